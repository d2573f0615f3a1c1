"""Logging through the logger, by printing, and not at all."""

from __future__ import annotations

from fractions import Fraction

import pytest
from tracing import Recording

from grader.grading.judging.checks.logs import UsesLogger

CHECK = UsesLogger("node.py")

TRACEBACK = [
    "Traceback (most recent call last):",
    '  File "node.py", line 31, in <module>',
    "    main()",
    "    ~~~~^^",
    "KeyboardInterrupt",
]


@pytest.mark.parametrize("severity", ["DEBUG", "INFO", "WARN", "ERROR", "FATAL"])
def test_a_record_of_any_severity_is_met(severity: str) -> None:
    """The level does not matter, nor does the text."""
    assert CHECK.judge(Recording().log(1.0, "", severity).trace()).credit == 1


def test_printing_is_half() -> None:
    """The hint tells how to log."""
    for stream in ("stdout", "stderr"):
        finding = CHECK.judge(Recording().line(1.0, "hello", stream).trace())
        assert finding.credit == Fraction(1, 2)
        assert "self.get_logger().info" in finding.hint


def test_nothing_is_nothing() -> None:
    """No output, or that of another process."""
    assert CHECK.judge(Recording().trace()).credit == 0
    assert (
        CHECK.judge(Recording().log(1.0, "x", process="other.py").line(1, "y", process="other.py").trace()).credit == 0
    )


def test_a_quotation_is_the_same_in_every_run() -> None:
    """The repr of an object contains its address; the report leaves that out."""
    finding = CHECK.judge(Recording().log(1.0, "made <node.Talker object at 0x7f3a5c0d1e50>").trace())
    assert finding.reason.endswith("made <node.Talker object>")


@pytest.mark.parametrize(
    "lines",
    [
        TRACEBACK,
        ["Exception in thread Thread-1 (work):", *TRACEBACK],
        [*TRACEBACK, "", "During handling of the above exception, another exception occurred:", "", *TRACEBACK],
        ["/submission/node.py:7: SyntaxWarning: invalid escape sequence '\\d'", "  pattern = '\\d'"],
        ["usage: node.py [-h] --rate RATE", "node.py: error: the following arguments are required: --rate"],
        ["[INFO] [1698765432.123] [node]: hello"],
        ["Fatal Python error: Segmentation fault"],
        ["   ", ""],
    ],
)
def test_what_the_interpreter_writes_is_no_printing(lines: list[str]) -> None:
    """Tracebacks, warnings and usage texts on stderr earn nothing; a print after them does."""
    rec = Recording()
    for k, line in enumerate(lines):
        rec.line(1.0 + k / 100, line, "stderr")
    assert CHECK.judge(rec.trace()).credit == 0
    assert CHECK.judge(rec.line(2.0, "printed", "stderr").trace()).credit == Fraction(1, 2)


def test_what_rclpy_logs_by_itself_is_not_the_students() -> None:
    """A warning about QoS comes through the node's logger, from no line of the student's."""
    text = "New publisher discovered on topic '/odom', offering incompatible QoS. No messages will be received from it."
    assert CHECK.judge(Recording().log(1.0, text, "WARN").trace()).credit == 0
    assert CHECK.judge(Recording().log(1.0, text, "WARN", line=9).trace()).credit == 1


def test_a_crash_before_any_log_is_the_reason() -> None:
    """The fault is named with its line."""
    finding = CHECK.judge(Recording().crashed(0.0, "NameError: name 'x' is not defined", 8).trace())
    assert finding.reason == "node.py:8: NameError: name 'x' is not defined; nothing was logged"
    assert finding.location is not None


def test_a_log_before_a_crash_counts() -> None:
    """What was earned stays earned."""
    assert CHECK.judge(Recording().log(0.0, "started").crashed(1.0).trace()).credit == 1


@pytest.mark.parametrize("logger", ["rmw_fastrtps_shared_cpp", "rcl", "rcl.logging_rosout", "rmw_dds_common"])
def test_what_the_layers_below_rclpy_write_is_not_the_students(logger: str) -> None:
    """They complain when a node fails; that is no logging of its own."""
    assert CHECK.judge(Recording().log(1.0, "Attempted to delete a topic", logger=logger).trace()).credit == 0


@pytest.mark.parametrize("logger", ["rclone", "rmwatch", "rcl"])
def test_a_students_logger_may_have_a_name_like_theirs(logger: str) -> None:
    """What is logged in a file of the student's is the student's, whatever the logger is called."""
    assert CHECK.judge(Recording().log(1.0, "hello", logger=logger, line=5).trace()).credit == 1
    assert CHECK.judge(Recording().log(1.0, "hello", logger=f"my_{logger}").trace()).credit == 1
