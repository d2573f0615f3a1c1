"""Partial reports: one whenever an exercise is done and others are not, and never a mark for what is to come."""

import json
import os
import select
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from places import ROOT

from grader.grading.app.grade import EarlyReports, read_exercises
from grader.grading.app.request import GradeRequest
from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Environment, Report
from grader.grading.model.run import Run
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, ClockKind

REFERENCE = ROOT / "reference_solutions"
EXERCISES = read_exercises(GradeRequest("x"))
SCENARIOS = [(exercise.id, scenario.id) for exercise in EXERCISES for scenario in exercise.scenarios]


def a_run() -> Run:
    files = {name: StudentFile(name, name) for exercise in EXERCISES for name in exercise.files}
    submission = Submission("ada", "./ada", Path("nowhere"), "sha256:" + "0" * 64, files)
    environment = Environment("0.1.0", "jazzy", "7.1.6", "rmw_fastrtps_cpp", "3.11.9", "none")
    return Run(submission, traces={}, sources={}, environment=environment, seed=7)


def silent(scenario: str) -> AssessedTrace:
    return AssessedTrace(scenario, ClockKind.VIRTUAL, stop_ns=10**10, observations=())


@pytest.fixture
def heard() -> list[Report]:
    return []


def take_all(reports: EarlyReports, scenarios: Sequence[tuple[str, str]]) -> None:
    for exercise, scenario in scenarios:
        reports.take((exercise, scenario), silent(scenario))


def test_every_exercise_but_the_last_makes_a_report(heard: list[Report]) -> None:
    """After the last one the whole report follows at once."""
    take_all(EarlyReports(EXERCISES, SCENARIOS, a_run(), heard.append), SCENARIOS)
    assert [report.pending for report in heard] == [
        ("odom_subscriber", "two_node_communication"),
        ("two_node_communication",),
    ]


def test_the_order_of_the_recordings_does_not_matter(heard: list[Report]) -> None:
    """An exercise on the wall clock may come last although it was asked for first."""
    take_all(EarlyReports(EXERCISES, SCENARIOS, a_run(), heard.append), SCENARIOS[::-1])
    assert [report.pending for report in heard] == [
        ("velocity_publisher", "odom_subscriber"),
        ("velocity_publisher",),
    ]


def test_what_is_to_come_is_undecided_and_counts_in_the_maximum(heard: list[Report]) -> None:
    """A share of all points means the same in a partial report as in the whole one."""
    take_all(EarlyReports(EXERCISES, SCENARIOS, a_run(), heard.append), SCENARIOS)
    for report in heard:
        assert not report.final
        assert report.max_score == 100
        for part in report.exercises:
            outcomes = {verdict.outcome for verdict in part.verdicts}
            assert (outcomes == {Outcome.UNDECIDED}) == (part.id in report.pending)


def test_an_exercise_whose_files_are_missing_is_judged_with_the_first(heard: list[Report]) -> None:
    """Nothing of it is recorded, so nothing of it is awaited."""
    scenarios = [key for key in SCENARIOS if key[0] != "odom_subscriber"]
    take_all(EarlyReports(EXERCISES, scenarios, a_run(), heard.append), scenarios)
    assert [report.pending for report in heard] == [("two_node_communication",)]


def test_one_exercise_makes_no_partial_report(heard: list[Report]) -> None:
    """There is nothing to wait for."""
    first = [key for key in SCENARIOS if key[0] == "velocity_publisher"]
    take_all(EarlyReports(EXERCISES[:1], first, a_run(), heard.append), first)
    assert heard == []


def reports(data: bytes, found: list[Any]) -> tuple[list[Any], bytes]:
    """Return the reports that are whole, after those that were found before, and the rest of the data."""
    text = data.decode("utf-8", "surrogateescape").lstrip()
    try:
        whole, end = json.JSONDecoder().raw_decode(text)
    except ValueError:
        return found, data
    return reports(text[end:].encode("utf-8", "surrogateescape"), [*found, whole])


@pytest.mark.long
@pytest.mark.ros
def test_a_platform_that_ends_the_run_finds_what_was_earned(tmp_path: Path) -> None:
    """Each exercise that is done adds its points to the file; killed after the first, they are there."""
    pipe = tmp_path / "results.json"
    os.mkfifo(pipe)
    command = [
        sys.executable,
        "-c",
        "from grader.cli.main import main; main()",
        str(REFERENCE),
        "-o",
        f"gradescope={pipe}",
        "--no-progress",
    ]
    reading = os.open(pipe, os.O_RDWR)  # the end of a report does not end the reading, and two may come at once
    data, found = b"", list[Any]()
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as running:
        try:
            while len(found) < 2:
                assert running.poll() is None
                if select.select([reading], [], [], 1)[0]:
                    data += os.read(reading, 1 << 16)
                    found, data = reports(data, found)
        finally:
            running.kill()
            os.close(reading)
    assert [whole["score"] for whole in found] == [30, 60]
    assert [len(whole["extra_data"]["pending"]) for whole in found] == [2, 1]
    assert "This report is partial" in found[1]["output"]
