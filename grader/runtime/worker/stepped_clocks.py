"""The runners that carry out commands on the virtual clock, and on the real one."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence

from grader.runtime.host.protocol import Expect, Go, MessagesArrived, Progress
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S, seconds
from grader.runtime.model.scenario import Event
from grader.runtime.model.step_event import ProgramStep
from grader.runtime.model.trace import ClockKind, Endpoint, Observation, unmet_policy
from grader.runtime.plan import Plan, PlannedConnection, derive
from grader.runtime.stimuli.messages import PlannedMessages
from grader.runtime.worker.core import Core, RunProcess, announce
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.step_log import StepLog
from grader.runtime.worker.stepped_runner import Question, Starter, SteppedRunner
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.transit import Transit
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


#: A pause of a program begins before one of its first steps, the start among them: races are about what comes first,
#: and a program at rest loses nothing by a pause.
PAUSED_STEPS = 6


@dataclass(frozen=True, slots=True)
class ArriveLate(Event):
    """A message arrives that a process holds because it is late."""

    process: str
    topic: str


@dataclass(frozen=True, slots=True)
class KillProgram(Event):
    """A fault kills a program."""

    process: str


class VirtualSteppedRunner(SteppedRunner, VirtualRunner):
    """Carries out commands on the virtual clock, with the faults of the plan."""

    goes_on = True

    def __init__(
        self, plan: Plan, students: list[NodeProcess], observer: Observer, start: Starter, ask: Question
    ) -> None:
        super().__init__(plan, students, observer, start, ask)
        self._log = StepLog(students)
        #: The steps in which the order is drawn; None for all.
        self._drawn = None if plan.drawn_steps is None else frozenset(plan.drawn_steps)
        #: How a process is late to hear of a topic, or loses its messages.
        self._ways: dict[tuple[str, str], Transit] = {}
        #: The number of the step of each program before which it is paused, and for how long.
        self._pauses: dict[str, tuple[int, int]] = {}
        self._own_steps: dict[str, int] = {}
        for fault in plan.faults:
            draw = random.Random(fault.seed)  # noqa: S311 - it has to repeat
            if fault.kind == "pause":
                self._pauses[fault.on] = draw.randrange(PAUSED_STEPS), draw.randint(fault.least_ns, fault.most_ns)
            elif fault.kind == "kill":
                self._agenda.later(KillProgram(draw.randint(fault.least_ns, fault.most_ns), fault.on))

    def steps(self) -> list[ProgramStep]:
        """Return what each program has done so far."""
        return self._log.steps()

    def _draws(self) -> bool:
        return self._plan.drawn_order and (self._drawn is None or self._core.step in self._drawn)

    def _step(self, run: RunProcess[NodeProcess]) -> None:
        process, now_ns = run.process, self._core.now_ns
        number = self._own_steps.get(process.name, 0)
        self._own_steps[process.name] = number + 1
        paused_before, pause_ns = self._pauses.get(process.name, (-1, 0))
        if number == paused_before and not process.stop_signalled:
            self._log.fault(now_ns, process, "paused", f"{seconds(pause_ns):.3g}")
            for channel, count in run.arrivals.items():
                announce(process, channel, count)
            process.resumes_ns, process.nudged = now_ns + pause_ns, True
            return
        self._log.begin(now_ns, process, self._core.step, deviates=self._core.deviates)
        super()._step(run)

    def _account(self, student: NodeProcess, progress: Progress, *, is_over: bool) -> None:
        before = student.claims
        super()._account(student, progress, is_over=is_over)
        self._log.told(self._core.now_ns, student, progress.did, before, drew=progress.drew)
        withheld, self._core.withheld = self._core.withheld, []
        for process, topic, count in withheld:
            self._send_late(process, topic, count)

    def _send_late(self, process: NodeProcess, topic: str, count: int) -> None:
        """Let a process take messages that do not arrive at once, and hold or lose them."""
        now_ns = self._core.now_ns
        if (process.name, topic) not in self._ways:
            late = {one.kind: one for one in self._plan.faults if one.on == topic}
            delay, lose = late.get("delay"), late.get("lose")
            delay_ns = (delay.least_ns, delay.most_ns) if delay else (0, 0)
            # of its own for each process that hears the topic; the faults of a topic follow from one seed
            seed = derive(int(next(iter(late.values())).seed, 16), process.name)
            way = Transit(PlannedConnection(topic, delay_ns, lose.share if lose else 0.0, seed))
            self._ways[process.name, topic] = way
        times_ns = [self._ways[process.name, topic].arrives_ns(now_ns) for _ in range(count)]
        process.tell(Expect({}, {f"topic {topic}": [t_ns is not None for t_ns in times_ns]}))
        if not isinstance(process.report(), MessagesArrived):
            self._mark_dead(process)
            return
        for t_ns in times_ns:
            if t_ns is None:
                self._log.fault(now_ns, process, "loses", f"topic {topic}")
                continue
            if t_ns > now_ns:
                self._log.fault(now_ns, process, "late", f"{seconds(t_ns - now_ns):.3g} topic {topic}")
            self._agenda.later(ArriveLate(t_ns, process.name, topic))

    def _do(self, event: Event, now_ns: int) -> None:
        if isinstance(event, ArriveLate):
            process, channel = self._named(event.process), f"topic {event.topic}"
            process.released[channel] = process.released.get(channel, 0) + 1
            process.nudged = True
        elif isinstance(event, KillProgram):
            for student in self._students:
                if student.name == event.process and not student.ended:
                    self._log.fault(now_ns, student, "killed")
                    self._kill(student)
        else:
            super()._do(event, now_ns)

    def unsuitable(self) -> str:
        """Return why virtual time does not suit the nodes; empty if it does."""
        return super().unsuitable() or unfit(self._students, self._faults, full=bool(self._recorder.full))

    def _advance(self, to_ns: int, *, until_news: bool = False) -> None:
        """Let time pass until a moment, with everything that happens at it.

        A plan ends before what happens at its end. A step includes it: whoever waits for a second expects the timer of
        that second. The loop therefore ends a nanosecond later, and no process is told of that nanosecond.
        """

        def is_enough() -> bool:
            return until_news and self._has_news()

        self._core.go_to(to_ns)
        self._carry_out(self._core.run_on(is_enough))
        self._core.arrive(early=bool(self._recorder.full) or is_enough())

    def _make_core(self) -> Core[NodeProcess]:
        seed = int(self._plan.host_seed, 16)
        held = {one.on for one in self._plan.faults if one.on.startswith("/")}

        def choose(step: str, found: Sequence[NodeProcess]) -> NodeProcess:
            # of its own for each step, so that what one draws does not depend on whether an earlier one has drawn
            draw = random.Random(derive(seed, "order", step))  # noqa: S311 - it has to repeat
            return draw.choice(found) if self._draws() else found[0]

        drawn = choose if self._plan.drawn_order else None
        return Core(self._students, self._agenda, includes_end=True, choose=drawn, held=held)

    def _await_start(self, started: Sequence[NodeProcess]) -> None:
        del started
        self._advance(self._core.now_ns)

    def _interrupt(self, student: NodeProcess) -> None:
        self._core.go_to(self._core.now_ns)
        super()._interrupt(student)

    def _await_end(self, student: NodeProcess) -> None:
        del student
        self._advance(self._core.now_ns)


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
        self._await(lambda: until_news and self._has_news(), to_ns)

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
        if not delay_ns and student.name not in self._agenda.starts_ns:
            student.tell(Go())
            self._note_start(student)

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
