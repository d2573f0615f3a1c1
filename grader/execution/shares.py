"""Installs what the packages of a submission share, as `colcon build` does, for programs that look it up."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Container, Iterator
from pathlib import Path

from grader.execution.ros_installation import RosInstallation
from grader.student_host.packages import data_files, package_folders, packages_of

_NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")
_INDEX = Path("share", "ament_index", "resource_index", "packages")


def install_shares(root: Path, prefix: Path, ros: RosInstallation) -> tuple[str, ...]:
    """Install the shared files of all packages, and return the prefixes with which they are found.

    Those are the `data_files` of setup.py. Where they are not known, or CMake installs, they are all files of the
    package, under their own names.

    Args:
        root: The staged submission.
        prefix: Folder that receives copies.
        ros: Comes after the submission in the path.

    Returns:
        The folders of AMENT_PREFIX_PATH; none if the submission has no package.
    """
    packages = {name: Path(folder) for name, folder in packages_of(str(root)).items() if _NAME.fullmatch(name)}
    if not packages:
        return ()
    folders = frozenset(map(Path, package_folders(str(root))))
    for name, folder in packages.items():
        marker = prefix / _INDEX / name
        marker.parent.mkdir(parents=True, exist_ok=True)
        marker.touch()
        for source, target in _shared(root, folder, name, folders - {folder}):
            place = Path(os.path.normpath(prefix / target))
            if prefix in place.parents and source.is_file() and not place.exists():
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, place)
    for here, _, files in os.walk(prefix):  # students' processes may run as another user, whatever the umask is
        Path(here).chmod(0o755)
        for file in files:
            Path(here, file).chmod(0o644)
    behind = ros.runtime.environment.get("AMENT_PREFIX_PATH", str(ros.prefix))
    return (str(prefix), *behind.split(":"))


def _shared(root: Path, folder: Path, name: str, others: Container[Path]) -> Iterator[tuple[Path, str]]:
    """Yield files that a package shares, each with its place below the prefix; `others` are the other packages."""
    known = data_files(str(folder))
    if known is not None:
        for target, files in known:
            for file in files:
                source = Path(os.path.normpath(folder / file))
                if root in source.parents:
                    yield source, f"{target}/{source.name}"
        return
    for here, folders, files in os.walk(folder):
        folders[:] = [f for f in folders if Path(here, f) not in others]
        for file in files:
            source = Path(here, file)
            yield source, f"share/{name}/{source.relative_to(folder)}"
