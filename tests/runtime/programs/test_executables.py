"""Which file of a submission an executable stands for, and what is told where there is none."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from places import TESTS

from grader.grading.submissions.projects import read_projects
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.submission import StudentFile
from grader.runtime.programs.executables import find_executable

WORKSPACE = TESTS / "packages" / "workspace"
NODES = "src/robot/robot/nodes.py"


def found(folder: Path, wanted: str, into: Path) -> tuple[StudentFile, tuple[str, ...]]:
    into.mkdir()
    submission = stage_submission(str(folder), [wanted], into)
    return submission.files[wanted], submission.notes


@pytest.mark.parametrize("wanted", ["robot/listener", "*/listener"])
def test_an_executable_is_found_by_its_entry_point(tmp_path: Path, wanted: str) -> None:
    """In the named package, or in any."""
    file, notes = found(WORKSPACE, wanted, tmp_path / "s")
    assert (file.found, file.executable, notes) == (NODES, "listener", ())


def test_an_executable_stands_for_the_file_of_its_name(tmp_path: Path) -> None:
    """Where there is no such file; the report says so."""
    file, notes = found(WORKSPACE, "talker.py", tmp_path / "s")
    assert (file.found, file.executable) == (NODES, "talker")
    assert notes == (f"talker.py: the graded executable is talker, in {NODES}",)


def test_what_is_there_instead_is_told(tmp_path: Path) -> None:
    """Executables with similar names first; an entry point without its file is named."""
    file, _ = found(WORKSPACE, "robot/talkr", tmp_path / "similar")
    assert (file.found, file.similar, file.candidates) == (None, ("robot/talker",), ("robot/listener",))
    broken = tmp_path / "broken"
    shutil.copytree(WORKSPACE, broken)
    (broken / NODES).rename(broken / "src/robot/robot/others.py")
    file, _ = found(broken, "robot/talker", tmp_path / "missing")
    assert file.problem == "the entry point robot/talker is robot.nodes:talk, which is not in the submission"


@pytest.mark.parametrize("setup", ["setup.cfg", "pyproject.toml"])
def test_entry_points_may_be_declared_elsewhere(tmp_path: Path, setup: str) -> None:
    """As setuptools reads them."""
    if setup == "pyproject.toml":
        pytest.importorskip("tomllib")
    texts = {
        "setup.cfg": "[options.entry_points]\nconsole_scripts =\n    go = robot.nodes:talk\n",
        "pyproject.toml": '[project]\nname = "robot"\n[project.scripts]\ngo = "robot.nodes:talk"\n',
    }
    (tmp_path / "robot").mkdir()
    (tmp_path / "robot" / "nodes.py").touch()
    (tmp_path / "package.xml").write_text("<package><name>robot</name></package>")
    (tmp_path / setup).write_text(texts[setup])
    executable = find_executable(tmp_path, read_projects(tmp_path)[0], "robot", "go")
    assert executable is not None
    assert executable.file == "robot/nodes.py"


@pytest.mark.parametrize("name", ["../../../etc/passwd", "/bin/sh", "", "nodes"])
def test_nothing_outside_of_the_submission_is_an_executable(name: str) -> None:
    """Names come from launch files, which students write."""
    assert find_executable(WORKSPACE, read_projects(WORKSPACE)[0], "robot", name) is None


def test_a_file_that_is_installed_without_permission_is_found_with_a_note(tmp_path: Path) -> None:
    """After `colcon build --symlink-install` it runs, if its source is executable."""
    package = tmp_path / "talk"
    (package / "scripts").mkdir(parents=True)
    (package / "scripts" / "talker.py").touch()
    (package / "package.xml").write_text("<name>talk</name>")
    (package / "CMakeLists.txt").write_text("install(FILES scripts/talker.py DESTINATION lib/talk)\n")
    file, notes = found(tmp_path / "talk", "talk/talker.py", tmp_path / "staged")
    assert file.found == "scripts/talker.py"
    assert notes == (
        "scripts/talker.py is not installed as a program, so that `ros2 run` may not find it; "
        "install it with install(PROGRAMS ...)",
    )
