"""Interface packages that are not installed: what a run used of them, and what nodes can use."""

from __future__ import annotations

from grader.runtime.model.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class BroughtPackage:
    """An interface package that a run used and that is not installed."""

    name: str
    origin: str  # who brought it: `rubric`, `class` (with `--interfaces`), `grader` or `submission`
    digest: str  # of its definitions


@dataclass(frozen=True, slots=True)
class DescribedPackage:
    """An interface package that nodes can use, for `grade interfaces`."""

    name: str
    origin: str  # as in `BroughtPackage`
    digest: str  # of its definitions
    types: tuple[str, ...]  # e.g. `lab_msgs/msg/Level`, sorted
    folder: str  # where its modules are kept; empty if the installed package of this name is used instead
