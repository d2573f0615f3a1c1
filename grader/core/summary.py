"""Summaries: what nodes did in one scenario, without a rubric and without a mark."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from grader.core.trace import ClockKind, Endpoint, Fault, GraphSnapshot, LogRecord, Offer, OutputLine, Start


@dataclass(frozen=True, slots=True)
class Pace:
    """How often messages came, as `ros2 topic hz` says it; times in seconds.

    Attributes:
        rate_hz: (n - 1) / (t_last - t_first).
        min_s: Shortest interval.
        max_s: Longest interval.
        std_dev_s: Standard deviation of the intervals.
    """

    rate_hz: float
    min_s: float
    max_s: float
    std_dev_s: float


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """One topic of the students' nodes.

    Attributes:
        name: Absolute name.
        types: Message types seen on it.
        publishers: Its publishers, in order of appearance.
        subscriptions: Its subscriptions, in order of appearance.
        messages: How many messages the nodes published on it.
        first_s: When the first one came; None if none came.
        pace: None for fewer than two messages at different times.
        ranges: Numeric field, dotted -> least and greatest value.
    """

    name: str
    types: tuple[str, ...]
    publishers: tuple[Endpoint, ...]
    subscriptions: tuple[Endpoint, ...]
    messages: int
    first_s: float | None
    pace: Pace | None
    ranges: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Summary:
    """What nodes did.

    Attributes:
        processes: Names of the files that ran.
        clock: Which clock they ran on.
        clock_reason: Why virtual time does not do them justice; empty if it does.
        duration_s: How long they were observed.
        nodes: Node names, sorted.
        topics: Sorted by name.
        offers: Services, clients and parameters, as the processes say.
        records: Log records, in order.
        lines: Other output, in order.
        faults: In order.
        notes: Sentences a reader must know.
        graph: The richest snapshot of the graph, if there is any.
        isolation: The sandbox tier.
        starts: How each file was started.
    """

    processes: tuple[str, ...]
    clock: ClockKind
    clock_reason: str
    duration_s: float
    nodes: tuple[str, ...]
    topics: tuple[TopicSummary, ...]
    offers: tuple[Offer, ...]
    records: tuple[LogRecord, ...]
    lines: tuple[OutputLine, ...]
    faults: tuple[Fault, ...]
    notes: tuple[str, ...]
    graph: GraphSnapshot | None
    isolation: str
    starts: tuple[Start, ...] = ()
