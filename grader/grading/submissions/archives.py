"""Unpacks archives in memory, within limits and by strict rules; nothing is written."""

from __future__ import annotations

import bz2
import contextlib
import io
import lzma
import re
import stat
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

from grader.grading.submissions.collected import (
    ARCHIVE_SUFFIXES,
    USUAL,
    Collected,
    LeftOut,
    SubmissionLimits,
    collisions,
    folders_of,
    generated_folders,
    is_gradable,
    is_skipped,
    may_be_left_out,
    name_problem,
)
from grader.grading.submissions.foreign_archives import KINDS, UnpackerLimits, foreign_members, has_libarchive
from grader.grading.submissions.members import FEWER, FILE, FOLDER, LINK, REPACK, Member, UnusableArchiveError
from grader.runtime.model.errors import SubmissionError
from grader.runtime.model.limits import (
    MAX_EXTENDED_BYTES,
    MAX_RATIO,
    MAX_STREAMS,
    MAX_UNPACKED_BYTES,
    MAX_XZ_BYTES,
    RATIO_FREE_BYTES,
)
from grader.runtime.model.wording import printable

__all__ = [
    "ARCHIVE_SUFFIXES",
    "FILE",
    "FOLDER",
    "HAND_IN_ZIP",
    "HEAD_BYTES",
    "Member",
    "UnusableArchiveError",
    "archive_kind",
    "collect_archive",
    "is_tar",
    "tar_members",
    "unpacked",
    "zip_members",
]

HAND_IN_ZIP = "pack the folder with your .py files as a zip"

BLOCK = 512


_ENCODING, _ERRORS = "utf-8", "surrogateescape"
_PAX = (tarfile.XHDTYPE, tarfile.XGLTYPE, tarfile.SOLARIS_XHDTYPE)
_EXTENDED = (*_PAX, tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK)
# In older versions of Python, tarfile needs quadratic time for such a run.
_MANY_DIGITS = re.compile(rb"[0-9]{40}")
_KINDS = {tarfile.LNKTYPE: LINK, tarfile.SYMTYPE: LINK, tarfile.DIRTYPE: FOLDER}


class _Stream(Protocol):
    @property
    def eof(self) -> bool: ...

    @property
    def unused_data(self) -> bytes: ...

    def decompress(self, data: bytes, max_length: int, /) -> bytes: ...


_STREAMS: dict[str, Callable[[], _Stream]] = {
    "gzip": lambda: zlib.decompressobj(wbits=31),
    "bzip2": bz2.BZ2Decompressor,
    "xz": lambda: lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=MAX_XZ_BYTES),
}


def is_tar(head: bytes) -> bool:
    """Return whether data begins with a tar header, which contains a checksum of itself."""
    try:
        tarfile.TarInfo.frombuf(head[:BLOCK], _ENCODING, _ERRORS)
    except tarfile.HeaderError:
        return False
    return True


def unpacked(data: bytes, compression: str, *, most: int, limit: str) -> bytes:
    """Return the decompressed data; raises UnusableArchiveError if it is damaged, cut off or too large.

    Nothing is decompressed beyond `most` bytes, which is `limit` in words.
    """
    whole = bytearray()
    for _ in range(MAX_STREAMS):
        stream = _STREAMS[compression]()
        try:
            whole += stream.decompress(data, most - len(whole) + 1)
        except (zlib.error, OSError, lzma.LZMAError, EOFError, ValueError):
            raise _damaged("tar") from None
        if len(whole) > most:
            raise UnusableArchiveError(f"expected at most {limit}, found more", FEWER)
        if not stream.eof:
            raise _damaged("tar")
        data = stream.unused_data.lstrip(b"\0")
        if not data:
            return bytes(whole)
    raise UnusableArchiveError(f"expected at most {MAX_STREAMS} compressed parts, found more")


def tar_members(data: bytes, *, most: int) -> list[Member]:
    """Return the members of an uncompressed tar archive in order; raises UnusableArchiveError for more than `most`."""
    places = _places(data, most)
    try:
        with tarfile.open(fileobj=io.BytesIO(data), mode="r:", encoding=_ENCODING, errors=_ERRORS) as archive:
            found = archive.getmembers()
    except (tarfile.TarError, ValueError, OSError, EOFError, OverflowError):
        raise _damaged("tar") from None
    return [_tar_member(data, info, places) for info in found]


