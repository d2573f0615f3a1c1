"""Whether the library that compares programs is installed, which is known before anything else is done."""

from __future__ import annotations

from importlib.util import find_spec

from grader.model.errors import EnvironmentFault

LIBRARY = "copydetect"


def require_library() -> None:
    """Make sure that programs can be compared; raises EnvironmentFault with what to install."""
    if find_spec(LIBRARY) is None:
        message = f"--similarity: expected the package {LIBRARY}, found none"
        raise EnvironmentFault(message, "pip install 'rclpy-grader[similarity]'")
