"""The folder for results: each result appears whole or not at all, and a good one is never replaced by a worse one."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from enum import Enum
from pathlib import Path

import msgspec

from grader.app.spot_checks import is_drawn
from grader.core.errors import ClassError, GraderError, HarnessError
from grader.core.exercise import Drawn
from grader.core.limits import TIME_BUDGET_S
from grader.reporting.delivery import write_whole
from grader.reporting.escape import json_value

SCHEMA = "grader/batch-result/v1"


class State(str, Enum):
    """What an attempt at grading a submission came to; only the first two have a report."""

    GRADED = "graded"
    UNDECIDED = "undecided"  # a criterion was not decided, through no fault of the student
    REFUSED = "refused"  # the submission cannot be used: the student, or whoever named it, must act
    FAILED = "failed"  # the grader or the machine failed: never a mark

    @property
    def worth(self) -> int:
        """How good a result is: a worse one never replaces a better one."""
        return {State.FAILED: 0, State.UNDECIDED: 1, State.REFUSED: 2, State.GRADED: 2}[self]


@dataclass(frozen=True, slots=True)
class ResultStatus:
    """What became of one submission.

    Attributes:
        state: See State.
        key: What the result depends on; see `Conditions`.
        digest: Digest of what was handed in.
        label: What the source calls the submission.
        problem: Why there is no report, one line; empty if there is one.
        hint: One thing to do; may be empty.
        score: Points earned.
        max_score: Points to be had.
        duration_s: Wall time.
        usage: What it cost: `processor_s` and `peak_bytes`.
        schema: Version of this format.
    """

    state: State
    key: str
    digest: str
    label: str
    problem: str = ""
    hint: str = ""
    score: float = 0.0
    max_score: float = 0.0
    duration_s: float = 0.0
    usage: Mapping[str, float] = field(default_factory=dict)
    schema: str = SCHEMA


def dump(standing: ResultStatus) -> bytes:
    """Return a standing as JSON; what is no text in a name becomes a sign for that."""
    return json.dumps(json_value(asdict(standing)), indent=2).encode() + b"\n"


def load(data: bytes) -> ResultStatus | None:
    """Return a standing; None if the data is none of this version."""
    try:
        standing = msgspec.json.decode(data, type=ResultStatus)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
        return None
    return standing if standing.schema == SCHEMA else None


RESULT, ATTEMPT = "result.json", "attempt.json"
#: The key of the class, which only its owner can read; of all that is handed on, nothing holds it.
SEED_KEY = ".seed.key"
_FRESH, _OLD = ".new", ".old"
_PENDING = ".pending.json"


@dataclass(frozen=True, slots=True)
class Kept:
    """What lies in the folder for one submission.

    Attributes:
        result: The best result so far; None if there is none.
        attempt: A later attempt that came to less, so that it did not replace the result; None if there was none.
    """

    result: ResultStatus | None = None
    attempt: ResultStatus | None = None

    @property
    def last(self) -> ResultStatus | None:
        """What was tried last."""
        return self.attempt or self.result


class Store:
    """The results of a class in a folder; at most one process uses it.

    Args:
        folder: Where they lie.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._students = folder / "students"

    def place(self, name: str) -> Path:
        """Return the folder of one submission's result."""
        return self._students / name

    def fresh(self, name: str) -> Path:
        """Return an empty place for a new result, on the same disk as the old one; it is not there yet."""
        return self._students / f".{name}.{secrets.token_hex(4)}{_FRESH}"

    def kept(self, name: str) -> Kept:
        """Return what lies there for a submission."""
        return Kept(_read(self.place(name) / RESULT), _read(self.place(name) / ATTEMPT))

    def names(self) -> list[str]:
        """Return the names of all results, in order."""
        return sorted(path.name for path in self._students.iterdir() if (path / RESULT).is_file())

    def commit(self, name: str, fresh: Path, standing: ResultStatus) -> bool:
        """Take in a new result; return whether it is the result now.

        Args:
            name: Name of the submission.
            fresh: Folder that holds the new result, complete but for `standing`; it is gone afterwards.
            standing: What the attempt came to.

        Raises:
            HarnessError: It cannot be written; what was there before still is.
        """
        place = self.place(name)
        try:
            before = self.kept(name).result
            if before is not None and before.state.worth > standing.state.worth:
                write_whole(place / ATTEMPT, dump(standing))
                shutil.rmtree(fresh, ignore_errors=True)
                return False
            fresh.mkdir(exist_ok=True)
            write_whole(fresh / RESULT, dump(standing))
            _sync(fresh)
            self._swap(fresh, place)
        except OSError as error:
            shutil.rmtree(fresh, ignore_errors=True)
            why = f"{place}: the result cannot be written: {error.strerror}"
            raise HarnessError(why, "free some space; the same command goes on where it was") from None
        return True

    def write(self, name: str, data: bytes) -> Path:
        """Write a file for the whole class, and return where; raises HarnessError if that cannot be done."""
        path = self.folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, data)
        except OSError as error:
            raise HarnessError(f"{path}: cannot be written: {error.strerror}", "free some space") from None
        return path

    def pending(self, rerun: str) -> frozenset[str] | None:
        """Return the names that a stopped run was still to grade again; None if there was no such run."""
        try:
            noted = json.loads((self.folder / _PENDING).read_bytes())
            return frozenset(map(str, noted["names"])) if noted["rerun"] == rerun else None
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None

    def note_pending(self, rerun: str, names: Iterable[str]) -> None:
        """Note what a run is still to grade again, so that the same command goes on where it was stopped."""
        left = sorted(names)
        if left:
            self.write(_PENDING, json.dumps({"rerun": rerun, "names": left}).encode())
        else:
            (self.folder / _PENDING).unlink(missing_ok=True)

    def _swap(self, fresh: Path, place: Path) -> None:
        """Put a folder in the place of another; whenever the machine stops, one of the two is found again."""
        old = self._students / f".{place.name}{_OLD}"
        if place.exists():
            shutil.rmtree(old, ignore_errors=True)
            place.rename(old)
        fresh.rename(place)
        _sync_one(self._students)
        shutil.rmtree(old, ignore_errors=True)

    def recover(self) -> None:
        """Mend what a killed run left behind: put back results that were being replaced, remove unfinished ones."""
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
        """Room that is left for results."""
        return shutil.disk_usage(self.folder).free


