"""Which programs a CMakeLists.txt installs for `ros2 run`, however it is written down."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from grader.grading.submissions.cmake_files import Contents, contents_of
from grader.grading.submissions.projects import read_projects
from grader.grading.submissions.setup_files import LimitError
from grader.runtime.model.projects import Project
from grader.runtime.programs.executables import executables, find_executable

NAMES = ("CMakeLists.txt", "package.xml", "scripts/a.py", "scripts/b.py", "scripts/notes.txt", "talk/__init__.py")
HEAD = "cmake_minimum_required(VERSION 3.8)\nproject(talk)\n"
DEST = "DESTINATION lib/${PROJECT_NAME}"
A, B = ("a.py", "scripts/a.py"), ("b.py", "scripts/b.py")
INSTALLS: dict[str, tuple[str, Sequence[tuple[str, str]]]] = {
    "one": (f"install(PROGRAMS scripts/a.py {DEST})", [A]),
    "several, on lines": (f"INSTALL(\n  PROGRAMS\n  scripts/a.py # first\n  scripts/b.py\n  {DEST}\n)", [A, B]),
    "quoted": ('install(PROGRAMS "scripts/a.py" DESTINATION "lib/${PROJECT_NAME}/")', [A]),
    "the name itself": ("install(PROGRAMS scripts/a.py DESTINATION lib/talk)", [A]),
    "absolute": (
        "install(PROGRAMS ${CMAKE_CURRENT_SOURCE_DIR}/scripts/a.py "
        + DEST.replace("lib", "${CMAKE_INSTALL_PREFIX}/lib")
        + ")",
        [A],
    ),
    "renamed": (f"install(PROGRAMS scripts/a.py {DEST} RENAME a)", [("a", "scripts/a.py")]),
    "a list": (
        f"set(S scripts/a.py\n  scripts/b.py)\ninstall(PROGRAMS ${{S}} {DEST})",
        [A, B],
    ),
    "an appended list": (
        f"list(APPEND S scripts/a.py)\nlist(APPEND S scripts/b.py)\ninstall(PROGRAMS ${{S}} {DEST})",
        [A, B],
    ),
    "a variable for the folder": (
        "set(DIR scripts)\nset(TO lib/${PROJECT_NAME})\ninstall(PROGRAMS ${DIR}/a.py DESTINATION ${TO})",
        [A],
    ),
    "a pattern": (f"file(GLOB S scripts/*.py)\ninstall(PROGRAMS ${{S}} {DEST})", [A, B]),
    "a condition": (f"if(NOT WIN32)\n  install(PROGRAMS scripts/a.py {DEST})\nelse()\nendif()", [A]),
    "files with permissions": (
        f"install(FILES scripts/a.py {DEST} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)",
        [A],
    ),
    "a folder with permissions": (
        f"install(DIRECTORY scripts/ {DEST} FILE_PERMISSIONS OWNER_READ WORLD_EXECUTE)",
        [A, B, ("notes.txt", "scripts/notes.txt")],
    ),
    "a comment in brackets": (
        f"#[[ install(PROGRAMS scripts/b.py {DEST}) ]]\ninstall(PROGRAMS scripts/a.py {DEST})",
        [A],
    ),
    "elsewhere": (
        "install(PROGRAMS scripts/a.py DESTINATION bin)\ninstall(PROGRAMS scripts/b.py DESTINATION share/x)",
        [],
    ),
    "of another package": ("install(PROGRAMS scripts/a.py DESTINATION lib/talk_other)", []),
    "outside": (f"install(PROGRAMS ../a.py /etc/passwd {DEST})", []),
}


def read(text: str) -> Contents:
    return contents_of(HEAD + text + "\nament_package()\n", "talk", NAMES)


@pytest.mark.parametrize(("text", "expected"), INSTALLS.values(), ids=INSTALLS)
def test_programs_that_cmake_installs_are_found(text: str, expected: Sequence[tuple[str, str]]) -> None:
    """By their names below lib/PACKAGE."""
    found = read(text)
    assert [(one.name, one.file) for one in found.installed if one.runs == "yes"] == list(expected)


@pytest.mark.parametrize(
    ("text", "runs"),
    [
        (f"install(FILES scripts/a.py {DEST})", "no"),
        (f"install(PROGRAMS scripts/a.py {DEST} PERMISSIONS OWNER_READ)", "no"),
        (f"install(DIRECTORY scripts/ {DEST} OPTIONAL)", "no"),
        (f"install(DIRECTORY scripts/ {DEST} USE_SOURCE_PERMISSIONS)", "source"),
    ],
)
def test_what_ros_cannot_run_is_told_apart(text: str, runs: str) -> None:
    """Only what is executable is a program."""
    assert [one.runs for one in read(text).installed if one.name == "a.py"] == [runs]


@pytest.mark.parametrize(
    "text",
    [
        "add_subdirectory(nodes)",
        "include(cmake/nodes.cmake)",
        f"install(PROGRAMS $<TARGET_FILE:x> {DEST})",
        f"install(PROGRAMS ${{CMAKE_CURRENT_BINARY_DIR}}/a.py {DEST})",
        f"string(TOUPPER scripts S)\ninstall(PROGRAMS ${{S}}/a.py {DEST})",
        "install(PROGRAMS scripts/a.py DESTINATION $ENV{HOME})",
        "install(CODE [[ message(x) ]])",
        f"set(S scripts/a.py)\nlist(REMOVE_ITEM S scripts/b.py)\ninstall(PROGRAMS ${{S}} {DEST})",
        f"set(S scripts/a.py)\nfile(GLOB_RECURSE S *.py)\ninstall(PROGRAMS ${{S}} {DEST})",
        f"file(GLOB S RELATIVE ${{CMAKE_CURRENT_SOURCE_DIR}} scripts/*.py)\ninstall(PROGRAMS ${{S}} {DEST})",
        f"foreach(s a b)\n  install(PROGRAMS scripts/${{s}}.py {DEST} RENAME ${{s}})\nendforeach()",
        f"foreach(s a b)\n  list(APPEND S scripts/${{s}}.py)\nendforeach()\ninstall(PROGRAMS ${{S}} {DEST})",
        f"macro(add)\n  install(PROGRAMS ${{ARGN}} {DEST})\nendmacro()\nadd(scripts/a.py scripts/b.py)",
        f'install(DIRECTORY scripts {DEST} FILES_MATCHING PATTERN "a.*" PERMISSIONS OWNER_EXECUTE OWNER_READ)',
        f"get_filename_component(S scripts/a.py NAME)\ninstall(PROGRAMS scripts/${{S}} {DEST})",
    ],
)
def test_what_only_cmake_knows_is_admitted(text: str) -> None:
    """There may be more programs than were found."""
    assert read(text).unread


def test_ordinary_files_are_read_whole() -> None:
    """As `ros2 pkg create` and the tutorials write them; programs in C++ are told apart."""
    text = """
