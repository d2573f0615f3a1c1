"""Draws what a rubric leaves open besides values: times, counts, and the order of cases."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

from grader.model.quantities import NS_PER_MS
from grader.model.scenario import AnyOrder, Count, CountBetween, InOrder, SomeOf, Time, TimeBetween


def drawn_time(time: Time, draw: random.Random) -> int:
    """Return a time in nanoseconds; one that is fixed takes nothing from the source."""
    if not isinstance(time, TimeBetween):
        return time
    # the ends as they are written are inside, also where they are no whole milliseconds
    return min(time.high_ns, time.low_ns + NS_PER_MS * draw.randint(0, -(-(time.high_ns - time.low_ns) // NS_PER_MS)))


def drawn_count(count: Count, draw: random.Random) -> int:
    """Return a count; one that is fixed takes nothing from the source."""
    return draw.randint(count.low, count.high) if isinstance(count, CountBetween) else count


def in_drawn_order(items: Sequence[Any], draw: random.Random) -> list[Any]:
    """Return the cases one by one; a list in which nothing is open comes back as it is and takes nothing."""
    return [case for item in items for block in _blocks(item, draw) for case in block]


def _blocks(item: Any, draw: random.Random) -> list[list[Any]]:
    """Return what an item comes to: cases that belong together are one list."""
    if isinstance(item, InOrder):
        return [list(item.items)]
    if isinstance(item, SomeOf):
        return [[draw.choice(item.items)] for _ in range(drawn_count(item.count, draw))]
    if isinstance(item, AnyOrder):
        blocks = [block for inner in item.items for block in _blocks(inner, draw)]
        draw.shuffle(blocks)
        return blocks
    return [[item]]
