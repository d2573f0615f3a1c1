"""Holds the budget of real time that the recordings of a submission share."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from grader.runtime.model.quantities import NS_PER_S, duration
from grader.runtime.model.trace import AssessedTrace, ClockKind, Fault, FaultKind

if TYPE_CHECKING:
    from grader.runtime.plan import Plan

#: The budget of recordings that do not belong to one submission: effectively unlimited.
FOREVER_S = 1e9
#: If the nodes spent more than this share of the real time waiting for processors, a used-up budget is not their fault.
STARVED_SHARE = 0.25


class RealTimeBudget:
    """A budget of real time that starts when it is created, and that parallel recordings share.

    Args:
        seconds: Size of the budget.
        spent_s: How much of it was spent before.
        now_ns: A clock in nanoseconds that never goes back.
    """

    def __init__(
        self, seconds: float = FOREVER_S, *, spent_s: float = 0.0, now_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self._total_ns = round(seconds * NS_PER_S)
        self._now_ns = now_ns
        self._started_ns = now_ns() - round(spent_s * NS_PER_S)
        self._real_ns = self._starved_ns = 0
        self._lock = threading.Lock()

    @property
    def left_ns(self) -> int:
        """Real time that is left, in nanoseconds; 0 if it is used up."""
        return max(0, self._total_ns - (self._now_ns() - self._started_ns))

    @property
    def _exceeded(self) -> str:
        return f"the recordings of this submission took more than {duration(self._total_ns)} of real time"

    @property
    def words(self) -> str:
        """The reason to give when a recording is ended or not started; the same in every run."""
        return f"stopped: {self._exceeded}"

    def charge(self, real_ns: int, starved_ns: int) -> None:
        """Account for a recording.

        Args:
            real_ns: Real time that it took.
            starved_ns: How much of that the nodes waited for processors that other programs used.
        """
        with self._lock:
            self._real_ns += real_ns
            self._starved_ns += starved_ns

    def unrecorded(self, plan: Plan) -> AssessedTrace:
        """Return the trace of a scenario for which no time is left: a fault of the nodes, or a harness problem."""
        clock = ClockKind(plan.clock)
        if self._starved_ns > STARVED_SHARE * self._real_ns:
            problem = f"the machine was too busy: {self._exceeded}"
            return AssessedTrace(plan.scenario, clock, stop_ns=0, observations=(), harness_problem=problem)
        faults = tuple(Fault(0, name, FaultKind.KILLED, self.words) for name, _ in plan.processes)
        return AssessedTrace(plan.scenario, clock, stop_ns=plan.duration_ns, observations=faults)
