"""Determines which files of this machine a student's process can see, and which of the grader's it must not see."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import secrets
import stat
import sysconfig
import threading
from collections.abc import Iterable
from pathlib import Path

import grader
from grader.runtime.model.dataclass import dataclass
from grader.runtime.ros_installation import PythonRuntime
from grader.runtime.sandbox.protocol import WorkerView

MOST_LINKS = 40  # what the kernel allows in one path


@dataclass(frozen=True, slots=True)
class View:
    """A minimal view of the machine's files."""

    bound: tuple[Path, ...]  # real files and folders, sorted, none inside another
    # Symbolic links on the way to them, (path, target), sorted, none inside a bound folder
    links: tuple[tuple[Path, str], ...]

    def parents(self) -> tuple[Path, ...]:
        """Return the folders above the bound paths and links, outermost first."""
        return parents_of((*self.bound, *(where for where, _ in self.links)))


def view_of(paths: Iterable[Path]) -> View:
    """Return a view in which every existing path can be opened by its own name.

    Links are followed one by one, so that a virtual environment whose interpreter is a link to a link works; a path
    that does not exist is left out.
    """
    real: set[Path] = set()
    links: dict[Path, str] = {}
    for path in paths:
        target, on_the_way = _follow(path)
        if target is not None:
            real.add(target)
            links.update(on_the_way)
    bound = tuple(path for path in sorted(real) if not any(parent in real for parent in path.parents))
    return View(
        bound,
        tuple((where, links[where]) for where in sorted(links) if not any(folder in where.parents for folder in bound)),
    )


def parents_of(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return every folder above the paths except the root, outermost first."""
    return tuple(sorted({parent for path in paths for parent in path.parents if parent != Path("/")}))


def _follow(path: Path) -> tuple[Path | None, dict[Path, str]]:
    """Resolve a path part by part and note each link on the way; None if the path does not exist."""
    # Text, not paths: a run looks at a thousand parts
    links: dict[Path, str] = {}
    done, to_do = "", os.path.normpath(path).strip("/").split("/")
    passed = 0
    while to_do:
        name = to_do.pop(0)
        if name in ("", "."):
            continue
        if name == "..":
            done = done.rpartition("/")[0]
            continue
        step = f"{done}/{name}"
        try:
            is_link = stat.S_ISLNK(os.lstat(step).st_mode)
        except (FileNotFoundError, NotADirectoryError):
            return None, {}
        if not is_link:
            done = step
            continue
        passed += 1
        if passed > MOST_LINKS:
            return None, {}
        target = os.readlink(step)  # noqa: PTH115 -- Path.readlink drops a leading "./"
        links[Path(step)] = target
        to_do[:0] = target.split("/")
        done = "" if target.startswith("/") else done
    return Path(done or "/"), links


# Without a user namespace, the kernel counts processes by user. Students that run at the same time on one machine need
# different users, or a fork bomb would use up the threads of the others. User ids have 16 bits, because containers do
# not map others.
STUDENT_GROUP = 61234
STUDENT_USERS = range(61234, 65234)
#: Drawing again finds a free user among 4,000 as long as a few are free. After that one is shared, and the limit of its
#: processes with it.
TRIES = 1000


#: Graders of one machine lock in this file the byte of each user that they have taken; only root writes there.
TAKEN = Path("/run/rclpy-grader.users")


class StudentUsers:
    """Allocates users for student processes, each to one process on this machine.

    A user stays allocated until the process that requested it ends. Without a file of locks, which is created if it
    does not exist, users are random, and two processes are only unlikely to get the same one.
    """

    def __init__(self, taken: Path) -> None:
        self._path = taken
        self._file: int | None = None
        self._mine: set[int] = set()
        self._lock = threading.Lock()

    def next(self) -> int:
        """Allocate a user that no other process has."""
        with self._lock:
            for _ in range(TRIES):
                user = STUDENT_USERS.start + secrets.randbelow(len(STUDENT_USERS))
                if user not in self._mine and self._take(user):
                    break
            self._mine.add(user)
            return user

    def _take(self, user: int) -> bool:
        try:
            if self._file is None:
                self._file = os.open(self._path, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600)
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, user)
        except OSError as error:
            return error.errno not in (errno.EAGAIN, errno.EACCES) or self._file is None
        return True


_USERS = StudentUsers(TAKEN)


def some_user() -> int:
    """Return a user for a student's process that no other grader on this machine uses."""
    return _USERS.next()


def taken_users() -> tuple[Path, ...]:
    """Return the file in which workers lock their users, created if needed; empty if that is not possible."""
    with contextlib.suppress(OSError):
        os.close(os.open(TAKEN, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600))
        return (TAKEN,)
    return ()


def secrets_within(bound: Iterable[Path], python_paths: Iterable[Path]) -> list[Path]:
    """Return the folders with rubrics and checks that are inside of a visible folder.

    Args:
        bound: The visible folders.
        python_paths: Additional entries of sys.path.
    """
    package = Path(grader.__file__).resolve().parent
    bound = tuple(bound)
    # An editable installation has a copy of the rubrics in site-packages, apart from the code.
    installed = {Path(sysconfig.get_path(name)).resolve() / "grader" for name in ("purelib", "platlib")}
    places = {package, *installed, *(folder.resolve() / "grader" for folder in python_paths)}
    return [place for place in sorted(places) if place.is_dir() and any(folder in place.parents for folder in bound)]


def worker_view(runtime: PythonRuntime, folder: Path) -> WorkerView:
    """Return the view of a worker: Python, ROS, the part of this package that it runs, and its working folder.

    The working folder also contains the staged submissions and copies of the interface packages that they use.
    """
    package = Path(grader.__file__).resolve().parent
    read = (*runtime.read_paths, runtime.executable, *runtime.library_paths, *runtime.python_paths)
    hidden = tuple(secrets_within(view_of(read).bound, runtime.python_paths))
    parts = ("__init__.py", "api", "runtime")
    own = tuple(package / name for name in parts)
    return WorkerView(read, hidden, own, (folder,))


def make_readable(folder: Path) -> None:
    """Make a folder and its content readable for every user, without following links."""
    for path in (folder, *folder.rglob("*")):
        mode = path.lstat().st_mode
        wanted = 0o555 if stat.S_ISDIR(mode) else 0o444
        if (stat.S_ISDIR(mode) or stat.S_ISREG(mode)) and mode & wanted != wanted:
            path.chmod(stat.S_IMODE(mode) | wanted)


def closed_folders(paths: Iterable[Path]) -> list[Path]:
    """Return the folders above some paths that only their owner or group can enter."""
    folders = {folder for path in paths for folder in path.parents}
    return [folder for folder in sorted(folders) if folder.is_dir() and not folder.stat().st_mode & stat.S_IXOTH]
