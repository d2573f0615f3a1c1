"""What host and worker do alike in real time: clock and thread functions, saved before any is replaced, and waits."""

import _thread
import contextlib
import os
import time
from collections.abc import Callable

sleep = time.sleep
perf_counter = time.perf_counter
time_ns = time.time_ns
thread_time = time.thread_time
allocate_lock = _thread.allocate_lock
get_ident = _thread.get_ident
get_native_id = _thread.get_native_id
start_new_thread = _thread.start_new_thread
urandom = os.urandom
exit_now = os._exit
kill = os.kill


#: The most real time that one iteration of a wait counts for; on an idle machine each is shorter.
ITERATION_S = 0.02


def wait_until(
    condition: Callable[[], object],
    seconds: float,
    pause_s: float = 0.0005,
    *,
    now_s: Callable[[], float] = perf_counter,
    pause: Callable[[float], None] = sleep,
) -> bool:
    """Wait, in real time, until a condition holds; return whether it did before the time-out.

    An iteration that took longer than `ITERATION_S` counts for no more: meanwhile this process had no processor.
    """
    left_s, before = seconds, now_s()
    while not condition():
        if left_s < 0:
            return False
        pause(pause_s)
        now = now_s()
        left_s -= min(now - before, ITERATION_S)
        before = now
    return True


def unread_bytes() -> int:
    """Return the number of unread bytes in all UDP sockets of this network namespace, from /proc/net/udp (proc(5))."""
    unread = 0
    for name in ("udp", "udp6"):
        with contextlib.suppress(OSError), open(f"/proc/net/{name}", encoding="ascii") as table:
            unread += sum(int(row.split()[4].partition(":")[2], 16) for row in table.readlines()[1:])
    return unread


def processor_ns() -> int:
    """Return the processor time that this process has used, in nanoseconds."""
    return time.clock_gettime_ns(time.CLOCK_PROCESS_CPUTIME_ID)


def starved_ns(thread: int) -> int:
    """Return how long a thread of this process was ready to run but waited for a processor; 0 if that is not known."""
    try:
        with open(f"/proc/self/task/{thread}/schedstat", encoding="ascii") as counted:
            return int(counted.read().split()[1])
    except (OSError, ValueError, IndexError):
        return 0
