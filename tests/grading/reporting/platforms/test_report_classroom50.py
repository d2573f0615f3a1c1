"""Classroom 50's result.json: its schema, whole points that add up, exact ones beside them."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any

import jsonschema
import pytest
from places import SHARED
from report_samples import HANDED_IN, SAMPLES, criterion, exercise, middling, report, undecided

from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Report, Verdict
from grader.grading.reporting.platforms.classroom50 import render_classroom50

SCHEMA = SHARED / "formats" / "classroom50-result-v1.schema.json"


def result(sample: Report) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(render_classroom50(sample, HANDED_IN))
    return found


@pytest.mark.skipif(not SCHEMA.exists(), reason="the platform's schema is not beside this checkout")
@pytest.mark.parametrize("name", SAMPLES)
def test_every_sample_follows_the_platform_s_schema(name: str) -> None:
    """No key too many, none too few, whole numbers."""
    jsonschema.validate(result(SAMPLES[name]()), json.loads(SCHEMA.read_text(encoding="utf-8")))


@pytest.mark.parametrize("name", SAMPLES)
def test_scores_are_whole_bounded_and_add_up(name: str) -> None:
    """What the platform's own code checks besides its schema."""
    whole = result(SAMPLES[name]())
    for part in (whole, *whole["tests"]):
        assert type(part["score"]) is type(part["max-score"]) is int
        assert 0 <= part["score"] <= part["max-score"]
    assert whole["score"] == sum(test["score"] for test in whole["tests"])
    assert whole["max-score"] == sum(test["max-score"] for test in whole["tests"])


def test_exact_values_stand_beside_the_rounded_ones() -> None:
    """Half a point is not lost, only rounded."""
    halves = [Verdict(i, i, Outcome.PARTLY, Fraction(5, 2), Fraction(5), "why") for i in ("a", "b", "c")]
    whole = result(report(exercise("e", "1", "E", *halves)))
    assert [(t["score"], t["exact-score"]) for t in whole["tests"][:-1]] == [(3, 2.5), (3, 2.5), (2, 2.5)]
    assert (whole["score"], whole["tests"][-1]["exact-score"]) == (8, 7.5)


def test_rows_say_why() -> None:
    """Reason, hint and place come along, for the platform shows extra keys."""
    rate = next(t for t in result(middling())["tests"] if t.get("criterion") == "rate")
    assert rate["passed"] is False
    assert rate["reason"].startswith("/cmd_vel: 10.00 Hz, expected 20 ± 1 Hz")
    assert rate["more"][0].startswith("hint: the argument of create_timer")
    assert rate["more"][1] == "at velocity_publisher.py:17"


def test_the_last_row_has_no_points_and_tells_whether_the_result_is_final() -> None:
    """An undecided result does not silently look like a low one."""
    last = result(undecided())["tests"][-1]
    assert (last["test-name"], last["passed"], last["max-score"]) == ("This result is not final", False, 0)
    assert last["isolation"] == "none"
    assert result(report(exercise("e", "1", "E", criterion("c", "C", 1))))["tests"][-1]["passed"] is True


def test_the_time_is_the_commit_s() -> None:
    """The same submission graded later gives the same bytes."""
    assert result(middling())["datetime"] == HANDED_IN.datetime
