"""Counts the names in students' scratch folders: each takes memory of the system's, which no limit on sizes counts."""

from __future__ import annotations

import os
from collections.abc import Iterable

#: Where a sandbox with its own file systems has the folders that may be written to.
FOLDERS = ("tmp", "dev/shm")


def scratch_names(pids: Iterable[int]) -> int:
    """Return how many files and folders there are in the fullest scratch folder of some processes.

    Args:
        pids: The processes, of one sandbox.

    Returns:
        The count; 0 where they share the machine's folders, of which nothing tells who filled them.
    """
    return max((_names(f"/proc/{pid}/root/{folder}", f"/{folder}") for pid in pids for folder in FOLDERS), default=0)


def _names(folder: str, ours: str) -> int:
    try:
        if os.stat(folder).st_dev == os.stat(ours).st_dev:  # noqa: PTH116 -- strings, of folders in /proc
            return 0
        system = os.statvfs(folder)
    except OSError:  # the process has ended, or is being made
        return 0
    return system.f_files - system.f_ffree
