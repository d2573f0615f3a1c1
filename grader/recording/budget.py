"""The real time that all recordings of one submission may take together."""

from __future__ import annotations

import threading
import time

from grader.model.quantities import NS_PER_S, duration
from grader.model.trace import ClockKind, Fault, FaultKind, Trace
from grader.recording.plan import Plan

#: More than anything takes, for recordings that are not of one submission.
FOREVER_S = 1e9
#: Where nodes lost more than this share of it to others on the machine, a budget that is used up says nothing of them.
STARVED_SHARE = 0.25


class RealTimeBudget:
    """Real time from its making on; several recordings may go on at once.

    Args:
        seconds: How much there is.
    """

    def __init__(self, seconds: float = FOREVER_S) -> None:
        self._total_ns = round(seconds * NS_PER_S)
        self._started_ns = time.monotonic_ns()
        self._real_ns = self._starved_ns = 0
        self._lock = threading.Lock()

    @property
    def left_ns(self) -> int:
        """Real time that is left; 0 if it is used up."""
        return max(0, self._total_ns - (time.monotonic_ns() - self._started_ns))

    @property
    def _exceeded(self) -> str:
        return f"the recordings of this submission took more than {duration(self._total_ns)} of real time"

    @property
    def words(self) -> str:
        """Why a recording is ended, or not begun, when the time is used up; the same in every run."""
        return f"stopped: {self._exceeded}"

    def charge(self, real_ns: int, starved_ns: int) -> None:
        """Take note of a recording.

        Args:
            real_ns: What it took.
            starved_ns: How much of that the nodes waited for processors that others had.
        """
        with self._lock:
            self._real_ns += real_ns
            self._starved_ns += starved_ns

    def unrecorded(self, plan: Plan) -> Trace:
        """Return the trace of a scenario for which no time is left: the nodes' fault, or the machine's."""
        clock = ClockKind(plan.clock)
        if self._starved_ns > STARVED_SHARE * self._real_ns:
            problem = f"the machine was too busy: {self._exceeded}"
            return Trace(plan.scenario, clock, stop_ns=0, observations=(), harness_problem=problem)
        faults = tuple(Fault(0, name, FaultKind.KILLED, self.words) for name, _ in plan.processes)
        return Trace(plan.scenario, clock, stop_ns=plan.duration_ns, observations=faults)
