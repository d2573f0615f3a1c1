"""The grader's publishers of one run, on either clock: created, used and removed as stimuli require."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from grader.runtime.message_classes import built, message_class, number_message, numeric_field, plain_fields
from grader.runtime.model.trace import Delivery, Mark
from grader.runtime.stimuli.events import Appear, Disappear, TopicEvent
from grader.runtime.stimuli.messages import Advertise, PlannedMessages, PublishFields
from grader.runtime.stimuli.numbers import PublishNumber
from grader.runtime.stimuli.recorded import PublishRecorded
from grader.runtime.worker.claims import readers_of
from grader.runtime.worker.core import announce
from grader.runtime.worker.discovery import Discovery
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.trace_recorder import TraceRecorder

#: How long, on the wall clock, a publisher stays after its last message, which would be lost otherwise.
LINGER_NS = 400_000_000


class TopicPeers(ABC):
    """Publishes for the students' nodes.

    Args:
        observer: The grader's node.
        recorder: Records deliveries and marks.
    """

    def __init__(self, observer: Observer, recorder: TraceRecorder) -> None:
        self._observer = observer
        self._recorder = recorder
        #: The topics that stimuli publish on now, with their types.
        self._streams: dict[str, str] = {}
        #: Those of them whose type does not depend on the students' nodes.
        self._fixed: set[str] = set()
        #: The field of each stream of numbers that holds them.
        self._fields: dict[str, str] = {}

    def do(self, event: TopicEvent, now_ns: int) -> None:
        """Execute one event of a stimulus."""
        topic = event.topic
        if isinstance(event, PublishNumber):
            message, value = number_message(self._streams[topic], event.number, self._fields[topic])
            self._publish(Delivery(now_ns, topic, self._streams[topic], value), message)
        elif isinstance(event, PublishRecorded):
            self._publish(Delivery(now_ns, topic, self._streams[topic], event.value, event.cdr), event.cdr)
        elif isinstance(event, PublishFields):
            message = event.message
            if message is None:
                message = built(message_class(event.stream.type), event.fields, topic)
            self._publish(Delivery(now_ns, topic, event.stream.type, plain_fields(message)), message)
        elif isinstance(event, Disappear):
            self._streams.pop(topic, None)
            self._fixed.discard(topic)
            self._withdraw(topic, now_ns)
            self._recorder.add(Mark(now_ns, "stream_stops", topic))
        else:
            if isinstance(event, Advertise):
                self._offer(event.stream)
            elif isinstance(event, Appear):
                (self._fixed.add if event.fixed else self._fixed.discard)(topic)
                self._fields[topic] = event.field
                self._advertise(topic, event.type)
            self._recorder.add(Mark(now_ns, "stream_starts", topic))

    def follow_type(self, topic: str) -> None:
        """Replace a publisher if the subscriptions of students' nodes ask for another type."""
        # Looked up each time: subscriptions come and go while a stimulus runs.
        current, asked = self._streams[topic], [interface for interface, _ in self._asked(topic)]
        # A subscription of the present type suffices: changing to another one's would lose its messages.
        if topic in self._fixed or not asked or current in asked:
            return
        if any(self._carries(interface, topic) for interface in asked):
            self._observer.withdraw(topic)
            self._advertise(topic, current)

    def _offer(self, stream: PlannedMessages) -> None:
        self._observer.advertise(stream.topic, stream.type, latched=stream.latched, best_effort=stream.best_effort)

    def _advertise(self, topic: str, default: str) -> bool:
        """Create a publisher as the students' subscriptions ask for it, with type and durability; return if latched."""
        asked = self._asked(topic)
        usable = [interface for interface, _ in asked if interface == default or self._carries(interface, topic)]
        # The first subscription decides, as it would for a publisher that is written to fit it.
        interface = usable[0] if usable and topic not in self._fixed else default
        # A subscription that asks for transient local hears no volatile publisher, and a volatile one hears both.
        latched = any(late for found, late in asked if found == interface)
        self._observer.advertise(topic, interface, latched=latched)
        self._streams[topic] = interface
        return latched

    def _carries(self, interface: str, topic: str) -> bool:
        """Return whether a message type has the field for the numbers of a topic."""
        return numeric_field(interface, self._fields.get(topic, "")) is not None

    def _publish(self, delivery: Delivery, message: Any) -> None:
        # Recorded before it is sent, so that no answer to it can be recorded first.
        self._recorder.add(delivery)
        self._observer.publish(delivery.topic, message)

    @abstractmethod
    def _asked(self, topic: str) -> list[tuple[str, bool]]:
        """Return the type of each of the students' subscriptions to a topic, and whether it is transient-local."""

    @abstractmethod
    def _withdraw(self, topic: str, now_ns: int) -> None:
        """Remove a publisher from the graph."""


