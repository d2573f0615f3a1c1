"""The results folder: results are written atomically, and a result is never replaced by a worse one."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, field, replace
from enum import Enum
from pathlib import Path
from typing import Any

import msgspec

from grader.grading.app.spot_checks import is_spot_checked
from grader.grading.model.exercise import Drawn
from grader.grading.model.grading_options import GradingOptions, key_values
from grader.grading.reporting.escape import json_value
from grader.runtime.files import write_whole
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError, GraderError, HarnessError, SubmissionError

SCHEMA = "grader/batch-result/v1"


class State(str, Enum):
    """Outcome of an attempt to grade a submission; only the first two have a report."""

    GRADED = "graded"
    UNDECIDED = "undecided"  # a criterion was not decided, through no fault of the student
    REFUSED = "refused"  # the submission cannot be used; the student must act
    FAILED = "failed"  # the grader or the machine failed; never counts as a mark

    @property
    def worth(self) -> int:
        """Rank of a result; a result never replaces one of a higher rank."""
        return {State.FAILED: 0, State.UNDECIDED: 1, State.REFUSED: 2, State.GRADED: 2}[self]


@dataclass(frozen=True, slots=True)
class ResultStatus:
    """Status of one submission."""

    state: State
    key: str  # what the result depends on; see `Conditions`
    digest: str
    label: str  # name of the submission in the source
    problem: str = ""  # why there is no report, in one line; empty if there is one
    hint: str = ""  # what to do; may be empty
    score: float = 0.0
    max_score: float = 0.0
    duration_s: float = 0.0
    usage: Mapping[str, float] = field(default_factory=dict)  # resources used: `processor_s` and `peak_bytes`
    # What its recordings depend on besides their scenarios; see `Conditions.recorded`. Empty if nothing was recorded.
    recorded: str = ""
    schema: str = SCHEMA  # version of this format


def dump_status(status: ResultStatus) -> bytes:
    """Encode a status as JSON; invalid text in names is replaced."""
    return json.dumps(json_value(asdict(status)), indent=2).encode() + b"\n"


def load_status(data: bytes) -> ResultStatus | None:
    """Decode a status; None for invalid data or another version."""
    try:
        status = msgspec.json.decode(data, type=ResultStatus)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
        return None
    return status if status.schema == SCHEMA else None


RESULT, ATTEMPT, REPORT = "result.json", "attempt.json", "report.json"
#: The report from before a run that is not finished, of a submission that this run graded again.
BEFORE = ".before.json"
#: The seed key of the class; only its owner can read it, and no exported file contains it.
SEED_KEY = ".seed.key"
_FRESH, _OLD = ".new", ".old"
_PENDING = ".pending.json"


@dataclass(frozen=True, slots=True)
class Kept:
    """The stored results of one submission."""

    result: ResultStatus | None = None  # the best result so far; None if there is none
    # A later, worse attempt that did not replace the result; None if there was none
    attempt: ResultStatus | None = None

    @property
    def last(self) -> ResultStatus | None:
        """The latest attempt."""
        return self.attempt or self.result


class Store:
    """The results of a class; only one process at a time uses the folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._students = folder / "students"

    def place(self, name: str) -> Path:
        """Return the folder of one submission's result."""
        return self._students / name

    def fresh(self, name: str) -> Path:
        """Return a new path for a result, on the same disk as the old one; it does not exist yet."""
        return self._students / f".{name}.{secrets.token_hex(4)}{_FRESH}"

    def kept(self, name: str) -> Kept:
        """Read the stored results of a submission."""
        return Kept(_read(self.place(name) / RESULT), _read(self.place(name) / ATTEMPT))

    def names(self) -> list[str]:
        """Return the names of all results, in order."""
        return sorted(path.name for path in self._students.iterdir() if (path / RESULT).is_file())

    def remember(self, name: str, fresh: Path, status: ResultStatus) -> None:
        """Put the report that an unfinished run began with beside a new result of the same files, to compare them."""
        place, result = self.place(name), self.kept(name).result
        old = next((path for path in (place / BEFORE, place / REPORT) if path.is_file()), None)
        if old is not None and fresh.is_dir() and result is not None and result.digest == status.digest:
            with suppress(OSError):  # without it only the comparison lacks a line
                shutil.copyfile(old, fresh / BEFORE)

    def commit(self, name: str, fresh: Path, status: ResultStatus) -> bool:
        """Store a new result, whose folder of files is moved or deleted; return whether it replaced the old one.

        Raises HarnessError if the result cannot be written; the old one is kept.
        """
        place = self.place(name)
        try:
            before = self.kept(name).result
            if before is not None and before.state.worth > status.state.worth:
                write_whole(place / ATTEMPT, dump_status(status))
                shutil.rmtree(fresh, ignore_errors=True)
                return False
            fresh.mkdir(exist_ok=True)
            write_whole(fresh / RESULT, dump_status(status))
            _sync(fresh)
            self._swap(fresh, place)
        except OSError as error:
            shutil.rmtree(fresh, ignore_errors=True)
            why = f"{place}: the result cannot be written: {error.strerror}"
            raise HarnessError(why, "free some space; run the same command again to continue") from None
        return True

    def write(self, name: str, data: bytes) -> Path:
        """Write a file for the whole class, and return its path; raises HarnessError if it cannot be written."""
        path = self.folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, data)
        except OSError as error:
            raise HarnessError(f"{path}: cannot be written: {error.strerror}", "free some space") from None
        return path

    def forget_before(self) -> None:
        """Delete the reports from before a run, because it is finished."""
        for path in self._students.glob(f"*/{BEFORE}"):
            path.unlink(missing_ok=True)

    def pending(self, rerun: str) -> frozenset[str] | None:
        """Return the names that a stopped run still had to grade; None if there was no such run."""
        try:
            first, *done = (self.folder / _PENDING).read_bytes().splitlines()
            noted = json.loads(first)
            # The last line may be cut off: its submission is graded once more.
            found = frozenset(map(str, noted["names"])).difference(filter(None, map(_name_in, done)))
            return found if noted["rerun"] == rerun else None
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None

    def note_pending(self, rerun: str, names: Iterable[str]) -> None:
        """Store what a run still has to grade, so that the same command resumes it."""
        left = sorted(names)
        if left:
            self.write(_PENDING, json.dumps({"rerun": rerun, "names": left}).encode() + b"\n")
        else:
            (self.folder / _PENDING).unlink(missing_ok=True)

    def note_done(self, name: str, *, last: bool) -> None:
        """Add to the note of `note_pending` that a submission is graded; the last one removes the note.

        A line is added, because writing the note anew for each submission would take time with the square of the class.
        """
        if last:
            self.note_pending("", ())
            return
        with suppress(OSError), (self.folder / _PENDING).open("ab") as note:  # without it, it is graded once more
            note.write(json.dumps(name).encode() + b"\n")

    def _swap(self, fresh: Path, place: Path) -> None:
        """Replace a folder by another; if the machine stops, one of the two can always be recovered."""
        old = self._students / f".{place.name}{_OLD}"
        if place.exists():
            shutil.rmtree(old, ignore_errors=True)
            place.rename(old)
        fresh.rename(place)
        _sync_one(self._students)
        shutil.rmtree(old, ignore_errors=True)

    def recover(self) -> None:
        """Clean up after a killed run: restore results that were being replaced, and remove unfinished ones."""
        for path in self._students.glob(f".*{_OLD}"):
            place = self.place(path.name.removeprefix(".").removesuffix(_OLD))
            if (place / RESULT).is_file():
                shutil.rmtree(path, ignore_errors=True)
            else:
                shutil.rmtree(place, ignore_errors=True)
                path.rename(place)
        for path in self._students.glob(f".*{_FRESH}"):
            shutil.rmtree(path, ignore_errors=True)

    @property
    def free_bytes(self) -> int:
        """Free disk space for results."""
        return shutil.disk_usage(self.folder).free


