"""Makes packages importable that are not installed, for a test and for its programs.

They are the message packages that lie in a workspace as sources, and what the grader brings of ROS itself.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from importlib import invalidate_caches
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType

from grader.runtime.interface_packages import InterfacePackage, is_brought, modules_named, unbuilt
from grader.runtime.model.errors import GraderError
from grader.runtime.programs.executables import package_of, project_folders, workspace_of

#: The largest file that is searched for the names of packages.
MOST_BYTES = 1 << 20


def workspace_around(folder: Path) -> Path | None:
    """Return the folder with the packages beside the one that a folder is in; None if it is in none and has none."""
    package = package_of(folder)
    if (package / "package.xml").is_file():
        return workspace_of(package)
    source = folder / "src"
    if project_folders(source):
        return source
    return folder if any(folder.glob("*/package.xml")) else None


@cache
def _unbuilt(workspace: Path) -> tuple[InterfacePackage, ...]:
    return unbuilt(workspace)


@cache
def modules_for(folder: Path) -> tuple[Path, ...]:
    """Return where the modules of packages are that the programs of a folder need and nobody has installed.

    What has to be built is built once, and kept for other runs.

    Args:
        folder: A package, or the folder of programs in none.

    Raises:
        GraderError: A definition cannot be used; the message has its file and line.
    """
    workspace = workspace_around(folder)
    paths = folder.glob("*.py") if workspace is None else workspace.rglob("*.py")
    sources = [path.read_bytes() for path in sorted(paths) if path.is_file() and path.stat().st_size <= MOST_BYTES]
    own = () if workspace is None else _unbuilt(workspace)
    return modules_named(sources, own)


def find_package(folder: Path, name: str, target: ModuleType | None = None) -> ModuleSpec | None:
    """Return the place of a package that is not installed; None for anything else.

    Args:
        folder: Lies in the workspace.
        name: The package.
        target: As for a finder of modules.

    Raises:
        ImportError: It cannot be built.
    """
    try:
        found = [str(place) for place in _places(folder, name)]
    except GraderError as error:
        hint = f"; {error.hint}" if error.hint else ""
        raise ImportError(f"{name}: {error.message}{hint}", name=name) from None
    let_import(found)
    return PathFinder.find_spec(name, found, target) if found else None


def _places(folder: Path, name: str) -> tuple[Path, ...]:
    workspace = workspace_around(folder)
    if workspace is not None and name in {package.name for package in _unbuilt(workspace)}:
        return modules_for(folder)
    return modules_named([name.encode()], ()) if is_brought(name) else ()


def let_import(folders: Sequence[str]) -> None:
    """Let this process import from folders what is not installed."""
    added = [folder for folder in folders if folder not in sys.path]
    sys.path += added
    if added:
        invalidate_caches()
