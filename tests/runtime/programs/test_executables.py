"""Which file of a submission an executable stands for, and what is told where there is none."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from places import TESTS

from grader.grading.submissions.projects import read_projects
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.submission import StudentFile
from grader.runtime.programs.executables import (
    find_executable,
    ignored_packages,
    needed_packages,
    package_name,
    workspace_of,
)

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


def a_package(folder: Path, name: str, text: str = "") -> Path:
    (folder / name).mkdir(parents=True)
    (folder / name / "package.xml").write_text(f"<package><name>{name}</name></package>")
    (folder / name / "node.py").write_text(text)
    return folder / name


#: Where a package lies, where the one lies that it imports, and its workspace, relative to a folder.
LAYOUTS = [
    ("ws/src", "ws/src", "ws/src"),
    ("ws/src/repository/packages", "ws/src/repository/packages", "ws/src"),
    ("ws/src/a/b/c", "ws/src/other/d", "ws/src"),
    ("course/PYTHON", "course/CPP", "course"),
    ("course", "course", "course"),
    ("cloned/x/y/z", "cloned/w", "cloned"),
]


@pytest.mark.parametrize("crowded", [False, True])
@pytest.mark.parametrize(("own", "other", "workspace"), LAYOUTS)
def test_a_workspace_has_the_packages_that_one_names(
    tmp_path: Path, own: str, other: str, workspace: str, crowded: bool
) -> None:
    """However deep they lie, and whatever else lies beside it."""
    package = a_package(tmp_path / own, "talk_py", "from talk_interfaces.msg import Say\n")
    needed = a_package(tmp_path / other, "talk_interfaces")
    (tmp_path / "cloned" / ".git").mkdir(parents=True)
    if crowded:
        a_package(tmp_path / own, "beside")
    assert workspace_of(package) == tmp_path / workspace
    assert needed_packages(package, tmp_path / workspace) == sorted([package, needed])


def test_a_package_that_names_no_other_has_those_beside_it(tmp_path: Path) -> None:
    """A launch file may start their programs; what lies further away has nothing to do with it."""
    package = a_package(tmp_path / "course" / "PYTHON", "talk_py")
    a_package(tmp_path / "course" / "CPP", "talk_interfaces")
    assert workspace_of(package) == package
    a_package(tmp_path / "course" / "PYTHON", "beside")
    assert workspace_of(package) == tmp_path / "course" / "PYTHON"


def test_a_folder_that_vanishes_meanwhile_holds_no_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Such as those of earlier runs of pytest, which a later one tidies up while a package beside them is looked at."""
    package = a_package(tmp_path / "course" / "PYTHON", "talk_py")
    a_package(tmp_path / "course" / "PYTHON", "beside")
    (tmp_path / "course" / "vanishing").mkdir()
    real = os.scandir

    def scan(folder: str | Path) -> object:
        if str(folder).endswith("vanishing"):
            raise FileNotFoundError(folder)
        return real(folder)

    monkeypatch.setattr(os, "scandir", scan)
    assert workspace_of(package) == tmp_path / "course" / "PYTHON"


def test_what_needed_packages_need_is_needed(tmp_path: Path) -> None:
    """Whichever of their files names it."""
    one = a_package(tmp_path, "one", "import two")
    two = a_package(tmp_path, "two", "")
    (two / "package.xml").write_text("<package><name>two</name><depend>three</depend></package>")
    three = a_package(tmp_path, "three")
    a_package(tmp_path, "four", "import one")
    assert needed_packages(one, tmp_path) == sorted([one, three, two])


def test_packages_that_colcon_ignores_are_named(tmp_path: Path) -> None:
    """Those with COLCON_IGNORE in their own folder, or in one above."""
    a_package(tmp_path, "one")
    (a_package(tmp_path, "two") / "COLCON_IGNORE").touch()
    three = a_package(tmp_path / "group", "three")
    (tmp_path / "group" / "COLCON_IGNORE").touch()
    assert ignored_packages(tmp_path) == {"two": tmp_path / "two", "three": three.parent}


def test_a_pipe_in_a_neighbouring_folder_is_not_waited_for(tmp_path: Path) -> None:
    """A package that one names is looked for beside others, which may hold anything."""
    (tmp_path / "piped").mkdir()
    os.mkfifo(tmp_path / "piped" / "package.xml")
    assert package_name(tmp_path / "piped") == "piped"
