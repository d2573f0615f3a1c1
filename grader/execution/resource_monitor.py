"""Watches, from the worker, what students' processes use; ends one at its limit and says which limit it was.

The system's own limits count address space and processor time of single processes: several together, or memory that is
only mapped, would be told wrongly or not at all. The guard adds up what is really used. It sees a limit a little late,
by what a process can use between two looks; the system's limits stand behind it.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from grader.core.limits import Limits
from grader.core.quantities import MIB, size
from grader.core.trace import Trace
from grader.execution.student_process import NodeProcess
from grader.execution.usage import Usage, families, scratch_names, starved_ns, usage

#: How often it looks, and every how many looks it searches for new children.
LOOK_S = 0.025
SEARCH_EVERY = 10
#: Processes of the sandbox around a student's, which the system does not count, and some more: it should be first.
WRAPPERS = 16
#: Files and folders in one scratch folder; log files and caches of an ordinary node are a dozen.
MOST_NAMES = 10_000
#: What the worker itself may fill beyond its size at the start: messages that have come and were not yet taken.
UNREAD_BYTES = 512 * MIB
#: Out of real time with this share of it spent waiting for a processor, a run says nothing about the nodes; unless
#: they had so much of all processor time themselves: then it was they who kept the processors.
STARVED_SHARE, OWN_SHARE = 0.25, 0.5


@dataclass(frozen=True, slots=True)
class Budget:
    """What is left of the real time that a submission may take.

    Attributes:
        left_ns: Real time.
        words: Why a recording is ended when it is used up.
    """

    left_ns: int
    words: str


class ResourceMonitor:
    """A thread beside the conductor's, for as long as its block lasts.

    Args:
        students: Whom to watch.
        limits: What each may use.
        budget: What is left for the submission, if there is such a limit.
    """

    def __init__(self, students: Sequence[NodeProcess], limits: Limits, budget: Budget | None = None) -> None:
        self._students = students
        self._limits = limits
        self._budget = budget
        self._families: dict[int, set[int]] = {}
        self._started_ns = time.monotonic_ns()
        self._own_bytes = usage([os.getpid()]).memory_bytes
        self._own_ns = time.process_time_ns()
        self._over = threading.Event()
        self._starved = False
        self._ending = False
        self._used_ns = self._waited_ns = 0
        self._thread = threading.Thread(target=self._watch, name="guard", daemon=True)

    def __enter__(self) -> ResourceMonitor:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def reviewed(self, trace: Trace) -> Trace:
        """Return a trace, with a problem of the machine's if that is why its time ran out."""
        if not self._starved or trace.harness_problem:
            return trace
        problem = "the machine was too busy: the nodes waited for a processor until their time was over"
        return replace(trace, harness_problem=problem)

    @property
    def real_ns(self) -> int:
        """Real time since the start."""
        return time.monotonic_ns() - self._started_ns

    @property
    def starved_ns(self) -> int:
        """Real time that the nodes have lost to others on this machine."""
        processors = len(os.sched_getaffinity(0))
        their_own = self._used_ns > OWN_SHARE * processors * self.real_ns
        return 0 if their_own else min(self._waited_ns, self.real_ns)

    def _watch(self) -> None:
        looks = 0
        while not self._over.wait(LOOK_S):
            if looks % SEARCH_EVERY == 0:
                self._families = families([s.process.pid for s in self._students])
                self._look_for_names()
                self._look_for_waiting()
            looks += 1
            self._look()

    def _look(self) -> None:
        for student in self._students:
            used = usage(self._families.get(student.process.pid, ()))
            student.most_threads = max(student.most_threads, used.threads)
            student.most_bytes = max(student.most_bytes, used.memory_bytes)
            student.used_ns = max(student.used_ns, used.processor_ns)
            self._hold(student, self._reached(used))
        self._look_at_itself()
        self._look_at_time()

    def _look_at_itself(self) -> None:
        """Hold everybody at a limit of the worker's own: nothing but what the nodes send brings it there."""
        filled_bytes = usage([os.getpid()]).memory_bytes - self._own_bytes
        if filled_bytes > UNREAD_BYTES:
            self._hold_all(f"stopped at {size(UNREAD_BYTES)} of messages that were under way at once")
        if time.process_time_ns() - self._own_ns > self._limits.processor_ns:
            self._hold_all(f"stopped at {self._limits.processor_words()} to take what was sent")

    def _look_at_time(self) -> None:
        if self._ending:
            return
        real_ns = self.real_ns
        if self._budget is not None and real_ns > self._budget.left_ns:
            self._end_time(self._budget.words)
        elif real_ns > self._limits.wall_ns:
            self._end_time(f"stopped after {self._limits.wall_words()}")

    def _look_for_waiting(self) -> None:
        pids = [pid for family in self._families.values() for pid in family]
        self._used_ns = max(self._used_ns, usage(pids).processor_ns)
        self._waited_ns = max(self._waited_ns, starved_ns(pids))

    def _look_for_names(self) -> None:
        for student in self._students:
            if scratch_names(self._families.get(student.process.pid, ())) > MOST_NAMES:
                self._hold(student, f"stopped at {MOST_NAMES:,} files in one folder")

    def _reached(self, used: Usage) -> str:
        """Return which limit was reached, in words; empty if none was."""
        limits = self._limits
        if used.memory_bytes > limits.memory_bytes:
            return f"stopped at {limits.memory_words()}"
        if used.processor_ns > limits.processor_ns:
            return f"stopped at {limits.processor_words()}"
        if used.halted:
            return "stopped: a signal had halted it for good"
        if used.threads > limits.processes + WRAPPERS:
            return f"stopped at {limits.processes_words()}"
        return ""

    def _end_time(self, why: str) -> None:
        self._look_for_waiting()
        if any(not s.ended and not s.stopped for s in self._students):
            self._starved = self.starved_ns > STARVED_SHARE * self.real_ns
        self._hold_all(why)

    def _hold_all(self, why: str) -> None:
        self._ending = True
        for student in self._students:
            self._hold(student, why)

    def _hold(self, student: NodeProcess, why: str) -> None:
        if why and not student.stopped:
            student.stop(why, self._families.get(student.process.pid, set()))
