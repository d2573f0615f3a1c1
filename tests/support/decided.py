"""Grading for tests with real nodes: a busy machine decides nothing, so they ask again."""

from __future__ import annotations

from grader.grading.app.grade import Progress
from grader.grading.app.request import GradeRequest
from grader.grading.app.start import grade_once
from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Report, Verdict

#: Even if every second attempt is undecided, so many are it less than once in a million runs: 2 ** -20.
ATTEMPTS = 20


def say_nothing(step: str) -> None:
    """Take no note of the step that begins."""


def grade_until_decided(request: GradeRequest, hear: Progress = say_nothing) -> Report:
    """Grade a submission, again where the machine was too busy for the wall clock."""
    for _ in range(ATTEMPTS):
        report = grade_once(request, hear, pictures=False)
        if not was_too_busy(report):
            break
    return report


def was_too_busy(report: Report) -> bool:
    """Return whether a criterion is undecided because of the machine."""
    verdicts = [verdict for exercise in report.exercises for verdict in exercise.verdicts]
    return any(v.outcome is Outcome.UNDECIDED and "the machine was too busy" in v.reason for v in verdicts)


def verdicts(report: Report) -> dict[str, Verdict]:
    """Return the verdicts by the ids of their criteria."""
    return {verdict.id: verdict for verdict in report.exercises[0].verdicts}
