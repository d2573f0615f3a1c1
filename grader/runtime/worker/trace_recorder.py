"""Records what happens in a scenario, up to its limits; the same for both clocks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import NS_PER_S, size
from grader.runtime.model.trace import Fault, GraphSnapshot, Mark, Message, Observation, Offer, Request, Response
from grader.runtime.worker.core import Taken

#: The most notes of a trace, and the maximum length of a note and of a name in it.
NOTES, NOTE_CHARACTERS, NAME_CHARACTERS = 50, 500, 200
#: Bounds that no sensible node exceeds, and that limit the size of a trace: nodes, publishers and subscriptions at one
#: moment; entries in all snapshots of the graph together; faults; offers.
ENDPOINTS, GRAPH_PARTS, FAULTS, OFFERS = 500, 100_000, 200, 2_000
#: A topic with more messages per second, plus a burst, is a flood: the node publishes as fast as it can.
FLOOD_HZ, BURST = 1_000, 100


class TraceRecorder:
    """Records the observations of one run, in order.

    Args:
        limits: How much to record.

    Attributes:
        observations: The recorded observations.
        full: Why the recording has to end, as a sentence; empty until then.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._notes: list[str] = []
        self._graph = GraphSnapshot(0, (), ())
        self._graph_parts = 0
        self._messages: Counter[str] = Counter()
        self._traffic_bytes = 0
        self._counts: Counter[type] = Counter()
        self.observations: list[Observation] = []
        self.full = ""

    def allow_participant(self) -> None:
        """Allow one more DDS participant, for a process that was started while recording."""
        self._limits = replace(self._limits, participants=self._limits.participants + 1)

    @property
    def graph(self) -> GraphSnapshot:
        """The last snapshot of the graph."""
        return self._graph

    def seen(self, topic: str) -> int:
        """Return how many messages were recorded on a topic."""
        return self._messages[topic]

    def floods(self, now_ns: int) -> bool:
        """Return whether any topic has had more messages by now than a correct node sends."""
        return max(self._messages.values(), default=0) > BURST + FLOOD_HZ * now_ns / NS_PER_S

    def add(self, *observations: Observation) -> None:
        """Record observations other than messages; only the first faults and offers are kept."""
        for observation in observations:
            kind = type(observation)
            self._counts[kind] += 1
            if self._counts[kind] <= {Fault: FAULTS, Offer: OFFERS}.get(kind, self._counts[kind]):
                self.observations.append(observation)

    def message(self, t_ns: int, taken: Taken, *, early: bool = False) -> None:
        """Record a message, or end the recording if it exceeds a limit; early is one that was sent before discovery."""
        limits = self._limits
        self._messages[taken.topic] += 1
        self._traffic_bytes += len(taken.cdr)
        if self._messages[taken.topic] > limits.messages:
            self.stop(t_ns, f"more than {limits.messages:,} messages on {taken.topic[:NAME_CHARACTERS]}")
        elif self._traffic_bytes > limits.traffic_bytes:
            self.stop(t_ns, f"more than {size(limits.traffic_bytes)} of messages")
        elif not self.full:
            self.observations.append(Message(t_ns, taken.topic, taken.type, taken.value, taken.cdr, early))

    def exchange(self, observation: Request | Response, size_bytes: int) -> None:
        """Record a request or response, or end the recording if it exceeds a limit.

        Args:
            observation: The request or response.
            size_bytes: Its size if a student's node sent it, otherwise 0.
        """
        limits, service = self._limits, observation.service
        self._messages[f"service {service}"] += 1
        self._traffic_bytes += size_bytes
        if self._messages[f"service {service}"] > limits.messages:
            name = service[:NAME_CHARACTERS]
            self.stop(observation.t_ns, f"more than {limits.messages:,} requests and responses of {name}")
        elif self._traffic_bytes > limits.traffic_bytes:
            self.stop(observation.t_ns, f"more than {size(limits.traffic_bytes)} of messages")
        elif not self.full:
            self.observations.append(observation)

    def look(self, graph: GraphSnapshot, participants: int) -> bool:
        """Record the graph if it has changed.

        Args:
            graph: The current graph.
            participants: How many participants have appeared so far.

        Returns:
            Whether the graph has changed and no limit was exceeded.
        """
        last = self._graph
        if (graph.nodes, graph.endpoints, graph.services) == (last.nodes, last.endpoints, last.services):
            return False
        self._graph_parts += len(graph.nodes) + len(graph.endpoints) + len(graph.services)
        if participants > self._limits.participants:
            self.stop(graph.t_ns, f"more than {self._limits.participants:,} DDS participants")
        elif max(len(graph.endpoints), len(graph.nodes)) > ENDPOINTS:
            self.stop(graph.t_ns, f"more than {ENDPOINTS:,} nodes, publishers or subscriptions at once")
        elif len(graph.services) > ENDPOINTS:
            self.stop(graph.t_ns, f"more than {ENDPOINTS:,} servers and clients at once")
        elif self._graph_parts > GRAPH_PARTS:
            self.stop(graph.t_ns, "the nodes changed the ROS graph too often")
        else:
            self._graph = graph
            self.observations.append(graph)
        return not self.full

    def look_back(self, t_ns: int) -> None:
        """Record an empty snapshot if there is none: a trace without snapshots says nothing about the graph."""
        if not any(isinstance(o, GraphSnapshot) for o in self.observations):
            self.observations.append(GraphSnapshot(t_ns, (), ()))

    def stop(self, t_ns: int, why: str) -> None:
        """End the recording at a limit, with a mark; the first limit counts."""
        if not self.full:
            self.full = f"{why}: the rest was ignored"
            self.observations.append(Mark(t_ns, "limit", self.full))

    def note(self, *texts: str) -> None:
        """Add notes, which readers of the report see."""
        self._notes += texts[: 2 * NOTES - len(self._notes)] if len(self._notes) < 2 * NOTES else ()

    def notes(self, others: Iterable[str]) -> tuple[str, ...]:
        """Return all notes: first the limit that ended the recording, then the recorded notes, then the others."""
        first = [self.full] if self.full else []
        whole = dict.fromkeys(text[:NOTE_CHARACTERS] for text in (*first, *self._notes, *others))
        return tuple(whole)[:NOTES]
