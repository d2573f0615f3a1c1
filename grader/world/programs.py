"""Finds the programs and launch files that a test names, where they lie, and reads the parameters that it gives."""

from __future__ import annotations

import inspect
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from grader.grading.model.wording import first_few, nearest
from grader.grading.submissions.submission import read_projects
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import SubmissionError
from grader.runtime.model.projects import Project
from grader.runtime.model.scenario import LAUNCH_ENDINGS, is_launch_file
from grader.runtime.model.wording import listed
from grader.runtime.programs.executables import (
    IGNORED,
    Executable,
    executables,
    find_executables,
    ignored_packages,
    package_of,
    packages_near,
    project_folders,
    workspace_of,
)

#: What `ros.run` gives a program: values of parameters by name, or the path of a parameter file.
Parameters = Mapping[str, Any] | str | os.PathLike[str]
#: What `ros.run` starts: a path, `PACKAGE/EXECUTABLE`, or the function to call, such as a module's `main`.
Runnable = str | os.PathLike[str] | Callable[..., Any]


@dataclass(frozen=True, slots=True)
class Found:
    """A program to run where it lies."""

    name: str  # what it is called in messages
    root: Path  # the folder of its workspace or package, or its own folder
    file: str  # relative to `root`
    executable: str = ""  # the entry point to run; empty for the one that suits the file
    projects: tuple[Project, ...] = ()


def find_program(wanted: Runnable, near: Sequence[Path]) -> Found:
    """Find a program; raises SubmissionError if there is none.

    Args:
        wanted: What to run.
        near: Folders in which a relative path is looked for, and in whose workspace a package is, in this order.
    """
    if callable(wanted):
        return _of_function(wanted)
    text = os.fspath(wanted)
    for folder in near:
        path = (folder / text).resolve()
        if path.is_file():
            return _of_file(path)
    package, slash, name = text.partition("/")
    if slash and "/" not in name and not name.endswith(".py"):
        return _of_package(package, name, near)
    beside = [path.name for folder in near for path in sorted(folder.glob("*.py"))]
    close = nearest(Path(text).name, beside)
    hint = f"did you mean {close}?" if close else f"looked in {', '.join(map(str, near))}"
    raise SubmissionError(f"{text}: expected a file, found none", hint)


def _of_file(path: Path) -> Found:
    root, projects = _surroundings(path.parent)
    return Found(path.name, root, path.relative_to(root).as_posix(), projects=projects)


def _of_function(function: Callable[..., Any]) -> Found:
    source = inspect.getsourcefile(function)
    name = getattr(function, "__qualname__", "")
    if source is None or not name.isidentifier():
        raise SubmissionError(f"{name or function}: expected a function of a module, found none", "name its file")
    path = Path(source).resolve()
    root, projects = _surroundings(path.parent)
    file = path.relative_to(root).as_posix()
    module = getattr(function, "__module__", path.stem)
    package = next((one for one in projects if file.startswith(f"{one.folder}/") or not one.folder), None)
    known = () if package is None else tuple(script for script in package.scripts if script[1:] == (module, name))
    if package is not None and known:
        return Found(f"{package.name}/{known[0][0]}", root, file, known[0][0], projects)
    if name != "main":
        hint = "name its file, or give the package an entry point that calls it"
        raise SubmissionError(f"{module}.{name}: expected main() of a module, or an entry point", hint)
    return Found(path.name, root, file, projects=projects)


def _of_package(package: str, name: str, near: Sequence[Path]) -> Found:
    known: list[str] = []
    ignored: dict[str, Path] = {}
    for root, projects in _workspaces(near):
        for one in find_executables(root, projects, package, name):
            if one.file is not None:
                return Found(one.words, root, one.file, one.name if one.target else "", projects)
            raise SubmissionError(f"{package}/{name}: {one.problem}", "write the file, or correct the name")
        known += [one.words for one in executables(root, projects)]
        ignored |= ignored_packages(root) if projects else {}
    if package in ignored:
        text = f"{package}/{name}: expected a package that colcon builds, found {IGNORED} in {ignored[package].name}"
        raise SubmissionError(text, "remove that file")
    close = nearest(f"{package}/{name}", known)
    hint = (
        f"did you mean {close}?"
        if close
        else f"there are {first_few(known)}"
        if known
        else "no package is near the test"
    )
    raise SubmissionError(f"{package}/{name}: expected an executable of a package, found none", hint)


def _surroundings(folder: Path) -> tuple[Path, tuple[Project, ...]]:
    """Return the folder of the workspace, the package or the file alone, with the packages in it."""
    package = package_of(folder)
    if not (package / "package.xml").is_file():
        return folder, ()
    root = workspace_of(package)
    return root, _projects(root)


def _below(folder: Path) -> tuple[Path, tuple[Project, ...]]:
    """Return a folder that is in no package, such as that of a workspace, with the packages below it."""
    in_package = (package_of(folder) / "package.xml").is_file()
    is_workspace = not in_package and bool(packages_near(folder) or project_folders(folder / "src"))
    return folder, _projects(folder) if is_workspace else ()


@cache
def _projects(root: Path) -> tuple[Project, ...]:
    return tuple(read_projects(root)[0])


#: How launch files are named.
NAMED_SO = f"its name ends with {listed(LAUNCH_ENDINGS)}"


