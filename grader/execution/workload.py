"""Measures, from outside, how long the steps of a student's process take, and how late it would be on a real clock.

Virtual time stands still while a process works. The worker therefore takes the real time of each step, less what the
process spent waiting for a processor, and the processor time that the kernel counts; the larger one is what the step
would cost on any machine. What a process says about itself plays no part.
"""

from __future__ import annotations

import os
import threading
import time

from grader.core.quantities import NS_PER_MS, NS_PER_S
from grader.execution.usage import innermost, starved_ns, thread_starved_ns

#: A step that is this much longer than its processor time may have waited for a processor: only then that is looked up.
UNEXPLAINED_NS = 2 * NS_PER_MS
#: How long a step may wait for messages that are on their way to it; more counts as the process's own waiting.
ARRIVAL_NS = 20 * NS_PER_MS
#: A wake-up is late when the work before it would have held it up by more than this, or took longer than that itself:
#: making a node takes up to 100 ms, and checks wait 250 ms for an answer.
LATE_NS, SLOW_NS = 40 * NS_PER_MS, 200 * NS_PER_MS
#: Virtual time hides too much when more than this share of the wake-ups are late, and more than so many.
LATE_SHARE, LATE_AT_LEAST = 0.05, 3
#: A loop with a pause, or a timer that is set again, is put off by its own work each time. It matters beyond this share
#: of the time; not counting the longest pieces of work, and what the grader costs for each step and each pause in it.
DRIFT_SHARE, LONGEST = 0.08, 3
STEP_NS, PAUSE_NS = 3 * NS_PER_MS // 2, NS_PER_MS
#: What each of the polls of a busy loop may cost, and how many there may be in a step: on a real clock such a loop
#: makes as many as there is time for, and is not late by them.
POLL_NS, MOST_POLLS = NS_PER_MS // 2, 10
#: Beyond this delay there is no need to go on in virtual time.
HOPELESS_NS = 2 * NS_PER_S


class Delay:
    """By how much a process would be late on a real clock.

    It follows Lindley's recursion for queues: each wake-up inherits what the work before it took beyond the time until
    then. What a program does until it first waits delays nothing: it only starts later.

    Args:
        start_ns: Virtual time at which the program starts.

    Attributes:
        wake_ups: Moments of virtual time at which the process went on after waiting.
        late: How many of them would have come late, or followed a long piece of work.
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
        """Note that the process goes on at a virtual time."""
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
        """Note what the process did at this moment would have taken."""
        self._work_ns += real_ns

    def put_off(self, real_ns: int) -> None:
        """Note that what comes next is counted from the end of some work, however much time there is."""
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
        """Whether that is clear, however the run goes on."""
        return not self._starting and self._delay_ns + self._work_ns > HOPELESS_NS


class Workload:
    """The steps of one process, measured.

    Args:
        root: The process that was started; the program may run in a child of it.
        start_ns: Virtual time at which the program starts.

    Attributes:
        delay: What the steps add up to.
        used_ns: Processor time.
        waited_ns: What the steps took beyond that, without waiting for a processor.
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
        """Note that the process is about to be told to go on, at a virtual time."""
        self.delay.wake(t_ns)
        self._began_ns, self._used_before_ns = time.monotonic_ns(), self._used()

    def arrived(self) -> None:
        """Note that the process has waited for what was on its way to it, and goes on by itself."""
        self._began_ns = min(time.monotonic_ns(), self._began_ns + ARRIVAL_NS)

    def end(self, *, counted: bool = False, moved: object = 0) -> None:
        """Note that the process has said that it waits, or has ended.

        Args:
            counted: Whether a pause, or a timer's period, began in this step.
            moved: How many pauses or polls there were inside of it; more than a few are not believed.
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
        """Return the processor time that the process has used; 0 once it has ended."""
        try:
            return time.clock_gettime_ns(self._clock)
        except OSError:
            return 0

    def _starved(self) -> int:
        """Return how long the process's threads and this one were ready to run and had to wait for a processor."""
        return starved_ns([self._pid]) + thread_starved_ns(os.getpid(), threading.get_native_id())


def _processor_clock(pid: int) -> int:
    """Return the clock of a process's processor time, as clock_getcpuclockid(3) makes it."""
    return ~pid << 3 | 2
