"""How an end is worded, and which limit is behind it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from grader.runtime.host.protocol import Exited, FaultReport
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB, NS_PER_S
from grader.runtime.model.trace import Fault, FaultKind
from grader.runtime.worker.ending import ending_fault, graders_fault, limit_behind, reported_fault
from grader.runtime.worker.notes import Places


class Three(Places):
    """A submission of one file, a.py, of three lines."""

    def lines(self, file: str) -> int:
        return 3 if file == "a.py" else 0


def told(data: Any, places: Places | None = None) -> Fault:
    """Return the fault that a process describes."""
    return reported_fault("a.py", 5, FaultReport.checked(data), LIMITS, places or Three(None))


LIMITS = Limits(memory_bytes=200 * MIB, processes=50, open_files=77, file_bytes=3 * MIB, scratch_bytes=5 * MIB)


@pytest.mark.parametrize(
    ("text", "limit"),
    [
        ("MemoryError", "200 MiB of memory"),
        ("numpy.core._exceptions._ArrayMemoryError: Unable to allocate 7.45 GiB", "200 MiB of memory"),
        ("OSError: [Errno 12] Cannot allocate memory", "200 MiB of memory"),
        ("RuntimeError: can't start new thread", "50 processes and threads"),
        ("BlockingIOError: [Errno 11] Resource temporarily unavailable", "50 processes and threads"),
        ("OSError: [Errno 24] Too many open files: 'x'", "77 open files"),
        ("OSError: [Errno 27] File too large", "3 MiB in one file"),
        ("OSError: [Errno 28] No space left on device", "5 MiB in one folder"),
    ],
)
def test_an_error_that_a_limit_is_behind_names_it(text: str, limit: str) -> None:
    """What Python says stays, what it means is added."""
    kind, _, message = text.partition(": ")
    fault = told({"code": "exception", "type": kind, "message": message, "file": "a.py", "line": 3})
    assert (fault.text, fault.file, fault.line) == (f"{text} (the limit is {limit})", "a.py", 3)


def test_other_errors_stay_as_they_are() -> None:
    """Most errors have nothing to do with limits."""
    assert told({"type": "ValueError", "message": "x"}).text == "ValueError: x"


@pytest.mark.parametrize("module", ["../../x.py", "inbox.py is right, give full marks.py", 7, None, "\x1b[2J.py"])
@pytest.mark.parametrize("line", [True, -1, 10**30, "7"])
def test_a_fault_of_the_grader_says_only_what_is_checked(module: object, line: object) -> None:
    """A process may claim one: its words do not get into the grader's sentence."""
    data = {"code": "grader", "type": "all is well", "module": module, "at": line, "message": "full marks"}
    said = "the grader's own code failed in the process of a.py: Exception; please report this line"
    assert graders_fault("a.py", FaultReport.checked(data)) == said
    assert told(data).text == said


def test_a_fault_of_the_grader_names_its_place() -> None:
    """What a bug report needs."""
    data = {"code": "grader", "type": "ValueError", "module": "inbox.py", "at": 48}
    expected = (
        "the grader's own code failed in the process of a.py: ValueError, inbox.py line 48; please report this line"
    )
    assert graders_fault("a.py", FaultReport.checked(data)) == expected
    assert graders_fault("a.py", FaultReport("exception")) == graders_fault("a.py", None) == ""


@pytest.mark.parametrize(
    ("signal", "last", "threads", "used_s", "said"),
    [
        ("SIGXCPU", b"", 1, 119, "stopped at 120 s of processor time"),
        ("SIGXCPU", b"", 1, 2, ""),
        ("SIGXFSZ", b"", 1, 0, "stopped at 3 MiB in one file"),
        ("SIGPWR", b"", 1, 0, "in one folder"),
        (
            "SIGABRT",
            b"terminate called after throwing an instance of 'std::bad_alloc'",
            1,
            0,
            "wrote std::bad_alloc (the limit is 200 MiB of memory",
        ),
        ("SIGABRT", b"", 49, 0, "ended by SIGABRT (the limit is 50 processes and threads)"),
        (
            "SIGABRT",
            b"terminate called after throwing an instance of 'std::system_error'",
            20,
            0,
            "ended by SIGABRT (the limit is 50 processes and threads)",
        ),
        ("SIGABRT", b"", 20, 0, ""),
        ("SIGKILL", b"std::bad_alloc", 50, 0, ""),
    ],
)
def test_a_signal_that_a_limit_is_behind_names_it(
    signal: str, last: bytes, threads: int, used_s: int, said: str
) -> None:
    """Where nothing explains the signal, nothing is made up."""
    found = limit_behind(signal, last, threads, used_s * NS_PER_S, LIMITS)
    assert said in found
    assert bool(found) == bool(said)


@pytest.mark.parametrize("code", [True, "0", None, 1.5, [0], 10**30])
def test_an_absurd_exit_is_worded_all_the_same(code: Any) -> None:
    """The code of a report is untrusted as everything else in it."""
    fault = ending_fault("a.py", 5, Exited.checked({"code": code}), LIMITS, Places(None))
    assert fault.kind is FaultKind.EXITED
    assert len(fault.text) < 100


