"""Finds the processes of a command in /proc: its descendants, and which of them run a student's file."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

Running = tuple[int, str]  # a process id, and when the kernel started it


def read(path: Path) -> bytes:
    """Return a file of /proc; nothing if its process has gone."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


def students_of(command: subprocess.Popen[str] | subprocess.Popen[bytes]) -> set[Running]:
    """Return the descendants of a command that run a student's file."""
    return {one for one in below(command.pid) if is_students(Path(f"/proc/{one[0]}"))}


def below(pid: int) -> set[Running]:
    """Return the descendants of a process."""
    parents = {one: int(status[1]) for one, status in stats().items()}
    return {one for one in parents if pid in set(ancestors(one[0], {child: up for (child, _), up in parents.items()}))}


def ancestors(pid: int, parents: Mapping[int, int]) -> Iterator[int]:
    while pid := parents.get(pid, 0):
        yield pid


def running() -> set[Running]:
    """Return all processes that have not ended."""
    return {one for one, status in stats().items() if status[0] != b"Z"}


def stats() -> dict[Running, list[bytes]]:
    """Return the fields of proc_pid_stat(5) from the state on, of each process."""
    found: dict[Running, list[bytes]] = {}
    for entry in Path("/proc").iterdir():
        fields = read(entry / "stat").rpartition(b") ")[2].split() if entry.name.isdigit() else []
        if fields:
            found[int(entry.name), fields[19].decode()] = fields
    return found


def processor_time_s(*, cheaply: bool = False) -> float:
    """Return the processor time of this process and of all that it starts.

    Exactly where root counts it by a control group of version 1, which this process enters. Elsewhere that of the
    processes that live or were awaited, which leaves out what a killed process had started.

    Args:
        cheaply: Without such a group, leave out the processes that live: to look at all processes costs more than
            most tests do.
    """
    if (group := _counted()) is not None:
        return int(read(group / "cpuacct.usage")) / 1e9
    if cheaply:
        return sum(os.times()[:4])
    known = stats()
    tree = {one for one, _ in below(os.getpid())} | {os.getpid()}
    ticks = sum(int(field) for (one, _), status in known.items() if one in tree for field in status[11:15])
    return ticks / os.sysconf("SC_CLK_TCK")


@cache
def _counted() -> Path | None:
    own = re.search(rb"^\d+:[^:]*\bcpuacct\b[^:]*:/(.*)$", read(Path("/proc/self/cgroup")), re.MULTILINE)
    group = Path("/sys/fs/cgroup/cpuacct") / (own[1].decode() if own else "") / f"pytest-{os.getpid()}"
    try:
        group.mkdir(exist_ok=True)
        (group / "cgroup.procs").write_text(str(os.getpid()))
    except OSError:
        return None
    return group


def is_students(process: Path) -> bool:
    """Return whether a process was executed for a student's file, or forked for one, which has its own mounts."""
    command = read(process / "cmdline")
    forked = b"/host/starter.py" in command and b" /submission " in read(process / "mountinfo")
    return forked or b"launcher.py" in command


def segments_in_use() -> set[str]:
    """Return what living processes have mapped or opened in /dev/shm: other tests use some at any time."""
    used: set[bytes] = set()
    for process in Path("/proc").glob("[0-9]*"):
        used.update(re.findall(rb"/dev/shm/(\S*)", read(process / "maps")))
        with contextlib.suppress(OSError):  # it has ended, or is another user's
            for link in (process / "fd").iterdir():
                with contextlib.suppress(OSError):
                    used.add(str(link.readlink()).removeprefix("/dev/shm/").encode())
    return {name.decode("utf-8", "replace") for name in used}
