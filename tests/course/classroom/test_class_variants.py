"""A class of which everybody has a variant: whose it is, the roster says, and nobody is graded by another's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from class_samples import GRADING, FakeScheduler, course, grade, hand_in

from grader.course.classroom import worker
from grader.course.classroom.local import Task
from grader.course.classroom.outputs import Graded
from grader.course.classroom.store import Conditions, State
from grader.grading.app.request import GradeRequest
from grader.grading.app.seeds import by_key
from grader.grading.model.exercise import Drawn
from grader.grading.model.grading_options import GradingOptions
from grader.grading.model.report import Report
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.draws import Recorded
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import ClassError, HarnessError, VariantError

ROSTER = (
    "name,username,email,id number\nAda,ada,ada@x.edu,17\nBob,bob,bob@x.edu,\nEve,eve,eve@x.edu,18\nEve 2,eve,,19\n"
)


@pytest.fixture
def class_(tmp_path: Path) -> Callable[..., Any]:
    """Return what grades a class by a rubric with a variant; the scheduler beside it remembers the tasks."""
    hand_in(tmp_path / "in", ada=10, bob=4, eve=5)
    (tmp_path / "roster.csv").write_text(ROSTER, encoding="utf-8")
    (tmp_path / "variant.key").write_text("a variant key of enough bytes\n", encoding="utf-8")
    text = builtin_rubrics()["velocity_publisher"].read_text(encoding="utf-8")
    text = text.replace("\nscenarios:", "\nvariants:\n  rate: {between: [5 Hz, 500 Hz], step: 1 Hz}\nscenarios:", 1)
    (tmp_path / "r.yaml").write_text(text.replace("rate: 20 Hz,", "rate: {variant: rate},"), encoding="utf-8")

    def run(*, key: str = "variant.key", roster: str = "roster.csv") -> tuple[Graded, FakeScheduler]:
        scheduler = FakeScheduler()
        grading = replace(GRADING, rubrics=(tmp_path / "r.yaml",), variant_key=tmp_path / key if key else None)
        wanted = course(tmp_path / "in", tmp_path / "out", roster=tmp_path / roster if roster else None)
        return grade(replace(wanted, grading=grading), scheduler), scheduler

    return run


def test_everybody_is_graded_by_their_own_values(class_: Callable[..., Any], tmp_path: Path) -> None:
    """By the number, else the user name; the values are those of the task sheet, and in the key of the result."""
    _, scheduler = class_()
    found = {name: task.conditions for name, task in scheduler.tasks.items()}
    assert {name: conditions.variants.student for name, conditions in found.items()} == {"ada": "17", "bob": "bob"}
    sheet = read_rubric(tmp_path / "r.yaml", draw=by_key(tmp_path / "variant.key", "17"))
    assert sheet.variant is not None
    assert found["ada"].variants == Drawn("17", {"velocity_publisher": dict(sheet.variant.values)})
    assert found["ada"].rubrics == (("velocity_publisher", sheet.digest),)
    assert found["ada"].rubrics != found["bob"].rubrics


def test_whose_variant_is_not_clear_is_not_graded(class_: Callable[..., Any]) -> None:
    """That is no mark; the row says what to fix."""
    graded, _ = class_()
    eve = next(row for row in graded.book.rows if row.name == "eve")
    assert (eve.status.value, eve.adjusted.score) == ("refused", None)
    assert "no student on the roster matches this submission with certainty" in eve.problem


def test_results_stay_until_the_values_change(class_: Callable[..., Any], tmp_path: Path) -> None:
    """The same command grades nothing again; another variant key means other values."""
    class_()
    assert class_()[0].graded == 0
    (tmp_path / "variant.key").write_text("another variant key of enough bytes\n", encoding="utf-8")
    assert class_()[0].graded == 2


def test_without_key_or_roster_nothing_is_graded(class_: Callable[..., Any]) -> None:
    """The message says which of the two is missing."""
    with pytest.raises(VariantError, match="--variant-key: expected the variant key"):
        class_(key="")
    with pytest.raises(ClassError, match="--roster: expected the people of the class"):
        class_(roster="")


def test_the_process_that_grades_gets_the_values_and_not_the_key(tmp_path: Path) -> None:
    """So that it can be anywhere; the line that repeats the run names student and key."""
    heard = []

    def refuse(request: GradeRequest, progress: Callable[..., Any], on_recorded: Callable[..., Any]) -> Report:
        heard.append(request)
        raise HarnessError("enough")

    own = Drawn("17", {"velocity_publisher": {"rate": "7 Hz"}})
    conditions = Conditions("0", (), "", GradingOptions(variant_key=tmp_path / "variant.key"), variants=own)
    task = Task("x", "x", tmp_path, tmp_path / "into", conditions, 1, False, 60.0)
    status = worker.attempt(task, lambda step: None, refuse)
    (request,) = heard
    assert isinstance(request.draw, Recorded)
    assert (request.student, request.variant_key, request.draw.drawn) == ("17", tmp_path / "variant.key", own)
    assert status.state is State.FAILED
