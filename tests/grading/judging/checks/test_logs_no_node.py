"""What is written by a file that is no node, and the prompt of an input() that has no keyboard."""

from __future__ import annotations

from fractions import Fraction

from tracing import TWIST, Recording

from grader.grading.judging.checks.logs import LogsMatching, UsesLogger
from grader.runtime.model.trace import FaultKind

CHECK = UsesLogger("node.py")
MATCHING = LogsMatching("node.py", "speed")


def nobody() -> Recording:
    """A recording in which no node was ever in the graph."""
    return Recording().snapshot(10.0, [])


def test_a_file_that_is_no_node_earns_nothing() -> None:
    """Neither logged nor printed; the hint tells what to do."""
    for rec in (nobody().log(1.0, "speed 1"), nobody().line(1.0, "speed 1"), nobody().line(0.0, "speed 1").exited(0.0)):
        for check in (CHECK, MATCHING):
            finding = check.judge(rec.trace())
            assert finding.credit == 0
        assert "no node in the ROS graph in 10.0 s" in CHECK.judge(rec.trace()).reason
    assert (
        MATCHING.judge(nobody().log(1.0, "speed 1").trace()).hint == "create the node, and log with node.get_logger()"
    )


def test_a_node_that_logged_and_ended_at_once_may_not_have_been_seen() -> None:
    """The graph takes a moment to tell."""
    assert CHECK.judge(nobody().log(0.0, "started").exited(0.0).trace()).credit == 1
    assert CHECK.judge(nobody().log(0.0, "started").exited(5.0).trace()).credit == 0


def test_the_node_of_another_file_is_not_this_ones() -> None:
    """A node is known by the name of its logger."""
    rec = Recording().endpoint("publisher", "/cmd_vel", TWIST, "/other").log(1.0, "hello", logger="main")
    assert CHECK.judge(rec.trace()).credit == 1
    rec.log(1.0, "hi", process="other.py", logger="other")
    assert CHECK.judge(rec.trace()).credit == 0


def test_the_prompt_of_an_input_is_no_line() -> None:
    """What was printed before it is."""
    rec = Recording().endpoint("publisher", "/cmd_vel", TWIST).line(0.0, "speed? ")
    rec.fault(0.0, FaultKind.EXCEPTION, "EOFError: EOF when reading a line", 3)
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 0
    assert "node.py:3: EOFError" in finding.reason
    rec = Recording().endpoint("publisher", "/cmd_vel", TWIST).line(0.0, "speed control").line(0.0, "speed? ")
    rec.fault(0.0, FaultKind.EXCEPTION, "EOFError: EOF when reading a line", 3)
    assert CHECK.judge(rec.trace()).credit == Fraction(1, 2)
