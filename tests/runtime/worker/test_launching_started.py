"""Programs that a rubric starts with arguments, parameters, remappings, names: on both clocks and as bare processes."""

from __future__ import annotations

from pathlib import Path

import pytest
from decided import grade_until_decided
from places import TESTS

from grader.grading.app.request import GradeRequest
from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Report
from grader.grading.rubrics.loader import read_rubric

HERE = TESTS / "packages"
RUBRIC = HERE / "rubrics" / "started.yaml"


def outcomes(report: Report) -> dict[str, Outcome]:
    (exercise,) = report.exercises
    return {verdict.id: verdict.outcome for verdict in exercise.verdicts}


def test_provided_files_are_part_of_the_rubric(tmp_path: Path) -> None:
    """Their text is in the scenarios that use them, and in the digest."""
    for file in RUBRIC.parent.glob("*.yaml"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    before = read_rubric(tmp_path / RUBRIC.name)
    assert [dict(s.provided) for s in before.scenarios] == [{"given.yaml": (tmp_path / "given.yaml").read_text()}, {}]
    assert [s.wanted for s in before.scenarios] == [("talker.py",), ("talker.py", "own.yaml")]
    (tmp_path / "given.yaml").write_text("/**: {ros__parameters: {frame: odom}}\n")
    assert read_rubric(tmp_path / RUBRIC.name).digest != before.digest


@pytest.mark.ros
def test_what_a_program_is_started_with_reaches_it() -> None:
    """Every kind of parameter, names and remappings; a program that ignores them is told apart."""
    report = grade_until_decided(GradeRequest(str(HERE / "right"), rubrics=(RUBRIC,), clock="virtual"))
    assert set(outcomes(report).values()) == {Outcome.MET}, report
    notes = " ".join(report.exercises[0].notes)
    for said in ("hello --ros-args -r __node:=lidar -r __ns:=/robot1 -r chatter:=/talk", "--params-file own.yaml"):
        assert said in notes
    deaf = grade_until_decided(GradeRequest(str(HERE / "deaf"), rubrics=(RUBRIC,), clock="virtual"))
    assert outcomes(deaf) == {"rate": Outcome.NOT_MET, "told": Outcome.MET, "own": Outcome.NOT_MET}


@pytest.mark.ros
@pytest.mark.long
def test_a_bare_process_is_started_with_the_same() -> None:
    """A spot check would find any difference between the clocks, and say so."""
    request = GradeRequest(str(HERE / "right"), rubrics=(RUBRIC,), clock="auto", spot_checks=1.0)
    report = grade_until_decided(request)
    assert set(outcomes(report).values()) == {Outcome.MET}
    assert report.exercises[0].clock.value == "virtual"


@pytest.mark.ros
@pytest.mark.long
def test_a_missing_parameter_file_is_missing(tmp_path: Path) -> None:
    """Only what needs it is lost."""
    (tmp_path / "talker.py").write_text("x = 1\n")
    report = grade_until_decided(GradeRequest(str(tmp_path), rubrics=(RUBRIC,), clock="virtual"))
    reasons = {verdict.id: verdict.reason for verdict in report.exercises[0].verdicts}
    assert reasons["own"] == "own.yaml: not in the submission"
    assert "own.yaml" not in reasons["rate"]
