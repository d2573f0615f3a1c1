"""What stimuli do on topics in virtual time: publishers appear, publish for whoever listens, and disappear."""

from __future__ import annotations

from typing import Any

from grader.core.trace import Delivery, Mark
from grader.execution.discovery import Matching, announce, compatible, offered, readers_of, takes_ordinary
from grader.execution.interfaces import built, message_class, plain_fields
from grader.execution.observer import Observer
from grader.execution.stimuli import Due, number_message, numeric_field
from grader.execution.student_process import Student
from grader.execution.trace_recorder import Tape


class Broadcasts:
    """Publishes for the students' nodes.

    Args:
        students: The processes.
        observer: The grader's node.
        tape: Where it is taken down.
        matching: Knows which publishers there are, and tells the processes.
    """

    def __init__(self, students: list[Student], observer: Observer, tape: Tape, matching: Matching) -> None:
        self._students = students
        self._observer = observer
        self._tape = tape
        self._matching = matching

    def disappear(self, due: Due, now_ns: int) -> None:
        """Take a stimulus's publisher out of the graph."""
        self._matching.streams.pop(due.topic, None)
        self._matching.fixed.pop(due.topic, None)
        self._observer.withdraw(due.topic)
        self._matching.tell_all()
        self._tape.add(Mark(now_ns, "stream_stops", due.topic))

    def offer(self, due: Due, now_ns: int) -> None:
        """Create the publisher of messages of a fixed type."""
        stream = due.payload
        self._matching.fixed[due.topic] = stream
        self._matching.streams[due.topic] = stream.type
        self._observer.advertise(due.topic, stream.type, latched=stream.latched, best_effort=stream.best_effort)
        self._matching.patience.wait(lambda: self._matching.is_heard(due.topic))
        self._matching.tell_all()
        self._tape.add(Mark(now_ns, "stream_starts", due.topic))

    def say(self, due: Due, now_ns: int) -> None:
        """Publish one message of a fixed type."""
        stream, fields = due.payload
        message = built(message_class(stream.type), fields, due.topic)
        self._tape.add(Delivery(now_ns, due.topic, stream.type, plain_fields(message)))
        self._observer.publish(due.topic, message)
        self._matching.said[due.topic] += 1
        for student in self._students:
            if any(compatible(offered(stream), c) for c in readers_of(student, due.topic)):
                announce(student.arrivals, f"topic {due.topic}", 1)

    def appear(self, due: Due, now_ns: int) -> None:
        """Create a stimulus's publisher, of the type and durability that the students' subscriptions ask for."""
        self._start_stream(due.topic, due.payload)
        self._tape.add(Mark(now_ns, "stream_starts", due.topic))

    def _start_stream(self, topic: str, default: str) -> None:
        asked = [c for s in self._students for c in readers_of(s, topic)]
        carrying = [c for c in asked if default == c["type"] or numeric_field(c["type"]) is not None]
        interface = carrying[0]["type"] if carrying and "nav_msgs" not in default else default
        latched = any(c["latched"] for c in asked if c["type"] == interface)
        self._observer.advertise(topic, interface, latched=latched)
        self._matching.streams[topic] = interface
        self._matching.patience.wait(lambda: self._matching.is_heard(topic))
        self._matching.tell_all()

    def publish(self, due: Due, now_ns: int) -> None:
        """Publish one message of a stimulus and note for whom it is on its way."""
        self._follow_type(due.topic)
        interface = self._matching.streams[due.topic]
        if interface == "nav_msgs/msg/Odometry":
            cdr, value = due.payload
            message: Any = cdr
        else:
            message, value = number_message(interface, due.payload)
            cdr = b""
        self._tape.add(Delivery(now_ns, due.topic, interface, value, cdr))
        self._observer.publish(due.topic, message)
        for student in self._students:
            if any(c["type"] == interface and takes_ordinary(c) for c in readers_of(student, due.topic)):
                announce(student.arrivals, f"topic {due.topic}", 1)

    def _follow_type(self, topic: str) -> None:
        """Change a stimulus's type or durability when a student's node subscribed with another one."""
        current = self._matching.streams[topic]
        asked = [c for s in self._students for c in readers_of(s, topic)]
        if current == "nav_msgs/msg/Odometry" or not asked or any(c["type"] == current for c in asked):
            return
        if any(numeric_field(c["type"]) is not None for c in asked):
            self._observer.withdraw(topic)
            self._start_stream(topic, current)
