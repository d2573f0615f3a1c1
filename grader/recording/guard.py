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
from dataclasses import replace

from grader.model.limits import Limits
from grader.model.quantities import MIB, size
from grader.model.trace import Trace
from grader.recording.scratch import scratch_names
from grader.recording.student import Student
from grader.recording.usage import Usage, families, starved_ns, usage

#: How often it looks, and every how many looks it searches for new children.
LOOK_S = 0.025
SEARCH_EVERY = 10
#: Processes of the sandbox around a student's, which the system does not count, and some more: it should be first.
WRAPPERS = 16
#: Files and folders in one scratch folder; log files and caches of an ordinary node are a dozen.
MOST_NAMES = 10_000
#: What the worker itself may fill beyond its size at the start: messages that have come and were not yet taken.
UNREAD_BYTES = 512 * MIB
#: Out of real time with this share of it spent waiting for a processor, a run says nothing about the nodes.
STARVED_SHARE = 0.25


class Guard:
    """A thread beside the conductor's, for as long as its block lasts.

    Args:
        students: Whom to watch.
        limits: What each may use.
    """

    def __init__(self, students: Sequence[Student], limits: Limits) -> None:
        self._students = students
        self._limits = limits
        self._families: dict[int, set[int]] = {}
        self._deadline_ns = time.monotonic_ns() + limits.wall_ns
        self._own_bytes = usage([os.getpid()]).memory_bytes
        self._over = threading.Event()
        self._starved = False
        self._thread = threading.Thread(target=self._watch, name="guard", daemon=True)

    def __enter__(self) -> Guard:
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

    def _watch(self) -> None:
        looks = 0
        while not self._over.wait(LOOK_S):
            if looks % SEARCH_EVERY == 0:
                self._families = families([s.process.pid for s in self._students])
                self._look_for_names()
            looks += 1
            self._look()

    def _look(self) -> None:
        for student in self._students:
            used = usage(self._families.get(student.process.pid, ()))
            student.most_threads = max(student.most_threads, used.threads)
            student.most_bytes = max(student.most_bytes, used.memory_bytes)
            self._hold(student, self._reached(used))
        if usage([os.getpid()]).memory_bytes > self._own_bytes + UNREAD_BYTES:
            self._hold_all(f"stopped at {size(UNREAD_BYTES)} of messages that were under way at once")
        if time.monotonic_ns() > self._deadline_ns:
            self._end_time()

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

    def _end_time(self) -> None:
        if any(not s.ended and not s.stopped for s in self._students):
            pids = [pid for family in self._families.values() for pid in family]
            self._starved = starved_ns(pids) > STARVED_SHARE * self._limits.wall_ns
        self._hold_all(f"stopped after {self._limits.wall_words()}")

    def _hold_all(self, why: str) -> None:
        for student in self._students:
            self._hold(student, why)

    def _hold(self, student: Student, why: str) -> None:
        if why and not student.stopped:
            student.stop(why, self._families.get(student.process.pid, set()))
