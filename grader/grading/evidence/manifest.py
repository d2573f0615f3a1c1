"""A folder of evidence and its manifest, with the submission, the software it was recorded with, and all digests."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import stat
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import MISSING, fields, is_dataclass, replace
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec

from grader.grading.model.report import Environment
from grader.runtime.files import replace_file
from grader.runtime.model.errors import EvidenceError
from grader.runtime.model.packages import BroughtPackage
from grader.runtime.model.projects import ExaminedPackage
from grader.runtime.model.scenario import Scenario
from grader.runtime.model.submission import Definition, StudentFile
from grader.runtime.stimuli import RecordedStream

#: Describes the run and lists its recordings; written last.
MANIFEST = "evidence.json"
#: The report that was made when the submission was graded.
REPORT = "report.json"
#: What recording the submission again has found; only where that was done.
VERIFICATION = "verification.json"
METADATA = "metadata.yaml"
_ID = "[a-z][a-z0-9_]{0,99}"
_OWN = re.compile(rf"{MANIFEST}|{REPORT}|{VERIFICATION}|({_ID})\.({_ID})/(?:\1\.\2_0\.mcap|{METADATA})")


def recording_name(exercise: str, scenario: str) -> str:
    """Return the path of a scenario's recording inside the folder; its folder is a rosbag2 recording."""
    return f"{exercise}.{scenario}/{exercise}.{scenario}_0.mcap"


def metadata_name(exercise: str, scenario: str) -> str:
    """Return the path of rosbag2's metadata file for a recording."""
    return f"{exercise}.{scenario}/{METADATA}"


def is_own(name: str) -> bool:
    """Return whether a path inside the folder is one that the grader writes."""
    return _OWN.fullmatch(name) is not None


def is_recording(folder: Path) -> bool:
    """Return whether a folder has the name and the content of a recording."""
    return is_own(f"{folder.name}/{METADATA}") and (folder / f"{folder.name}_0.mcap").is_file()


def refuse_foreign(folder: Path, names: Iterable[str], own: Iterable[str]) -> None:
    """Raise EvidenceError if writing would replace a file that the folder's manifest does not list as `own`."""
    known = set(own)
    for name in names:
        path = folder / name
        inner = path.parent
        if inner != folder and inner.is_symlink():
            raise EvidenceError(f"{inner}: expected a folder, found a link", "name another folder for the evidence")
        if os.path.lexists(path) and (name not in known or not stat.S_ISREG(path.lstat().st_mode)):
            message = f"{path}: expected nothing or kept evidence, found another file"
            raise EvidenceError(message, "name another folder for the evidence")


