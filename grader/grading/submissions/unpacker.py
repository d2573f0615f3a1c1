"""Unpacks a .rar or .7z archive with libarchive, as a process of its own that can do nothing else.

Usage: python -m grader.grading.submissions.unpacker LIMITS < ARCHIVE > MEMBERS. The C library reads what students
made, so the
process gives up all privileges, files and networks first; its memory, processor time and output are limited. LIMITS is
a JSON object of `format`, a format of libarchive; `entries`, `file` and `total`, the most members, bytes of one member
that are of use, and bytes of all together; `memory` and `output`, in bytes, and `processor`, in seconds. The output has
for each member a length of 4 bytes, a JSON object of so many bytes, and the content; `FAULTS` are the exit codes.
"""

from __future__ import annotations

import ctypes
import json
import logging
import mmap
import os
import struct
import sys
from collections.abc import Mapping
from typing import Any, BinaryIO

try:
    import libarchive
    from libarchive import ffi
except (ImportError, OSError, TypeError, AttributeError):  # without the C library its name is None
    libarchive = None

from grader.runtime.contained import confine

DAMAGED, ENCRYPTED, TOO_MANY, TOO_MUCH, NO_LIBRARY = 10, 11, 12, 13, 14
FAULTS = (DAMAGED, ENCRYPTED, TOO_MANY, TOO_MUCH, NO_LIBRARY)
_BLOCK = 1 << 16


class _Strict(logging.Handler):
    """Turns a warning of the library, such as a wrong checksum, into an error."""

    def emit(self, record: logging.LogRecord) -> None:
        raise ValueError(record.getMessage())


def main(limits: Mapping[str, Any]) -> int:
    """Unpack the archive; return 0 or one of `FAULTS`."""
    if libarchive is None:
        return NO_LIBRARY
    logging.getLogger("libarchive").addHandler(_Strict())
    data = mmap.mmap(0, 0, access=mmap.ACCESS_READ)
    confine(limits)
    out = sys.stdout.buffer
    encrypted = ffi.libarchive.archive_read_has_encrypted_entries
    encrypted.argtypes = [ctypes.c_void_p]
    with libarchive.memory_reader(data[:], format_name=limits["format"], filter_name="none") as archive:
        try:
            fault = _unpack(archive, limits, out)
        except (libarchive.ArchiveError, ValueError, OverflowError, MemoryError):
            fault = ENCRYPTED if encrypted(archive._pointer) == 1 else DAMAGED  # noqa: SLF001  it has no other access
    out.flush()
    return fault


def _unpack(archive: Any, limits: Mapping[str, Any], out: BinaryIO) -> int:
    total = 0
    for number, entry in enumerate(archive, start=1):
        if number > limits["entries"]:
            return TOO_MANY
        content = bytearray()
        size = 0
        if _kind(entry) == "file":
            for block in entry.get_blocks(_BLOCK):
                size += len(block)
                total += len(block)
                if total > limits["total"]:
                    return TOO_MUCH
                # What is too large is only counted, because it is left out anyway.
                content += block if size <= limits["file"] else b""
        if size > limits["file"]:
            content.clear()
        name = entry.pathname
        name = name.decode("utf-8", "surrogateescape") if isinstance(name, bytes) else str(name)
        head = {"name": name, "kind": _kind(entry), "declared": entry.size, "size": size, "sent": len(content)}
        line = json.dumps(head).encode()
        out.write(struct.pack(">I", len(line)) + line + content)
    return 0


def _kind(entry: Any) -> str:
    # Members may refer to others by a link name whatever their type says.
    if entry.issym or entry.islnk or entry.linkpath:
        return "link"
    return "file" if entry.isreg else "folder" if entry.isdir else "other"


if __name__ == "__main__":
    os._exit(main(json.loads(sys.argv[1])))
