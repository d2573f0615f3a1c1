"""Reasons that hold both numbers, and checks that do not take one thing for another."""

from __future__ import annotations

from tracing import FAN_VALUES, Recording, scripted

from grader.grading.judging.checks.logs import UsesLogger
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.trace import FaultKind

ON = known_checks()["threshold_response"]("/temperature", "/fan_speed", 25, 100, 0, "above")


def test_the_further_lines_of_an_exceptions_text_are_not_printing() -> None:
    """They are not indented below the traceback, as printed lines are not."""
    text = "InvalidTopicNameException: Invalid topic name: it must not contain a space: '/cmd vel' ^"
    rec = Recording(1.0, process="node.py").fault(0.0, FaultKind.EXCEPTION, text, 9)
    rows = ["Traceback (most recent call last):", "InvalidTopicNameException: Invalid topic name: it must not contain"]
    for row in [*rows, "a space:", "'/cmd vel'", "     ^"]:
        rec.line(0.0, row, "stderr")
    assert UsesLogger("node.py").judge(rec.trace()).credit == 0
    assert UsesLogger("node.py").judge(rec.line(0.0, "hello").trace()).credit > 0


def test_a_proportional_controller_is_not_told_about_rounding() -> None:
    """It answers just above the threshold with something that is neither on nor off."""
    rec = scripted()
    for k in range(10 * len(FAN_VALUES)):
        rec.number(0.5 + 0.2 * k, "/fan_speed", max(0.0, 20 * (FAN_VALUES[k // 10] - 25)))
    finding = ON.judge(rec.trace())
    assert finding.credit == 0
    assert "rounding" not in finding.hint
