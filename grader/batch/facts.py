"""What belongs to one run of the command over a class, and to no result in particular."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.batch.keys import Conditions


@dataclass(frozen=True, slots=True)
class RunOfClass:
    """One run of the command over a class.

    Attributes:
        conditions: What the results depend on.
        title: What the class is called.
        written: When the run ended, as text.
        jobs: Submissions at a time.
        took_s: How long grading took.
        graded: Submissions that were graded now.
        kept: Submissions whose results were there already.
        stopped: Whether it was stopped before everybody was graded.
        folders: Folders of this machine, which no page names.
    """

    conditions: Conditions
    title: str = ""
    written: str = ""
    jobs: int = 1
    took_s: float = 0.0
    graded: int = 0
    kept: int = 0
    stopped: bool = False
    folders: tuple[str, ...] = ()


def title_of(sources: Sequence[Path]) -> str:
    """Return what a class is called: the names of its sources, without the folders that they lie in."""
    return ", ".join(source.resolve().name for source in sources)


def folders_of(paths: Sequence[Path]) -> tuple[str, ...]:
    """Return folders as they may stand in messages, the longest first."""
    found = {str(path) for path in paths} | {str(path.resolve()) for path in paths}
    return tuple(sorted((folder for folder in found if folder.startswith("/")), key=lambda f: (-len(f), f)))
