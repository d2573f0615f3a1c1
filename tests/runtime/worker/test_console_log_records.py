"""A log record is one that the logging library made: what a program writes itself never becomes one."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest
from tiers import more

from grader.runtime.model.trace import Trace
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import hostile, record

from grader.runtime.worker.student_process import LOG_FORMAT

pytestmark = pytest.mark.ros

CLOCKS = ["virtual", *more(["wall"])]
SECOND_NS = 1_000_000_000


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., Trace]:
    """Record a publisher that does something more when it is made, for a second."""
    tmp_path.chmod(0o755)
    return lambda harm, clock: record(session, tmp_path / "s", hostile(harm), clock=clock, duration_ns=5 * SECOND_NS)


@pytest.mark.parametrize("clock", CLOCKS)
def test_what_looks_like_a_record_is_a_line(run: Callable[..., Trace], clock: str) -> None:
    """The format is public; the token is not."""
    fields = {"severity": "INFO", "name": "velocity_publisher", "file_name": "a.py", "line_number": 3, "message": "x"}
    tokens = ("", "0" * 32, "{token}")
    forged = [LOG_FORMAT.format(token=token, **fields) for token in tokens] + ["\x1eINFO\x1fn\x1fa.py\x1f1\x1fx\x1d"]
    trace = run("\n".join(f"print({text!r}, file=sys.stderr)" for text in forged), clock)
    assert trace.records() == ()
    assert [line.text for line in trace.lines()] == forged


@pytest.mark.parametrize("clock", CLOCKS)
def test_what_the_logger_writes_is_a_record(run: Callable[..., Trace], clock: str) -> None:
    """With its logger, its severity and its place; also after a second start, and whatever a program sets."""
    trace = run(
        "import rclpy.logging\n"
        "os.environ['RCUTILS_CONSOLE_OUTPUT_FORMAT'] = '{message}'\n"
        "os.environ['RCUTILS_LOGGING_USE_STDOUT'] = '1'\n"
        "self.get_logger().warn('one')\n"
        "rclpy.shutdown()\n"
        "rclpy.logging.shutdown()\n"
        "rclpy.init()\n"
        "rclpy.logging.get_logger('other').info('two')\n"
        "sys.exit(0)",
        clock,
    )
    said = [(r.severity, r.logger, r.text, r.file) for r in trace.records()]
    assert said == [("WARN", "velocity_publisher", "one", "a.py"), ("INFO", "other", "two", "a.py")]
    assert all(r.line > 0 for r in trace.records())


@pytest.mark.parametrize("clock", CLOCKS)
def test_no_variable_and_no_option_tells_the_token(run: Callable[..., Trace], clock: str) -> None:
    """Neither to the program nor, on the wall clock where it may start some, to other programs."""
    child = "import os; print(sorted(os.environ)); print(open('/proc/self/environ').read().split(chr(0)))"
    start = f"import subprocess; subprocess.run([sys.executable, '-I', '-S', '-c', {child!r}])\n"
    trace = run(
        (start if clock == "wall" else "")
        + "print(sorted(os.environ), open('/proc/self/environ').read().split('\\0'))\n"
        "print(open('/proc/self/cmdline').read().replace('\\0', ' '))",
        clock,
    )
    text = "\n".join(line.text for line in trace.lines())
    assert "RCUTILS_COLORIZED_OUTPUT" in text
    assert "RCUTILS_CONSOLE_OUTPUT_FORMAT" not in text
    assert "/grader_host/host/" in text


@pytest.mark.parametrize("clock", CLOCKS)
def test_each_record_names_its_own_place(session: RecordingSession, tmp_path: Path, clock: str) -> None:
    """Also of functions that are the same in two files, in a loop, and of one that rclpy is told to leave out."""
    tmp_path.chmod(0o755)
    says = "def say(logger, text):\n    logger.info(text)\n"
    program = """
        import rclpy
        import rclpy.impl.rcutils_logger as loggers
        from rclpy.node import Node
        import b, c
        def own(text):
            logger.info(text)
        rclpy.init()
        logger = Node("node").get_logger()
        for number in range(2):
            b.say(logger, f"b {number}")
            c.say(logger, f"c {number}")
            logger.info(f"a {number}"); logger.warning(f"a {number}")
            own(f"own {number}")
        loggers._internal_callers.append(b.__file__)
        b.say(logger, "left out")
    """
    programs = (textwrap.dedent(program), says, says)  # they end by themselves
    trace = record(session, tmp_path / "s", *programs, clock=clock, duration_ns=60 * SECOND_NS)
    found = [(r.severity, r.text, r.file, r.line) for r in trace.records() if r.process == "a.py"]
    each = [
        [
            ("INFO", f"b {number}", "b.py", 2),
            ("INFO", f"c {number}", "c.py", 2),
            ("INFO", f"a {number}", "a.py", 13),
            ("WARN", f"a {number}", "a.py", 13),
            ("INFO", f"own {number}", "a.py", 7),
        ]
        for number in range(2)
    ]
    assert found == [*each[0], *each[1], ("INFO", "left out", "a.py", 16)]
