"""Reads .rar and .7z archives through libarchive, an optional extra, in a process with strict limits."""

from __future__ import annotations

import ctypes.util
import importlib.util
import json
import struct
import subprocess
import tempfile
from collections.abc import Iterator
from functools import partial
from typing import BinaryIO

from grader.grading.submissions.members import FEWER, FILE, FOLDER, LINK, Member, UnusableArchiveError
from grader.runtime.contained import REAL_S, run_contained
from grader.runtime.model import extras
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError

#: Kind of archive -> names of the format in libarchive, and the first bytes that tell them apart.
_FORMATS = {"7z": ("7zip", b""), "rar": ("rar5", b"Rar!\x1a\x07\x01"), "old rar": ("rar", b"Rar!\x1a\x07\x00")}
#: The kinds, as `archive_kind` names them.
KINDS = ("7z", "rar")

#: Limits of the process that unpacks: memory in bytes, processor time in seconds.
MEMORY_BYTES = 768 << 20
#: 50 MiB, the most that a submission may have, unpack in a few seconds.
PROCESSOR_S = 60
_KINDS = {"file": FILE, "folder": FOLDER, "link": LINK, "other": "a device, pipe or other special file"}
# The exit codes of grader.grading.submissions.unpacker, which is not imported, because only its process needs the
# sandbox.
_ENCRYPTED, _TOO_MANY, _TOO_MUCH, _NO_LIBRARY = 11, 12, 13, 14


@dataclass(frozen=True, slots=True)
class UnpackerLimits:
    """What the process that unpacks may produce and use."""

    entries: int  # the largest number of members
    file_bytes: int  # members of more bytes than this are not read; they are returned with their size
    total_bytes: int  # the most bytes to unpack, of all members together
    words: str  # the same in words
    memory_bytes: int = MEMORY_BYTES
    processor_s: int = PROCESSOR_S
    real_s: float = REAL_S


def libarchive_commands() -> str:
    """Return the commands that install libarchive here."""
    return f"{extras.install_command('libarchive-c')} && sudo apt-get install -y libarchive13"


def has_libarchive() -> bool:
    """Return whether the Python package and the C library are there."""
    return importlib.util.find_spec("libarchive") is not None and ctypes.util.find_library("archive") is not None


def foreign_members(data: bytes, kind: str, limits: UnpackerLimits) -> list[Member]:
    """Return the members of a .rar or .7z archive in order.

    Args:
        data: The archive.
        kind: One of `KINDS`.
        limits: What the process that unpacks may produce and use.

    Raises:
        UnusableArchiveError: It is damaged, encrypted, has features that libarchive cannot read, or exceeds a limit.
        HarnessError: The process cannot be started, or libarchive is not installed.
    """
    format_, magic = _FORMATS[kind]
    if not data.startswith(magic):
        format_ = _FORMATS["old rar"][0]
    # libarchive takes the end of the file for the end of a rar, and so a part of it for the whole.
    if kind == "rar" and not _has_end(data, is_old=format_ != _FORMATS["rar"][0]):
        raise _unreadable(kind)
    # Beside the content, each member has a head, whose name is at most as long as the archive.
    output = limits.total_bytes + 2 * len(data) + limits.entries * 1024
    told = {
        "format": format_,
        "entries": limits.entries,
        "file": limits.file_bytes,
        "total": limits.total_bytes,
        "memory": limits.memory_bytes,
        "processor": limits.processor_s,
        "output": output,
    }
    with tempfile.TemporaryFile() as archive, tempfile.TemporaryFile() as out:
        archive.write(data)
        archive.seek(0)
        code = _run(told, archive, out, limits.real_s)
        _check(code, kind, limits)
        out.seek(0)
        found = out.read(output)
    try:
        return list(_members(found, limits.file_bytes))
    except (ValueError, KeyError, TypeError, struct.error, RecursionError):
        raise _unreadable(kind) from None


def _has_end(data: bytes, *, is_old: bool) -> bool:
    """Return whether the blocks of a rar lead to the block that ends it, or to encrypted ones.

    Raises UnusableArchiveError for a file that is stored as a reference to another one: for those that are not links,
    libarchive makes empty files.

    See "RAR 5.0 archive format" by its author, and technote.txt of older versions.
    """
    at = _OLD_START if is_old else _START
    try:
        while at < len(data):
            kind, following = (_old_block if is_old else _block)(data, at)
            if kind in (_OLD_ENDS if is_old else _ENDS):
                return following <= len(data)
            if not is_old and kind == _FILE_BLOCK and _redirections(data, at) - _LINKS:
                raise UnusableArchiveError("expected plain files, found a reference to another file in the archive")
            at = following
    except (IndexError, struct.error):
        pass
    return False


