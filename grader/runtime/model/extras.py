"""The libraries of optional extras: whether they are installed, and how to install them."""

from __future__ import annotations

import importlib.util
import shlex
import sys

from grader.runtime.model.errors import EnvironmentFault

#: What pip installs the grader from: until there is a release, a clone in the current folder. `.ci/release --switch`
#: changes it, as it does on all pages.
PACKAGE = "./rclpy-grader"


def pip_install(extra: str) -> str:
    """Return the command that adds an extra, for reports, which do not depend on the machine they are made on."""
    return f"pip install '{PACKAGE}[{extra}]'"


def require(what: str, library: str, extra: str) -> None:
    """Raise EnvironmentFault, with the command to install it, if the library of an optional extra is missing."""
    if importlib.util.find_spec(library) is None:
        message = f"{what}: expected the package {library} of the extra {extra!r}, found none"
        raise EnvironmentFault(message, install_command(library))


def install_command(library: str) -> str:
    """Return the command that adds a library here, whether the grader came from a clone, a wheel, uv or pipx."""
    from importlib import metadata  # noqa: PLC0415  takes long

    try:
        requirements = metadata.requires("rclpy-grader") or []
    except metadata.PackageNotFoundError:
        requirements = []
    wanted = next((line.partition(";")[0].strip() for line in requirements if line.startswith(library)), library)
    # Environments that uv makes have no pip.
    pip = [sys.executable, "-m", "pip", "install"]
    uv = ["uv", "pip", "install", "--python", sys.executable]
    return shlex.join([*(pip if importlib.util.find_spec("pip") else uv), wanted])
