"""The members of a tar archive, plain or compressed."""

from __future__ import annotations

import bz2
import io
import lzma
import re
import tarfile
import zlib
from collections.abc import Callable
from typing import Protocol

from grader.reading.archive_members import FEWER, FILE, FOLDER, Member, UnusableArchiveError

BLOCK = 512

#: Longest header that only describes the next member.
MAX_EXTENDED_BYTES = 64 << 10

#: Compressed streams one after the other that are read as one: parallel compressors write several.
MAX_STREAMS = 100

#: Most memory of a decompressor of xz, in bytes; `xz -9` asks for 65 MiB.
MAX_XZ_BYTES = 128 << 20

_ENCODING, _ERRORS = "utf-8", "surrogateescape"
_PAX = (tarfile.XHDTYPE, tarfile.XGLTYPE, tarfile.SOLARIS_XHDTYPE)
_EXTENDED = (*_PAX, tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK)
# In older versions of Python, tarfile needs time that grows with the square of such a run.
_MANY_DIGITS = re.compile(rb"[0-9]{40}")
_KINDS = {tarfile.LNKTYPE: "a link", tarfile.SYMTYPE: "a link", tarfile.DIRTYPE: FOLDER}


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
    """Return whether data begins with the header of a tar archive, which holds a checksum of itself."""
    try:
        tarfile.TarInfo.frombuf(head[:BLOCK], _ENCODING, _ERRORS)
    except tarfile.HeaderError:
        return False
    return True


def unpacked(data: bytes, compression: str, *, most: int, limit: str) -> bytes:
    """Return what compressed data holds.

    Args:
        data: The whole compressed file.
        compression: `gzip`, `bzip2` or `xz`.
        most: Most bytes of the result; nothing is computed beyond.
        limit: The same in words.

    Raises:
        UnusableArchiveError: The data is damaged or cut off, or holds more.
    """
    whole = bytearray()
    for _ in range(MAX_STREAMS):
        stream = _STREAMS[compression]()
        try:
            whole += stream.decompress(data, most - len(whole) + 1)
        except (zlib.error, OSError, lzma.LZMAError, EOFError, ValueError):
            raise _damaged() from None
        if len(whole) > most:
            raise UnusableArchiveError(f"expected at most {limit}, found more", FEWER)
        if not stream.eof:
            raise _damaged()
        data = stream.unused_data.lstrip(b"\0")
        if not data:
            return bytes(whole)
    raise UnusableArchiveError(f"expected at most {MAX_STREAMS} compressed parts, found more")


def tar_members(data: bytes, *, most: int) -> list[Member]:
    """Return the members of an uncompressed tar archive in their order.

    Args:
        data: The whole archive.
        most: Most members.

    Raises:
        UnusableArchiveError: The archive is damaged or cut off, has too many members, or uses what no student needs.
    """
    places = _places(data, most)
    try:
        with tarfile.open(fileobj=io.BytesIO(data), mode="r:", encoding=_ENCODING, errors=_ERRORS) as archive:
            found = archive.getmembers()
    except (tarfile.TarError, ValueError, OSError, EOFError, OverflowError):
        raise _damaged() from None
    return [_member(data, info, places) for info in found]


def _member(data: bytes, info: tarfile.TarInfo, places: set[tuple[int, int]]) -> Member:
    if not info.isreg():
        kind = _KINDS.get(info.type, "a device, pipe or other special file")
        return Member(info.name, kind, 0, lambda most: b"")  # noqa: ARG005 - there is nothing to read
    # An extended header can move and stretch a member; then the two readings of the archive differ.
    if info.issparse() or (info.offset_data, info.size) not in places:
        raise _unusual()
    start, size = info.offset_data, info.size
    return Member(info.name, FILE, size, lambda most: data[start : start + min(size, most)])


def _places(data: bytes, most: int) -> set[tuple[int, int]]:
    """Walk over the headers and return where the contents lie, as offset and size; tarfile trusts what is said here."""
    places: set[tuple[int, int]] = set()
    at = headers = 0
    while True:
        block = data[at : at + BLOCK]
        if len(block) < BLOCK:
            raise _damaged()
        if not any(block):
            return places
        headers += 1
        if headers > 3 * most:  # a member may have two extended headers
            raise UnusableArchiveError(f"expected at most {most} entries, found more", FEWER)
        at += BLOCK
        size = _size(block)
        if at + size > len(data):
            raise _damaged()
        if block[156:157] in _EXTENDED:
            _check_extended(data[at : at + size], pax=block[156:157] in _PAX)
        else:
            places.add((at, size))
        at += -(-size // BLOCK) * BLOCK


def _size(block: bytes) -> int:
    try:
        info = tarfile.TarInfo.frombuf(block, _ENCODING, _ERRORS)
    except (tarfile.HeaderError, ValueError):
        raise _damaged() from None
    if info.type == tarfile.GNUTYPE_SPARSE or info.size < 0:
        raise _unusual()
    if info.type in _EXTENDED and info.size > MAX_EXTENDED_BYTES:
        raise _unusual()
    carries = info.type in _EXTENDED or info.isreg() or info.type not in tarfile.SUPPORTED_TYPES
    return info.size if carries else 0


def _check_extended(header: bytes, *, pax: bool) -> None:
    """Refuse records that are not exactly `LENGTH KEY=VALUE` and a line break, and those about sparse files."""
    if not pax:
        return
    if b"GNU.sparse" in header or _MANY_DIGITS.search(header):
        raise _unusual()
    at = 0
    while at < len(header):
        length = header[at : at + 8].partition(b" ")[0]
        record = header[at : at + int(length)] if length.isdigit() else b""
        if not record.endswith(b"\n") or b"=" not in record or len(record) != int(length):
            raise _damaged()
        at += len(record)


def _damaged() -> UnusableArchiveError:
    return UnusableArchiveError("expected a whole tar archive, found a damaged or incomplete one")


def _unusual() -> UnusableArchiveError:
    return UnusableArchiveError("expected a tar archive of plain files, found a feature that is not supported")
