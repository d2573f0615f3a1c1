"""Every way to name a program finds the same programs in a workspace, whatever the workspace is like."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet
from decided import grade_until_decided
from places import REPORTED
from tiers import LONG, NIGHTLY, each, more

from grader.grading.app.observe import ObserveRequest, observe_programs
from grader.grading.app.programs import find_targets, stage
from grader.grading.app.request import GradeRequest
from grader.grading.submissions.projects import read_projects
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.errors import SubmissionError
from grader.runtime.model.limits import MAX_DEPTH
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.programs.executables import find_executable

NODE = """#!/usr/bin/env python3
import rclpy

TEXT = {text!r}


def main():
    rclpy.init()
    node = rclpy.create_node({name!r})
    node.get_logger().info(TEXT)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
"""
LISTS = "cmake_minimum_required(VERSION 3.8)\nproject({name})\n{lists}\nament_package()\n"
SCRIPTS = "DESTINATION lib/${PROJECT_NAME}"

Files = Mapping[str, str]


def python(name: str, *nodes: str, folder: str = "src") -> Files:
    """Return the files of a package with entry points."""
    scripts = ", ".join(f"'{node} = {name}.{node}:main'" for node in nodes)
    setup = f"from setuptools import setup\nsetup(name='{name}', entry_points={{'console_scripts': [{scripts}]}})\n"
    here = f"{folder}/{name}" if folder else name
    return {
        f"{here}/package.xml": f"<package><name>{name}</name></package>",
        f"{here}/setup.py": setup,
        f"{here}/{name}/__init__.py": "",
        **{f"{here}/{name}/{node}.py": NODE.format(name=node, text=f"{name}/{node}") for node in nodes},
    }


def cmake(name: str, lists: str, programs: Mapping[str, str], folder: str = "src") -> Files:
    """Return the files of a CMake package; `programs` maps the names of its programs to their files."""
    here = f"{folder}/{name}"
    return {
        f"{here}/package.xml": f"<package><name>{name}</name></package>",
        f"{here}/CMakeLists.txt": LISTS.format(name=name, lists=lists),
        **{
            f"{here}/{file}": NODE.format(name=Path(file).stem, text=f"{name}/{program}")
            for program, file in programs.items()
        },
    }


BUILT = {
    "build/COLCON_IGNORE": "",
    "install/COLCON_IGNORE": "",
    "log/COLCON_IGNORE": "",
    **{f"log/build_{n}/{part}/stdout.log": "" for n in range(130) for part in "abc"},
    "install/drive/share/drive/package.xml": "<package><name>drive</name></package>",
}
INTERFACES = {
    "src/words/package.xml": "<package><name>words</name></package>",
    "src/words/CMakeLists.txt": LISTS.format(
        name="words", lists='rosidl_generate_interfaces(${PROJECT_NAME} "msg/Word.msg")'
    ),
    "src/words/msg/Word.msg": "string text\n",
}
CPP = {
    "src/fast/package.xml": "<package><name>fast</name></package>",
    "src/fast/CMakeLists.txt": LISTS.format(name="fast", lists="add_executable(fly src/fly.cpp)"),
    "src/fast/src/fly.cpp": "int main() {}\n",
}
TALK = {"talker.py": "scripts/talker.py"}
#: Each shape of a workspace: its files, and the programs that it has.
SHAPES: dict[str, tuple[Files, tuple[str, ...]]] = {
    "a package": (python("drive", "talker", "listener"), ("drive/talker", "drive/listener")),
    "packages that import each other": (
        {**python("drive", "talker"), **python("other", "hearer")},
        ("drive/talker", "other/hearer"),
    ),
    "packages that were built": ({**python("drive", "talker"), **BUILT}, ("drive/talker",)),
    "packages without src": (
        {**python("drive", "talker", folder=""), **python("other", "hearer", folder="")},
        ("drive/talker", "other/hearer"),
    ),
    "packages in a repository": (python("drive", "talker", folder="src/robot_repository"), ("drive/talker",)),
    "a virtual environment": (
        {
            **python("drive", "talker"),
            "env/pyvenv.cfg": "",
            **python("other", "hearer", folder="env/lib/python3.11/site-packages"),
        },
        ("drive/talker",),
    ),
    "interfaces and C++ beside them": ({**python("drive", "talker"), **INTERFACES, **CPP}, ("drive/talker",)),
    "CMake": (cmake("talk", f"install(PROGRAMS scripts/talker.py {SCRIPTS})", TALK), ("talk/talker.py",)),
    "CMake and entry points": (
        {**python("drive", "talker"), **cmake("talk", f"install(PROGRAMS scripts/talker.py {SCRIPTS})", TALK)},
        ("drive/talker", "talk/talker.py"),
    ),
    "CMake with a pattern": (
        cmake(
            "talk",
            f"file(GLOB S scripts/*.py)\ninstall(PROGRAMS ${{S}} {SCRIPTS})",
            {**TALK, "other.py": "scripts/other.py"},
        ),
        ("talk/other.py", "talk/talker.py"),
    ),
    "CMake with another name": (
        cmake("talk", f"install(PROGRAMS scripts/t.py {SCRIPTS} RENAME talker)", {"talker": "scripts/t.py"}),
        ("talk/talker",),
    ),
    "CMake with a folder": (
        cmake("talk", f"install(DIRECTORY scripts/ {SCRIPTS} USE_SOURCE_PERMISSIONS)", TALK),
        ("talk/talker.py",),
    ),
    "CMake with a Python package": (
        {
            **cmake(
                "talk",
                f"ament_python_install_package(${{PROJECT_NAME}})\ninstall(PROGRAMS talk/talker.py {SCRIPTS})",
                {"talker.py": "talk/talker.py"},
            ),
            "src/talk/talk/__init__.py": "",
        },
        ("talk/talker.py",),
    ),
    "CMake with console scripts": (
        {
            **cmake(
                "talk",
                "ament_python_install_package(${PROJECT_NAME} SCRIPTS_DESTINATION lib/${PROJECT_NAME})",
                {"say": "talk/say.py"},
            ),
            "src/talk/talk/__init__.py": "",
            "src/talk/talk/setup.cfg": "[options.entry_points]\nconsole_scripts =\n    say = talk.say:main\n",
        },
        ("talk/say",),
    ),
    "scripts of setup.py": (
        {
            **python("drive", folder="src"),
            "src/drive/setup.py": "from setuptools import setup\nsetup(name='drive', scripts=['scripts/talker.py'])\n",
            "src/drive/scripts/talker.py": NODE.format(name="talker", text="drive/talker.py"),
        },
        ("drive/talker.py",),
    ),
    "programs of one name": (
        {**python("drive", "talker"), **python("other", "talker")},
        ("drive/talker", "other/talker"),
    ),
}


def write(files: Files, folder: Path) -> Path:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def link(workspace: Path) -> None:
    """Make the links that `colcon build --symlink-install` leaves."""
    package = workspace / "src" / "drive"
    if (workspace / "build").is_dir():
        built = workspace / "build" / "drive"
        built.mkdir()
        for name in ("setup.py", "package.xml", "drive"):
            (built / name).symlink_to(package / name)


Found = dict[str, str]  # program -> the text of its file


def text_of(path: Path) -> str:
    return next(line for line in path.read_text().splitlines() if line.startswith("TEXT"))


def by_folder(workspace: Path, into: Path, programs: tuple[str, ...]) -> Found:
    """`grade observe WORKSPACE`."""
    del programs
    return observed((workspace,), into)


def observed(paths: tuple[Path, ...], into: Path) -> Found:
    into.mkdir()
    submission = stage(find_targets(paths).targets, into)
    found = {name: file.found for name, file in submission.files.items()}
    return {name: text_of(submission.root / path) for name, path in found.items() if path}


def by_package(workspace: Path, into: Path, programs: tuple[str, ...]) -> Found:
    """`grade observe WORKSPACE/PACKAGE/NAME`."""
    return observed(tuple(workspace / program for program in programs), into)


def by_any_package(workspace: Path, into: Path, programs: tuple[str, ...]) -> Found:
    """`grade observe 'WORKSPACE/*/NAME'`; of several programs of one name, the first."""
    names = dict.fromkeys(program.partition("/")[2] for program in programs)
    return observed(tuple(workspace / "*" / name for name in names), into)


def by_name(workspace: Path, into: Path, programs: tuple[str, ...]) -> Found:
    """`grade observe WORKSPACE/NAME`; not where several packages have the name."""
    names = [program.partition("/")[2] for program in programs]
    return observed(tuple(workspace / name for name in names), into)


def by_package_folder(workspace: Path, into: Path, programs: tuple[str, ...]) -> Found:
    """`grade observe PACKAGE_FOLDER` for each package."""
    made = {"build", "install"}
    found = [sorted(workspace.rglob(f"{name}/package.xml")) for name in packages(programs)]
    own = [[path.parent for path in paths if not made.intersection(path.parts)] for paths in found]
    return observed(tuple(folders[0] for folders in own if folders), into)


def packages(programs: tuple[str, ...]) -> list[str]:
    return list(dict.fromkeys(program.partition("/")[0] for program in programs))


def by_rubric(workspace: Path, into: Path, programs: tuple[str, ...]) -> Found:
    """`PACKAGE/NAME` in a rubric."""
    into.mkdir()
    submission = stage_submission(str(workspace), programs, into)
    found = {name: file.found for name, file in submission.files.items()}
    return {name: text_of(into / path) for name, path in found.items() if path}


def by_rubric_for_any(workspace: Path, into: Path, programs: tuple[str, ...]) -> Found:
    """`*/NAME` in a rubric; of several programs of one name, the first."""
    into.mkdir()
    names = list(dict.fromkeys(f"*/{program.partition('/')[2]}" for program in programs))
    submission = stage_submission(str(workspace), names, into)
    return {name: text_of(into / file.found) for name, file in submission.files.items() if file.found}


def by_launch_file(workspace: Path, into: Path, programs: tuple[str, ...]) -> Found:
    """`Node(package=..., executable=...)`."""
    into.mkdir()
    submission = stage_submission(str(workspace), ["talker.py"], into)
    found = {}
    for program in programs:
        package, _, name = program.partition("/")
        one = find_executable(into, submission.projects, package, name)
        if one is not None and one.file is not None:
            found[program] = text_of(into / one.file)
    return found


FORMS: dict[str, Callable[[Path, Path, tuple[str, ...]], Found]] = {
    form.__name__: form
    for form in (
        by_folder,
        by_package,
        by_any_package,
        by_name,
        by_package_folder,
        by_rubric,
        by_rubric_for_any,
        by_launch_file,
    )
}


def form_and_shape() -> Iterator[ParameterSet]:
    """Yield every pair: each form and each workspace in at least one that is long, and two by default."""
    for across, form in enumerate(FORMS):
        for down, shape in enumerate(SHAPES):
            kept = () if down % len(FORMS) == 1 else LONG
            yield pytest.param(form, shape, marks=NIGHTLY if (across - down) % len(FORMS) else kept)


@pytest.mark.slow
@pytest.mark.parametrize(("form", "shape"), list(form_and_shape()))
def test_every_form_finds_the_same_programs(tmp_path: Path, form: str, shape: str) -> None:
    """The programs of a workspace do not depend on how one asks for them."""
    files, programs = SHAPES[shape]
    workspace = write(files, tmp_path / "ws")
    link(workspace)
    several = shape == "programs of one name"
    if several and form == "by_name":
        with pytest.raises(SubmissionError, match="several: drive/talker or other/talker"):
            FORMS[form](workspace, tmp_path / "staged", programs)
        return
    found = FORMS[form](workspace, tmp_path / "staged", programs)
    expected = programs[:1] if several and "any" in form else programs
    assert sorted(found.values()) == sorted(f"TEXT = {program!r}" for program in expected)
    if "rubric_for_any" not in form:
        assert {name: f"TEXT = {name!r}" for name in found} == found


@pytest.mark.slow
@pytest.mark.parametrize("shape", each(SHAPES, 8))
def test_files_that_are_named_together_are_the_ones_that_run(tmp_path: Path, shape: str) -> None:
    """Each with the packages beside it, also where several have one name."""
    files, programs = SHAPES[shape]
    workspace = write(files, tmp_path / "ws")
    named = [workspace / name for name, text in files.items() if "TEXT" in text and "env/" not in name]
    found = observed(tuple(named), tmp_path / "staged")
    assert sorted(found.values()) == sorted(f"TEXT = {program!r}" for program in programs)
    assert len(found) == len(named)


def test_files_of_different_places_run_together(tmp_path: Path) -> None:
    """Where their common folder holds too much, each is staged with its own package."""
    write({f"{'deep/' * (MAX_DEPTH + 1)}notes.txt": ""}, tmp_path / "all")
    one = write(python("drive", "talker"), tmp_path / "all" / "one") / "src/drive/drive/talker.py"
    two = write({"talker.py": NODE.format(name="t", text="loose")}, tmp_path / "all" / "two") / "talker.py"
    found = observed((one, two), tmp_path / "staged")
    assert found == {"drive/talker.py": "TEXT = 'drive/talker'", "two/talker.py": "TEXT = 'loose'"}
    assert sorted(path.name for path in (tmp_path / "staged" / "alone").iterdir()) == ["1_drive", "2_two"]


def test_a_program_is_named_once(tmp_path: Path) -> None:
    """Twice the same is a slip."""
    workspace = write(python("drive", "talker"), tmp_path)
    file = workspace / "src/drive/drive/talker.py"
    for paths in ((file, file), (workspace / "talker", workspace / "drive" / "talker")):
        with pytest.raises(SubmissionError, match="expected each program once, found it twice"):
            find_targets(paths)


def test_too_many_programs_are_refused_with_their_number(tmp_path: Path) -> None:
    """Before anything is started."""
    write({f"{n}.py": "" for n in range(41)}, tmp_path)
    with pytest.raises(SubmissionError, match="expected at most 40 programs, found 41"):
        find_targets(tuple(tmp_path / f"{n}.py" for n in range(41)))


@pytest.mark.parametrize(
    ("files", "hint"),
    [
        (python("drive"), "name the files of the nodes to run, or add console_scripts to setup.py"),
        (
            cmake("talk", "", {}),
            "name the files of the nodes to run, or add install(PROGRAMS ... DESTINATION lib/${PROJECT_NAME}) to "
            "CMakeLists.txt",
        ),
        ({"src/notes.txt": ""}, "name the files of the nodes to run"),
        (
            cmake("talk", f"install(FILES scripts/talker.py {SCRIPTS})", TALK),
            "install scripts/talker.py with PROGRAMS, so that it can be run",
        ),
    ],
)
def test_a_workspace_without_programs_is_told_how_to_have_some(tmp_path: Path, files: Files, hint: str) -> None:
    """By how its packages are built."""
    with pytest.raises(SubmissionError) as raised:
        find_targets((write(files, tmp_path),))
    assert raised.value.message.endswith("expected a package or workspace with executables, found none")
    assert raised.value.hint == hint


@pytest.mark.parametrize(
    ("lists", "hint"),
    [
        ("", "add install(PROGRAMS scripts/talker.py DESTINATION lib/${PROJECT_NAME}) to CMakeLists.txt"),
        (f"install(FILES scripts/hear.py {SCRIPTS})", "add install(PROGRAMS scripts/talker.py DESTINATION"),
        (f"install(PROGRAMS scripts/gone.py {SCRIPTS} RENAME talker.py)", "add install(PROGRAMS scripts/talker.py"),
    ],
)
def test_a_program_that_cmake_does_not_install_is_missing(tmp_path: Path, lists: str, hint: str) -> None:
    """The report says what to add to CMakeLists.txt, and nothing of setup.py."""
    workspace = write(cmake("talk", lists, TALK), tmp_path / "ws")
    (tmp_path / "own.yaml").write_text(RUBRIC.format(process="talk/talker.py"))
    request = GradeRequest(str(workspace), rubrics=(tmp_path / "own.yaml",), clock="virtual")
    (verdict,) = grade_until_decided(request).exercises[0].verdicts
    assert verdict.outcome.value == "not_met"
    assert verdict.hint.startswith(hint)


def test_what_is_not_run_is_said(tmp_path: Path) -> None:
    """A program in C++, and an entry point without its file."""
    files = {**python("drive", "talker", "gone"), **CPP}
    workspace = write({name: text for name, text in files.items() if "gone.py" not in name}, tmp_path)
    found = find_targets((workspace,))
    assert [target.name for target in found.targets] == ["drive/talker"]
    assert found.notes == (
        "the entry point drive/gone is drive.gone:main, which is not in the submission",
        "not run, because it is not a Python program: fast/fly",
    )


RUBRIC = """
schema: grader/rubric/v1
exercise: {{id: cmake, number: S1, title: Programs of CMake packages}}
files: ["{process}"]
scenarios:
  - id: alone
    processes: ["{process}"]
    observe: {{duration: 2 s}}
