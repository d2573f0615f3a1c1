"""Installs what the packages of a submission share, as `colcon build` does, for programs that look it up."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Container, Iterator, Sequence
from pathlib import Path

from grader.runtime.model.limits import MAX_FILES, MAX_TOTAL_BYTES
from grader.runtime.model.projects import Project
from grader.runtime.model.quantities import size
from grader.runtime.ros_installation import RosInstallation

_NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")
_INDEX = Path("share", "ament_index", "resource_index", "packages")


def install_shares(
    root: Path, projects: Sequence[Project], prefix: Path, ros: RosInstallation
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Install the shared files of all packages, and return the prefixes with which they are found, and notes.

    The files are the `data_files` of setup.py. Where they are not known, or CMake installs, they are all files of the
    package, under their own names.

    Args:
        root: The staged submission.
        projects: Its packages.
        prefix: Folder that receives copies.
        ros: Comes after the submission in the path.

    Returns:
        The folders of AMENT_PREFIX_PATH, none if the submission has no package; and sentences about what cannot be
        installed.
    """
    packages: dict[str, Path] = {}
    for project in projects:
        if _NAME.fullmatch(project.name):
            packages.setdefault(project.name, root / project.folder)
    if not packages:
        return (), ()
    folders = frozenset(root / project.folder for project in projects)
    known = {root / project.folder: project.data_files for project in projects}
    copies = _Copies(prefix)
    for name, folder in packages.items():
        marker = prefix / _INDEX / name
        marker.parent.mkdir(parents=True, exist_ok=True)
        marker.touch()
        for source, target in _shared(root, folder, name, folders - {folder}, known[folder]):
            if not copies.add(source, prefix / target):
                break
    for here, _, files in os.walk(prefix):  # students' processes may run as another user, whatever the umask is
        Path(here).chmod(0o755)
        for file in files:
            Path(here, file).chmod(0o644)
    behind = ros.runtime.environment.get("AMENT_PREFIX_PATH", str(ros.prefix))
    return (str(prefix), *behind.split(":")), tuple(copies.notes())


class _Copies:
    """Copies files below a prefix, up to a limit, and counts those that have no place there."""

    def __init__(self, prefix: Path) -> None:
        self._prefix = prefix
        self._files = self._bytes = 0
        self._full = False
        self._failed: list[str] = []

    def add(self, source: Path, place: Path) -> bool:
        """Copy a file, unless there is one at its place; return whether there is room for others."""
        place = Path(os.path.normpath(place))
        try:
            if self._prefix not in place.parents or not source.is_file() or place.is_file():
                return True
            self._files, self._bytes = self._files + 1, self._bytes + source.stat().st_size
            # As much as a whole submission: setup.py may install one file any number of times
            if self._files > MAX_FILES or self._bytes > MAX_TOTAL_BYTES:
                self._full = True
                return False
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, place)
        except OSError:  # a file is where a folder should be, or the other way round; or the name is too long
            self._failed.append(source.name)
        return True

    def notes(self) -> Iterator[str]:
        """Yield what could not be installed, as sentences."""
        if self._full:
            yield f"data_files of setup.py: only {MAX_FILES:,} files and {size(MAX_TOTAL_BYTES)} of them are installed"
        if self._failed:
            files = "1 file" if len(self._failed) == 1 else f"{len(self._failed):,} files"
            yield f"data_files of setup.py: {files} cannot be installed where it says, as something else is there"


def _shared(
    root: Path,
    folder: Path,
    name: str,
    others: Container[Path],
    known: Sequence[tuple[str, Sequence[str]]] | None,
) -> Iterator[tuple[Path, str]]:
    """Yield files that a package shares, each with its place below the prefix; `others` are the other packages."""
    if known is not None:
        for target, files in known:
            for file in files:
                source = Path(os.path.normpath(folder / file))
                if root in source.parents:
                    yield source, f"{target}/{source.name}"
        return
    for here, folders, files_here in os.walk(folder):
        folders[:] = [f for f in folders if Path(here, f) not in others]
        for file in files_here:
            source = Path(here, file)
            yield source, f"share/{name}/{source.relative_to(folder)}"
