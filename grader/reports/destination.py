"""Files that reports are written to: whole or not at all."""

from __future__ import annotations

import errno
import os
import secrets
import stat
from contextlib import suppress
from pathlib import Path


def check_writable(path: Path) -> None:
    """Make sure that a report can be written to a path, without changing what is there.

    Raises:
        OSError: It cannot, and why.
    """
    target = _target(path)
    if _is_special(target):
        return
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    descriptor, probe = _beside(target)
    os.close(descriptor)
    probe.unlink()


def write_whole(path: Path, data: bytes) -> None:
    """Write a file so that a reader finds either what was there before or all of the new content.

    A symbolic link stays one, an existing file keeps its mode. What is no regular file, such as /dev/null or a pipe,
    is written to as it is.

    Raises:
        OSError: It could not be written; nothing is left beside it.
    """
    target = _target(path)
    if _is_special(target):
        target.write_bytes(data)
        return
    descriptor, fresh = _beside(target)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            fresh.chmod(stat.S_IMODE(target.stat().st_mode))
        fresh.replace(target)
    except BaseException:
        with suppress(OSError):
            fresh.unlink()
        raise


def _target(path: Path) -> Path:
    return Path(os.path.realpath(path))


def _is_special(path: Path) -> bool:
    return path.exists() and not path.is_file() and not path.is_dir()


def _beside(target: Path) -> tuple[int, Path]:
    """Create an empty file in the folder of the target, with the mode that the user's umask leaves."""
    fresh = target.parent / f".grade-{secrets.token_hex(8)}.tmp"
    return os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666), fresh
