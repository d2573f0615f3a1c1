"""A folder of evidence: which files are the grader's own, how they are written and read, and nobody else's touched."""

from __future__ import annotations

import errno
import os
import re
import secrets
import stat
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from grader.model.errors import EvidenceError

#: What the run was and which recordings belong to it; written last.
MANIFEST = "evidence.json"
#: The report that was made of the recordings at first.
REPORT = "report.json"
METADATA = "metadata.yaml"
_ID = "[a-z][a-z0-9_]{0,99}"
_OWN = re.compile(rf"{MANIFEST}|{REPORT}|({_ID})\.({_ID})/(?:\1\.\2_0\.mcap|{METADATA})")


def recording_name(exercise: str, scenario: str) -> str:
    """Return the path of a scenario's recording inside the folder; its folder is a rosbag2 recording."""
    return f"{exercise}.{scenario}/{exercise}.{scenario}_0.mcap"


def metadata_name(exercise: str, scenario: str) -> str:
    """Return the path of what rosbag2 wants beside the recording."""
    return f"{exercise}.{scenario}/{METADATA}"


def is_own(name: str) -> bool:
    """Return whether a path inside the folder is one that the grader writes."""
    return _OWN.fullmatch(name) is not None


def is_recording(folder: Path) -> bool:
    """Return whether a folder is named as that of a recording is, and holds one."""
    return is_own(f"{folder.name}/{METADATA}") and (folder / f"{folder.name}_0.mcap").is_file()


def refuse_foreign(folder: Path, names: Iterable[str], own: Iterable[str]) -> None:
    """Raise EvidenceError if a file would be replaced that is not the grader's own.

    Args:
        folder: Where evidence is to be kept; need not exist.
        names: What is to be written into it.
        own: What a manifest in it says is the grader's.
    """
    known = set(own)
    for name in names:
        path = folder / name
        inner = path.parent
        if inner != folder and inner.is_symlink():
            raise EvidenceError(f"{inner}: expected a folder, found a link", "name another folder for the evidence")
        if os.path.lexists(path) and (name not in known or not stat.S_ISREG(path.lstat().st_mode)):
            message = f"{path}: expected nothing or evidence kept before, found a file of somebody else"
            raise EvidenceError(message, "name another folder for the evidence")


def write(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files, each whole or not at all.

    Raises:
        EvidenceError: One cannot be written.
    """
    for name, data in files.items():
        path = folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            _write_whole(path, data)
        except OSError as error:
            raise EvidenceError(f"{path}: the evidence cannot be written: {error.strerror or error}") from error


def remove(folder: Path, names: Iterable[str]) -> None:
    """Remove files of the grader's own, and the folders that they leave empty."""
    for name in filter(is_own, names):
        with suppress(OSError):
            (folder / name).unlink()
        if "/" in name:
            with suppress(OSError):
                (folder / name).parent.rmdir()


def read(path: Path, most: int) -> bytes:
    """Return the bytes of a plain file; links are not followed.

    Raises:
        EvidenceError: It is not there, is no plain file, cannot be read or is longer than `most` bytes.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        with os.fdopen(descriptor, "rb") as file:
            status = os.fstat(descriptor)
            if not stat.S_ISREG(status.st_mode):
                raise EvidenceError(f"{path}: expected a file, found something that is no plain one")
            # one byte more than there is tells whether it grows; to ask for `most` sets memory aside for all of it
            data = file.read(min(status.st_size, most) + 1)
    except OSError as error:
        found = "nothing there" if error.errno in (errno.ENOENT, errno.ENOTDIR) else (error.strerror or str(error))
        raise EvidenceError(f"{path}: expected a file of kept evidence, found {found}") from error
    if len(data) > most:
        raise EvidenceError(f"{path}: expected at most {most >> 20} MiB, found more")
    return data


def _write_whole(path: Path, data: bytes) -> None:
    fresh = path.parent / f".grade-{secrets.token_hex(8)}.tmp"
    descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
    except BaseException:
        with suppress(OSError):
            fresh.unlink()
        raise
