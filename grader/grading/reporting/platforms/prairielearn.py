"""The report as PrairieLearn's results.json."""

from __future__ import annotations

from fractions import Fraction

from grader.grading.model.report import ExerciseReport, JsonObject, JsonValue, Report, Verdict
from grader.grading.reporting import wording
from grader.grading.reporting.escape import json_value, shown
from grader.grading.reporting.json_report import json_text

#: PrairieLearn refuses a longer file; bytes.
MOST_BYTES = 1_000_000
_LEFT_OUT = "left out: the results would be too long"


def render_prairielearn(report: Report, *, limit: int = MOST_BYTES) -> str:
    """Return the results.json of a report, at most `limit` bytes.

    A report that is not final is marked as not gradable, so that the attempt does not count, and its message explains
    why. Near the limit, explanations are dropped first, then the rest of the output, then the tests.
    """
    share = report.score / report.max_score if report.max_score else Fraction(0)
    output = "\n".join(wording.overview(report))
    tests = [_test(exercise, verdict) for exercise in report.exercises for verdict in exercise.verdicts]
    results: dict[str, JsonValue] = {
        "gradable": report.final,
        "score": json_value(share),
        "message": " ".join([wording.headline(report), *wording.warnings(report)]),
        "output": output,
        "tests": tests,
    }
    short_tests: JsonValue = [{**test, "message": _LEFT_OUT, "output": ""} for test in tests]
    cuts: list[dict[str, JsonValue]] = [{"tests": short_tests}, {"output": output.splitlines()[-1]}, {"tests": []}]
    text = json_text(results)
    # A zero-point row would hide all other rows, so all of them are dropped.
    for cut in cuts:
        if len(text.encode()) <= limit:
            break
        results |= cut
        text = json_text(results)
    return text


def _test(exercise: ExerciseReport, verdict: Verdict) -> JsonObject:
    return {
        "name": f"{shown(exercise.number, limit=wording.NAME_LIMIT)}: {shown(verdict.title)}",
        "description": f"{wording.OUTCOME_WORDS[verdict.outcome]} ({shown(verdict.id)})",
        "points": json_value(verdict.score),
        "max_points": json_value(verdict.max_score),
        "message": shown(wording.reason(verdict)),
        "output": "\n".join(wording.explanation(verdict)[1:]),
    }
