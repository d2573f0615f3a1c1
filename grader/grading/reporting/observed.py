"""Renders the summary of an observation, as text for people and as JSON for programs."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, fields, replace

from grader.grading.model.report import JsonObject, Pace, Summary, TopicSummary
from grader.grading.reporting.escape import json_value, shown
from grader.grading.reporting.graph import draw_graph
from grader.grading.reporting.json_report import start_values
from grader.runtime.model.quantities import counted, seconds
from grader.runtime.model.trace import ClockKind, Endpoint, Fault, LogRecord, Offer, OutputLine

SCHEMA = "grader/observation/v1"
#: Lines of one kind that the text shows; the rest are counted.
SHOWN_LINES = 12
SHOWN_FIELDS = 8
#: The different texts of a field that are shown, and the characters of each.
SHOWN_TEXTS, TEXT_LIMIT = 3, 60
#: Whole numbers below this are shown in full.
WHOLE = 1e15
WIDTH = 100


def render_summary(summary: Summary) -> str:
    """Return a summary as plain text."""
    return "\n".join(_lines(summary)) + "\n"


def _lines(summary: Summary) -> Iterator[str]:
    yield f"{', '.join(map(shown, summary.processes))}: {summary.duration_s:.1f} s on the {summary.clock.value} clock"
    if summary.clock_reason:
        virtual = summary.clock is ClockKind.VIRTUAL
        about = "virtual time does not suit what was observed" if virtual else "recorded on the wall clock"
        yield f"  note: {about}: {shown(summary.clock_reason)}"
    yield from (f"  note: {shown(note)}" for note in summary.notes)
    yield from _section("Nodes", map(shown, summary.nodes))
    yield from _section("Topics", (line for topic in summary.topics for line in _topic(topic)))
    offers = (f"{o.kind} {shown(o.name)} {_offered(o.kind, o.detail)}" for o in summary.offers)
    yield from _section("Services and parameters", offers)
    if summary.graph is not None and len(summary.graph.nodes) > 1:
        yield from _section("Graph", draw_graph(summary.graph, width=WIDTH))
    yield from _section("Log records", _cut(_record(r) for r in summary.records))
    yield from _section("Other output", _cut(map(_line, without_libraries(summary.lines))))
    # A program that ends on its own, in peace, has no fault unless a rubric says so.
    faults = list(_with_hints(summary))
    yield from _section("Ended", [line for fault, _ in faults if fault.exit_code == 0 for line in _fault(fault)])
    failed = [(fault, hint) for fault, hint in faults if fault.exit_code != 0]
    yield from _section("Faults", [line for fault, hint in failed for line in _fault(fault, hint)])
    yield f"isolation {shown(summary.isolation)}"


def _section(title: str, lines: Iterator[str] | Sequence[str]) -> Iterator[str]:
    body = list(lines)
    if body:
        yield f"{title}:"
        yield from (f"  {line}" for line in body)


def _offered(kind: str, detail: str) -> str:
    return f"= {shown(detail)}" if kind == "parameter" else f"[{shown(detail)}]"


def _topic(topic: TopicSummary) -> Iterator[str]:
    yield f"{shown(topic.name)} [{', '.join(map(shown, topic.types))}]"
    yield from (f"  published by {_end(e)}" for e in topic.publishers)
    yield from (f"  subscribed by {_end(e)}" for e in topic.subscriptions)
    if topic.publishers:
        yield f"  {_traffic(topic)}"
    fields = list(_contents(topic))
    yield from (f"  {line}" for line in fields[:SHOWN_FIELDS])
    if len(fields) > SHOWN_FIELDS:
        yield f"  and {counted(len(fields) - SHOWN_FIELDS, 'more field')} (--json shows them)"


def _contents(topic: TopicSummary) -> Iterator[str]:
    """Yield a line for each field: texts and booleans, then arrays and numbers, and last what is empty or always 0."""
    for name, (values, count) in topic.texts.items():
        if values != ("",):
            some = ", ".join(f'"{shown(value, limit=TEXT_LIMIT)}"' for value in values[:SHOWN_TEXTS])
            yield f"{shown(name)}: {some}{f' and {count - SHOWN_TEXTS} more' if count > SHOWN_TEXTS else ''}"
    for name, seen in topic.flags.items():
        if name.removesuffix("[]") not in topic.lengths:
            yield f"{shown(name)}: {_flags(seen)}"
    rest = {name: limits for name, limits in topic.ranges.items() if name.removesuffix("[]") not in topic.lengths}
    for empty in (False, True):
        for name, (least, most) in topic.lengths.items():
            if (most == 0) is empty:
                limits, flags = topic.ranges.get(f"{name}[]"), topic.flags.get(f"{name}[]")
                size = counted(most, "element") if least == most else f"{least} to {counted(most, 'element')}"
                held = _range(*limits) if limits else _flags(flags) if flags else ""
                yield f"{shown(name)}: {size}{f', {held}' if held else ''}"
        yield from (f"{shown(n)}: {_range(*limits)}" for n, limits in rest.items() if (limits == (0, 0)) is empty)


def _flags(values: Sequence[bool]) -> str:
    return ", ".join(str(value).lower() for value in values)


def _traffic(topic: TopicSummary) -> str:
    if topic.first_s is None:
        return "no message"
    text = f"{counted(topic.messages, 'message')}, the first at t = {topic.first_s:.3f} s"
    pace = topic.pace
    if pace is None:
        return text
    return (
        f"{text}; average rate: {pace.rate_hz:.3f} Hz, min: {pace.min_s:.3f} s, max: {pace.max_s:.3f} s, "
        f"std dev: {pace.std_dev_s:.5f} s"
    )


def _end(end: Endpoint) -> str:
    return f"{shown(end.node)} ({end.reliability.replace('_', ' ')}, {end.durability.replace('_', ' ')})"


def _range(low: float, high: float) -> str:
    return _number(low) if low == high else f"{_number(low)} to {_number(high)}"


def _number(value: float) -> str:
    """Format a number; whole ones in full, such as the seconds of a time."""
    return f"{value:.0f}" if value == int(value) and abs(value) < WHOLE else f"{value:g}"


def _cut(lines: Iterator[str]) -> list[str]:
    every = list(lines)
    if len(every) <= SHOWN_LINES:
        return every
    return [*every[:SHOWN_LINES], f"and {len(every) - SHOWN_LINES} more (--json shows them)"]


def _record(record: LogRecord) -> str:
    return f"t = {seconds(record.t_ns):.3f} s [{shown(record.severity)}] [{shown(record.logger)}]: {shown(record.text)}"


def _line(line: OutputLine) -> str:
    return f"t = {seconds(line.t_ns):.3f} s {line.stream}: {shown(line.text)}"


#: A frame in a traceback, as Python prints it. The files of a submission have relative paths.
_FRAME = re.compile(r'  File "(?P<file>[^"]+)", line \d+')


def without_libraries(lines: Sequence[OutputLine]) -> Iterator[OutputLine]:
    """Yield output; in tracebacks, one line stands for each row of calls in Python and ROS."""
    calls, skipping = 0, False
    for line in lines:
        frame = _FRAME.match(line.text) if line.stream == "stderr" else None
        if frame is not None and frame["file"].startswith(("/", "<frozen")):
            calls, skipping = calls + 1, True
            continue
        if skipping and frame is None and line.stream == "stderr" and line.text.startswith("    "):
            continue  # the source of the call, and marks below it
        if calls:
            yield replace(line, text=f"  ({counted(calls, 'call')} in Python and ROS)")
        calls, skipping = 0, False
        yield line


def _with_hints(summary: Summary) -> Iterator[tuple[Fault, str]]:
    """Yield each fault with its hint, which may be empty."""
    hints = (*summary.hints, *("" for _ in summary.faults[len(summary.hints) :]))
    yield from zip(summary.faults, hints, strict=True)


def _fault(fault: Fault, hint: str = "") -> Iterator[str]:
    place = f" ({shown(fault.file)}:{fault.line})" if fault.file else ""
    yield f"t = {seconds(fault.t_ns):.3f} s {shown(fault.process)}: {shown(fault.text)}{place}"
    yield from (f"  {shown(frame)}" for frame in fault.frames)
    if hint:
        yield f"  hint: {shown(hint)}"


def summary_to_json(summary: Summary) -> str:
    """Return a summary as JSON text; times are in seconds."""
    data: Mapping[str, object] = {
        "schema": SCHEMA,
        "processes": summary.processes,
        "starts": [start_values(start) for start in summary.starts],
        "clock": summary.clock,
        "clock_reason": summary.clock_reason or None,
        "duration_s": summary.duration_s,
        "isolation": summary.isolation,
        "nodes": summary.nodes,
        "topics": [_topic_json(topic) for topic in summary.topics],
        "offers": [_fields(offer) for offer in summary.offers],
        "records": [_timed(record) for record in summary.records],
        "lines": [_timed(line) for line in summary.lines],
        "faults": [
            {**_timed(fault, "exit_code", "signal", "python"), "hint": hint or None}
            for fault, hint in _with_hints(summary)
        ],
        "notes": summary.notes,
    }
    return json.dumps(json_value(data), indent=2, allow_nan=False) + "\n"


def _timed(observation: LogRecord | OutputLine | Fault, *left_out: str) -> Mapping[str, object]:
    return {"t_s": seconds(observation.t_ns), **_fields(observation, *left_out)}


def _fields(observation: LogRecord | OutputLine | Fault | Offer, *left_out: str) -> Mapping[str, object]:
    """Return the fields of an observation without its time."""
    return {name: value for name, value in asdict(observation).items() if name not in ("t_ns", *left_out)}


def _topic_json(topic: TopicSummary) -> Mapping[str, object]:
    pace = asdict(topic.pace) if topic.pace else dict.fromkeys(field.name for field in fields(Pace))
    return {
        "name": topic.name,
        "types": topic.types,
        "publishers": [_end_json(e) for e in topic.publishers],
        "subscriptions": [_end_json(e) for e in topic.subscriptions],
        "messages": topic.messages,
        "first_s": topic.first_s,
        **pace,
        "ranges": topic.ranges,
        "texts": {name: {"values": values, "different": count} for name, (values, count) in topic.texts.items()},
        "lengths": topic.lengths,
        "flags": topic.flags,
    }


def _end_json(end: Endpoint) -> JsonObject:
    return {"node": end.node, "type": end.type, "reliability": end.reliability, "durability": end.durability}
