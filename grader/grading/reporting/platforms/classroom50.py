"""The report as Classroom 50's result.json: whole points, with the exact ones beside them.

What a result needs beside the report, the metadata of the submission, is read from the environment.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

from grader.grading.model.exercise import Outcome
from grader.grading.model.report import ExerciseReport, JsonObject, Report, Verdict
from grader.grading.reporting import wording
from grader.grading.reporting.escape import json_value, shown
from grader.grading.reporting.json_report import json_text
from grader.grading.reporting.wording import whole_points
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import GraderError

SCHEMA = "classroom50/result/v1"
#: Environment variables that Classroom 50 sets for its autograders, by the field that each one fills.
VARIABLES = {
    "classroom": "CLASSROOM",
    "assignment": "ASSIGNMENT",
    "assignment_type": "ASSIGNMENT_TYPE",
    "owner": "OWNER",
    "username": "USERNAME",
    "submission": "SUBMISSION_TAG",
    "commit": "COMMIT_URL",
    "release": "RELEASE_URL",
    "review": "REVIEW_URL",
}
#: When the submission was committed, in any form of ISO 8601 with an offset.
COMMIT_DATETIME = "COMMIT_DATETIME"
_EVENT = "GITHUB_EVENT_PATH"
_EVENT_BYTES = 32 << 20


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


def handed_in(environment: Mapping[str, str]) -> HandedIn:
    """Return the metadata of the submission from Classroom 50; raises GraderError if a value is missing."""
    missing = [name for name in VARIABLES.values() if not environment.get(name)]
    if missing:
        text = (
            f"classroom50: expected {', '.join(VARIABLES.values())} in the environment, found no {', '.join(missing)}"
        )
        raise GraderError(text, "a Classroom 50 autograder has them; elsewhere use another format")
    if not environment["SUBMISSION_TAG"].startswith("submit/"):
        raise GraderError("classroom50: SUBMISSION_TAG: expected submit/..., found another tag")
    if environment["ASSIGNMENT_TYPE"] not in ("individual", "group"):
        raise GraderError("classroom50: ASSIGNMENT_TYPE: expected individual or group, found something else")
    values = {field: environment[name] for field, name in VARIABLES.items()}
    return HandedIn(**values, datetime=_committed_at(environment))


def _committed_at(environment: Mapping[str, str]) -> str:
    text = environment.get(COMMIT_DATETIME) or _from_event(environment.get(_EVENT, ""))
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        when = datetime.min  # noqa: DTZ901  it has no offset, like a time that cannot be used
    if when.tzinfo is None:
        raise GraderError(
            f"classroom50: {COMMIT_DATETIME}: expected the commit's time with its offset, found none",
            f'export {COMMIT_DATETIME}="$(git show -s --format=%cI)"',
        )
    return when.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def _from_event(path: str) -> str:
    """Return the commit time from a push event, as GitHub wrote it; empty if it has none."""
    if not path:
        return ""
    try:
        with Path(path).open("rb") as file:
            event = json.loads(file.read(_EVENT_BYTES))
        return str(event["head_commit"]["timestamp"])
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return ""


def render_classroom50(report: Report, handed_in: HandedIn) -> str:
    """Return the result.json of a report.

    The last row has no points: it states whether the result is final, and how to reproduce it.
    """
    metadata = asdict(handed_in)
    username = metadata.pop("username")
    rows = [(exercise, verdict) for exercise in report.exercises for verdict in exercise.verdicts]
    rounded = whole_points([v.score for _, v in rows], [v.max_score for _, v in rows])
    return json_text(
        {
            "schema": SCHEMA,
            **metadata,
            "score": sum(score for score, _ in rounded),
            "max-score": sum(top for _, top in rounded),
            "tests": [
                *(_row(e, v, *whole) for (e, v), whole in zip(rows, rounded, strict=True)),
                _about(report),
            ],
            "submitted_by": {"username": username},
        }
    )


def _row(exercise: ExerciseReport, verdict: Verdict, score: int, max_score: int) -> JsonObject:
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


def _about(report: Report) -> JsonObject:
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
        "reproduce": wording.ending_lines(report),
    }
