"""The report as Gradescope's results.json."""

from __future__ import annotations

from grader.grading.model.exercise import DUE_DATE, OPEN, PUBLISHED, Outcome
from grader.grading.model.report import ExerciseReport, JsonObject, Report, Verdict
from grader.grading.reporting import wording
from grader.grading.reporting.audience import for_student
from grader.grading.reporting.escape import json_value, shown
from grader.grading.reporting.json_report import json_text

#: `until` of a criterion -> when the platform shows its test.
_VISIBILITIES = {DUE_DATE: "after_due_date", PUBLISHED: "after_published"}
_HIDDEN, _VISIBLE = "hidden", "visible"
_FOR_STAFF = "What was found is in the standard output, which only staff see."


def render_gradescope(report: Report, *, day: str | None = None) -> str:
    """Return the results.json of a whole report; its texts are plain, so the platform finds no markup in them.

    Undecided criteria earn nothing yet, and the output starts with that. The score counts every criterion, including
    those whose tests the platform hides. Dates in the rubric are compared with the day; None shows everything to
    everybody.
    """
    seen = report if day is None else for_student(report, day)
    return json_text(
        {
            "score": json_value(report.score),
            "execution_time": json_value(round(report.duration_s, 3)),
            "output": "\n".join(wording.overview(seen)),
            "output_format": "text",
            "visibility": _VISIBLE,
            "stdout_visibility": _HIDDEN,
            "tests": _tests(report, seen),
            "extra_data": {
                "max_score": json_value(report.max_score),
                "final": report.final,
                "pending": list(report.pending),
                "isolation": report.environment.isolation,
                "submission": report.digest,
            },
        }
    )


def _tests(report: Report, seen: Report) -> list[JsonObject]:
    """Return one test per criterion, as students see it; the platform keeps the rest hidden."""
    visible = {(exercise.id, verdict.id): verdict for exercise in seen.exercises for verdict in exercise.verdicts}
    found = []
    for exercise in report.exercises:
        for number, verdict in enumerate(exercise.verdicts, start=1):
            shown_one = visible.get((exercise.id, verdict.id))
            found.append(_test(exercise, number, shown_one) if shown_one else _unshown(exercise, number, verdict))
    return found


def _unshown(exercise: ExerciseReport, number: int, verdict: Verdict) -> JsonObject:
    """Return a test that the platform hides: complete if it shows the test later, else only its points."""
    visibility = _VISIBILITIES.get(exercise.feedback.get(verdict.id, OPEN).until, _HIDDEN)
    kept = {"output": _FOR_STAFF} if visibility == _HIDDEN else {}
    return {**_test(exercise, number, verdict), **kept, "visibility": visibility}


def _test(exercise: ExerciseReport, number: int, verdict: Verdict) -> JsonObject:
    return {
        "name": f"{shown(verdict.title)} ({shown(verdict.id)})",
        "name_format": "text",
        "number": f"{shown(exercise.number, limit=wording.NAME_LIMIT)}.{number}",
        "score": json_value(verdict.score),
        "max_score": json_value(verdict.max_score),
        "status": "passed" if verdict.outcome is Outcome.MET else "failed",
        "output": "\n".join([wording.OUTCOME_WORDS[verdict.outcome], *wording.explanation(verdict)]),
        "output_format": "text",
        "tags": [verdict.outcome.value],
        "visibility": _VISIBLE,
        "extra_data": {"exercise": exercise.id, "criterion": verdict.id, "outcome": verdict.outcome.value},
    }
