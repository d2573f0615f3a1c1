"""Another rubric for a class: judged again from kept recordings where it asks for no other recording."""

from __future__ import annotations

import csv
import io
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from kept_runs import RUBRICS
from regraded_class import RATES, grade, rubric

from grader.course.classroom.outputs import render_graded
from grader.course.classroom.store import BEFORE, ResultStatus, State
from grader.course.classroom.watching import Watcher
from grader.grading.app.kept_recordings import PlannedRun, recorded_alike
from grader.grading.app.request import GradeRequest
from grader.grading.evidence.store import open_evidence
from grader.grading.model.exercise import Exercise
from grader.grading.rubrics.loader import read_rubric

POINTS = ("points: 5", "points: 7")  # of two criteria
LONGER = ("wait_at_most: 60 s", "wait_at_most: 50 s")  # of what is recorded


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a class and its rubric."""
    for name in RATES:
        (tmp_path / "in" / name).mkdir(parents=True)
        (tmp_path / "in" / name / "velocity_publisher.py").write_text(f"# {name}\n", encoding="utf-8")
    rubric(tmp_path)
    return tmp_path


def table(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"), newline="")))


def files(folder: Path) -> dict[str, bytes]:
    """Return the content of all results but for times, which differ between two runs."""
    found = {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    return {name: data for name, data in found.items() if not name.endswith((".key", "result.json", "index.html"))}


def test_nothing_runs_where_only_judging_changed(folder: Path) -> None:
    """The gradebook, the reports and their summary follow."""
    assert grade(folder)[1] == ["ada", "bob", "cleo"]
    rubric(folder, POINTS)
    graded, ran, lines = grade(folder)
    assert ran == []
    assert lines[0] == "to grade: 3 (3 of them from kept recordings)"
    scores = {row["submission"]: (row["score"], row["max_score"]) for row in table(folder / "out/gradebook.csv")}
    assert scores == {"ada": ("34", "34"), "bob": ("24", "34"), "cleo": ("34", "34")}
    text = render_graded(graded)
    assert text.startswith(
        "graded now: 3 (3 from kept recordings, 0 run), done before: 0\nchanged: 3 of 3: 1 up, 0 down"
    )
    assert "velocity_publisher/linear_velocity: 5 -> 7 points; 3 changed, mean 5.0 -> 7.0" in text
    assert {row["submission"] for row in table(folder / "out/changes.csv")} == set(RATES)
    kept = (folder / "out/changes.csv").read_bytes()
    assert grade(folder)[0].graded == 0
    assert (
        grade(folder, rerun="all")[0].graded == 3
    )  # with the same results: no record of changes replaces the real one
    assert (folder / "out/changes.csv").read_bytes() == kept


def test_results_are_those_of_a_run(folder: Path) -> None:
    """Byte for byte, evidence and feedback included, but for the digest of the rubric by which it was recorded."""
    grade(folder)
    rubric(folder, POINTS)
    grade(folder)
    again = files(folder / "out")
    grade(folder, rerun="all")
    run = files(folder / "out")
    recordings = {name for name in run if name.endswith((".mcap", "evidence.json"))}
    assert len(recordings) == 6
    different = {name for name in again.keys() | run.keys() if again.get(name) != run.get(name)}
    assert different - recordings == {"batch.json"}


def test_a_changed_scenario_is_recorded_again(folder: Path) -> None:
    """Of everybody, because it asks for another recording."""
    grade(folder)
    rubric(folder, LONGER)
    graded, ran, _ = grade(folder)
    assert ran == ["ada", "bob", "cleo"]
    assert (graded.now.judged, graded.now.run) == (0, 3)


@pytest.mark.breadth(2, 6)
@pytest.mark.parametrize(
    "change",
    [
        {"rerun": "all"},
        {"grading": {"seed": 5}},
        {"grading": {"clock": "wall"}},
        {"grading": {"isolation": "none"}},
        {"grading": {"time_budget_s": 7.0}},
        {"grading": {"spot_checks": 1.0}},
    ],
    ids=str,
)
def test_recordings_of_other_conditions_are_not_used(folder: Path, change: dict[str, Any]) -> None:
    """They would not be what a run records now."""
    grade(folder)
    rubric(folder, POINTS)
    grading = GradeRequest("", rubrics=(folder / "rubric.yaml",))
    if isinstance(change.get("grading"), dict):
        change = {"grading": replace(grading, **change["grading"])}
    assert grade(folder, **change)[1] == ["ada", "bob", "cleo"]


def test_recordings_of_other_files_are_not_used(folder: Path) -> None:
    """Only the submission that was handed in again runs."""
    grade(folder)
    (folder / "in/bob/velocity_publisher.py").write_text("# another\n", encoding="utf-8")
    rubric(folder, POINTS)
    graded, ran, lines = grade(folder)
    assert ran == ["bob"]
    assert lines[0] == "to grade: 3 (2 of them from kept recordings)"
    assert {c.name for c in graded.changes} == {"ada", "cleo"}  # with other files there is nothing to compare


@pytest.mark.breadth(1, 3)
@pytest.mark.parametrize("damage", ["recording", "manifest", "seed"])
def test_damaged_recordings_are_made_again(folder: Path, damage: str) -> None:
    """Only that submission runs."""
    grade(folder)
    evidence = folder / "out/students/bob/evidence"
    if damage == "recording":
        (evidence / "velocity_publisher.alone/velocity_publisher.alone_0.mcap").write_bytes(b"x")
    elif damage == "manifest":
        (evidence / "evidence.json").write_text("{}", encoding="utf-8")
    else:
        manifest = (evidence / "evidence.json").read_text(encoding="utf-8")
        seed = open_evidence(evidence).manifest.run.seed
        (evidence / "evidence.json").write_text(manifest.replace(f'"seed": {seed}', '"seed": 1'), encoding="utf-8")
    rubric(folder, POINTS)
    graded, ran, lines = grade(folder)
    assert ran == ["bob"]
    assert (graded.now.judged, graded.now.run) == (2, 1)
    told = [line for line in lines if "its recordings cannot be used, so it is run again" in line]
    assert len(told) == (damage == "recording")  # the others are found out before


class InterruptedAfterBob(Watcher):
    """Stands for Ctrl-C when two of three are done."""

    def done(self, name: str, status: ResultStatus) -> None:
        super().done(name, status)
        if name == "bob":
            raise KeyboardInterrupt


def test_a_killed_run_goes_on_and_tells_all_changes(folder: Path) -> None:
    """Also of those that it judged before it was killed."""
    grade(folder)
    rubric(folder, POINTS)
    with pytest.raises(KeyboardInterrupt):
        grade(folder, InterruptedAfterBob)
    graded, ran, lines = grade(folder)
    assert (lines[0], ran) == ("to grade: 1 (1 of them from kept recordings), done before: 2", [])
    assert len(graded.changes) == 3
    assert not list(folder.rglob(BEFORE))


@pytest.mark.nightly
def test_many_are_judged_by_several_processes(folder: Path) -> None:
    """With the same results, also if the recordings of one are damaged."""
    grade(folder)
    for k in range(40):
        name = f"s{k:02}"
        RATES[name] = 20
        (folder / "in" / name).mkdir()
        (folder / "in" / name / "velocity_publisher.py").write_text(f"# {name}\n", encoding="utf-8")
    try:
        assert len(grade(folder)[1]) == 40
        rubric(folder, POINTS)
        graded, ran, _ = grade(folder, jobs=2)
        assert (ran, graded.now.judged) == ([], 43)
        assert {row["score"] for row in table(folder / "out/gradebook.csv")} == {"34", "24"}
    finally:
        for k in range(40):
            del RATES[f"s{k:02}"]


def exercise(*changes: tuple[str, str], folder: Path) -> Exercise:
    rubric(folder, *changes)
    return read_rubric(folder / "rubric.yaml")


def test_only_the_same_recording_is_used(folder: Path) -> None:
    """Of the same scenario, seed and files."""
    grade(folder)
    evidence = open_evidence(folder / "out/students/ada/evidence")
    digest, seed = evidence.manifest.submission.digest, evidence.manifest.run.seed
    same = exercise(POINTS, folder=folder)
    assert recorded_alike(evidence, [same], PlannedRun(digest, seed, "")) == (same,)
    assert recorded_alike(evidence, [same], PlannedRun(digest, seed + 1, "")) == ()
    assert recorded_alike(evidence, [same], PlannedRun("sha256:" + "0" * 64, seed, "")) == ()
    assert recorded_alike(evidence, [exercise(LONGER, folder=folder)], PlannedRun(digest, seed, "")) == ()
    other = read_rubric(RUBRICS / "exercise_2" / "rubric.yaml")
    assert recorded_alike(evidence, [other], PlannedRun(digest, seed, "")) == ()


@pytest.mark.nightly
@pytest.mark.ros
def test_only_the_changed_exercise_of_a_submission_runs(tmp_path: Path) -> None:
    """Its other recordings are used as they are, and the report is that of a whole run."""
    for number in (1, 2):
        shutil.copytree(RUBRICS / f"exercise_{number}", tmp_path, dirs_exist_ok=True)
        (tmp_path / "rubric.yaml").rename(tmp_path / f"{number}.yaml")
    (tmp_path / "in" / "ada").mkdir(parents=True)
    for path in (RUBRICS.parent / "reference_solutions").rglob("*.py"):
        (tmp_path / "in" / "ada" / path.name).write_bytes(path.read_bytes())
    words = ["batch", "in", "-o", "out", "--rubric", "1.yaml", "--rubric", "2.yaml", "--spot-checks", "0%"]
    command = [sys.executable, "-c", "from grader.cli.main import main; main()", *words]

    def run() -> str:
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    def recordings(number: str) -> list[int]:
        folder = tmp_path / "out/students/ada/evidence"
        return [path.stat().st_mtime_ns for path in sorted(folder.rglob(f"{number}*.mcap"))]

    assert "graded now: 1, done" in run()
    text = (tmp_path / "1.yaml").read_text(encoding="utf-8")
    (tmp_path / "1.yaml").write_text(text.replace(*LONGER), encoding="utf-8")
    assert "graded now: 1 (0 from kept recordings, 1 run, 1 of them only for what changed)" in run()
    assert recordings("velocity_publisher")
    assert State.GRADED.value == table(tmp_path / "out/gradebook.csv")[0]["status"]
