"""Proposes criteria for a new rubric, from the observed behaviour of a reference solution."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Mapping, Sequence

from grader.course.authoring.skeleton import DraftCriterion, DraftQuantity, as_id, in_seconds
from grader.grading.judging.summary import summarise
from grader.grading.judging.values import carries_number, numbers_by_path, student_endpoints
from grader.grading.model.report import TopicSummary
from grader.grading.model.wording import number
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S, counted, seconds
from grader.runtime.model.trace import AssessedTrace, Delivery, Message, Offer, Trace

#: What every node has.
_EVERYBODYS = ("use_sim_time", "start_type_description_service")
_OVERRIDES = "qos_overrides."


def student_parameters(trace: Trace) -> Iterator[tuple[str, str, str | float | bool | None]]:
    """Yield node, name and value of each parameter, with an empty node if only one has any; lists become None."""
    offers = [(o.name.partition(":"), o.detail) for o in trace.of(Offer) if o.kind == "parameter"]
    own = {
        (node, name): value
        for (node, _, name), value in offers
        if name not in _EVERYBODYS and not name.startswith(_OVERRIDES)
    }
    several = len({node for node, _ in own}) > 1
    for (node, name), value in own.items():
        yield node if several else "", name, _read(value)


def _read(text: str) -> str | float | bool | None:
    """Parse a parameter value in Python syntax; None for lists and invalid values."""
    try:
        value = ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return None
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, (str, int, float)) and value != "" else None


#: Suffixes of fields with times, which differ in each run.
OF_THE_RUN = ("stamp.sec", "stamp.nanosec")
#: Something comes after anything.
ANY: list[dict[str, object]] = [{"when": {}, "then": {}}]
#: Most distinct inputs to turn into cases, and most fields of an answer.
_MOST_CASES, _MOST_ANSWER_FIELDS = 8, 8
#: How many elements of a list can tell inputs apart.
_MOST_ELEMENTS = 8


def cases_seen(trace: Trace, given: str, answered: str) -> list[dict[str, object]]:
    """Return a case for each distinct input: its fields, and the answer within a second."""
    inputs = trace.deliveries(given)
    answers = _answers(trace, inputs, answered)
    different: dict[str, tuple[Delivery, Message | None]] = {}
    for sent, answer in zip(inputs, answers, strict=True):
        different.setdefault(str(sent.value), (sent, answer))
    if not 0 < len(different) <= _MOST_CASES:
        return ANY
    paths = _telling([answer for answer in answers if answer is not None])
    rows = [_scalars(sent.value) for sent, _ in different.values()]
    differing = _differing(rows)
    cases = []
    for row, (_, answer) in zip(rows, different.values(), strict=True):
        held = {path: value for path, value in row.items() if path in differing}
        cases.append(_case(held or {path: value for path, value in row.items() if value}, answer, paths))
    return cases


def _differing(rows: Sequence[Mapping[str, float | str]]) -> list[str]:
    """Return the first paths that tell every two messages apart; all that differ if none do."""
    every = [
        path for path in dict.fromkeys(path for row in rows for path in row) if len({row.get(path) for row in rows}) > 1
    ]
    for count in range(1, len(every) + 1):
        if len({tuple(row.get(path) for path in every[:count]) for row in rows}) == len(rows):
            return every[:count]
    return every


def texts(value: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield path and value of every string in a message."""
    for name, inner in value.items():
        if isinstance(inner, Mapping):
            yield from texts(inner, f"{prefix}{name}.")
        elif isinstance(inner, str):
            yield f"{prefix}{name}", inner


def _answers(trace: Trace, inputs: tuple[Delivery, ...], answered: str) -> list[Message | None]:
    """Return the last answer to each input, within a second and before the next input; None if there is none."""
    stops = [*(sent.t_ns for sent in inputs), trace.stop_ns][1:]
    found: list[Message | None] = []
    for sent, stop_ns in zip(inputs, stops, strict=True):
        until_ns = min(stop_ns, sent.t_ns + NS_PER_S)
        found.append(next((m for m in reversed(trace.messages(answered)) if sent.t_ns <= m.t_ns < until_ns), None))
    return found


