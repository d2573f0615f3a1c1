"""The report as PrairieLearn's results.json."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from grader.core.report import ExerciseReport, Report, Verdict
from grader.reporting import wording
from grader.reporting.escape import json_value, shown
from grader.reporting.json_report import json_text

#: PrairieLearn refuses a longer file; bytes.
MOST_BYTES = 1_000_000


def render_prairielearn(report: Report, *, limit: int = MOST_BYTES) -> str:
    """Return the results.json of a report, at most `limit` bytes.

    A report that is not final is marked as not gradable, so that the attempt does not count, and its message explains
    why. Near the limit, explanations are dropped first, then the rest of the output, then the tests.
    """
    whole = _results(report)
    text = json_text(whole)
    for give_way in (_explanations, _output, _tests):
        if len(text.encode()) <= limit:
            break
        give_way(whole)
        text = json_text(whole)
    return text


def _results(report: Report) -> dict[str, Any]:
    share = report.score / report.max_score if report.max_score else Fraction(0)
    return {
        "gradable": report.final,
        "score": json_value(share),
        "message": " ".join([wording.headline(report), *wording.warnings(report)]),
        "output": wording.whole_output(report),
        "tests": [_test(exercise, verdict) for exercise in report.exercises for verdict in exercise.verdicts],
    }


def _test(exercise: ExerciseReport, verdict: Verdict) -> dict[str, Any]:
    return {
        "name": f"{shown(exercise.number, limit=wording.NAME_LIMIT)}: {shown(verdict.title)}",
        "description": f"{wording.OUTCOME_WORDS[verdict.outcome]} ({shown(verdict.id)})",
        "points": json_value(verdict.score),
        "max_points": json_value(verdict.max_score),
        "message": shown(wording.reason(verdict)),
        "output": "\n".join(wording.explanation(verdict)[1:]),
    }


def _explanations(whole: dict[str, Any]) -> None:
    for test in whole["tests"]:
        test.update(message="left out: the results would be too long", output="")


def _output(whole: dict[str, Any]) -> None:
    whole["output"] = whole["output"].splitlines()[-1]


def _tests(whole: dict[str, Any]) -> None:
    # A zero-point row would hide all other rows, so all of them are dropped.
    whole["tests"] = []
