"""Makes the figures of an exercise: charts of its checks, the graph, recordings to play, and lines of the source."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import replace
from itertools import islice
from typing import Any

import msgspec

from grader.grading.judging.authored import is_authored, mistake_of
from grader.grading.judging.charts import Lanes, marked_moments, time_chart
from grader.grading.judging.findings import fault_sentence
from grader.grading.judging.logs.outputs import printed_lines
from grader.grading.judging.plots import chart_of, shows_graph
from grader.grading.judging.proportion import measure_panel
from grader.grading.judging.recorded_values import recorded_values
from grader.grading.judging.values import on_student_topic
from grader.grading.model.chart import (
    Chart,
    Excerpt,
    Figure,
    GraphFigure,
    Look,
    Panel,
    Playback,
    Series,
    SourceFile,
    Stage,
    Tone,
    VerticalLine,
)
from grader.grading.model.exercise import Criterion, Exercise, Location, ask, has_member, measure_of, reads_sources
from grader.grading.model.report import ExerciseReport, Verdict
from grader.grading.model.wording import quote
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.quantities import counted, seconds
from grader.runtime.model.scenario import Scenario
from grader.runtime.model.submission import Submission
from grader.runtime.model.trace import Endpoint, GraphSnapshot, Request, Response, ServiceEnd, Trace, offered_as
from grader.runtime.model.worlds import Sketch


def illustrated(
    report: ExerciseReport,
    exercise: Exercise,
    traces: Mapping[str, Trace],
    submission: Submission,
    sources: Mapping[str, str],
) -> ExerciseReport:
    """Return the report with figures, the source, the lines of it that matter, and the expected results."""
    files = {name: submission.files[name] for name in exercise.files if name in submission.files}
    mistakes: list[AuthorMistake] = []
    return replace(
        report,
        figures=figures_of(on_recordings(exercise, report.verdicts), traces, mistakes, sources),
        excerpts=excerpts_for(report, submission, sources),
        sources=tuple(_whole(f.found, sources[name]) for name, f in files.items() if f.found and name in sources),
        expected={c.id: phrase for c in exercise.criteria if (phrase := expectation(c, mistakes))},
        notes=(*report.notes, *(f"the rubric has a mistake: {mistake}" for mistake in dict.fromkeys(mistakes))),
    )


def on_recordings(exercise: Exercise, verdicts: Sequence[Verdict]) -> Exercise:
    """Return the exercise with each criterion on the recording that decided it, if there are several."""
    decided = {verdict.id: verdict.recording for verdict in verdicts if verdict.recording}
    if not decided:
        return exercise
    criteria = (replace(c, scenario=decided.get(c.id, c.scenario)) for c in exercise.criteria)
    return replace(exercise, criteria=tuple(criteria), draws={})


def expectation(criterion: Criterion, mistakes: list[AuthorMistake]) -> str:
    """Return the phrase for what a check expects, without a full stop; empty if it has none.

    A mistake in a check of an author's is appended to `mistakes`.
    """
    check: Any = criterion.check
    try:
        own = check.expected if has_member(check, "expected") else ""
    except Exception as error:
        if not is_authored(check):
            raise
        mistakes.append(mistake_of(check, error))
        return ""
    return own if isinstance(own, str) else ""


def figures_of(
    exercise: Exercise,
    traces: Mapping[str, Trace],
    mistakes: list[AuthorMistake] | None = None,
    sources: Mapping[str, str] | None = None,
) -> tuple[Figure, ...]:
    """Return the charts of an exercise in rubric order, the graph if a criterion shows it, then each recording.

    Mistakes in the charts of an author's checks are appended to `mistakes`.
    """
    noted: list[AuthorMistake] = [] if mistakes is None else mistakes
    drawn = [chart for c in exercise.criteria for chart in _drawn(c, traces, noted, sources)]
    figures: list[Figure] = list(_merged(drawn))
    graph = graph_figure(exercise, traces)
    graphs = tuple(c.id for c in exercise.criteria if shows_graph(c.check))
    if graph is not None and graphs:
        figures.append(replace(graph, criteria=graphs))
    told = {id_ for figure in figures for id_ in figure.criteria}
    figures += _pictures(exercise, traces)
    figures += _playbacks(exercise, traces, told)
    return tuple(replace(f, id=f"{exercise.id}-{number}") for number, f in enumerate(figures, 1))


def _drawn(
    criterion: Criterion,
    traces: Mapping[str, Trace],
    mistakes: list[AuthorMistake],
    sources: Mapping[str, str] | None,
) -> Iterable[Chart]:
    trace = traces.get(criterion.scenario)
    if trace is None:
        return
    try:
        chart = chart_of(criterion.check, trace)
        if chart is not None and is_authored(criterion.check):
            chart = msgspec.convert(msgspec.to_builtins(chart), Chart)  # raises for values of a wrong type
    except Exception as error:  # a failing chart must not cost the report
        chart = None
        if is_authored(criterion.check):
            mistakes.append(mistake_of(criterion.check, error))
    chart = _with_measure(chart, criterion, trace, sources)
    if isinstance(chart, Chart):
        yield replace(chart, scenario=criterion.scenario, criteria=(criterion.id,))


def _with_measure(
    chart: Chart | None, criterion: Criterion, trace: Trace, sources: Mapping[str, str] | None
) -> Chart | None:
    """Return the chart with a panel of what the check measured, if the rubric gives a share of the points for it."""
    measure, scale = measure_of(criterion.check), criterion.scale
    if measure is None or scale is None or not (chart is None or chart.until_s is not None):
        return chart
    try:
        panel = measure_panel(measure, scale, ask(criterion.check, trace, sources))
    except Exception:  # judging has reported why the check fails
        return chart
    if panel is None:
        return chart
    if chart is None:
        title = f"{measure.name[:1].upper()}{measure.name[1:]}"
        return time_chart(trace, f"measure {criterion.id}", title, f"{title}, with its limits.", panel)
    return replace(chart, panels=(*chart.panels, panel))


def _merged(charts: Iterable[Chart]) -> Iterable[Chart]:
    """Merge charts of which one shows all that the other does: criteria about the same data share one chart."""
    kept: list[Chart] = []
    for chart in charts:
        place = next((k for k, one in enumerate(kept) if _holds(one, chart) or _holds(chart, one)), None)
        if place is None:
            kept.append(chart)
        else:
            other = kept[place]
            fuller = other if _holds(other, chart) else chart
            rest = chart if fuller is other else other
            # the first of its criteria is the one that the chart was drawn for
            kept[place] = replace(fuller, criteria=tuple(dict.fromkeys((*fuller.criteria, *rest.criteria))))
    return kept


def _holds(chart: Chart, other: Chart) -> bool:
    """Return whether a chart shows the same recording as another, all its panels and cases, and perhaps more."""
    if chart.scenario != other.scenario or chart.square != other.square or not set(other.cases) <= set(chart.cases):
        return False
    return all(any(_covers(panel, asked) for panel in chart.panels) for asked in other.panels)


def _covers(panel: Panel, other: Panel) -> bool:
    alike = (panel.title, panel.unit, panel.lanes, panel.grid) == (other.title, other.unit, other.lanes, other.grid)
    parts = ((panel.series, other.series), (panel.bands, other.bands), (panel.levels, other.levels))
    return alike and all(all(part in mine for part in theirs) for mine, theirs in parts)


def _pictures(exercise: Exercise, traces: Mapping[str, Trace]) -> Iterable[Chart]:
    """Yield what the simulations of each recording have drawn, for the criteria about that recording."""
    recorded = [s.id for s in exercise.scenarios if s.id in traces]
    for id_ in recorded:
        criteria = tuple(c.id for c in exercise.criteria if c.scenario == id_)
        if traces[id_].drawn and criteria:
            title = f"Seen from above: {id_.replace('_', ' ')}" if len(recorded) > 1 else "Seen from above"
            yield replace(picture_of(traces[id_].drawn, title), scenario=id_, criteria=criteria)


def picture_of(drawn: Sequence[Sketch], title: str) -> Chart:
    """Return what simulations have drawn as a chart with the same scale on both axes.

    Args:
        drawn: Each thing with its lines.
        title: Title of the chart.
    """
    rows = []
    for sketch in drawn:
        points = [point for line in sketch.lines for point in (*line, (math.nan, math.nan))][:-1]
        look = Look.DOTS if sketch.dots else Look.LINE
        shown = [point for point in points if not (sketch.dots and math.isnan(point[0]))]
        rows.append(Series(sketch.name, tuple(shown), look, Tone(sketch.tone)))
    said = ", ".join(f"{sketch.name}: {counted(sum(map(len, sketch.lines)), 'point')}" for sketch in drawn)
    return Chart("picture", title, f"{said}.", (), "x", "m", (Panel("y", "m", tuple(rows)),), square=True)


def _playbacks(exercise: Exercise, traces: Mapping[str, Trace], told: Set[str]) -> Iterable[Playback]:
    """Return each recording, with the criteria about it that no other figure shows."""
    recorded = [s for s in exercise.scenarios if s.id in traces]
    for scenario in recorded:
        title = f"The run: {scenario.id.replace('_', ' ')}" if len(recorded) > 1 else "The run"
        criteria = tuple(c.id for c in exercise.criteria if c.scenario == scenario.id and _is_recorded(c, told))
        yield playback(traces[scenario.id], scenario.id, scenario.processes, title, criteria)


def playback(  # noqa: PLR0913  what a recording to play consists of
    trace: Trace,
    scenario: str,
    processes: Sequence[str],
    title: str = "The run",
    criteria: tuple[str, ...] = (),
    *,
    lanes: Lanes | None = None,
    beside: Sequence[tuple[int, Endpoint | ServiceEnd]] = (),
) -> Playback:
    """Return a recording to play.

    Args:
        trace: The recording.
        scenario: Id of its scenario.
        processes: Names of its processes.
        title: Title of the figure.
        criteria: The criteria that are shown with it.
        lanes: Rows that stand above those of the processes, and what both sides of a call are named.
        beside: What stands in the graph beside the programs, each with the time from which on, in nanoseconds.
    """
    timeline = replace(timeline_chart(trace, processes, lanes), scenario=scenario)
    graphs = _changes(trace, beside)
    connected = f" {_said(graphs[-1][1])}." if graphs and graphs[-1][1].nodes else ""
    return Playback(
        id="run",
        title=title,
        about=f"{timeline.about}{connected}",
        criteria=criteria,
        timeline=timeline,
        topics=recorded_values(trace),
        graphs=graphs,
    )


def _is_recorded(criterion: Criterion, told: Set[str]) -> bool:
    return criterion.id not in told and not reads_sources(criterion.check)


#: Maximum number of changes of the graph that can be played.
_MOST_CHANGES = 40


def _changes(
    trace: Trace, beside: Sequence[tuple[int, Endpoint | ServiceEnd]] = ()
) -> tuple[tuple[float, GraphSnapshot], ...]:
    """Return the student's own graph, and what stands beside it, from each moment of a change, in seconds."""
    own = {graph.t_ns: _own(graph) for graph in trace.graphs()}
    last: dict[float, GraphSnapshot] = {}
    graph = GraphSnapshot(0, (), ())
    for t_ns in sorted({*own, *(since_ns for since_ns, _ in beside)}):
        graph = own.get(t_ns, graph)
        if t_ns <= trace.stop_ns:
            last[seconds(t_ns)] = _with(graph, [end for since_ns, end in beside if since_ns <= t_ns])
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
    found = (excerpt_around(place, lines.get(place.file, [])) for place in dict.fromkeys(places))
    return tuple(excerpt for excerpt in found if excerpt is not None)


