"""Waits, in real time, until endpoints that belong together have found each other, so that nothing sent is lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

from grader.model.trace import GraphSnapshot
from grader.recording.claims import announce, compatible, offered, readers_of, serves, takes_ordinary
from grader.recording.desk import Desk
from grader.recording.exchanges import PlannedCalls, PlannedMessages
from grader.recording.observer import Observer
from grader.recording.patience import Patience
from grader.recording.student import Student
from grader.recording.tape import NAME_CHARACTERS, Tape

#: Looking at the graph costs much: not so often that it holds up what is looked for.
GRAPH_PAUSE_S = 0.003
#: A process that names more than this as unmatched does not talk like the host.
WORDS = 10_000


class Matching:
    """Knows which endpoints there are on both sides.

    Args:
        students: The processes.
        observer: The grader's node.
        tape: Where the graph is taken down.
        desk: The grader's servers and clients.
        bury: Called with a process that no longer answers.

    Attributes:
        streams: The topics that stimuli publish on now, with their types.
        fixed: Those whose type a rubric has fixed.
        said: How many messages each of those has sent.
        patience: How long whatever was announced is waited for.
    """

    def __init__(
        self,
        students: list[Student],
        observer: Observer,
        tape: Tape,
        desk: Desk,
        bury: Callable[[Student], None],
    ) -> None:
        self._students = students
        self._observer = observer
        self._tape = tape
        self._desk = desk
        self._bury = bury
        self.patience = Patience()
        self._served: set[tuple[str, str]] = set()
        self.streams: dict[str, str] = {}
        self.fixed: dict[str, PlannedMessages] = {}
        self.said: Counter[str] = Counter()

    def match(self, now_ns: int) -> None:
        """Wait until every endpoint that the processes say they have is seen, watched and matched."""
        claims = [c for s in self._students if not s.ended for c in s.claims]
        ends = [c for c in claims if c["kind"] in ("publisher", "subscription")]
        if not self.patience.wait(lambda: self._sees(now_ns, claims), pause_s=GRAPH_PAUSE_S):
            self._tape.note("an endpoint that a node created was not seen in the graph")
        self.look(now_ns)
        unknown = self._observer.watch(self._tape.graph)
        self._tape.note(*(f"the type of {name} is not known on this machine" for name in unknown))
        writers = [c for c in ends if c["kind"] == "publisher"]
        self.patience.wait(lambda: all(self._watched(c, writers) for c in writers))
        self._announce_kept()
        self.tell_all()

    def _announce_kept(self) -> None:
        """Tell processes of what publishers have kept for subscriptions that come late and ask for it."""
        for topic, stream in self.fixed.items():
            for student in self._students:
                asks = any(c["latched"] and compatible(offered(stream), c) for c in readers_of(student, topic))
                if asks and self.said[topic] and (student.name, topic) not in self._served:
                    self._served.add((student.name, topic))
                    announce(student.arrivals, f"topic {topic}", self.said[topic])

    def tell_all(self) -> None:
        """Have every process wait for the counterparts of its endpoints."""
        claims = [c for s in self._students if not s.ended for c in s.claims]
        for student in self._students:
            if not student.ended and student.claims:
                self._tell_matches(student, claims)

    def _sees(self, now_ns: int, claims: list[dict[str, Any]]) -> bool:
        """Return whether the graph holds what the processes claim."""
        graph = self._graph_at(now_ns)
        seen = Counter((e.kind, e.topic, e.type) for e in graph.endpoints)
        ends = [c for c in claims if c["kind"] in ("publisher", "subscription")]
        wanted = Counter((c["kind"], c["name"], c["type"]) for c in ends)
        offered = {(e.kind, e.service, e.type) for e in graph.services}
        exchanging = {(c["kind"], c["name"], c["type"]) for c in claims if c["kind"] in ("service", "client")}
        nodes = {c["name"] for c in claims if c["kind"] == "node"}
        return (
            all(seen[key] >= count for key, count in wanted.items())
            and exchanging <= offered
            and nodes <= set(graph.nodes)
        )

    def _graph_at(self, now_ns: int) -> GraphSnapshot:
        """Return the live graph, with services where a process has said that it has any."""
        services = any(c["kind"] in ("service", "client") for s in self._students for c in s.claims)
        return self._observer.graph(now_ns, services=services or bool(self._tape.graph.services))

    def is_served(self, calls: PlannedCalls) -> bool:
        """Return whether the server that some calls need is there and matched."""
        service = self._desk.resolved(calls.service)
        claims = [c for s in self._students if not s.ended for c in s.claims]
        if service is None or not any(serves(c, service, calls.type) for c in claims):
            return False
        self._desk.meet(calls)
        if self.patience.wait(lambda: self._observer.services.met(service)):
            return True
        self._tape.note(f"{service[:NAME_CHARACTERS]} was not matched in time")
        return False

    def _watched(self, claim: dict[str, Any], writers: list[dict[str, Any]]) -> bool:
        same = [
            w
            for w in writers
            if (w["name"], w["type"], w["reliable"]) == (claim["name"], claim["type"], claim["reliable"])
        ]
        matched = self._observer.publishers_matched(claim["name"], claim["type"], reliable=claim["reliable"])
        # A reader that takes best effort also matches reliable writers: it may see more than its own.
        return matched >= len(same) or not self._observer.reads(claim["name"])

    def _tell_matches(self, student: Student, claims: list[dict[str, Any]]) -> None:
        """Have a process wait for the counterparts of its endpoints, unless it was told of as many before."""
        expected: dict[str, dict[str, list[int]]] = {}
        for claim in student.claims:
            count = self._counterparts(claim, claims)
            if count:
                expected.setdefault(claim["kind"], {}).setdefault(claim["name"], []).append(count)
        gone = sorted(student.told.get("client", {}).keys() - expected.get("client", {}).keys())
        if expected == student.told or not (expected or gone):
            return
        student.told = expected
        student.tell({"match": expected, "gone": gone, "wait_s": self.patience.wait_s})
        answer = student.report()
        if answer is None or answer.get("kind") != "matched":
            self._bury(student)
            return
        student.nudged = True  # a match is an event that a node may have a callback for
        missing = answer.get("missing")
        if missing:
            self.patience.lose()
        for name in missing[:WORDS] if isinstance(missing, list) else ():
            self._tape.note(f"{student.name}: {str(name)[:NAME_CHARACTERS]} was not matched in time")

    def _counterparts(self, claim: dict[str, Any], claims: list[dict[str, Any]]) -> int:
        kind, name = claim["kind"], claim["name"]
        if kind == "publisher":
            students = sum(compatible(claim, c) for c in claims if c["kind"] == "subscription")
            return students + sum(
                1 for key in self._observer.watching(name, claim["type"]) if claim["reliable"] or not key
            )
        if kind == "subscription":
            fixed = self.fixed.get(name)
            fits = takes_ordinary(claim) if fixed is None else compatible(offered(fixed), claim)
            stimulus = self.streams.get(name) == claim["type"] and fits
            return int(stimulus) + sum(compatible(c, claim) for c in claims if c["kind"] == "publisher")
        if kind != "client":
            return 0
        return int(
            self._desk.serves(name, claim["type"])
            or any((c["kind"], c["name"], c["type"]) == ("service", name, claim["type"]) for c in claims)
        )

    def look(self, now_ns: int) -> None:
        """Take down the graph where it has changed."""
        self._tape.look(self._graph_at(now_ns), self._observer.participants())
