"""What a class is graded with, and which of its submissions are graded now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.app.request import GradeRequest
from grader.app.seeds import SeedKey
from grader.classroom.downloads import AUTO
from grader.classroom.intake import HandedInEntry
from grader.classroom.outputs import Platforms
from grader.classroom.store import Kept, State, Store, unusable_digest
from grader.core.errors import GraderError, SubmissionError
from grader.similarity.library import ComparedProgram
from grader.submissions.submission import stage_submission

CHANGED, FAILED, UNDECIDED, ALL = "changed", "failed", "undecided", "all"
#: What `--rerun` takes; each of the others includes what is new or changed.
RERUNS = (CHANGED, FAILED, UNDECIDED, ALL)


def digest_of(entry: HandedInEntry, scratch: Path) -> str:
    """Return the digest of a submission; empty if that cannot be known.

    Args:
        entry: The submission.
        scratch: An empty folder, to copy it into.
    """
    if entry.problem:
        return unusable_digest(SubmissionError(entry.problem))
    try:
        return stage_submission(str(entry.path), (), scratch).digest
    except SubmissionError as error:
        return unusable_digest(error)
    except (GraderError, OSError, MemoryError, RecursionError):
        return ""  # grading it, in a process of its own, will say why


def due_now(store: Store, entries: Sequence[HandedInEntry], keys: Mapping[str, str], rerun: str) -> list[HandedInEntry]:
    """Return the submissions to grade: where a run was stopped, the same one goes on.

    Args:
        store: The results so far.
        entries: The submissions.
        keys: Name -> key of a result made now.
        rerun: One of `RERUNS`.
    """
    pending = store.pending(rerun)
    due = []
    for entry in entries:
        kept, key = store.kept(entry.name), keys[entry.name]
        again = is_due(kept, key, rerun) if pending is None else entry.name in pending
        if again or is_due(kept, key, CHANGED):
            due.append(entry)
    return due


def is_due(kept: Kept, key: str, rerun: str) -> bool:
    """Return whether a submission is to be graded.

    Args:
        kept: What lies in the folder for results.
        key: The key of a result made now; empty if it is not known.
        rerun: One of `RERUNS`.
    """
    result, last = kept.result, kept.last
    if rerun == ALL or result is None or result.state is State.FAILED or not key or result.key != key:
        return True
    assert last is not None
    if rerun == UNDECIDED:
        return State.UNDECIDED in (result.state, last.state)
    return rerun == FAILED and bool({result.state, last.state} & {State.FAILED, State.REFUSED})


_GRADING = GradeRequest("")
_NO_PLATFORMS = Platforms()


@dataclass(frozen=True, slots=True)
class ClassRequest:
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
    grading: GradeRequest = _GRADING
    jobs: int | None = None
    rerun: str = CHANGED
    seed_key: SeedKey | None = None
    standalone: bool = False
    platforms: Platforms = _NO_PLATFORMS
    given: tuple[ComparedProgram, ...] | None = None
