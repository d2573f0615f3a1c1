"""Lends programs the Python packages of ROS that no wheel holds, where the installation has none of its own."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Collection, Iterable
from pathlib import Path

from grader.runtime.model.dataclass import dataclass
from grader.runtime.shipped import PACKAGE

#: The packages, each a folder; they import rclpy, so only nodes do.
LENT = PACKAGE / "runtime" / "ros_packages"
#: Their names.
LENDABLE = (
    "cv_bridge",
    "message_filters",
    "sensor_msgs_py",
    "tf2_geometry_msgs",
    "tf2_py",
    "tf2_ros",
    "tf_transformations",
)
_IMPORT = re.compile(rb"^ *(?:from|import) (\w+)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Lent:
    """What a run gets of these packages."""

    names: tuple[str, ...] = ()  # sorted
    text: bytes = b""  # all of their code, which names the interface packages that they need


def lent_to(named: Collection[str], is_installed: Callable[[str], bool]) -> Lent:
    """Return the packages that are not installed and that programs name, or that those need.

    Args:
        named: What the programs name, of `LENDABLE`.
        is_installed: Whether ROS or Python has a package of this name.
    """
    lacking = {name for name in LENDABLE if not is_installed(name)}
    found: dict[str, bytes] = {}
    wanted = lacking.intersection(named)
    while more := {name: _code(name) for name in wanted if name not in found}:
        found |= more
        wanted = lacking & {m[1].decode() for text in more.values() for m in _IMPORT.finditer(text)}
    return Lent(tuple(sorted(found)), b"".join(found.values()))


def copied(names: Iterable[str], into: Path) -> Path:
    """Copy packages to where the nodes may read them, and return the folder for their sys.path."""
    folder = into / "ros_packages" / "python"
    for name in names:
        if not (folder / name).exists():
            shutil.copytree(LENT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def _code(name: str) -> bytes:
    return b"".join(path.read_bytes() for path in sorted((LENT / name).rglob("*.py")))
