"""Messages between the machines that grade a class together, as bytes without code and without absolute paths."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from grader.course.classroom.store import Conditions
from grader.grading.model.exercise import Drawn
from grader.grading.submissions.collected import Collected, name_problem
from grader.runtime.files import write_whole
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError

#: Largest size of an answer, and most files in it.
MAX_ANSWER_BYTES = 512 << 20
MAX_ANSWER_FILES = 1_000

# File names are bytes, because a student's file name need not be valid text.
Files = tuple[tuple[bytes, bytes], ...]
_Message = TypeVar("_Message", "Terms", "GradingJob", "JobResult", "Fitness", "Parcel", "_Reading")


@dataclass(frozen=True, slots=True)
class Terms:
    """What all submissions of a class are graded with."""

    conditions: Conditions  # what the results depend on; the paths in their options are relative
    files: Files  # relative path and content of each file that the options name, or that rubrics bring
    standalone: bool  # whether each HTML report includes its scripts
    deadline_s: float  # real time after which an attempt is killed


@dataclass(frozen=True, slots=True)
class GradingJob:
    """One submission to grade."""

    name: str  # name of the entry
    label: bytes  # its name in the source
    path: bytes  # its path in reports, relative to where the class is graded
    collected: bytes  # the submission; see `pack_collected`
    variants: Drawn | None = None  # the student's variant values; None if nothing varies
    seed: int | None = None  # seed of all drawn values; the seed key itself is never sent


@dataclass(frozen=True, slots=True)
class Parcel:
    """One submission with all that another machine needs to grade it."""

    version: str  # of the grader that asks
    terms: bytes  # packed `Terms`
    job: bytes  # packed `GradingJob`


@dataclass(frozen=True, slots=True)
class JobResult:
    """The result of one submission."""

    machine: str  # the machine that graded it, for people
    status: bytes = b""  # the status as stored in a results folder; empty if nothing was tried
    files: Files = ()  # the result files, such as `report.json`
    unfit: str = ""  # why this machine cannot grade; empty if it can
    hint: str = ""  # what to do about that


@dataclass(frozen=True, slots=True)
class Fitness:
    """Whether a machine can grade."""

    machine: str  # the machine, for people
    unfit: str = ""  # why it cannot grade; empty if it can
    hint: str = ""  # what to do about that
    remarks: tuple[str, ...] = ()  # warnings about its sandbox for the instructor


@dataclass(frozen=True, slots=True)
class _Reading:
    files: Files
    notes: tuple[bytes, ...]
    too_large: tuple[bytes, ...] = ()


def pack_message(message: Terms | GradingJob | JobResult | Fitness | Parcel) -> bytes:
    """Encode a message."""
    return msgspec.msgpack.encode(message, enc_hook=os.fsencode)  # a path, which need not be valid text


def unpack_message(data: bytes, kind: type[_Message]) -> _Message:
    """Decode a message; raises HarnessError for anything else."""
    try:
        return msgspec.msgpack.decode(data, type=kind, dec_hook=_path)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError, ValueError):
        raise HarnessError(f"{kind.__name__.lower()}: expected what a grader packs, found something else") from None


def _path(kind: type[Any], value: Any) -> Any:
    if kind is not Path or not isinstance(value, bytes):
        raise ValueError(kind)
    return Path(os.fsdecode(value))


def pack_collected(collected: Collected) -> bytes:
    """Encode the files of a submission."""
    files = tuple((os.fsencode(name), content) for name, content in collected.files)
    notes, too_large = (tuple(map(os.fsencode, names)) for names in (collected.notes, collected.too_large))
    return msgspec.msgpack.encode(_Reading(files, notes, too_large))


def read_collected(data: bytes) -> Collected:
    """Decode the files of a submission; raises HarnessError for anything else."""
    reading = unpack_message(data, _Reading)
    files = tuple((os.fsdecode(name), content) for name, content in reading.files)
    for name, _ in files:
        if os.path.isabs(name) or ".." in name.split("/"):  # noqa: PTH117  a name from elsewhere, not a path here
            raise HarnessError("submission: expected names that stay inside, found one that does not")
    return Collected(files, tuple(map(os.fsdecode, reading.notes)), tuple(map(os.fsdecode, reading.too_large)))


def travelling_name(path: Path) -> bytes:
    """Return a path's name on other machines: as typed, or relative to the current directory if it was absolute."""
    return os.fsencode(os.path.relpath(path) if path.is_absolute() else os.path.normpath(path))


def plain_files(folder: Path) -> Files:
    """Read the plain files in a folder, ordered by their relative paths."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return tuple((os.fsencode(path.relative_to(folder)), path.read_bytes()) for path in paths)


def write_answer(files: Iterable[tuple[bytes, bytes]], into: Path, allowed: frozenset[str]) -> None:
    """Write the files of a result into a new folder; raises HarnessError for a file that is not allowed."""
    named = [(os.fsdecode(name), content) for name, content in files]
    if len(named) > MAX_ANSWER_FILES or any(name_problem(n) or n.split("/")[0] not in allowed for n, _ in named):
        raise HarnessError("answer: expected the files of a result, found others")
    into.mkdir()
    for name, content in named:
        (into / name).parent.mkdir(parents=True, exist_ok=True)
        write_whole(into / name, content)
