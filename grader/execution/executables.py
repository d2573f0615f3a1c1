"""Finds the programs that the packages of a submission install, by their names as `ros2 run` takes them."""

from __future__ import annotations

import os
from pathlib import Path

from grader.core.dataclass import dataclass
from grader.student_host.packages import console_scripts, package_folders, package_name

#: The most files of a package that are searched for a module or a program.
MOST_FILES = 2_000


@dataclass(frozen=True, slots=True)
class Executable:
    """A program of a package."""

    package: str  # name of the ROS package
    name: str  # name of the executable
    file: str | None  # the file that it runs, relative to the submission; None if it is not there
    target: str = ""  # the entry point, as `MODULE:FUNCTION`; empty for a file that is installed as it is

    @property
    def words(self) -> str:
        """Package and name, as in `ros2 run PACKAGE NAME`."""
        return f"{self.package}/{self.name}"


def executables(root: Path) -> list[Executable]:
    """Return the entry points of all packages of a submission, in the order of its folders."""
    found = []
    for folder in package_folders(str(root)):
        package = package_name(folder)
        for name, module, function in console_scripts(folder):
            path = _file_of(Path(folder), f"{module.replace('.', '/')}.py")
            file = None if path is None else path.relative_to(root).as_posix()
            found.append(Executable(package, name, file, f"{module}:{function}"))
    return found


def find_executable(root: Path, package: str, name: str) -> Executable | None:
    """Return the program that `ros2 run PACKAGE NAME` would start; None if there is none.

    Where there is no entry point of the name, a file of the name in the package is taken, as CMake packages install
    them; where the submission has no such package, a file NAME or NAME.py anywhere in it.
    """
    named = [one for one in executables(root) if (one.package, one.name) == (package, name)]
    if named:
        return named[0]
    folders = [Path(f) for f in package_folders(str(root)) if package_name(f) == package]
    wanted = (name,) if folders else (name, f"{name}.py")
    for folder in folders or [root]:
        found = next((path for one in wanted if (path := _file_of(folder, one)) is not None), None)
        if found is not None and found.suffix == ".py":
            return Executable(package, name, found.relative_to(root).as_posix())
    return None


def has_package(root: Path, name: str) -> bool:
    """Return whether a submission has a ROS package."""
    return any(package_name(folder) == name for folder in package_folders(str(root)))


def _file_of(folder: Path, tail: str) -> Path | None:
    """Return the file nearest the top of a folder whose path ends like this."""
    if (folder / tail).is_file():
        return folder / tail
    if tail.startswith("/") or ".." in tail.split("/"):
        return None
    seen = 0
    for above, folders, names in os.walk(folder):
        folders.sort()
        seen += len(names)
        if seen > MOST_FILES:
            return None
        if (Path(above) / tail).is_file():
            return Path(above) / tail
    return None