def _scalars(value: Mapping[str, object]) -> dict[str, float | str]:
    """Return every number and text of a message by path, with the first elements of lists."""
    value = _with_elements(value)
    return {
        **dict(texts(value)),
        **{k: v for k, v in numbers_by_path(value).items() if not k.endswith(OF_THE_RUN) and v == v},  # noqa: PLR0124  NaN
    }


def _telling(answers: list[Message]) -> list[str]:
    """Return the paths that differ from their default in at least one answer."""
    rows = [_scalars(answer.value) for answer in answers]
    return [path for path in (rows[0] if rows else ()) if any(row.get(path) for row in rows)][:_MOST_ANSWER_FIELDS]


def _with_elements(value: Mapping[str, object]) -> dict[str, object]:
    """Return a message with the first elements of each list as fields: `ranges[0]`."""
    found: dict[str, object] = {}
    for name, inner in value.items():
        if isinstance(inner, (list, tuple)):
            found |= _with_elements({f"{name}[{n}]": item for n, item in enumerate(inner[:_MOST_ELEMENTS])})
        else:
            found[name] = _with_elements(inner) if isinstance(inner, Mapping) else inner
    return found


def _case(when: Mapping[str, object], answer: Message | None, paths: list[str]) -> dict[str, object]:
    if answer is None:
        return {"when": when, "silent": True}
    held = _scalars(answer.value)
    return {"when": when, "then": {path: held[path] for path in paths if path in held}}


#: Fewest messages to determine a rate, and largest spread of the intervals, as a share of them.
_FEWEST, _STEADY = 5, 0.2
#: Tolerances of a rate for all and for half of the points, as shares of the rate.
_TOLERANCE, _PARTLY = 0.05, 0.1
#: Most constant fields in one criterion.
_MOST_FIELDS = 8


@dataclass(frozen=True, slots=True)
class Seen:
    """The observed behaviour of a reference solution."""

    alone: AssessedTrace  # trace of the nodes without stimuli
    driven: AssessedTrace  # trace of the nodes with the stimuli of the draft; the same as `alone` if there are none
    files: tuple[str, ...]
    window_s: float  # longest time that every topic was observed after its first message


def questions(seen: Seen) -> tuple[DraftCriterion, ...]:
    """Propose criteria for everything that was observed, even if their checks do not exist."""
    topics = summarise(seen.driven, seen.files, "").topics
    own = {end.topic for end in student_endpoints(seen.driven)}
    rows: list[DraftCriterion] = []
    for topic in (t for t in topics if t.name in own):
        rows += [*_published(topic, seen), *_subscribed(topic)]
    rows += [*_services(seen), *_parameters(seen), *_logs(seen)]
    return tuple(rows)


def _published(topic: TopicSummary, seen: Seen) -> Iterator[DraftCriterion]:
    if not topic.messages:
        return
    name, messages = as_id(topic.name), seen.driven.messages(topic.name)
    first = f"publishes_{name}"
    asked = {"topic": topic.name, "type": messages[0].type}
    hint = f"create a publisher for {messages[0].type} on {topic.name}, and publish on it"
    yield DraftCriterion(first, f"Publishes on {topic.name}", "publishes", asked, hint)
    if seen.alone.messages(topic.name):
        yield from _rate(topic, seen, first)
        yield from _fields(topic, seen, first)
        return
    reaction = _reaction(topic, seen, first)
    yield reaction
    if reaction.parameters["cases"] == ANY:
        yield from _fields(topic, seen, first)


