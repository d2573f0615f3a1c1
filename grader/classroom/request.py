"""A request to grade a class, and the choice of the submissions to grade now."""

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
#: Values of `--rerun`; each includes new and changed submissions.
RERUNS = (CHANGED, FAILED, UNDECIDED, ALL)


def digest_of(entry: HandedInEntry, scratch: Path) -> str:
    """Compute the digest of a submission, copied to an empty folder; empty if that is not possible."""
    if entry.problem:
        return unusable_digest(SubmissionError(entry.problem))
    try:
        return stage_submission(str(entry.path), (), scratch).digest
    except SubmissionError as error:
        return unusable_digest(error)
    except (GraderError, OSError, MemoryError, RecursionError):
        return ""  # grading it in its own process will report why


def due_now(store: Store, entries: Sequence[HandedInEntry], keys: Mapping[str, str], rerun: str) -> list[HandedInEntry]:
    """Select the submissions to grade; a stopped run with the same `--rerun` is resumed."""
    pending = store.pending(rerun)
    due = []
    for entry in entries:
        kept, key = store.kept(entry.name), keys[entry.name]
        again = is_due(kept, key, rerun) if pending is None else entry.name in pending
        if again or is_due(kept, key, CHANGED):
            due.append(entry)
    return due


def is_due(kept: Kept, key: str, rerun: str) -> bool:
    """Whether a submission has to be graded; the key is that of a current result, empty if unknown."""
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
    """What to grade, and how."""

    sources: tuple[Path, ...]  # folders of submissions, or downloads
    results: Path
    layout: str = AUTO  # how submissions are named; one of `downloads.LAYOUTS`
    pattern: str = ""  # a regular expression for names, used instead of the layout; empty for none
    roster: Path | None = None  # CSV file of the class; None if there is none
    adjustments: Path | None = None  # YAML file of late days and changed scores; None if there is none
    grading: GradeRequest = _GRADING  # the request as for one submission; its path is ignored
    jobs: int | None = None  # submissions graded in parallel; None for one per processor
    rerun: str = CHANGED  # one of `RERUNS`
    seed_key: SeedKey | None = None  # the key that seeds are derived from; None for the one stored with the results
    standalone: bool = False  # whether each HTML report is self-contained
    platforms: Platforms = _NO_PLATFORMS
    # Code handed out to everyone, ignored when submissions are compared; None to skip the comparison
    given: tuple[ComparedProgram, ...] | None = None