def find_launch_file(wanted: str | os.PathLike[str], near: Sequence[Path]) -> tuple[Found, tuple[tuple[str, str], ...]]:
    """Find a launch file, and return it with the name of each program that it may start, by the program's file.

    Raises SubmissionError if there is none.
    """
    text = os.fspath(wanted)
    package, slash, name = text.partition("/")
    is_file = any((folder / text).is_file() for folder in near)
    if slash and "/" not in name and not is_file and is_launch_file(name):
        found = _launch_file_of(package, name, near)
    else:
        found = _in_workspace(find_program(wanted, near), near)
    if not is_launch_file(found.name):
        raise SubmissionError(f"{found.name}: expected a launch file", NAMED_SO)
    known = [(f"{one.file} {one.name}" if one.target else one.file, one.words) for one in _runnable(found)]
    loose = () if found.projects else ((path.name, path.name) for path in sorted(found.root.glob("*.py")))
    return found, (*((file, name) for file, name in known if file), *loose)


def _workspaces(near: Sequence[Path]) -> Iterable[tuple[Path, tuple[Project, ...]]]:
    """Return the workspaces around some folders, and those below them, with their packages: each once."""
    return dict.fromkeys((*map(_surroundings, near), *map(_below, near)))


def _launch_file_of(package: str, name: str, near: Sequence[Path]) -> Found:
    """Return the launch file of a package that has a name, in any of its folders, as `ros2 launch` finds it."""
    packages: set[str] = set()
    for root, projects in _workspaces(near):
        packages |= {project.name for project in projects}
        for project in (one for one in projects if one.name == package):
            files = sorted(
                (path for path in (root / project.folder).rglob("*") if is_launch_file(path.name)),
                key=lambda path: (path.parent.name != "launch", path),
            )
            installed = {file for _, group in project.data_files or () for file in group}
            for path in (one for one in files if one.name == name):
                if (
                    project.data_files is not None
                    and path.relative_to(root / project.folder).as_posix() not in installed
                ):
                    text = f"{package}/{name}: expected a file that the package installs, found none in setup.py"
                    raise SubmissionError(text, "add it to data_files, as `ros2 launch` needs it too")
                return Found(name, root, path.relative_to(root).as_posix(), projects=projects)
            close = nearest(name, [path.name for path in files])
            hint = f"did you mean {package}/{close}?" if close else f"it has {first_few([path.name for path in files])}"
            raise SubmissionError(
                f"{package}/{name}: expected a launch file of a package, found none", hint if files else ""
            )
    close = nearest(package, packages)
    hint = f"did you mean {close}/{name}?" if close else f"there are {first_few(sorted(packages))}" if packages else ""
    raise SubmissionError(f"{package}/{name}: expected a package near the test, found none", hint)


def _in_workspace(found: Found, near: Sequence[Path]) -> Found:
    """Return a launch file that lies in no package with the packages of a workspace around it, if there is one."""
    path = (found.root / found.file).resolve()
    if found.projects:
        return found
    for root, projects in (_below(path.parent), *map(_surroundings, near), *map(_below, near)):
        if projects and path.is_relative_to(root):
            return Found(found.name, root, path.relative_to(root).as_posix(), projects=projects)
    return found


def _runnable(found: Found) -> list[Executable]:
    return [one for one in executables(found.root, found.projects) if one.file is not None]


def given_parameters(
    given: Parameters | Sequence[Parameters] | None, near: Sequence[Path]
) -> tuple[dict[str, Any], tuple[tuple[str, str], ...], tuple[str, ...]]:
    """Return what a program is given: values by their names, name and text of parameter files, and all names of values.

    Values that come beside files become a file as well, because rcl lets those on the command line count least.

    Raises SubmissionError if there is no such file.
    """
    several = [given] if isinstance(given, (Mapping, str, os.PathLike)) else [*(given or ())]
    values = {name: value for one in several if isinstance(one, Mapping) for name, value in one.items()}
    if all(isinstance(one, Mapping) for one in several):
        return values, (), tuple(values)
    files: list[tuple[str, str]] = []
    for one in several:
        if isinstance(one, Mapping):
            lines = [f"    {json.dumps(name)}: {value}" for name, value in parameter_values(one)]
            files.append(("parameters.yaml", "\n".join(["/**:", "  ros__parameters:", *lines, ""])))
            continue
        path = next((found for folder in near if (found := folder / one).is_file()), None)
        if path is None:
            where = first_few([str(folder) for folder in near])
            raise SubmissionError(f"{os.fspath(one)}: expected a parameter file, found none", f"looked in {where}")
        files.append((path.name, path.read_text(encoding="utf-8")))
    return {}, tuple(files), tuple(values)


def parameter_values(parameters: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield parameters with their values in YAML, as they are given on the command line."""
    for name, value in parameters.items():
        plain = list(value) if isinstance(value, tuple) else value
        try:
            yield name, json.dumps(plain, allow_nan=False) if not isinstance(plain, float) else _float(plain)
        except (TypeError, ValueError) as error:
            raise TypeError(f"parameter {name}: expected a value of a ROS parameter, found {value!r}") from error


def _float(value: float) -> str:
    """Return a number as YAML reads it as a float: rcl takes `1` for an integer, and `1e-06` for a string."""
    text = repr(value)
    if text in ("inf", "-inf", "nan"):
        return text.replace("inf", ".inf").replace("nan", ".nan")
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa if '.' in mantissa else f'{mantissa}.0'}{e}{exponent}"