criteria:
  - id: says
    title: Says which it is
    points: 1
    scenario: alone
    check: {{logs_matching: {{process: "{process}", pattern: "talk/talker.py"}}}}
"""
LAUNCH = """
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription([Node(package="talk", executable="talker.py")])
"""


@pytest.mark.breadth(1, 1)
@pytest.mark.ros
@pytest.mark.parametrize("process", each(["*/talker.py", "talk/talker.py", "talk.launch.py", "talker.py"], 4))
def test_programs_of_cmake_packages_are_graded(tmp_path: Path, process: str) -> None:
    """By every name that a rubric may give them."""
    files = {**SHAPES["CMake with a Python package"][0], "src/talk/launch/talk.launch.py": LAUNCH}
    workspace = write(files, tmp_path / "ws")
    (tmp_path / "own.yaml").write_text(RUBRIC.format(process=process))
    request = GradeRequest(str(workspace), rubrics=(tmp_path / "own.yaml",), clock="virtual")
    (verdict,) = grade_until_decided(request).exercises[0].verdicts
    assert (verdict.outcome.value, verdict.reason) == ("met", verdict.reason)


@pytest.mark.ros
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
@pytest.mark.parametrize(
    "shape", each(["CMake with a Python package", "CMake and entry points", "CMake with console scripts"], 3)
)
def test_programs_of_cmake_packages_run(tmp_path: Path, shape: str, clock: str) -> None:
    """As `ros2 run` starts them: a program that is installed as it is, as a script."""
    files, programs = SHAPES[shape]
    tmp_path.chmod(0o755)
    summary = observe_programs(ObserveRequest((write(files, tmp_path / "ws"),), NS_PER_S, clock=clock), lambda _: None)
    assert sorted(record.text for record in summary.records) == sorted(programs)
    assert summary.faults == ()


@pytest.mark.nightly
@pytest.mark.ros
def test_more_programs_than_a_scenario_has_by_default_are_all_heard(tmp_path: Path) -> None:
    """A limit for stray participants does not count the programs themselves."""
    files = {f"n{n}.py": NODE.format(name=f"n{n}", text=f"n{n}") for n in range(18)}
    write(files, tmp_path)
    summary = observe_programs(
        ObserveRequest(tuple(tmp_path / n for n in files), NS_PER_S, clock="virtual"), lambda _: None
    )
    assert sorted(record.text for record in summary.records) == sorted(f"n{n}" for n in range(18))
    assert summary.notes == ()


CASES = {
    "cmake_ws": ("talk/talker.py",),
    "sibling_ws": ("words_py/talker",),
    "packages_without_src": ("words_py/talker",),
    "same_names": ("rooms/kitchen", "rooms/hall"),
}


@pytest.mark.parametrize("case", CASES)
def test_workspaces_of_others(tmp_path: Path, case: str) -> None:
    """All programs are found, and the same from a copy without links."""
    found = find_targets((REPORTED / case,))
    assert tuple(target.name for target in found.targets) == CASES[case]
    copy = tmp_path / "copy"
    shutil.copytree(REPORTED / case, copy)
    projects, _ = read_projects(copy)
    for program in CASES[case]:
        package, _, name = program.partition("/")
        assert find_executable(copy, projects, package, name) is not None
