"""Whether the library for clusters is installed, which is known before anything else is done."""

from __future__ import annotations

from importlib.util import find_spec

from grader.model.errors import EnvironmentFault

LIBRARY = "distributed"


def require_dask() -> None:
    """Make sure that a cluster can be spoken to; raises EnvironmentFault with what to install."""
    if find_spec(LIBRARY) is None:
        message = f"--scheduler: expected the package {LIBRARY}, found none"
        raise EnvironmentFault(message, "pip install 'rclpy-grader[dask]'")
