"""The runners that carry out commands on the virtual clock, and on the real one."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence

from grader.runtime.host.protocol import Go
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.trace import ClockKind, Endpoint, Observation, unmet_policy
from grader.runtime.plan import Plan, derive
from grader.runtime.stimuli.messages import PlannedMessages
from grader.runtime.worker.core import Core
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.stepped_runner import Question, Starter, SteppedRunner
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.virtual_runner import VirtualRunner, unfit
from grader.runtime.worker.wall_runner import WallRunner

#: How long, in real time, a new process may take until its node is in the graph, and the graph has then rested for so
#: long: a node creates its endpoints in turn.
COMES_UP_NS, RESTS_NS = 10 * NS_PER_S, 150 * NS_PER_MS
#: How long, in real time, a process may take to end after Ctrl-C before the test goes on.
ENDS_NS = 5 * NS_PER_S
#: How long, in real time, to wait until known subscriptions are matched with a new publisher; discovery takes some ten
#: milliseconds.
MATCHED_NS = 2 * NS_PER_S


class VirtualSteppedRunner(SteppedRunner, VirtualRunner):
    """Carries out commands on the virtual clock."""

    def unsuitable(self) -> str:
        """Return why virtual time does not suit the nodes; empty if it does."""
        return super().unsuitable() or unfit(self._students, self._faults, full=bool(self._recorder.full))

    def _advance(self, to_ns: int, *, until_news: bool = False) -> None:
        """Let time pass until a moment, with everything that happens at it.

        A plan ends before what happens at its end. A step includes it: whoever waits for a second expects the timer of
        that second. The loop therefore ends a nanosecond later, and no process is told of that nanosecond.
        """

        def is_enough() -> bool:
            return until_news and bool(self._recorder.observations)

        self._core.go_to(to_ns)
        self._carry_out(self._core.run_on(is_enough))
        self._core.arrive(early=bool(self._recorder.full) or is_enough())

    def _make_core(self) -> Core[NodeProcess]:
        shuffle = None
        if self._plan.drawn_order:
            shuffle = random.Random(derive(int(self._plan.host_seed, 16), "order")).shuffle  # noqa: S311
        return Core(self._students, self._agenda, includes_end=True, shuffle=shuffle)

    def _begin_process(self, student: NodeProcess, delay_ns: int) -> None:
        self._core.waits(student, self._core.now_ns + delay_ns)

    def _await_start(self, started: Sequence[NodeProcess]) -> None:
        del started
        self._advance(self._core.now_ns)

    def _interrupt(self, student: NodeProcess) -> None:
        self._core.go_to(self._core.now_ns)
        super()._interrupt(student)

    def _await_end(self, student: NodeProcess) -> None:
        del student
        self._advance(self._core.now_ns)

    def _lose(self, student: NodeProcess) -> None:
        self._discovery.lose(student)
        self._core.ended(student)


class WallSteppedRunner(SteppedRunner, WallRunner):
    """Carries out commands on the real clock, where programs run on between two commands."""

    def __init__(
        self, plan: Plan, students: list[NodeProcess], observer: Observer, start: Starter, ask: Question
    ) -> None:
        super().__init__(plan, students, observer, start, ask)
        self._begin()
        self._changed_ns = 0  # when the graph has changed for the last time

    def news(self) -> list[Observation]:
        """Return what was observed since the last call, and forget it."""
        self._sent_ns.clear()
        return super().news()

    def look(self) -> None:
        """Record what has arrived, and the graph as it is."""
        self._look(self._time_ns())
        self._look_at_graph(self._time_ns())

    def idle(self) -> None:
        """Record what happens between two commands, for as long as one pause takes."""
        self._agenda.end_ns = self._time_ns() + self.longest_pause_ns
        self._look(self._time_ns())
        self._pause()

    def _advance(self, to_ns: int, *, until_news: bool = False) -> None:
        self._await(lambda: until_news and bool(self._recorder.observations), to_ns)

    def _await(self, condition: Callable[[], bool], until_ns: int) -> None:
        """Record what happens until a condition holds, or until a moment; it is looked at once at least."""
        while True:
            self._agenda.end_ns = until_ns
            self._look(self._time_ns())
            if condition() or self._recorder.full or self._time_ns() >= until_ns:
                return
            self._pause()

    def _look_at_graph(self, now_ns: int) -> bool:
        changed = super()._look_at_graph(now_ns)
        if changed:
            self._changed_ns = now_ns
        return changed

    def _begin_process(self, student: NodeProcess, delay_ns: int) -> None:
        if not delay_ns:
            student.tell(Go())

    def _await_start(self, started: Sequence[NodeProcess]) -> None:
        others = len(self._observer.students_nodes())

        def are_up() -> bool:
            running = sum(not student.ended for student in started)
            if running and len(self._observer.students_nodes()) < others + running:
                self._changed_ns = self._time_ns()
            return not running or self._time_ns() - self._changed_ns >= RESTS_NS

        self._await(are_up, self._time_ns() + COMES_UP_NS)

    def _await_end(self, student: NodeProcess) -> None:
        self._await(lambda: student.ended, self._time_ns() + ENDS_NS)

    def _lose(self, student: NodeProcess) -> None:
        """Do nothing: the middleware itself notices after a while that nobody answers."""

    def _await_readers(self, offer: PlannedMessages) -> None:
        reliability = "best_effort" if offer.best_effort else "reliable"
        durability = "transient_local" if offer.latched else "volatile"
        publisher = Endpoint("publisher", offer.topic, offer.type, "", -1, reliability, durability)

        def are_matched() -> bool:
            ends = self._recorder.graph.endpoints
            heard = [e for e in ends if (e.kind, e.topic, e.type) == ("subscription", offer.topic, offer.type)]
            fitting = sum(unmet_policy(publisher, end) is None for end in heard)
            return self._observer.subscribers_matched(offer.topic) >= fitting

        self._await(are_matched, self._time_ns() + MATCHED_NS)


#: The runner of each clock.
STEPPED: Mapping[str, Callable[..., SteppedRunner]] = {
    ClockKind.VIRTUAL.value: VirtualSteppedRunner,
    ClockKind.WALL.value: WallSteppedRunner,
}
