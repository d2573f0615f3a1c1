"""Grading, observing and judging again from Python, on real nodes."""

from __future__ import annotations

from pathlib import Path

import pytest
from places import ROOT

from grader.api import GraderError, Outcome, SubmissionError, grade, observe, rejudge


@pytest.mark.ros
def test_a_submission_is_graded_kept_and_judged_again(tmp_path: Path) -> None:
    """With the same result."""
    folder = ROOT / "reference_solutions"
    report = grade(folder, exercises=["1"], seed=3, evidence=tmp_path / "kept")
    assert (report.all_met, report.seed) == (True, 3)
    again = rejudge(tmp_path / "kept")
    assert [v.outcome for e in again.exercises for v in e.verdicts] == [Outcome.MET] * len(report.exercises[0].verdicts)
    assert again.score == report.score


@pytest.mark.ros
def test_a_program_is_observed_without_a_rubric() -> None:
    """What it publishes is told, and how often."""
    summary = observe(ROOT / "reference_solutions" / "velocity_publisher.py", duration_s=3)
    assert summary.duration_s == 3
    assert "/cmd_vel" in [topic.name for topic in summary.topics]


def test_an_error_says_who_must_act(tmp_path: Path) -> None:
    """Each is a GraderError."""
    with pytest.raises(SubmissionError) as error:
        grade(tmp_path / "nothing", isolation="none")
    assert isinstance(error.value, GraderError)
    with pytest.raises(GraderError):
        rejudge(tmp_path)
