"""Tells which package of the submission a name was meant to be, and raises what ROS does for a name of none."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

#: Names this similar to a package of the submission are taken for a misspelling of it.
SIMILARITY = 0.8


#: So similar are the parts in which a misspelling and the name differ; `orion` and `robot` are not.
ALIKE = 0.7


def meant_by(package: str, known: Iterable[str]) -> str:
    """Return the package of which a name is a misspelling; empty if it may be the name of another one.

    A name with a part more, or with another number, is often that of a released package: `turtlesim` and
    `my_turtlesim`, `turtlebot3_gazebo` and `turtlebot4_gazebo`.
    """
    for near in difflib.get_close_matches(package, list(known), n=3, cutoff=SIMILARITY):
        one, other = (re.sub(r"[0-9]", "", name).split("_") for name in (package, near))
        # What both share, such as `description`, makes them no more alike.
        mine, theirs = ("_".join(part for part in a if part not in b) for a, b in ((one, other), (other, one)))
        if mine and theirs and difflib.SequenceMatcher(None, mine, theirs).ratio() >= ALIKE:
            return near
    return ""


class PackageNotFoundError(KeyError):
    """A package that is neither in the submission nor installed."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


PackageNotFoundError.__module__ = "ament_index_python.packages"
