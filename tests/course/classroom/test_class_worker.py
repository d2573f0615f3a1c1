"""What grading one submission comes to in its process: whose fault it is decides, and nothing of ours is a mark."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from grader.course.classroom import worker
from grader.course.classroom.local import Task
from grader.course.classroom.store import REPORT, Conditions, ResultStatus, State
from grader.grading.app.request import GradeRequest
from grader.grading.model.exercise import Feedback, Outcome, Shows
from grader.grading.model.grading_options import GradingOptions
from grader.grading.model.report import Environment, ExerciseReport, Report, Reproduction, Verdict
from grader.runtime.model.errors import EnvironmentFault, HarnessError, SubmissionError
from grader.runtime.model.trace import ClockKind

CONDITIONS = Conditions("0", (("a", "sha256:1"),), "", GradingOptions())


def attempt(tmp_path: Path, error: Any) -> ResultStatus:
    """Return what an attempt comes to in which grading ends with an error."""

    def grade(request: GradeRequest, progress: Callable[..., Any], on_recorded: Callable[..., Any]) -> Report:
        raise error

    into = tmp_path / f"into {len(list(tmp_path.iterdir()))}"
    task = Task("x", "label", tmp_path, into, CONDITIONS, 1, False, 60.0)
    return worker.attempt(task, lambda step: None, grade)


@pytest.mark.parametrize(
    ("error", "state", "problem"),
    [
        (SubmissionError("x: expected a .py file", "add one"), State.REFUSED, "x: expected a .py file"),
        (HarnessError("worker: gone", "again"), State.FAILED, "worker: gone"),
        (EnvironmentFault("no ROS"), State.FAILED, "no ROS"),
        (OSError(28, "No space left on device"), State.FAILED, "the result cannot be written: No space left on device"),
        (ZeroDivisionError("ours"), State.FAILED, "the grader failed: ZeroDivisionError: ours"),
        (RecursionError("deep"), State.FAILED, "the grader failed: RecursionError: deep"),
        (MemoryError(), State.FAILED, "the grader failed: MemoryError: "),
    ],
)
def test_an_error_is_told_by_who_must_act(tmp_path: Path, error: Any, state: State, problem: str) -> None:
    """Only what is wrong with the submission itself refuses it and has a key; all else is tried again."""
    status = attempt(tmp_path, error)
    assert (status.state, status.problem) == (state, problem)
    assert bool(status.key) == (state is State.REFUSED)
    assert status.usage["peak_bytes"] > 1 << 20


def test_the_same_reason_to_refuse_has_the_same_key(tmp_path: Path) -> None:
    """A submission that cannot be used is looked at again only when something changed."""
    one = attempt(tmp_path, SubmissionError("x: found none"))
    same = attempt(tmp_path, SubmissionError("x: found none"))
    other = attempt(tmp_path, SubmissionError("x: found two"))
    assert one.key == same.key != other.key


def test_a_result_of_some_exercises_has_the_key_that_is_looked_for(tmp_path: Path) -> None:
    """Where only exercises count of which there is a file, the others do not make it look changed."""
    rubrics = (("a", "sha256:1"), ("e", "sha256:2"))
    every = Conditions("0", rubrics, "sha256:9", GradingOptions(every=True))
    verdict = Verdict("b", "B", Outcome.MET, Fraction(2), Fraction(2), "fine")
    exercise = ExerciseReport("e", "1", "E", True, ClockKind.VIRTUAL, "", (verdict,))
    environment = Environment("0", "jazzy", "7", "rmw", "3.11", "none")
    digest = "sha256:" + "0" * 64
    given = Reproduction(rubrics=rubrics[1:])
    report = Report("x", "x", digest, environment, 1, (exercise,), 0.1, reproduce=given)
    task = Task("x", "x", tmp_path, tmp_path / "into", every, 1, False, 60.0)
    assert worker.attempt(task, lambda step: None, lambda *_: report).key == every.key(digest)
    changed = dataclasses.replace(report, reproduce=Reproduction(rubrics=(("e", "sha256:3"),)))
    task = dataclasses.replace(task, into=tmp_path / "again")
    assert worker.attempt(task, lambda step: None, lambda *_: changed).key != every.key(digest)


def test_what_is_handed_back_holds_only_what_students_may_see(tmp_path: Path) -> None:
    """The instructor's files show everything; the student's keep back what the rubric withholds."""
    secret = Verdict("b", "B", Outcome.NOT_MET, Fraction(0), Fraction(2), "hushhush")
    exercise = ExerciseReport(
        "e", "1", "E", True, ClockKind.VIRTUAL, "", (secret,), feedback={"b": Feedback(Shows.OUTCOME, "9999-12-31")}
    )
    environment = Environment("0", "jazzy", "7", "rmw", "3.11", "none")
    report = Report("x", "x", "sha256:" + "0" * 64, environment, 1, (exercise,), 0.1)
    into = tmp_path / "into"
    task = Task("x", "x", tmp_path, into, CONDITIONS, 1, False, 60.0)
    worker.attempt(task, lambda step: None, lambda *_: report)
    found = {path.name for path in into.iterdir() if "hushhush" in path.read_text(encoding="utf-8")}
    assert found == {REPORT, worker.PAGE}
    assert {path.name for path in into.iterdir()} == set(worker.PARTS) - {worker.EVIDENCE}
