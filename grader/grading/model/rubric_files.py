"""Where the files of an exercise are: its rubric, named in any way, and the notes on the rubric's self-test."""

from __future__ import annotations

import os.path
from pathlib import Path

#: Names of the rubric and of its notes in the folder of an exercise.
RUBRIC, NOTES = "rubric.yaml", "selftest.yaml"
#: What `rubrics/*.yaml` names where a shell finds nothing for it: the rubric of each exercise below `rubrics/`.
_ALL = "*.yaml"


def rubric_file(named: Path) -> Path:
    """Return the file of a rubric.

    Args:
        named: The file, the folder of its exercise, or `NAME.yaml` for `NAME/rubric.yaml`: each rubric was such a file
            before exercises had folders. A file that is there is always meant itself.

    Returns:
        The rubric, or what was named if there is none.
    """
    folder = named.with_suffix("") if named.suffix == ".yaml" else named
    inside = folder / RUBRIC
    return inside if os.path.isfile(inside) and not os.path.isfile(named) else named  # noqa: PTH113 - False for any name


def rubrics_in(folder: Path) -> list[Path]:
    """Return the rubrics of the exercises in a folder, sorted."""
    return sorted(folder.glob(f"*/{RUBRIC}"))


def rubric_files(named: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return the files of rubrics, in order; `FOLDER/*.yaml` without such a file names the exercises in the folder."""
    return tuple(file for one in named for file in _all_in(one) or (rubric_file(one),))


def _all_in(named: Path) -> tuple[Path, ...]:
    every = named.name == _ALL and not named.exists()
    return tuple(rubrics_in(named.parent)) if every else ()


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
