"""How files were started, and an exception's own words, in the sentences that people read."""

from __future__ import annotations

import pytest

from grader.grading.judging.findings import fault_sentence
from grader.grading.judging.judge_run import unusual_starts
from grader.runtime.model.trace import ClockKind, Fault, FaultKind, Start, StartWay, Trace


@pytest.mark.parametrize(
    ("way", "target", "notes"),
    [
        (StartWay.SCRIPT, "", ()),
        (StartWay.MODULE, "p.a", ("p/a.py: run as `python3 -m p.a`",)),
        (StartWay.MAIN, "p.a:main", ("p/a.py: run as `ros2 run` would: p.a:main()",)),
        (StartWay.ENTRY_POINT, "p.a:go", ("p/a.py: run as `ros2 run` does: the entry point p.a:go",)),
    ],
)
def test_only_what_is_not_ordinary_is_noted(way: StartWay, target: str, notes: tuple[str, ...]) -> None:
    """A script that was run as a script needs no line."""
    trace = Trace("alone", ClockKind.VIRTUAL, 0, (), starts=(Start("a.py", "p/a.py", way, target),))
    assert unusual_starts(trace) == notes


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("KeyError: 'speed'", "a.py:3: KeyError: 'speed'"),
        ('ValueError: no; "x" counts', "a.py:3: ValueError: \"no; 'x' counts\""),
        ("ValueError: a: b; c", 'a.py:3: ValueError: "a: b; c"'),
        ("KeyboardInterrupt", "a.py:3: KeyboardInterrupt"),
    ],
)
def test_a_message_that_reads_like_parts_of_a_reason_is_quoted(text: str, told: str) -> None:
    """A semicolon separates the grader's own words: the text of an exception cannot follow it."""
    assert fault_sentence(Fault(0, "a.py", FaultKind.EXCEPTION, text, "a.py", 3)) == told


def test_a_launch_file_that_ended_has_no_exit_code() -> None:
    """Its fault says what became of it instead; a program's says its code."""
    launch = Fault(0, "robot.launch.py", FaultKind.EXITED, "describes no node")
    program = Fault(2_000_000_000, "a.py", FaultKind.EXITED, "exited", exit_code=0)
    assert fault_sentence(launch) == "robot.launch.py describes no node"
    assert fault_sentence(program) == "a.py exited after 2.0 s with code 0"
