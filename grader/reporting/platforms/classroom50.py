"""The report as Classroom 50's result.json: whole points, with the exact ones beside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from grader.core.exercise import Outcome
from grader.core.report import ExerciseReport, Report, Verdict
from grader.reporting import wording
from grader.reporting.escape import json_value, shown
from grader.reporting.json_report import json_text
from grader.reporting.wording import whole_points

SCHEMA = "classroom50/result/v1"


@dataclass(frozen=True, slots=True)
class HandedIn:
    """Metadata of a submission that only the classroom knows; all fields are required."""

    classroom: str
    assignment: str
    assignment_type: str  # `individual` or `group`
    owner: str  # owner of the repository
    username: str  # who submitted it
    submission: str  # tag that starts with `submit/`
    commit: str
    release: str
    review: str
    datetime: str  # commit time in UTC, as `2026-01-31T23:59:59Z`


def render_classroom50(report: Report, handed_in: HandedIn) -> str:
    """Return the result.json of a report.

    The last row has no points: it states whether the result is final, and how to reproduce it.
    """
    rows = [(exercise, verdict) for exercise in report.exercises for verdict in exercise.verdicts]
    rounded = whole_points([v.score for _, v in rows], [v.max_score for _, v in rows])
    return json_text(
        {
            "schema": SCHEMA,
            "classroom": handed_in.classroom,
            "assignment": handed_in.assignment,
            "assignment_type": handed_in.assignment_type,
            "owner": handed_in.owner,
            "submission": handed_in.submission,
            "commit": handed_in.commit,
            "release": handed_in.release,
            "review": handed_in.review,
            "datetime": handed_in.datetime,
            "score": sum(score for score, _ in rounded),
            "max-score": sum(top for _, top in rounded),
            "tests": [
                *(_row(e, v, *whole) for (e, v), whole in zip(rows, rounded, strict=True)),
                _about(report),
            ],
            "submitted_by": {"username": handed_in.username},
        }
    )


def _row(exercise: ExerciseReport, verdict: Verdict, score: int, max_score: int) -> dict[str, Any]:
    reason, *more = wording.explanation(verdict)
    return {
        "test-name": f"{shown(exercise.number, limit=wording.NAME_LIMIT)}: {shown(verdict.title)}",
        "passed": verdict.outcome is Outcome.MET,
        "score": score,
        "max-score": max_score,
        "exact-score": json_value(verdict.score),
        "exact-max-score": json_value(verdict.max_score),
        "exercise": exercise.id,
        "criterion": verdict.id,
        "outcome": verdict.outcome.value,
        "reason": reason,
        "more": more,
    }


def _about(report: Report) -> dict[str, Any]:
    return {
        "test-name": "About this result" if report.final else "This result is not final",
        "passed": report.final,
        "score": 0,
        "max-score": 0,
        "exact-score": json_value(report.score),
        "exact-max-score": json_value(report.max_score),
        "final": report.final,
        "isolation": report.environment.isolation,
        "opening": wording.opening(report),
        "remarks": {e.id: remarks for e in report.exercises if (remarks := wording.remarks(e))},
        "reproduce": wording.ending(report),
    }