class VirtualTopicPeers(TopicPeers):
    """Publishes in virtual time: waits until publishers are matched, and announces messages to the processes.

    Args:
        students: The processes.
        observer: The grader's node.
        recorder: Records deliveries and marks.
        discovery: Waits for publishers to be matched.
    """

    def __init__(
        self, students: list[NodeProcess], observer: Observer, recorder: TraceRecorder, discovery: Discovery
    ) -> None:
        super().__init__(observer, recorder)
        self._students = students
        self._discovery = discovery
        self._streams = discovery.matching.streams

    def do(self, event: TopicEvent, now_ns: int) -> None:
        """Execute one event of a stimulus, with the publisher's type adapted to the current subscriptions."""
        if isinstance(event, PublishNumber):
            self.follow_type(event.topic)
        super().do(event, now_ns)

    def _offer(self, stream: PlannedMessages) -> None:
        self._discovery.matching.fixed[stream.topic] = stream
        self._streams[stream.topic] = stream.type
        super()._offer(stream)
        self._discovery.advertised(stream.topic)

    def _advertise(self, topic: str, default: str) -> bool:
        latched = super()._advertise(topic, default)
        (self._discovery.matching.latched.add if latched else self._discovery.matching.latched.discard)(topic)
        self._discovery.advertised(topic)
        return latched

    def _publish(self, delivery: Delivery, message: Any) -> None:
        super()._publish(delivery, message)
        topic = delivery.topic
        self._discovery.matching.published[topic] += 1
        for student in self._students:
            # Only to those that receive it: a process waits in real time for what is announced.
            if any(self._discovery.matching.takes(reader, topic) for reader in readers_of(student.claims, topic)):
                announce(student, f"topic {topic}", 1)

    def _asked(self, topic: str) -> list[tuple[str, bool]]:
        return [(reader.type, reader.qos.latched) for s in self._students for reader in readers_of(s.claims, topic)]

    def _withdraw(self, topic: str, now_ns: int) -> None:
        del now_ns
        self._discovery.matching.fixed.pop(topic, None)
        self._observer.withdraw(topic)
        self._discovery.tell_all()


class WallTopicPeers(TopicPeers):
    """Publishes on the wall clock, where a publisher stays for a while after its last message."""

    def __init__(self, observer: Observer, recorder: TraceRecorder) -> None:
        super().__init__(observer, recorder)
        self._leaving: list[tuple[int, str]] = []
        #: How the publishers of fixed types were created.
        self._offered: dict[str, tuple[str, bool, bool]] = {}

    def follow_types(self) -> None:
        """Adapt the types of all publishers after the graph has changed."""
        for topic in list(self._streams):
            self.follow_type(topic)

    def leave(self, now_ns: int) -> None:
        """Remove the publishers that have stayed long enough after their last message."""
        while self._leaving and self._leaving[0][0] <= now_ns:
            _, topic = self._leaving.pop(0)
            self._observer.withdraw(topic)
            self._offered.pop(topic, None)

    def do(self, event: TopicEvent, now_ns: int) -> None:
        """Execute one event; a publisher that still lingers goes on as its successor, or is removed before."""
        if isinstance(event, (Appear, Advertise)) and any(left == event.topic for _, left in self._leaving):
            self._leaving = [(at_ns, left) for at_ns, left in self._leaving if left != event.topic]
            same = isinstance(event, Advertise) and self._offered.get(event.topic) == _terms(event.stream)
            if not same:  # the same one would have to be discovered anew, and what it has just sent could be lost
                self._observer.withdraw(event.topic)
                self._offered.pop(event.topic, None)
        super().do(event, now_ns)

    def _offer(self, stream: PlannedMessages) -> None:
        self._streams[stream.topic] = stream.type
        self._fixed.add(stream.topic)
        if self._offered.get(stream.topic) != _terms(stream):
            self._offered[stream.topic] = _terms(stream)
            super()._offer(stream)

    def _asked(self, topic: str) -> list[tuple[str, bool]]:
        asked = self._recorder.graph.ends_of_topics("subscription", topic)
        return [(e.type, e.durability == "transient_local") for e in asked]

    def _withdraw(self, topic: str, now_ns: int) -> None:
        self._leaving.append((now_ns + LINGER_NS, topic))


def _terms(stream: PlannedMessages) -> tuple[str, bool, bool]:
    """Return what a publisher is created with, beside its topic."""
    return stream.type, stream.latched, stream.best_effort
