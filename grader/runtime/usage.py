"""Reads the resource usage of processes from the kernel: memory, processor time, threads, files in scratch folders."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Protocol

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB, NS_PER_S, duration

#: A worker that uses more memory, without pages mapped from files, is ended, and the exit code that says so. The most
#: that is recorded takes 200 MiB; a gap of millions of messages makes Fast DDS fill 400 MiB a second.
FULL_BYTES, FULL_CODE = 300 * MIB, 77
#: Processor time that a worker may use for a scenario, and for each second of it: ordinary ones take it 0.02 s for a
#: second, and 5 s for the most messages that are recorded. A malformed packet can make Fast DDS compute without end.
WORKER_CPU_S, WORKER_SHARE = 20, 0.25
#: The writable folders of a sandbox that has its own file systems.
FOLDERS = ("tmp", "dev/shm")


class Kernel(Protocol):
    """The functions of this module with which a recording is watched: whoever calls them is handed the module."""

    def scratch_names(self, pids: Iterable[int]) -> int:
        """See `scratch_names`."""
        ...

    def usage(self, pids: Iterable[int]) -> Usage:
        """See `usage`."""
        ...

    def families(self, roots: Collection[int]) -> dict[int, set[int]]:
        """See `families`."""
        ...

    def last_pid(self) -> str:
        """See `last_pid`."""
        ...

    def innermost(self, root: int) -> int:
        """See `innermost`."""
        ...

    def threads_starved_ns(self, pids: Iterable[int]) -> dict[str, int]:
        """See `threads_starved_ns`."""
        ...

    def busiest_thread_ns(self, pids: Iterable[int]) -> int:
        """See `busiest_thread_ns`."""
        ...

    def thread_starved_ns(self, pid: int, thread: int | str) -> int:
        """See `thread_starved_ns`."""
        ...

    def activity(self, pid: int) -> Activity:
        """See `activity`."""
        ...


def scratch_names(pids: Iterable[int]) -> int:
    """Count the files and folders in the fullest scratch folder of some processes.

    Args:
        pids: The processes of one sandbox.

    Returns:
        The count; 0 if they share the machine's folders, where files cannot be attributed to processes.
    """
    return max(
        (_names_below(f"/proc/{pid}/root/{folder}", f"/{folder}") for pid in pids for folder in FOLDERS), default=0
    )


def _names_below(folder: str, ours: str) -> int:
    try:
        if os.stat(folder).st_dev == os.stat(ours).st_dev:  # noqa: PTH116 -- strings, of folders in /proc
            return 0
        system = os.statvfs(folder)
    except OSError:  # the process has ended, or is just starting
        return 0
    return system.f_files - system.f_ffree


NS_PER_TICK = NS_PER_S // os.sysconf("SC_CLK_TCK")
#: State in /proc/PID/stat of a process that was stopped by a signal.
HALTED = b"T"
#: Memory in /proc/PID/status, in KiB, that is not backed by a file.
SHARED_MEMORY = b"\nRssShmem:"
OWN_MEMORY = (b"\nRssAnon:", SHARED_MEMORY, b"\nVmSwap:")
THREADS = b"\nThreads:"
#: In /proc/PID/task/TID/status: the state of a thread, the one of those that run or are ready to, and how often it has
#: given up its processor; see proc_pid_status(5).
STATE, RUNNING, SLEPT = b"\nState:\t", b"R", b"\nvoluntary_ctxt_switches:"
#: How often a process has called the system to read and to write, in /proc/PID/io.
READS, WRITES = b"\nsyscr:", b"\nsyscw:"
#: Indexes of fields in /proc/PID/stat after the name in parentheses, which may contain spaces. Index 0 is the third
#: field of proc(5), which counts from 1.
PARENT, USER_TIME, CHILDREN_SYSTEM_TIME = 1, 11, 14


def worker_processor_s(limits: Limits, lasts_ns: int) -> int:
    """Return the most processor time of a worker for one scenario, in seconds.

    Args:
        limits: Limits of a node; the worker has no more processor time than that.
        lasts_ns: How long the scenario may last.
    """
    return min(limits.processor_s, WORKER_CPU_S + math.ceil(WORKER_SHARE * lasts_ns / NS_PER_S))


def processor_words(seconds: int) -> str:
    """Describe a limit of processor time."""
    return f"{duration(seconds * NS_PER_S)} of processor time"


@dataclass(frozen=True, slots=True)
class Usage:
    """The combined usage of some processes; processor time includes that of children that have ended.

    `halted` is whether a signal has stopped one of them, so that it never continues by itself.
    """

    memory_bytes: int = 0
    processor_ns: int = 0
    threads: int = 0
    halted: bool = False


def usage(pids: Iterable[int]) -> Usage:
    """Return the combined usage of processes; one that has ended counts as nothing."""
    memory_kib = ticks = threads = 0
    halted = False
    for pid in pids:
        own_kib, own_threads = _status(pid)
        memory_kib += own_kib
        threads += own_threads
        fields = _stat(pid)
        halted = halted or fields[:1] == [HALTED]
        ticks += sum(int(field) for field in fields[USER_TIME : CHILDREN_SYSTEM_TIME + 1])
    return Usage(memory_kib << 10, ticks * NS_PER_TICK, threads, halted)


def own_processor_ns(pid: int) -> int:
    """Return the processor time of a process without its children; 0 if it has ended."""
    return sum(int(field) for field in _stat(pid)[USER_TIME : USER_TIME + 2]) * NS_PER_TICK


def restart_peak() -> None:
    """Forget the most memory that this process has had; nothing happens where the kernel does not allow it."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_bytes(b"5")  # proc(5): resets the peak of the resident set


