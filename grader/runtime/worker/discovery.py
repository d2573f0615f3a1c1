"""Waits, in real time, for DDS discovery: messages sent before endpoints are matched would be lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext

from grader.runtime.host.protocol import AwaitMatches, Claim, Matched, is_name
from grader.runtime.model.trace import GraphSnapshot
from grader.runtime.patience import SETTLE_S, Patience, Wait
from grader.runtime.stimuli.calls import PlannedCalls
from grader.runtime.worker.claims import CHANNELS, ORDINARY_END, answers, serves
from grader.runtime.worker.core import Core, Remains
from grader.runtime.worker.matching import Match, Matching
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.service_peers import ServicePeers
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.trace_recorder import NAME_CHARACTERS, TraceRecorder

#: How long, in real time, to wait until a removed endpoint has left the graph.
DEPARTURE_S = 2.0
#: Querying the graph is expensive: the pause keeps the queries from delaying discovery itself.
GRAPH_PAUSE_S = 0.003

#: Kind, name and type of an endpoint as the graph counts it. Servers and clients are counted by name alone.
Key = tuple[str, str, str]


class Discovery:
    """Tracks the endpoints of the students' processes and of the grader, and waits until they are matched.

    Args:
        core: Provides the processes.
        observer: The grader's node.
        recorder: Records graph snapshots and notes.
        services: The grader's servers and clients.
        mark_dead: Called with a process that no longer answers.
        wait: How to wait for discovery.

    Attributes:
        matching: Works out who is to be matched with whom.
        patience: The timeout for anything that was announced.
    """

    def __init__(  # noqa: PLR0913 - whom it asks, and how it waits
        self,
        core: Core[NodeProcess],
        observer: Observer,
        recorder: TraceRecorder,
        services: ServicePeers,
        mark_dead: Callable[[NodeProcess], None],
        *,
        wait: Wait,
    ) -> None:
        self._core = core
        self._students = core.processes
        self.matching = Matching(core, services, observer.watching)
        self._observer = observer
        self._recorder = recorder
        self._services = services
        self._mark_dead = mark_dead
        self.patience = Patience(SETTLE_S, wait)
        self._departures = Patience(DEPARTURE_S, wait)
        #: The graph when it was last looked up, and how many endpoints of those ever claimed were in it.
        self._graph = GraphSnapshot(0, (), ())
        self._found: Counter[Key] = Counter()
        self._known: set[Key] = set()
        self._strangers: Counter[Key] = Counter()
        #: The process of each participant that was seen, and the nodes of processes that were looked for.
        self._owners: dict[bytes, str] = {}
        self._owning: dict[str, set[str]] = {}

    def match(self, now_ns: int) -> None:
        """Wait until the graph shows exactly the endpoints that exist, and all of them are matched."""
        claims = self.matching.claims()
        # What a process that is about to leave has removed already, it tells when it goes on.
        staying = [c for s in self._staying() for c in s.claims]
        staying += [c for remains in self._core.remains for c in remains.claims]
        if not self.patience.wait(lambda: self._holds(now_ns, staying), pause_s=GRAPH_PAUSE_S):
            self._recorder.note("an endpoint that a node created was not seen in the graph")
            self._query(now_ns)

        def gone() -> bool:
            self._query(now_ns)
            return not self._surplus(claims)

        # Usually nothing is to leave, and the query that found everything there is the only one.
        if self._surplus(claims) and not self._departures.wait(gone, pause_s=GRAPH_PAUSE_S):
            # What stays in the graph without anybody's claim is left by a process that died, and counts as known from
            # now on.
            self._strangers = self._strangers + self._surplus(claims)
        self._record()
        unknown = self._observer.watch(self._recorder.graph.endpoints)
        if self._observer.crowded:
            self._recorder.stop(now_ns, self._observer.crowded)
        self._recorder.note(*(f"the type of {name} is not known on this machine" for name in unknown))
        writers = Counter((c.name, c.type) for c in claims if c.kind == "publisher")
        self.patience.wait(lambda: all(self._watched(*writer) for writer in writers.items()))
        self.patience.wait(lambda: all(map(self.is_heard, self.matching.streams)))
        self.matching.announce_kept()
        self.tell_all()

    def advertised(self, topic: str) -> None:
        """Wait until the new publisher of a stimulus is matched with every compatible subscription."""
        self.matching.advertised(topic)
        self.patience.wait(lambda: self.is_heard(topic))
        self.tell_all()

    def is_heard(self, topic: str) -> bool:
        """Return whether the publisher of a stimulus is matched with every compatible subscription."""
        return self._observer.subscribers_matched(topic) >= self.matching.readers(topic)

    def await_departure(self, now_ns: int) -> None:
        """Wait until all other processes, and the grader's node, have seen that a process left before it ended."""
        self.match(now_ns)

    def note_participants(self, student: NodeProcess) -> None:
        """Note which participants are of a process that has reported its endpoints: those that have come since.

        A process may have several, and others may have nodes of the same names.
        """
        nodes = _nodes_of(student)
        if nodes == self._owning.get(student.name):
            return
        self._owning[student.name] = nodes
        for participant, names in self._observer.participants_of_nodes().items():
            if names & nodes:
                self._owners.setdefault(participant, student.name)

    def lose(self, student: NodeProcess) -> None:
        """Note that a process ended without a farewell: its endpoints stay in the graph until its lease ends."""
        self._owning.pop(student.name, None)
        self.note_participants(student)
        self._core.lost(student)

    def end_lease(self, remains: Remains) -> None:
        """Let whoever sees what a process has left know that a lease of it has ended, by the virtual clock.

        The middleware's own lease is much longer in virtual time: it counts real time.
        """
        now_ns = self._core.now_ns
        if now_ns < remains.gone_ns:
            self.tell_all()
            return
        self._core.remains.remove(remains)
        claims = self.matching.claims()

        def has_left() -> bool:
            # again, if it is still there: what it had sent before its end may have arrived only now
            self._observer.say_farewell([p for p, name in self._owners.items() if name == remains.name])
            self._query(now_ns)
            return not self._surplus(claims)

        self._departures.wait(has_left, pause_s=GRAPH_PAUSE_S)
        self.match(now_ns)

    def _staying(self) -> list[NodeProcess]:
        return [s for s in self._students if not (s.ended or s.leaving)]

    def tell_all(self) -> None:
        """Make every process wait for the counterparts of its endpoints."""
        graph = self._observer.counts() if any(s.sees_graph for s in self._students) else {}
        for question in self.matching.questions(graph):
            self._ask(question)

    def _ask(self, question: Match[NodeProcess]) -> None:
        """Let a process wait, and note what it has missed."""
        student = question.process
        with nullcontext() if student.workload is None else student.workload.beside():
            student.tell(AwaitMatches(question.expected, question.gone, self.patience.wait_s))
            answer = student.report()
        if not isinstance(answer, Matched):
            self._mark_dead(student)
            return
        missing = [end.partition(" ") for end in answer.missing]
        untold = [end.partition(" ") for end in answer.untold]
        self.matching.matched(student, [(kind, name) for kind, _, name in missing])
        if missing or untold:
            self.patience.lose()
        late = [(end, "matched") for end in missing] + [(end, "informed about its counterparts") for end in untold]
        for (kind, _, name), what in late:
            if (kind == "publisher" or kind in CHANNELS) and is_name(name):
                self._recorder.note(f"{student.name}: {kind} {name[:NAME_CHARACTERS]} was not {what} in time")

    def retry(self) -> None:
        """Wait once more for the counterparts that a process has missed, before time goes on."""
        if self.patience.is_left and any(s.unmatched and not s.ended for s in self._students):
            self.tell_all()

    def _holds(self, now_ns: int, claims: list[Claim]) -> bool:
        """Return whether the graph shows everything that the processes claim."""
        wanted = _wanted(claims)
        self._known |= wanted.keys()
        names = {c.name for c in claims if c.kind == "node"}
        if not names <= {*self._observer.students_nodes(names)}:
            return False  # before anything that takes longer to query: this is asked most often
        self._query(now_ns)
        found = self._found
        offered = {(e.kind, e.service, e.type) for e in self._graph.services}
        # The end of an action outlives its node, and is then in the list of none.
        nodes = [s.claims for s in self._staying() if any(c.kind == "node" for c in s.claims)]
        exchanging = {(c.kind, c.name, c.type) for own in nodes for c in own if c.kind in ("service", "client")}
        # The middleware tells the services of one node of a name. A node lives on until it is collected, a process that
        # died stays in the graph for its lease, and one that left may return.
        told = exchanging <= offered or self._observer.has_namesakes()
        return told and all(found[key] >= count for key, count in wanted.items())

    def _surplus(self, claims: list[Claim]) -> Counter[Key]:
        """Count the removed endpoints that are still in the graph, except known strangers.

        The name of a node that leaves may go before its endpoints, which programs count until they have gone as well.
        """
        wanted, there = _wanted(claims), self._found + self._observer.unnamed
        return +Counter({key: there[key] - wanted[key] - self._strangers[key] for key in self._known})

    def _query(self, now_ns: int) -> None:
        """Look the graph up, and count in it the endpoints that any process has ever claimed.

        It includes services if any process has reported one.
        """
        services = any(c.kind in ("service", "client") for s in self._students for c in s.claims)
        services = services or bool(self._recorder.graph.services)
        nodes = self._nodes()
        found = Counter(("node", name, "") for name in self._observer.students_nodes(nodes))
        for kind, name, _ in self._known:
            if kind in ("service", "client"):
                found[kind, name, ""] = self._observer.ends_of(kind, name) - self._services.ends_of(kind, name)
        # The graph after the counts: what they miss because it has just left is then not in the graph either.
        self._graph = self._observer.graph(now_ns, services=services, existing=nodes)
        found.update((e.kind, e.topic, e.type) for e in self._graph.endpoints)
        self._found = found

    def _nodes(self) -> set[str]:
        return {c.name for c in self.matching.claims() if c.kind == "node"}

    def is_served(self, calls: PlannedCalls) -> bool:
        """Return whether the server for some calls exists and is matched."""
        service = self._services.resolved(calls.service)
        claims = [c for s in self._students if not s.ended for c in s.claims]
        if service is None or not any(serves(c, service, calls.type) and answers(c, ORDINARY_END) for c in claims):
            return False
        self._services.add_clients(calls)
        if self.patience.wait(lambda: self._observer.services.is_matched(service)):
            return True
        self._recorder.note(f"{service[:NAME_CHARACTERS]} was not matched in time")
        return False

    def _watched(self, written: tuple[str, str], writers: int) -> bool:
        """Return whether the observer's subscription is matched with exactly the publishers of a topic and type."""
        topic, interface = written
        if not self._observer.reads(topic):
            return True
        strangers = self._strangers["publisher", topic, interface]
        matched = self._observer.publishers_matched(topic, interface)
        return writers <= matched <= writers + strangers + self._observer.publishes(topic)

    def look(self, now_ns: int) -> None:
        """Record the graph if it has changed."""
        self._query(now_ns)
        self._record()

    def _record(self) -> None:
        self._recorder.look(self._observer.with_qos(self._graph), self._observer.participants())


def _nodes_of(student: NodeProcess) -> set[str]:
    return {c.name for c in student.claims if c.kind == "node"}


def _wanted(claims: list[Claim]) -> Counter[Key]:
    return Counter(_key(c) for c in claims if c.kind != "parameter")


def _key(claim: Claim) -> Key:
    exchanges = claim.kind in ("service", "client", "node")
    return claim.kind, claim.name, "" if exchanges else claim.type
