"""Works out which counterparts the endpoints of a run are to have; whether they have them is for discovery to see."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Generic, Protocol

from grader.runtime.host.protocol import NO_COUNTERPARTS, ORDINARY, Claim, Counterparts
from grader.runtime.model.dataclass import dataclass
from grader.runtime.stimuli.messages import PlannedMessages
from grader.runtime.worker.claims import (
    CHANNELS,
    ORDINARY_END,
    answers,
    compatible,
    ends_of_kind,
    fits,
    passes,
    readers_of,
    serves,
)
from grader.runtime.worker.core import Core, P, announce


class GradersServices(Protocol):
    """The grader's own servers and clients, as far as others are matched with them."""

    def serves(self, service: str, interface: str) -> bool:
        """Return whether the grader has a server for a service and type now."""

    def ends_of(self, kind: str, service: str) -> int:
        """Return the number of the grader's servers (`service`) or clients (`client`) of a service."""


@dataclass(frozen=True, slots=True)
class Match(Generic[P]):
    """Make a process wait for the counterparts of its endpoints.

    Attributes:
        process: The process.
        expected: The counterparts.
        gone: The services whose servers have left, and are to disappear.
    """

    process: P
    expected: Counterparts
    gone: list[str]


class Matching(Generic[P]):
    """The endpoints of the processes and the grader's, and who is to be matched with whom.

    Args:
        core: Provides the processes, and how many messages they keep for subscriptions that come later.
        services: The grader's servers and clients.
        watching: Returns, for the topic and type of a publisher, the grader's subscriptions that watch it: whether each
            is reliable.

    Attributes:
        streams: The topics that stimuli publish on now, with their types.
        fixed: The streams whose type a rubric has fixed.
        latched: The other streams whose publisher is latched, because the first subscription asked for that.
        published: How many messages each stimulus has published.
    """

    def __init__(
        self, core: Core[P], services: GradersServices, watching: Callable[[str, str], Iterable[bool]]
    ) -> None:
        self._core = core
        self._services = services
        self._watching = watching
        self.streams: dict[str, str] = {}
        self.fixed: dict[str, PlannedMessages] = {}
        self.latched: set[str] = set()
        self.published: Counter[str] = Counter()
        self._served: set[tuple[str, str, str]] = set()
        #: How many publishers each stimulus has had, and for each endpoint of a process, by its number there, the
        #: counterparts of the same type whose QoS has kept them apart: the middleware counts those that have gone, too.
        self._writers: Counter[str] = Counter()
        self._refused: dict[tuple[str, int], set[tuple[str, int]]] = {}

    def claims(self) -> list[Claim]:
        """Return the endpoints of all processes that have not ended, and those that others have left in the graph."""
        return [*self._living(), *(c for remains in self._core.remains for c in remains.claims)]

    def _living(self) -> list[Claim]:
        return [c for process in self._core.processes if not process.ended for c in process.claims]

    def _seen_by(self, process: P) -> list[Claim]:
        """Return the endpoints that a process sees: all, but for what was left in the graph before it came."""
        seen = [remains for remains in self._core.remains if process.name in remains.witnesses]
        return [*self._living(), *(c for remains in seen for c in remains.claims)]

    def _counted_by(self, process: P, graph: Mapping[str, int]) -> dict[str, int]:
        """Return how many endpoints of each name a process sees in the graph, of those that the grader sees."""
        unseen = [remains for remains in self._core.remains if process.name not in remains.witnesses]
        left = Counter(f"{c.kind} {c.name}" for remains in unseen for c in remains.claims)
        return {name: seen for name, count in graph.items() if (seen := count - left[name]) > 0}

    def advertised(self, topic: str) -> None:
        """Note that a stimulus has a new publisher."""
        self._writers[topic] += 1

    def offered(self, topic: str) -> Claim:
        """Describe the publisher of a stimulus as a process would describe its own."""
        fixed = self.fixed.get(topic)
        qos = ORDINARY._replace(
            reliable=fixed is None or not fixed.best_effort,
            latched=topic in self.latched if fixed is None else fixed.latched,
        )
        return Claim("publisher", topic, self.streams[topic], qos=qos)

    def takes(self, reader: Claim, topic: str) -> bool:
        """Return whether a subscription is compatible with the stimulus on a topic."""
        return topic in self.streams and compatible(self.offered(topic), reader)

    def readers(self, topic: str) -> int:
        """Return how many subscriptions the publisher of a stimulus is to be matched with."""
        writer = self.offered(topic)
        # The grader watches its own stimuli where a student publishes on the same topic.
        own = sum(writer.qos.reliable or not reliable for reliable in self._watching(topic, writer.type))
        return int(own + sum(compatible(writer, c) for c in readers_of(self.claims(), topic)))

    def announce_kept(self) -> None:
        """Announce the messages that latched publishers resend to new transient-local subscriptions."""
        writers = [("", self.offered(topic), self.published[topic]) for topic in self.fixed]
        for talker in self._core.processes:
            latched = [c for c in talker.claims if c.kind == "publisher" and c.qos.latched]
            # how many a student's publisher keeps is not known, but that one comes is certain
            writers += [(talker.name, c, min(1, self._core.kept[talker.name, c.name])) for c in latched]
        served = {
            (student.name, writer.name, sender): count
            for sender, writer, count in writers
            for student in self._core.processes
            if any(c.qos.latched and compatible(writer, c) for c in readers_of(student.claims, writer.name))
        }
        students = {student.name: student for student in self._core.processes}
        for (reader, topic, sender), count in served.items():
            if count and (reader, topic, sender) not in self._served:
                announce(students[reader], f"topic {topic}", count)
        # Forgotten with the subscription: a new one on the same topic gets the kept messages again.
        self._served = set(served)

    def questions(self, graph: Mapping[str, int]) -> Iterator[Match[P]]:
        """Make every process wait for the counterparts of its endpoints, unless it already waited for the same ones.

        Args:
            graph: How many endpoints of each name there are, for programs that query the graph.
        """
        self._count_refused()
        for process in self._core.processes:
            if not process.ended and (process.claims or process.told != NO_COUNTERPARTS):
                expected = self._expected(process, self._seen_by(process), self._counted_by(process, graph))
                gone = sorted(process.told.client.keys() - expected.client.keys())
                again = (process.renewed or process.unmatched) and expected != NO_COUNTERPARTS
                if expected == process.told and not again:
                    continue
                process.told, process.renewed = expected, False
                yield Match(process, expected, gone)

    def matched(self, process: P, missing: Iterable[tuple[str, str]]) -> None:
        """Note that a process has waited, and the kinds and names of its endpoints that have too few counterparts."""
        process.nudged = True  # a match is an event that a node may have a callback for, and so is a refusal
        process.unmatched = frozenset(f"{CHANNELS.get(kind, kind)} {name}" for kind, name in missing)

    def _count_refused(self) -> None:
        """Note for each publisher and subscription of a process the counterparts whose QoS keeps them apart."""
        writers: dict[tuple[str, str], list[tuple[tuple[str, int], Claim]]] = {}
        for topic, interface in self.streams.items():
            writers.setdefault((topic, interface), []).append(((topic, self._writers[topic]), self.offered(topic)))
        left = {remains.name: remains for remains in self._core.remains}
        owners = [*((p.name, p.claims) for p in self._core.processes), *((r.name, r.claims) for r in left.values())]
        ends = [
            ((name, claim.number), claim)
            for name, claims in owners
            for claim in claims
            if claim.kind in ("publisher", "subscription")
        ]

        def is_seen(end: tuple[str, int], by: tuple[str, int]) -> bool:
            return end[0] not in left or by[0] in left[end[0]].witnesses

        for end, claim in ends:
            if claim.kind == "publisher":
                writers.setdefault((claim.name, claim.type), []).append((end, claim))
        for reader, wish in ends:
            same = writers.get((wish.name, wish.type), []) if wish.kind == "subscription" else []
            for writer, offer in same:
                if is_seen(writer, reader) and is_seen(reader, writer) and not fits(offer.qos, wish.qos):
                    self._refused.setdefault(reader, set()).add(writer)
                    self._refused.setdefault(writer, set()).add(reader)

    def _expected(self, process: P, claims: list[Claim], graph: Mapping[str, int]) -> Counterparts:
        ends: dict[str, dict[str, list[int]]] = {
            kind: {} for kind in ("publisher", "subscription", "client", "service")
        }
        heard, refused, alive = {}, {}, {}
        for claim in process.claims:
            count = self._counterparts(claim, claims)
            if count:
                ends[claim.kind].setdefault(claim.name, []).append(count)
            elif claim.kind == "client" and (hearing := self._hearing(claim, claims)):
                heard[claim.name] = hearing
            if claim.kind == "subscription" and claim.qos.lease_ns:
                alive[str(claim.number)] = self._alive(process, claim)
            if kept_apart := self._refused.get((process.name, claim.number)):
                refused[str(claim.number)] = len(kept_apart)
        looked_at = dict(graph) if process.sees_graph else None
        return Counterparts(**ends, heard=heard, refused=refused, alive=alive, graph=looked_at)

    def _alive(self, process: P, reader: Claim) -> list[int]:
        """Count the publishers of a subscription with a lease that live, and those that have not for that lease.

        Returns:
            The two numbers; none where a publisher has to show that it lives, which only the middleware times.
        """
        living = [c for c in ends_of_kind(self._living(), "publisher") if compatible(c, reader)]
        alive, silent = len(living), 0
        for remains in self._core.remains:
            left = [c for c in ends_of_kind(remains.claims, "publisher") if compatible(c, reader)]
            living += left
            # of a publisher that was found when it was dead already, nobody knows that it has ever lived
            if process.name in remains.witnesses and self._core.appeared_ns(process, reader) <= remains.died_ns:
                is_silent = self._core.now_ns >= remains.died_ns + reader.qos.lease_ns
                alive, silent = alive + len(left) * (not is_silent), silent + len(left) * is_silent
        return [] if any(c.qos.manual for c in living) else [alive, silent]

    def _counterparts(self, claim: Claim, claims: list[Claim]) -> int:
        kind, name = claim.kind, claim.name
        if kind == "publisher":
            students = sum(compatible(claim, c) for c in claims if c.kind == "subscription")
            watching = self._watching(name, claim.type)
            return students + sum(fits(claim.qos, ORDINARY._replace(reliable=reliable)) for reliable in watching)
        if kind == "subscription":
            return self.takes(claim, name) + sum(compatible(c, claim) for c in claims if c.kind == "publisher")
        if kind == "service":
            asking = ("client", name, claim.type)
            students = sum((c.kind, c.name, c.type) == asking for c in claims)
            return students + self._services.ends_of("client", name)
        if kind != "client":
            return 0
        graders = self._services.serves(name, claim.type) and answers(ORDINARY_END, claim)
        return int(graders or any(serves(c, name, claim.type) and answers(c, claim) for c in claims))

    def _hearing(self, client: Claim, claims: list[Claim]) -> int:
        """Count the servers that get the requests of a client, although it may not get their responses."""
        return sum(serves(c, client.name, client.type) and passes(client, c) for c in claims)
