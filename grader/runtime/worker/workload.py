"""Measures, from outside, how long the steps of a student's process take; `Delay` says how late that would make it.

Virtual time stands still while a process works. The worker therefore measures the real time of each step, minus the
time that the process waited for a processor, and the processor time that the kernel counts. The larger of the two is
the cost of the step on an idle machine. Nothing that the process reports about itself is used as a measurement.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from grader.runtime import usage
from grader.runtime.host.protocol import Progress
from grader.runtime.model.quantities import NS_PER_MS
from grader.runtime.usage import Kernel
from grader.runtime.worker.delay import ARRIVAL_NS, BESIDE_FREE_NS, Delay

#: Only if a step takes this much longer than its processor time, its waiting time for a processor is read.
UNEXPLAINED_NS = 2 * NS_PER_MS
#: Processor time that the middleware's threads may use while the program waits for its turn.
UNATTENDED_NS = 2 * NS_PER_MS


class Workload:
    """Measures the steps of one process.

    Args:
        root: Pid of the started process; the program may run in a child of it.
        start_ns: Virtual time at which the program starts.
        kernel: Reads how long threads waited for a processor.

    Attributes:
        delay: The resulting delay.
        used_ns: Processor time of the steps.
        waited_ns: Real time of the steps beyond that, not counting waits for a processor.
    """

    def __init__(self, root: int, start_ns: int, kernel: Kernel = usage) -> None:
        self._kernel = kernel
        # A sandbox is a chain of processes, of which the last is the program.
        self._pid = kernel.innermost(root)
        self._clock = _processor_clock(self._pid)
        self._began_ns = self._used_before_ns = self._at_ns = self._forgiven_ns = 0
        self._moved_on = self._may_arrive = False
        self._begun = False
        self._threads_ns: dict[str, int] = {}
        self._own_ns = 0
        self._starved()
        self.delay = Delay(start_ns)
        self.used_ns = 0
        self.waited_ns = 0

    def begin(self, t_ns: int, *, arrivals: bool = False) -> None:
        """Note that the process is about to continue at a virtual time, with messages on their way to it or not."""
        used_ns = self._used()
        if self._begun:  # threads of its own may work while it waits for its turn
            self._count(max(0, used_ns - self._used_before_ns - UNATTENDED_NS))
        self.delay.wake(t_ns)
        self._moved_on, self._at_ns, self._begun = t_ns > self._at_ns or not self._begun, t_ns, True
        # Forgiven once in each step, or a program could report arrivals to make all of its work free.
        self._may_arrive, self._forgiven_ns = arrivals, 0
        self._began_ns, self._used_before_ns = time.monotonic_ns(), used_ns

    def arrived(self) -> None:
        """Note that the process has received the messages that were on their way, and continues; once in a step."""
        if self._may_arrive:
            self._may_arrive = False
            self._forgiven_ns = min(time.monotonic_ns() - self._began_ns, ARRIVAL_NS)
            self._began_ns += self._forgiven_ns

    def end(self, progress: Progress, passed_ns: int = 0) -> None:
        """Note that the process has reported that it waits or has ended.

        Args:
            progress: What it reports of the step.
            passed_ns: The virtual time that has passed in the step.
        """
        taken_ns = self._taken(threads=progress.threads)
        self.delay.step(taken_ns, progress, passed_ns, forgiven_ns=self._forgiven_ns, moved_on=self._moved_on)

    @contextmanager
    def beside(self) -> Iterator[None]:
        """Measure what a process does within the block, beside its steps, because the grader makes it wait."""
        used_ns = self._used()
        self._count(max(0, used_ns - self._used_before_ns - UNATTENDED_NS))
        self._began_ns, self._used_before_ns = time.monotonic_ns(), used_ns
        try:
            yield
        finally:
            # most waits take less: nothing more is read
            self.delay.beside(self._taken(unexplained_ns=BESIDE_FREE_NS))

    def _count(self, real_ns: int) -> None:
        self.delay.work(real_ns)
        self.delay.take(real_ns)

    def _taken(self, *, threads: bool = True, unexplained_ns: int = UNEXPLAINED_NS) -> int:
        """Return what the process has taken since the last beginning, and add it to the sums."""
        real_ns = time.monotonic_ns() - self._began_ns
        before_ns, self._used_before_ns = self._used_before_ns, self._used()
        used_ns = max(0, self._used_before_ns - before_ns)
        # Reading how long threads waited takes a while, and is needed only where real time and processor time differ.
        if real_ns - used_ns > unexplained_ns:
            real_ns -= min(self._starved(threads=threads), real_ns)
        taken_ns = max(used_ns, real_ns)
        self.used_ns += used_ns
        self.waited_ns += taken_ns - used_ns
        return taken_ns

    def _used(self) -> int:
        """Return the processor time of the process, in nanoseconds; 0 once it has ended."""
        try:
            return time.clock_gettime_ns(self._clock)
        except OSError:
            return 0

    def _starved(self, *, threads: bool = True) -> int:
        """Return how long the process and this thread were ready but waited for a processor, since the last time.

        One thread of the program runs at a time. If it was not the first, only the one that waited longest counts: many
        threads together could have waited for longer than the step took.
        """
        before, own_ns = self._threads_ns, self._own_ns
        self._threads_ns = self._kernel.threads_starved_ns([self._pid])
        self._own_ns = self._kernel.thread_starved_ns(os.getpid(), threading.get_native_id())
        names = self._threads_ns.keys() if threads else {str(self._pid)}
        longest_ns = max((self._threads_ns.get(name, 0) - before.get(name, 0) for name in names), default=0)
        return max(0, longest_ns) + max(0, self._own_ns - own_ns)


def _processor_clock(pid: int) -> int:
    """Return the id of a process's CPU-time clock, as clock_getcpuclockid(3) computes it."""
    return ~pid << 3 | 2
