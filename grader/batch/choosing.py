"""Which submissions are graded now: what is new or changed, and what was asked for besides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from grader.batch.intake import Entry
from grader.batch.keys import unusable_digest
from grader.batch.standing import State
from grader.batch.store import Kept, Store
from grader.model.errors import GraderError, SubmissionError
from grader.reading.submission import stage_submission

CHANGED, FAILED, UNDECIDED, ALL = "changed", "failed", "undecided", "all"
#: What `--rerun` takes; each of the others includes what is new or changed.
RERUNS = (CHANGED, FAILED, UNDECIDED, ALL)


def digest_of(entry: Entry, scratch: Path) -> str:
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


def due_now(store: Store, entries: Sequence[Entry], keys: Mapping[str, str], rerun: str) -> list[Entry]:
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