find_package(ament_cmake REQUIRED)
include(GNUInstallDirs)
add_library(inside SHARED src/inside.cpp)
add_executable(listener src/listener.cpp)
rclcpp_components_register_node(inside PLUGIN "a::B" EXECUTABLE inside_node)
target_compile_options(listener PRIVATE -Wall "-Wextra")
install(TARGETS listener DESTINATION lib/${PROJECT_NAME})
install(DIRECTORY launch config DESTINATION share/${PROJECT_NAME}/)
ament_python_install_package(${PROJECT_NAME})
if(BUILD_TESTING)
  find_package(ament_lint_auto REQUIRED)
endif()
"""
    found = read(text)
    assert (found.built, found.installed, found.unread) == (["listener", "inside_node"], [], False)
    assert found.imported == [""]


@pytest.mark.parametrize("text", ["install(PROGRAMS", "install PROGRAMS)", 'set(A "x)', ")", "foreach(a b)\nset(C d)"])
def test_what_is_not_cmake_is_an_error(text: str) -> None:
    """CMake would refuse it too."""
    with pytest.raises(ValueError, match=r"not CMake|found the end"):
        contents_of(text, "talk", NAMES)


@pytest.mark.parametrize(
    "text",
    [
        "set(A x;x;x;x;x;x;x;x)\n" + "".join(f"set(A{n} ${{A}}{n})\nset(A ${{A}};${{A}})\n" for n in range(40)),
        "file(GLOB S scripts/*)\n" + f"install(PROGRAMS ${{S}} {DEST})\n" * 3_000,
    ],
    ids=["values", "files"],
)
def test_what_never_ends_is_cut_off(text: str) -> None:
    """A hostile file costs a bounded amount of work."""
    with pytest.raises(LimitError):
        contents_of(text, "talk", NAMES)


def package(folder: Path, lists: str, **files: str) -> Path:
    """Write a CMake package named talk."""
    for name, text in {"package.xml": "<name>talk</name>", "CMakeLists.txt": HEAD + lists, **files}.items():
        path = folder / name.replace("__init__", "\0").replace("__", "/").replace("\0", "__init__")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def the_project(root: Path) -> Project:
    (project,), notes = read_projects(root)
    assert notes == ()
    return project


def test_programs_of_packages_are_python(tmp_path: Path) -> None:
    """By suffix or first line; with the permissions of the source, only the first line tells."""
    files = {
        "scripts__a.py": "print()\n",
        "scripts__b": "#!/usr/bin/env python3\nprint()\n",
        "scripts__c.sh": "#!/bin/sh\n",
        "more__d.py": "#!/usr/bin/env python3\n",
        "more__helper.py": "X = 1\n",
    }
    lists = f"install(PROGRAMS scripts/a.py scripts/b scripts/c.sh scripts/gone.py {DEST})\n"
    lists += f"install(DIRECTORY more/ {DEST} USE_SOURCE_PERMISSIONS)\n"
    project = the_project(package(tmp_path, lists, **files))
    assert project.programs == (
        ("a.py", "scripts/a.py"),
        ("b", "scripts/b"),
        ("gone.py", "scripts/gone.py"),
        ("d.py", "more/d.py"),
    )
    assert project.unrunnable == (("helper.py", "more/helper.py"),)
    assert project.foreign == ("c.sh",)
    found = {one.name: one.file for one in executables(tmp_path, [project])}
    assert found == {"a.py": "scripts/a.py", "b": "scripts/b", "gone.py": None, "d.py": "more/d.py"}


def test_a_file_that_is_not_installed_is_no_program(tmp_path: Path) -> None:
    """`ros2 run` would not find it either, unless its package may install it in a way that was not read."""
    files = {"scripts__a.py": "", "scripts__b.py": ""}
    root = package(tmp_path / "known", f"install(PROGRAMS scripts/a.py {DEST})", **files)
    assert find_executable(root, [the_project(root)], "talk", "b.py") is None
    root = package(tmp_path / "unknown", f"install(PROGRAMS scripts/a.py {DEST})\nadd_subdirectory(x)", **files)
    found = find_executable(root, [the_project(root)], "talk", "b.py")
    assert found is not None
    assert found.file == "scripts/b.py"


def test_console_scripts_of_a_python_package_in_a_cmake_package(tmp_path: Path) -> None:
    """`ament_python_install_package` with SCRIPTS_DESTINATION installs those of its setup.cfg."""
    lists = "ament_python_install_package(${PROJECT_NAME} PACKAGE_DIR src/talk SCRIPTS_DESTINATION lib/${PROJECT_NAME})"
    cfg = "[options.entry_points]\nconsole_scripts =\n    say = talk.say:main\n"
    files = {"src__talk__setup.cfg": cfg, "src__talk__say.py": "", "src__talk____init__.py": ""}
    project = the_project(package(tmp_path, lists, **files))
    assert (project.scripts, project.imported) == ((("say", "talk.say", "main"),), ("src",))
    assert [(one.name, one.file) for one in executables(tmp_path, [project])] == [("say", "src/talk/say.py")]


def test_programs_of_setup_py_that_are_no_entry_points(tmp_path: Path) -> None:
    """`scripts`, and files that data_files puts below lib/PACKAGE."""
    text = (
        "from setuptools import setup\nsetup(name='talk', scripts=['scripts/a.py'],\n"
        "      data_files=[('lib/talk', ['scripts/b.py', 'scripts/c.py']), ('share/talk', ['package.xml'])])\n"
    )
    for name, content in {"a": "", "b": "#!/usr/bin/env python3\n", "c": ""}.items():
        (tmp_path / "scripts").mkdir(exist_ok=True)
        (tmp_path / "scripts" / f"{name}.py").write_text(content)
    (tmp_path / "package.xml").write_text("<name>talk</name>")
    (tmp_path / "setup.py").write_text(text)
    project = the_project(tmp_path)
    assert project.programs == (("a.py", "scripts/a.py"), ("b.py", "scripts/b.py"))
    assert project.unrunnable == (("c.py", "scripts/c.py"),)
