"""The period of position logs."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracing import Recording, position_logs
from wordings import plain

from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import ClockKind, Trace

LOG_PERIOD = known_checks()["log_period"]
PERIOD = LOG_PERIOD("odom_subscriber.py", "/odom", NS_PER_S)


@pytest.mark.parametrize(("period", "credit"), [(0.9, 1), (1.0, 1), (1.1, 1), (0.89, 0), (1.12, 0), (0.5, 0), (2.0, 0)])
def test_the_average_period_decides(period: float, credit: int) -> None:
    """1 s ± 10 %, the edges inside; every 30th message at 26.8 Hz is 1.12 s and outside."""
    times = [5.5 + k * period for k in range(100) if 5.5 + k * period < 24]
    assert PERIOD.judge(position_logs(plain, times).trace()).credit == credit


def test_a_gap_in_the_middle_is_named() -> None:
    """The right average with a long pause is not a period."""
    times = [5.5 + 0.9 * k for k in range(9)] + [15.5 + 0.9 * k for k in range(9)]
    finding = PERIOD.judge(position_logs(plain, times).trace())
    assert finding.credit == 0
    assert "12.7 s to 15.5 s" in finding.reason


def test_logs_that_begin_late_are_not_enough() -> None:
    """The first log must come within 2.2 periods."""
    assert PERIOD.judge(position_logs(plain, [8.0 + k for k in range(14)]).trace()).credit == 0
    assert PERIOD.judge(position_logs(plain, [7.1 + k for k in range(14)]).trace()).credit == 1


def test_printed_positions_have_a_period_too() -> None:
    """What is only printed is judged by its times all the same."""
    assert PERIOD.judge(position_logs(plain, printed=True).trace()).credit == 1


def test_the_stream_is_taken_from_the_deliveries_where_no_mark_is_there() -> None:
    """Marks are a help, not a need."""
    rec = position_logs(plain)
    rec.items = [o for o in rec.items if type(o).__name__ != "Mark"]
    assert PERIOD.judge(rec.trace()).credit == 1


@given(st.floats(0.3, 2.5), st.floats(0.0, 0.5), st.floats(0.0, 0.5))
def test_credit_never_falls_as_the_tolerance_grows(period: float, a: float, b: float) -> None:
    """A wider band accepts whatever a narrower one does."""
    times = [5.5 + k * period for k in range(100) if 5.5 + k * period < 24]
    trace = position_logs(plain, times).trace()
    narrow, wide = (LOG_PERIOD("odom_subscriber.py", "/odom", NS_PER_S, t).judge(trace).credit for t in sorted((a, b)))
    assert narrow <= wide


def test_numbers_of_other_messages_have_a_period_too() -> None:
    """A rubric about another topic may use this check; its chart does not speak of positions."""
    rec = (
        Recording(12.0, process="listener.py").mark(2.0, "stream_starts", "/level").mark(12.0, "stream_stops", "/level")
    )
    for k in range(100):
        rec.deliver(2.0 + k / 10, "/level", {"data": 0.5 + k})
    for k in range(10):
        rec.log(2.5 + k, f"level {k}")
    check, trace = LOG_PERIOD("listener.py", "/level", NS_PER_S), rec.trace()
    assert check.judge(trace).credit == 1
    assert check.drawing(trace).title == "When numbers were logged"
    assert PERIOD.drawing(position_logs(plain).trace()).title == "When positions were logged"


def test_a_recording_in_which_nothing_was_played_cannot_be_judged() -> None:
    """That is the grader's fault, not the student's."""
    with pytest.raises(HarnessError, match="nothing was played"):
        PERIOD.judge(Trace("alone", ClockKind.VIRTUAL, NS_PER_S, ()))
