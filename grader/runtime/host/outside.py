"""Gives up virtual time for programs that use something outside of it: alarms, processes, the network, kernel clocks.

All of these take real time, and a virtual second takes only a small part of a real one.
"""

from __future__ import annotations

import os
import signal
import stat
import sys
from collections.abc import Callable, Iterable
from typing import Any

#: Audit events (https://docs.python.org/3/library/audit_events.html) of starting or becoming another process.
PROCESSES = frozenset({"os.exec", "os.fork", "os.forkpty", "os.posix_spawn", "os.spawn", "subprocess.Popen"})
#: Files in which the kernel tells its own time (proc_uptime(5), https://docs.kernel.org/admin-guide/rtc.html).
KERNEL_CLOCKS = ("/proc/uptime", "/proc/driver/rtc", "/sys/class/rtc/rtc0/since_epoch", "/sys/class/rtc/rtc0/time")


def install_alarms(give_up: Callable[[], None]) -> None:
    """Call `give_up` before a real-time alarm is set; clearing one, or timing processor time, is allowed."""
    setitimer, alarm = signal.setitimer, signal.alarm

    def guarded_setitimer(*arguments: Any, **named: Any) -> Any:
        if len(arguments) > 1 and arguments[0] == signal.ITIMER_REAL and _is_positive(arguments[1]):
            give_up()
        return setitimer(*arguments, **named)

    def guarded_alarm(*arguments: Any, **named: Any) -> int:
        if arguments and _is_positive(arguments[0]):
            give_up()
        return alarm(*arguments, **named)

    signal.setitimer, signal.alarm = guarded_setitimer, guarded_alarm


def _is_positive(seconds: Any) -> bool:
    return isinstance(seconds, (int, float)) and seconds > 0


def install_events(give_up: Callable[[str], None]) -> None:
    """Call `give_up` before the program starts another process, replaces itself by one, or reads a clock of the kernel.

    `multiprocessing` starts processes by a function that does not call audit hooks, unless it forks.

    Args:
        give_up: Takes the code of the reason, `process` or `kernel_clock`.
    """
    import _posixsubprocess

    fork_exec = _posixsubprocess.fork_exec
    clocks = frozenset((*KERNEL_CLOCKS, *map(os.fsencode, KERNEL_CLOCKS)))

    def hook(event: str, arguments: Any) -> None:
        if event in PROCESSES:
            give_up("process")
        elif event == "open" and isinstance(arguments[0], (str, bytes)) and arguments[0] in clocks:
            give_up("kernel_clock")

    def guarded_fork_exec(*arguments: Any) -> int:
        give_up("process")
        return int(fork_exec(*arguments))

    sys.addaudithook(hook)
    _posixsubprocess.fork_exec = guarded_fork_exec


def any_outside(descriptors: Iterable[int]) -> bool:
    """Return whether another process can make one of some descriptors ready.

    A pipe is internal if both its ends are open in this process. A Unix socket without a name is one of a pair, which
    event loops use to wake themselves up.
    """
    pipes: set[int] = set()
    for descriptor in descriptors:
        try:
            status = os.fstat(descriptor)
        except OSError:
            continue
        if stat.S_ISFIFO(status.st_mode):
            pipes.add(status.st_ino)
        elif not (stat.S_ISSOCK(status.st_mode) and _is_one_of_a_pair(descriptor)):
            return True
    return bool(pipes) and not pipes <= _own_pipes()


def _is_one_of_a_pair(descriptor: int) -> bool:
    import socket

    try:
        with socket.socket(fileno=os.dup(descriptor)) as end:
            return end.family == socket.AF_UNIX and not end.getsockname() and not end.getpeername()
    except OSError:
        return False


def _own_pipes() -> set[int]:
    """Return the inodes of the pipes that have both ends open in this process."""
    found: dict[int, int] = {}
    for name in os.listdir("/proc/self/fd"):
        try:
            status = os.fstat(int(name))
        except OSError:
            continue
        if stat.S_ISFIFO(status.st_mode):
            found[status.st_ino] = found.get(status.st_ino, 0) + 1
    return {pipe for pipe, ends in found.items() if ends > 1}
