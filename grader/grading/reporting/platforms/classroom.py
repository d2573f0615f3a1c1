"""The report for the reporter of the retired GitHub Classroom: base64 of JSON, on one line.

That reporter shows two totals: the share of its rows that passed times the maximum, and the sum of the rows' scores. So
a row is one unit of points, the largest one that divides every score; then both totals equal the score.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from fractions import Fraction
from math import gcd, lcm

from grader.grading.model.exercise import Outcome
from grader.grading.model.report import ExerciseReport, JsonObject, Report, Verdict
from grader.grading.reporting import wording
from grader.grading.reporting.escape import json_value, log_lines, shown
from grader.grading.reporting.wording import whole_points

#: With more rows than this, scores are rounded to whole points.
MOST_ROWS = 500

_Row = tuple[ExerciseReport, Verdict, int, int]


def render_classroom(report: Report) -> str:
    """Return the reporter's result, with a line break at the end."""
    text = json.dumps(result(report), ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return base64.b64encode(text.encode()).decode() + "\n"


def result(report: Report) -> JsonObject:
    """Return the result before its encoding.

    A report without points has no rows; its two totals are 0.
    """
    unit, rows = _units(report)
    tests = [test for row in rows for test in _tests(*row, unit)]
    status = "pass" if report.all_met else "fail"
    return {
        "version": 1,
        "status": status if report.final else "error",
        "max_score": json_value(unit * len(tests)),
        "tests": tests,
        # The reporter ignores further keys.
        "exact_score": json_value(report.score),
        "exact_max_score": json_value(report.max_score),
        "isolation": report.environment.isolation,
        "opening": wording.opening(report),
        "reproduce": wording.ending_lines(report),
    }


def _units(report: Report) -> tuple[Fraction, list[_Row]]:
    """Return the points of one row, and for each verdict the number of rows earned and in total."""
    found = [(exercise, verdict) for exercise in report.exercises for verdict in exercise.verdicts]
    scores, tops = [v.score for _, v in found], [v.max_score for _, v in found]
    unit = _greatest_unit([*scores, *tops])
    counts = [(int(s / unit), int(t / unit)) for s, t in zip(scores, tops, strict=True)]
    if unit < 1 and sum(top for _, top in counts) > MOST_ROWS:
        unit, counts = Fraction(1), whole_points(scores, tops)
    return unit, [(e, v, *count) for (e, v), count in zip(found, counts, strict=True)]


def _greatest_unit(values: list[Fraction]) -> Fraction:
    denominator = lcm(*(value.denominator for value in values))
    numerator = gcd(*(int(value * denominator) for value in values))
    return Fraction(numerator, denominator) if numerator else Fraction(1)


def _tests(exercise: ExerciseReport, verdict: Verdict, earned: int, rows: int, unit: Fraction) -> Iterator[JsonObject]:
    for row in range(rows):
        got = row < earned
        yield {
            "name": _name(exercise, verdict, row + 1, rows),
            "status": "pass" if got else ("error" if verdict.outcome is Outcome.UNDECIDED else "fail"),
            "score": json_value(unit if got else Fraction(0)),
            "message": "" if got else log_lines(shown(verdict.reason)),
            # The reporter prints this unchanged, so no line of it may be a workflow command. The first row is enough.
            "test_code": "\n".join(map(log_lines, wording.explanation(verdict))) if row == earned else "",
            "filename": "",
            "line_no": 0,
            "duration": 0,
        }


def _name(exercise: ExerciseReport, verdict: Verdict, row: int, rows: int) -> str:
    number = shown(exercise.number, limit=wording.NAME_LIMIT)
    return log_lines(f"{number}: {shown(verdict.title)}" + (f" ({row} of {rows})" if rows > 1 else ""))
