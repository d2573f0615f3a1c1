"""The members of a zip archive."""

from __future__ import annotations

import contextlib
import io
import stat
import struct
import zipfile
import zlib

from grader.reading.archive_members import FEWER, FILE, FOLDER, Member, UnusableArchiveError

_DIRECTORY_ENTRY = b"PK\x01\x02"
_ENCRYPTED = 0x1 | 0x40 | 0x2000  # with a password, strongly, the directory too
_NAMED_IN_UTF8 = 0x800
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
# What zipfile and zlib raise for a damaged archive.
_DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, ValueError, NotImplementedError, KeyError)


def zip_members(data: bytes, *, most: int) -> list[Member]:
    """Return the members of a zip archive in the order of its directory.

    Args:
        data: The whole archive.
        most: Most members.

    Raises:
        UnusableArchiveError: The archive is damaged, encrypted, compressed in an uncommon way, or has too many members.
    """
    # Before zipfile builds an object for each: of a few megabytes it could make gigabytes.
    if data.count(_DIRECTORY_ENTRY) > most:
        raise UnusableArchiveError(f"expected at most {most} entries, found more", FEWER)
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except _DAMAGE:
        raise _damaged() from None
    # Members that share their bytes could be unpacked for hours, however little comes out.
    if sum(info.compress_size for info in archive.infolist()) > len(data):
        raise _damaged()
    return [_member(archive, info) for info in archive.infolist()]


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> Member:
    if info.flag_bits & _ENCRYPTED:
        raise UnusableArchiveError("expected an archive without a password, found an encrypted one")
    if info.compress_type not in _COMPRESSIONS:
        found = f"method {info.compress_type}"
        raise UnusableArchiveError(f"expected a zip with the usual compression (deflate), found {found}")

    def read(most: int) -> bytes:
        try:
            with archive.open(info) as file:
                return file.read(most)
        except _DAMAGE:
            raise _damaged() from None

    name = _name(info)
    return Member(name.rstrip("/") or name, _kind(info, name), info.file_size, read)


def _name(info: zipfile.ZipInfo) -> str:
    """Return a member's whole name; zipfile would cut it at a NUL."""
    name = info.orig_filename
    if not info.flag_bits & _NAMED_IN_UTF8:
        # macOS writes UTF-8 and does not say so.
        with contextlib.suppress(UnicodeError):
            name = name.encode("cp437").decode("utf-8")
    return name.replace("\\", "/")  # what old Windows programs write between the parts


def _kind(info: zipfile.ZipInfo, name: str) -> str:
    mode = info.external_attr >> 16
    if stat.S_ISLNK(mode):
        return "a link"
    if stat.S_IFMT(mode) and not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        return "a device, pipe or socket"
    return FOLDER if name.endswith("/") else FILE


def _damaged() -> UnusableArchiveError:
    return UnusableArchiveError("expected a whole zip archive, found a damaged or incomplete one")