def _tar_member(data: bytes, info: tarfile.TarInfo, places: set[tuple[int, int]]) -> Member:
    if not info.isreg():
        kind = _KINDS.get(info.type, "a device, pipe or other special file")
        return Member(info.name, kind, 0, lambda most: b"")  # noqa: ARG005 - there is nothing to read
    # An extended header can move and enlarge a member; then the two readings of the archive differ.
    if info.issparse() or (info.offset_data, info.size) not in places:
        raise _unusual()
    start, size = info.offset_data, info.size
    return Member(info.name, FILE, size, lambda most: data[start : start + min(size, most)])


def _places(data: bytes, most: int) -> set[tuple[int, int]]:
    """Return offset and size of each member's content, read from the headers; tarfile trusts these values."""
    places: set[tuple[int, int]] = set()
    at = headers = 0
    while True:
        block = data[at : at + BLOCK]
        if len(block) < BLOCK:
            raise _damaged("tar")
        if not any(block):
            return places
        headers += 1
        if headers > 3 * most:  # a member may have two extended headers
            raise _too_many(most, "entries")
        at += BLOCK
        size = _size(block)
        if at + size > len(data):
            raise _damaged("tar")
        kind = block[156:157]
        if kind in _PAX:
            _check_pax(data[at : at + size])
        elif kind not in _EXTENDED:
            places.add((at, size))
        at += -(-size // BLOCK) * BLOCK


def _size(block: bytes) -> int:
    try:
        info = tarfile.TarInfo.frombuf(block, _ENCODING, _ERRORS)
    except (tarfile.HeaderError, ValueError):
        raise _damaged("tar") from None
    if info.type == tarfile.GNUTYPE_SPARSE or info.size < 0:
        raise _unusual()
    if info.type in _EXTENDED and info.size > MAX_EXTENDED_BYTES:
        raise _unusual()
    carries = info.type in _EXTENDED or info.isreg() or info.type not in tarfile.SUPPORTED_TYPES
    return info.size if carries else 0


def _check_pax(header: bytes) -> None:
    """Reject records that are not exactly `LENGTH KEY=VALUE` and a line break, and those about sparse files."""
    if b"GNU.sparse" in header or _MANY_DIGITS.search(header):
        raise _unusual()
    at = 0
    while at < len(header):
        length = header[at : at + 8].partition(b" ")[0]
        record = header[at : at + int(length)] if length.isdigit() else b""
        if not record.endswith(b"\n") or b"=" not in record or len(record) != int(length):
            raise _damaged("tar")
        at += len(record)


def _damaged(kind: str) -> UnusableArchiveError:
    return UnusableArchiveError(f"expected a whole {kind} archive, found a damaged or incomplete one")


def _too_many(most: int, what: str) -> UnusableArchiveError:
    return UnusableArchiveError(f"expected at most {most} {what}, found more", FEWER)


def _unusual() -> UnusableArchiveError:
    return UnusableArchiveError("expected a tar archive of plain files, found a feature that is not supported")


_DIRECTORY_ENTRY = b"PK\x01\x02"
_ENCRYPTED = 0x1 | 0x40 | 0x2000  # with a password, with strong encryption, with an encrypted directory
_NAMED_IN_UTF8 = 0x800
#: What compressors write for nothing, in bytes, is shorter.
_EMPTY_BYTES = 16
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
# Exceptions of zipfile and zlib for damaged archives.
_DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, ValueError, NotImplementedError, KeyError)


def zip_members(data: bytes, *, most: int) -> list[Member]:
    """Return the members of a zip archive in its order; raises UnusableArchiveError if it is damaged or unusual."""
    # Checked before zipfile creates an object for each member: a few megabytes could become gigabytes.
    if data.count(_DIRECTORY_ENTRY) > most:
        raise _too_many(most, "entries")
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except _DAMAGE:
        raise _damaged("zip") from None
    # Unpacking members that share their bytes could take hours, however small the result.
    if sum(info.compress_size for info in archive.infolist()) > len(data):
        raise _damaged("zip")
    return [_zip_member(archive, info) for info in archive.infolist()]