def _rate(topic: TopicSummary, seen: Seen, needs: str) -> Iterator[DraftCriterion]:
    pace = topic.pace
    if pace is None or topic.messages < _FEWEST or pace.std_dev_s * pace.rate_hz > _STEADY:
        return
    rate = float(f"{pace.rate_hz:.3g}")
    asked = {
        "topic": topic.name,
        "rate": _hertz(rate),
        "tolerance": _hertz(rate * _TOLERANCE),
        "partly_tolerance": _hertz(rate * _PARTLY),
        "window": in_seconds(seen.window_s),
    }
    comment = f"seen: {pace.rate_hz:.3f} Hz; decide: how far off may it be, for all and for half of the points?"
    hint = "a timer takes its period in seconds, which is 1 divided by the rate"
    title = f"Publishes {topic.name} at {number(rate)} Hz"
    yield DraftCriterion(f"{as_id(topic.name)}_rate", title, "topic_rate", asked, hint, needs, comment)


def _reaction(topic: TopicSummary, seen: Seen, needs: str) -> DraftCriterion:
    """Propose a criterion for a topic with messages only in response to inputs."""
    given = next((delivery.topic for delivery in seen.driven.of(Delivery)), topic.name)
    cases = cases_seen(seen.driven, given, topic.name)
    asked = {"input": given, "output": topic.name, "within": in_seconds(1), "cases": cases}
    comment = "seen: it publishes only after it receives something; decide: which output follows which input, how soon?"
    hint = f"publish on {topic.name} in the callback of the subscription"
    title = f"Answers on {topic.name}"
    return DraftCriterion(f"{as_id(topic.name)}_reaction", title, "reaction", asked, hint, needs, comment)


def _fields(topic: TopicSummary, seen: Seen, needs: str) -> Iterator[DraftCriterion]:
    rows = [numbers_by_path(message.value) for message in seen.driven.messages(topic.name)]
    constant, varying = _sorted_out(rows)
    name = as_id(topic.name)
    if constant:
        asked = {"topic": topic.name, "values": dict(list(constant.items())[:_MOST_FIELDS])}
        comment = f"seen: the same in {counted(len(rows), 'message')}; decide: which of them does the task ask for?"
        hint = f"the fields of every message on {topic.name} hold the same numbers"
        title = f"Right values on {topic.name}"
        yield DraftCriterion(f"{name}_values", title, "field_values", asked, hint, needs, comment)
    words = _constant_texts([message.value for message in seen.driven.messages(topic.name)])
    if words:
        equal = {"topic": topic.name, "fields": words}
        comment = f"seen: the same in {counted(len(rows), 'message')}; decide: does the task ask for them?"
        hint = f"the texts of every message on {topic.name} are the same"
        title = f"Right texts on {topic.name}"
        yield DraftCriterion(f"{name}_texts", title, "field_equal", equal, hint, needs, comment)
    for path, (low, high) in list(varying.items())[:_MOST_FIELDS]:
        yield from _varying(topic, path, low, high, needs)


def _varying(topic: TopicSummary, path: str, low: float, high: float, needs: str) -> Iterator[DraftCriterion]:
    """Propose criteria for a varying field: random numbers, then values in a range; unmet ones are dropped."""
    name = f"{as_id(topic.name)}_{as_id(path)}"
    comment = f"seen: {number(low)} to {number(high)}; decide: which range does the task ask for?"
    hint = f"{path} stays in its range"
    bounds = _round_range(low, high)
    if path != "variance" and carries_number(topic.types[0]):
        title = f"Random numbers on {topic.name}"
        asked = {"topic": topic.name, **bounds}
        yield DraftCriterion(f"{name}_random", title, "random_in_range", asked, hint, needs, comment)
    title, asked = f"{path} of {topic.name} is in range", {"topic": topic.name, "field": path, **bounds}
    yield DraftCriterion(f"{name}_range", title, "field_in_range", asked, hint, needs, comment)


def _constant_texts(values: Sequence[Mapping[str, object]]) -> dict[str, str]:
    """Return the non-empty strings that are the same in all messages, by their paths."""
    rows = [dict(texts(value)) for value in values]
    first = rows[0] if rows else {}
    return {path: text for path, text in first.items() if text and all(row.get(path) == text for row in rows)}