def excerpt_around(place: Location, lines: list[str]) -> Excerpt | None:
    """Return the source around a place; None if it is not in these lines of its file."""
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


def _with(graph: GraphSnapshot, ends: Sequence[Endpoint | ServiceEnd]) -> GraphSnapshot:
    """Return a graph with further ends."""
    topics = tuple(end for end in ends if isinstance(end, Endpoint))
    services = tuple(end for end in ends if isinstance(end, ServiceEnd))
    return replace(graph, endpoints=(*graph.endpoints, *topics), services=(*graph.services, *services))


def _size(graph: GraphSnapshot) -> int:
    return len(graph.endpoints) + len(graph.services)


def _said(graph: GraphSnapshot) -> str:
    """Return in words what the picture of a graph shows, which leaves out the topics of actions."""
    graph = replace(graph, endpoints=tuple(e for e in graph.endpoints if "/_" not in e.topic))
    publishers = graph.ends_of_topics("publisher")
    parts = []
    for publisher in publishers:
        takers = graph.ends_of_topics("subscription", publisher.topic)
        parts += [f"{publisher.node} publishes {publisher.topic} to {t.node}" for t in takers]
        parts += [] if takers else [f"{publisher.node} publishes {publisher.topic}"]
    served = {p.topic for p in publishers}
    unserved = [e for e in graph.ends_of_topics("subscription") if e.topic not in served]
    parts += [f"{e.node} subscribes to {e.topic}" for e in unserved]
    offered = [(e, name) for e in graph.services for kind, name in [offered_as(e.service) or ("", "")] if kind]
    parts += [f"{e.node} {'serves' if e.kind == 'service' else 'calls'} {name}" for e, name in offered]
    return ", ".join(dict.fromkeys(parts)) or f"{counted(len(graph.nodes), 'node')} without topics"


