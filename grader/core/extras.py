"""How to install the libraries of optional extras."""

from __future__ import annotations

import importlib.util
import shlex
import sys
from importlib import metadata


def install_command(library: str) -> str:
    """Return the command that adds a library here, whether the grader came from a clone, a wheel, uv or pipx."""
    try:
        requirements = metadata.requires("rclpy-grader") or []
    except metadata.PackageNotFoundError:
        requirements = []
    wanted = next((line.partition(";")[0].strip() for line in requirements if line.startswith(library)), library)
    # Environments that uv makes have no pip.
    pip = [sys.executable, "-m", "pip", "install"]
    uv = ["uv", "pip", "install", "--python", sys.executable]
    return shlex.join([*(pip if importlib.util.find_spec("pip") else uv), wanted])
