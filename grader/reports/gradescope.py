"""The report as Gradescope's results.json."""

from __future__ import annotations

from typing import Any

from grader.model.exercise import Outcome
from grader.model.report import ExerciseReport, Report, Verdict
from grader.reports import wording
from grader.reports.escape import json_value, shown
from grader.reports.json_report import json_text


def render_gradescope(report: Report) -> str:
    """Return the results.json of a report; its texts are plain, so that nothing in them is markup to the platform.

    What is undecided earns nothing yet, and the output says so before anything else.
    """
    return json_text(
        {
            "score": json_value(report.score),
            "execution_time": json_value(round(report.duration_s, 3)),
            "output": "\n".join(_output(report)),
            "output_format": "text",
            "visibility": "visible",
            "stdout_visibility": "hidden",
            "tests": [_test(e, n, v) for e in report.exercises for n, v in enumerate(e.verdicts, start=1)],
            "extra_data": {
                "max_score": json_value(report.max_score),
                "final": report.final,
                "pending": list(report.pending),
                "isolation": report.environment.isolation,
                "submission": report.digest,
            },
        }
    )


def _output(report: Report) -> list[str]:
    lines = [*wording.opening(report), wording.run_line(report)]
    for exercise in report.exercises:
        remarks = wording.remarks(exercise)
        lines += ["", wording.exercise_line(exercise), *remarks] if remarks else []
    return [*lines, "", *wording.ending(report)]


def _test(exercise: ExerciseReport, number: int, verdict: Verdict) -> dict[str, Any]:
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
        "visibility": "visible",
        "extra_data": {"exercise": exercise.id, "criterion": verdict.id, "outcome": verdict.outcome.value},
    }
