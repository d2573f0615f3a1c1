"""The check on two nodes that talk in both directions, asked of the live graph."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from grader.core.exercise import Finding, Problem, ProblemKind
from grader.core.quantities import seconds
from grader.core.trace import Endpoint, GraphSnapshot, Trace
from grader.judging.findings import met, not_met
from grader.judging.silence import fault_hint, first_fault
from grader.judging.wording import fault_sentence, moment, quote

Pair = tuple[Endpoint, Endpoint]


@dataclass(frozen=True, slots=True)
class BidirectionalGraph:
    """At one moment the live graph joins two processes by two topics, one in each direction, with the types agreeing.

    Attributes:
        forward: Topic that the first process publishes and the second subscribes to, e.g. `/temperature`.
        back: Topic of the other direction, e.g. `/fan_speed`.
    """

    forward: str
    back: str

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if any snapshot has both directions between the same two processes."""
        snapshots = [g for g in trace.graphs() if g.t_ns < trace.stop_ns]
        for snapshot in snapshots:
            edges = self._both_ways(snapshot)
            if edges:
                drawn = " and ".join(_drawn(*pair) for pair in edges)
                evidence = {"t_s": seconds(snapshot.t_ns), "edges": [_edge(*pair) for pair in edges]}
                return met(f"{moment(snapshot.t_ns)}: {drawn}", evidence)
        return self._explain(trace, snapshots)

    def _both_ways(self, snapshot: GraphSnapshot) -> tuple[Pair, Pair] | None:
        back = _edges(snapshot, self.back)
        for there in _edges(snapshot, self.forward):
            ends = (there[1].participant, there[0].participant)
            here = next((b for b in back if (b[0].participant, b[1].participant) == ends), None)
            if here is not None and ends[0] != ends[1]:
                return there, here
        return None

    def _explain(self, trace: Trace, snapshots: list[GraphSnapshot]) -> Finding:
        endpoints = [e for g in snapshots for e in g.endpoints if e.participant != -1]
        edges = [pair for g in snapshots for topic in (self.forward, self.back) for pair in _edges(g, topic)]
        evidence = {"edges": [list(e) for e in dict.fromkeys(tuple(_edge(*pair)) for pair in edges)]}
        complete = {pair[0].topic for pair in edges if pair[0].participant != pair[1].participant}
        broken = [topic for topic in (self.forward, self.back) if topic not in complete]
        fault = first_fault(trace)
        if broken and fault is not None:
            reason = f"{fault_sentence(fault)}; no edge over {' and '.join(broken)}"
            return not_met(reason, evidence, hint=fault_hint(fault), fault=fault)
        if not broken:
            reason = (
                f"{self.forward} and {self.back}: both have an edge, but not between the same two processes at once"
            )
            return not_met(reason, evidence, problem=Problem(ProblemKind.NO_EDGE, (self.forward, self.back)))
        reason = "; ".join(_gap(topic, endpoints) for topic in broken)
        reason += "; only one direction" if len(broken) == 1 else ""
        problem = Problem(ProblemKind.NO_EDGE, tuple(broken))
        return not_met(reason, evidence, hint=_hint(broken[0], endpoints), problem=problem)


def _edges(snapshot: GraphSnapshot, topic: str) -> list[Pair]:
    ends = [e for e in snapshot.endpoints if e.topic == topic and e.participant != -1]
    publishers = [e for e in ends if e.kind == "publisher"]
    subscriptions = [e for e in ends if e.kind == "subscription"]
    return [(p, s) for p in publishers for s in subscriptions if p.type == s.type]


def _edge(publisher: Endpoint, subscription: Endpoint) -> list[str]:
    return [publisher.node, publisher.topic, subscription.node]


def _drawn(publisher: Endpoint, subscription: Endpoint) -> str:
    return f"{quote(publisher.node)} ─{publisher.topic}→ {quote(subscription.node)}"


def _split(topic: str, endpoints: Iterable[Endpoint]) -> tuple[list[Endpoint], list[Endpoint]]:
    mine = [e for e in endpoints if e.topic == topic]
    return [e for e in mine if e.kind == "publisher"], [e for e in mine if e.kind == "subscription"]


def _gap(topic: str, endpoints: list[Endpoint]) -> str:
    publishers, subscriptions = _split(topic, endpoints)
    if not publishers and not subscriptions:
        return f"{topic}: nothing publishes it and nothing subscribes to it"
    if not publishers:
        return f"{topic}: {quote(subscriptions[0].node)} subscribes to it, nothing publishes it"
    if not subscriptions:
        return f"{topic}: {quote(publishers[0].node)} publishes it, nothing subscribes to it"
    if publishers[0].type != subscriptions[0].type:
        there = f"{quote(publishers[0].node)} publishes {quote(publishers[0].type)}"
        return f"{topic}: {there}, {quote(subscriptions[0].node)} subscribes {quote(subscriptions[0].type)}"
    return f"{topic}: its publisher and its subscription are in one process or not there at the same time"


def _hint(topic: str, endpoints: list[Endpoint]) -> str:
    publishers, subscriptions = _split(topic, endpoints)
    if publishers and not subscriptions:
        return f"subscribe to {topic} in the other node"
    if subscriptions and not publishers:
        return f"publish {topic} in the other node"
    if publishers and subscriptions and publishers[0].type != subscriptions[0].type:
        return f"use the same message type for {topic} in both files"
    return ""
