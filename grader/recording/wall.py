"""Runs a plan on the real clock, beside a reference that tells whether the machine kept up.

For what virtual time cannot hold. Nothing is stepped: processes run as they like, and whatever arrives gets the real
time at which it came. The reference is the conductor's own loop: if it was held up for long, so may the students' nodes
have been, and the run says nothing about them.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from grader.model.quantities import NS_PER_MS
from grader.model.trace import ClockKind, Delivery, Mark, Trace
from grader.recording.ending import ending_fault, reported_fault
from grader.recording.observer import Observer, Taken
from grader.recording.plan import Plan
from grader.recording.stimuli import Due, number_message, numeric_field, schedule
from grader.recording.student import Student
from grader.recording.tape import Tape

#: How much of a flood is taken in one look, so as not to hold up the reference: messages of a topic, pieces of output.
MESSAGES_A_LOOK, READS_A_LOOK = 100, 2
#: How often the conductor looks, and how long it may be held up at most before the run says nothing.
LOOK_S = 0.001
HELD_UP_NS = 150 * NS_PER_MS
#: How long a publisher stays after its last message, which it would take with it otherwise.
LINGER_NS = 400 * NS_PER_MS
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
        self._due = schedule(plan.numbers, plan.recordings)
        self._streams: dict[str, str] = {}
        self._leaving: list[tuple[int, str]] = []
        self._tape = Tape(plan.limits)
        self._next_graph_ns = 0
        self._started = 0
        self.held_up_ns = 0

    def run(self) -> Trace:
        """Run the plan to its end and return the trace."""
        self._started = time.monotonic_ns()
        for student in self._students:
            student.tell({"now_ns": 0, "free_until_ns": 0})
        before_ns = 0
        while (now_ns := self._now_ns()) < self._end_ns and not self._finished():
            self.held_up_ns = max(self.held_up_ns, now_ns - before_ns)
            before_ns = now_ns
            self._look(now_ns)
            time.sleep(LOOK_S)
        self._look_at_graph(self._end_ns)
        return Trace(
            scenario=self._plan.scenario,
            clock=ClockKind.WALL,
            stop_ns=self._end_ns,
            clock_reason="it was asked for",
            observations=tuple(self._tape.observations),
            notes=self._tape.notes([*self._observer.notes(), *(note for s in self._students for note in s.notes)]),
            harness_problem=self._slip(),
        )

    def _slip(self) -> str:
        """Say that the machine did not keep up, if it did not; a node that floods holds it up itself."""
        if self.held_up_ns <= HELD_UP_NS or self._tape.full:
            return ""
        return "the machine was too busy: a reference timer beside the node was held up as well"

    def _now_ns(self) -> int:
        return time.monotonic_ns() - self._started

    def _finished(self) -> bool:
        return all(s.ended for s in self._students) and not self._due

    def _look(self, now_ns: int) -> None:
        while self._due and self._due[0].t_ns <= now_ns:
            self._do(self._due.pop(0), now_ns)
        while self._leaving and self._leaving[0][0] <= now_ns:
            self._observer.withdraw(self._leaving.pop(0)[1])
        for student in self._students:
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
                student.note(str(report.get("text", "")))
            elif report.get("kind") == "fault":
                self._tape.add(reported_fault(student.name, now_ns, report, self._plan.limits))
            elif report.get("kind") == "exited":
                self._tape.add(*student.output(now_ns, final=True))
                self._tape.add(ending_fault(student.name, now_ns, report, self._plan.limits))
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
        changed = self._tape.look(self._observer.graph(now_ns), self._observer.participants())
        self._end_if_full(now_ns)
        if not changed:
            return
        self._observer.watch(self._tape.graph)
        for topic in list(self._streams):
            self._follow_type(topic)

    def _do(self, due: Due, now_ns: int) -> None:
        if due.action == "appear":
            self._withdraw_left(due.topic)
            self._advertise(due.topic, due.payload)
            self._tape.add(Mark(now_ns, "stream_starts", due.topic))
        elif due.action == "disappear":
            self._streams.pop(due.topic, None)
            self._leaving.append((now_ns + LINGER_NS, due.topic))
            self._tape.add(Mark(now_ns, "stream_stops", due.topic))
        else:
            self._publish(due, now_ns)

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
