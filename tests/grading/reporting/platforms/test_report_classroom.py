"""The retired GitHub Classroom's result: both totals of its reporter are the score."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_samples import SAMPLES, exercise, hostile, middling, perfect, report, undecided

from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Report, Verdict
from grader.grading.reporting.platforms.classroom import MOST_ROWS, render_classroom


def result(sample: Report) -> dict[str, Any]:
    text = render_classroom(sample)
    assert text.endswith("\n")
    assert len(text.splitlines()) == 1  # a step output is one line
    found: dict[str, Any] = json.loads(base64.b64decode(text.rstrip("\n"), validate=True))
    return found


def console_total(found: Mapping[str, Any]) -> float:
    """Return the share of passed rows, of the maximum, as the reporter prints it at the end of the log."""
    passed = sum(test["status"] == "pass" for test in found["tests"])
    return float(passed / len(found["tests"]) * found["max_score"])


def annotation_total(found: Mapping[str, Any]) -> float:
    """Return the sum of the rows, as the reporter annotates it."""
    return float(sum(test["score"] for test in found["tests"]))


@pytest.mark.parametrize("name", SAMPLES)
def test_both_totals_are_the_score(name: str) -> None:
    """Rows of unequal worth would make them differ."""
    sample = SAMPLES[name]()
    found = result(sample)
    assert console_total(found) == pytest.approx(float(sample.score))
    assert annotation_total(found) == pytest.approx(float(sample.score))
    assert found["max_score"] == sample.max_score


@pytest.mark.parametrize("name", SAMPLES)
def test_rows_have_every_key_that_the_reporter_reads(name: str) -> None:
    """A missing one crashes it, or is sent to the service as nothing."""
    found = result(SAMPLES[name]())
    assert found["version"] == 1
    assert found["tests"]
    for test in found["tests"]:
        assert {"name", "status", "score", "message", "test_code", "filename", "line_no", "duration"} == set(test)
        assert test["status"] in ("pass", "fail", "error")
        assert isinstance(test["line_no"], int)


SHARES = st.fractions(min_value=0, max_value=1, max_denominator=12)


@given(st.lists(st.tuples(st.integers(1, 40), SHARES), min_size=1, max_size=12))
def test_both_totals_agree_for_any_scores(rows: Sequence[tuple[int, Fraction]]) -> None:
    """Thirds, halves and whole points mixed; where rows would be too many, both are the rounded score."""
    verdicts = [
        Verdict(f"c{n}", "C", Outcome.MET if share == 1 else Outcome.PARTLY, top * share, Fraction(top), "x")
        for n, (top, share) in enumerate(rows)
    ]
    sample = report(exercise("e", "1", "E", *verdicts))
    found = result(sample)
    assert console_total(found) == pytest.approx(annotation_total(found), abs=1e-3)
    assert abs(annotation_total(found) - float(sample.score)) < 1
    assert (found["status"] == "pass") == (annotation_total(found) == found["max_score"])


def test_the_status_tells_a_lost_point_from_a_fault_of_ours() -> None:
    """Only what is undecided is an error."""
    assert result(perfect())["status"] == "pass"
    assert result(middling())["status"] == "fail"
    found = result(undecided())
    assert found["status"] == "error"
    assert {t["message"] for t in found["tests"] if t["status"] == "error"} == {
        "the worker ended before the scenario did (signal 9)"
    }


def test_a_reason_is_told_once() -> None:
    """A lost criterion of ten points is ten rows, and explained at the first."""
    rows = [t for t in result(middling())["tests"] if "20 Hz" in t["name"]]
    assert [bool(row["test_code"]) for row in rows] == [True] + [False] * 9
    assert "hint: the argument of create_timer" in rows[0]["test_code"]


def test_rows_are_as_coarse_as_the_scores_allow() -> None:
    """Points in steps of five need one row for five."""
    verdicts = [Verdict("a", "A", Outcome.MET, Fraction(10), Fraction(10), "x")]
    verdicts.append(Verdict("b", "B", Outcome.PARTLY, Fraction(5), Fraction(15), "x"))
    assert [t["score"] for t in result(report(exercise("e", "1", "E", *verdicts)))["tests"]] == [5, 5, 5, 0, 0]


def test_scores_in_tiny_steps_are_rounded() -> None:
    """Ten thousand rows would be useless; the exact score is beside them."""
    odd = Verdict("a", "A", Outcome.PARTLY, Fraction(1000, 997), Fraction(30), "x")
    found = result(report(exercise("e", "1", "E", odd)))
    assert len(found["tests"]) == 30 <= MOST_ROWS
    assert annotation_total(found) == pytest.approx(console_total(found)) == 1
    assert found["exact_score"] == 1.003009


def test_nothing_that_is_printed_is_a_command_to_the_runner() -> None:
    """The reporter prints names, messages and code as they are."""
    attack = "::error::x\n  ::stop-commands::y\n##[error]z"
    verdict = Verdict("a", attack, Outcome.NOT_MET, Fraction(0), Fraction(2), attack, hint=attack)
    for test in result(report(exercise("e", attack, "E", verdict)))["tests"] + result(hostile())["tests"]:
        for text in (test["name"], test["message"], test["test_code"]):
            assert not any(line.lstrip().startswith("::") or "##[" in line for line in text.splitlines())
