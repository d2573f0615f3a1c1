"""Returns what an idle machine may have recorded, and how much of that a busy one has had time to show; pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from grader.grading.judging.agreement import ends_in
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    Fault,
    GraphSnapshot,
    LogRecord,
    Message,
    Observation,
    Offer,
    OutputLine,
    Request,
    Response,
    Trace,
)

#: On the wall clock, a program that pauses after its work loses the time that it waits for a processor. If it waited
#: for more than this share of the time, the recording may be another one on an idle machine: at higher speeds, up to
#: that of a program that did not wait, and earlier. Longer waits count as the longest. Where virtual time counts the
#: work of the nodes, no share is ordinary: only a busy machine makes one.
_ORDINARY_WAIT, _LONGEST_WAIT = 0.03, 0.9
#: The number of speeds, a tenth apart at most, which is less than rubrics allow a rate to be wrong; and of delays.
_SPEEDS, _DELAYS = 24, 8


def quicker(assessed: AssessedTrace) -> Iterator[Trace]:
    """Yield what an idle machine may have recorded; nothing if the nodes did not wait for a processor.

    A wait makes a program slower all the time, or late by one delay: at its beginning, with its answers, or with its
    logs. Whatever the chain of threads is from a program to the recording, a delay takes no longer than all of them
    waited together.
    """
    trace = assessed.recorded
    ordinary = _ORDINARY_WAIT if trace.clock is ClockKind.WALL else 0
    if assessed.most_starved_ns <= ordinary * trace.stop_ns:
        return
    longest_ns = round(_LONGEST_WAIT * trace.stop_ns)
    slower_ns, late_ns = (min(waited, longest_ns) for waited in (assessed.most_starved_ns, assessed.all_starved_ns))
    for step in range(1, _SPEEDS + 1):
        left = (1 - slower_ns / trace.stop_ns) ** (step / _SPEEDS)
        observations = tuple(replace(one, t_ns=round(one.t_ns * left)) for one in trace.observations)
        yield replace(trace, stop_ns=round(trace.stop_ns * left), observations=observations)
    for step in range(1, _DELAYS + 1) if late_ns else ():
        yield _begun_earlier(trace, late_ns * step // _DELAYS)
        yield _answered_earlier(trace, late_ns * step // _DELAYS)
    yield from (_logged_earlier(trace, late_ns * step // _DELAYS) for step in range(1, _DELAYS + 1) if late_ns)


def shown_until_ns(idle: Trace, busy: AssessedTrace, starts_ns: tuple[int, int]) -> int:
    """Return until when a recording of an idle machine tells what another one has had time to show.

    Where the nodes waited for a processor, they come up later, by no more than all of them waited together, and are
    slower from then on.

    Args:
        idle: The whole recording.
        busy: Another one of the same plan, on the wall clock.
        starts_ns: When the observation began in each.
    """
    length_ns = busy.stop_ns - starts_ns[1]
    if busy.most_starved_ns <= _ORDINARY_WAIT * busy.stop_ns:
        return starts_ns[0] + length_ns
    if not starts_ns[1]:  # nothing may have come that begins the observation
        starts_ns = 0, 0
    wanted, seen = (_first_seen(t, start_ns) for t, start_ns in zip((idle, busy.recorded), starts_ns, strict=True))
    late_ns = max((seen.get(end, length_ns) - t_ns for end, t_ns in wanted.items() if t_ns < length_ns), default=0)
    late_ns = max(0, min(late_ns, busy.all_starved_ns, length_ns))
    own_share = 1 - min(_LONGEST_WAIT, busy.most_starved_ns / busy.stop_ns)
    return starts_ns[0] + round((length_ns - late_ns) * own_share)


def _first_seen(trace: Trace, start_ns: int) -> dict[tuple[str, str, str], int]:
    """Return how long after a time each end was first in the graph, in nanoseconds."""
    found: dict[tuple[str, str, str], int] = {}
    for graph in trace.graphs():
        for end in ends_in(graph):
            found.setdefault(end, max(0, graph.t_ns - start_ns))
    return found


def _begun_earlier(trace: Trace, by_ns: int) -> Trace:
    """Return a recording as if its programs had begun earlier, and everything else with them."""
    first_ns = next((one.t_ns for one in trace.observations if _channel(one)), 0)
    by_ns = min(by_ns, first_ns)
    observations = (replace(one, t_ns=max(0, one.t_ns - by_ns)) for one in trace.observations)
    return replace(trace, stop_ns=trace.stop_ns - by_ns, observations=tuple(observations))


def _answered_earlier(trace: Trace, by_ns: int) -> Trace:
    """Return a recording as if its programs had begun and answered earlier, but not before what they were given.

    What a program sends on a topic until it is given something else keeps its distances.
    """
    given_ns = 0
    earlier_ns: dict[str, int] = {}  # of each channel since then
    observations: list[Observation] = []
    for one in trace.observations:
        channel = _channel(one)
        if not channel:
            given_ns, earlier_ns = (given_ns, earlier_ns) if isinstance(one, _OF_GRAPH) else (one.t_ns, {})
            observations.append(one)
            continue
        moved_ns = earlier_ns.setdefault(channel, min(by_ns, one.t_ns - given_ns))
        observations.append(replace(one, t_ns=one.t_ns - moved_ns))
    return replace(trace, observations=tuple(sorted(observations, key=lambda one: one.t_ns)))


def _logged_earlier(trace: Trace, by_ns: int) -> Trace:
    """Return a recording as if whatever a program writes had come right after what was recorded before it.

    A program that waits for a processor between a message and its log may send the next messages at once, to catch up.
    """
    before_ns = 0
    observations: list[Observation] = []
    for one in trace.observations:
        moved = one
        if isinstance(one, (LogRecord, OutputLine)):
            moved = replace(one, t_ns=max(before_ns, one.t_ns - by_ns))
        before_ns = moved.t_ns
        observations.append(moved)
    return replace(trace, observations=tuple(observations))


#: Not sent by anybody: whoever sends something is in the graph before.
_OF_GRAPH = (GraphSnapshot, Offer)


def _channel(one: Observation) -> str:
    """Return what a program uses to send something; empty for what is given to it, and for what it does not send."""
    match one:
        case Message():
            return f"topic {one.topic}"
        case Request() | Response():
            return f"service {one.service}" if one.sender == "student" else ""
        case LogRecord() | OutputLine():
            return f"log {one.process}"
        case Fault():
            return f"end {one.process}"
    return ""
