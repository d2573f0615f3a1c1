"""What is shown while a class is graded: count, rate, time left, what is running; never control characters."""

from __future__ import annotations

import io
import re

import pytest
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TextColumn

from grader.course.classroom.store import ResultStatus, State
from grader.course.classroom.watching import LiveWatcher, Watcher, clock_time, outcome_words


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def status(state: State = State.GRADED, problem: str = "") -> ResultStatus:
    return ResultStatus(state, "", "", "x", problem, score=87.5, max_score=100.0, duration_s=2.06)


def test_each_one_is_a_line_with_rate_and_time_left() -> None:
    """The rate is that of this run, what was done before does not count."""
    clock = Clock()
    lines: list[str] = []
    watcher = Watcher(lines.append, clock)
    watcher.begin(60, 7)
    for name in ("ada", "bob", "cleo"):
        watcher.step(name, "grading")
    clock.now = 30.0
    watcher.done("ada", status())
    watcher.done("bob", status(State.FAILED, "the \x1b[31mgrader"))
    assert lines == [
        "to grade: 60, done before: 7",
        "[ 1/60] ada: 87.5/100 in 2.1 s (2.0/min, 29:30 left; running: bob, cleo)",
        "[ 2/60] bob: failed: the \\x1b[31mgrader in 2.1 s (4.0/min, 14:30 left; running: cleo)",
    ]


def test_many_that_run_are_counted() -> None:
    """A line stays a line on a machine with many processors."""
    lines: list[str] = []
    watcher = Watcher(lines.append, Clock())
    watcher.begin(9, 0)
    for name in "abcdefg":
        watcher.step(name, "grading")
    assert watcher.pace() == "0.0/min, ? left; running: a, b, c, d and 3 more"


def test_a_terminal_shows_a_bar_under_the_lines() -> None:
    """What was done before is said once, and lines leave the count to the bar."""
    out = io.StringIO()
    words = TextColumn("{task.fields[words]}", markup=False)
    with Progress(MofNCompleteColumn(), words, console=Console(file=out, width=120), auto_refresh=False) as bar:
        watcher = LiveWatcher(bar)
        watcher.begin(2, 5)
        watcher.step("ada", "grading")
        watcher.step("bob", "grading")
        watcher.done("ada", status())
    assert out.getvalue().splitlines()[:2] == ["done before: 5", "ada: 87.5/100 in 2.1 s"]
    assert re.fullmatch(r"1/2 \d+\.\d/min, \d+:\d\d left; running: bob", out.getvalue().splitlines()[-1].rstrip())


@pytest.mark.parametrize(("seconds", "text"), [(0, "0:00"), (59.6, "1:00"), (3599, "59:59"), (3661, "1:01:01")])
def test_time_is_written_as_a_clock_does(seconds: float, text: str) -> None:
    """Hours only where there are any."""
    assert clock_time(seconds) == text


def test_undecided_is_no_score() -> None:
    """The points so far, and that they are not final."""
    assert outcome_words(status(State.UNDECIDED)) == "87.5/100, undecided"
