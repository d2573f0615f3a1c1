"""A class for tests: submissions, a scheduler that grades without running anything, and what it hands back."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from grader.course.classroom.grading import ClassRequest
from grader.course.classroom.local import Attempt, Task
from grader.course.classroom.outputs import Graded
from grader.course.classroom.store import ResultStatus, State, dump_status, unusable_digest
from grader.course.classroom.watching import Watcher
from grader.grading.app.request import GradeRequest
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.errors import SubmissionError

GRADING = GradeRequest("", exercises=("velocity_publisher",))
#: The status that a process which stands in for the grader reports.
DONE = json.loads(dump_status(ResultStatus(State.GRADED, "k", "d", "l", score=1.0, max_score=2.0)))
#: Grades one submission after the other, and tells its process as a step; fails or ends if the label says so.
LASTING = f"""
import json, os, sys
for line in sys.stdin:
    label = json.loads(line)["task"]["label"]
    print(json.dumps({{"step": str(os.getpid())}}), flush=True)
    if label.startswith("ends"):
        sys.exit(7)
    status = {DONE!r}
    status["state"] = "failed" if label.startswith("fails") else "graded"
    print(json.dumps({{"done": status}}), flush=True)
"""


def report(score: int, *, final: bool = True, reason: str = "as expected") -> dict[str, Any]:
    """Return a report as JSON values: one exercise of two criteria, `score` of 10 points."""
    outcome = ("met" if score == 10 else "not_met") if final else "undecided"
    rate = {"id": "rate", "title": "Publishes at 20 Hz", "outcome": outcome, "score": score - 4, "max_score": 6}
    type_ = {"id": "type", "title": "Publishes a Twist", "outcome": "met", "score": 4, "max_score": 4}
    criteria = [{**type_, "reason": "yes", "hint": None}, {**rate, "reason": reason, "hint": None}]
    exercise = {"id": "velocity_publisher", "title": "t", "score": score, "max_score": 10, "criteria": criteria}
    return {"schema": "grader/report/v1", "score": score, "max_score": 10, "final": final, "exercises": [exercise]}


class FakeScheduler:
    """Gives each submission the score in its `score.py`, or the state that this is the name of."""

    def __init__(self, jobs: int = 1, stop_after: int | None = None, default: str = "") -> None:
        self.default = default  # the score of a submission without a `score.py`
        self.graded: list[str] = []
        self.tasks: dict[str, Task] = {}
        self.stop_after = stop_after

    def __call__(self, jobs: int) -> FakeScheduler:
        return self

    def prepare(self, isolation: str) -> list[Any]:
        return ["no sandbox"] if isolation == "none" else []

    def run(self, tasks: Sequence[Task], on_step: Callable[..., Any]) -> Generator[Attempt, None, None]:
        for task in tasks:
            if len(self.graded) == self.stop_after:
                raise KeyboardInterrupt
            on_step(task.name, "grading")
            self.graded.append(task.name)
            self.tasks[task.name] = task
            yield Attempt(task, self.status(task))

    def status(self, task: Task) -> ResultStatus:
        staging = task.into.parent / "staging"
        staging.mkdir()
        try:
            submission = stage_submission(str(task.submission), (), staging)
            said = next((file.read_text(encoding="utf-8") for file in staging.rglob("score.py")), self.default).strip()
        except SubmissionError as error:
            key = task.conditions.key(unusable_digest(error))
            return ResultStatus(State.REFUSED, key, "", task.label, error.message)
        finally:
            import shutil

            shutil.rmtree(staging)
        if said == "failed":
            return ResultStatus(State.FAILED, "", "", task.label, "the grader ended without a result")
        unchecked = said.startswith("unchecked")
        final = not (said.startswith("undecided") or unchecked)
        score = int(said.removeprefix("undecided ").removeprefix("unchecked "))
        task.into.mkdir()
        values = report(score, final=final or unchecked)
        if unchecked:
            values["final"], values["exercises"][0]["unchecked"] = False, "the machine was too busy for a check"
        for name in ("report.json", "feedback.json"):
            (task.into / name).write_text(json.dumps(values), encoding="utf-8")
        gradescope = {"score": score, "output": "done", "extra_data": {}}
        (task.into / "gradescope.json").write_text(json.dumps(gradescope), encoding="utf-8")
        state = State.GRADED if final else State.UNDECIDED
        key = task.conditions.key(submission.digest)
        return ResultStatus(state, key, submission.digest, task.label, score=float(score), max_score=10.0)


def hand_in(folder: Path, **scores: int | str) -> Path:
    """Write a submission for each name; what it holds is what the fake scheduler gives it."""
    for name, score in scores.items():
        (folder / name).mkdir(parents=True, exist_ok=True)
        (folder / name / "score.py").write_text(str(score), encoding="utf-8")
    return folder


def course(source: Path, results: Path, **changes: Any) -> ClassRequest:
    """Return what to grade."""
    return replace(ClassRequest((source,), results, grading=GRADING), **changes)


def grade(wanted: ClassRequest, scheduler: FakeScheduler | None = None, watcher: Watcher | None = None) -> Graded:
    """Grade a class with the fake scheduler, or another one."""
    from grader.course.classroom.class_run import grade_class

    return grade_class(wanted, watcher or Watcher(lambda line: None), lambda line: None, scheduler or FakeScheduler())


def scores(graded: Graded) -> dict[str, Fraction | None]:
    """Return name -> final score of a class."""
    return {row.name: row.adjusted.score for row in graded.book.rows}


POINTS = Fraction


def without_line(results: Path, option: str) -> None:
    """Leave an option of a class out: delete its line in `class.yaml`."""
    path = results / "class.yaml"
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    kept = [line for line in lines if not line.startswith(f"{option}:")]
    assert len(kept) == len(lines) - 1
    path.write_text("".join(kept), encoding="utf-8")
