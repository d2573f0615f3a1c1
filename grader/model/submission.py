"""A submission: which staged file belongs to which process of an exercise, and what was found instead."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True, slots=True)
class StudentFile:
    """One file of the submission that an exercise asks for.

    Attributes:
        wanted: File name the exercise asks for, e.g. `velocity_publisher.py`.
        found: Path inside the submission, POSIX form and relative, or None if there is none.
        similar: Names in the submission that look like a misspelling of `wanted`, nearest first.
        others: Further files of the wanted name that were not taken, relative paths.
    """

    wanted: str
    found: str | None
    similar: tuple[str, ...] = ()
    others: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Submission:
    """What a student handed in, staged where it can be run.

    Attributes:
        name: Name shown in reports.
        path: Where it came from, as the user typed it.
        root: Staged copy, read-only by convention; what runs.
        digest: `sha256:` and 64 hex digits over relative names and contents of all staged files.
        files: Wanted file name -> what was found for it.
        notes: Sentences about the intake that a reader must know.
    """

    name: str
    path: str
    root: Path
    digest: str
    files: Mapping[str, StudentFile] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
