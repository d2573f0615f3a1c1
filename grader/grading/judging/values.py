"""Contents of messages: fields by path, numbers, and the rules that a rubric sets for fields."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import lru_cache, wraps
from types import MappingProxyType
from typing import Any, Concatenate, ParamSpec, TypeVar

from grader.grading.model.exercise import Check
from grader.grading.model.measures import Reading
from grader.grading.model.wording import number, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, FieldNumber, Pattern, within
from grader.runtime.model.trace import ClockKind, Delivery, Endpoint, Message, Trace

T = TypeVar("T")
P = ParamSpec("P")
#: Largest difference between two numbers that count as equal.
EXACT = 1e-6
#: Largest difference between two clock readings of one moment.
JITTER_NS = {ClockKind.VIRTUAL: 0, ClockKind.WALL: 50 * NS_PER_MS}
_NUMERIC_TYPE = re.compile(
    r"(std_msgs|example_interfaces)/msg/(Float(32|64)|U?Int(8|16|32|64)|Char)"
    r"|sensor_msgs/msg/(FluidPressure|Illuminance|RelativeHumidity|Temperature)"
)


#: How many messages or responses are enough to judge the beginning of a recording.
FEW = 3


@dataclass(frozen=True, slots=True)
class Held:
    """A number that the grader repeated in [start_ns, stop_ns); the last one lasts until the trace ends."""

    start_ns: int
    stop_ns: int
    value: float

    @property
    def t_ns(self) -> int:
        """When it came."""
        return self.start_ns


class FewSuffice:
    """A check of every message or response on its own, whose number only a whole recording shows."""

    __slots__ = ()

    def of_beginning(self) -> Check:
        """Return the check for a beginning: see `grader.grading.model.exercise.BeginningCheck`."""
        own: Any = self
        fewer: Check = replace(own, at_least=min(own.at_least, FEW))
        return fewer


def per_trace(find: Callable[Concatenate[Trace, P], T]) -> Callable[Concatenate[Trace, P], T]:
    """Make a function remember its result for each trace and arguments; these must be hashable."""

    @wraps(find)
    def found(trace: Trace, /, *args: P.args, **kwargs: P.kwargs) -> T:
        return trace.once((find, args, *kwargs.items()), lambda: find(trace, *args, **kwargs))

    return found


def as_number(value: object) -> float | None:
    """Return a plain JSON value as a number; None for a bool, string or list."""
    if type(value) is float:  # the common case, and this is called very often
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def number_path(value: Mapping[str, object]) -> str:
    """Return the path of the number that a message stands for; empty if it stands for none.

    That is `data`, or else its only number apart from a variance, as in `sensor_msgs/msg/FluidPressure`.
    """
    if as_number(value.get("data")) is not None:
        return "data"
    found = [name for name, inner in value.items() if name != "variance" and as_number(inner) is not None]
    return found[0] if len(found) == 1 else ""


def number_of(message: Message | Delivery, field: str = "") -> float | None:
    """Return the number in a field of a message, by default the one that it stands for, or None."""
    path = field or number_path(message.value)
    return number_at(message.value, path) if path else None


def carries_number(type_: str) -> bool:
    """Return whether a message type is a standard one that holds a single number."""
    return _NUMERIC_TYPE.fullmatch(type_) is not None


@per_trace
def published(trace: Trace, topic: str, after_discovery: bool = False) -> tuple[Message, ...]:  # noqa: FBT001, FBT002
    """Return the messages of the student's nodes on a topic during the observation.

    Args:
        trace: The trace.
        topic: The topic.
        after_discovery: Whether those do not count that were sent before anybody could have discovered the publisher.
    """
    found = (m for m in trace.messages(topic) if m.t_ns < trace.stop_ns)
    return tuple(m for m in found if not (after_discovery and m.before_discovery))


@per_trace
def delivered(trace: Trace, topic: str) -> tuple[Delivery, ...]:
    """Return the grader's messages on a topic during the observation."""
    return tuple(d for d in trace.deliveries(topic) if d.t_ns < trace.stop_ns)


@per_trace
def published_numbers(trace: Trace, topic: str, field: str = "") -> tuple[Reading, ...]:
    """Return the numbers that the student's nodes published on a topic during the observation; see `number_of`."""
    return _readings(published(trace, topic), field)


@per_trace
def delivered_numbers(trace: Trace, topic: str, field: str = "") -> tuple[Reading, ...]:
    """Return the numbers that the grader published on a topic during the observation; see `number_of`."""
    return _readings(delivered(trace, topic), field)


def _readings(messages: Iterable[Message | Delivery], field: str) -> tuple[Reading, ...]:
    """Return the numbers of those messages that hold one."""
    found = ((m.t_ns, number_of(m, field)) for m in messages)
    return tuple(Reading(t_ns, value) for t_ns, value in found if value is not None)