def peak_bytes() -> int:
    """Return the most memory that this process has had since `restart_peak`."""
    return _number(_read("/proc/self/status"), b"\nVmHWM:") << 10


def families(roots: Collection[int]) -> dict[int, set[int]]:
    """Return each process with all of its descendants."""
    parents = {pid: int(fields[PARENT]) for pid in _pids() if (fields := _stat(pid))}
    found: dict[int, set[int]] = {root: {root} for root in roots}
    for pid in parents:
        line = [pid]
        while line[-1] in parents and line[-1] not in found and len(line) <= len(parents):
            line.append(parents[line[-1]])
        if line[-1] in found:
            found[line[-1]].update(line)
    return found


def last_pid() -> str:
    """Return the pid that the kernel gave last, to a process or a thread; empty if it does not say.

    As long as it stays the same, no process has been started that this process could see: proc_loadavg(5).
    """
    return _read("/proc/loadavg").rpartition(b" ")[2].strip().decode("ascii")


def innermost(root: int) -> int:
    """Return the last process in a chain of wrapper processes, each of which has one child."""
    pids = {pid: int(fields[PARENT]) for pid in families([root])[root] if (fields := _stat(pid))}
    return next((pid for pid in pids if pid not in pids.values()), root)


def threads_starved_ns(pids: Iterable[int]) -> dict[str, int]:
    """Return how long each thread of processes was ready to run but waited for a processor, in nanoseconds."""
    return {thread: thread_starved_ns(pid, thread) for pid in pids for thread in _names(f"/proc/{pid}/task")}


def thread_starved_ns(pid: int, thread: int | str) -> int:
    """Return how long a thread was ready to run but waited for a processor; 0 if the kernel does not count it."""
    return _schedule(pid, thread)[1]


def busiest_thread_ns(pids: Iterable[int]) -> int:
    """Return the processor time of the thread of processes that has used most; 0 if the kernel does not count it."""
    return max((_schedule(pid, thread)[0] for pid in pids for thread in _names(f"/proc/{pid}/task")), default=0)


@dataclass(frozen=True, slots=True)
class Activity:
    """What a process has done so far other than computing.

    Attributes:
        runs: Whether one of its threads runs, or is ready to.
        slept: How often its threads have waited for something else than a processor.
        exchanged: How often it has read or written; None if the kernel does not tell, or if it shares memory with
            others, in which it can be told and tell something without that.
    """

    runs: bool = False
    slept: int = 0
    exchanged: int | None = None

    @property
    def is_known(self) -> bool:
        """Whether the process has computed all the time from one look to another if both are equal to this."""
        return self.runs and self.exchanged is not None


def activity(pid: int) -> Activity:
    """Return what a process has done so far; one that has ended has done nothing."""
    runs, slept = False, 0
    for thread in _names(f"/proc/{pid}/task"):
        status = _read(f"/proc/{pid}/task/{thread}/status")
        runs = runs or status.partition(STATE)[2][:1] == RUNNING
        slept += _number(status, SLEPT)
    return Activity(runs, slept, _exchanged(pid) if runs else None)


def _exchanged(pid: int) -> int | None:
    counted = _read(f"/proc/{pid}/io")
    if READS not in counted or _number(_read(f"/proc/{pid}/status"), SHARED_MEMORY):
        return None
    return _number(counted, READS) + _number(counted, WRITES)


def _schedule(pid: int, thread: int | str) -> tuple[int, int]:
    """Return how long a thread has run and has waited for a processor, from /proc/PID/task/TID/schedstat."""
    fields = _read(f"/proc/{pid}/task/{thread}/schedstat").split()
    return (int(fields[0]), int(fields[1])) if len(fields) > 1 else (0, 0)


def _status(pid: int) -> tuple[int, int]:
    """Return the private memory of a process in KiB, and its number of threads."""
    status = _read(f"/proc/{pid}/status")
    return sum(_number(status, key) for key in OWN_MEMORY), _number(status, THREADS)


def _number(status: bytes, key: bytes) -> int:
    """Return the first number of a line of /proc/PID/status; 0 if there is no such line."""
    _, found, rest = status.partition(key)
    return int(rest.split(None, 1)[0]) if found else 0


def _stat(pid: int) -> list[bytes]:
    return _read(f"/proc/{pid}/stat").rpartition(b")")[2].split()


def _pids() -> list[int]:
    return [int(name) for name in _names("/proc") if name.isdecimal()]


def _names(folder: str) -> list[str]:
    try:
        return os.listdir(folder)  # noqa: PTH208 - many times a second
    except OSError:
        return []


def _read(path: str) -> bytes:
    """Read a file in /proc; empty if the process has ended.

    Without a file object, because usage is read many times a second.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return b""
    try:
        return os.read(descriptor, 1 << 16)
    except OSError:
        return b""
    finally:
        os.close(descriptor)
