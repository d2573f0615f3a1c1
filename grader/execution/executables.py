"""Finds the programs that the packages of a submission install, by their names as `ros2 run` takes them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from grader.core.dataclass import dataclass
from grader.core.projects import Project
from grader.student_host.packages import package_folders

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


def project_folders(root: Path) -> list[Path]:
    """Return the folders of all ROS packages in a submission, outermost first."""
    return [Path(folder) for folder in package_folders(str(root))]


def executables(root: Path, projects: Sequence[Project]) -> list[Executable]:
    """Return the entry points of all packages of a submission, in the order of its folders."""
    found, files = [], _Files(root)
    for project in projects:
        for name, module, function in project.scripts:
            path = files.find(project.folder, f"{module.replace('.', '/')}.py")
            file = None if path is None else path.relative_to(root).as_posix()
            found.append(Executable(project.name, name, file, f"{module}:{function}"))
    return found


def find_executable(root: Path, projects: Sequence[Project], package: str, name: str) -> Executable | None:
    """Return the program that `ros2 run PACKAGE NAME` would start; None if there is none.

    Where there is no entry point of the name, a file of the name in the package is taken, as CMake packages install
    them; where the submission has no such package, a file NAME or NAME.py anywhere in it. It is always a file of the
    submission.
    """
    named = [one for one in executables(root, projects) if (one.package, one.name) == (package, name)]
    if named:
        return named[0]
    folders = [project.folder for project in projects if project.name == package]
    wanted = (name,) if folders else (name, f"{name}.py")
    files = _Files(root)
    for folder in folders or [""]:
        found = next((path for one in wanted if (path := files.find(folder, one)) is not None), None)
        if found is not None and found.suffix == ".py":
            return Executable(package, name, found.relative_to(root).as_posix())
    return None


def has_package(projects: Sequence[Project], name: str) -> bool:
    """Return whether a submission has a ROS package."""
    return any(project.name == name for project in projects)


class _Files:
    """The files of a submission; each folder is listed once, however many names are looked for in it.

    Args:
        root: The submission.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._listed: dict[str, dict[str, list[Path]]] = {}

    def find(self, within: str, tail: str) -> Path | None:
        """Return the file nearest the top of a folder whose path ends like this.

        A tail that could lead out of the folder is refused before the file system is asked, and so is a file that a
        link leads to.
        """
        parts = tail.split("/")
        if "\0" in tail or not {"", ".", ".."}.isdisjoint(parts):
            return None
        if within not in self._listed:
            self._listed[within] = self._list(self._root / within)
        near = len((self._root / within).parts)
        for path in self._listed[within].get(parts[-1], ()):
            ends_so = path.parts[-len(parts) :] == tuple(parts) and len(path.parts) - len(parts) >= near
            if ends_so and self._is_inside(path):
                return path
        return None

    def _list(self, folder: Path) -> dict[str, list[Path]]:
        """Return the files below a folder by name, the ones nearest the top first."""
        found: dict[str, list[Path]] = {}
        seen = 0
        for above, folders, names in os.walk(folder):
            folders.sort()
            seen += len(names)
            for name in names:
                found.setdefault(name, []).append(Path(above, name))
            if seen > MOST_FILES:
                break
        return found

    def _is_inside(self, path: Path) -> bool:
        return path.is_file() and path.resolve() == self._root.resolve() / path.relative_to(self._root)