@per_trace
def held(trace: Trace, topic: str, field: str = "", *, heard_from_ns: int = 0) -> tuple[Held, ...]:
    """Return the numbers that the grader published on a topic, merging equal neighbours.

    Numbers sent before `heard_from_ns`, without a subscriber, are left out, unless that would leave none.
    """
    sent = delivered_numbers(trace, topic, field)
    received = [r for r in sent if r.t_ns >= heard_from_ns] or sent
    starts: list[Reading] = []
    for reading in received:
        if not starts or starts[-1].value != reading.value:
            starts.append(reading)
    stops = [*(s.t_ns for s in starts), trace.stop_ns][1:]
    return tuple(Held(start.t_ns, stop, start.value) for start, stop in zip(starts, stops, strict=True))


@lru_cache(maxsize=256)
def _names(path: str) -> tuple[str, ...]:
    return tuple(re.sub(r"\[([0-9]+)\]", r".\1", path).split("."))


def numbers_by_path(value: Mapping[str, object], prefix: str = "") -> dict[str, float]:
    """Return every number of a message by path."""
    found: dict[str, float] = {}
    for name, inner in value.items():
        if isinstance(inner, (dict, Mapping)):
            found |= numbers_by_path(inner, f"{prefix}{name}.")
        elif (got := as_number(inner)) is not None:
            found[f"{prefix}{name}"] = got
    return found


class NoSuchField(KeyError):  # noqa: N818 - says what is missing, and never ends a run
    """A value has no field at that path."""


def at_path(value: Mapping[str, object], path: str) -> Any:
    """Return the part of a value at a path; raises NoSuchField if there is none.

    Args:
        value: The fields of a message.
        path: Names joined by dots, with list elements counted from 0: `linear.x`, `ranges[0]` or `ranges.0`.
    """
    here: object = value
    for name in _names(path):
        if isinstance(here, (dict, Mapping)) and name in here:  # the check for dict is much faster
            here = here[name]
        elif isinstance(here, (list, tuple)) and name.isdecimal() and len(name) < 9 and int(name) < len(here):
            here = here[int(name)]
        else:
            raise NoSuchField(path)
    return here


def value_at(value: Mapping[str, object], path: str, default: object = None) -> Any:
    """Return the part of a value at a path, or the default if the path does not exist."""
    try:
        return at_path(value, path)
    except NoSuchField:
        return default


def message_at(value: Mapping[str, object], path: str) -> Mapping[str, object]:
    """Return the message at a path, or an empty one if there is none."""
    found = value_at(value, path)
    return found if isinstance(found, Mapping) else {}


def goal_id(value: Mapping[str, object], path: str = "goal_id") -> str:
    """Return the id at a path in a message or call of an action, as text that can be compared."""
    return json.dumps(value_at(value, f"{path}.uuid"), default=str)


def number_at(value: Mapping[str, object], path: str) -> float | None:
    """Return the number at a path, or None if there is none."""
    return as_number(value_at(value, path))


def text_at(value: Mapping[str, object], path: str) -> str | None:
    """Return the text at a path, or None if there is none."""
    found = value_at(value, path)
    return found if isinstance(found, str) else None


#: The longest text that is matched against a pattern, in characters: an author's pattern may need quadratic time.
LONGEST_MATCHED = 2_000
_YES_OR_NO = MappingProxyType({"yes": True, "no": False})


def _slack(value: object, edge: float) -> float:
    """Return how far a number may be beyond an edge of its range: as far as single precision rounds a fraction."""
    return 0.0 if isinstance(value, int) else max(EXACT, abs(edge) * 2.0**-24)


def equals(got: float, want: float, tolerance: float) -> bool:
    """Return whether a field has a value within a tolerance; infinities and NaN equal only themselves."""
    if math.isfinite(want):
        return within(got, want, tolerance)
    return got == want or (math.isnan(got) and math.isnan(want))


