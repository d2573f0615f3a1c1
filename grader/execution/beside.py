"""Finds the files beside a loose program, of which its working directory holds copies, as if it were started there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from grader.core.quantities import MIB
from grader.student_host.packages import PackageLayout, layout_of

#: How many files are copied at most, and how many bytes in all: a program reads settings and small tables.
MOST_FILES, MOST_BYTES = 64, MIB


def files_beside(root: Path, file: str) -> tuple[str, ...]:
    """Return the files in the folder of a program and below, sorted, relative to that folder.

    Programs, hidden files and links are left out, and so is what exceeds `MOST_FILES` or `MOST_BYTES`. A program in a
    package has none, because `ros2 run` starts it from anywhere.

    Args:
        root: The staged submission.
        file: The program, relative to `root`.
    """
    if layout_of(str(root), file) != PackageLayout():
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