@contextmanager
def open_store(folder: Path) -> Iterator[Store]:
    """Open the results folder, and lock it; raises ClassError if it cannot be used, or another process uses it."""
    store = Store(folder)
    try:
        (folder / "students").mkdir(parents=True, exist_ok=True)
        lock = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o644)
    except OSError as error:
        raise ClassError(f"{folder}: expected a folder for results, found: {error.strerror}", "name another") from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        raise ClassError(f"{folder}: another process grades into this folder", "wait for it, or stop it") from None
    try:
        store.recover()
        yield store
        store.recover()
    except BaseException:
        with suppress(OSError):  # the error that stopped the run is more useful
            store.recover()
        raise
    finally:
        os.close(lock)


def _name_in(line: bytes) -> str:
    """Return the name in a line of the note of what is pending; empty if the line is cut off."""
    try:
        return str(json.loads(line))
    except (ValueError, RecursionError):
        return ""


def _read(path: Path) -> ResultStatus | None:
    with suppress(OSError):
        return load_status(path.read_bytes())
    return None


def _sync(folder: Path) -> None:
    """Sync a folder and all folders below it, so that new names survive a power failure."""
    for root, _, _ in os.walk(folder):
        _sync_one(root)


def _sync_one(folder: Path | str) -> None:
    """Sync one folder without those below, of which the students' folder has many."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@dataclass(frozen=True, slots=True)
class Conditions:
    """Everything that a result depends on besides the submission."""

    grader: str
    rubrics: tuple[tuple[str, str], ...]  # exercise id and digest of its rubric, in grading order
    recording: str  # digest of the recordings that are played; empty if there are none
    options: GradingOptions  # their seed is that of the submission; None for a whole class in which each has its own
    variants: Drawn | None = None  # the student's variant values; None if nothing varies
    interfaces: str = ""  # digest of the interface packages of rubrics and class; empty if there are none

    def key(self, submission: str) -> str:
        """Return the cache key of a result, given the digest of the submission."""
        variants = None if self.variants is None else asdict(self.variants)
        whole = {"rubrics": self.rubrics, "recording": self.recording, "variants": variants}
        return self._digest(key_values(self.options) | whole, submission)

    def recorded(self, submission: str) -> str:
        """Return the key of the recordings of a submission: of all that they depend on besides the scenarios."""
        return self._digest(key_values(self.options, recordings=True), submission)

    def draws(self, submission: str) -> bool:
        """Return whether a submission is drawn for a spot check, given its digest."""
        return is_spot_checked(self.options.spot_checks, self.options.seed or 0, submission)

    def of_submission(self, seed: int | None, variants: Drawn | None) -> Conditions:
        """Return the conditions of one submission: with its own seed and variant."""
        return replace(self, options=replace(self.options, seed=seed), variants=variants)

    def _digest(self, depends_on: dict[str, Any], submission: str) -> str:
        depends_on |= {"grader": self.grader, "submission": submission, "interfaces": self.interfaces}
        # A changed share affects only submissions that are drawn with one share and not with the other.
        if self.draws(submission):
            depends_on["spot_check"] = True
        text = json.dumps(depends_on, sort_keys=True)
        return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def refused(label: str, conditions: Conditions, error: SubmissionError) -> ResultStatus:
    """Return the status of a submission that cannot be used."""
    digest = unusable_digest(error)
    return ResultStatus(State.REFUSED, conditions.key(digest), digest, label, error.message, error.hint)


def unusable_digest(error: GraderError) -> str:
    """Return a substitute digest for an unusable submission; it changes when the reason changes."""
    return f"unusable:{hashlib.sha256(error.message.encode('utf-8', 'surrogatepass')).hexdigest()}"
