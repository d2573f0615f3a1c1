"""Rates, in the words of ros2 topic hz."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracing import TWIST, Recording, twist, velocity

from grader.grading.judging.checks.rate import TopicRate
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import ClockKind, Trace

RATE = TopicRate("/cmd_vel", 20.0, 1.0, 10 * NS_PER_S, 2.0)
HALF = Fraction(1, 2)


def published_at(times: list[float], stop_s: float = 10.05) -> Recording:
    rec = Recording(stop_s)
    for t in times:
        rec.message(t, "/cmd_vel", twist(), TWIST)
    return rec


def test_an_exact_rate_reads_like_topic_hz() -> None:
    """200 messages in 10 s are 20 Hz."""
    finding = RATE.judge(velocity().trace())
    assert finding.credit == 1
    assert finding.reason == (
        "/cmd_vel: 20.000 Hz on average, 200 messages 0.050 s apart; expected 20 ± 1 Hz over 10.0 s"
    )


@pytest.mark.parametrize(
    ("rate", "credit"),
    [
        (20, 1),
        (19, 1),
        (21, 1),
        (18.9, HALF),
        (18.5, HALF),
        (18, HALF),
        (22, HALF),
        (17.9, 0),
        (22.1, 0),
        (10, 0),
        (40, 0),
        (2, 0),
        (0.5, 0),
        (1000, 0),
    ],
)
def test_bands_are_inclusive(rate: float, credit: Fraction) -> None:
    """Full within 1 Hz, half within 2 Hz, nothing beyond; the edges are inside."""
    assert RATE.judge(velocity(rate).trace()).credit == credit


@pytest.mark.parametrize(
    ("rate", "hint"),
    [
        (10, "1/20 = 0.05"),
        (40, "1/20 = 0.05"),
        (2, "period in seconds"),
        (5000, "no pause"),
        (18.5, "loop with sleep"),
    ],
)
def test_a_wrong_rate_is_told_the_period(rate: float, hint: str) -> None:
    """The argument of create_timer is a period in seconds."""
    assert hint in RATE.judge(velocity(rate, stop_s=3.05 if rate > 100 else 10.05).trace()).hint


@pytest.mark.parametrize(
    ("rate", "brief"),
    [
        (10, "/cmd_vel: 10.0 Hz, expected 20 ± 1 Hz over 10.0 s"),
        (18.99, "/cmd_vel: 18.99 Hz, expected 20 ± 1 Hz over 10.0 s"),
    ],
)
def test_a_terminal_is_told_the_rate_and_what_was_expected(rate: float, brief: str) -> None:
    """With as many decimals as show that the rate is wrong."""
    assert RATE.judge(velocity(rate).trace()).brief == brief


def test_no_partly_without_a_second_tolerance() -> None:
    """Leaving it out leaves nothing between."""
    assert TopicRate("/cmd_vel", 20.0, 1.0, 10 * NS_PER_S).judge(velocity(18.5).trace()).credit == 0


def test_a_period_given_in_hertz_gives_one_message() -> None:
    """create_timer(20, ...) sends nothing more in 10 s."""
    finding = RATE.judge(published_at([20.0], 30.0).trace())
    assert finding.credit == 0
    assert "1 message, at t = 20.000 s" in finding.reason
    assert "create_timer(0.05" in finding.hint


def test_stopping_early_is_no_rate() -> None:
    """20 Hz for 5 s and then nothing is not 20 Hz over 10 s."""
    finding = RATE.judge(velocity(stop_s=5.05).trace())
    assert finding.credit == 0
    rec = velocity(stop_s=5.05)
    rec.stop_s = 10.05
    finding = RATE.judge(rec.trace())
    assert finding.credit == 0
    assert "stopped after 5.0 s" in finding.reason


def test_an_exit_is_the_reason_for_stopping() -> None:
    """The fault is named, and points to its line if it has one."""
    rec = velocity(stop_s=5.05).exited(5.05)
    rec.stop_s = 10.05
    assert "exited after" in RATE.judge(rec.trace()).reason
    rec = velocity(stop_s=5.05).crashed(5.05, line=31)
    for rec.stop_s in (10.05, 5.05):
        finding = RATE.judge(rec.trace())
        assert finding.credit == 0
        assert "node.py" not in finding.reason
        assert "velocity_publisher.py:31: ValueError: no" in finding.reason
        assert finding.location is not None


@pytest.mark.parametrize("pause_s", [0.05, 1.0])
def test_a_crash_after_which_a_node_is_started_again_is_the_reason_for_a_pause(pause_s: float) -> None:
    """Neither the period nor bursts are, whatever the delay; the crash of a node beside it makes no pause."""
    times, begins = [], 0.05
    while begins < 10:
        times += [begins + 0.05 * k for k in range(4)]
        begins += 0.2 + pause_s
    rec = published_at([t for t in times if t < 10]).crashed(times[3] + 0.04, line=31)
    finding = RATE.judge(rec.trace())
    assert finding.credit == 0
    assert finding.reason.endswith("node.py:31: ValueError: no")
    assert (finding.hint, finding.location is None) == ("", False)
    beside = RATE.judge(velocity(10).crashed(5.02, line=31).trace())
    assert (beside.credit, beside.location) == (0, None)
    assert "create_timer(0.05, ...)" in beside.hint


def test_bursts_are_no_rate() -> None:
    """20 messages at once each second have the average, not the rate."""
    times = [0.05 + second + k * 0.0001 for second in range(10) for k in range(20)]
    finding = RATE.judge(published_at(times).trace())
    assert finding.credit == 0
    assert "bursts" in finding.reason
    pairs = [0.05 + 0.1 * k for k in range(100) for _ in range(2)]
    assert "bursts" in RATE.judge(published_at(pairs).trace()).reason


def test_everything_at_one_instant_is_no_rate() -> None:
    """No interval, no rate, and no division by zero."""
    assert "all at t = 1.000 s" in RATE.judge(published_at([1.0] * 50).trace()).reason


def test_silence_is_explained() -> None:
    """Without a message the reason is that of publishing."""
    assert "no publisher" in RATE.judge(Recording().trace()).reason


def test_a_late_start_is_judged_from_the_first_message() -> None:
    """A node that thinks for 8 s first has its 10 s all the same."""
    assert RATE.judge(velocity(start_s=8.0, stop_s=18.0).trace()).credit == 1


def test_a_window_that_was_not_observed_is_not_judged_by_its_average() -> None:
    """Two seconds of 20 Hz prove nothing about ten."""
    finding = RATE.judge(velocity(start_s=8.0, stop_s=10.0).trace())
    assert finding.credit == 0
    assert "only 2.0 s could be observed" in finding.reason


def test_jitter_of_single_intervals_costs_nothing() -> None:
    """Only the average counts; a busy machine shakes intervals."""
    times = [0.05 + 0.05 * k + (0.015 if k % 2 else 0.0) for k in range(200)]
    rec = published_at(times)
    rec.clock = ClockKind.WALL
    assert RATE.judge(rec.trace()).credit == 1


def test_a_drifting_loop_is_accepted_within_the_band() -> None:
    """sleep(0.05) and 2 ms of work are 19.2 Hz."""
    assert RATE.judge(velocity(1 / 0.052).trace()).credit == 1


@settings(deadline=None)
@given(st.integers(0, 10**12), st.sampled_from([5, 10, 18, 19, 20, 21, 22, 30]))
def test_shifting_all_times_changes_no_credit(shift_ns: int, rate: float) -> None:
    """The window goes with the first message."""
    here = RATE.judge(velocity(rate).trace()).credit
    there = RATE.judge(velocity(rate, start_s=0.05 + shift_ns / 1e9, stop_s=10.05 + shift_ns / 1e9).trace()).credit
    assert here == there


@settings(deadline=None)
@given(st.floats(10, 30), st.floats(0, 5), st.floats(0, 5))
def test_credit_never_falls_as_the_tolerance_grows(rate: float, a: float, b: float) -> None:
    """A wider band accepts whatever a narrower one does."""
    trace = velocity(rate).trace()
    narrow, wide = (TopicRate("/cmd_vel", 20.0, t, 10 * NS_PER_S).judge(trace).credit for t in sorted((a, b)))
    assert narrow <= wide


TO_THE_END = TopicRate("/cmd_vel", 20, 1, partly_tolerance=2)


def driven(*paces: tuple[float, float], stop_s: float = 13.0) -> Trace:
    """Return a trace of messages at one rate after another, each until a time."""
    rec, t = Recording(stop_s=stop_s), 0.05
    for hz, until in paces:
        while t < until - 1e-9:
            rec.message(t, "/cmd_vel", {})
            t = round(t + 1 / hz, 9)
    return rec.trace()


def test_without_a_window_a_rate_holds_to_the_end() -> None:
    """However long that is."""
    assert TO_THE_END.judge(driven((20, 13.0))).credit == 1
    assert TO_THE_END.judge(driven((20, 11.0), stop_s=11.0)).credit == 1
    assert TO_THE_END.judge(driven((18.2, 13.0))).credit == Fraction(1, 2)
    assert TO_THE_END.judge(driven((10, 13.0))).credit == 0


@pytest.mark.parametrize(("hz", "said"), [(1, "/cmd_vel"), (5, "average"), (10, "Hz from t = 9")])
def test_who_lets_go_after_ten_seconds_is_found(hz: float, said: str) -> None:
    """Also where the average hides it."""
    finding = TO_THE_END.judge(driven((20, 10.05), (hz, 12.0), stop_s=12.0))
    assert finding.credit == 0
    assert said in finding.reason


def test_who_is_silent_after_ten_seconds_stopped() -> None:
    """A second of silence is enough at this rate."""
    finding = TO_THE_END.judge(driven((20, 10.05), stop_s=11.0))
    assert finding.credit == 0
    assert "stopped after 9.9 s" in finding.reason


def test_a_rate_with_a_window_looks_no_further() -> None:
    """Rubrics that name one mean it."""
    check = TopicRate("/cmd_vel", 20, 1, window=10_000_000_000)
    assert check.judge(driven((20, 10.05))).credit == 1
