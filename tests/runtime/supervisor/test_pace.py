"""Which of two recordings in virtual time is slower: a share that rubrics do not notice is none."""

from collections.abc import Sequence

import pytest

from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.trace import ClockKind, LogRecord, Message, Trace
from grader.runtime.supervisor.pace import SLOWER, keeps_pace, slower_share

STOP_NS = 10 * NS_PER_S


def trace(times_ns: Sequence[float], *, logs: bool = False) -> Trace:
    """Return a recording of ten seconds with messages, or log records, at some times."""
    made = [
        LogRecord(round(t), "a.py", "INFO", "a", "x", "", 0) if logs else Message(round(t), "/x", "T", {}, b"")
        for t in times_ns
        if t < STOP_NS
    ]
    return Trace("alone", ClockKind.VIRTUAL, STOP_NS, tuple(made))


def every(period_ms: float, *, first_ms: float = 0) -> list[float]:
    return [(first_ms + period_ms * n) * NS_PER_MS for n in range(round(10_000 / period_ms) + 1)]


@pytest.mark.rule(23)
@pytest.mark.parametrize("logs", [False, True])
@pytest.mark.parametrize("period_ms", [10, 50, 1000])
def test_what_comes_more_slowly_is_told(period_ms: float, logs: bool) -> None:
    """Messages and records alike, from a certain share on; what comes later by the same time each time is as fast."""
    before = trace(every(period_ms), logs=logs)
    assert keeps_pace(before, before)
    assert keeps_pace(before, trace(every(period_ms, first_ms=45), logs=logs))
    assert keeps_pace(before, trace(every(period_ms * (1 + SLOWER / 2)), logs=logs))
    assert not keeps_pace(before, trace(every(period_ms * (1 + 2 * SLOWER)), logs=logs))


def test_what_does_not_come_any_more_is_slower() -> None:
    """Nothing at all, or nothing after a while."""
    before = trace(every(50))
    assert not keeps_pace(before, trace([]))
    assert not keeps_pace(before, trace(every(50)[:100]))


def test_work_of_varying_length_before_each_message_is_not_slower() -> None:
    """15 to 45 ms, before a sleep until the next moment."""
    later = [t + (15 + n * 7 % 31) * NS_PER_MS for n, t in enumerate(every(50))]
    assert keeps_pace(trace(every(50)), trace(later))


def test_two_events_have_no_pace() -> None:
    """Whether an answer comes late is judged otherwise."""
    assert keeps_pace(trace([0, NS_PER_S]), trace([0, 2 * NS_PER_S]))


def test_how_much_slower_a_recording_is_follows_from_its_slowest_channel() -> None:
    """By its period or by its beginning; one that is as fast is not slower, and one that is silent is all of it."""
    before = trace(every(50))
    assert slower_share(before, before) == 0
    assert slower_share(before, trace(every(40))) == 0
    assert slower_share(before, trace(every(62.5))) == pytest.approx(0.2)
    assert slower_share(before, trace(every(50, first_ms=1000))) == pytest.approx(0.1)
    assert slower_share(before, trace([])) == 1
    logs = trace(every(80), logs=True)
    both = Trace("alone", before.clock, STOP_NS, before.observations + logs.observations)
    slower = trace(every(100), logs=True).observations
    assert slower_share(both, Trace("alone", before.clock, STOP_NS, before.observations + slower)) == pytest.approx(0.2)
