"""Judges a whole run: every exercise of it, as grading does at once and rejudging does later."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from grader.core.exercise import Exercise
from grader.core.report import ExerciseReport, Report
from grader.core.submission import Run
from grader.core.trace import Trace
from grader.judging.figures.pictures import illustrated
from grader.judging.judge import judge_exercise
from grader.judging.pending import not_graded_yet


def judge_run(
    exercises: Sequence[Exercise], run: Run, *, pictures: bool = True, pending: Collection[str] = ()
) -> Report:
    """Return the report of a run; pure, so the same run and the same exercises give the same report.

    Args:
        exercises: What is asked, in the order of the report.
        run: What was recorded for them.
        pictures: Whether to draw figures as well, which takes about as long as judging and only some formats show.
        pending: Ids of the exercises that are still being recorded; the report is then a partial one.
    """
    return Report(
        name=run.submission.name,
        path=run.submission.path,
        digest=run.submission.digest,
        environment=run.environment,
        seed=run.seed,
        exercises=tuple(
            not_graded_yet(exercise) if exercise.id in pending else _judged(exercise, run, pictures=pictures)
            for exercise in exercises
        ),
        duration_s=run.duration_s,
        notes=run.notes,
        reproduce=run.reproduce,
        pending=tuple(exercise.id for exercise in exercises if exercise.id in pending),
    )


def _judged(exercise: Exercise, run: Run, *, pictures: bool) -> ExerciseReport:
    own: Mapping[str, Trace] = {
        scenario: trace for (owner, scenario), trace in run.traces.items() if owner == exercise.id
    }
    report = judge_exercise(exercise, own, run.submission, run.sources)
    return illustrated(report, exercise, own, run.submission, run.sources) if pictures else report
