"""Waiting for data on a silent topic."""

from __future__ import annotations

import pytest
from tracing import driving, position_logs
from wordings import plain

from grader.grading.judging.checks.waiting import WaitsGracefully
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import FaultKind

WAITS = WaitsGracefully("odom_subscriber.py", "/odom", 5 * NS_PER_S)


def test_waiting_and_then_working_is_met() -> None:
    """Warnings and prints while waiting are fine."""
    rec = position_logs(plain).log(1.0, "no odometry yet", "WARN").line(2.0, "still waiting")
    finding = WAITS.judge(rec.trace())
    assert finding.credit == 1
    assert finding.evidence["silence_s"] == pytest.approx(5.0)


@pytest.mark.parametrize("severity", ["ERROR", "FATAL"])
def test_error_records_while_waiting_are_not_graceful(severity: str) -> None:
    """The first such record is quoted with its line."""
    finding = WAITS.judge(position_logs(plain).log(1.0, "NO ODOM", severity, line=33).trace())
    assert finding.credit == 0
    assert "NO ODOM" in finding.reason
    assert finding.location is not None
    assert finding.location.line == 33


def test_an_exception_on_missing_data_is_named_with_its_remedy() -> None:
    """The classic: the timer reads a message that has not come."""
    rec = driving().crashed(1.0, "AttributeError: 'NoneType' object has no attribute 'pose'", 20)
    finding = WAITS.judge(rec.trace())
    assert finding.credit == 0
    assert "odom_subscriber.py:20: AttributeError" in finding.reason
    assert "while nothing was published on /odom" in finding.reason
    assert "None" in finding.hint


def test_an_early_exit_is_not_graceful() -> None:
    """A node that ends itself has its own words."""
    finding = WAITS.judge(position_logs(plain, [6.0, 7.0]).exited(8.0).trace())
    assert finding.credit == 0
    assert "exited after 8.0 s with code 0" in finding.reason
    assert "keep the node running" in finding.hint


@pytest.mark.parametrize("kind", list(FaultKind))
def test_no_fault_is_graceful(kind: FaultKind) -> None:
    """Hanging and being killed count like raising."""
    assert WAITS.judge(position_logs(plain).fault(3.0, kind, "stopped").trace()).credit == 0


def test_silence_after_the_data_came_leaves_the_question_open() -> None:
    """Alive, but without a sign that it works: the position criterion names the mistake."""
    finding = WAITS.judge(driving().log(0.0, "started").trace())
    assert finding.blocked_by == "/odom"
    assert "no sign that the data arrived" in finding.reason


def test_a_recording_without_the_silence_cannot_be_judged() -> None:
    """That is the grader's fault, not the student's."""
    with pytest.raises(HarnessError, match="no silence"):
        WaitsGracefully("odom_subscriber.py", "/odom", 6 * NS_PER_S).judge(position_logs(plain).trace())


def test_waiting_that_goes_on_as_before_is_no_sign_of_data() -> None:
    """A node that never spins logs that it waits, before the data and after."""
    rec = driving()
    for t in range(1, 24):
        rec.log(float(t), "waiting for odometry", process="odom_subscriber.py")
    finding = WAITS.judge(rec.trace())
    assert finding.credit == 0
    assert finding.blocked_by == "/odom"


def test_a_text_that_was_not_there_before_is_a_sign_of_data() -> None:
    """Also without a number."""
    rec = driving()
    for t in range(1, 24):
        rec.log(float(t), "waiting" if t < 6 else "odometry received", process="odom_subscriber.py")
    assert WAITS.judge(rec.trace()).credit == 1
