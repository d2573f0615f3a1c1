"""Gradescope's results.json: the keys and values that the platform takes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pytest
from report_samples import SAMPLES, middling, partial, undecided

from grader.grading.model.report import Report
from grader.grading.reporting.platforms.gradescope import render_gradescope

TOP = {
    "score": (int, float),
    "execution_time": (int, float),
    "output": str,
    "output_format": str,
    "visibility": str,
    "stdout_visibility": str,
    "tests": list,
    "extra_data": dict,
}
TEST = {
    "name": str,
    "name_format": str,
    "number": str,
    "score": (int, float),
    "max_score": (int, float),
    "status": str,
    "output": str,
    "output_format": str,
    "tags": list,
    "visibility": str,
    "extra_data": dict,
}
FORMATS = {"text", "html", "simple_format", "md", "ansi"}
VISIBILITIES = {"hidden", "after_due_date", "after_published", "visible"}


def result(sample: Report) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(render_gradescope(sample), parse_constant=pytest.fail)
    return found


def check(part: Mapping[str, Any], keys: Mapping[str, Any]) -> None:
    assert set(part) == set(keys)
    assert all(isinstance(part[key], kind) and not isinstance(part[key], bool) for key, kind in keys.items())
    assert part["output_format"] in FORMATS
    assert part["visibility"] in VISIBILITIES


@pytest.mark.parametrize("name", SAMPLES)
def test_every_sample_has_the_keys_and_values_that_the_platform_takes(name: str) -> None:
    """Scores are numbers, and the rows add up to the whole."""
    whole = result(SAMPLES[name]())
    check(whole, TOP)
    assert whole["stdout_visibility"] in VISIBILITIES
    for test in whole["tests"]:
        check(test, TEST)
        assert test["status"] in {"passed", "failed"}
        assert 0 <= test["score"] <= test["max_score"]
    assert whole["score"] == pytest.approx(sum(test["score"] for test in whole["tests"]))


def test_texts_are_plain() -> None:
    """What a student wrote is never markup to the platform."""
    whole = result(SAMPLES["hostile"]())
    formats = {test[key] for test in whole["tests"] for key in ("name_format", "output_format")}
    assert formats | {whole["output_format"]} == {"text"}


def test_rows_are_numbered_like_the_exercises_and_say_why() -> None:
    """Exercise 1, criterion 2."""
    rate = result(middling())["tests"][1]
    assert (rate["number"], rate["name"], rate["status"]) == ("1.2", "Publishes at 20 Hz (rate)", "failed")
    assert rate["output"].splitlines()[0] == "not met"
    assert "hint: the argument of create_timer" in rate["output"]
    assert rate["tags"] == ["not_met"]


def test_what_is_not_final_is_said_before_anything_else() -> None:
    """The platform has no word for it, so the output has."""
    assert result(undecided())["output"].splitlines()[1].startswith("This score is not final")
    whole = result(partial())
    assert whole["output"].splitlines()[1].startswith("This report is partial")
    assert whole["extra_data"]["pending"] == ["odom_subscriber"]
    assert whole["score"] == 30
