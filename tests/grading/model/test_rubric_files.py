"""The names of a rubric: its file, the folder of its exercise, and the file that it was before there were folders."""

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
from grader.grading.model.rubric_files import rubric_file, rubric_files, rubrics_in
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.loader import read_rubric, side_files

RUBRICS = ROOT / "rubrics"
EARLIER = [RUBRICS / f"{path.parent.name}.yaml" for path in rubrics_in(RUBRICS)]


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


@pytest.mark.breadth(2, 6)
@pytest.mark.parametrize("named", EARLIER, ids=lambda path: path.name)
def test_the_name_that_a_built_in_rubric_once_had_is_that_of_its_file(named: Path) -> None:
    """No such file is there, and no copy of the rubric."""
    assert not named.exists()
    assert rubric_file(named) == named.with_suffix("") / "rubric.yaml"
    assert read_rubric(named) == read_rubric(builtin_rubrics()[read_rubric(named).id])


@pytest.mark.breadth(1, 4)
@pytest.mark.parametrize("named", ["rubrics/one.yaml", "rubrics/one", "rubrics/one/", "rubrics/one/rubric.yaml"])
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


def test_a_file_that_is_there_is_meant_itself(course: Path) -> None:
    """Also beside a folder of its name."""
    shutil.copy("rubrics/two/rubric.yaml", "rubrics/one.yaml")
    assert rubric_file(Path("rubrics/one.yaml")) == Path("rubrics/one.yaml")


@pytest.mark.parametrize("named", ["none.yaml", "rubrics", "", "a\0b.yaml", ".yaml", "..", "a" * 300 + ".yaml"])
def test_another_name_stays_as_it_is(course: Path, named: str) -> None:
    """Whoever reads it says what is wrong with it."""
    assert rubric_file(Path(named)) == Path(named)


def test_a_pattern_that_the_shell_left_names_every_exercise(course: Path) -> None:
    """`rubrics/*.yaml` fitted all rubrics before exercises had folders; shells pass it on if it fits nothing."""
    both = (Path("rubrics/one/rubric.yaml"), Path("rubrics/two/rubric.yaml"))
    assert rubric_files((Path("rubrics/*.yaml"),)) == both
    assert run("rubric", "check", "rubrics/*.yaml")[1].count("velocity_publisher: 1 scenario") == 2
    assert rubric_files((Path("none/*.yaml"),)) == (Path("none/*.yaml"),)


def test_notes_are_found_by_each_name_of_their_rubric(course: Path) -> None:
    """The self-test has a reference solution; an unusable one is the first complaint."""
    for named in ("rubrics/one.yaml", "rubrics/one"):
        code, said = run("selftest", named, "--no-progress")
        assert code == 2
        assert f"rubrics{os.sep}one{os.sep}../../reference_solutions" in said
    code, said = run("selftest", "rubrics/one/selftest.yaml", "--no-progress")
    assert (code, "found notes only; name rubric.yaml" in said) == (2, True)


def test_a_class_that_was_graded_by_the_earlier_name_can_be_graded_again(course: Path) -> None:
    """What the last run used counts as there."""
    from grader.cli.batch import command
    from grader.course.classroom.last_run import LastRun

    gone = LastRun(options={"rubric": ("rubrics/one.yaml",)}, decisions=0)
    assert command._repeated(gone, {}, set()) == {"rubrics": ("rubrics/one.yaml",)}
