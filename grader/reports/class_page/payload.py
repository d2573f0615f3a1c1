"""What the page's script sorts, filters and draws, as JSON values; all text in them is made safe to show here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from grader.model.exercise import Outcome
from grader.reports.class_page.causes import Cause
from grader.reports.class_page.contents import ClassPage, Student
from grader.reports.class_page.counts import Distribution, ExerciseCount
from grader.reports.escape import shown

#: One sign for each outcome, and one for a criterion that a report does not have.
LETTERS = {Outcome.MET: "m", Outcome.PARTLY: "p", Outcome.NOT_MET: "n", Outcome.BLOCKED: "b", Outcome.UNDECIDED: "u"}
NOT_ASKED = "-"
_NAME_LIMIT = 100


def payload(
    page: ClassPage, exercises: Sequence[ExerciseCount], found: Sequence[Cause], spread: Distribution
) -> dict[str, Any]:
    """Return the data of the page.

    Args:
        page: The page.
        exercises: Its exercises and criteria.
        found: Its causes, in the order shown.
        spread: How its scores are distributed.
    """
    criteria = [(e.id, c.id) for e in exercises for c in e.criteria]
    return {
        "criteria": [f"{exercise}/{criterion}" for exercise, criterion in criteria],
        "students": [_student(student, exercises, criteria) for student in page.students],
        "causes": [list(cause.students) for cause in found],
        "bins": [[b.label, b.low, b.high, b.raw, b.final] for b in spread.bins],
        "changed": spread.changed,
        "max_score": float(spread.max_score),
    }


def _student(
    student: Student, exercises: Sequence[ExerciseCount], criteria: Sequence[tuple[str, str]]
) -> dict[str, Any]:
    """Return what a row is sorted by, column by column, and the outcome of each criterion in one letter."""
    by_id = {} if student.report is None else {e["id"]: e for e in student.report["exercises"]}
    outcomes = {(e, c["id"]): LETTERS[Outcome(c["outcome"])] for e, x in by_id.items() for c in x["criteria"]}
    change = None if student.final is None or student.raw is None else student.final - student.raw
    return {
        "name": shown(student.name, limit=_NAME_LIMIT),
        "status": student.status,
        "raw": student.raw,
        "change": change if student.adjustments else None,
        "final": student.final,
        "exercises": [by_id[e.id]["score"] if e.id in by_id else None for e in exercises],
        "outcomes": "".join(outcomes.get(pair, NOT_ASKED) for pair in criteria),
    }
