"""Lets time pass in a stepped run: it stands still between two commands of a test, or runs on, on the wall clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, TypeVar

from grader.runtime.model.errors import GraderError
from grader.runtime.model.quantities import NS_PER_S, is_number
from grader.runtime.model.trace import ClockKind, Observation
from grader.runtime.plan import Plan
from grader.runtime.session import LentWorker, SteppedRun
from grader.runtime.steps import Advance, Command, StartProcesses
from grader.world.errors import StepTimeout
from grader.world.observed import Observed

Value = TypeVar("Value")
#: How long `settle` waits on the wall clock: a reaction takes some milliseconds, tens of them on a busy machine.
REAL_SETTLE_S = 0.1


def given_ns(what: str, value: Any) -> int:
    """Return seconds that a test gives as nanoseconds; raises ValueError if it is not a finite number."""
    if not is_number(value) or not math.isfinite(value):
        raise ValueError(f"{what}: expected a number of seconds, found {value!r}")
    return round(value * NS_PER_S)


class StepSession(Protocol):
    """What the runs of worlds are stepped in."""

    def begin(self, plan: Plan) -> LentWorker:
        """Return a worker that has begun a run."""


class Participant(Protocol):
    """A part of a world that has to know what commands lead to."""

    def note(self, command: Command | None, told: Mapping[str, Any], observations: Sequence[Observation]) -> None:
        """Take in what a command has led to.

        Args:
            command: The command; None for the end of the run.
            told: What the worker has answered.
            observations: What was observed since the command before it.
        """

    def complain(self) -> None:
        """Raise what the test has to know at once, such as that a program has failed."""


class Timeline:
    """The time of a run: the commands of a test are carried out in it, in the order of its lines.

    Args:
        session: Lends the worker.
        plan: Of the run.
        observed: Keeps what is observed.

    Attributes:
        run: The run.
        is_real: Whether time is that of the wall clock, and passes by itself.
    """

    def __init__(self, session: StepSession, plan: Plan, observed: Observed) -> None:
        self.is_real = plan.clock == ClockKind.WALL.value
        self._observed = observed
        self._participants: list[Participant] = []
        self._answers: dict[str, Callable[[Mapping[str, Any]], Any]] = {}
        self._starting = self._judging = False
        self._shown = 0  # how many observations since the last command somebody who answers has seen already
        self.run = SteppedRun(session.begin(plan), self._answered)

    def join(self, participant: Participant, **answers: Callable[[Mapping[str, Any]], Any]) -> None:
        """Let a part of the world know what commands lead to; those that joined first know it first.

        Args:
            participant: The part.
            **answers: The questions of the worker that it answers, by what they ask for.
        """
        self._participants.append(participant)
        self._answers |= answers

    def _answered(self, question: Mapping[str, Any], observations: Sequence[Observation]) -> Any:
        self._show(observations)
        return self._answers[question["ask"]](question)

    @property
    def now_ns(self) -> int:
        """The time since the run began; on the wall clock that of the last command."""
        return self.run.now_ns

    def begin_ns(self) -> int:
        """Return the time at which a wait begins, or at which somebody looks at the clock."""
        __tracebackhide__ = True
        if self.is_real:
            self.catch_up()
        return self.run.now_ns

    def perform(self, command: Command) -> dict[str, Any]:
        """Carry out a command, and return what the worker answers; raises what participants complain of."""
        __tracebackhide__ = True
        if self.run.is_busy:
            raise RuntimeError("a function that answers for the test cannot let time pass or act on the programs")
        if self._starting and not isinstance(command, (StartProcesses, Advance)):
            self.catch_up()
        self._starting = isinstance(command, StartProcesses) and not command.settle
        told, observations = self.run.perform(command)
        self._tell(command, told, observations)
        if self.run.full:
            raise GraderError(f"the test was ended: {self.run.full}")
        for participant in self._participants:
            participant.complain()
        return told

    def _tell(self, command: Command | None, told: Mapping[str, Any], observations: Sequence[Observation]) -> None:
        self._show(observations)
        self._shown = 0
        for participant in self._participants:
            participant.note(command, told, observations)

    def _show(self, observations: Sequence[Observation]) -> None:
        """Let the test see what was observed since the last command."""
        self._observed.add(observations[self._shown :])
        self._shown = len(observations)

    def catch_up(self) -> None:
        """Learn what has happened since the last command, before the test looks or time passes.

        On the virtual clock, that is the start of the programs that were started last: where a seed draws their order,
        they start together. While a condition is looked at, nothing changes.
        """
        __tracebackhide__ = True
        stands_still = self.run.is_busy or self.run.is_closed or self._judging
        if (self._starting or self.is_real) and not stands_still:
            self.perform(Advance(self.run.now_ns))

    def caught_up(self, look: Callable[[], Value]) -> Callable[[], Value]:
        """Return a function that looks at what has happened until now."""

        def looked() -> Value:
            __tracebackhide__ = True
            self.catch_up()
            return look()

        return looked

    def advance(self, seconds: float) -> None:
        """Let so many seconds pass, with everything that happens at their end."""
        __tracebackhide__ = True
        duration_ns = given_ns("advance", seconds)
        if duration_ns < 0:
            raise ValueError(f"expected seconds to advance, found {seconds:g}: time does not go back")
        self.perform(Advance(self.begin_ns() + duration_ns))

    def settle(self) -> None:
        """Let everything happen that happens now; on the wall clock nobody knows when that is complete."""
        __tracebackhide__ = True
        self.advance(REAL_SETTLE_S if self.is_real else 0.0)

    def wait(self, look: Callable[[], Value | None], timeout: float, too_late: Callable[[int], StepTimeout]) -> Value:
        """Let time pass until a function returns something true, and return that.

        Args:
            look: Looks whenever something was observed.
            timeout: Seconds to wait at most.
            too_late: Called with the time at which the wait began, in nanoseconds; returns what to raise.
        """
        __tracebackhide__ = True
        duration_ns, since_ns = given_ns("timeout", timeout), self.begin_ns()
        deadline_ns = since_ns + duration_ns
        self.perform(Advance(self.run.now_ns))
        while not (found := self._looked(look)) and self.run.now_ns < deadline_ns:
            self.perform(Advance(deadline_ns, until_news=True))
        if not found:
            raise too_late(since_ns)
        return found

    def _looked(self, look: Callable[[], Value]) -> Value:
        """Return what a function returns, all of whose looks show the same moment."""
        __tracebackhide__ = True
        self._judging = True
        try:
            return look()
        finally:
            self._judging = False

    def close(self) -> None:
        """End the run; what was observed can still be looked at."""
        if not self.run.is_closed:
            self._tell(None, {}, self.run.close())