def write(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files, each atomically; raises EvidenceError if one cannot be written."""
    for name, data in files.items():
        path = folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(path, data)
        except OSError as error:
            raise EvidenceError(f"{path}: the evidence cannot be written: {error.strerror or error}") from error


def remove(folder: Path, names: Iterable[str]) -> None:
    """Remove files that the grader wrote, and folders that become empty."""
    for name in filter(is_own, names):
        with suppress(OSError):
            (folder / name).unlink()
        if "/" in name:
            with suppress(OSError):
                (folder / name).parent.rmdir()


def read_file(path: Path, most: int) -> bytes:
    """Read a regular file of at most `most` bytes without following links; raises EvidenceError for anything else."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        with os.fdopen(descriptor, "rb") as file:
            status = os.fstat(descriptor)
            if not stat.S_ISREG(status.st_mode):
                raise EvidenceError(f"{path}: expected a regular file, found something else")
            # one byte more than its size shows whether it grows; reading `most` bytes would allocate that much memory
            data = file.read(min(status.st_size, most) + 1)
    except OSError as error:
        found = "nothing there" if error.errno in (errno.ENOENT, errno.ENOTDIR) else (error.strerror or str(error))
        raise EvidenceError(f"{path}: expected a file of kept evidence, found {found}") from error
    if len(data) > most:
        raise EvidenceError(f"{path}: expected at most {most >> 20} MiB, found more")
    return data


FORMAT = "grader/evidence/v1"


class _Strict(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A mapping with fixed keys."""


class KeptSubmission(_Strict, frozen=True):
    """The submission; see `grader.runtime.model.submission.Submission`."""

    name: str
    digest: str
    files: tuple[StudentFile, ...]
    notes: tuple[str, ...]
    packages: tuple[ExaminedPackage, ...] = ()


class KeptRecording(_Strict, frozen=True):
    """One scenario's recording."""

    scenario: str
    asked: str  # digest of the scenario as the rubric described it
    # `sha256:` of the file; None if the scenario was not recorded because a student's file is missing
    digest: str | None = None
    at: int = 0  # offset of the packed trace in the file, in bytes
    size: int = 0  # size of the packed trace, in bytes


class KeptExercise(_Strict, frozen=True):
    """One exercise that was graded; `rubric` is the digest of its rubric at that time."""

    id: str
    rubric: str
    recordings: tuple[KeptRecording, ...]


class KeptRun(_Strict, frozen=True):
    """Data of this particular run: the path as typed, and the duration."""

    path: str
    seed: int
    duration_s: float
    notes: tuple[str, ...]
    recording: str
    request: dict[str, Any]


class KeptInterfaces(_Strict, frozen=True):
    """The interface packages that are not installed, and the definitions of the recorded message types among theirs."""

    packages: tuple[BroughtPackage, ...] = ()
    offered: str = ""  # digest of all packages of rubric and class, used or not
    definitions: dict[str, Definition] = {}


class Manifest(_Strict, frozen=True, omit_defaults=True):
    """Everything but the recordings; `files` lists what the grader wrote, `complete` is false while writing."""

    format: str
    complete: bool
    files: tuple[str, ...]
    submission: KeptSubmission
    run: KeptRun
    environment: Environment
    exercises: tuple[KeptExercise, ...]
    sources: dict[str, str]
    interfaces: KeptInterfaces = KeptInterfaces()


def dump_manifest(manifest: Manifest) -> bytes:
    """Convert a manifest to JSON; the same manifest gives the same bytes."""
    return json.dumps(msgspec.to_builtins(manifest), indent=1, allow_nan=False).encode() + b"\n"


def parse_manifest(data: bytes) -> Manifest:
    """Parse a manifest; raises EvidenceError if it is invalid, or has another version."""
    try:
        found = json.loads(data)
        version = found.get("format") if isinstance(found, dict) else None
        if version != FORMAT:
            what = f"the format {version[:40]}" if isinstance(version, str) else "none"
            raise EvidenceError(f"expected evidence of the format {FORMAT}, found {what}")
        return msgspec.convert(found, Manifest)
    except (ValueError, RecursionError) as error:
        raise EvidenceError(f"expected {FORMAT}, found something else ({type(error).__name__})") from error


def scenario_digest(scenario: Scenario) -> str:
    """Return a digest of everything that determines a recording; fields with default values are left out."""
    try:
        return _known_digest(scenario)
    except TypeError:  # one with fields of messages cannot be a key
        return _digest(scenario)


@lru_cache(maxsize=256)
def _known_digest(scenario: Scenario) -> str:
    return _digest(scenario)


def _digest(scenario: Scenario) -> str:
    return sha256(json.dumps(_plainly(scenario), sort_keys=True).encode())


def sha256(data: bytes) -> str:
    """Return the digest of bytes in the format of manifests."""
    return f"sha256:{hashlib.sha256(data).hexdigest()}"


def _plainly(value: Any) -> Any:
    if isinstance(value, RecordedStream):
        value = replace(value, bag="")  # a path; its messages have a digest of their own
    if is_dataclass(value):
        kept = {f.name: getattr(value, f.name) for f in fields(value)}
        defaults = {f.name: f.default for f in fields(value) if f.default is not MISSING}
        changed = {n: _plainly(v) for n, v in kept.items() if n not in defaults or v != defaults[n]}
        return {type(value).__name__: changed}
    if isinstance(value, Mapping):
        return {str(key): _plainly(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plainly(item) for item in value]
    if isinstance(value, bytes):  # the text of an author's simulation
        return sha256(value)
    return value.value if isinstance(value, Enum) else value
