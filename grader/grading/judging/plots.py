"""The chart of any check: what came and what was published, asked, answered and logged, as the check names it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace
from itertools import islice
from typing import Any

from grader.grading.judging.charts import (
    MOST_CASES,
    MOST_POINTS,
    SIDES,
    Lanes,
    drawn_case,
    expected_series,
    kept_indices,
    points_of,
    series,
    time_chart,
)
from grader.grading.judging.recorded_values import parts_of
from grader.grading.judging.service_calls import Call, calls_of, status_of
from grader.grading.judging.values import (
    RuleOrValue,
    as_number,
    as_rule,
    delivered,
    goal_id,
    message_at,
    number_path,
    published,
    rules_text,
    shown_value,
    value_at,
)
from grader.grading.model.chart import Band, Chart, Level, Look, Panel, Series, Stretch, Tone
from grader.grading.model.exercise import NODE_GRAPH, has_member, roles_of, texts_under
from grader.grading.model.measures import Reading
from grader.grading.model.wording import first_few, number, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S, counted, seconds
from grader.runtime.model.trace import Delivery, Message, Request, Response, Trace

#: Maximum number of panels of a chart, of panels for one topic, of lines in a panel, and of rows for texts.
_MOST_PANELS, _MOST_GROUPS, _MOST_LINES, _MOST_WORDS = 6, 3, 6, 5
#: Of so many messages, spread over all, it is read which fields there are and which of them change.
_SAMPLES, _MOST_FIELDS = 40, 200
#: Of a list that is longer than this, the first, the middle and the last element are drawn.
_SHORT_LIST = 6
_NESTED = re.compile(r"[.\[]")
#: With up to this many values, what is published is drawn as steps: it is a state, not a curve.
_FEW_VALUES, _FEW_INPUTS = 4, 30
#: Responses that take less than this have no panel for the time that they took.
_PROMPT_NS = NS_PER_MS
_TEXT_LENGTH = 40
#: The name of messages of which nothing but their time is drawn.
_BARE = "message without a number"
_UNITS = {
    "linear": "m/s",
    "angular": "rad/s",
    "linear_acceleration": "m/s²",
    "angular_velocity": "rad/s",
    "translation": "m",
}

Item = Message | Delivery | Request | Response
_Timed = tuple[int, Mapping[str, object]]


@dataclass(frozen=True, slots=True)
class Plot:
    """What a chart shows of a topic.

    Attributes:
        fields: Paths of the fields; those that change if left out.
        rules: What is expected by field path; these fields are shown.
        levels: Thresholds of the first field.
        bands: Accepted ranges of the first field.
        expected: What the first field should have been.
        most: Maximum number of panels.
        number: Path of the field that goes by the name of the topic.
        unit: Unit of that field.
    """

    topic: str
    fields: tuple[str, ...] = ()
    rules: Mapping[str, RuleOrValue] = field(default_factory=dict)
    levels: tuple[Level, ...] = ()
    bands: tuple[Band, ...] = ()
    expected: tuple[Reading, ...] = ()
    most: int = _MOST_GROUPS
    number: str = "data"
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Drawing:
    """What the chart of a check shows, from the top.

    Attributes:
        topics: Topics; those that the grader publishes stand above the others.
        services: Services that are called, whoever calls.
        rules: What is expected of responses, by field path.
        within_ns: Longest time allowed to a response.
        action: Name of an action; empty for none.
        panels: Further panels, each with a sentence about it.
        processes: Files whose output is shown.
        cases: Cases that the check distinguishes.
        title: Title of the chart; made from the rest if left out.
        sides: What both sides of a call are named, by the sender of an observation.
        came: The words before the topic of messages of the grader.
    """

    topics: tuple[Plot, ...] = ()
    services: tuple[str, ...] = ()
    rules: Mapping[str, RuleOrValue] = field(default_factory=dict)
    within_ns: int | None = None
    action: str = ""
    panels: tuple[tuple[Panel, str], ...] = ()
    processes: tuple[str, ...] = ()
    cases: tuple[Stretch, ...] = ()
    title: str = ""
    sides: Mapping[str, str] = field(default_factory=lambda: SIDES)
    came: str = "received on"


_Panels = list[tuple[Panel, str]]


def chart_of(check: Any, trace: Trace) -> Chart | None:
    """Return the chart of a check: by its method `drawing`, or of what its parameters name; None if nothing happened.

    A check that shows the graph of nodes and topics has no chart.

    Raises:
        TypeError: The method returned something else.
    """
    if shows_graph(check):
        return None
    try:
        found = check.drawing(trace) if has_member(check, "drawing") else _named(check)
    except HarnessError:  # what the check asks is not in the recording
        return None
    if not isinstance(found, (Drawing, Chart, type(None))):
        raise TypeError(f"drawing returned a {type(found).__name__}, expected a Drawing, a Chart or None")
    return drawn_chart(found, trace) if isinstance(found, Drawing) else found


def shows_graph(check: object) -> bool:
    """Return whether the picture of a check is the graph of nodes and topics."""
    return getattr(check, "drawing", None) == NODE_GRAPH


def _named(check: object) -> Drawing:
    """Return a drawing of the topics, services, actions and output that the parameters of a check name."""
    roles = roles_of(type(check))
    plots = [Plot(topic) for topic in texts_under(check, *roles.topics)]
    fields = list(texts_under(check, *roles.fields))
    fields += [str(path) for name in roles.fields for path in _keys(getattr(check, name, None))]
    if plots and fields:
        plots[-1] = replace(plots[-1], fields=tuple(fields))
    services, action = texts_under(check, *roles.services), "".join(texts_under(check, *roles.actions)[:1])
    return Drawing(tuple(plots), services, action=action, processes=texts_under(check, roles.process))


def _keys(value: object) -> Iterable[object]:
    return value if isinstance(value, Mapping) else ()


def drawn_chart(drawing: Drawing, trace: Trace) -> Chart | None:
    """Return a drawing as a chart over time; None if there is nothing but output of processes."""
    above: _Panels = []
    below: _Panels = []
    came: list[str] = []
    went: list[str] = []
    several = len({p.topic for p in drawing.topics}) > 1
    for plot in drawing.topics:
        given, sent = delivered(trace, plot.topic), published(trace, plot.topic)
        if given:
            above += _topic_panels(plot, given, drawing.came, several=several or bool(sent), steps=True)
            came.append(plot.topic)
        if sent:
            below += _topic_panels(plot, sent, "published on", several=several or bool(given))
            went.append(plot.topic)
    for service in drawing.services:
        above += _call_panels(trace, service, drawing)
    cases = [*drawing.cases]
    if drawing.action:
        panels, goals = _action_panels(trace, drawing.action, drawing.sides)
        above, cases = [*above, *panels], [*cases, *goals]
    cases = _joined(cases)
    found = [*above, *below, *drawing.panels][:_MOST_PANELS]
    if not found:
        return None
    for process in drawing.processes:
        lanes = Lanes()
        lanes.logs(trace, process, apart=True)
        records = sum(len(s.points) for s in lanes.rows)
        found.append((lanes.panel("written"), f"Meanwhile {process} wrote {counted(records, 'text')}."))
    asked = [f"calls of {s}" for s in drawing.services]
    asked += [f"goals of {drawing.action}"] if drawing.action else []
    title = drawing.title or _title(drawing.came, came, went, asked, drawing.processes)
    about = " ".join(said for _, said in found if said)
    about += _cases_said(cases)
    return time_chart(trace, title, title, about, *(panel for panel, _ in found), cases=cases)


def _title(how: str, came: Sequence[str], went: Sequence[str], asked: Sequence[str], processes: Sequence[str]) -> str:
    parts = [f"messages {how} {' and '.join(came[:2])}"] if came else []
    parts += [f"messages published on {' and '.join(went[:2])}"] if went else []
    parts += [first_few(asked)] if asked else []
    parts += [f"output of {first_few(processes)}"] if processes else []
    text = f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else "".join(parts)
    return text[:1].upper() + text[1:]


def _joined(cases: Sequence[Stretch]) -> list[Stretch]:
    """Return the cases with neighbours of the same kind as one."""
    joined: list[Stretch] = []
    for case in cases:
        last = joined[-1] if joined else None
        if last and (last.label, last.tone) == (case.label, case.tone) and last.stop >= case.start:
            joined[-1] = replace(last, stop=case.stop)
        else:
            joined.append(case)
    return joined


def _cases_said(cases: Sequence[Stretch]) -> str:
    if not cases:
        return ""
    said = [f"{quote(c.label, _TEXT_LENGTH)} from {c.start:.1f} s to {c.stop:.1f} s" for c in cases[:8]]
    more = f" and {len(cases) - 8} more" if len(cases) > 8 else ""
    more += f", of which the first {MOST_CASES} are marked" if len(cases) > MOST_CASES else ""
    return f" Cases: {', '.join(said)}{more}."


# --- topics -----------------------------------------------------------------------------------------------------------


def _topic_panels(plot: Plot, items: Sequence[Item], how: str, *, several: bool, steps: bool = False) -> _Panels:
    timed = [(item.t_ns, item.value) for item in items]
    head = f"{counted(len(items), 'message')} {how} {plot.topic}"
    plot = replace(plot, number=number_path(items[0].value) or plot.number) if items else plot
    return value_panels(plot, timed, head, plot.topic if several else "", steps=steps)


def value_panels(plot: Plot, timed: Sequence[_Timed], head: str, prefix: str = "", *, steps: bool = False) -> _Panels:
    """Return panels with the fields of values, each with a sentence.

    Args:
        plot: Which fields, and what is expected of them.
        timed: The values with their times in nanoseconds.
        head: What the sentence begins with.
        prefix: What the names of the panels begin with; empty where there is no other topic.
        steps: Whether a number lasts until the next.
    """
    fields = _read(timed, plot.fields or tuple(plot.rules))
    chosen = fields.chosen if not (plot.fields or plot.rules) else list(fields.numbers)
    groups: dict[str, list[str]] = {}
    for path in chosen:
        groups.setdefault(path.rpartition(".")[0], []).append(path)
    panels: _Panels = []
    hidden = [path for group in list(groups.values())[plot.most :] for path in group]
    said: list[str] = []
    for group, paths in list(groups.items())[: plot.most]:
        hidden += paths[_MOST_LINES:]
        readings = {path: _numbers(path, timed) for path in paths[:_MOST_LINES]}
        lines = _lines(plot, readings, steps=steps)
        said += [_numbers_said(path, found) for path, found in readings.items()]
        panels.append((_panel(plot, group, paths[:_MOST_LINES], lines, prefix, first=not panels), ""))
    panels += [(_bool_panel(path, timed, prefix), "") for path in fields.bools[:2]]
    said += [_bools_said(path, timed) for path in fields.bools[:2]]
    for path in fields.texts[:2]:
        panel, words = _text_panel(path, timed, prefix, plot.rules.get(path))
        panels.append((panel, ""))
        said.append(words)
    said += [_constants_said(fields, chosen)] if fields.constants else []
    said += [f"expected: {quote(rules_text(plot.rules), 300)}"] if plot.rules else []
    said += [_band_said(band) for band in plot.bands]
    said += [f"not drawn: {first_few([_label(p) for p in hidden])}"] if hidden else []
    words = f"{head}{': ' if any(said) else ''}{'; '.join(filter(None, said))}."
    if panels:
        panels[0] = (panels[0][0], words)
        return panels
    lanes = Lanes()
    lanes.add("message")
    lanes.dots(_BARE, ((t_ns, "") for t_ns, _ in timed))
    return [(lanes.panel(prefix or plot.topic), words)]


@dataclass(slots=True)
class _Fields:
    """Paths of fields by what they hold; constants with their numbers."""

    numbers: dict[str, bool] = field(default_factory=dict)  # whether each one changes
    constants: dict[str, float] = field(default_factory=dict)
    bools: list[str] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)
    whole: bool = True  # whether all values were read, and not a sample

    @property
    def chosen(self) -> list[str]:
        """The numbers to draw: those that change, or else those that are not 0, or else the first."""
        changing = [path for path, changes in self.numbers.items() if changes]
        other = [path for path, value in self.constants.items() if value != 0]
        return changing or other[:_MOST_LINES] or list(self.numbers)[:1]


def _read(timed: Sequence[_Timed], wanted: Sequence[str]) -> _Fields:
    """Return which fields there are, by a sample; only those wanted, if any are."""
    changes = [value for k, (_, value) in enumerate(timed) if not k or value != timed[k - 1][1]]
    stride = max(1, -(-len(changes) // _SAMPLES))
    found: dict[str, list[object]] = {}
    for value in [*changes[::stride], *changes[-1:]]:
        if wanted:
            for path in wanted:
                whole = value_at(value, path)
                if isinstance(whole, (int, float, str)):
                    found.setdefault(path, []).append(whole)
                    continue
                for inner, part in islice(parts_of({path: whole}, _places), _MOST_FIELDS):
                    found.setdefault(inner, []).append(part)
        else:
            for path, part in islice(parts_of(value, _places), _MOST_FIELDS):
                found.setdefault(path, []).append(part)
    fields = _Fields(whole=stride == 1)
    for path, values in found.items():
        known = next((v for v in values if v is not None), None)
        if isinstance(known, bool):
            fields.bools.append(path)
        elif isinstance(known, str):
            fields.texts += [path] if any(values) else []
        elif (first := as_number(known)) is not None:
            fields.numbers[path] = len({str(v) for v in values}) > 1
            if not fields.numbers[path]:
                fields.constants[path] = first
    return fields


def _places(length: int) -> Iterable[int]:
    return range(length) if length <= _SHORT_LIST else (0, length // 2, length - 1)


def _tone(place: int) -> Tone:
    return (Tone.MAIN, Tone.SECOND, Tone.THIRD)[place % 3]


def _label(path: str) -> str:
    return quote(re.sub(r"\.([0-9]+)(?=\.|$)", r"[\1]", path), 60)


def _name(plot: Plot, path: str) -> str:
    """Return the name of a field in a legend: a topic with a single field goes by its own name."""
    return plot.topic if path == plot.number else _label(path)


def _values(path: str, timed: Sequence[_Timed]) -> list[tuple[int, object]]:
    if not _NESTED.search(path):
        return [(t_ns, value.get(path)) for t_ns, value in timed]
    return [(t_ns, value_at(value, path)) for t_ns, value in timed]


def _numbers(path: str, timed: Sequence[_Timed]) -> list[Reading]:
    found = ((t_ns, as_number(value)) for t_ns, value in _values(path, timed))
    return [Reading(t_ns, math.nan if value is None else value) for t_ns, value in found]


def _lines(plot: Plot, readings: Mapping[str, Sequence[Reading]], *, steps: bool) -> list[Series]:
    """Return a line for each field, thinned at the same times."""
    most = MOST_POINTS // len(readings)
    kept = sorted({k for found in readings.values() for k in kept_indices([r.value for r in found], most)})
    lines = []
    for place, (path, found) in enumerate(readings.items()):
        few = len({r.value for r in found}) <= (_FEW_INPUTS if steps else _FEW_VALUES)
        look = Look.DOTS if len(found) == 1 else Look.STEP if few else Look.LINE
        points = points_of(found[k] for k in kept)
        lines.append(series(_name(plot, path), points, look=look, tone=_tone(place), most=len(points)))
    return lines


def _band_said(band: Band) -> str:
    """Return the label of a band, with its limits if it has no number: what an author writes may be a name alone."""
    if any(map(str.isdigit, band.label)):
        return band.label
    return f"{band.label}: {number(band.low)} to {number(band.high)}"


def _panel(  # noqa: PLR0913
    plot: Plot, group: str, paths: Sequence[str], lines: Sequence[Series], prefix: str, *, first: bool
) -> Panel:
    alone = list(paths) == [plot.number]
    title = plot.topic if alone else f"{prefix} {_label(group)}".strip() or "value"
    unit = plot.unit if alone else _UNITS.get(group.rpartition(".")[2], "")
    levels, bands = _ruled({path: plot.rules[path] for path in paths if path in plot.rules})
    if first:
        levels, bands = [*plot.levels, *levels], [*plot.bands, *bands]
        look = Look.LINE if lines[0].look is Look.LINE and len(plot.expected) == len(lines[0].points) else Look.STEP
        lines = [*([expected_series(plot.expected, look)] if plot.expected else []), *lines]
    return Panel(title, unit, tuple(lines), tuple(bands), tuple(levels))


def _ruled(rules: Mapping[str, RuleOrValue]) -> tuple[list[Level], list[Band]]:
    """Return the expected numbers, those that are equal as one, and the accepted ranges."""
    wanted: dict[float, list[str]] = {}
    levels: list[Level] = []
    bands: list[Band] = []
    for path, given in rules.items():
        rule = as_rule(given)
        equal = as_number(rule.equals)
        if equal is not None and math.isfinite(equal):
            wanted.setdefault(equal, []).append(_label(path))
        ends = [end for end in (rule.low, rule.high) if end is not None and math.isfinite(end)]
        if len(ends) == 2:
            bands.append(Band(ends[0], ends[1], f"{_label(path)} {rule.wanted}: accepted"))
        else:
            side = "at least" if rule.low in ends else "at most"
            levels += [Level(end, f"{side} {number(end)}", name=f"{_label(path)} {side}") for end in ends]
    return [*(Level(w, f"{', '.join(paths)} = {number(w)}") for w, paths in wanted.items()), *levels], bands


def _numbers_said(path: str, readings: Sequence[Reading]) -> str:
    values = [r.value for r in readings]
    finite = [v for v in values if math.isfinite(v)]
    label = _label(path)
    if not finite:
        return f"{label} is never a finite number"
    odd = f", {len(values) - len(finite)} not finite or missing" if len(finite) < len(values) else ""
    low, high = min(finite), max(finite)
    return f"{label} from {number(low)} to {number(high)}{odd}" if low < high else f"{label} = {number(low)}{odd}"


def _constants_said(fields: _Fields, chosen: Sequence[str]) -> str:
    rest = [f"{_label(path)} = {number(v)}" for path, v in fields.constants.items() if path not in chosen]
    how = "never changing" if fields.whole else "the same in every message of a sample"
    return f"{how}: {first_few(rest, 3)}" if rest else ""


def _bool_panel(path: str, timed: Sequence[_Timed], prefix: str) -> Panel:
    points = [(seconds(t_ns), 0.0 if value is True else 1.0) for t_ns, value in _values(path, timed)]
    look = Look.STEP if len(points) > 1 else Look.DOTS
    title = f"{prefix} {_label(path)}".strip()
    return Panel(title, "", (series(_label(path), points, look=look),), lanes=("true", "false"))


def _bools_said(path: str, timed: Sequence[_Timed]) -> str:
    values = [value is True for _, value in _values(path, timed)]
    return f"{_label(path)} true in {sum(values)} of {len(values)}"


def _text_panel(path: str, timed: Sequence[_Timed], prefix: str, rule: RuleOrValue | None) -> tuple[Panel, str]:
    """Return texts as marks, right or wrong by a rule: a row for each of a few texts, or else one row for all."""
    found = [(t_ns, value) for t_ns, value in _values(path, timed) if isinstance(value, str)]
    words = list(dict.fromkeys(quote(text, _TEXT_LENGTH) for _, text in found))
    few = len(words) <= _MOST_WORDS
    lanes = tuple(repr(word) for word in words) if few else (_label(path),)
    row = {word: float(k) for k, word in enumerate(words)}
    kinds: dict[tuple[str, Tone], list[tuple[int, str]]] = {}
    for t_ns, text in found:
        right = rule is None or as_rule(rule).allows(text)
        kind = (_label(path), Tone.MAIN) if rule is None else ("right", Tone.GOOD) if right else ("wrong", Tone.BAD)
        kinds.setdefault(kind, []).append((t_ns, text))
    rows = tuple(
        series(
            name,
            [(seconds(t_ns), row[quote(text, _TEXT_LENGTH)] if few else 0.0) for t_ns, text in some],
            look=Look.DOTS,
            tone=tone,
            texts=[text for _, text in some],
        )
        for (name, tone), some in kinds.items()
    )
    said = f"{_label(path)}: {first_few([repr(word) for word in words])}"
    return Panel(f"{prefix} {_label(path)}".strip(), "", rows, lanes=lanes), said


# --- services and actions ---------------------------------------------------------------------------------------------


def _asker(trace: Trace, service: str) -> str:
    """Return who calls a service: the grader, or the student whom it answers."""
    return "grader" if trace.requests(service, "grader") else "student"


def _call_panels(trace: Trace, service: str, drawing: Drawing) -> _Panels:
    asker = _asker(trace, service)
    calls = calls_of(trace, service, asker)
    if not calls:
        return []
    answered = [(c, c.response) for c in calls if c.response is not None]
    asked = [(c.request.t_ns, c.request.value) for c in calls]
    told = [(response.t_ns, response.value) for _, response in answered]
    lanes = Lanes(sides=drawing.sides)
    lanes.add("request")
    lanes.exchanges(c.request for c in calls)
    lanes.add("response")
    lanes.exchanges(response for _, response in answered)
    said = f"{counted(len(calls), 'request')} of the {drawing.sides[asker]} on {service}, "
    said += f"{counted(len(answered), 'response')}."
    panels: _Panels = [(lanes.panel(service), said)]
    lasted = [(c.request.t_ns, r.t_ns - c.request.t_ns) for c, r in answered]
    if drawing.within_ns is not None or (asker == "grader" and any(ns >= _PROMPT_NS for _, ns in lasted)):
        panels.append(delay_panel("response", lasted, drawing.within_ns))
    inputs = _only_values(Plot(service), asked, "request")
    # a check with a panel of its own draws there what matters in the responses
    outputs = [] if drawing.panels else _only_values(Plot(service, rules=drawing.rules), told, "response")
    return [*inputs, *panels, *outputs]


def _only_values(plot: Plot, timed: Sequence[_Timed], what: str) -> _Panels:
    """Return panels with the numbers, truth values and texts of requests or responses that change."""
    if not plot.rules:
        fields = _read(timed, ())
        changing = [path for path, changes in fields.numbers.items() if changes]
        if not changing:
            return []
        plot = replace(plot, fields=tuple(changing))
    panels = value_panels(plot, timed, f"In {counted(len(timed), what)}", what) if timed else []
    return [(panel, said) for panel, said in panels if panel.series[-1].name != _BARE]


def delay_panel(what: str, lasted: Sequence[tuple[int, int]], within_ns: int | None = None) -> tuple[Panel, str]:
    """Return a panel with how long each answer took, and a sentence.

    Args:
        what: What came, e.g. `response`.
        lasted: When each was asked for and how long it took, in nanoseconds.
        within_ns: Longest time allowed; None if any time is.
    """
    unit, scale = ("s", 1e-9) if max((ns for _, ns in lasted), default=0) > NS_PER_S // 2 else ("ms", 1e-6)
    points = [(seconds(t_ns), ns * scale) for t_ns, ns in lasted]
    dots = series(f"time to the {what}", points, look=Look.DOTS, tone=Tone.SECOND)
    slowest = max((ns for _, ns in lasted), default=0) * scale
    said = f"The slowest {what} took {slowest:.4g} {unit}." if lasted else ""
    if within_ns is None:
        return Panel(f"time to the {what}", unit, (dots,)), said
    level = Level(within_ns * scale, f"at most {number(within_ns * scale)} {unit}", name="longest time allowed")
    return Panel(f"time to the {what}", unit, (dots,), levels=(level,)), said


def _action_panels(trace: Trace, action: str, sides: Mapping[str, str]) -> tuple[_Panels, list[Stretch]]:
    """Return what was sent to an action's server and what came from it, and each goal as a case."""
    asker = _asker(trace, f"{action}/_action/send_goal")
    goals = calls_of(trace, f"{action}/_action/send_goal", asker)
    if not goals:
        return [], []
    results = calls_of(trace, f"{action}/_action/get_result", asker)
    cancels = calls_of(trace, f"{action}/_action/cancel_goal", asker)
    answered = published if asker == "grader" else delivered
    feedback = answered(trace, f"{action}/_action/feedback")
    lanes = Lanes()
    lanes.add("goal")
    lanes.dots("goal", ((g.request.t_ns, said_of(message_at(g.request.value, "goal"))) for g in goals), Tone.SECOND)
    answers = [(g.response.t_ns, g.response.value.get("accepted") is True) for g in goals if g.response]
    lanes.dots("accepted", ((t, "accepted") for t, yes in answers if yes), Tone.MAIN)
    lanes.dots("rejected", ((t, "rejected") for t, yes in answers if not yes), Tone.BAD)
    if feedback:
        lanes.add("feedback")
        lanes.dots("feedback", ((m.t_ns, said_of(message_at(m.value, "feedback"))) for m in feedback), Tone.MAIN)
    if cancels:
        lanes.add("cancel")
        lanes.dots("cancel", ((c.request.t_ns, "asked to cancel") for c in cancels), Tone.WARNING)
    ended = [r.response for r in results if r.response]
    lanes.add("result")
    told = [(r.t_ns, f"{status_of(r)}: {said_of(message_at(r.value, 'result'))}") for r in ended]
    lanes.dots("result", told, Tone.THIRD)
    said = f"{counted(len(goals), 'goal')} of the {sides[asker]} for {action}, "
    said += f"{counted(len(feedback), 'message')} of feedback, "
    said += f"{counted(len(cancels), 'request')} to cancel, {counted(len(ended), 'result')}."
    numbers = _only_values(Plot(action), [(m.t_ns, message_at(m.value, "feedback")) for m in feedback], "feedback")
    return [(lanes.panel(action), said), *numbers], _goal_cases(trace, goals, results)


def _goal_cases(trace: Trace, goals: Sequence[Call], results: Sequence[Call]) -> list[Stretch]:
    ends = {goal_id(r.request.value): r.response for r in results if r.response}
    cases = []
    for place, goal in enumerate(goals, 1):
        end = ends.get(goal_id(goal.request.value))
        stop_ns = trace.stop_ns if end is None else end.t_ns
        accepted = goal.response is not None and goal.response.value.get("accepted") is True
        how = status_of(end) if end is not None else "no result" if accepted else "not accepted"
        if accepted:
            cases.append(drawn_case(goal.request.t_ns, stop_ns, f"goal {place}: {how}"))
    return cases


def said_of(value: Mapping[str, object]) -> str:
    """Return the content of a message as text: `order = 3, name = 'a'`."""
    return ", ".join(f"{quote(str(name), 40)} = {shown_value(inner)}" for name, inner in islice(value.items(), 12))
