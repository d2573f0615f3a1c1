"""Checks on the ROS graph: names of nodes and topics, edges between nodes, and the QoS of an endpoint."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import ClassVar, Literal

from grader.grading.judging.findings import explain_fault, explain_no_subscription, faulted, first_fault, met, not_met
from grader.grading.judging.values import student_endpoints
from grader.grading.model.exercise import NODE_GRAPH, Finding, Problem, ProblemKind
from grader.grading.model.wording import first_few, moment, nearest, number, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import DurationNs, counted, seconds
from grader.runtime.model.trace import Endpoint, GraphSnapshot, Trace

Pair = tuple[Endpoint, Endpoint]


@dataclass(frozen=True, slots=True)
class GraphEdge:
    """An edge of the ROS graph; a node that is left out may be any of the students'.

    Attributes:
        topic: Topic name as on the wire.
        source: Fully qualified name of the publishing node.
        target: Fully qualified name of the subscribing node.
    """

    topic: str
    source: str | None = None
    target: str | None = None

    def __str__(self) -> str:
        """Return the edge in the form of reports."""
        return f"{self.source or 'a node'} ─{self.topic}→ {self.target or 'a node'}"

    def joins(self, publisher: Endpoint, subscription: Endpoint) -> bool:
        """Return whether it may join two endpoints by the names of their nodes."""
        return self.source in (None, publisher.node) and self.target in (None, subscription.node)


@dataclass(frozen=True, slots=True)
class GraphEdges:
    """The live graph has edges between students' nodes by given topics, with matching types.

    Attributes:
        edges: Each with `topic`, and `source` and `target` if the nodes' names matter.
        at_once: Whether all edges must exist at one moment.
        between_processes: Whether the two nodes must belong to different processes.
    """

    drawing: ClassVar[str] = NODE_GRAPH
    edges: tuple[GraphEdge, ...]
    at_once: bool = False
    between_processes: bool = False

    @property
    def expected(self) -> str:
        return f"{', '.join(map(str, self.edges))} in the ROS graph{' at one moment' if self.at_once else ''}"

    def judge(self, trace: Trace) -> Finding:
        return self.judged(trace)

    def judged(self, trace: Trace, *, both_ways: bool = False) -> Finding:
        """Judge a recording; `both_ways`: the two edges must lead there and back between the same two processes."""
        # What is there after the stop signal is on its way out.
        snapshots = [g for g in trace.graphs() if g.t_ns < trace.stop_ns]
        found = [[self._pairs(g, edge) for edge in self.edges] for g in snapshots]
        first = {edge: next((p[k][0] for p in found if p[k]), None) for k, edge in enumerate(self.edges)}
        wanted: dict[str, object] = {} if both_ways else {"edges": [str(edge) for edge in self.edges if first[edge]]}
        key = "edges" if both_ways else "found"
        for snapshot, pairs in zip(snapshots, found, strict=True):
            # All edges in one snapshot first, even where they may come at different times: reports can then name a
            # moment.
            chosen = next((c for c in product(*pairs) if not both_ways or _lead_back(*c)), None)
            if chosen is not None:
                drawn = {"t_s": seconds(snapshot.t_ns), key: [_edge(*pair) for pair in chosen]}
                return met(f"{moment(snapshot.t_ns)}: {_all_drawn(chosen)}", wanted | drawn)
        seen = [pair for pair in first.values() if pair is not None]
        if len(seen) == len(first) and not self.at_once:
            return met(_all_drawn(seen), wanted | {key: [_edge(*pair) for pair in seen]})
        between = [pair for g in snapshots for topic in _topics(self.edges) for pair in _edges(g, topic)]
        evidence = wanted | {key: [list(e) for e in dict.fromkeys(tuple(_edge(*pair)) for pair in between)]}
        missing = [edge for edge, pair in first.items() if pair is None]
        topics = _topics(missing or self.edges)
        # Only what is missing can be due to a crash; edges that were there, but never together, are not.
        if missing and (crashed := explain_fault(trace, f"no edge over {' and '.join(topics)}", evidence)):
            return crashed
        reason, hint = self._explain(snapshots, missing, between, both_ways=both_ways)
        return not_met(reason, evidence, hint=hint, problem=Problem(ProblemKind.NO_EDGE, topics))

    def _pairs(self, graph: GraphSnapshot, edge: GraphEdge) -> list[Pair]:
        return [
            (source, target)
            for source, target in _edges(graph, edge.topic)
            if edge.joins(source, target) and not (self.between_processes and source.participant == target.participant)
        ]

    def _explain(
        self, graphs: list[GraphSnapshot], missing: list[GraphEdge], pairs: list[Pair], *, both_ways: bool
    ) -> tuple[str, str]:
        """Return why edges are missing, or not there together, and a hint, which may be empty."""
        if not missing:
            between = "between the same two processes " if both_ways else ""
            return f"{' and '.join(_topics(self.edges))}: every edge is there, but not {between}at once", ""
        # Without the grader's own endpoints: an edge to one of them proves nothing about the student's nodes.
        endpoints = [e for g in graphs for e in g.endpoints if e.participant != -1]
        gaps = [self._gap(edge, endpoints, pairs) for edge in missing]
        one_way = "; connected in one direction only" if both_ways and len(missing) == 1 else ""
        return "; ".join(said for said, _ in gaps) + one_way, gaps[0][1]

    def _gap(self, edge: GraphEdge, endpoints: list[Endpoint], pairs: list[Pair]) -> tuple[str, str]:
        """Return why an edge is missing, and a hint, which may be empty."""
        topic, apart = edge.topic, self.between_processes
        publishers, subscriptions = _ends(topic, endpoints)
        if not publishers and not subscriptions:
            return f"{topic}: nothing publishes it and nothing subscribes to it", ""
        if not publishers:
            said = f"{topic}: {quote(subscriptions[0].node)} subscribes to it, nothing publishes it"
            return said, f"publish {topic} in {edge.source or ('the other node' if apart else 'a node')}"
        if not subscriptions:
            said = f"{topic}: {quote(publishers[0].node)} publishes it, nothing subscribes to it"
            return said, f"subscribe to {topic} in {edge.target or ('the other node' if apart else 'a node')}"
        found = [pair for pair in pairs if pair[0].topic == topic]
        # Other nodes before other types: an edge that is there shows that the types agree.
        if found and not any(edge.joins(*pair) for pair in found):
            return f"no edge {edge}, found {first_few(list(dict.fromkeys(_drawn(*pair) for pair in found)))}", ""
        if publishers[0].type != subscriptions[0].type:
            said = f"{topic}: {quote(publishers[0].node)} publishes {quote(publishers[0].type)}, "
            said += f"{quote(subscriptions[0].node)} subscribes {quote(subscriptions[0].type)}"
            return said, f"use the same message type for {topic} in both {'files' if apart else 'places'}"
        where = "in one process or " if apart else ""
        return f"{topic}: its publisher and its subscription are {where}not there at the same time", ""


@dataclass(frozen=True, slots=True)
class BidirectionalGraph:
    """At one moment, the live graph connects two processes by two topics, one in each direction, with matching types.

    Attributes:
        forward: Topic that the first process publishes and the second subscribes to, e.g. `/ping`.
        back: Topic of the other direction, e.g. `/pong`.
    """

    drawing: ClassVar[str] = NODE_GRAPH
    forward: str
    back: str

    @property
    def expected(self) -> str:
        return f"one node reached by {self.forward}, the other by {self.back}, with the types agreeing"

    def judge(self, trace: Trace) -> Finding:
        edges = (GraphEdge(self.forward), GraphEdge(self.back))
        return GraphEdges(edges, at_once=True, between_processes=True).judged(trace, both_ways=True)


def _lead_back(there: Pair, back: Pair) -> bool:
    return (there[0].participant, there[1].participant) == (back[1].participant, back[0].participant)


def _topics(edges: Iterable[GraphEdge]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(edge.topic for edge in edges))


def _all_drawn(pairs: Iterable[Pair]) -> str:
    return " and ".join(_drawn(*pair) for pair in pairs)


def _edges(snapshot: GraphSnapshot, topic: str) -> list[Pair]:
    publishers, subscriptions = _ends(topic, (e for e in snapshot.endpoints if e.participant != -1))
    return [(p, s) for p in publishers for s in subscriptions if p.type == s.type]


def _edge(publisher: Endpoint, subscription: Endpoint) -> list[str]:
    return [publisher.node, publisher.topic, subscription.node]


def _drawn(publisher: Endpoint, subscription: Endpoint) -> str:
    return f"{quote(publisher.node)} ─{publisher.topic}→ {quote(subscription.node)}"


def _ends(topic: str, endpoints: Iterable[Endpoint]) -> tuple[list[Endpoint], list[Endpoint]]:
    """Return the publishers and the subscriptions of a topic."""
    mine = [e for e in endpoints if e.topic == topic]
    return [e for e in mine if e.kind == "publisher"], [e for e in mine if e.kind == "subscription"]


_QOS_HINT = "pass a QoSProfile with that policy where the {kind} is created"


@dataclass(frozen=True, slots=True)
class Qos:
    """A publisher or subscription of a student's node on a topic has the given QoS policies.

    One matching endpoint is enough. The middleware does not report every depth; without it, a criterion that depends on
    it stays undecided.

    Attributes:
        topic: Topic name as on the wire.
        kind: `publisher` or `subscription`.
        reliability: `reliable` or `best_effort`; free if left out.
        durability: `volatile` or `transient_local`; free if left out.
        deadline: Offered or requested deadline; `0 s` for none; free if left out.
        depth: Smallest history depth; free if left out.
    """

    drawing: ClassVar[str] = NODE_GRAPH
    topic: str
    kind: Literal["publisher", "subscription"]
    reliability: Literal["reliable", "best_effort"] | None = None
    durability: Literal["volatile", "transient_local"] | None = None
    deadline: DurationNs | None = None
    depth: int | None = None

    @property
    def expected(self) -> str:
        return f"a {self.kind} on {self.topic} with {self._wanted}"

    @property
    def _wanted(self) -> str:
        parts = [str(part) for part in (self.reliability, self.durability) if part]
        if self.deadline is not None:
            parts.append(f"a deadline of {number(seconds(self.deadline))} s" if self.deadline else "no deadline")
        parts += [f"a depth of at least {self.depth}"] if self.depth is not None else []
        return " and ".join(parts) or "any QoS"

    def judge(self, trace: Trace) -> Finding:
        mine = student_endpoints(trace, self.kind, self.topic)
        if not mine:
            return self._absent(trace)
        fitting = [e for e in mine if self._fits(e) and (self.depth is None or e.depth >= self.depth)]
        # The middleware does not report every depth, and no student may lose a point for that.
        unknown = [e for e in mine if self._fits(e) and e.depth == 0]
        evidence = {"endpoints": [[e.node, e.reliability, e.durability, seconds(e.deadline_ns), e.depth] for e in mine]}
        if fitting:
            return met(f"{self.topic}: the {self.kind} of {quote(fitting[0].node)} has {self._wanted}", evidence)
        if unknown:
            raise HarnessError(f"{self.topic}: the middleware does not report the depth of the {self.kind}")
        reason = f"{self.topic}: the {self.kind} of {quote(mine[0].node)} has {_policies(mine[0])}"
        return not_met(f"{reason}, expected {self._wanted}", evidence, hint=_QOS_HINT.format(kind=self.kind))

    def _fits(self, end: Endpoint) -> bool:
        return (
            self.reliability in (None, end.reliability)
            and self.durability in (None, end.durability)
            and self.deadline in (None, end.deadline_ns)
        )

    def _absent(self, trace: Trace) -> Finding:
        if self.kind == "subscription":
            return explain_no_subscription(trace, self.topic)
        if crashed := explain_fault(trace, f"no publisher on {self.topic}"):
            return crashed
        seen = list(dict.fromkeys(e.topic for e in student_endpoints(trace, "publisher")))
        ending = f"; seen: {first_few(seen)}" if seen else ""
        return not_met(f"{self.topic}: no publisher{ending}", {"seen": seen[:20]}, problem=ProblemKind.ABSENT)


def _policies(end: Endpoint) -> str:
    deadline = f", a deadline of {number(seconds(end.deadline_ns))} s" if end.deadline_ns else ""
    depth = f", a depth of {end.depth}" if end.depth else ""
    return f"{quote(end.reliability)} reliability, {quote(end.durability)} durability{deadline}{depth}"


@dataclass(frozen=True, slots=True)
class NodeName:
    """A node with a given name is in the ROS graph.

    Attributes:
        name: Fully qualified, e.g. `/velocity_publisher`.
    """

    drawing: ClassVar[str] = NODE_GRAPH
    name: str

    @property
    def expected(self) -> str:
        return f"a node named {self.name}"

    def judge(self, trace: Trace) -> Finding:
        wanted = self.name if self.name.startswith("/") else f"/{self.name}"
        nodes = list(dict.fromkeys(node for graph in trace.graphs() for node in graph.nodes))
        if wanted in nodes:
            return met(f"{wanted} is in the ROS graph", {"nodes": nodes[:20]})
        fault = first_fault(trace)
        # With a node in the graph, its name is wrong, whatever happened to it later.
        if fault is not None and not nodes:
            return faulted(fault, f"no node {wanted}")
        found = f"{counted(len(nodes), 'node')}: {first_few(nodes)}" if nodes else "no node"
        near = nearest(wanted, nodes) or (nodes[0] if len(nodes) == 1 else None)
        hint = f"name the node {wanted.rsplit('/', 1)[-1]!r} instead of {quote(near)}" if near else ""
        kind = ProblemKind.OTHER_NAME if nodes else ProblemKind.ABSENT
        return not_met(f"{wanted}: not in the ROS graph, found {found}", {"nodes": nodes[:20]}, hint=hint, problem=kind)


@dataclass(frozen=True, slots=True)
class TopicNames:
    """The students' nodes publish and subscribe to the given topics, at least or exactly; types are free.

    Topics that every node has are not counted.

    Attributes:
        publishes: Topics that are published.
        subscribes: Topics that are subscribed to.
        exactly: Whether other topics are a mistake.
        node: Fully qualified name of the node; all nodes if left out.
    """

    drawing: ClassVar[str] = NODE_GRAPH
    publishes: tuple[str, ...] = ()
    subscribes: tuple[str, ...] = ()
    exactly: bool = False
    node: str | None = None

    @property
    def expected(self) -> str:
        parts = [f"publishes {', '.join(self.publishes)}"] if self.publishes or self.exactly else []
        parts += [f"subscribes to {', '.join(self.subscribes)}"] if self.subscribes or self.exactly else []
        return f"{self.node or 'the program'} {' and '.join(parts)}{' and nothing else' if self.exactly else ''}"

    def judge(self, trace: Trace) -> Finding:
        made = [e for e in student_endpoints(trace) if self.node in (None, e.node)]
        out, back = (sorted({e.topic for e in made if e.kind == k}) for k in ("publisher", "subscription"))
        flaws = [*_flaws("published", self.publishes, out, exactly=self.exactly)]
        flaws += _flaws("subscribed to", self.subscribes, back, exactly=self.exactly)
        evidence = {"publishes": out, "subscribes": back}
        if not flaws:
            return met(
                f"published: {first_few(out) or 'nothing'}; subscribed to: {first_few(back) or 'nothing'}", evidence
            )
        fault = first_fault(trace)
        # With an endpoint in the graph, the program came as far as creating some, so that the others are missing in it.
        if fault is not None and not made:
            return faulted(fault, flaws[0], evidence)
        return not_met(f"{'; '.join(flaws[:3])}; expected that {self.expected}", evidence)


def _flaws(word: str, wanted: Sequence[str], found: Sequence[str], *, exactly: bool) -> list[str]:
    flaws = []
    for topic in (t for t in wanted if t not in found):
        near = nearest(topic, found)
        flaws.append(f"{topic} is not {word}" + (f", but {quote(near)} is" if near else ""))
    return flaws + [f"{quote(topic)} is {word} too" for topic in found if exactly and topic not in wanted]