def _zip_member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> Member:
    if info.flag_bits & _ENCRYPTED:
        raise UnusableArchiveError("expected an archive without a password, found an encrypted one")
    hidden = info.file_size if _kind(info, _name(info)) == FOLDER else 0 if info.file_size else info.compress_size
    if hidden > _EMPTY_BYTES:  # content of a folder, or of a file that is said to be empty
        raise _damaged("zip")
    if info.compress_type not in _COMPRESSIONS:
        found = f"method {info.compress_type}"
        raise UnusableArchiveError(f"expected a zip with the usual compression (deflate), found {found}")

    def read(most: int) -> bytes:
        try:
            with archive.open(info) as file:
                return file.read(most)
        except _DAMAGE:
            raise _damaged("zip") from None

    name = _name(info)
    return Member(name.rstrip("/") or name, _kind(info, name), info.file_size, read)


def _name(info: zipfile.ZipInfo) -> str:
    """Return a member's full name; zipfile would cut it at a NUL."""
    name = info.orig_filename
    if not info.flag_bits & _NAMED_IN_UTF8:
        # macOS writes UTF-8 without setting the flag.
        with contextlib.suppress(UnicodeError):
            name = name.encode("cp437").decode("utf-8")
    return name.replace("\\", "/")  # the separator of old Windows programs


def _kind(info: zipfile.ZipInfo, name: str) -> str:
    mode = info.external_attr >> 16
    if stat.S_ISLNK(mode):
        return LINK
    if stat.S_IFMT(mode) and not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        return "a device, pipe or socket"
    return FOLDER if name.endswith("/") else FILE


_RATIO = f"{MAX_RATIO} times the size of the archive"

#: Number of leading bytes that identify the kind of an archive.
HEAD_BYTES = BLOCK

_MAGIC = {
    b"PK\x03\x04": "zip",
    b"PK\x05\x06": "zip",
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ\x00": "xz",
    b"PK\x07\x08": "split zip",
    b"7z\xbc\xaf\x27\x1c": "7z",
    b"Rar!\x1a\x07": "rar",
    b"\x28\xb5\x2f\xfd": "zstd",
    b"LZIP": "lzip",
}
#: The kinds that can be read.
_READABLE = ("zip", "tar", "gzip", "bzip2", "xz")


def archive_kind(head: bytes) -> str | None:
    """Return the kind of archive or compressed file that begins with these bytes, at most `HEAD_BYTES`, or None."""
    for magic, kind in _MAGIC.items():
        if head.startswith(magic):
            return kind
    return "tar" if is_tar(head) else None


def collect_archive(data: bytes, *, where: str, limits: SubmissionLimits = USUAL) -> Collected:
    """Return the files of an archive; the same files are skipped as in a folder, so packing changes no result.

    Raises:
        SubmissionError: It cannot be read, exceeds a limit, or holds a link, a device, or a name that some system could
            not store or would store elsewhere.
    """
    if len(data) > limits.packed_bytes:
        raise SubmissionError(f"{where}: expected at most {limits.packed_bytes >> 20} MiB, found more", FEWER)
    try:
        left = LeftOut()
        members = _without_generated(_wanted(_members(data, limits), left), left, limits)
        files = tuple(_contents(members, len(data), left, limits))
    except UnusableArchiveError as error:
        raise SubmissionError(f"{where}: {error.problem}", error.hint) from None
    return Collected(files, left.notes(), tuple(left.too_large))


