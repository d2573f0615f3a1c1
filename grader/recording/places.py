"""Which files and lines a submission has: what a student's process says of places is untrusted."""

from __future__ import annotations

import os
import stat
from pathlib import Path, PurePosixPath

#: No file of a submission is larger.
MOST_BYTES = 8 << 20
NAME_CHARACTERS = 300


class Places:
    """The files of a staged submission, looked at when they are named.

    Args:
        root: Its folder; None for a submission without files.
    """

    def __init__(self, root: Path | None) -> None:
        self._root = root
        self._lines: dict[str, int] = {}

    def has(self, file: object, line: object = 1) -> bool:
        """Return whether a file of the submission has a line; its path is relative, and spelt as it is staged."""
        return isinstance(file, str) and type(line) is int and 1 <= line <= self.lines(file)

    def lines(self, file: str) -> int:
        """Return how many lines a file has, an empty one has one; 0 for what is no file of the submission."""
        if len(file) > NAME_CHARACTERS or file in ("", ".") or str(PurePosixPath(file)) != file:
            return 0
        if file not in self._lines:
            if len(self._lines) >= 2_000:
                return 0
            self._lines[file] = self._count(file)
        return self._lines[file]

    def _count(self, file: str) -> int:
        if self._root is None or file.startswith("/") or ".." in file.split("/") or "\0" in file:
            return 0
        path = self._root / file
        try:
            if path.resolve() != self._root.resolve() / file:
                return 0
            with open(path, "rb", opener=_without_waiting) as source:
                if not stat.S_ISREG(os.fstat(source.fileno()).st_mode):
                    return 0
                return max(1, len(source.read(MOST_BYTES).splitlines()))
        except (OSError, ValueError):
            return 0


def _without_waiting(path: str, flags: int) -> int:
    """Open a file; not a pipe that nobody writes to, and nothing that a link leads to."""
    return os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
