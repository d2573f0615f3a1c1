"""The test submissions, wherever they are: those of each exercise, and those that are about no single one.

A collection is a folder with submissions in `correct/`, `threads/`, `wrong/` and `broken/`, and beside them
`expected.yaml` (what each is worth), `golden.yaml` (what its student reads), `charts.yaml` and `recorded.tar.xz`. The
name of a submission is that of its folder in its collection, as `wrong/joint_amplitude`; no other has the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from places import TESTS
from tables import read_table

#: One folder for each exercise, and a collection of programs that crash, or are no programs, whatever the exercise.
EXERCISES, SHAPES = TESTS / "exercises", TESTS / "shapes"
GROUPS = ("correct", "threads", "wrong", "broken")
EXPECTED, GOLDEN, CHARTS, ARCHIVE = "expected.yaml", "golden.yaml", "charts.yaml", "recorded.tar.xz"


@cache
def collections() -> tuple[Path, ...]:
    """Return the folders of all collections, in order."""
    return (*sorted(path.parent for path in EXERCISES.glob(f"*/{EXPECTED}")), SHAPES)


@cache
def expected_in(collection: Path) -> dict[str, Any]:
    """Return what a collection expects: submission -> `about`, `graded`, and each criterion that is not met."""
    return table(collection / EXPECTED)


@cache
def _homes() -> dict[str, Path]:
    return {name: collection for collection in collections() for name in expected_in(collection)}


def collection_of(name: str) -> Path:
    """Return the folder of the collection that a submission belongs to; raises KeyError if there is none."""
    return _homes()[name]


def folder_of(name: str) -> Path:
    """Return the folder of a submission such as `wrong/joint_amplitude`; raises KeyError if there is none."""
    return collection_of(name) / name


def folders_in(*groups: str) -> list[Path]:
    """Return the folders of all submissions in these groups, sorted by name, also of those that no table names yet."""
    found: Iterator[Path] = (
        path for collection in collections() for group in groups for path in (collection / group).glob("*/")
    )
    return sorted(found, key=lambda path: (groups.index(path.parent.name), path.name))


@cache
def expected() -> dict[str, Any]:
    """Return what each submission is graded for, and the outcome of every criterion that it does not meet."""
    return {name: entry for collection in collections() for name, entry in expected_in(collection).items()}


@cache
def golden() -> dict[str, Any]:
    """Return the reasons, hints and places that students read, by submission."""
    return _together(GOLDEN)


@cache
def golden_charts() -> dict[str, Any]:
    """Return what the charts of some submissions show, by submission."""
    return _together(CHARTS)


def _together(name: str) -> dict[str, Any]:
    tables = (table(path) for collection in collections() if (path := collection / name).exists())
    return {key: value for one in tables for key, value in one.items()}


def table(path: Path) -> dict[str, Any]:
    """Return what a YAML file of a collection maps names to."""
    return dict(read_table(path) or {})
