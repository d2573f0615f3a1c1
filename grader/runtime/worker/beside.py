"""Finds the files that a student's process gets copies of: those of a small submission, or those beside its program."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

from grader.runtime.host.packages import PackageLayout, layout_of
from grader.runtime.model.quantities import MIB
from grader.runtime.model.scenario import is_bag_file

#: How many files are copied at most, and how many bytes in all: a program reads settings and small tables.
MOST_FILES, MOST_BYTES = 64, MIB


#: A submission with more files, or with more bytes, is only read: each process would need a copy of it in memory.
MOST_OF_SUBMISSION, MOST_BYTES_OF_SUBMISSION = 200, 4 * MIB


def whole_submission(root: Path, most_bytes: int) -> tuple[str, ...] | None:
    """Return all files of a submission, sorted, relative to its folder; None if it is too large to be copied.

    Args:
        root: The staged submission.
        most_bytes: What the folder of the copy may hold; at least half of it stays free.
    """
    found: list[str] = []
    left = min(MOST_BYTES_OF_SUBMISSION, most_bytes // 2)
    for folder, _, names in os.walk(root):
        for name in names:
            path = Path(folder, name)
            status = path.lstat()
            if is_bag_file(name) and status.st_size > MOST_BYTES:  # judged by itself: it changes nothing for programs
                continue
            left -= status.st_size
            if left < 0 or len(found) == MOST_OF_SUBMISSION or not stat.S_ISREG(status.st_mode):
                return None
            found.append(path.relative_to(root).as_posix())
    return tuple(sorted(found))


def is_loose(root: Path, file: str) -> bool:
    """Return whether a program is in no package, so that it is started in its own folder."""
    return layout_of(str(root), file) == PackageLayout()


def files_beside(root: Path, file: str) -> tuple[str, ...]:
    """Return the files in the folder of a program and below, sorted, relative to that folder.

    Programs, hidden files and links are left out, and so is what exceeds `MOST_FILES` or `MOST_BYTES`. A program in a
    package has none, because `ros2 run` starts it from anywhere.

    Args:
        root: The staged submission.
        file: The program, relative to `root`.
    """
    if not is_loose(root, file):
        return ()
    found: list[str] = []
    left = MOST_BYTES
    for path, size in _files(str((root / file).parent), ""):
        if len(found) == MOST_FILES:
            break
        if size <= left:
            left -= size
            found.append(path)
    return tuple(found)


def _files(folder: str, below: str) -> Iterator[tuple[str, int]]:
    """Yield the path, relative to the first folder, and the size of each file that is not left out."""
    with os.scandir(folder) as entries:
        listed = sorted(entries, key=lambda entry: entry.name)
    for entry in listed:
        if entry.name.startswith(".") or entry.name == "__pycache__":
            continue
        if entry.is_dir(follow_symlinks=False):
            yield from _files(entry.path, f"{below}{entry.name}/")
        elif entry.is_file(follow_symlinks=False) and not entry.name.endswith((".py", ".pyc")):
            yield f"{below}{entry.name}", entry.stat(follow_symlinks=False).st_size
