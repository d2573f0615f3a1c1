"""Sums a trace up for people who want to see what nodes do, without judging them."""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from grader.core.quantities import NS_PER_S, seconds
from grader.core.summary import Pace, Summary, TopicSummary
from grader.core.trace import Message, Offer, Trace
from grader.judging.judge import started


def summarise(trace: Trace, processes: Sequence[str], isolation: str) -> Summary:
    """Return what the nodes of a trace did.

    Args:
        trace: What was recorded.
        processes: Names of the files that ran.
        isolation: The sandbox tier.
    """
    graphs = trace.graphs()
    names = {e.topic for g in graphs for e in g.endpoints}
    return Summary(
        processes=tuple(processes),
        clock=trace.clock,
        clock_reason=trace.clock_reason,
        duration_s=seconds(trace.stop_ns),
        nodes=tuple(sorted({node for g in graphs for node in g.nodes})),
        topics=tuple(_topic(trace, name) for name in sorted(names)),
        offers=tuple(o for o in trace.observations if isinstance(o, Offer)),
        records=trace.records(),
        lines=trace.lines(),
        faults=trace.faults(),
        notes=(*started(trace), *trace.notes),
        starts=trace.starts,
        graph=max(graphs, key=lambda g: len(g.endpoints), default=None),
        isolation=isolation,
    )


def _topic(trace: Trace, name: str) -> TopicSummary:
    messages = trace.messages(name)
    publishers, subscriptions = trace.endpoints("publisher", name), trace.endpoints("subscription", name)
    return TopicSummary(
        name=name,
        types=tuple(dict.fromkeys(e.type for e in (*publishers, *subscriptions))),
        publishers=publishers,
        subscriptions=subscriptions,
        messages=len(messages),
        first_s=seconds(messages[0].t_ns) if messages else None,
        pace=_pace(messages),
        ranges=_ranges(messages),
    )


def _pace(messages: Sequence[Message]) -> Pace | None:
    times = [m.t_ns for m in messages]
    if len(times) < 2 or times[-1] == times[0]:
        return None
    gaps = [(later - earlier) / NS_PER_S for earlier, later in itertools.pairwise(times)]
    # n - 1 gaps, not n: counting messages overstates a short window
    return Pace(len(gaps) * NS_PER_S / (times[-1] - times[0]), min(gaps), max(gaps), statistics.pstdev(gaps))


def _ranges(messages: Sequence[Message]) -> dict[str, tuple[float, float]]:
    ranges: dict[str, tuple[float, float]] = {}
    for message in messages:
        for name, value in _numbers(message.value, ""):
            low, high = ranges.get(name, (value, value))
            ranges[name] = (min(low, value), max(high, value))
    return ranges


def _numbers(value: Any, name: str) -> Iterator[tuple[str, float]]:
    """Yield the finite numbers of a message by their dotted names; lists are left out, they have no names."""
    if isinstance(value, Mapping):
        for key, field in value.items():
            yield from _numbers(field, f"{name}.{key}" if name else key)
    elif isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
        yield name, float(value)
