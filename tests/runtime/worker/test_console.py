"""Standard error in ROS's own format: where records begin and end, and what ended a program."""

import pytest

from grader.runtime.host.protocol import FaultReport
from grader.runtime.model.trace import LogRecord, OutputLine
from grader.runtime.worker.console import Logged, last_traceback, read_console, thread_tracebacks

STAMP = "1767225600.000000042"


def lines(*texts: str, stream: str = "stderr") -> list[OutputLine]:
    return [OutputLine(n, "a.py", stream, text) for n, text in enumerate(texts)]


def logged(text: str, file: str = "/s/a.py", line: int = 7, arrived_ns: int = 0) -> tuple[int, Logged]:
    return arrived_ns, Logged(1767225600, 42, "node", text, file, line)


def relative(path: str) -> str:
    return path.removeprefix("/s/") if path.startswith("/s/") else ""


def test_a_record_has_the_place_that_its_logger_publishes() -> None:
    """The console tells when and what, /rosout tells where."""
    (record,) = read_console(lines(f"[WARN] [{STAMP}] [node]: hello"), [logged("hello")], relative)
    assert record == LogRecord(0, "a.py", "WARN", "node", "hello", "a.py", 7)


@pytest.mark.parametrize(("arrived_ns", "t_ns"), [(1, 1), (3, 2)])
def test_a_record_counts_from_when_it_was_first_known(arrived_ns: int, t_ns: int) -> None:
    """The console may be read late, and /rosout may be discovered late."""
    told = logged("hello", arrived_ns=arrived_ns)
    found = read_console(lines("", "", f"[WARN] [{STAMP}] [node]: hello"), [told], relative)
    assert [one.t_ns for one in found if one] == [0, 1, t_ns]


def test_a_record_of_several_lines_is_one() -> None:
    """Blank lines, which no output keeps, do not matter; what was printed after it stays a line."""
    found = read_console(
        lines(f"[INFO] [{STAMP}] [node]: x: 1", "y: 2", "after"), [logged("x: 1\n\ny: 2", file="/other.py")], relative
    )
    assert found == [LogRecord(0, "a.py", "INFO", "node", "x: 1\n\ny: 2"), None, lines("", "", "after")[2]]


def test_a_record_that_nobody_publishes_is_its_first_line() -> None:
    """Loggers of modules have no node; what follows may be anybody's."""
    found = read_console(lines(f"[INFO] [{STAMP}] [module]: a", "b"), [], relative)
    assert [type(one) for one in found] == [LogRecord, OutputLine]


def test_standard_output_holds_no_records() -> None:
    """print() of something that looks like a record is print()."""
    given = lines(f"[INFO] [{STAMP}] [node]: a", stream="stdout")
    assert read_console(given, [logged("a")], relative) == given


TRACEBACK = (
    "Traceback (most recent call last):",
    '  File "/s/a.py", line 12, in main',
    "    tick()",
    '  File "/usr/lib/python3/x.py", line 3, in f',
    "ValueError: no number",
)


def test_the_exception_that_ended_a_program_is_its_last_traceback() -> None:
    """With the student's own frames."""
    found = last_traceback("\n".join(("before", *TRACEBACK, "")), "/s")
    frames = [("a.py", 12, "main")]
    assert found == FaultReport("exception", "ValueError", "no number", file="a.py", line=12, frames=frames)


def test_a_traceback_that_a_program_survived_ended_nothing() -> None:
    """It went on to log."""
    assert last_traceback("\n".join((*TRACEBACK, f"[INFO] [{STAMP}] [node]: goes on")), "/s") is None
    assert last_traceback("bye", "/s") is None


def test_a_syntax_error_has_its_line() -> None:
    """Python writes no traceback for one."""
    found = last_traceback('  File "/s/a.py", line 3\n    def f(:\n          ^\nSyntaxError: invalid syntax\n', "/s")
    assert found is not None
    assert (found.code, found.file, found.line) == ("syntax_error", "a.py", 3)


def test_a_thread_ends_while_the_program_goes_on() -> None:
    """Its traceback is a fault where it stands, and none of the program."""
    texts = ["x", "Exception in thread Thread-1 (work):", *TRACEBACK, "y"]
    assert list(thread_tracebacks(texts, "/s")) == [2]
    assert last_traceback("\n".join(texts), "/s") is None
