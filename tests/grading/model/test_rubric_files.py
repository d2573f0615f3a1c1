"""The names of a rubric: its file, and the folder of its exercise."""

from __future__ import annotations

import os
import shutil
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner
from places import ROOT

from grader.cli.main import app
from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest
from grader.grading.model.rubric_files import rubric_file
from grader.grading.rubrics.loader import read_rubric, side_files

RUBRICS = ROOT / "rubrics"


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the rubrics of two exercises, `rubrics/one` and `rubrics/two`, to work in."""
    for name in ("one", "two"):
        shutil.copytree(RUBRICS / "exercise_1", tmp_path / "rubrics" / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(words))
    return result.exit_code, result.output


@pytest.mark.breadth(1, 3)
@pytest.mark.parametrize("named", ["rubrics/one", "rubrics/one/", "rubrics/one/rubric.yaml"])
def test_a_rubric_has_several_names(course: Path, named: str) -> None:
    """Each is read, checked, explained and packed as the same file."""
    assert rubric_file(Path(named)) == Path("rubrics/one/rubric.yaml")
    (exercise,) = read_exercises(GradeRequest("", rubrics=(Path(named),)))
    assert exercise.digest == read_rubric(course / "rubrics/one/rubric.yaml").digest
    assert run("rubric", "check", named) == (
        0,
        "rubrics/one/rubric.yaml: velocity_publisher: 1 scenario, 5 criteria, 30 points\n",
    )
    code, said = run("rubric", "explain", named)
    assert code == 0
    assert "1, Velocity publisher (velocity_publisher)" in said
    assert run("rubric", "schema", named)[0] == 0
    assert run("export", "gradescope", "all.zip", "--rubric", named)[0] == 0
    held = zipfile.ZipFile("all.zip").read("rubrics/1/rubric.yaml")
    assert held == Path("rubrics/one/rubric.yaml").read_bytes()
    assert side_files(Path(named)) == ()


@pytest.mark.parametrize(
    "named", ["none.yaml", "rubrics/one.yaml", "rubrics", "", "a\0b.yaml", ".yaml", "..", "a" * 300 + ".yaml"]
)
def test_another_name_stays_as_it_is(course: Path, named: str) -> None:
    """Whoever reads it says what is wrong with it."""
    assert rubric_file(Path(named)) == Path(named)


def test_notes_are_found_by_each_name_of_their_rubric(course: Path) -> None:
    """The self-test has a reference solution; an unusable one is the first complaint."""
    code, said = run("selftest", "rubrics/one", "--no-progress")
    assert code == 2
    assert f"rubrics{os.sep}one{os.sep}../../reference_solutions" in said
    code, said = run("selftest", "rubrics/one/selftest.yaml", "--no-progress")
    assert (code, "found notes only; name rubric.yaml" in said) == (2, True)
