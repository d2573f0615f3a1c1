"""PrairieLearn's results.json: a share of the points, rows with points, and a size that is accepted."""

from __future__ import annotations

import json
from typing import Any

import pytest
from report_samples import SAMPLES, criterion, exercise, hostile, middling, report, undecided

from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Report
from grader.grading.reporting.platforms.prairielearn import MOST_BYTES, render_prairielearn


def result(sample: Report, **options: int) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(render_prairielearn(sample, **options), parse_constant=pytest.fail)
    return found


@pytest.mark.parametrize("name", SAMPLES)
def test_every_sample_has_the_keys_and_values_that_the_platform_takes(name: str) -> None:
    """One row without points would hide those of all others."""
    whole = result(SAMPLES[name]())
    assert set(whole) == {"gradable", "score", "message", "output", "tests"}
    assert isinstance(whole["gradable"], bool)
    assert 0 <= whole["score"] <= 1
    for test in whole["tests"]:
        assert set(test) == {"name", "description", "points", "max_points", "message", "output"}
        assert 0 <= test["points"] <= test["max_points"]
        assert all(isinstance(test[key], str) for key in ("name", "description", "message", "output"))


def test_the_score_is_a_share() -> None:
    """13 of 60."""
    assert result(middling())["score"] == pytest.approx(13 / 60, abs=1e-6)
    assert result(report(exercise("e", "1", "E")))["score"] == 0


def test_what_is_undecided_is_not_graded() -> None:
    """The attempt does not count, and the message says why."""
    whole = result(undecided())
    assert whole["gradable"] is False
    assert "undecided through no fault of the student" in whole["message"]
    assert result(middling())["gradable"] is True


def test_detail_gives_way_before_the_file_is_too_long() -> None:
    """Explanations, then the output, then the rows; the score stays, and so does what gives it again."""
    whole = render_prairielearn(hostile())
    short = result(hostile(), limit=len(whole.encode()) - 1)
    assert {test["message"] for test in short["tests"]} == {"left out: the results would be too long"}
    shorter = render_prairielearn(hostile(), limit=2500)
    assert len(shorter.encode()) <= 2500
    assert json.loads(shorter)["output"].startswith("reproduce: grade ")


def test_a_monstrous_report_is_accepted() -> None:
    """A megabyte is the platform's limit."""
    verdicts = [criterion(f"c{n}", "😀" * 400, 1, Outcome.NOT_MET, reason="€" * 500) for n in range(400)]
    sample = report(exercise("e", "1", "E", *verdicts))
    assert len(render_prairielearn(sample, limit=1 << 40).encode()) > MOST_BYTES
    text = render_prairielearn(sample)
    assert len(text.encode()) <= MOST_BYTES
    assert json.loads(text)["score"] == 0
