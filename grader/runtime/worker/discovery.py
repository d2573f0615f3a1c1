"""Waits, in real time, for DDS discovery: messages sent before endpoints are matched would be lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

from grader.runtime.model.trace import GraphSnapshot
from grader.runtime.patience import Patience
from grader.runtime.stimuli.calls import PlannedCalls
from grader.runtime.stimuli.messages import PlannedMessages
from grader.runtime.worker.claims import (
    CHANNELS,
    ORDINARY,
    answers,
    compatible,
    fits,
    meets,
    passes,
    readers_of,
    serves,
)
from grader.runtime.worker.core import Core, announce
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.ros_names import is_name
from grader.runtime.worker.service_peers import ServicePeers
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.trace_recorder import NAME_CHARACTERS, TraceRecorder

#: How long, in real time, to wait until a removed endpoint has left the graph.
DEPARTURE_S = 2.0
#: Querying the graph is expensive: the pause keeps the queries from delaying discovery itself.
GRAPH_PAUSE_S = 0.003
#: The host never reports more unmatched names than this.
MOST_UNMATCHED = 10_000

#: Kind, name and type of an endpoint as the graph counts it. Servers and clients are counted by name alone.
Key = tuple[str, str, str]


class Discovery:
    """Tracks the endpoints of the students' processes and of the grader, and waits until they are matched.

    Args:
        core: Provides the processes, and how many messages they keep for subscriptions that come later.
        observer: The grader's node.
        recorder: Records graph snapshots and notes.
        services: The grader's servers and clients.
        mark_dead: Called with a process that no longer answers.

    Attributes:
        streams: The topics that stimuli publish on now, with their types.
        fixed: The streams whose type a rubric has fixed.
        latched: The other streams whose publisher is latched, because the first subscription asked for that.
        published: How many messages each stimulus has published.
        patience: The timeout for anything that was announced.
    """

    def __init__(
        self,
        core: Core[NodeProcess],
        observer: Observer,
        recorder: TraceRecorder,
        services: ServicePeers,
        mark_dead: Callable[[NodeProcess], None],
    ) -> None:
        self._core = core
        self._students = core.processes
        self._observer = observer
        self._recorder = recorder
        self._services = services
        self._mark_dead = mark_dead
        self.patience = Patience()
        self._departures = Patience(DEPARTURE_S)
        self._served: set[tuple[str, str, str]] = set()
        self._known: set[Key] = set()
        self._strangers: Counter[Key] = Counter()
        self.streams: dict[str, str] = {}
        self.fixed: dict[str, PlannedMessages] = {}
        self.latched: set[str] = set()
        #: How many publishers each stimulus has had, and for each endpoint of a process, by its number there, the
        #: counterparts of the same type whose QoS has kept them apart: the middleware counts those that have gone, too.
        self._writers: Counter[str] = Counter()
        self._refused: dict[tuple[str, int], set[tuple[str, int]]] = {}
        self.published: Counter[str] = Counter()

    def match(self, now_ns: int) -> None:
        """Wait until the graph shows exactly the endpoints that exist, and all of them are matched."""
        claims = self._claims()
        # What a process that is about to leave has removed already, it tells when it goes on.
        staying = [c for s in self._staying() for c in s.claims]
        if not self.patience.wait(lambda: self._holds(now_ns, staying), pause_s=GRAPH_PAUSE_S):
            self._recorder.note("an endpoint that a node created was not seen in the graph")
        if not self._departures.wait(lambda: not self._surplus(now_ns, claims), pause_s=GRAPH_PAUSE_S):
            # What stays in the graph without anybody's claim is left by a process that died, and counts as known from
            # now on.
            self._strangers = self._strangers + self._surplus(now_ns, claims)
        self.look(now_ns)
        unknown = self._observer.watch(self._recorder.graph.endpoints)
        if self._observer.crowded:
            self._recorder.stop(now_ns, self._observer.crowded)
        self._recorder.note(*(f"the type of {name} is not known on this machine" for name in unknown))
        writers = [c for c in claims if c["kind"] == "publisher"]
        self.patience.wait(lambda: all(self._watched(c, writers) for c in writers))
        self.patience.wait(lambda: all(map(self.is_heard, self.streams)))
        self._announce_kept()
        self.tell_all()

    def _announce_kept(self) -> None:
        """Announce the messages that latched publishers resend to new transient-local subscriptions."""
        writers = [("", self.offered(topic), self.published[topic]) for topic in self.fixed]
        for talker in self._students:
            latched = [c for c in talker.claims if c["kind"] == "publisher" and c["latched"]]
            # how many a student's publisher keeps is not known, but that one comes is certain
            writers += [(talker.name, c, min(1, self._core.kept[talker.name, c["name"]])) for c in latched]
        served = {
            (student.name, writer["name"], sender): count
            for sender, writer, count in writers
            for student in self._students
            if any(c["latched"] and compatible(writer, c) for c in readers_of(student.claims, writer["name"]))
        }
        students = {student.name: student for student in self._students}
        for (reader, topic, sender), count in served.items():
            if count and (reader, topic, sender) not in self._served:
                announce(students[reader], f"topic {topic}", count)
        # Forgotten with the subscription: a new one on the same topic gets the kept messages again.
        self._served = set(served)

    def offered(self, topic: str) -> dict[str, Any]:
        """Describe the publisher of a stimulus as a process would describe its own."""
        fixed = self.fixed.get(topic)
        return {
            **ORDINARY,
            "name": topic,
            "type": self.streams[topic],
            "reliable": fixed is None or not fixed.best_effort,
            "latched": topic in self.latched if fixed is None else fixed.latched,
        }

    def advertised(self, topic: str) -> None:
        """Wait until the new publisher of a stimulus is matched with every compatible subscription."""
        self._writers[topic] += 1
        self.patience.wait(lambda: self.is_heard(topic))
        self.tell_all()

    def is_heard(self, topic: str) -> bool:
        """Return whether the publisher of a stimulus is matched with every compatible subscription."""
        writer = self.offered(topic)
        # The grader watches its own stimuli where a student publishes on the same topic.
        own = sum(writer["reliable"] or not reliable for reliable in self._observer.watching(topic, writer["type"]))
        readers = sum(compatible(writer, c) for s in self._students if not s.ended for c in readers_of(s.claims, topic))
        return self._observer.subscribers_matched(topic) >= int(readers + own)

    def takes(self, reader: dict[str, Any], topic: str) -> bool:
        """Return whether a subscription is compatible with the stimulus on a topic."""
        return topic in self.streams and compatible(self.offered(topic), reader)

    def await_departure(self, now_ns: int) -> None:
        """Wait until all other processes have seen that a process left the graph before it ended."""
        if any(not student.ended for student in self._students):
            self.match(now_ns)

    def lose(self, student: NodeProcess) -> None:
        """Note that a process ended without leaving the graph, so its endpoints stay there for a while."""
        self._strangers += Counter(map(_key, student.claims))

    def _staying(self) -> list[NodeProcess]:
        return [s for s in self._students if not (s.ended or s.leaving)]

    def _claims(self) -> list[dict[str, Any]]:
        return [c for s in self._students if not s.ended for c in s.claims]

    def tell_all(self) -> None:
        """Make every process wait for the counterparts of its endpoints."""
        claims = self._claims()
        self._count_refused()
        graph = self._observer.counts() if any(s.sees_graph for s in self._students) else {}
        for student in self._students:
            if not student.ended and (student.claims or student.told):
                self._tell_matches(student, claims, graph)

    def _count_refused(self) -> None:
        """Note for each publisher and subscription of a process the counterparts whose QoS keeps them apart."""
        writers: dict[tuple[str, str], list[tuple[tuple[str, int], dict[str, Any]]]] = {}
        for topic, interface in self.streams.items():
            writers.setdefault((topic, interface), []).append(((topic, self._writers[topic]), self.offered(topic)))
        ends = [
            ((student.name, claim.get("number", 0)), claim)
            for student in self._students
            for claim in student.claims
            if claim["kind"] in ("publisher", "subscription")
        ]
        for end, claim in ends:
            if claim["kind"] == "publisher":
                writers.setdefault((claim["name"], claim["type"]), []).append((end, claim))
        for reader, wish in ends:
            same = writers.get((wish["name"], wish["type"]), []) if wish["kind"] == "subscription" else []
            for writer, offer in same:
                if not fits(offer, wish):
                    self._refused.setdefault(reader, set()).add(writer)
                    self._refused.setdefault(writer, set()).add(reader)

    def retry(self) -> None:
        """Wait once more for the counterparts that a process has missed, before time goes on."""
        if self.patience.is_left and any(s.unmatched and not s.ended for s in self._students):
            self.tell_all()

    def _holds(self, now_ns: int, claims: list[dict[str, Any]]) -> bool:
        """Return whether the graph shows everything that the processes claim."""
        wanted = _wanted(claims)
        self._known |= wanted.keys()
        names = {c["name"] for c in claims if c["kind"] == "node"}
        if not names <= {*self._observer.students_nodes(names)}:
            return False  # before anything that takes longer to query: this is asked most often
        graph = self._graph_at(now_ns)
        found = self._found(graph)
        offered = {(e.kind, e.service, e.type) for e in graph.services}
        # The end of an action outlives its node, and is then in the list of none.
        nodes = [s.claims for s in self._staying() if any(c["kind"] == "node" for c in s.claims)]
        exchanging = {
            (c["kind"], c["name"], c["type"]) for own in nodes for c in own if c["kind"] in ("service", "client")
        }
        # The middleware tells the services of one node of a name. A node lives on until it is collected, and a process
        # that left may stay in the graph for its lease.
        namesakes = any(kind == "node" and count > 1 for (kind, _, _), count in found.items())
        return (namesakes or exchanging <= offered) and all(found[key] >= count for key, count in wanted.items())

    def _surplus(self, now_ns: int, claims: list[dict[str, Any]]) -> Counter[Key]:
        """Count the removed endpoints that are still in the graph, except known strangers."""
        wanted, found = _wanted(claims), self._found(self._graph_at(now_ns))
        return +Counter({key: found[key] - wanted[key] - self._strangers[key] for key in self._known})

    def _found(self, graph: GraphSnapshot) -> Counter[Key]:
        """Count, in the graph, the endpoints that any process has ever claimed."""
        found = Counter((e.kind, e.topic, e.type) for e in graph.endpoints)
        found.update(("node", name, "") for name in self._observer.students_nodes(self._nodes()))
        for kind, name, _ in self._known:
            if kind in ("service", "client"):
                found[kind, name, ""] = self._observer.ends_of(kind, name) - self._services.ends_of(kind, name)
        return found

    def _graph_at(self, now_ns: int) -> GraphSnapshot:
        """Return the live graph, including services if any process has reported one."""
        services = any(c["kind"] in ("service", "client") for s in self._students for c in s.claims)
        services = services or bool(self._recorder.graph.services)
        return self._observer.graph(now_ns, services=services, existing=self._nodes())

    def _nodes(self) -> set[str]:
        return {c["name"] for c in self._claims() if c["kind"] == "node"}

    def is_served(self, calls: PlannedCalls) -> bool:
        """Return whether the server for some calls exists and is matched."""
        service = self._services.resolved(calls.service)
        claims = [c for s in self._students if not s.ended for c in s.claims]
        if service is None or not any(serves(c, service, calls.type) and answers(c, {}) for c in claims):
            return False
        self._services.add_clients(calls)
        if self.patience.wait(lambda: self._observer.services.is_matched(service)):
            return True
        self._recorder.note(f"{service[:NAME_CHARACTERS]} was not matched in time")
        return False

    def _watched(self, claim: dict[str, Any], writers: list[dict[str, Any]]) -> bool:
        """Return whether the observer's subscription is matched with exactly the publishers of a topic and type."""
        if not self._observer.reads(claim["name"]):
            return True
        same = sum(meets(writer, claim) for writer in writers)
        matched = self._observer.publishers_matched(claim["name"], claim["type"])
        return same <= matched <= same + self._strangers[_key(claim)] + self._observer.publishes(claim["name"])

    def _tell_matches(self, student: NodeProcess, claims: list[dict[str, Any]], graph: dict[str, int]) -> None:
        """Make a process wait for the counterparts of its endpoints, unless it already waited for the same ones."""
        expected: dict[str, dict[str, list[int]]] = {}
        for claim in student.claims:
            count = self._counterparts(claim, claims)
            if count:
                expected.setdefault(claim["kind"], {}).setdefault(claim["name"], []).append(count)
            elif claim["kind"] == "client" and (heard := self._hearing(claim, claims)):
                expected.setdefault("heard", {})[claim["name"]] = [heard]
            number = claim.get("number", 0)
            if refused := self._refused.get((student.name, number)):
                expected.setdefault("refused", {})[str(number)] = [len(refused)]
        if student.sees_graph:
            expected["graph"] = {name: [count] for name, count in graph.items()}
        gone = sorted(student.told.get("client", {}).keys() - expected.get("client", {}).keys())
        if expected == student.told and not ((student.renewed or student.unmatched) and expected):
            return
        student.told, student.renewed = expected, False
        with nullcontext() if student.workload is None else student.workload.beside():
            student.tell({"match": expected, "gone": gone, "wait_s": self.patience.wait_s})
            answer = student.report()
        if answer is None or answer.get("kind") != "matched":
            self._mark_dead(student)
            return
        student.nudged = True  # a match is an event that a node may have a callback for, and so is a refusal
        missing = [str(end).partition(" ") for end in _listed(answer.get("missing"))]
        student.unmatched = frozenset(f"{CHANNELS.get(kind, kind)} {name}" for kind, _, name in missing)
        untold = [str(end).partition(" ") for end in _listed(answer.get("untold"))]
        if missing or untold:
            self.patience.lose()
        late = [(end, "matched") for end in missing] + [(end, "informed about its counterparts") for end in untold]
        for (kind, _, name), what in late:
            if (kind == "publisher" or kind in CHANNELS) and is_name(name):
                self._recorder.note(f"{student.name}: {kind} {name[:NAME_CHARACTERS]} was not {what} in time")

    def _counterparts(self, claim: dict[str, Any], claims: list[dict[str, Any]]) -> int:
        kind, name = claim["kind"], claim["name"]
        if kind == "publisher":
            students = sum(compatible(claim, c) for c in claims if c["kind"] == "subscription")
            watching = self._observer.watching(name, claim["type"])
            return students + sum(fits(claim, {"reliable": reliable}) for reliable in watching)
        if kind == "subscription":
            return self.takes(claim, name) + sum(compatible(c, claim) for c in claims if c["kind"] == "publisher")
        if kind == "service":
            asking = ("client", name, claim["type"])
            students = sum((c["kind"], c["name"], c["type"]) == asking for c in claims)
            return students + self._services.ends_of("client", name)
        if kind != "client":
            return 0
        graders = self._services.serves(name, claim["type"]) and answers({}, claim)
        return int(graders or any(serves(c, name, claim["type"]) and answers(c, claim) for c in claims))

    def _hearing(self, client: dict[str, Any], claims: list[dict[str, Any]]) -> int:
        """Count the servers that get the requests of a client, although it may not get their responses."""
        return sum(serves(c, client["name"], client["type"]) and passes(client, c) for c in claims)

    def look(self, now_ns: int) -> None:
        """Record the graph if it has changed."""
        self._recorder.look(self._observer.with_qos(self._graph_at(now_ns)), self._observer.participants())


def _listed(value: Any) -> list[Any]:
    return value[:MOST_UNMATCHED] if isinstance(value, list) else []


def _wanted(claims: list[dict[str, Any]]) -> Counter[Key]:
    return Counter(_key(c) for c in claims if c["kind"] != "parameter")


def _key(claim: dict[str, Any]) -> Key:
    exchanges = claim["kind"] in ("service", "client", "node")
    return claim["kind"], claim["name"], "" if exchanges else claim["type"]
