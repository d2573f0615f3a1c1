"""Where the files of an exercise are: its rubric, named in any way, and the notes on the rubric's self-test."""

from __future__ import annotations

import os.path
from pathlib import Path

#: Names of the rubric and of its notes in the folder of an exercise.
RUBRIC, NOTES = "rubric.yaml", "selftest.yaml"


def rubric_file(named: Path) -> Path:
    """Return the file of a rubric, which is named itself or by the folder of its exercise."""
    inside = named / RUBRIC
    return inside if os.path.isfile(inside) else named  # noqa: PTH113 - False for any name


def rubrics_in(folder: Path) -> list[Path]:
    """Return the rubrics of the exercises in a folder, sorted."""
    return sorted(folder.glob(f"*/{RUBRIC}"))


def notes_on(rubric: Path) -> Path:
    """Return the path of the notes on a rubric: `NAME.selftest.yaml`, or `selftest.yaml` beside `rubric.yaml`."""
    beside = rubric.with_suffix(f".{NOTES}")
    return rubric.with_name(NOTES) if rubric.name == RUBRIC and not beside.exists() else beside


def rubric_of(notes: Path) -> Path | None:
    """Return the path of the rubric that a file holds notes on; None if its name is not that of a file of notes."""
    if notes.name.endswith(f".{NOTES}"):
        return notes.with_name(f"{notes.name.removesuffix(f'.{NOTES}')}.yaml")
    beside = notes.with_name(RUBRIC)
    return beside if notes.name == NOTES and beside.is_file() else None
