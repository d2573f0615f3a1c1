"""Control groups that count and limit the memory of a worker with everything that it starts, where they can be made.

The kernel then counts everything that the processes hold, also sockets, pipes and temporary files, and ends one of them
if it is too much: a second line of defence behind the resource monitor. Never required: see cgroups(7). With version 2
a group is made beside that of this process, because a group that has processes cannot have groups with limits in it.
"""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from grader.runtime.host.originals import wait_until
from grader.runtime.model.checkup import Fact
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB
from grader.runtime.usage import FULL_BYTES

#: What a worker, its starter, the sandboxes and the kernel need beside the nodes, with some files in the page cache.
BESIDE_BYTES = 384 * MIB
PREFIX = "rclpy-grader-"
#: How long to wait until the processes of a group have ended, and between two looks. It takes some milliseconds, unless
#: the machine is busy.
PATIENCE_S, LOOK_S = 5.0, 0.002
#: The name of a group has the pid of the process that made it.
_NAME = re.compile(rf"{PREFIX}(\d+)-[0-9a-f]+")
#: Enters a group, if it is still there, and becomes the command.
_ENTER = 'echo 0 2>/dev/null >"$0"; exec "$@"'


class MemoryGroup:
    """A control group for one worker and its forks.

    Args:
        folder: The folder of the group.
        limit_file: The name of the file with its limit, which differs between the versions.
        workers: How many workers are in it.
    """

    def __init__(self, folder: Path, limit_file: str, workers: int) -> None:
        self.folder = folder
        self._file = folder / limit_file
        self._workers = workers
        self._most = 0

    def inside(self, argv: Sequence[str]) -> tuple[str, ...]:
        """Return a command that enters the group and becomes the given one."""
        return ("/bin/sh", "-c", _ENTER, str(self.folder / "cgroup.procs"), *argv)

    def make_room(self, limits: Limits, processes: int) -> None:
        """Limit the memory to what workers with so many nodes each may use, or to what they could before, if more."""
        node = limits.memory_bytes + 2 * limits.scratch_bytes
        needed = self._workers * (FULL_BYTES + BESIDE_BYTES + processes * node)
        if needed > self._most:
            self._most = needed
            with suppress(OSError):
                self._file.write_text(str(needed), "ascii")

    def remove(self) -> None:
        """Remove the group when its killed processes have ended, which takes the kernel some milliseconds.

        If one takes longer than `PATIENCE_S`, the next grader finds the group.
        """
        wait_until(lambda: _removed(self.folder), PATIENCE_S, LOOK_S)


def _removed(folder: Path) -> bool:
    """Remove a group; return whether it is gone."""
    try:
        folder.rmdir()
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return True


def make_group(workers: int = 1, proc: Path = Path("/proc/self")) -> MemoryGroup | None:
    """Make a group for a worker; None if that is not possible.

    Args:
        workers: How many workers it is for: one, and its forks.
        proc: The folder of this process in the file system `proc`.
    """
    for parent, limit_file in _places(proc):
        folder = parent / f"{PREFIX}{os.getpid()}-{secrets.token_hex(4)}"
        try:
            _sweep(parent)
            folder.mkdir()
        except OSError:
            continue
        group = MemoryGroup(folder, limit_file, workers)
        if os.access(folder / limit_file, os.W_OK) and os.access(folder / "cgroup.procs", os.W_OK):
            return group
        group.remove()
    return None


def group_fact() -> Fact:
    """Report whether workers get groups."""
    group = make_group()
    if group is None:
        return Fact("memory groups", "none can be made here: the grader adds up the memory of nodes itself")
    group.remove()
    version = 2 if (group.folder.parent / "cgroup.controllers").exists() else 1
    return Fact("memory groups", f"each worker has one, of cgroup version {version}")


def _places(proc: Path) -> list[tuple[Path, str]]:
    """Return the folders in which a group with a limit of memory may be made, with the name of the limit's file."""
    try:
        own = [line.split(":", 2) for line in (proc / "cgroup").read_text("utf-8").splitlines()]
        mounts = [line.split() for line in (proc / "mountinfo").read_text("utf-8").splitlines()]
    except (OSError, UnicodeError):
        return []
    found = []
    for mount in mounts:
        root, at, kind, options = mount[3], mount[4], mount[mount.index("-") + 1], mount[-1].split(",")
        for _, controllers, path in own:
            if root != "/" and not path.startswith(root):
                continue
            here = Path(at) / path.removeprefix(root).lstrip("/")
            if kind == "cgroup" and "memory" in options and "memory" in controllers.split(","):
                found.append((here, "memory.limit_in_bytes"))
            elif kind == "cgroup2" and not controllers and "memory" in _words(here.parent / "cgroup.subtree_control"):
                found.append((here.parent, "memory.max"))
    return found


def _words(path: Path) -> list[str]:
    try:
        return path.read_text("ascii").split()
    except (OSError, UnicodeError):
        return []


def _sweep(parent: Path) -> None:
    """Remove the groups of graders that were killed."""
    for folder in parent.glob(f"{PREFIX}*"):
        name = _NAME.fullmatch(folder.name)
        if name is not None and not Path(f"/proc/{name[1]}").exists():
            _removed(folder)
