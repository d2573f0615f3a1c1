"""The compiled form of what is shipped says what its sources say, and is made anew when they change."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from tracing import ODOMETRY

from grader.grading.app.bags import read_recordings, shipped_recording
from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest
from grader.grading.rubrics.builtin import (
    builtin_exercises,
    builtin_headers,
    builtin_recording,
    builtin_rubrics,
    exercises_in,
)
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.compiled import compiled, state_in, state_of, state_of_package
from grader.runtime.recording.bag import read_bag
from grader.runtime.shipped import shipped


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An empty folder for compiled forms."""
    path = tmp_path / "compiled"
    path.mkdir()
    return path


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """A file that a value is read from."""
    path = tmp_path / "source"
    path.write_text("one")
    return path


def never() -> str:
    raise AssertionError("it was read again")


def test_the_compiled_form_equals_its_sources(folder: Path) -> None:
    """Rubrics and recording, when they are compiled and when they are loaded."""
    rubrics = tuple(read_rubric(header.path) for header in builtin_headers())
    recording = read_bag(builtin_recording(), "/odom", ODOMETRY)
    for _ in ("compiled", "loaded"):
        assert exercises_in(shipped("rubrics"), folder) == rubrics
        assert shipped_recording.__wrapped__(builtin_recording(), "/odom", ODOMETRY, folder) == recording
        assert len(list(folder.iterdir())) == 2
    assert builtin_exercises() == rubrics
    assert list(read_recordings(GradeRequest("x"), rubrics).values()) == [recording]


def test_an_unchanged_source_is_not_read_again(folder: Path, source: Path) -> None:
    """The value is loaded."""
    assert compiled("it", state_of([source]), source.read_text, folder) == "one"
    assert compiled("it", state_of([source]), never, folder) == "one"


def test_a_changed_source_is_read_again(folder: Path, source: Path) -> None:
    """Also one that was added."""
    compiled("it", state_of([source]), source.read_text, folder)
    source.write_text("three")
    assert compiled("it", state_of([source]), source.read_text, folder) == "three"
    other = source.with_name("other")
    other.write_text("")
    assert compiled("it", state_of([source, other]), lambda: "more", folder) == "more"


def test_any_changed_file_of_an_exercise_makes_the_exercises_anew(folder: Path, tmp_path: Path) -> None:
    """Rubric, checks, hint rules, recording, whatever an exercise brings; and a file that is new."""
    copy = tmp_path / "rubrics"
    shutil.copytree(shipped("rubrics"), copy, ignore=shutil.ignore_patterns("__pycache__"))
    states = [state_in(copy)]
    for number, path in enumerate(sorted(path for path in copy.rglob("*") if path.is_file()), 1):
        os.utime(path, (number, number))
        states.append(state_in(copy))
    (copy / "exercise_2" / "more.py").write_text("")
    (copy / "exercise_2" / ".#rubric.yaml").symlink_to("nowhere")
    (copy / "exercise_2" / "__pycache__").mkdir()
    states.append(state_in(copy))
    (copy / "exercise_2" / "__pycache__" / "more.pyc").write_text("")
    assert state_in(copy) == states[-1]
    assert len(set(states)) == len(states)
    before = exercises_in(copy, folder)
    rubric = copy / "exercise_1" / "rubric.yaml"
    rubric.write_text(rubric.read_text(encoding="utf-8").replace("title: ", "title: New ", 1), encoding="utf-8")
    after = exercises_in(copy, folder)
    assert after[0].title == f"New {before[0].title}"
    assert after[1:] == before[1:]


def test_one_exercise_has_the_recording_that_the_older_stimulus_plays() -> None:
    """It is the one that its rubric names, too."""
    (found,) = shipped("rubrics").glob("*/odometry")
    assert found == builtin_recording()
    assert found.parent == builtin_rubrics()["odom_subscriber"].parent


def test_a_changed_added_or_removed_module_changes_the_state_of_the_package(tmp_path: Path) -> None:
    """Byte code and other files do not."""
    module, inner = tmp_path / "one.py", tmp_path / "inner" / "two.py"
    inner.parent.mkdir()
    states = []
    for change in (
        lambda: module.write_text("1"),
        lambda: inner.write_text("1"),
        lambda: module.write_text("12"),
        lambda: os.utime(inner, (1, 1)),
        inner.unlink,
    ):
        change()
        states.append(state_of_package.__wrapped__(tmp_path))
    assert len(set(states)) == len(states)
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__" / "three.py").write_text("")
    (tmp_path / "data").write_text("")
    assert state_of_package.__wrapped__(tmp_path) == states[-1]


@pytest.mark.parametrize(
    "damage", [lambda b: b[:-1], lambda b: b[:40], lambda b: b"", lambda b: b[:32] + b"cos\nno\n."]
)
def test_a_damaged_form_is_ignored(folder: Path, source: Path, damage: Callable[[bytes], bytes]) -> None:
    """And replaced."""
    compiled("it", state_of([source]), source.read_text, folder)
    (file,) = folder.iterdir()
    file.write_bytes(damage(file.read_bytes()))
    assert compiled("it", state_of([source]), lambda: "again", folder) == "again"
    assert compiled("it", state_of([source]), never, folder) == "again"


def test_a_folder_that_cannot_be_written_to_does_not_matter(folder: Path, source: Path) -> None:
    """The sources are read every time, and nothing is left behind."""
    folder.rmdir()
    assert [compiled("it", state_of([source]), source.read_text, folder) for _ in range(2)] == ["one", "one"]
    assert not folder.exists()


def test_an_exercise_that_is_graded_on_request_is_left_out() -> None:
    """Unless all are asked for, or it alone."""
    usual, every = read_exercises(GradeRequest("")), read_exercises(GradeRequest("", every=True))
    assert [e.id for e in every if not e.by_request] == [e.id for e in usual]
    assert len(usual) < len(every) == len(builtin_headers())
    assert [e.id for e in read_exercises(GradeRequest("", exercises=(every[-1].id,)))] == [every[-1].id]