def _sorted_out(rows: Sequence[Mapping[str, float]]) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Return constant fields with their value, and varying fields with their smallest and largest value."""
    constant: dict[str, float] = {}
    varying: dict[str, tuple[float, float]] = {}
    for path in rows[0] if rows else ():
        values = [row[path] for row in rows if path in row]
        if path.endswith(OF_THE_RUN) or any(v != v for v in values):  # noqa: PLR0124  NaN
            continue
        if min(values) == max(values):
            constant[path] = values[0]
        else:
            varying[path] = (min(values), max(values))
    return constant, varying


def _subscribed(topic: TopicSummary) -> Iterator[DraftCriterion]:
    own = [end for end in topic.subscriptions if end.participant >= 0]
    if own:
        asked = {"topic": topic.name, "type": own[0].type}
        hint = f"create a subscription for {own[0].type} on {topic.name} with an ordinary queue depth such as 10"
        id_, title = f"subscribes_{as_id(topic.name)}", f"Subscribes to {topic.name}"
        yield DraftCriterion(id_, title, "subscribes", asked, hint)


def _services(seen: Seen) -> Iterator[DraftCriterion]:
    for service, type_ in dict.fromkeys((e.service, e.type) for e in seen.driven.service_ends("service")):
        name = as_id(service)
        first = f"offers_{name}"
        asked = {"service": service, "type": type_}
        hint = f"create a service of the type {type_} with the name {service}"
        yield DraftCriterion(first, f"Offers {service}", "service_available", asked, hint)
        comment = "decide: how long may an answer take?"
        within = {"service": service, "within": in_seconds(1)}
        hint = f"the callback of {service} returns the response"
        title = f"Answers on {service}"
        yield DraftCriterion(f"{name}_answers", title, "service_answers_all", within, hint, first, comment)
    for service in dict.fromkeys(e.service for e in seen.driven.service_ends("client")):
        calls = len(seen.driven.requests(service, "student"))
        if calls:
            wanted: dict[str, object] = {"service": service, "calls": calls}
            comment = f"seen: {counted(calls, 'call')}; decide: how many, and how long between two of them?"
            hint = f"call {service} once it is available"
            id_, title = f"calls_{as_id(service)}", f"Calls {service}"
            yield DraftCriterion(id_, title, "service_calls", wanted, hint, "", comment)


def _parameters(seen: Seen) -> Iterator[DraftCriterion]:
    for node, name, value in student_parameters(seen.alone):
        asked: dict[str, object] = {"name": name, **({"node": node} if node else {})}
        comment = "decide: does the task ask for this default?"
        if value is None:
            comment = "its value is not a number, text or truth value; decide: does the task ask for it at all?"
        else:
            asked["value"] = value
        title, hint = f"Has the parameter {name}", f'declare_parameter("{name}", ...) before anything reads it'
        yield DraftCriterion(f"parameter_{as_id(name)}", title, "parameter_declared", asked, hint, "", comment)


def _logs(seen: Seen) -> Iterator[DraftCriterion]:
    for file in seen.files:
        records = seen.driven.records(file)
        if records:
            comment = f"seen: {len(records)} in {seconds(seen.driven.stop_ns):g} s; decide: which, and how often?"
            hint = 'write through the node\'s logger, for example self.get_logger().info("...")'
            first = f"{as_id(file.removesuffix('.py'))}_logs"
            yield DraftCriterion(first, f"{file} logs", "uses_logger", {"process": file}, hint, "", comment)


def _hertz(rate: float) -> DraftQuantity:
    return DraftQuantity(f"{float(f'{rate:.3g}'):g} Hz")


def _round_range(low: float, high: float) -> dict[str, float]:
    """Return round bounds around observed values, in proportion to their range: 20 and 30 for 20.3 to 29.8."""
    step = 10.0 ** math.floor(math.log10(high - low))
    return {"low": float(f"{math.floor(low / step) * step:.9g}"), "high": float(f"{math.ceil(high / step) * step:.9g}")}
