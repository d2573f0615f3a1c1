"""Renders the report as one HTML page, from a template that escapes everything."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cache
from itertools import islice
from typing import Any, TypeVar

from jinja2 import Environment
from markupsafe import Markup

from grader.grading.model.chart import (
    Chart,
    Excerpt,
    Figure,
    GraphFigure,
    Panel,
    Playback,
    Series,
    ShownStep,
    Stage,
    TopicValues,
)
from grader.grading.model.exercise import Audience, Location, Outcome, exercise_name
from grader.grading.model.report import ExerciseReport, JsonObject, JsonValue, Report, ReportedFault, Verdict
from grader.grading.reporting import wording
from grader.grading.reporting.escape import script_json, shown
from grader.grading.reporting.graph import call_edges, graph_edges
from grader.grading.reporting.html.assets import bundle, page_environment
from grader.grading.reporting.html.final_mark import (
    CriterionMark,
    ScoreShown,
    decision_place,
    earned_place,
    points_place,
    score_place,
)
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import ClockKind, Endpoint, GraphSnapshot, ServiceEnd, offered_as

_Key = TypeVar("_Key")
_TEXT_LIMIT = 200
_NAME_LIMIT = 60
#: Of nodes, of topics, and of services and actions, no more than this are drawn.
_MOST_BOXES = 60


class Columns:
    """The times, numbers and texts of all series of a page, each list of them once: many charts share them."""

    def __init__(self) -> None:
        self._places: dict[tuple[object, ...], int] = {}
        self.lists: list[list[JsonValue]] = []

    def numbers(self, values: tuple[float, ...]) -> int:
        """Return the index of a list of numbers; a single one stands for equal ones."""
        same = len(values) > 1 and all(value == values[0] for value in values)
        return self._kept(("numbers", *(values[:1] if same else values)), _number)

    def texts(self, values: tuple[str, ...]) -> int:
        """Return the index of a list of texts."""
        return self._kept(("texts", *values), lambda text: shown(text, limit=_TEXT_LIMIT))

    def _kept(self, key: tuple[object, ...], showable: Callable[[Any], JsonValue]) -> int:
        if key not in self._places:
            self._places[key] = len(self.lists)
            self.lists.append([showable(value) for value in key[1:]])
        return self._places[key]


def figure_values(figure: Figure, columns: Columns) -> JsonObject:
    """Return a figure as JSON values, with its points in columns; numbers that JSON cannot represent become None."""
    if isinstance(figure, GraphFigure):
        return {"kind": "graph", "title": shown(figure.title), "stages": [_stage(stage) for stage in figure.stages]}
    if isinstance(figure, Playback):
        return {
            "kind": "run",
            "timeline": _chart(figure.timeline, columns),
            "topics": [_topic(topic) for topic in figure.topics],
            "graph": _living_graph(figure),
        }
    return _chart(figure, columns)


def _topic(topic: TopicValues) -> JsonObject:
    return {
        "name": shown(topic.topic, limit=_NAME_LIMIT),
        "type": shown(topic.type, limit=_NAME_LIMIT),
        "sender": topic.sender,
        "messages": topic.messages,
        "times": [round(t, 3) for t in topic.times_s],
        "fields": [
            {"name": shown(c.name, limit=_NAME_LIMIT), "values": [_value(v) for v in c.values]} for c in topic.columns
        ],
    }


def _value(value: float | str) -> JsonValue:
    return shown(value, limit=_NAME_LIMIT) if isinstance(value, str) else _number(value, digits=5)


def _living_graph(figure: Playback) -> JsonObject:
    """Return everything that was ever in the graph, each part with the indices of the moments at which it was there."""
    graphs = [graph for _, graph in figure.graphs]
    nodes = tuple(dict.fromkeys(node for graph in graphs for node in graph.nodes))
    endpoints = tuple(dict.fromkeys(e for graph in graphs for e in graph.endpoints))
    services = tuple(dict.fromkeys(end for graph in graphs for end in graph.services))
    whole = _stage(Stage("", GraphSnapshot(0, nodes, endpoints, services)))
    stages = [_stage(Stage("", graph)) for graph in graphs]
    edges = [{edge["text"] for edge in stage["edges"]} for stage in stages]
    boxes = {}
    for kind in ("nodes", "topics", "services"):
        there = [{(box["kind"], box["name"]) for box in stage[kind]} for stage in stages]
        boxes[kind] = [
            {**box, "alive": [k for k, some in enumerate(there) if (box["kind"], box["name"]) in some]}
            for box in whole[kind]
        ]
    arrows = [{**e, "alive": [k for k, some in enumerate(edges) if e["text"] in some]} for e in whole["edges"]]
    return {"title": "", "times": [round(t, 3) for t, _ in figure.graphs], **boxes, "edges": arrows}


def _chart(figure: Chart, columns: Columns) -> JsonObject:
    return {
        "kind": "chart",
        "title": shown(figure.title),
        "x": {"title": figure.x_title, "unit": figure.x_unit},
        "square": figure.square,
        "run": figure.scenario,
        "until": figure.until_s,
        "panels": [_panel(panel, columns) for panel in figure.panels],
        "cases": [
            {"start": _number(c.start), "stop": _number(c.stop), "label": shown(c.label, limit=_NAME_LIMIT)}
            | {"tone": c.tone.value}
            for c in figure.cases
        ],
        "moments": [
            {"x": _number(m.x), "label": shown(m.label, limit=_NAME_LIMIT), "tone": m.tone.value}
            for m in figure.moments
        ],
    }


def _panel(panel: Panel, columns: Columns) -> JsonObject:
    return {
        "title": shown(panel.title, limit=_NAME_LIMIT),
        "unit": panel.unit,
        "series": [_series(series, columns) for series in panel.series],
        "bands": [
            {"low": _number(b.low), "high": _number(b.high), "label": shown(b.label), "tone": b.tone.value}
            for b in panel.bands
        ],
        "levels": [{"value": _number(v.value), "label": shown(v.label), "name": shown(v.name)} for v in panel.levels],
        "lanes": [shown(lane, limit=_NAME_LIMIT) for lane in panel.lanes],
        "grid": list(panel.grid) if panel.grid else None,
    }


def _series(series: Series, columns: Columns) -> JsonObject:
    return {
        "name": shown(series.name, limit=_NAME_LIMIT),
        "look": series.look.value,
        "tone": series.tone.value,
        "count": len(series.points),
        "x": columns.numbers(tuple(x for x, _ in series.points)),
        "y": columns.numbers(tuple(y for _, y in series.points)),
        "texts": columns.texts(series.texts),
    }


def _stage(stage: Stage) -> dict[str, Any]:
    """Return nodes, topics, services and arrows; ids tell a node from a topic of the same name."""
    endpoints = [e for e in stage.graph.endpoints if "/_" not in e.topic]
    offered = [(end, offer) for end in stage.graph.services if (offer := offered_as(end.service))]
    ends = (*(e.node for e in endpoints), *(end.node for end, _ in offered))
    nodes = _numbered("n", (*stage.graph.nodes, *ends))
    topics = _numbered("t", (e.topic for e in endpoints))
    services = _numbered("s", (offer for _, offer in offered))
    apart = {("topic", topic): why for _, topic, _, why in reversed(graph_edges(stage.graph)) if why}
    apart |= {(call.kind, call.name): call.quarrel for call in reversed(call_edges(stage.graph)) if call.quarrel}
    drawn = [e for e in endpoints if e.node in nodes and e.topic in topics]
    called = [(end, offer) for end, offer in offered if end.node in nodes and offer in services]
    types: dict[tuple[str, str], list[str]] = {}
    for key, type_ in [*((("topic", e.topic), e.type) for e in drawn), *((key, end.type) for end, key in called)]:
        types.setdefault(key, []).append(type_.removesuffix("_SendGoal") if key[0] == "action" else type_)
    return {
        "title": shown(stage.title, limit=_NAME_LIMIT),
        "nodes": [{"id": id_, "kind": "node", "name": shown(name, limit=_NAME_LIMIT)} for name, id_ in nodes.items()],
        "topics": [_box(id_, ("topic", name), types, apart) for name, id_ in topics.items()],
        "services": [_box(id_, key, types, apart) for key, id_ in services.items()],
        "edges": [
            *(_edge(e, nodes[e.node], topics[e.topic]) for e in drawn),
            *(_call_edge(end, offer, nodes[end.node], services[offer]) for end, offer in called),
        ],
    }


def _numbered(letter: str, found: Iterable[_Key]) -> dict[_Key, str]:
    """Return an id for each of the different ones."""
    return {one: f"{letter}{k}" for k, one in enumerate(islice(dict.fromkeys(found), _MOST_BOXES))}


def _box(
    id_: str, key: tuple[str, str], found: Mapping[tuple[str, str], list[str]], apart: Mapping[tuple[str, str], str]
) -> JsonObject:
    """Return a topic, service or action with its types, and what keeps its ends apart."""
    kind, name = key
    types = list(dict.fromkeys(found[key]))[:5]
    why = apart.get(key) or (f"types differ: {', '.join(types)}" if len(types) > 1 else "")
    return {
        "id": id_,
        "kind": kind,
        "name": shown(name, limit=_NAME_LIMIT),
        "types": [shown(t, limit=_NAME_LIMIT) for t in types],
        "quarrel": shown(why, limit=_TEXT_LIMIT),
    }


def _edge(endpoint: Endpoint, node: str, topic: str) -> JsonObject:
    ends = (node, topic) if endpoint.kind == "publisher" else (topic, node)
    text = f"{endpoint.node} {'publishes' if endpoint.kind == 'publisher' else 'subscribes to'} {endpoint.topic}: "
    text += f"{endpoint.type}, {endpoint.reliability}, {endpoint.durability}"
    text += f", depth {endpoint.depth}" if endpoint.depth else ""
    return {"from": ends[0], "to": ends[1], "text": shown(text, limit=_TEXT_LIMIT)}


#: What an end of a service or an action does, by kind and end.
_DOES = {
    ("service", "client"): "calls",
    ("service", "service"): "serves",
    ("action", "client"): "sends goals to",
    ("action", "service"): "takes goals of",
}


def _call_edge(end: ServiceEnd, offer: tuple[str, str], node: str, service: str) -> JsonObject:
    kind, name = offer
    ends = (node, service) if end.kind == "client" else (service, node)
    text = f"{end.node} {_DOES[kind, end.kind]} {name}: {end.type.removesuffix('_SendGoal')}"
    text += f", {end.unusual}" if end.unusual else ""
    return {"from": ends[0], "to": ends[1], "text": shown(text, limit=_TEXT_LIMIT)}


def _number(value: float, digits: int = 7) -> float | int | None:
    """Return a number with as many digits as a chart shows."""
    if not math.isfinite(value):
        return None
    short = float(f"{value:.{digits}g}")
    return int(short) if short.is_integer() and abs(short) < 1e15 else short


def render_html(report: Report, *, assets: str | None = None, recordings: str = "") -> str:
    """Return a report, all of whose text is treated as hostile, as an HTML page that makes no network requests.

    The page finds the files of `bundle` at `assets`, relative to itself, e.g. `../assets`. None puts them into
    the page, which then stands alone. Recordings is the folder of the kept evidence, relative to the page; empty if
    its readers have none.
    """
    page = _templates().get_template("report.html")
    columns = Columns()
    figures = {figure.id: figure_values(figure, columns) for e in report.exercises for figure in e.figures}
    return page.render(
        report=report,
        bundle=bundle(),
        assets=assets,
        recordings=recordings,
        figures=Markup(script_json({"figures": figures, "columns": columns.lists})),  # noqa: S704  the function exists to make it safe in a script element
        embedded=Markup,
        clock_wall=ClockKind.WALL,
        command=" ".join(wording.reproducing_command(report)),
        score=score_place(score_shown(report)),
        for_student=report.audience is Audience.STUDENT,
        first=wording.first_to_fix(report) if report.audience is Audience.STUDENT else None,
    )


def render_run(  # noqa: PLR0913  what the page shows
    title: str,
    why: str,
    run: Playback,
    facts: Mapping[str, str],
    charts: Sequence[Chart] = (),
    steps: Sequence[ShownStep] = (),
    omitted: int = 0,
    excerpts: Sequence[Excerpt] = (),
) -> str:
    """Return a page that plays one run, in one file that makes no network requests; all its text is hostile.

    Args:
        title: What was run.
        why: What is to be told about it; may be empty.
        run: The run.
        facts: Names and values of what it was made with.
        charts: Charts of the run.
        steps: What was done in it, in order.
        omitted: How many steps there were before these.
        excerpts: The source around the lines at which something failed.
    """
    columns = Columns()
    drawn: tuple[Figure, ...] = (run, *charts)
    figures = {figure.id: figure_values(figure, columns) for figure in drawn}
    return (
        _templates()
        .get_template("run.html")
        .render(
            title=title,
            why=why,
            run_figure=run,
            charts=charts,
            steps=steps,
            omitted=omitted,
            excerpts=excerpts,
            facts=facts,
            bundle=bundle(),
            embedded=Markup,
            figures=Markup(script_json({"figures": figures, "columns": columns.lists})),  # noqa: S704  as above
        )
    )


def score_shown(report: Report) -> ScoreShown:
    """Return the score of a report as its page shows it."""
    outcomes = tuple(verdict.outcome for exercise in report.exercises for verdict in exercise.verdicts)
    return ScoreShown(report.score, report.max_score, outcomes, report.final)


@cache
def _templates() -> Environment:
    templates = page_environment("grader.grading.reporting.html")
    templates.filters["exercise_name"] = exercise_name
    templates.globals |= {
        "wording": wording,
        "open_at_first": _open_at_first,
        "points_place": points_place,
        "earned_place": earned_place,
        "decision_place": decision_place,
        "mark_of": lambda verdict: CriterionMark(verdict.score, verdict.max_score),
        "excerpt_at": _excerpt_at,
        "excerpts_left": _excerpts_left,
        "marked_in": _marked_in,
        "line_id": _line_id,
        "placed_in": _placed_in,
        "open_run": _open_run,
        "kept_at": _kept_at,
        "segments": _segments,
    }
    return templates


def _kept_at(recordings: str, exercise: ExerciseReport, run: Playback) -> str:
    """Return where the evidence of a run is, relative to the page; empty if its readers have none."""
    name = f"{exercise.id}.{run.timeline.scenario}"
    return f"{recordings}/{name}/{name}_0.mcap" if recordings else ""


def _open_at_first(verdict: Verdict) -> bool:
    """Return whether a criterion starts unfolded: readers look for what cost points."""
    return verdict.outcome in (Outcome.NOT_MET, Outcome.PARTLY, Outcome.UNDECIDED)


def _excerpt_at(exercise: ExerciseReport, place: Location | None) -> Excerpt | None:
    if place is None:
        return None
    return next((e for e in exercise.excerpts if (e.file, e.line) == (place.file, place.line)), None)


def _marked_in(exercise: ExerciseReport, file: str) -> dict[int, list[Verdict | None]]:
    """Return the criteria that name each line of a file; None stands for a fault that no criterion names."""
    marked: dict[int, list[Verdict | None]] = {}
    for verdict in exercise.verdicts:
        if verdict.location is not None and verdict.location.file == file:
            marked.setdefault(verdict.location.line, []).append(verdict)
    for fault in exercise.faults:
        if fault.file == file:
            marked.setdefault(fault.line, [None])
    return marked


def _line_id(exercise: ExerciseReport, place: Location) -> str:
    """Return the id of a line of the source; empty if the report does not have it."""
    for number, source in enumerate(exercise.sources, 1):
        if source.file == place.file and 1 <= place.line <= len(source.lines):
            return f"{exercise.id}-file{number}-{place.line}"
    return ""


def _excerpts_left(exercise: ExerciseReport, fault: ReportedFault) -> list[Excerpt]:
    """Return the source around a fault, unless a criterion shows it already."""
    shown_above = {verdict.location for verdict in exercise.verdicts}
    place = Location(fault.file, fault.line)
    excerpt = _excerpt_at(exercise, place)
    return [excerpt] if excerpt and place not in shown_above else []


@dataclass(frozen=True, slots=True)
class _Placed:
    """The figures of an exercise, each with the criterion that it stands in; empty for none."""

    figures: tuple[tuple[str, Figure], ...]

    def inside(self, criterion: str) -> list[Figure]:
        """Return the figures that stand in a criterion, or in none."""
        return [figure for home, figure in self.figures if home == criterion]

    def elsewhere(self, criterion: str) -> list[Figure]:
        """Return the figures that illustrate a criterion but stand in another one."""
        return [figure for home, figure in self.figures if home != criterion and criterion in figure.criteria]


def _placed_in(exercise: ExerciseReport) -> _Placed:
    """Place each figure in the first of its criteria that starts unfolded, else in the first; no run stands in one."""
    unfolded = {verdict.id: _open_at_first(verdict) for verdict in exercise.verdicts}
    homes = [
        ""
        if isinstance(f, Playback)
        else next(iter(sorted(f.criteria, key=lambda id_: not unfolded.get(id_, False))), "")
        for f in exercise.figures
    ]
    return _Placed(tuple(zip(homes, exercise.figures, strict=True)))


def _open_run(exercise: ExerciseReport) -> str:
    """Return the scenario whose recording starts unfolded: the first that cost points; empty if none did."""
    return next((exercise.situations.get(v.id, "") for v in exercise.verdicts if _open_at_first(v)), "")


def _segments(verdicts: Iterable[Verdict]) -> list[tuple[float, float, str]]:
    """Return start, length and outcome of each criterion on a bar as long as all their points."""
    parts, start = [], Fraction(0)
    for verdict in verdicts:
        parts.append((float(start), float(verdict.max_score), verdict.outcome.value))
        start += verdict.max_score
    return parts
