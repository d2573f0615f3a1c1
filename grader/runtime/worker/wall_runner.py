"""Runs a plan on the real clock, for programs that virtual time does not suit.

Processes run freely, and everything is recorded with the real time of its arrival. The runner's own loop is the
reference for the load of the machine: if the loop was delayed for long, the students' nodes may have been as well, and
the run is not judged.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import ClassVar, Protocol

from grader.runtime.host.protocol import Claim, EarlyMessage, Exited, Go, Note, Parameters, Stop, ThreadFault
from grader.runtime.model.quantities import NS_PER_MS
from grader.runtime.model.scenario import Event
from grader.runtime.model.trace import ClockKind, Mark, Message, Observation, Offer
from grader.runtime.plan import Plan
from grader.runtime.stimuli.calls import PlannedCalls
from grader.runtime.stimuli.events import Disappear
from grader.runtime.stimuli.messages import Advertise
from grader.runtime.stimuli.server import RemoveServer
from grader.runtime.worker.ending import ending
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.runner import Runner
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.topic_peers import LINGER_NS, WallTopicPeers

#: The most messages of a topic, and reads of a stream, in one iteration, so that a flood does not delay the loop.
MESSAGES_A_LOOK, READS_A_LOOK = 100, 2
#: The shortest pause between two iterations: without one, the loop would take a processor from the nodes.
PAUSE_S = 0.0002
#: The longest pause, if nothing arrives: graph and output are only noticed by looking.
LONGEST_PAUSE_NS = 10 * NS_PER_MS
#: The longest delay of the loop before the run counts as invalid: the nodes may have been delayed as long.
HELD_UP_NS = 150 * NS_PER_MS
#: An iteration in which the grader works for longer than this, on a graph of hundreds of endpoints for instance, may be
#: delayed so much for each such piece of work. A busy machine takes the processor away after each few milliseconds, so
#: that a long iteration is delayed many times.
PIECE_NS = 20 * NS_PER_MS
#: The most early messages that are distinguished.
MOST_EARLY = 10_000
#: How long before its first message a publisher is created, so that subscriptions can discover it.
LEAD_NS = 300 * NS_PER_MS
#: How often the graph is looked at: what is there for a shorter time may be missed, and each look delays discovery.
GRAPH_EVERY_NS = 50 * NS_PER_MS
#: The most of the time that goes into looks at the graph: one at 470 endpoints takes 0.1 s of a processor, in which
#: nothing else is recorded.
GRAPH_SHARE = 0.1


class RealTime(Protocol):
    """The functions of the module `time` that the runners of the real clock call."""

    def monotonic_ns(self) -> int:
        """Return the time of a clock that is never set."""
        ...

    def time_ns(self) -> int:
        """Return the time of the system clock."""
        ...

    def process_time_ns(self) -> int:
        """Return the processor time of this process."""
        ...

    def sleep(self, seconds: float, /) -> None:
        """Let time pass."""
        ...


class WallRunner(Runner):
    """Runs one plan on the real clock; see `Runner`.

    Args:
        plan: What to run.
        students: The started processes, each waiting for its first answer.
        observer: The grader's node.
        real_time: The real clock.
    """

    clock = ClockKind.WALL
    clock_reason = "it was requested"
    #: See `PAUSE_S` and `LONGEST_PAUSE_NS`.
    pause_s: ClassVar[float] = PAUSE_S
    longest_pause_ns: ClassVar[int] = LONGEST_PAUSE_NS
    #: How long after a look at the graph the next one is at the latest.
    rarest_graph_ns: ClassVar[int] = GRAPH_EVERY_NS

    def __init__(
        self, plan: Plan, students: list[NodeProcess], observer: Observer, *, real_time: RealTime = time
    ) -> None:
        super().__init__(plan, students, observer)
        self._real_time = real_time
        self._agenda.due = sorted(_with_early_publishers(self._agenda.due), key=lambda e: e.t_ns)
        self._topics: WallTopicPeers = WallTopicPeers(observer, self._recorder)
        self._looked_ns = self._looked_before_ns = self._worked_ns = 0
        self._next_graph_ns = 0
        self._graph_every_ns = GRAPH_EVERY_NS
        self._started = 0
        #: When messages were sent before anybody could have discovered their publisher: topic -> beginnings and ends,
        #: by the system clock, as the processes report them.
        self._early: dict[str, list[tuple[int, int]]] = {}
        self._early_told = 0
        #: The services and clients whose process is not known.
        self._nobodys: set[tuple[str, str, str]] = set()
        #: When messages were sent, by the system clock, by their index in the recording.
        self._sent_ns: dict[int, int] = {}
        self.held_up_ns = 0

    def _time_ns(self) -> int:
        return max(self._stop_ns, self._real_time.monotonic_ns() - self._started)

    def _clock_ns(self, now_ns: int) -> int:
        return self._real_time.time_ns() - self._time_ns() + now_ns

    def _begin(self) -> None:
        """Start the clock and every process that does not start late."""
        self._started = self._real_time.monotonic_ns()
        for student in self._students:
            if student.name not in self._agenda.starts_ns:
                student.tell(Go())
                self._note_start(student)

    def _run_on(self) -> None:
        """Poll until the end, or until nothing more can happen."""
        self._looked_ns, self._worked_ns = self._time_ns() if self._stop_ns else 0, self._real_time.process_time_ns()
        while self._note_delay() < self._agenda.end_ns and not self._finished():
            self._look(self._looked_ns)
            self._pause()

    def _note_delay(self) -> int:
        """Return the time, and note how long the iteration before was held up by other programs."""
        before_ns, worked_before_ns = self._looked_ns, self._worked_ns
        self._looked_before_ns = before_ns
        self._looked_ns, self._worked_ns = self._time_ns(), self._real_time.process_time_ns()
        # What this process has worked itself is due to what the nodes do.
        work_ns = self._worked_ns - worked_before_ns
        held_up_ns = (self._looked_ns - before_ns - work_ns) // (1 + work_ns // PIECE_NS)
        self.held_up_ns = max(self.held_up_ns, held_up_ns)
        return self._looked_ns

    def _finished(self) -> bool:
        return self._agenda.is_over(self._students)

    def _pause(self) -> None:
        """Wait until something has arrived or is due, but not for long: many things are only noticed by looking."""
        self._real_time.sleep(self.pause_s)
        moments = [*self._agenda.moments(), *self._agenda.starts_ns.values()]
        left_ns = min(self.longest_pause_ns, min(moments) - self._time_ns())
        if left_ns > 0:
            self._observer.await_arrival(left_ns)

    def _last_look(self) -> int:
        self._look_at_graph(self._agenda.end_ns)
        return self._agenda.end_ns

    def _interrupt(self, student: NodeProcess) -> None:
        student.tell(Stop())

    _signal_stop = _interrupt

    def _begin_process(self, student: NodeProcess, delay_ns: int) -> None:
        self._agenda.starts_ns[student.name] = max(1, self._time_ns() + delay_ns)
        self._looked_ns = self._time_ns()  # starting a process takes long, and is not what holds the loop up

    def _lose(self, student: NodeProcess) -> None:
        """Do nothing: the middleware itself notices after a while that nobody answers."""

    def _harness_problem(self) -> str:
        """Report that the machine was too busy, unless the nodes themselves delayed the loop."""
        if self.held_up_ns <= HELD_UP_NS or self._recorder.full or self.fills_machine():
            return ""
        return "the machine was too busy: a reference timer beside the node was held up as well"

    def _look(self, now_ns: int) -> None:
        while self._agenda.is_due(now_ns):
            self._do(self._agenda.due.pop(0), now_ns)
        self._topics.leave(now_ns)
        for due in self._services.ready(self._is_served):
            self._agenda.later(replace(due, t_ns=now_ns))
        self._services.take()
        self._services.record(now_ns)
        for server in self._services.done():
            # removed later, because its last response would be lost otherwise
            if not any(isinstance(due, RemoveServer) and due.server == server for due in self._agenda.due):
                self._agenda.later(RemoveServer(now_ns + LINGER_NS, server))
        for student in self._students:
            if 0 < self._agenda.starts_ns.get(student.name, 0) <= now_ns:
                del self._agenda.starts_ns[student.name]
                self._recorder.add(Mark(now_ns, "process_starts", student.name))
                student.tell(Go())
                self._note_start(student)
            self._hear(student, now_ns)
        for taken in self._observer.take(MESSAGES_A_LOOK):
            self._record(now_ns, taken, arrived_ns=self._arrived(taken.arrived_ns, now_ns))
            self._sent_ns[len(self._recorder.observations) - 1] = taken.sent_ns
            self._end_if_full(now_ns)
        if now_ns >= self._next_graph_ns:
            used_ns = self._real_time.process_time_ns()
            changed = self._look_at_graph(now_ns)
            work_ns = self._real_time.process_time_ns() - used_ns
            self._graph_every_ns = GRAPH_EVERY_NS if changed else min(2 * self._graph_every_ns, self.rarest_graph_ns)
            self._next_graph_ns = now_ns + max(self._graph_every_ns, round(work_ns / GRAPH_SHARE))

    def _arrived(self, clock_ns: int, now_ns: int) -> int:
        """Return when something arrived that is found now; `clock_ns` is what the middleware says, 0 if it does not.

        Processes with the grader's code log in a way that only a look finds: their messages count from then as well.
        """
        del clock_ns
        return now_ns

    def _observations(self) -> tuple[Observation, ...]:
        found = super()._observations()
        if not self._early:
            return found
        return tuple(self._marked(one, self._sent_ns.get(place, 0)) for place, one in enumerate(found))

    def _marked(self, one: Observation, sent_ns: int) -> Observation:
        """Mark a message as sent before discovery if that was reported; the report may arrive after the message."""
        told = self._early.get(one.topic, ()) if isinstance(one, Message) else ()
        if isinstance(one, Message) and any(began_ns <= sent_ns <= ended_ns for began_ns, ended_ns in told):
            return replace(one, before_discovery=True)
        return one

    def _hear(self, student: NodeProcess, now_ns: int) -> None:
        reports = [] if student.ended else student.reports()
        student.drain(READS_A_LOOK)  # after the reports, so that all that it has written before them is found
        for report in reports:
            if report is None:
                self._recorder.add(*student.output(now_ns, final=True), student.death(now_ns))
                student.ended = True
                self._note_end(student)
            elif isinstance(report, Note):
                student.note(report)
            elif isinstance(report, EarlyMessage):
                self._note_early(report)
            elif isinstance(report, Parameters):
                self._note_parameters(student, report, now_ns)
            elif isinstance(report, ThreadFault):
                self._report_fault(student, report, now_ns)
            elif isinstance(report, Exited):
                self._recorder.add(*student.output(now_ns, final=True))
                stopped, places = student.stop_signalled, student.places
                student.exit_code = report.code
                self._recorder.add(ending(student.name, now_ns, report, self._plan, places, stopped=stopped))
                student.ended = True
                self._note_end(student)
        self._recorder.add(*student.output(now_ns))

    def _note_parameters(self, student: NodeProcess, report: Parameters, now_ns: int) -> None:
        claims = [claim for claim in report.claims if claim is not None and claim.kind == "parameter"]
        self._note_offers(student, claims, now_ns)

    def _note_services(self, now_ns: int) -> None:
        """Record the services and clients in the graph; one of several processes is known by its parameters alone."""
        nodes = {offer[1].partition(":")[0]: one for one in self._students for offer in one.offers}
        only = self._students[0] if len(self._students) == 1 else None
        for end in self._recorder.graph.services:
            student = only or nodes.get(end.node)
            claim = Claim(end.kind, end.service, end.type)
            if student is not None:
                self._note_offers(student, [claim], now_ns)
            elif (offer := (end.kind, end.service, end.type)) not in self._nobodys:
                self._nobodys.add(offer)
                self._recorder.add(Offer(now_ns, "", *offer))

    def _note_early(self, report: EarlyMessage) -> None:
        if self._early_told < MOST_EARLY:
            self._early_told += 1
            self._early.setdefault(report.topic, []).append((report.began_ns, report.ended_ns))

    def _look_at_graph(self, now_ns: int) -> bool:
        """Record the graph, subscribe to what is new, and return whether it has changed."""
        graph = self._observer.with_qos(self._observer.graph(now_ns, services=True))
        changed = self._recorder.look(graph, self._observer.participants())
        self._end_if_full(now_ns)
        if changed:
            self._observer.watch(self._recorder.graph.endpoints)
            if not self._plan.bare:  # what a spot check records is compared with what nobody reported
                self._note_services(now_ns)
            if self._observer.crowded:
                self._recorder.stop(now_ns, self._observer.crowded)
                self._end_if_full(now_ns)
            self._topics.follow_types()
        return changed

    def _announce_exchange(self, kind: str, service: str, count: int) -> None:
        """Do nothing: on the real clock, processes receive messages by themselves."""

    def _tell_servers(self) -> None:
        """Do nothing: on the real clock, processes discover servers by themselves."""

    def _is_served(self, calls: PlannedCalls) -> bool:
        service = self._services.add_clients(calls)
        return service is not None and self._observer.services.is_matched(service)


def _with_early_publishers(events: Iterable[Event]) -> Iterator[Event]:
    """Yield events with publishers created earlier, but not before the one that they replace has left."""
    left_ns: dict[str, int] = {}
    for event in events:
        if isinstance(event, Advertise):
            yield replace(event, t_ns=max(left_ns.get(event.topic, 0), event.t_ns - LEAD_NS))
            continue
        if isinstance(event, Disappear):
            left_ns[event.topic] = event.t_ns
        yield event
