"""An exercise can be moved to another repository: copies of its folders grade as the originals do, byte for byte."""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from archive import judged, read_archive
from sample_folders import ARCHIVE, EXERCISES, expected_in
from tiers import LONG, NIGHTLY, but

from grader.grading.model.rubric_files import rubric_file, rubrics_in
from grader.grading.reporting.json_report import dumps
from grader.grading.rubrics.loader import read_rubric

ROOT = EXERCISES.parents[1]
NAMES = sorted(path.name for path in EXERCISES.glob("[!_]*/"))
#: Graded before a change lands: one that plays a recording of its own, by default, and one of two nodes.
USUAL: dict[str, tuple[pytest.MarkDecorator, ...]] = {"exercise_2": (), "exercise_3": (LONG,)}
GRADE = (sys.executable, "-c", "from grader.cli.main import main; main()")


@pytest.fixture
def moved(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A folder with nothing but the two folders of an exercise, its solution and its template."""
    place = tmp_path / "course"
    shutil.copytree(ROOT / "rubrics" / request.param, place / "rubric", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(EXERCISES / request.param, place / "tests")
    return place


def test_each_exercise_has_both_folders() -> None:
    """Its rubric lies in one, its test submissions in the other."""
    assert [path.parent.name for path in rubrics_in(ROOT / "rubrics")] == NAMES


@pytest.mark.breadth(1, 0)
@pytest.mark.parametrize("moved", but(["project_2"], NAMES), indirect=True)
def test_what_was_recorded_is_judged_the_same_elsewhere(moved: Path) -> None:
    """By the copied rubric, from the copied recordings: the same reports."""
    exercise = read_rubric(rubric_file(moved / "rubric"))
    differ = [
        name
        for name, recorded in read_archive(moved / "tests" / ARCHIVE).items()
        if dumps(judged(recorded, {exercise.id: exercise})) != recorded.report.decode()
    ]
    assert differ == []
    assert expected_in(moved / "tests").keys() == read_archive(moved / "tests" / ARCHIVE).keys()


@pytest.mark.nightly
@pytest.mark.breadth(0, 1)
@pytest.mark.ros
@pytest.mark.parametrize(
    "moved",
    [pytest.param(name, marks=USUAL.get(name, (NIGHTLY,))) for name in NAMES],
    indirect=True,
)
def test_a_copied_exercise_grades_real_nodes(moved: Path) -> None:
    """The reference solution gets every point, and a wrong program loses what it should."""
    exercise = read_rubric(rubric_file(moved / "rubric"))
    right = moved / "right"
    right.mkdir()
    for file in exercise.files:
        shutil.copy(ROOT / "reference_solutions" / file, right)
    wrong = next(name for name in expected_in(moved / "tests") if name.startswith("wrong/"))
    for submission, lost in (("right", {}), (f"tests/{wrong}", expected_in(moved / "tests")[wrong]["expected"])):
        words = [submission, "--rubric", "rubric", "--seed", "1", "--json", "--no-progress"]
        done = subprocess.run([*GRADE, *words], cwd=moved, check=False, capture_output=True, text=True)
        verdicts = [v for e in json.loads(done.stdout)["exercises"] for v in e["criteria"]]
        assert {v["id"]: v["outcome"] for v in verdicts if v["outcome"] != "met"} == lost, done.stderr


FILES = sorted((ROOT / "rubrics").rglob("*.py"))


def packages_in(tree: ast.Module) -> set[str]:
    """Return what a file imports: `grader.api` and `grader.api.unstable` as a whole, of others the package."""
    absolute = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    names = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    names |= {"." * node.level + (node.module or "") for node in absolute}
    return {name if name.startswith("grader") else name.split(".")[0] for name in names}


@pytest.mark.parametrize("file", FILES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_what_an_exercise_brings_imports_the_public_door_alone(file: Path) -> None:
    """Besides it the standard library; the script that makes a recording runs alone and needs nothing of the grader."""
    found = packages_in(ast.parse(file.read_text(encoding="utf-8"))) - set(sys.stdlib_module_names)
    if file.name in ("checks.py", "hints.py"):
        assert found == {"grader.api", "grader.api.unstable"}
    else:
        assert not [name for name in found if name.startswith("grader")]


@pytest.mark.parametrize(
    "line", ["import grader.runtime.model.trace", "from grader.grading.judging import values", "from . import a"]
)
def test_another_import_is_found(line: str) -> None:
    """The rule can fail."""
    assert packages_in(ast.parse(line)) - set(sys.stdlib_module_names) - {"grader.api", "grader.api.unstable"}
