"""Runs a plan on the real clock, beside a reference that tells whether the machine kept up.

For what virtual time cannot hold. Nothing is stepped: processes run as they like, and whatever arrives gets the real
time at which it came. The reference is the conductor's own loop: if it was held up for long, so may the students' nodes
have been, and the run says nothing about them.
"""

from __future__ import annotations

import bisect
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from grader.core.quantities import NS_PER_MS
from grader.core.trace import ClockKind, Delivery, Mark, Observation, Trace
from grader.execution.ending import ending, never_stopped, reported_fault
from grader.execution.exchanges import PlannedCalls
from grader.execution.interfaces import built, message_class, plain_fields
from grader.execution.observer import Observer, Taken
from grader.execution.plan import Plan
from grader.execution.service_peers import Desk
from grader.execution.stimuli import BROADCASTS, Due, number_message, numeric_field, schedule
from grader.execution.student_process import Student
from grader.execution.trace_recorder import Tape

#: How much of a flood is taken in one look, so as not to hold up the reference: messages of a topic, pieces of output.
MESSAGES_A_LOOK, READS_A_LOOK = 100, 2
#: How often the conductor looks, and how long it may be held up at most before the run says nothing.
LOOK_S = 0.001
HELD_UP_NS = 150 * NS_PER_MS
#: How long a publisher stays after its last message, which it would take with it otherwise.
LINGER_NS = 400 * NS_PER_MS
#: How long before its first message a publisher appears: a subscription has to find it.
LEAD_NS = 300 * NS_PER_MS
GRAPH_EVERY_NS = 50 * NS_PER_MS


