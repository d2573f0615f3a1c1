"""Reasons that hold both numbers, and checks that do not take one thing for another."""

from __future__ import annotations

import pytest
from tracing import FAN_VALUES, Recording, position_logs, scripted

from grader.core.trace import FaultKind
from grader.judging.checks.logs import UsesLogger
from grader.judging.checks.odometry import LogsPosition
from grader.rubrics.exercise_checks import known_checks

POSITION = LogsPosition("odom_subscriber.py", "/odom")
ON = known_checks()["threshold_response"]("/temperature", "/fan_speed", 25, 100, 0, "above")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x={y:.3f} y={x:.3f}", "x and y are swapped"),
        ("x={x:.3f} y=0.000", "the second value is z of the position, not y"),
    ],
)
def test_wrong_positions_are_shown_beside_the_right_ones(text: str, said: str) -> None:
    """The first log that is settled, with its time, and where the robot was."""
    times = [6.0 + k for k in range(14)]
    finding = POSITION.judge(position_logs(lambda x, y: text.format(x=x, y=y), times).trace())
    assert finding.reason.startswith(f"odom_subscriber.py: {said}: at t = 6.000 s the log says 'x=")
    assert finding.reason.endswith(") m")


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
