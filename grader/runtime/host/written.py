"""Finds the small files that a program has written beside itself, to keep them with the recording."""

from __future__ import annotations

import base64
import contextlib
import gc
import io
import os
import stat
from collections.abc import Iterator

from .protocol import MOST_WRITTEN, WrittenContent

#: The most bytes of one file that is kept, and of all; more entries than these are not looked at.
FILE_BYTES, ALL_BYTES, ENTRIES = 64 << 10, 256 << 10, 2_000


class WrittenFiles:
    """Compares the files in the folders that a program writes to with those that were there before.

    Args:
        folders: The submission, the working directory and the home; one of them may be in another.
        left_out: Folders in them that are not looked at: ROS writes logs there, and libraries what they keep.
    """

    def __init__(self, folders: tuple[str, ...], left_out: tuple[str, ...]) -> None:
        self._folders = dict.fromkeys(folder for folder in folders if folder)
        self._left_out = left_out
        self._before = {path: state for _, path, state in self._entries()}

    def files(self) -> list[WrittenContent]:
        """Return the files that are new or changed, with their names and contents.

        A name is relative to the first of the folders that the file is in. Links are not followed.
        """
        found: list[WrittenContent] = []
        left = ALL_BYTES
        for name, path, state in sorted(self._entries()):
            if self._before.get(path) == state or state[0] > min(FILE_BYTES, left) or len(found) == MOST_WRITTEN:
                continue
            with contextlib.suppress(OSError):
                content = _content(path)
                left -= len(content)
                found.append(WrittenContent(name, base64.b64encode(content).decode()))
        return found

    def _entries(self) -> Iterator[tuple[str, str, tuple[int, int]]]:
        """Yield name, path, and size and time of each file."""
        seen: set[str] = set()
        for top in self._folders:
            for folder, inner, names in os.walk(top):
                inner[:] = [name for name in inner if os.path.join(folder, name) not in self._left_out]
                for name in names:
                    path = os.path.join(folder, name)
                    if path in seen:
                        continue
                    seen.add(path)
                    if len(seen) > ENTRIES:
                        return
                    with contextlib.suppress(OSError):
                        status = os.lstat(path)
                        if stat.S_ISREG(status.st_mode):
                            yield os.path.relpath(path, top), path, (status.st_size, status.st_mtime_ns)


def flush_open_files() -> None:
    """Write what open files still hold back: the garbage collector may close a file before its buffer is written."""
    for thing in gc.get_objects():
        if type(thing) in (io.TextIOWrapper, io.BufferedWriter, io.BufferedRandom):
            with contextlib.suppress(Exception):
                thing.flush()


def _content(path: str) -> bytes:
    """Read a plain file, whatever it was replaced by."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(path)
        content = file.read(FILE_BYTES + 1)
        if len(content) > FILE_BYTES:
            raise OSError(path)
        return content