@pytest.fixture
def places(tmp_path: Path) -> Places:
    """A submission with a file of three lines, an empty one, a link, a folder and a pipe."""
    (tmp_path / "src").mkdir()
    (tmp_path / "src/a.py").write_text("1\n2\n3")
    (tmp_path / "empty.py").write_text("")
    (tmp_path / "link.py").symlink_to("/etc/passwd")
    (tmp_path / "below").symlink_to("src")
    os.mkfifo(tmp_path / "pipe.py")
    return Places(tmp_path)


@pytest.mark.parametrize(
    ("file", "line", "found"),
    [
        ("src/a.py", 3, ("src/a.py", 3)),
        ("src/a.py", 4, ("src/a.py", 0)),
        ("src/a.py", 0, ("src/a.py", 0)),
        ("src/a.py", -1, ("src/a.py", 0)),
        ("src/a.py", 10**30, ("src/a.py", 0)),
        ("src/a.py", True, ("src/a.py", 0)),
        ("src/a.py", "3", ("src/a.py", 0)),
        ("empty.py", 1, ("empty.py", 1)),
        ("../../etc/passwd", 1, ("", 0)),
        ("/etc/passwd", 1, ("", 0)),
        ("src/../src/a.py", 1, ("", 0)),
        ("./src/a.py", 1, ("", 0)),
        ("src//a.py", 1, ("", 0)),
        ("src/a.py/", 1, ("", 0)),
        ("below/a.py", 1, ("", 0)),
        ("link.py", 1, ("", 0)),
        ("pipe.py", 1, ("", 0)),
        ("src", 1, ("", 0)),
        ("missing.py", 1, ("", 0)),
        ("a\0.py", 1, ("", 0)),
        ("\ud800", 1, ("", 0)),
        ("x" * 5000, 1, ("", 0)),
        ("", 1, ("", 0)),
        (["src/a.py"], 1, ("", 0)),
        (None, 1, ("", 0)),
    ],
)
def test_a_fault_names_only_places_that_there_are(places: Places, file: str, line: int, found: tuple[str, int]) -> None:
    """Files of the submission, spelt as they are, and lines that exist; the same for every frame."""
    fault = told({"code": "exception", "file": file, "line": line, "frames": [[file, line, "tick"]]}, places)
    assert (fault.file, fault.line) == found
    assert fault.frames == ((f"{file}:{line} in tick",) if found[1] else ())


def test_what_is_missing_at_the_end_of_a_file_is_in_its_last_line(places: Places) -> None:
    """Python places it one line further."""
    fault = told({"code": "syntax_error", "type": "SyntaxError", "message": "x", "file": "src/a.py", "line": 4}, places)
    assert (fault.kind, fault.line) == (FaultKind.SYNTAX_ERROR, 3)


@pytest.mark.parametrize("name", ["tick", "<module>", "<lambda>", "größe"])
def test_functions_have_names(places: Places, name: Any) -> None:
    """A frame tells where, in words that Python has for it."""
    assert told({"frames": [["src/a.py", 1, name]]}, places).frames == (f"src/a.py:1 in {name}",)


@pytest.mark.parametrize("name", ["the machine failed", "<the machine>", "", "x" * 101, 5, None])
def test_a_sentence_is_no_function(places: Places, name: Any) -> None:
    """The name of a code object can be anything."""
    assert told({"frames": [["src/a.py", 1, name]]}, places).frames == ()


@pytest.mark.parametrize(
    ("name", "message", "text"),
    [
        ("KeyError", "'a'", "KeyError: 'a'"),
        ("rclpy.exceptions.InvalidTopicNameException", "", "rclpy.exceptions.InvalidTopicNameException"),
        ("f.<locals>.Ärger", "x", "f.<locals>.Ärger: x"),
        ("the machine failed", "x", "Exception: x"),
        ("a" * 201, "x", "Exception: x"),
        (None, "x", "Exception: x"),
        ("KeyError", ["x"], "KeyError"),
        ("KeyError", "a\n  b\r\nc", "KeyError: a b c"),
    ],
)
def test_an_exception_is_told_in_its_own_words(name: Any, message: str, text: str) -> None:
    """Behind the name of its class, on one line."""
    assert told({"code": "exception", "type": name, "message": message}).text == text


def test_own_words_are_bounded() -> None:
    """However long an exception is."""
    assert len(told({"type": "KeyError", "message": "x" * 10_000}).text) == 500


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("start_limit", "did not return within 10 s of processor time"),
        ("wake_up_limit", "did not return within 5 s of processor time"),
        ("blocked", "waited 5 s for something outside the ROS graph"),
        ("alarm", "sets an alarm that rings in real time"),
    ],
)
def test_a_node_that_does_not_come_back_is_told_in_our_words(code: Any, text: str) -> None:
    """Whatever it sends besides its code."""
    fault = told({"code": code, "type": "x", "message": "the machine failed", "text": "y"})
    assert (fault.kind, fault.text) == (FaultKind.HUNG, text)


@pytest.mark.parametrize("data", [None, 5, [], "x", {}, {"code": ["alarm"]}, {"code": "killed"}])
def test_what_is_no_fault_is_an_exception_without_words(data: Any) -> None:
    """Nothing of it is shown."""
    fault = told(data)
    assert (fault.kind, fault.text, fault.file, fault.frames) == (FaultKind.EXCEPTION, "Exception", "", ())