@contextmanager
def open_store(folder: Path) -> Iterator[Store]:
    """Open the folder for results, and keep others from writing into it.

    Raises:
        ClassError: It cannot be used, or another process grades into it.
    """
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
        with suppress(OSError):  # what stopped the run says more
            store.recover()
        raise
    finally:
        os.close(lock)


def _read(path: Path) -> ResultStatus | None:
    with suppress(OSError):
        return load(path.read_bytes())
    return None


def _sync(folder: Path) -> None:
    """Make the names in a folder, and below it, survive a power failure."""
    for root, _, _ in os.walk(folder):
        _sync_one(root)


def _sync_one(folder: Path | str) -> None:
    """Make the names in one folder survive, without those below: in the folder of all students they are many."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@dataclass(frozen=True, slots=True)
class Conditions:
    """All that a class is graded with, besides what the students handed in.

    Attributes:
        grader: Version of the grader.
        rubrics: Exercise id and digest of its rubric, in the order graded.
        recording: Digest of the /odom recording; empty if none is played.
        seed: The seed of every drawn value; None in what a whole class is graded with, if each submission has its own.
        clock: The clock that was asked for.
        isolation: The sandbox that was asked for.
        time_budget_s: Real time that all recordings of a submission may take together.
        every: Whether only exercises count of which a submission has a file.
        variants: The values that are this student's own; None if nothing varies.
        spot_checks: Share of the class that is drawn to be checked on the wall clock, from 0 to 1.
    """

    grader: str
    rubrics: tuple[tuple[str, str], ...]
    recording: str
    seed: int | None
    clock: str
    isolation: str
    every: bool = False
    variants: Drawn | None = None
    time_budget_s: float = TIME_BUDGET_S
    spot_checks: float = 0.0

    def key(self, submission: str) -> str:
        """Return the key of the result of a submission, by its digest."""
        depends_on = {**asdict(self), "submission": submission}
        # Only who is drawn with one share and not with another is graded again.
        if is_drawn(depends_on.pop("spot_checks"), self.seed or 0, submission):
            depends_on["spot_check"] = True
        text = json.dumps(depends_on, sort_keys=True)
        return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def unusable_digest(error: GraderError) -> str:
    """Return what stands for the digest of a submission that cannot be used: it is new when the reason is."""
    return f"unusable:{hashlib.sha256(error.message.encode('utf-8', 'surrogatepass')).hexdigest()}"
