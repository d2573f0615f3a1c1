"""What travels between the machines that share the grading of a class, as bytes that hold no code and name no place."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec

from grader.classroom.store import Conditions
from grader.core.errors import HarnessError
from grader.core.exercise import Drawn
from grader.reporting.delivery import write_whole
from grader.submissions.collected import Collected, objection

#: Most that one answer may hold, and most files in it.
MAX_ANSWER_BYTES = 512 << 20
MAX_ANSWER_FILES = 1_000

# Names of files are bytes: what a student calls a file need not be text.
Files = tuple[tuple[bytes, bytes], ...]
_Parcel = TypeVar("_Parcel", "Terms", "GradingJob", "JobResult", "Fitness", "_Reading")


@dataclass(frozen=True, slots=True)
class Terms:
    """What all submissions of a class are graded with.

    Attributes:
        conditions: What results depend on.
        exercises: Exercise ids to grade; empty for all of the rubrics.
        rubrics: Relative path and content of each rubric file; empty for the built-in ones.
        odom_bag: Relative path of an /odom recording; empty for the project's own.
        recording: Its files, by their paths from there; that of a recording of one file is empty.
        standalone: Whether each HTML report holds its scripts.
        deadline_s: Real time after which an attempt is given up.
        checks: Relative path and content of the rubrics' own files of checks.
    """

    conditions: Conditions
    exercises: tuple[str, ...]
    rubrics: Files
    odom_bag: bytes
    recording: Files
    standalone: bool
    deadline_s: float
    checks: Files = ()


@dataclass(frozen=True, slots=True)
class GradingJob:
    """One submission to grade.

    Attributes:
        name: Name of the entry.
        label: What the source calls it.
        path: What reports call it: a path from where the class is graded.
        collected: What was handed in; see `pack_collected`.
        variants: The values that are this student's own; None if nothing varies.
        seed: The seed of every drawn value; the key that it was made with does not travel.
    """

    name: str
    label: bytes
    path: bytes
    collected: bytes
    variants: Drawn | None = None
    seed: int | None = None


@dataclass(frozen=True, slots=True)
class JobResult:
    """What came of one submission.

    Attributes:
        machine: Who did it, for people.
        standing: How it stands, as it lies in a folder for results; empty if nothing was tried.
        files: The result: `report.json` and what belongs to it.
        unfit: Why this machine can grade nothing; empty if it can.
        hint: One thing to do about that.
    """

    machine: str
    standing: bytes = b""
    files: Files = ()
    unfit: str = ""
    hint: str = ""


@dataclass(frozen=True, slots=True)
class Fitness:
    """Whether a machine can grade.

    Attributes:
        machine: Which one, for people.
        unfit: Why it can grade nothing; empty if it can.
        hint: One thing to do about that.
        remarks: What an instructor must know of its sandbox.
    """

    machine: str
    unfit: str = ""
    hint: str = ""
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Reading:
    files: Files
    notes: tuple[bytes, ...]


def pack(parcel: Terms | GradingJob | JobResult | Fitness) -> bytes:
    """Return a parcel as bytes."""
    return msgspec.msgpack.encode(parcel)


def unpack(data: bytes, kind: type[_Parcel]) -> _Parcel:
    """Return what bytes hold; raises HarnessError if that is something else."""
    try:
        return msgspec.msgpack.decode(data, type=kind)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError, ValueError):
        raise HarnessError(f"{kind.__name__.lower()}: expected what a grader packs, found something else") from None


def pack_collected(collected: Collected) -> bytes:
    """Return what was read of a submission as bytes."""
    files = tuple((os.fsencode(name), content) for name, content in collected.files)
    return msgspec.msgpack.encode(_Reading(files, tuple(map(os.fsencode, collected.notes))))


def read_collected(data: bytes) -> Collected:
    """Return what was read of a submission; raises HarnessError if the bytes hold something else."""
    reading = unpack(data, _Reading)
    files = tuple((os.fsdecode(name), content) for name, content in reading.files)
    for name, _ in files:
        if os.path.isabs(name) or ".." in name.split("/"):  # noqa: PTH117  a name, perhaps no path of this system
            raise HarnessError("submission: expected names that stay inside, found one that does not")
    return Collected(files, tuple(map(os.fsdecode, reading.notes)))


def travelling_name(path: Path) -> bytes:
    """Return a path by which a file can be called elsewhere: what a person typed, or from here if it was absolute."""
    return os.fsencode(os.path.relpath(path) if path.is_absolute() else os.path.normpath(path))


def files_below(folder: Path) -> Files:
    """Return the plain files in a folder, by their relative paths and in order."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return tuple((os.fsencode(path.relative_to(folder)), path.read_bytes()) for path in paths)


def write_answer(files: Iterable[tuple[bytes, bytes]], into: Path, allowed: frozenset[str]) -> None:
    """Write the files of a result into a new folder.

    Args:
        files: Relative path and content.
        into: The folder, which is not there yet.
        allowed: Names of files and folders that a result consists of.

    Raises:
        HarnessError: There is a file that no result has.
        OSError: They cannot be written.
    """
    named = [(os.fsdecode(name), content) for name, content in files]
    if len(named) > MAX_ANSWER_FILES or any(objection(n) or n.split("/")[0] not in allowed for n, _ in named):
        raise HarnessError("answer: expected the files of a result, found others")
    into.mkdir()
    for name, content in named:
        (into / name).parent.mkdir(parents=True, exist_ok=True)
        write_whole(into / name, content)