#: Number of lanes for services and actions; a node's parameters need several.
MOST_SERVICES = 6


def timeline_chart(trace: Trace, processes: Sequence[str], lanes: Lanes | None = None) -> Chart:
    """Return the timeline of a scenario, below the rows that are given; it exists even for a silent node."""
    lanes = lanes or Lanes()
    for process in processes:
        lanes.logs(trace, process)
    sent: list[Request | Response] = [*trace.of(Request), *trace.of(Response)]
    exchanges = [o for o in sent if o.t_ns <= trace.stop_ns]
    rows: dict[str, list[Request | Response]] = {}
    for exchange in exchanges:
        rows.setdefault(exchange.service.partition("/_action/")[0], []).append(exchange)
    for name, found in islice(rows.items(), MOST_SERVICES):
        lanes.add(f"{name}: called")
        lanes.exchanges(found)
    faults = [(f.t_ns, fault_sentence(f)) for f in trace.faults() if f.t_ns <= trace.stop_ns]
    faults += [(m.t_ns, m.detail) for m in trace.marks("limit")]
    if faults:
        lanes.add("faults")
        lanes.dots("fault", faults, Tone.BAD)
    about = _about(trace, processes)
    chart = time_chart(trace, "timeline", "Logs and faults over time", about, lanes.panel())
    return replace(chart, moments=(*marked_moments(trace), VerticalLine(seconds(trace.stop_ns), "end")))


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
