"""Writes files so that nobody finds half of one."""

from __future__ import annotations

import os
import secrets
import stat
from contextlib import suppress
from pathlib import Path


def write_whole(path: Path, data: bytes) -> None:
    """Write a file atomically: a reader finds the old content or all of the new; no temporary file is left behind.

    A symbolic link stays a link, and an existing file keeps its mode. Special files, such as /dev/null or a pipe, are
    written to directly.
    """
    target = link_target(path)
    if is_special(target):
        target.write_bytes(data)
        return
    replace_file(target, data, stat.S_IMODE(target.stat().st_mode) if target.exists() else None)


def replace_file(path: Path, data: bytes, mode: int | None = None) -> None:
    """Write a file atomically, in place of whatever is there, also of a link; without a mode, it has the usual one."""
    descriptor, fresh = beside(path)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if mode is not None:
            fresh.chmod(mode)
        fresh.replace(path)
    except BaseException:
        with suppress(OSError):
            fresh.unlink()
        raise


def link_target(path: Path) -> Path:
    """Return the file that is written under a path: where a link leads to."""
    return Path(os.path.realpath(path))


def is_special(path: Path) -> bool:
    """Return whether a path is neither a file nor a folder, but exists: a pipe or a device."""
    return path.exists() and not path.is_file() and not path.is_dir()


def beside(target: Path) -> tuple[int, Path]:
    """Create an empty file in the target's folder, with the mode that the user's umask allows."""
    fresh = target.parent / f".grade-{secrets.token_hex(8)}.tmp"
    return os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666), fresh
