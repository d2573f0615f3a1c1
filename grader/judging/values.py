"""Numbers on topics: reading them out of messages and grouping what was held."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Generic, TypeVar

from grader.core.quantities import NS_PER_MS
from grader.core.trace import ClockKind, Delivery, Message, Trace

T = TypeVar("T")
Carrier = TypeVar("Carrier", Message, Delivery)

#: How far two clock readings of one moment may lie apart.
JITTER_NS = {ClockKind.VIRTUAL: 0, ClockKind.WALL: 50 * NS_PER_MS}

_NUMERIC_TYPE = re.compile(r"std_msgs/msg/(Float(32|64)|U?Int(8|16|32|64)|Char)|sensor_msgs/msg/Temperature")


@dataclass(frozen=True, slots=True)
class Reading:
    """One number on a topic."""

    t_ns: int
    value: float


@dataclass(frozen=True, slots=True)
class Held:
    """A number that the grader repeated for a while, in [start_ns, stop_ns); the last one lasts to the trace's end."""

    start_ns: int
    stop_ns: int
    value: float


@dataclass(frozen=True, slots=True, eq=False)
class Same(Generic[T]):
    """A value as itself, for caches: checks ask the same of a trace again, and traces are too long to be compared."""

    value: T

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Same) and other.value is self.value

    def __hash__(self) -> int:
        return id(self.value)


def as_number(value: object) -> float | None:
    """Return a plain JSON value as a number; a bool, a string or a list is none."""
    if type(value) is float:  # nearly always, and this is asked very often
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def number_of(message: Message | Delivery) -> float | None:
    """Return the number that a message carries as `data` or `temperature`, or None."""
    for key in ("data", "temperature"):
        found = as_number(message.value.get(key))
        if found is not None:
            return found
    return None


def carries_number(type_: str) -> bool:
    """Return whether a message type is one of the standard ones that hold one number."""
    return _NUMERIC_TYPE.fullmatch(type_) is not None


def published(trace: Trace, topic: str) -> tuple[Message, ...]:
    """Return what the student's nodes published on a topic while it was observed."""
    return trace.once((published, topic), lambda: _observed(trace, trace.messages(topic)))


def _observed(trace: Trace, messages: tuple[Carrier, ...]) -> tuple[Carrier, ...]:
    return tuple(m for m in messages if m.t_ns < trace.stop_ns)


def delivered(trace: Trace, topic: str) -> tuple[Delivery, ...]:
    """Return what the grader published on a topic while it was observed."""
    return trace.once((delivered, topic), lambda: _observed(trace, trace.deliveries(topic)))


def published_numbers(trace: Trace, topic: str) -> tuple[Reading, ...]:
    """Return the numbers that the student's nodes published on a topic while it was observed."""
    return trace.once((published_numbers, topic), lambda: _readings(published(trace, topic)))


def delivered_numbers(trace: Trace, topic: str) -> tuple[Reading, ...]:
    """Return the numbers that the grader published on a topic while it was observed."""
    return trace.once((delivered_numbers, topic), lambda: _readings(delivered(trace, topic)))


def _readings(messages: Iterable[Message | Delivery]) -> tuple[Reading, ...]:
    """Return the numbers of those messages that carry one."""
    found = ((m.t_ns, number_of(m)) for m in messages)
    return tuple(Reading(t_ns, value) for t_ns, value in found if value is not None)


def last_of_instant(series: Sequence[Reading]) -> tuple[Reading, ...]:
    """Return one reading an instant: the last one counts."""
    return tuple({r.t_ns: r for r in series}.values())


def held(trace: Trace, topic: str, *, heard_from_ns: int = 0) -> tuple[Held, ...]:
    """Return the numbers that the grader published on a topic, equal neighbours joined.

    What was sent before `heard_from_ns`, when nobody listened, is left out, unless that is everything.
    """
    return trace.once((held, topic, heard_from_ns), lambda: _held(trace, topic, heard_from_ns))


def _held(trace: Trace, topic: str, heard_from_ns: int) -> tuple[Held, ...]:
    sent = delivered_numbers(trace, topic)
    heard = [r for r in sent if r.t_ns >= heard_from_ns] or sent
    starts: list[Reading] = []
    for reading in heard:
        if not starts or starts[-1].value != reading.value:
            starts.append(reading)
    stops = [*(s.t_ns for s in starts), trace.stop_ns][1:]
    return tuple(Held(start.t_ns, stop, start.value) for start, stop in zip(starts, stops, strict=True))


def field(value: Mapping[str, Any], path: str) -> float | None:
    """Return the number at a path such as `linear.x`, or None if there is none."""
    here: Any = value
    for name in _names(path):
        if not isinstance(here, (dict, Mapping)) or name not in here:  # a dict is known for one much faster
            return None
        here = here[name]
    return as_number(here)


@lru_cache(maxsize=256)
def _names(path: str) -> tuple[str, ...]:
    return tuple(path.split("."))


def leaves(value: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    """Return every number of a message by its path."""
    found: dict[str, float] = {}
    for name, inner in value.items():
        if isinstance(inner, (dict, Mapping)):
            found |= leaves(inner, f"{prefix}{name}.")
        elif (got := as_number(inner)) is not None:
            found[f"{prefix}{name}"] = got
    return found
