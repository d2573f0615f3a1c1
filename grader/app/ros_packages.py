"""Lends programs the Python packages of ROS that no wheel holds, where the installation has none of its own."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

from grader.core.dataclass import dataclass
from grader.core.shipped import PACKAGE

#: The packages, each a folder; they import rclpy, so only nodes do.
LENT = PACKAGE / "ros_packages"
_IMPORT = re.compile(rb"^ *(?:from|import) (\w+)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Lent:
    """What a run gets of these packages."""

    names: tuple[str, ...] = ()  # sorted
    text: bytes = b""  # all of their code, which names the interface packages that they need


def lent_to(programs: bytes, is_installed: Callable[[str], bool]) -> Lent:
    """Return the packages that are not installed and that programs, or the packages that these need, name.

    Args:
        programs: The text of all programs.
        is_installed: Whether ROS or Python has a package of this name.
    """
    lacking = {name: text for name, text in _packages().items() if not is_installed(name)}
    found: dict[str, bytes] = {}
    named = {name for name in lacking if name.encode() in programs}
    while more := {name: lacking[name] for name in named if name not in found}:
        found |= more
        named = {m[1].decode() for text in more.values() for m in _IMPORT.finditer(text)} & lacking.keys()
    return Lent(tuple(sorted(found)), b"".join(found.values()))


def copied(names: Iterable[str], into: Path) -> Path:
    """Copy packages to where the nodes may read them, and return the folder for their sys.path."""
    folder = into / "ros_packages" / "python"
    for name in names:
        if not (folder / name).exists():
            shutil.copytree(LENT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@cache
def _packages() -> dict[str, bytes]:
    """Return name and code of each package."""
    folders = sorted(folder for folder in LENT.iterdir() if (folder / "__init__.py").is_file())
    return {folder.name: b"".join(path.read_bytes() for path in sorted(folder.rglob("*.py"))) for folder in folders}
