"""Checks and hint rules of the exercises that come with the grader: every rubric may use these checks by their names.

An exercise keeps them beside its rubric, in `checks.py` and `hints.py`, as an author does. A rubric that names such a
check without a file of its own that defines it gets the check, and the hint rules of that exercise with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

from grader.grading.judging.checks import CHECKS
from grader.grading.rubrics.author_modules import OwnHints
from grader.grading.rubrics.own_checks import load_checks, load_hints, own_files
from grader.runtime.model.dataclass import dataclass
from grader.runtime.shipped import shipped

#: The names of both files in the folder of an exercise.
CHECK_FILE, HINT_FILE = "checks.py", "hints.py"


@dataclass(frozen=True, slots=True)
class _Shared:
    """What one exercise shares: its checks by name, and its folder."""

    checks: Mapping[str, type]
    folder: Path


@cache
def known_checks() -> Mapping[str, type]:
    """Return every check that comes with the grader, by name: the general ones, then those of the exercises."""
    return {**CHECKS, **{name: kind for shared in _exercises() for name, kind in shared.checks.items()}}


def hints_of(names: Iterable[str]) -> OwnHints:
    """Return the hint rules of the exercises that some of these checks come from, in the order of the exercises."""
    asked = set(names)
    folders = [shared.folder for shared in _exercises() if asked & shared.checks.keys()]
    return sum(map(_hints, folders), OwnHints())


@cache
def _exercises() -> tuple[_Shared, ...]:
    folders = sorted(path.parent for path in shipped("rubrics").glob(f"*/{CHECK_FILE}"))
    return tuple(
        _Shared(load_checks(own_files(folder / CHECK_FILE, [CHECK_FILE]), CHECKS), folder) for folder in folders
    )


@cache
def _hints(folder: Path) -> OwnHints:
    there = (folder / HINT_FILE).is_file()
    return load_hints(own_files(folder / HINT_FILE, [HINT_FILE]), known_checks()) if there else OwnHints()
