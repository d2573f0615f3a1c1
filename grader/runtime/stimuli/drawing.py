"""Draws times, counts, orders and fields of messages from the seed."""

from __future__ import annotations

import inspect
import math
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any, TypeVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS
from grader.runtime.model.scenario import (
    AnyOrder,
    Between,
    Choose,
    Count,
    CountBetween,
    FieldSpec,
    InOrder,
    Planned,
    SomeOf,
    Stimulus,
    Time,
    TimeBetween,
    Written,
)


@dataclass(frozen=True, slots=True)
class Draws:
    """What a stimulus is planned from, besides itself."""

    own: random.Random  # of this stimulus alone: another one beside it changes nothing
    # Of the numbers and recordings of the scenario in turn: a seed that somebody noted still gives the same values
    shared: random.Random
    until_ns: int = 0  # when the observation ends; 0 if that is not known
    recordings: Mapping[Any, Any] = field(default_factory=dict)  # the recording of each stimulus that plays one


def drawn_time(time: Time, draw: random.Random) -> int:
    """Draw a time in nanoseconds; a fixed time consumes no randomness."""
    if not isinstance(time, TimeBetween):
        return time
    # both ends are included, even if they are not whole milliseconds
    return min(time.high_ns, time.low_ns + NS_PER_MS * draw.randint(0, -(-(time.high_ns - time.low_ns) // NS_PER_MS)))


def drawn_count(count: Count, draw: random.Random) -> int:
    """Draw a count; a fixed count consumes no randomness."""
    return draw.randint(count.low, count.high) if isinstance(count, CountBetween) else count


def in_drawn_order(items: Sequence[Any], draw: random.Random) -> list[Any]:
    """Flatten a list of cases and draw their order; a list with a fixed order consumes no randomness."""
    return [case for item in items for block in _blocks(item, draw) for case in block]


def _blocks(item: Any, draw: random.Random) -> list[list[Any]]:
    """Expand an item to its cases; cases that must stay together form one list."""
    if isinstance(item, InOrder):
        return [list(item.items)]
    if isinstance(item, SomeOf):
        return [[draw.choice(item.items)] for _ in range(drawn_count(item.count, draw))]
    if isinstance(item, AnyOrder):
        blocks = [block for inner in item.items for block in _blocks(inner, draw)]
        draw.shuffle(blocks)
        return blocks
    return [[item]]


Made = TypeVar("Made", bound=Planned)
Fields = Mapping[str, Any]


def planned_as(kind: Callable[..., Made], stimulus: Stimulus, **drawn: Any) -> Made:
    """Build a planned stimulus from drawn values, and take all other fields from the scenario."""
    same = {name: getattr(stimulus, name) for name in inspect.signature(kind).parameters if name not in drawn}
    return kind(**same, **drawn)


def drawn_fields(fields: Mapping[str, FieldSpec], draw: random.Random) -> Fields:
    """Draw every value in the fields of a message."""
    return {name: _drawn(value, draw) for name, value in fields.items()}


def _drawn(value: FieldSpec, draw: random.Random) -> Any:
    if isinstance(value, Mapping):
        return drawn_fields(value, draw)
    if isinstance(value, tuple):
        return [_drawn(item, draw) for item in value]
    if isinstance(value, Choose):
        return draw.choice(value.options)
    if isinstance(value, Written):
        number = draw.uniform(value.number.low, value.number.high)
        return value.text.replace("{}", f"{number:.{value.decimals}f}")
    return drawn_number(value, draw) if isinstance(value, Between) else value


def drawn_number(spec: Between, draw: random.Random) -> int | float:
    """Draw a number: an integer between integer bounds, otherwise rounded to a hundredth of the range or finer."""
    if float(spec.low).is_integer() and float(spec.high).is_integer():
        return draw.randint(int(spec.low), int(spec.high))
    decimals = max(2, 2 - math.floor(math.log10(spec.high - spec.low)))
    return round(draw.uniform(spec.low, spec.high), decimals)