def _members(data: bytes, limits: SubmissionLimits) -> list[Member]:
    kind = archive_kind(data[:HEAD_BYTES])
    if kind is None:
        raise UnusableArchiveError("expected a zip or tar archive, found another kind of file", HAND_IN_ZIP)
    allowed = _allowed(len(data))
    most = MAX_UNPACKED_BYTES + limits.bag_bytes
    limit = _RATIO if allowed < most else f"{most >> 20} MiB unpacked"
    total = min(most, allowed)
    if kind in KINDS and has_libarchive():
        return foreign_members(
            data, kind, UnpackerLimits(limits.entries, max(limits.file_bytes, limits.bag_bytes), total, limit)
        )
    if kind not in _READABLE:
        hint = (
            f"{HAND_IN_ZIP}; the grader can read {kind} with the extra rclpy-grader[archives] and libarchive"
            if kind in KINDS
            else HAND_IN_ZIP
        )
        raise UnusableArchiveError(f"expected a zip or tar archive, found {kind}, which cannot be read", hint)
    if kind == "zip":
        return zip_members(data, most=limits.entries)
    if kind != "tar":
        data = unpacked(data, kind, most=total, limit=limit)
        if not is_tar(data[:HEAD_BYTES]):
            found = f"expected a tar archive inside the {kind}, found another kind of file"
            raise UnusableArchiveError(found, HAND_IN_ZIP)
    return tar_members(data, most=limits.entries)


def _allowed(packed: int) -> int:
    return max(RATIO_FREE_BYTES, packed * MAX_RATIO)


def _wanted(members: Sequence[Member], left: LeftOut) -> Iterator[tuple[str, Member]]:
    """Yield the student's files with normalised names; raises for members that no archive may contain.

    A file that is not a program and has a name that some system cannot keep is left out.
    """
    for member in members:
        name = _relative(member)
        if not name:  # the top folder itself
            continue
        problem = name_problem(name)
        if problem and not may_be_left_out(name):
            raise UnusableArchiveError(f"expected plain relative names, found {problem}: {printable(member.name)}")
        if member.kind == FOLDER or is_skipped(name):
            continue
        if problem:
            left.add(f"it has {problem}", name)
            continue
        if member.kind != FILE:
            hint = "replace it by the file itself" if member.kind == LINK else REPACK
            raise UnusableArchiveError(f"expected plain files, found {member.kind}: {printable(member.name)}", hint)
        yield name, member


def _relative(member: Member) -> str:
    """Return a member's name without the `./` of `tar -c .`; empty for the top folder."""
    name = member.name
    while name.startswith("./"):
        name = name[2:]
    return "" if name == "." and member.kind == FOLDER else name


def _without_generated(
    named: Iterator[tuple[str, Member]], left: LeftOut, limits: SubmissionLimits
) -> list[tuple[str, Member]]:
    """Drop generated files, then apply the limits that need no unpacking."""
    every = list(named)
    generated = generated_folders(name for name, _ in every)
    kept = []
    for name, member in every:
        folder = next((folder for folder in folders_of(name) if folder in generated), None)
        if folder is None:
            kept.append((name, member))
        else:
            left.add(f"it holds {generated[folder]}, so a tool made it", folder)
    if len(kept) > limits.files:
        raise _too_many(limits.files, "files")
    if any(name.count("/") > limits.depth for name, _ in kept):
        raise _too_many(limits.depth, "folders inside each other")
    twins = set()
    for index, other, name in collisions([name for name, _ in kept]):
        found = f"found {printable(other)} and {printable(name)}" if other != name else f"found {printable(name)} twice"
        path = kept[index][0]
        if is_gradable(path) or path != name:
            raise UnusableArchiveError(f"expected different names, {found}")
        twins.add(index)
        left.add(f"something else is called {printable(other)}", path)
    return [one for index, one in enumerate(kept) if index not in twins]


def _contents(
    members: Sequence[tuple[str, Member]], packed: int, left: LeftOut, limits: SubmissionLimits
) -> Iterator[tuple[str, bytes]]:
    """Unpack the members, counting actual sizes, not declared ones."""
    total = 0
    for name, member in members:
        most = limits.most_of(name)
        content = member.read(most + 1) if member.size <= most else None
        if content is None or len(content) > most:
            left.add_large(name, most)
            continue
        if len(content) != member.size:  # another program would unpack a different file
            raise UnusableArchiveError("expected a whole archive, found a damaged or incomplete one")
        total += len(content)
        if total > limits.whole_bytes:
            raise UnusableArchiveError(f"expected at most {limits.whole_bytes >> 20} MiB in all, found more", FEWER)
        if total > _allowed(packed):
            raise UnusableArchiveError(f"expected at most {_RATIO}, found more", FEWER)
        yield name, content
