"""Checks, in real time, that the student's code does not hang; if it does, reports its stack and ends the process."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from . import originals
from .faults import Describer
from .link import Link
from .protocol import Exited

if TYPE_CHECKING:
    from .virtual import VirtualTime

NS_PER_S = 1_000_000_000
#: How often the watchdog looks: often enough for limits of seconds, and rarely enough to take no processor time that
#: counts.
INTERVAL_S = 0.1


class Watchdog:
    """A thread of the host that watches the student's threads.

    Args:
        link: The connection to the grader.
        time: Provides since when the student's code has been running.
        describer: Describes the student's stack.
        limits: `start_cpu_s` and `wake_up_cpu_s`: processor seconds until the program first blocks, and between two
            blocks; `blocked_s`: real seconds that it may block outside of virtual time.
    """

    def __init__(self, link: Link, time: VirtualTime, describer: Describer, limits: dict[str, float]) -> None:
        self._link = link
        self._time = time
        self._describer = describer
        self._start_cpu_s = limits["start_cpu_s"]
        self._wake_up_cpu_s = limits["wake_up_cpu_s"]
        self._blocked_s = limits["blocked_s"]
        self._stopped = False

    def start(self) -> None:
        """Start watching."""
        originals.start_new_thread(self._watch, ())

    def stop(self) -> None:
        """Stop watching, because the program has ended."""
        self._stopped = True

    def _watch(self) -> None:
        blocked_s, used_before = 0.0, 0
        while not self._stopped:
            originals.sleep(INTERVAL_S)
            used = originals.processor_ns()
            if not self._time.running:
                blocked_s = 0.0
                continue
            limit_s = self._wake_up_cpu_s if self._time.has_blocked else self._start_cpu_s
            if used - self._time.resumed_ns > limit_s * NS_PER_S:
                unsettled = "threads" if self._time.scheduler.has_others() else ""
                self._give_up("wake_up_limit" if self._time.has_blocked else "start_limit", unsettled)
            idle = used - used_before < INTERVAL_S * NS_PER_S / 20 and self._sleeps()
            blocked_s = blocked_s + INTERVAL_S if idle else 0.0
            used_before = used
            if blocked_s > self._blocked_s:
                self.give_up_outside("blocked")

    def _sleeps(self) -> bool:
        """Return whether the thread that should run is asleep in the kernel, as opposed to waiting for a processor."""
        thread = self._time.scheduler.running_native_thread()
        try:
            with open(f"/proc/self/task/{thread}/stat", encoding="ascii", errors="replace") as stat:
                return stat.read().rpartition(")")[2].split()[0] == "S"
        except OSError:
            return False

    def give_up_outside(self, code: str) -> None:
        """End the process, because it is about to wait for something outside of virtual time; `code` says for what."""
        self._give_up(code, "outside")

    def _give_up(self, code: str, unsettled: str) -> None:
        """End the process; `code` is the reason, `unsettled` the reason for using the real clock, if there is one."""
        if self._stopped or not self._time.running:
            return
        frame = sys._current_frames().get(self._time.scheduler.running_thread() or -1)
        fault = self._describer.stack(frame, code)
        self._link.send(Exited(self._time.progress(), fault=fault, unsettled=unsettled))
        originals.exit_now(70)
