"""What of this machine's files a student's process must be shown, and what of the grader it must not see."""

from __future__ import annotations

import secrets
import stat
import sysconfig
from collections.abc import Iterable
from pathlib import Path

import grader
from grader.recording.isolation.protocol import PythonRuntime

# Where there is no user namespace, the kernel counts processes by user: students who run at the same time on one
# machine need users of their own, or one fork bomb would take the others' threads. Numbers of 16 bits, since
# containers map no others.
STUDENT_GROUP = 61234
STUDENT_USERS = range(61234, 65234)


def some_user() -> int:
    """Return a user that a student's process may become, unlikely to be another student's."""
    return STUDENT_USERS.start + secrets.randbelow(len(STUDENT_USERS))


def secrets_within(bound: Iterable[Path], runtime: PythonRuntime) -> list[Path]:
    """Return the folders with rubrics and checks that would be seen through a folder that is shown."""
    package = Path(grader.__file__).resolve().parent
    bound = tuple(bound)
    # An editable installation keeps a copy of the rubrics among the packages, away from the code.
    installed = {Path(sysconfig.get_path(name)).resolve() / "grader" for name in ("purelib", "platlib")}
    places = {package, *installed, *(folder.resolve() / "grader" for folder in runtime.python_paths)}
    return [place for place in sorted(places) if place.is_dir() and any(folder in place.parents for folder in bound)]


def make_readable(folder: Path) -> None:
    """Let every user read a folder and what is in it; links are left alone."""
    for path in (folder, *folder.rglob("*")):
        mode = path.lstat().st_mode
        wanted = 0o555 if stat.S_ISDIR(mode) else 0o444
        if (stat.S_ISDIR(mode) or stat.S_ISREG(mode)) and mode & wanted != wanted:
            path.chmod(stat.S_IMODE(mode) | wanted)


def closed_folders(paths: Iterable[Path]) -> list[Path]:
    """Return the folders above some paths that only their owner or group can enter."""
    folders = {folder for path in paths for folder in path.parents}
    return [folder for folder in sorted(folders) if folder.is_dir() and not folder.stat().st_mode & stat.S_IXOTH]
