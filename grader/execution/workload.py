"""Measures, from outside, how long the steps of a student's process take, and how late it would be on a real clock.

Virtual time stands still while a process works. The worker therefore measures the real time of each step, minus the
time that the process waited for a processor, and the processor time that the kernel counts. The larger of the two is
the cost of the step on an idle machine. Nothing that the process reports about itself is used as a measurement.
"""

from __future__ import annotations

import os
import threading
import time

from grader.core.quantities import NS_PER_MS, NS_PER_S
from grader.execution.usage import innermost, thread_starved_ns, threads_starved_ns

#: Only if a step takes this much longer than its processor time, its waiting time for a processor is read.
UNEXPLAINED_NS = 2 * NS_PER_MS
#: How long a step may wait for messages that are on their way; more counts as the process's own waiting.
ARRIVAL_NS = 20 * NS_PER_MS
#: A wake-up is late if the work before it delays it by more than LATE_NS, or took longer than SLOW_NS. For comparison:
#: creating a node takes up to 100 ms, and checks wait 250 ms for an answer.
LATE_NS, SLOW_NS = 40 * NS_PER_MS, 200 * NS_PER_MS
#: Virtual time hides too much if more than this share of the wake-ups, and more than this number, are late.
LATE_SHARE, LATE_AT_LEAST = 0.05, 3
#: A loop with a pause, or a timer that is reset, is postponed by its own work each time. This matters if the work
#: exceeds DRIFT_SHARE of the time, not counting the LONGEST pieces of work and the grader's own cost of each step and
#: pause.
DRIFT_SHARE, LONGEST = 0.08, 3
STEP_NS, PAUSE_NS = 3 * NS_PER_MS // 2, NS_PER_MS
#: The allowed cost of each poll of a busy loop, and the most polls in a step: on a real clock such a loop polls as
#: often as time allows, and is not delayed by it.
POLL_NS, MOST_POLLS = NS_PER_MS // 2, 10
#: With a longer delay there is no point in continuing in virtual time.
HOPELESS_NS = 2 * NS_PER_S


class Delay:
    """Computes how late a process would be on a real clock.

    It follows Lindley's recursion for queues: a wake-up inherits the part of the previous work that exceeds the time
    between the two. Work before the first wait delays nothing: the program only starts later.

    Args:
        start_ns: Virtual time at which the program starts.

    Attributes:
        wake_ups: Number of moments of virtual time at which the process continued after waiting.
        late: How many of them would have been late, or followed a long piece of work.
    """

    def __init__(self, start_ns: int = 0) -> None:
        self._at_ns = start_ns
        self._starting = True
        self._work_ns = 0
        self._delay_ns = 0
        self._began_ns = start_ns
        self._put_off_ns = 0
        self._longest_ns = [0] * LONGEST
        self.wake_ups = 0
        self.late = 0

    def wake(self, t_ns: int) -> None:
        """Note that the process continues at a virtual time."""
        if t_ns <= self._at_ns:
            return
        if not self._starting:
            self.wake_ups += 1
            self._delay_ns = max(0, self._delay_ns + self._work_ns - (t_ns - self._at_ns))
            self.late += self._work_ns > SLOW_NS or self._delay_ns > LATE_NS
        else:
            self._began_ns = t_ns
        self._starting = False
        self._at_ns, self._work_ns = t_ns, 0

    def work(self, real_ns: int) -> None:
        """Add the time that the process would have worked at this moment."""
        self._work_ns += real_ns

    def put_off(self, real_ns: int) -> None:
        """Note that the next pause or period is counted from the end of some work."""
        if not self._starting:
            self._put_off_ns += max(0, real_ns)
            self._longest_ns = sorted([*self._longest_ns, real_ns])[1:]

    @property
    def hides(self) -> bool:
        """Whether virtual time hides how late the process would be."""
        return self.hopeless or self._drifts or self.late > max(LATE_AT_LEAST, LATE_SHARE * self.wake_ups)

    @property
    def _drifts(self) -> bool:
        return self._put_off_ns - sum(self._longest_ns) > DRIFT_SHARE * (self._at_ns - self._began_ns)

    @property
    def hopeless(self) -> bool:
        """Whether the process is so late that the rest of the run cannot change the result."""
        return not self._starting and self._delay_ns + self._work_ns > HOPELESS_NS


class Workload:
    """Measures the steps of one process.

    Args:
        root: Pid of the started process; the program may run in a child of it.
        start_ns: Virtual time at which the program starts.

    Attributes:
        delay: The resulting delay.
        used_ns: Processor time of the steps.
        waited_ns: Real time of the steps beyond that, not counting waits for a processor.
    """

    def __init__(self, root: int, start_ns: int) -> None:
        self._pid = innermost(root)
        self._clock = _processor_clock(self._pid)
        self._began_ns = self._used_before_ns = 0
        self._starved_before_ns = self._starved()
        self.delay = Delay(start_ns)
        self.used_ns = 0
        self.waited_ns = 0

    def begin(self, t_ns: int) -> None:
        """Note that the process is about to continue at a virtual time."""
        self.delay.wake(t_ns)
        self._began_ns, self._used_before_ns = time.monotonic_ns(), self._used()

    def arrived(self) -> None:
        """Note that the process has received the messages that were on their way, and continues."""
        self._began_ns = min(time.monotonic_ns(), self._began_ns + ARRIVAL_NS)

    def end(self, *, counted: bool = False, moved: object = 0) -> None:
        """Note that the process has reported that it waits or has ended.

        Args:
            counted: Whether a pause or a timer's period began in this step.
            moved: The reported number of pauses or polls in the step; capped at `MOST_POLLS`.
        """
        real_ns = time.monotonic_ns() - self._began_ns
        used_ns = max(0, self._used() - self._used_before_ns)
        if real_ns - used_ns > UNEXPLAINED_NS:
            before, self._starved_before_ns = self._starved_before_ns, self._starved()
            real_ns -= max(0, self._starved_before_ns - before)
        taken_ns = max(used_ns, real_ns)
        self.used_ns += used_ns
        self.waited_ns += taken_ns - used_ns
        moves = min(max(moved, 0), MOST_POLLS) if isinstance(moved, int) else 0
        self.delay.work(max(0, taken_ns - POLL_NS * moves))
        if counted:
            self.delay.put_off(taken_ns - STEP_NS - PAUSE_NS * moves)

    def _used(self) -> int:
        """Return the processor time of the process, in nanoseconds; 0 once it has ended."""
        try:
            return time.clock_gettime_ns(self._clock)
        except OSError:
            return 0

    def _starved(self) -> int:
        """Return how long the process's threads and this thread were ready to run but waited for a processor."""
        return sum(threads_starved_ns([self._pid])) + thread_starved_ns(os.getpid(), threading.get_native_id())


def _processor_clock(pid: int) -> int:
    """Return the id of a process's CPU-time clock, as clock_getcpuclockid(3) computes it."""
    return ~pid << 3 | 2