_START, _ENDS = 8, (4, 5)  # encryption, end of the archive
_FILE_BLOCK = 2
#: The record of a redirection in the extra area of a file, and its kinds that libarchive reports as links: a Unix link,
#: a Windows link, a hard link. The others are a junction and a copy of a file.
_REDIRECTION, _LINKS = 5, {1, 2, 4}
_OLD_START, _OLD_ENDS = 7, (0x7B,)


def _block(data: bytes, at: int) -> tuple[int, int]:
    """Return the kind of a block and where the next one begins."""
    size, start = _vint(data, at + 4)
    kind, flags_at = _vint(data, start)
    flags, more = _vint(data, flags_at)
    if flags & 1:  # an extra area, which is a part of the head
        _, more = _vint(data, more)
    content = _vint(data, more)[0] if flags & 2 else 0
    return kind, start + size + content


def _redirections(data: bytes, at: int) -> set[int]:
    """Return the kinds of redirections in the extra area of a block, which is the end of its head."""
    size, start = _vint(data, at + 4)
    _, flags_at = _vint(data, start)
    flags, more = _vint(data, flags_at)
    if not flags & 1:
        return set()
    extra, _ = _vint(data, more)
    end = start + size
    here = end - extra
    found = set()
    while here < end:
        length, record = _vint(data, here)
        kind, inner = _vint(data, record)
        if kind == _REDIRECTION:
            found.add(_vint(data, inner)[0])
        here = record + length
    return found


def _old_block(data: bytes, at: int) -> tuple[int, int]:
    kind, flags, size = struct.unpack_from("<BHH", data, at + 2)
    content = struct.unpack_from("<I", data, at + 7)[0] if flags & 0x8000 else 0
    return kind, at + max(size, 7) + content


def _vint(data: bytes, at: int) -> tuple[int, int]:
    """Return a number, of which each byte has seven bits, the lowest first, and where it ends."""
    number = 0
    for k in range(10):
        number |= (data[at + k] & 0x7F) << (7 * k)
        if not data[at + k] & 0x80:
            return number, at + k + 1
    raise IndexError


def _run(told: dict[str, object], archive: BinaryIO, out: BinaryIO, real_s: float) -> int:
    try:
        return run_contained("grader.grading.submissions.unpacker", told, archive, out, real_s, installed=True)
    except subprocess.TimeoutExpired:
        return -1
    except OSError as error:
        raise HarnessError(f"the archive cannot be unpacked: {error.strerror}", "free some memory") from None


def _check(code: int, kind: str, limits: UnpackerLimits) -> None:
    if code == _ENCRYPTED:
        raise UnusableArchiveError("expected an archive without a password, found an encrypted one")
    if code == _TOO_MANY:
        raise UnusableArchiveError(f"expected at most {limits.entries} entries, found more", FEWER)
    if code == _TOO_MUCH:
        raise UnusableArchiveError(f"expected at most {limits.words}, found more", FEWER)
    if code == _NO_LIBRARY:
        raise HarnessError(f"a {kind} archive cannot be unpacked: libarchive cannot be loaded", libarchive_commands())
    if code:  # damaged, or killed at a limit of memory or time
        raise _unreadable(kind)


def _unreadable(kind: str) -> UnusableArchiveError:
    return UnusableArchiveError(f"expected a whole {kind} archive, found a damaged, incomplete or unusual one")


def _members(data: bytes, file: int) -> Iterator[Member]:
    """Read the members that the process wrote; the process is not trusted either."""
    at = 0
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        head = json.loads(data[at + 4 : at + 4 + length])
        at += 4 + length
        name, kind, size, sent = str(head["name"]), _KINDS[head["kind"]], int(head["size"]), int(head["sent"])
        content = data[at : at + sent]
        declared = head["declared"]
        if not 0 <= sent == len(content) or (size != sent and size <= file):
            raise ValueError("another size")
        # A file without a size is one that libarchive has not understood; it would be empty.
        if kind == FILE and (declared is None or int(declared) != size):
            raise ValueError("another size than the archive declares")
        at += sent
        name = name.replace("\\", "/")  # archives made on Windows
        yield Member(name.rstrip("/") or name, kind, size, partial(_first, content))


def _first(content: bytes, most: int) -> bytes:
    return content[:most]
