"""Makes the figures of an exercise: charts of its checks, the graph, recordings to play, and lines of the source."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from grader.core.chart import (
    Chart,
    Excerpt,
    Figure,
    GraphFigure,
    Level,
    Look,
    Moment,
    Panel,
    Playback,
    Point,
    Series,
    SourceFile,
    Stage,
    Tone,
)
from grader.core.exercise import Check, Criterion, Exercise, Location
from grader.core.quantities import seconds
from grader.core.report import ExerciseReport
from grader.core.scenario import Scenario
from grader.core.submission import Submission
from grader.core.trace import GraphSnapshot, LogRecord, OutputLine, Request, Response, Trace
from grader.judging.findings import fault_sentence
from grader.judging.output import printed_lines
from grader.judging.recorded_values import recorded_values
from grader.judging.texts import clean
from grader.judging.values import Reading, on_student_topic
from grader.judging.wording import counted, number, quote, unit_of

#: Maximum number of points of a series: a screen shows no more, and a flood must not enlarge the report.
MOST_POINTS = 1200
#: Maximum number of points with a text.
MOST_TEXTS = 400
_TEXT_LENGTH = 160


def illustrated(
    report: ExerciseReport,
    exercise: Exercise,
    traces: Mapping[str, Trace],
    submission: Submission,
    sources: Mapping[str, str],
) -> ExerciseReport:
    """Return the report with figures, the source, the lines of it that matter, and the expected results."""
    files = {name: submission.files[name] for name in exercise.files if name in submission.files}
    return replace(
        report,
        figures=figures_of(exercise, traces),
        excerpts=excerpts_for(report, submission, sources),
        sources=tuple(_whole(f.found, sources[name]) for name, f in files.items() if f.found and name in sources),
        expected={c.id: phrase for c in exercise.criteria if (phrase := expectation(c.check))},
    )


def expectation(check: Check) -> str:
    """Return the phrase for a check's expectation, without a full stop; empty if it has none."""
    own = getattr(check, "expected", "")
    return own if isinstance(own, str) else ""


def figures_of(exercise: Exercise, traces: Mapping[str, Trace]) -> tuple[Figure, ...]:
    """Return the charts of an exercise in rubric order, the graph if a criterion shows it, then each recording."""
    drawn = [chart for c in exercise.criteria for chart in _drawn(c, traces)]
    figures: list[Figure] = list(_merged(drawn))
    graph = graph_figure(exercise, traces)
    graphs = tuple(c.id for c in exercise.criteria if getattr(c.check, "shows_graph", False))
    if graph is not None and graphs:
        figures.append(replace(graph, criteria=graphs))
    figures += _playbacks(exercise, traces)
    return tuple(replace(f, id=f"{exercise.id}-{number}") for number, f in enumerate(figures, 1))


def _drawn(criterion: Criterion, traces: Mapping[str, Trace]) -> Iterable[Chart]:
    maker, trace = getattr(criterion.check, "chart", None), traces.get(criterion.scenario)
    try:
        chart = maker(trace) if callable(maker) and trace else None
    except Exception:  # a failing chart must not cost the report
        chart = None
    if isinstance(chart, Chart):
        yield replace(chart, scenario=criterion.scenario, criteria=(criterion.id,))


def _merged(charts: Iterable[Chart]) -> Iterable[Chart]:
    """Merge charts that show the same: two criteria about the same data share one chart."""
    merged: dict[tuple[str, str, tuple[Panel, ...]], Chart] = {}
    for chart in charts:
        key = (chart.scenario, chart.id, chart.panels)
        other = merged.get(key, chart)
        criteria = tuple(dict.fromkeys((*other.criteria, *chart.criteria)))
        merged[key] = replace(other, criteria=criteria)
    return merged.values()


