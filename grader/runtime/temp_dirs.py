"""The folders that runs write to: a temporary one, whose leftovers are removed, and the user's own, which are kept."""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PREFIX = "grade-run-"
#: The names that `tempfile` generates.
NAME = re.compile(re.escape(PREFIX) + r"[a-z0-9_]{8}")
#: An empty folder younger than this may just be in the making.
FRESH_S = 60.0
#: Where LTTng, a tracing library that ROS loads, leaves files for each user.
SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 - no file is created there
TRACER_FILES = "lttng-ust-wait-*"


#: The builds of submissions' interface packages, and how much of them is kept: a course has a few of some hundred KiB,
#: a hostile submission makes up to 64 MiB.
BUILDS, KEPT_BYTES = "submitted-*", 500 << 20
#: What a file or folder takes on a disk beside its content.
BLOCK_BYTES = 4096

#: The folder of the grader in folders that are a user's own.
OWN = "rclpy-grader"


def own_folder(*variables: str) -> Path | None:
    """Return a folder that only this user can write to, created if needed; None if there is none.

    It is in the folder that the first of these environment variables names, else in the user's `.cache`.
    """
    given = next(filter(None, map(os.environ.get, variables)), None)
    with contextlib.suppress(OSError, RuntimeError):  # RuntimeError: a user without a home
        folder = (Path(given) if given else Path.home() / ".cache") / OWN
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.geteuid() and not found.st_mode & 0o022:
            return folder
    return None


def kept_interfaces() -> Path | None:
    """Return the user's folder for interface packages that were built, created if needed; None if there is none."""
    folder = own_folder("XDG_CACHE_HOME")
    if folder is None:
        return None
    place = folder / "interfaces"
    with contextlib.suppress(OSError):
        place.mkdir(mode=0o755, exist_ok=True)
    return place if place.is_dir() else None


def make_room(place: Path, *, keep: Path, most: int = KEPT_BYTES) -> list[str]:
    """Remove the oldest builds of submissions' interface packages beyond a limit, and return their names.

    Only folders that `BUILDS` matches are removed; what a run uses, it has copied.

    Args:
        place: The folder that keeps what was built.
        keep: The build that was just made.
        most: The most bytes of all builds together.
    """
    found = [(path.lstat().st_mtime, size_on_disk(path), path) for path in place.glob(BUILDS) if path != keep]
    left = most - (size_on_disk(keep) if keep.is_dir() else 0)
    removed = []
    for _, used, path in sorted(found, reverse=True):
        left -= used
        if left < 0:
            _remove(path)
            removed.append(path.name)
    return removed


def size_on_disk(folder: Path) -> int:
    """Return the size of all files in a folder, with one block for each file and folder; in bytes."""
    total = 0
    for here, _, files in os.walk(folder):
        total += BLOCK_BYTES
        for file in files:
            with contextlib.suppress(OSError):
                total += BLOCK_BYTES + Path(here, file).lstat().st_size
    return total


@contextmanager
def scratch_folder(shared: Path = SHARED_MEMORY) -> Iterator[Path]:
    """Create a temporary folder for the block, and remove those that killed runs of this user left behind.

    The folder is locked while this process lives, so that a later run can tell whether it is still in use. What a
    tracer leaves in the shared memory during the block is removed as well.
    """
    place = Path(tempfile.gettempdir())
    sweep(place)
    with tempfile.TemporaryDirectory(prefix=PREFIX, dir=place) as name:
        lock = os.open(name, os.O_RDONLY | os.O_DIRECTORY)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX)
            with _without_tracer_files(shared):
                yield Path(name)
        finally:
            os.close(lock)


def sweep(place: Path) -> list[str]:
    """Remove the folders of dead runs in a place, and return their names.

    A folder is removed only if its name matches, it belongs to this user, is not a symlink and is not locked.
    """
    removed = []
    for name in sorted(_names(place)):
        if NAME.fullmatch(name) and _is_dead(place / name):
            _remove(place / name)
            removed.append(name)
    return removed


def _is_dead(folder: Path) -> bool:
    try:
        lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        if os.fstat(lock).st_uid != os.geteuid():
            return False
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # A folder that was just created, and is not locked yet, is empty.
        return bool(os.listdir(lock)) or time.time() - os.fstat(lock).st_mtime > FRESH_S  # noqa: PTH208
    except OSError:
        return False
    finally:
        os.close(lock)


def _remove(folder: Path) -> None:
    """Delete a folder and its content, without following symlinks."""
    for parent, folders, _ in os.walk(folder):
        for name in ("", *folders):
            path = Path(parent, name)
            if not path.is_symlink():
                with contextlib.suppress(OSError):
                    path.chmod(0o700)
    shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _without_tracer_files(shared: Path) -> Iterator[None]:
    """Remove the tracer's files that appear during the block, unless another program uses them."""
    before = _tracer_files(shared)
    try:
        yield
    finally:
        for path in _tracer_files(shared) - before:
            with contextlib.suppress(OSError):
                if path.lstat().st_uid == os.geteuid() and not _in_use(path):
                    path.unlink()


def _tracer_files(shared: Path) -> set[Path]:
    return {path for path in shared.glob(TRACER_FILES) if _is_plain(path)}


def _is_plain(path: Path) -> bool:
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def _in_use(path: Path) -> bool:
    """Return whether any process that may be inspected has a file mapped."""
    status = path.lstat()
    device = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}"
    wanted = f" {device} {status.st_ino} ".encode()  # as in /proc/PID/maps; another file may have the same name
    for pid in _names(Path("/proc")):
        if pid.isdecimal():
            with contextlib.suppress(OSError):
                if wanted in Path("/proc", pid, "maps").read_bytes():
                    return True
    return False


def _names(folder: Path) -> list[str]:
    try:
        return os.listdir(folder)  # noqa: PTH208 - names only
    except OSError:
        return []
