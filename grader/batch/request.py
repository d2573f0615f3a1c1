"""What a class is graded with: all that the command line says."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from grader.batch.choosing import CHANGED
from grader.batch.layouts import AUTO
from grader.batch.outputs import Platforms
from grader.request import Request
from grader.seeding import SeedKey
from grader.similarity.contents import Program

_GRADING = Request("")
_NO_PLATFORMS = Platforms()


@dataclass(frozen=True, slots=True)
class Course:
    """What is to be graded, and how.

    Attributes:
        sources: Folders of submissions, or downloads.
        results: Folder for results.
        layout: How submissions are named; see `layouts`.
        pattern: A regular expression for names, instead; empty for none.
        roster: CSV file of the people; None if there is none.
        adjustments: YAML file of late days and other scores; None if there is none.
        grading: As for one submission; its path says nothing.
        jobs: Submissions at a time; None for one a processor.
        rerun: See `choosing`.
        seed_key: The key that seeds are made with; None for the one kept with the results.
        standalone: Whether each HTML report can be sent away alone.
        platforms: What else is written for the class.
        given: What everybody was given, to compare the submissions without it; None to compare none.
    """

    sources: tuple[Path, ...]
    results: Path
    layout: str = AUTO
    pattern: str = ""
    roster: Path | None = None
    adjustments: Path | None = None
    grading: Request = _GRADING
    jobs: int | None = None
    rerun: str = CHANGED
    seed_key: SeedKey | None = None
    standalone: bool = False
    platforms: Platforms = _NO_PLATFORMS
    given: tuple[Program, ...] | None = None