class WallConductor:
    """Runs one plan on the real clock.

    Args:
        plan: What to run.
        students: The started processes, each waiting to be told to start.
        observer: The grader's node.
    """

    def __init__(self, plan: Plan, students: list[Student], observer: Observer) -> None:
        self._plan = plan
        self._students = students
        self._observer = observer
        self._end_ns = plan.wait_at_most_ns if plan.first_message_on else plan.duration_ns
        early = (replace(d, t_ns=max(0, d.t_ns - LEAD_NS)) if d.action == "offer" else d for d in schedule(plan))
        self._due = sorted(early, key=lambda d: d.t_ns)
        self._streams: dict[str, str] = {}
        self._leaving: list[tuple[int, str]] = []
        self._tape = Tape(plan.limits)
        nodes = lambda: self._tape.graph.nodes  # noqa: E731 - it changes
        self._desk = Desk(plan, observer.services, self._tape, nodes=nodes, later=self._later)
        self._starts_ns = dict(plan.starts_ns)
        self._stop_ns = 0
        self._exchanges: Mapping[str, Callable[[Due, int], None]] = {
            "serve": self._serve,
            "dismiss": self._dismiss,
            "answer": self._answer,
            "meet": self._meet,
            "call": self._call,
        }
        self._next_graph_ns = 0
        self._started = 0
        self.held_up_ns = 0

    def run(self) -> Trace:
        """Run the plan to its end and return the trace."""
        self._begin()
        self._run_on(0)
        self._look_at_graph(self._end_ns)
        self._tape.look_back(self._end_ns)
        self._stop_ns = self._end_ns
        if self._plan.shutdown_ns and not self._tape.full:
            self._shut_down()
        return Trace(
            scenario=self._plan.scenario,
            clock=ClockKind.WALL,
            stop_ns=self._stop_ns,
            clock_reason="it was asked for",
            observations=self._observations(),
            notes=self._tape.notes([*self._observer.notes(), *(note for s in self._students for note in s.notes)]),
            starts=tuple(s.start_told for s in self._students if s.start_told is not None),
            harness_problem=self._slip(),
        )

    def _observations(self) -> tuple[Observation, ...]:
        """Return what was observed, in order."""
        return tuple(self._tape.observations)

    def _begin(self) -> None:
        """Start the clock, and every process that does not start late."""
        self._started = time.monotonic_ns()
        for student in self._students:
            if student.name not in self._starts_ns:
                student.tell({"now_ns": 0, "free_until_ns": 0})

    def _run_on(self, before_ns: int) -> None:
        """Look again and again until the end, or until nothing more can happen."""
        while (now_ns := self._now_ns()) < self._end_ns and not self._finished():
            self.held_up_ns = max(self.held_up_ns, now_ns - before_ns)
            before_ns = now_ns
            self._look(now_ns)
            time.sleep(LOOK_S)

    def _shut_down(self) -> None:
        """Send every process the stop signal, as Ctrl-C does, and look on until all have ended."""
        now_ns = max(self._stop_ns, self._now_ns())
        self._due, self._end_ns = [], now_ns + self._plan.shutdown_ns
        for student in self._students:
            if not student.ended:
                student.stop_signalled = True
                self._tape.add(Mark(now_ns, "stop_signal", student.name))
                student.tell({"stop": True})
        self._run_on(now_ns)
        for student in self._students:
            if not student.ended:
                self._tape.add(never_stopped(student.name, self._end_ns, self._plan.shutdown_ns))

    def _slip(self) -> str:
        """Say that the machine did not keep up, if it did not; a node that floods holds it up itself."""
        if self.held_up_ns <= HELD_UP_NS or self._tape.full:
            return ""
        return "the machine was too busy: a reference timer beside the node was held up as well"

    def _now_ns(self) -> int:
        return time.monotonic_ns() - self._started

    def _finished(self) -> bool:
        return all(s.ended for s in self._students) and not any(d.action in BROADCASTS for d in self._due)

    def _look(self, now_ns: int) -> None:
        while self._due and self._due[0].t_ns <= now_ns:
            self._do(self._due.pop(0), now_ns)
        while self._leaving and self._leaving[0][0] <= now_ns:
            self._observer.withdraw(self._leaving.pop(0)[1])
        for due in self._desk.ready(self._is_served):
            self._later(Due(now_ns, due.action, due.topic, due.payload))
        self._desk.take()
        self._desk.write_down(now_ns)
        going = [due.payload for due in self._due if due.action == "dismiss"]
        for server in self._desk.done():
            if server not in going:  # it would take its last response with it
                self._later(Due(now_ns + LINGER_NS, "dismiss", server.service, server))
        for student in self._students:
            if 0 < self._starts_ns.get(student.name, 0) <= now_ns:
                del self._starts_ns[student.name]
                self._tape.add(Mark(now_ns, "process_starts", student.name))
                student.tell({"now_ns": 0, "free_until_ns": 0})
            self._hear(student, now_ns)
        for taken in self._observer.take(MESSAGES_A_LOOK):
            self._record(now_ns, taken)
        if now_ns >= self._next_graph_ns:
            self._look_at_graph(now_ns)
            self._next_graph_ns = now_ns + GRAPH_EVERY_NS

    def _hear(self, student: Student, now_ns: int) -> None:
        student.drain(READS_A_LOOK)
        reports = [] if student.ended else student.reports()
        for report in reports:
            if report is None:
                self._tape.add(*student.output(now_ns, final=True), student.death(now_ns))
                student.ended = True
            elif report.get("kind") == "note":
                student.note(report)
            elif report.get("kind") == "fault":
                fault, limits = report.get("fault"), self._plan.limits
                self._tape.add(reported_fault(student.name, now_ns, fault, limits, student.places))
            elif report.get("kind") == "exited":
                self._tape.add(*student.output(now_ns, final=True))
                stopped, places = student.stop_signalled, student.places
                self._tape.add(ending(student.name, now_ns, report, self._plan, places, stopped=stopped))
                student.ended = True
        self._tape.add(*student.output(now_ns))

    def _record(self, now_ns: int, taken: Taken) -> None:
        if taken.topic == self._plan.first_message_on and not self._tape.seen(taken.topic):
            self._end_ns = now_ns + self._plan.duration_ns
        self._tape.message(now_ns, taken)
        self._end_if_full(now_ns)

    def _end_if_full(self, now_ns: int) -> None:
        if self._tape.full:
            self._end_ns = min(self._end_ns, now_ns)

    def _look_at_graph(self, now_ns: int) -> None:
        changed = self._tape.look(self._observer.graph(now_ns, services=True), self._observer.participants())
        self._end_if_full(now_ns)
        if not changed:
            return
        self._observer.watch(self._tape.graph)
        for topic in list(self._streams):
            self._follow_type(topic)

    def _do(self, due: Due, now_ns: int) -> None:
        if due.action in self._exchanges:
            self._exchanges[due.action](due, now_ns)
        elif due.action == "offer":
            stream = due.payload
            self._withdraw_left(due.topic)
            self._observer.advertise(due.topic, stream.type, latched=stream.latched, best_effort=stream.best_effort)
            self._tape.add(Mark(now_ns, "stream_starts", due.topic))
        elif due.action == "say":
            stream, fields = due.payload
            message = built(message_class(stream.type), fields, due.topic)
            self._tape.add(Delivery(now_ns, due.topic, stream.type, plain_fields(message)))
            self._observer.publish(due.topic, message)
        elif due.action == "appear":
            self._withdraw_left(due.topic)
            self._advertise(due.topic, due.payload)
            self._tape.add(Mark(now_ns, "stream_starts", due.topic))
        elif due.action == "disappear":
            self._streams.pop(due.topic, None)
            self._leaving.append((now_ns + LINGER_NS, due.topic))
            self._tape.add(Mark(now_ns, "stream_stops", due.topic))
        else:
            self._publish(due, now_ns)

    def _later(self, due: Due) -> None:
        bisect.insort(self._due, due, key=lambda d: d.t_ns)

    def _is_served(self, calls: PlannedCalls) -> bool:
        """Return whether the server that some calls need is there and matched."""
        service = self._desk.meet(calls)
        return service is not None and self._observer.services.met(service)

    def _serve(self, due: Due, now_ns: int) -> None:
        self._desk.serve(now_ns, due.payload)

    def _meet(self, due: Due, now_ns: int) -> None:
        del now_ns
        self._desk.meet(due.payload)

    def _call(self, due: Due, now_ns: int) -> None:
        """Send a request, or keep it until its server is there."""
        if self._is_served(due.payload.calls):
            self._desk.call(now_ns, due.payload)
        else:
            self._desk.wait(due)

    def _answer(self, due: Due, now_ns: int) -> None:
        server, number = due.payload
        self._desk.answer(now_ns, server, number)

    def _dismiss(self, due: Due, now_ns: int) -> None:
        self._desk.dismiss(now_ns, due.payload)

    def _withdraw_left(self, topic: str) -> None:
        """Let a publisher that stayed for its last message go before the next one on its topic comes."""
        if any(left == topic for _, left in self._leaving):
            self._leaving = [(at_ns, left) for at_ns, left in self._leaving if left != topic]
            self._observer.withdraw(topic)

    def _publish(self, due: Due, now_ns: int) -> None:
        interface = self._streams[due.topic]
        message: Any
        value: Mapping[str, Any]
        if interface == "nav_msgs/msg/Odometry":
            message, value = due.payload
        else:
            message, value = number_message(interface, due.payload)
        self._tape.add(Delivery(now_ns, due.topic, interface, value))
        self._observer.publish(due.topic, message)

    def _advertise(self, topic: str, default: str) -> None:
        asked = [e for e in self._tape.graph.endpoints if e.kind == "subscription" and e.topic == topic]
        usable = [e for e in asked if e.type == default or numeric_field(e.type) is not None]
        interface = usable[0].type if usable and default != "nav_msgs/msg/Odometry" else default
        latched = any(e.durability == "transient_local" for e in asked if e.type == interface)
        self._observer.advertise(topic, interface, latched=latched)
        self._streams[topic] = interface

    def _follow_type(self, topic: str) -> None:
        current = self._streams[topic]
        asked = [e.type for e in self._tape.graph.endpoints if e.kind == "subscription" and e.topic == topic]
        if current == "nav_msgs/msg/Odometry" or not asked or current in asked:
            return
        if any(numeric_field(interface) is not None for interface in asked):
            self._observer.withdraw(topic)
            self._advertise(topic, current)
