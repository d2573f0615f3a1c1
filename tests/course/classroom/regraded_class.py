"""A class that is graded with made-up recordings, and graded again when its rubric has changed."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from class_samples import course
from kept_runs import RUBRICS, velocity_run, velocity_trace

from grader.course.classroom import worker
from grader.course.classroom.class_run import grade_class
from grader.course.classroom.local import Attempt, Task
from grader.course.classroom.outputs import Graded
from grader.course.classroom.watching import Watcher
from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest, reproduction
from grader.grading.judging.judge_run import judge_run
from grader.grading.model.report import Report
from grader.grading.model.run import Run
from grader.grading.submissions.submission import stage_submission

#: Name of a submission -> rate of its publisher.
RATES = {"ada": 20, "bob": 10, "cleo": 20}


class RecordingScheduler:
    """Grades as a process of the class does, with made-up recordings, and counts what it runs."""

    def __init__(self) -> None:
        self.ran: list[str] = []

    def __call__(self, jobs: int) -> RecordingScheduler:
        return self

    def prepare(self, isolation: str) -> list[str]:
        return []

    def run(self, tasks: Sequence[Task], on_step: Callable[..., Any]) -> Generator[Attempt, None, None]:
        for task in tasks:
            self.ran.append(task.name)
            yield Attempt(task, worker.attempt(task, lambda step: None, self.grade))

    def grade(
        self, request: GradeRequest, progress: Callable[[str], None], on_recorded: Callable[[Run, Any], None]
    ) -> Report:
        name = Path(request.submission).name
        made = velocity_run(velocity_trace(rate_hz=RATES[name]), name=name)
        exercises = read_exercises(request)
        with TemporaryDirectory() as staging:
            digest = stage_submission(request.submission, (), Path(staging)).digest
        assert request.seed is not None
        run = replace(
            made,
            submission=replace(made.submission, digest=digest, path=request.submission),
            seed=request.seed,
            reproduce=reproduction(request, exercises, "", request.seed),
        )
        on_recorded(run, exercises)
        return judge_run(exercises, run)


def rubric(folder: Path, *changes: tuple[str, str]) -> None:
    """Write the rubric of the class, with other texts in place of some."""
    text = (RUBRICS / "exercise_1" / "rubric.yaml").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "rubric.yaml").write_text(text, encoding="utf-8")


def grade(
    folder: Path, watched_by: Callable[[Callable[[str], None]], Watcher] = Watcher, **changes: Any
) -> tuple[Graded, list[str], list[str]]:
    """Grade the class; also return who ran, and what was written meanwhile."""
    scheduler, lines = RecordingScheduler(), list[str]()
    grading = GradeRequest("", rubrics=(folder / "rubric.yaml",))
    wanted = course(folder / "in", folder / "out", **{"grading": grading, "jobs": 1, **changes})
    graded = grade_class(wanted, watched_by(lines.append), lines.append, scheduler)
    return graded, scheduler.ran, lines