def _playbacks(exercise: Exercise, traces: Mapping[str, Trace]) -> Iterable[Playback]:
    recorded = [s for s in exercise.scenarios if s.id in traces]
    for scenario in recorded:
        trace = traces[scenario.id]
        timeline = replace(timeline_chart(trace, scenario.processes), scenario=scenario.id)
        graphs = _changes(trace)
        connected = f" {_said(graphs[-1][1])}." if graphs and graphs[-1][1].nodes else ""
        title = f"The run: {scenario.id.replace('_', ' ')}" if len(recorded) > 1 else "The run"
        yield Playback(
            id="run",
            title=title,
            about=f"{timeline.about}{connected}",
            criteria=(),
            timeline=timeline,
            topics=recorded_values(trace),
            graphs=graphs,
        )


#: Maximum number of changes of the graph that can be played.
_MOST_CHANGES = 40


def _changes(trace: Trace) -> tuple[tuple[float, GraphSnapshot], ...]:
    """Return the student's own graph from each moment at which it changed, in seconds."""
    last: dict[float, GraphSnapshot] = {}
    for graph in trace.graphs():
        if graph.t_ns <= trace.stop_ns:
            last[seconds(graph.t_ns)] = _own(graph)
    times = list(last)
    changed = [t for k, t in enumerate(times) if k == 0 or last[t] != last[times[k - 1]]]
    stride = -(-len(changed) // _MOST_CHANGES) or 1
    return tuple((t, last[t]) for t in dict.fromkeys((*changed[::stride], *changed[-1:])))


#: Lines shown before and after the referenced one.
AROUND = 3
#: Longest line shown, in characters; a source line may be a megabyte long.
_LONGEST_LINE = 400
#: Maximum number of lines of a file that are shown.
_MOST_LINES = 1000
_TAB = 4


def excerpts_for(report: ExerciseReport, submission: Submission, sources: Mapping[str, str]) -> tuple[Excerpt, ...]:
    """Return the source around each place that a verdict or a fault names, without duplicates."""
    places = [v.location for v in report.verdicts if v.location is not None]
    places += [Location(f.file, f.line) for f in report.faults if f.file and f.line > 0]
    texts = {file.found: sources[wanted] for wanted, file in submission.files.items() if wanted in sources}
    lines = {name: text.splitlines() for name, text in texts.items() if any(p.file == name for p in places)}
    found = (_excerpt(place, lines.get(place.file, [])) for place in dict.fromkeys(places))
    return tuple(excerpt for excerpt in found if excerpt is not None)


def _excerpt(place: Location, lines: list[str]) -> Excerpt | None:
    if not 1 <= place.line <= len(lines):
        return None
    first = max(1, place.line - AROUND)
    return Excerpt(place.file, place.line, first, _showable(lines[first - 1 : place.line + AROUND]))


def _whole(name: str, text: str) -> SourceFile:
    lines = text.splitlines()
    return SourceFile(name, _showable(lines[:_MOST_LINES]), max(0, len(lines) - _MOST_LINES))


def _showable(lines: Sequence[str]) -> tuple[str, ...]:
    return tuple(line[:_LONGEST_LINE].expandtabs(_TAB) for line in lines)


def graph_figure(exercise: Exercise, traces: Mapping[str, Trace]) -> GraphFigure | None:
    """Return the graph in every situation with new information, or None if no node ever appeared."""
    stages = [stage for s in exercise.scenarios if s.id in traces for stage in _stages(s, exercise, traces[s.id])]
    told: dict[tuple[object, ...], Stage] = {}
    for stage in stages:
        told.setdefault((stage.graph.nodes, stage.graph.endpoints, stage.graph.services), stage)
    distinct = [stage for stage in told.values() if stage.graph.nodes]
    if not distinct:
        return None
    about = " ".join(f"{stage.title.capitalize()}: {_said(stage.graph)}." for stage in distinct)
    return GraphFigure("graph", "The live ROS graph", about, (), tuple(distinct))


def _stages(scenario: Scenario, exercise: Exercise, trace: Trace) -> list[Stage]:
    graphs = [_own(g) for g in trace.graphs() if g.t_ns <= trace.stop_ns]
    if not graphs:
        return []
    if len(exercise.scenarios) > 1:
        return [Stage(scenario.id.replace("_", " "), max(reversed(graphs), key=_size))]
    if graphs[0] == graphs[-1]:
        return [Stage("from the start to the end", graphs[0])]
    return [Stage("at the start", graphs[0]), Stage("at the end", graphs[-1])]


def _own(graph: GraphSnapshot) -> GraphSnapshot:
    """Return the graph of the student's own endpoints, without a time."""
    return replace(graph, t_ns=0, endpoints=tuple(e for e in graph.endpoints if on_student_topic(e)))


def _size(graph: GraphSnapshot) -> int:
    return len(graph.endpoints) + len(graph.services)


def _said(graph: GraphSnapshot) -> str:
    publishers = [e for e in graph.endpoints if e.kind == "publisher"]
    parts = []
    for publisher in publishers:
        takers = [e for e in graph.endpoints if e.kind == "subscription" and e.topic == publisher.topic]
        parts += [f"{publisher.node} publishes {publisher.topic} to {t.node}" for t in takers]
        parts += [] if takers else [f"{publisher.node} publishes {publisher.topic}"]
    served = {p.topic for p in publishers}
    unserved = [e for e in graph.endpoints if e.kind == "subscription" and e.topic not in served]
    parts += [f"{e.node} subscribes to {e.topic}" for e in unserved]
    visible = [e for e in graph.services if "/_" not in e.service]
    parts += [f"{e.node} {'serves' if e.kind == 'service' else 'calls'} {e.service}" for e in visible]
    return ", ".join(dict.fromkeys(parts)) or f"{counted(len(graph.nodes), 'node')} without topics"


#: Number of lanes for services; a node's parameters and an action need several.
MOST_SERVICES = 6
_TONES = {"DEBUG": Tone.FAINT, "INFO": Tone.MAIN, "WARN": Tone.WARNING, "ERROR": Tone.BAD, "FATAL": Tone.BAD}


def timeline_chart(trace: Trace, processes: Sequence[str]) -> Chart:
    """Return the timeline of a scenario; it exists even for a silent node."""
    lanes: list[str] = []
    rows: list[Series] = []
    for process in processes:
        _logs(trace, process, lanes, rows)
        _prints(trace, process, lanes, rows)
    _exchanges(trace, lanes, rows)
    _faults(trace, lanes, rows)
    moments = [*_marked(trace, *_SAID_OF_MARKS), Moment(seconds(trace.stop_ns), "end")]
    panel = Panel("", "", tuple(rows), lanes=tuple(lanes))
    chart = time_chart(trace, "timeline", "Logs and faults over time", _about(trace, processes), panel)
    return replace(chart, moments=tuple(moments))


#: Name of a mark -> what follows its detail in charts.
_SAID_OF_MARKS = {
    "stream_starts": " begins",
    "stream_stops": " ends",
    "server_starts": ": server appears",
    "server_stops": ": server disappears",
    "process_starts": " starts",
    "exited": " ends",
}


def _marked(trace: Trace, *names: str) -> list[Moment]:
    return [Moment(seconds(m.t_ns), f"{m.detail}{_SAID_OF_MARKS[n]}") for n in names for m in trace.marks(n)]


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
    """Add a lane for each called service, with its requests and responses."""
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
    events = [(seconds(f.t_ns), fault_sentence(f)) for f in faults] + [(seconds(m.t_ns), m.detail) for m in limits]
    points = [(t, float(len(lanes) - 1)) for t, _ in events]
    rows.append(series("fault", points, look=Look.DOTS, tone=Tone.BAD, texts=[text for _, text in events]))


def _about(trace: Trace, processes: Sequence[str]) -> str:
    parts = []
    for process in processes:
        records = [r for r in trace.records(process) if r.t_ns <= trace.stop_ns]
        about = f"{process}: {counted(len(records), 'log record')}"
        lines = printed_lines(trace, process)
        parts.append(f"{about}, {counted(len(lines), 'printed line')}" if lines else about)
    faults = [quote(fault_sentence(f)) for f in trace.faults() if f.t_ns <= trace.stop_ns]
    parts.append(f"faults: {'; '.join(faults[:3])}" if faults else "no fault")
    return f"{'; '.join(parts)}; observed for {seconds(trace.stop_ns):.1f} s."


def series(  # noqa: PLR0913  what a series consists of
    name: str,
    points: Sequence[Point],
    *,
    look: Look = Look.LINE,
    tone: Tone = Tone.MAIN,
    texts: Sequence[str] = (),
    most: int = MOST_POINTS,
) -> Series:
    """Return a series reduced to a visible number of points; the extremes of each stretch stay."""
    most = min(most, MOST_TEXTS) if texts else most
    kept = kept_indices([y for _, y in points], most)
    labels = tuple(quote(texts[k], _TEXT_LENGTH) for k in kept) if texts else ()
    return Series(name, tuple(points[k] for k in kept), look, tone, labels)


def kept_indices(values: Sequence[float], most: int) -> list[int]:
    """Return about `most` indices of values, including the first, the last and the extremes of each stretch."""
    if len(values) <= most:
        return list(range(len(values)))
    stretch = -(-2 * len(values) // most)
    kept = {0, len(values) - 1}
    for start in range(0, len(values), stretch):
        part = range(start, min(start + stretch, len(values)))
        kept |= {min(part, key=values.__getitem__), max(part, key=values.__getitem__)}
    return sorted(kept)


def written_in_lane(name: str, items: Sequence[LogRecord | OutputLine], lane: int, tone: Tone) -> Series:
    """Return output as dots in a lane of its own, each with its text."""
    points = [(seconds(o.t_ns), float(lane)) for o in items]
    return series(name, points, look=Look.DOTS, tone=tone, texts=[clean(o.text) for o in items])


def plain_topic(topic: str) -> str:
    """Return a topic's name as a title: `/fan_speed` becomes `fan speed`."""
    return quote(topic.strip("/").replace("/", " ").replace("_", " "), 40) or topic


#: Maximum number of faults that a chart shows.
_MOST_FAULTS = 5


def time_chart(trace: Trace, id_: str, title: str, about: str, *panels: Panel) -> Chart:
    """Return a chart over time, with the faults of a trace and the ends of its streams."""
    moments = _marked(trace, "stream_starts", "stream_stops")
    faults = [f for f in trace.faults() if f.t_ns <= trace.stop_ns]
    moments += [Moment(seconds(f.t_ns), f.kind.value.replace("_", " "), Tone.BAD) for f in faults[:_MOST_FAULTS]]
    return Chart(id_, title, about, (), "time", "s", panels, tuple(moments), until_s=seconds(trace.stop_ns))


def input_panel(topic: str, values: Sequence[Reading], threshold: float, look: Look) -> Panel:
    """Return a panel with the inputs of a controller and its threshold."""
    level = Level(threshold, f"{number(threshold)}{unit_of(topic)}", name="threshold")
    name = plain_topic(topic)
    return Panel(name, unit_of(topic).strip(), (series(name, points_of(values), look=look),), levels=(level,))


def answer_panel(topic: str, answers: Sequence[Reading], expected: Sequence[Reading]) -> Panel:
    """Return a panel with a controller's answers and the expected ones."""
    name = plain_topic(topic)
    wanted = series("expected", points_of(expected), look=Look.STEP, tone=Tone.FAINT)
    dots = series(name, points_of(answers), look=Look.STEP, tone=Tone.SECOND)
    return Panel(name, unit_of(topic).strip(), (wanted, dots))


def which_answers(answers: Sequence[Reading]) -> str:
    """Return which answers occur, for text."""
    values = sorted({r.value for r in answers})
    if not values:
        return ""
    listed = ", ".join(number(v) for v in values[:5]) + (" and others" if len(values) > 5 else "")
    return f", all of them {listed}" if len(values) == 1 else f" ({listed})"


def points_of(values: Sequence[Reading]) -> list[Point]:
    """Return numbers as points over time, in seconds."""
    return [(seconds(r.t_ns), r.value) for r in values]
