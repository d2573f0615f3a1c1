"""Tells whether programs run with another numpy than that of their ROS release, whose numbers differ."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version

from grader.runtime.model.releases import release_of
from grader.runtime.model.trace import OtherNumpy


@cache
def other_numpy(distro: str) -> OtherNumpy | None:
    """Return the numpy here and that of a ROS release, if their major versions differ; None if they agree.

    Since numpy 2, `0.5 - float32` is a float32 and not a float64, and `uint8(200) + 100` does not fit (NEP 50). Other
    differences of versions raise exceptions that name what is missing.
    """
    wanted = release_of(distro).numpy
    try:
        here = version("numpy")
    except PackageNotFoundError:
        return None
    if wanted is None or here.partition(".")[0] == str(wanted[0]):
        return None
    return OtherNumpy(".".join(here.split(".")[:2]), ".".join(map(str, wanted)), distro)
