"""Compares two recordings in virtual time, without and with the time of the nodes' work: does it slow a node down?"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from grader.runtime.model.quantities import NS_PER_MS
from grader.runtime.model.trace import LogRecord, Message, OutputLine, Request, Response, Trace

#: A node that is slower by a smaller share keeps its pace: little more than half of what the strictest rubrics notice,
#: which allow a rate to be wrong by 5 %. Near this share the wall clock and virtual time lead to the same verdict.
SLOWER = 0.03
#: So much later are messages that a node sends after its work, without being slower.
LATER_NS = 40 * NS_PER_MS
#: Two recordings of fewer events say nothing about a pace.
FEWEST = 3

Key = tuple[str, ...]


def keeps_pace(plain: Trace, charged: Trace) -> bool:
    """Return whether everything comes as fast as without the time of the work.

    Args:
        plain: A recording in which no time passes while nodes work.
        charged: Another of the same plan, in which it does.
    """
    before, after = _times(plain), _times(charged)
    return all(_kept(times, after.get(key, ()), charged.stop_ns) for key, times in before.items())


def slower_share(before: Trace, after: Trace) -> float:
    """Return by what share of its time a recording is slower than another of the same plan, from 0 to 1.

    That of the channel that is slowed down most counts; it is 1 if a channel has nothing at all.

    Args:
        before: The faster recording.
        after: The slower one.
    """
    fast, slow = _times(before), _times(after)
    return max((_slowed(times, slow.get(key, ()), after.stop_ns) for key, times in fast.items()), default=0.0)


def _times(trace: Trace) -> dict[Key, list[int]]:
    """Return the times of what each node has sent and written, by channel."""
    found: dict[Key, list[int]] = defaultdict(list)
    for one in trace.observations:
        if one.t_ns >= trace.stop_ns:
            continue
        if isinstance(one, Message):
            found["topic", one.topic].append(one.t_ns)
        elif isinstance(one, (Request, Response)):
            found[type(one).__name__, one.service].append(one.t_ns)
        elif isinstance(one, LogRecord):
            found["log", one.process].append(one.t_ns)
        elif isinstance(one, OutputLine):
            found[one.stream, one.process].append(one.t_ns)
    return found


def _kept(before: Sequence[int], after: Sequence[int], stop_ns: int) -> bool:
    if len(before) < FEWEST:
        return True
    if not after:
        return False
    span_ns, later_ns = _spans(before, after, stop_ns)
    return later_ns <= max(SLOWER * span_ns, LATER_NS)


def _slowed(before: Sequence[int], after: Sequence[int], stop_ns: int) -> float:
    if not after:
        return 1.0
    span_ns, later_ns = _spans(before, after, stop_ns)
    begins_ns = max(0, after[0] - before[0])
    return max(later_ns / (span_ns + later_ns) if later_ns > 0 else 0.0, begins_ns / stop_ns)


def _spans(before: Sequence[int], after: Sequence[int], stop_ns: int) -> tuple[int, int]:
    """Return from the first to the last event that both have: how long it took, and how much longer the other time."""
    if len(after) < len(before):  # the next one would have come after the end
        after = [*after, max(stop_ns, after[-1])]
    last = min(len(before), len(after)) - 1
    span_ns = before[last] - before[0]
    return span_ns, after[last] - after[0] - span_ns
