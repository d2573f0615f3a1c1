"""Exercises that are still to be graded, as a partial report shows them."""

from __future__ import annotations

from fractions import Fraction

from grader.core.exercise import Exercise, Outcome, variant_notes
from grader.core.report import ExerciseReport, Verdict
from grader.core.trace import ClockKind


def not_graded_yet(exercise: Exercise) -> ExerciseReport:
    """Return a report in which every criterion is undecided, so that no part of it is taken for a result."""
    verdicts = (
        Verdict(c.id, c.title, Outcome.UNDECIDED, Fraction(0), c.points, "not graded yet") for c in exercise.criteria
    )
    return ExerciseReport(
        id=exercise.id,
        number=exercise.number,
        title=exercise.title,
        required=exercise.required,
        clock=ClockKind.VIRTUAL,
        clock_reason="",
        verdicts=tuple(verdicts),
        feedback={c.id: c.feedback for c in exercise.criteria},
        situations={c.id: c.scenario for c in exercise.criteria},
        notes=variant_notes(exercise.variant),
        variant=exercise.variant,
    )
