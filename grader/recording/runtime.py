"""The interpreter and the ROS installation that child processes run with, also as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True)
class PythonRuntime:
    """The interpreter and the ROS installation that children run with.

    Attributes:
        executable: Absolute path of the Python interpreter.
        read_paths: Absolute files and folders that the interpreter, its packages and ROS need, read-only.
        library_paths: Value of LD_LIBRARY_PATH, in order.
        python_paths: Folders for sys.path beyond the interpreter's own, in order.
        environment: Further variables that ROS needs (AMENT_PREFIX_PATH, ROS_DISTRO, RMW_IMPLEMENTATION ...).
    """

    executable: Path
    read_paths: tuple[Path, ...]
    library_paths: tuple[Path, ...]
    python_paths: tuple[Path, ...]
    environment: Mapping[str, str]


def runtime_to_json(runtime: PythonRuntime) -> dict[str, Any]:
    """Return a runtime as JSON values."""
    return {
        "executable": str(runtime.executable),
        "read_paths": [str(path) for path in runtime.read_paths],
        "library_paths": [str(path) for path in runtime.library_paths],
        "python_paths": [str(path) for path in runtime.python_paths],
        "environment": dict(runtime.environment),
    }


def runtime_from_json(values: Mapping[str, Any]) -> PythonRuntime:
    """Return a runtime from JSON values."""
    return PythonRuntime(
        executable=Path(values["executable"]),
        read_paths=tuple(map(Path, values["read_paths"])),
        library_paths=tuple(map(Path, values["library_paths"])),
        python_paths=tuple(map(Path, values["python_paths"])),
        environment=values["environment"],
    )
