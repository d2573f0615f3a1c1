"""Gaps, delays and silence: right, wrong by each mistake, at the edge, and cut short by a crash."""

from __future__ import annotations

import pytest
from tracing import Recording

from grader.grading.judging.checks.timing import Latency, Period, Silence
from grader.grading.judging.findings import FAULT_KEY
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.trace import ClockKind

GAPS = Period("/a", least=90 * NS_PER_MS, largest=200 * NS_PER_MS, average=100 * NS_PER_MS)
SOON = Latency("/in", "/out", 300 * NS_PER_MS)


def at(times: list[float], topic: str = "/a", clock: ClockKind = ClockKind.VIRTUAL) -> Recording:
    rec = Recording(10.0, clock)
    for t in times:
        rec.number(t, topic, t)
    return rec


STEADY = [1 + 0.1 * k for k in range(50)]


@pytest.mark.parametrize(
    ("times", "clock", "credit", "said"),
    [
        (STEADY, ClockKind.VIRTUAL, 1, "gaps from 0.100 s to 0.100 s"),
        ([*STEADY, 6.1], ClockKind.VIRTUAL, 1, ""),
        ([*STEADY, 6.101], ClockKind.VIRTUAL, 0, "t = 5.900 s, /a: 0.201 s to the next message"),
        ([*STEADY, 5.99], ClockKind.VIRTUAL, 1, ""),
        ([*STEADY, 5.98], ClockKind.VIRTUAL, 0, "0.08 s to the next"),
        ([*STEADY, 6.14], ClockKind.WALL, 1, ""),
        ([1 + 0.15 * k for k in range(30)], ClockKind.VIRTUAL, 0, "0.150 s on average; expected"),
        ([1.0, 1.1], ClockKind.VIRTUAL, 0, "2 messages, expected at least 3"),
        ([], ClockKind.VIRTUAL, 0, "no publisher"),
    ],
)
def test_gaps_are_judged_one_by_one_and_on_average(
    times: list[float], clock: ClockKind, credit: int, said: str
) -> None:
    """The edges are inside; the wall clock has 50 ms more."""
    finding = GAPS.judge(at(times, clock=clock).trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_a_crash_explains_too_few() -> None:
    """For a topic as for an answer."""
    assert FAULT_KEY in GAPS.judge(at([1.0]).crashed(1.05).trace()).evidence
    gone = at([1.1], "/out").crashed(1.5)
    for k in range(8):
        gone.deliver(1.0 + k, "/in", {"data": 1.0})
    assert FAULT_KEY in SOON.judge(gone.trace()).evidence
    assert FAULT_KEY in SOON.judge(at([1.1], "/out").crashed(1.5).trace()).evidence


def following(delay: float | None, every: int = 1, clock: ClockKind = ClockKind.VIRTUAL) -> Recording:
    rec = Recording(10.0, clock)
    for k in range(9):
        rec.deliver(1.0 + k, "/in", {"data": float(k)})
        if delay is not None and k % every == 0:
            rec.number(1.0 + k + delay, "/out", k)
    return rec


@pytest.mark.parametrize(
    ("rec", "credit", "said"),
    [
        (following(0.0), 1, "within 0.000 s after 9 inputs"),
        (following(0.3), 1, "within 0.300 s after"),
        (following(0.31), 0, "t = 1.000 s, /out: a message only after 0.310 s"),
        (following(0.34, clock=ClockKind.WALL), 1, ""),
        (following(-0.02, clock=ClockKind.WALL), 1, ""),
        (following(0.1, every=2), 0, "so after 4 of 9 inputs"),
        (following(None), 0, "/out: no publisher"),
    ],
)
def test_an_output_follows_soon(rec: Recording, credit: int, said: str) -> None:
    """After every input, up to and including the time asked for."""
    finding = SOON.judge(rec.trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_a_share_may_be_enough_and_a_student_may_be_the_input() -> None:
    """The last input is left out if its time is not over."""
    assert Latency("/in", "/out", 300 * NS_PER_MS, share=0.5).judge(following(0.1, every=2).trace()).credit == 1
    rec = Recording(10.0).number(1, "/in", 1).number(1.1, "/out", 1).number(9.9, "/in", 1)
    assert SOON.judge(rec.trace()).credit == 1
    with pytest.raises(HarnessError):
        SOON.judge(Recording(10.0).number(1.1, "/out", 1).number(9.9, "/in", 1).trace())
    assert SOON.judge(Recording(10.0).number(1.1, "/out", 1).trace()).blocked_by == "publishes"


def stopping(last: float, clock: ClockKind = ClockKind.VIRTUAL) -> Recording:
    rec = at([1 + 0.1 * k for k in range(round((last - 1) * 10) + 1)], clock=clock)
    return rec.mark(1.0, "stream_starts", "/in").mark(5.0, "stream_stops", "/in")


@pytest.mark.parametrize(
    ("check", "rec", "credit", "said"),
    [
        (Silence("/a", after="stream_stops"), stopping(4.9), 1, "no message from 5.000 s to 10.000 s"),
        (Silence("/a", after="stream_stops"), stopping(5.0), 0, "1 message from 5.000 s"),
        (Silence("/a", after="stream_stops", grace=NS_PER_S), stopping(5.9), 1, "from 6.000 s"),
        (Silence("/a", after="stream_stops", grace=NS_PER_S), stopping(6.0), 0, "the first at t = 6.000 s"),
        (Silence("/a", after="stream_stops"), stopping(5.0, ClockKind.WALL), 1, ""),
        (Silence("/a", before="stream_starts"), stopping(4.0), 1, "from 0.000 s to 1.000 s"),
        (Silence("/a", before="stream_stops", of="/in"), stopping(4.0), 0, "31 messages from 0.000 s to 5.000 s"),
        (Silence("/a", duration=NS_PER_S), stopping(4.0), 1, "to 1.000 s"),
        (Silence("/b"), stopping(9.0), 1, ""),
    ],
)
def test_a_window_without_a_message(check: Silence, rec: Recording, credit: int, said: str) -> None:
    """After a moment, before one, or by its length."""
    finding = check.judge(rec.trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_a_dead_node_is_not_silent() -> None:
    """Its fault is the reason; a moment that never came is ours."""
    check = Silence("/a", after="stream_stops")
    assert FAULT_KEY in check.judge(stopping(4.0).crashed(4.0).trace()).evidence
    assert FAULT_KEY in check.judge(at([1.0]).crashed(2.0).trace()).evidence
    for never in (check, Silence("/a", after="stream_stops", of="/other")):
        with pytest.raises(HarnessError):
            never.judge(at([1.0]).trace())
    with pytest.raises(HarnessError):
        Silence("/a", after="stream_stops", before="stream_starts").judge(stopping(4.0).trace())
