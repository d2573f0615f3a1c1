"""Draws what happened in a scenario: log records, printed lines, faults, limits and streams, each in its row."""

from __future__ import annotations

from collections.abc import Sequence

from grader.core.chart import Chart, Look, Moment, Panel, Series, Tone
from grader.core.quantities import seconds
from grader.core.trace import Request, Response, Trace
from grader.judging.figures.drawing import series, written_in_lane
from grader.judging.output import printed_lines
from grader.judging.wording import counted, fault_sentence, quote

#: Lanes for services; a node's parameters and an action are several.
MOST_SERVICES = 6
_TONES = {"DEBUG": Tone.FAINT, "INFO": Tone.MAIN, "WARN": Tone.WARNING, "ERROR": Tone.BAD, "FATAL": Tone.BAD}


def timeline_chart(trace: Trace, processes: Sequence[str]) -> Chart:
    """Return the picture of a scenario; there is always one, a silent node included."""
    lanes: list[str] = []
    rows: list[Series] = []
    for process in processes:
        _logs(trace, process, lanes, rows)
        _prints(trace, process, lanes, rows)
    _exchanges(trace, lanes, rows)
    _faults(trace, lanes, rows)
    moments = [Moment(seconds(m.t_ns), f"{m.detail} begins") for m in trace.marks("stream_starts")]
    moments += [Moment(seconds(m.t_ns), f"{m.detail} ends") for m in trace.marks("stream_stops")]
    moments += [Moment(seconds(m.t_ns), f"{m.detail}: server appears") for m in trace.marks("server_starts")]
    moments += [Moment(seconds(m.t_ns), f"{m.detail}: server disappears") for m in trace.marks("server_stops")]
    moments += [Moment(seconds(m.t_ns), f"{m.detail} starts") for m in trace.marks("process_starts")]
    moments += [Moment(seconds(m.t_ns), f"{m.detail} ends") for m in trace.marks("exited")]
    moments += [Moment(seconds(trace.stop_ns), "end")]
    return Chart(
        id="timeline",
        title="Logs and faults over time",
        about=_about(trace, processes),
        criteria=(),
        x_title="time",
        x_unit="s",
        panels=(Panel("", "", tuple(rows), lanes=tuple(lanes)),),
        moments=tuple(moments),
    )


def _logs(trace: Trace, process: str, lanes: list[str], rows: list[Series]) -> None:
    records = [r for r in trace.records(process) if r.t_ns <= trace.stop_ns]
    lanes.append(f"{process}: logged")
    for severity, tone in _TONES.items():
        some = [r for r in records if r.severity == severity]
        if some:
            rows.append(written_in_lane(severity, some, len(lanes) - 1, tone))


def _prints(trace: Trace, process: str, lanes: list[str], rows: list[Series]) -> None:
    lines = printed_lines(trace, process)
    if lines:
        lanes.append(f"{process}: printed")
        rows.append(written_in_lane("printed", lines, len(lanes) - 1, Tone.SECOND))


def _exchanges(trace: Trace, lanes: list[str], rows: list[Series]) -> None:
    """Add a lane for each service that was called: its requests and responses, with what they say."""
    sent: list[Request | Response] = [*trace.of(Request), *trace.of(Response)]
    exchanges = [o for o in sent if o.t_ns <= trace.stop_ns]
    for service in list(dict.fromkeys(o.service for o in exchanges))[:MOST_SERVICES]:
        lanes.append(f"{service}: called")
        for name, kind, tone in (("request", Request, Tone.SECOND), ("response", Response, Tone.MAIN)):
            some = [o for o in exchanges if isinstance(o, kind) and o.service == service]
            points = [(seconds(o.t_ns), float(len(lanes) - 1)) for o in some]
            texts = [f"{name} {o.number} of the {o.sender}: {dict(o.value)}" for o in some]
            if some:
                rows.append(series(name, points, look=Look.DOTS, tone=tone, texts=texts))


def _faults(trace: Trace, lanes: list[str], rows: list[Series]) -> None:
    faults = [f for f in trace.faults() if f.t_ns <= trace.stop_ns]
    limits = trace.marks("limit")
    if not faults and not limits:
        return
    lanes.append("faults")
    said = [(seconds(f.t_ns), fault_sentence(f)) for f in faults] + [(seconds(m.t_ns), m.detail) for m in limits]
    points = [(t, float(len(lanes) - 1)) for t, _ in said]
    rows.append(series("fault", points, look=Look.DOTS, tone=Tone.BAD, texts=[text for _, text in said]))


def _about(trace: Trace, processes: Sequence[str]) -> str:
    parts = []
    for process in processes:
        records = [r for r in trace.records(process) if r.t_ns <= trace.stop_ns]
        said = f"{process}: {counted(len(records), 'log record')}"
        lines = printed_lines(trace, process)
        parts.append(f"{said}, {counted(len(lines), 'printed line')}" if lines else said)
    faults = [quote(fault_sentence(f)) for f in trace.faults() if f.t_ns <= trace.stop_ns]
    parts.append(f"faults: {'; '.join(faults[:3])}" if faults else "no fault")
    return f"{'; '.join(parts)}; observed for {seconds(trace.stop_ns):.1f} s."