@dataclass(frozen=True, slots=True)
class FieldRule:
    """The rule for one field; all given parameters apply.

    Attributes:
        equals: Expected text, number or truth value.
        items: Expected list elements, in order.
        pattern: Regular expression that must match the whole text.
        example: A matching text, shown instead of the pattern.
    """

    equals: str | FieldNumber | bool | None = None
    items: tuple[str | FieldNumber | bool, ...] | None = None
    tolerance: float = 1e-6
    low: FieldNumber | None = None
    high: FieldNumber | None = None
    pattern: Pattern | None = None
    example: str | None = None

    def allows(self, value: object) -> bool:
        """Return whether a field may hold a value; NaN is in no range and equals only NaN."""
        equal = self.equals is None or self._equal(value, self.equals)
        return equal and self._listed(value) and self._in_range(value) and self._of_form(value)

    def _equal(self, value: object, wanted: str | float | bool) -> bool:  # noqa: FBT001 - the value of a field
        if isinstance(value, bool) and isinstance(wanted, str):
            return _YES_OR_NO.get(wanted.lower()) is value  # in YAML, yes is a text
        if isinstance(wanted, (bool, str)):
            return type(value) is type(wanted) and value == wanted
        got = as_number(value)
        return got is not None and equals(got, wanted, self.tolerance)

    def _listed(self, value: object) -> bool:
        if self.items is None:
            return True
        if not isinstance(value, (list, tuple)) or len(value) != len(self.items):
            return False
        return all(self._equal(got, wanted) for got, wanted in zip(value, self.items, strict=True))

    def _in_range(self, value: object) -> bool:
        if self.low is None and self.high is None:
            return True
        got = as_number(value)
        if got is None or math.isnan(got):
            return False
        low = -math.inf if self.low is None else self.low - _slack(value, self.low)
        high = math.inf if self.high is None else self.high + _slack(value, self.high)
        return low <= got <= high

    def _of_form(self, value: object) -> bool:
        if self.pattern is None:
            return True
        if not isinstance(value, str) or len(value) > LONGEST_MATCHED:
            return False
        return re.fullmatch(self.pattern, value) is not None

    @property
    def wanted(self) -> str:
        """The expected value, for text."""
        parts = []
        if self.equals is not None:
            parts.append(shown_value(self.equals))
        if self.items is not None:
            parts.append(shown_value(self.items))
        if self.low is not None and self.high is not None:
            parts.append(f"{number(self.low)} to {number(self.high)}")
        elif self.low is not None:
            parts.append(f"at least {number(self.low)}")
        elif self.high is not None:
            parts.append(f"at most {number(self.high)}")
        if self.pattern is not None:
            parts.append(f"a text such as {quote(self.example)!r}" if self.example else f"a text like {self.pattern!r}")
        return " and ".join(parts) or "any value"


#: A rule, or just the expected value.
RuleOrValue = str | FieldNumber | bool | FieldRule


def as_rule(rule: RuleOrValue, tolerance: float = 1e-6) -> FieldRule:
    """Return the rule for an expected value; a rule stays as it is."""
    return rule if isinstance(rule, FieldRule) else FieldRule(equals=rule, tolerance=tolerance)


def broken_rules(value: Mapping[str, object], rules: Mapping[str, RuleOrValue], tolerance: float = 1e-6) -> list[str]:
    """Return the paths whose rules a value breaks, in order; the tolerance applies to plain expected values."""
    return [path for path, rule in rules.items() if not _keeps(value, path, as_rule(rule, tolerance))]


def _keeps(value: Mapping[str, object], path: str, rule: FieldRule) -> bool:
    try:
        return rule.allows(at_path(value, path))
    except NoSuchField:
        return False


def breach(value: Mapping[str, object], path: str, rule: RuleOrValue) -> str:
    """Return the found and the expected value at a path, as a clause."""
    try:
        found = f"{path} is {shown_value(at_path(value, path))}"
    except NoSuchField:
        found = f"there is no field {path}"
    return f"{found}, expected {as_rule(rule).wanted}"


def shown_value(value: object) -> str:
    """Return a field's value as text."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"{quote(value, 80)!r}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(shown_value, value[:20]))}{', ...' if len(value) > 20 else ''}]"
    got = as_number(value)
    return number(got) if got is not None else quote(str(value), 80)


def rules_text(rules: Mapping[str, RuleOrValue]) -> str:
    """Return rules as text: `success true, message a text such as ...`."""
    return ", ".join(f"{path} {as_rule(rule).wanted}" for path, rule in rules.items())


#: Topics that every node has.
HIDDEN_TOPICS = frozenset({"/rosout", "/parameter_events", "/clock"})


def student_endpoints(trace: Trace, kind: str | None = None, topic: str | None = None) -> tuple[Endpoint, ...]:
    """Return the endpoints of student nodes, on one topic or all, without duplicates, in order of appearance."""
    kinds = (kind,) if kind else ("publisher", "subscription")
    return tuple(e for k in kinds for e in trace.endpoints(k, topic) if on_student_topic(e))


def on_student_topic(endpoint: Endpoint) -> bool:
    """Return whether an endpoint is the student's own, and not one that every node has."""
    return endpoint.participant != -1 and endpoint.topic not in HIDDEN_TOPICS


def heard_from_ns(trace: Trace, topic: str) -> int:
    """Return when the first subscription to a topic appeared; 0 if unknown."""
    for graph in trace.graphs():
        if any(map(on_student_topic, graph.ends_of_topics("subscription", topic))):
            return graph.t_ns
    return 0
