"""The graph by its names, edges and policies; and how a process ends."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from tracing import FLOAT32, FLOAT64, Recording

from grader.grading.judging.checks.graph import BidirectionalGraph, GraphEdge, GraphEdges, NodeName, Qos, TopicNames
from grader.grading.judging.checks.programs import CleanShutdown, NoFault
from grader.grading.judging.diagnosis import RULES
from grader.grading.judging.findings import FAULT_KEY
from grader.grading.model.exercise import Location, Problem, ProblemKind
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.trace import FaultKind
from grader.testing import explain


def talking() -> Recording:
    rec = Recording(10.0).endpoint("publisher", "/a", FLOAT32, "/talker", 1, "reliable", "transient_local")
    rec.endpoint("publisher", "/rosout", "rcl_interfaces/msg/Log", "/talker", 1)
    return rec.endpoint("subscription", "/a", FLOAT32, "/listener", 2, "best_effort", t_s=1.0)


def with_end(**change: Any) -> Recording:
    rec = talking()
    first = replace(rec.ends[0], **change)
    return Recording(10.0).snapshot(0.0, [first, *rec.ends[1:]])


@pytest.mark.parametrize(
    ("check", "credit", "said"),
    [
        (Qos("/a", "publisher", "reliable", "transient_local"), 1, "of /talker has reliable and transient_local"),
        (Qos("/a", "publisher", "best_effort"), 0, "has reliable reliability, transient_local durability, a depth of"),
        (Qos("/a", "publisher", durability="volatile"), 0, "expected volatile"),
        (Qos("/a", "subscription", "best_effort", depth=10), 1, ""),
        (Qos("/a", "subscription", depth=11), 0, "expected a depth of at least 11"),
        (Qos("/a", "publisher", deadline=0), 1, "no deadline"),
        (Qos("/a", "publisher", deadline=NS_PER_S), 0, "expected a deadline of 1 s"),
        (Qos("/b", "publisher"), 0, "/b: no publisher; seen: /a"),
        (Qos("/b", "subscription"), 0, "/a"),
    ],
)
def test_policies_of_an_endpoint(check: Qos, credit: int, said: str) -> None:
    """Those named have to fit; the reason has those found."""
    finding = check.judge(talking().trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_a_depth_that_nobody_tells_is_not_judged() -> None:
    """The middleware leaves it out for some; a deadline is reported."""
    with pytest.raises(HarnessError):
        Qos("/a", "publisher", depth=10).judge(with_end(depth=0).trace())
    assert Qos("/a", "publisher", "best_effort", depth=10).judge(with_end(depth=0).trace()).credit == 0
    assert Qos("/a", "publisher", deadline=NS_PER_S).judge(with_end(deadline_ns=NS_PER_S).trace()).credit == 1
    for kind in ("publisher", "subscription"):
        assert FAULT_KEY in Qos("/a", kind).judge(Recording().crashed(0).trace()).evidence


@pytest.mark.parametrize(
    ("name", "credit", "said"),
    [
        ("/talker", 1, "/talker is in the ROS graph"),
        ("talker", 1, ""),
        ("/talkr", 0, "not in the ROS graph, found 2 nodes: /talker, /listener"),
        ("/ns/talker", 0, ""),
    ],
)
def test_a_node_is_found_by_its_name(name: str, credit: int, said: str) -> None:
    """With or without its slash."""
    finding = NodeName(name).judge(talking().trace())
    assert finding.credit == credit
    assert said in finding.reason


def test_the_nearest_node_is_offered() -> None:
    """A crash is the reason only where there is no node at all."""
    assert NodeName("/talkr").judge(talking().trace()).hint == "name the node 'talkr' instead of /talker"
    assert FAULT_KEY in NodeName("/a").judge(Recording().crashed(0.0).trace()).evidence
    assert FAULT_KEY not in NodeName("/a").judge(talking().crashed(1.0).trace()).evidence
    assert "found no node" in NodeName("/a").judge(Recording().trace()).reason


@pytest.mark.parametrize(
    ("check", "credit", "said"),
    [
        (TopicNames(("/a",), ("/a",)), 1, "published: /a; subscribed to: /a"),
        (TopicNames(("/a",), ("/a",), exactly=True), 1, ""),
        (TopicNames(("/a",), exactly=True), 0, "/a is subscribed to too"),
        (TopicNames(("/a", "/aa")), 0, "/aa is not published"),
        (TopicNames(node="/listener", subscribes=("/a",), exactly=True), 1, "published: nothing"),
        (TopicNames(node="/listener", publishes=("/a",)), 0, "/a is not published; expected that /listener"),
    ],
)
def test_topics_by_name(check: TopicNames, credit: int, said: str) -> None:
    """Those that every node has do not count."""
    finding = check.judge(talking().trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


@pytest.mark.parametrize(
    ("check", "credit", "said"),
    [
        (GraphEdges((GraphEdge("/a"),)), 1, "t = 1.000 s: /talker ─/a→ /listener"),
        (GraphEdges((GraphEdge("/a", "/talker", "/listener"),), between_processes=True), 1, "/talker ─/a→ /listener"),
        (GraphEdges((GraphEdge("/a", "/listener"),)), 0, "no edge /listener ─/a→ a node, found /talker ─/a→ /listener"),
        (GraphEdges((GraphEdge("/a"), GraphEdge("/b"))), 0, "/b: nothing publishes it and nothing subscribes to it"),
    ],
)
def test_edges_of_the_graph(check: GraphEdges, credit: int, said: str) -> None:
    """By topic, and by nodes where they are named."""
    finding = check.judge(talking().trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_an_edge_needs_one_type_and_perhaps_two_processes_and_one_moment() -> None:
    """What does not meet is no edge."""
    assert GraphEdges((GraphEdge("/a"),)).judge(with_end(type=FLOAT64).trace()).credit == 0
    alone = GraphEdges((GraphEdge("/a"),), between_processes=True)
    assert alone.judge(with_end(participant=2).trace()).credit == 0
    rec = Recording(10.0)
    ends = talking().endpoint("publisher", "/b").endpoint("subscription", "/b").ends
    rec.snapshot(0.0, [e for e in ends if e.topic == "/a"]).snapshot(1.0, [e for e in ends if e.topic == "/b"])
    both = (GraphEdge("/a"), GraphEdge("/b"))
    assert GraphEdges(both).judge(rec.trace()).credit == 1
    apart = GraphEdges(both, at_once=True).judge(rec.trace())
    assert apart.reason == "/a and /b: every edge is there, but not at once"
    assert apart.evidence["edges"] == ["a node ─/a→ a node", "a node ─/b→ a node"]
    assert apart.evidence["found"] == [["/talker", "/a", "/listener"], ["/node", "/b", "/node"]]
    assert FAULT_KEY in GraphEdges(both).judge(Recording().crashed(0.0).trace()).evidence


def test_every_missing_edge_is_explained_by_its_ends() -> None:
    """The node that has one end, what differs, and what to do; a process that talks to itself is no other node."""
    rec = Recording().endpoint("publisher", "/a", node="/talker").endpoint("subscription", "/b", node="/listener")
    finding = GraphEdges((GraphEdge("/a"), GraphEdge("/b"))).judge(rec.trace())
    assert "/a: /talker publishes it, nothing subscribes to it; /b: /listener subscribes to it" in finding.reason
    assert finding.hint == "subscribe to /a in a node"
    apart = GraphEdges((GraphEdge("/a"), GraphEdge("/b")), between_processes=True).judge(rec.trace())
    assert apart.hint == "subscribe to /a in the other node"
    assert GraphEdges((GraphEdge("/a", "/talker", "/ear"),)).judge(rec.trace()).hint == "subscribe to /a in /ear"
    assert finding.problem == Problem(ProblemKind.NO_EDGE, ("/a", "/b"))
    typed = GraphEdges((GraphEdge("/a"),)).judge(with_end(type=FLOAT64).trace())
    assert "use the same message type for /a" in typed.hint
    itself = Recording().endpoint("publisher", "/a", node="/x").endpoint("subscription", "/a", node="/y")
    for edge in (GraphEdge("/a"), GraphEdge("/a", "/x", "/y")):
        said = GraphEdges((edge,), between_processes=True).judge(itself.trace()).reason
        assert said == "/a: its publisher and its subscription are in one process or not there at the same time"


def test_a_missing_edge_is_explained_by_the_name_in_a_file() -> None:
    """Whichever check asks for the edge: it says which topics have none."""
    files = {
        "talker.py": "class Talker(Node):\n    def __init__(self):\n"
        "        self.out = self.create_publisher(Float32, 'level', 10)\n",
        "listener.py": "class Listener(Node):\n    def __init__(self):\n"
        "        self.create_subscription(Float32, '/topic', self.heard, 10)\n",
    }
    rec = Recording().endpoint("publisher", "/level", node="/talker").endpoint("subscription", "/topic", node="/l")
    rule = next(rule for rule in RULES if rule.id == "graph_topic")
    for check in (GraphEdges((GraphEdge("/topic"),)), BidirectionalGraph("/topic", "/back")):
        clue = explain(rule, check, rec.trace(), files)
        assert clue is not None
        assert clue.location == Location("talker.py", 3)
        assert "publishes on /level: the task asks for /topic" in clue.hint


def test_no_fault_means_none_before_the_stop() -> None:
    """For one process, or for any."""
    assert NoFault().judge(talking().trace()).credit == 1
    found = NoFault().judge(talking().crashed(3.0).exited(4.0, 1).trace())
    assert found.reason == "t = 3.000 s: node.py:12: ValueError: no; 2 faults in all"
    assert FAULT_KEY in found.evidence
    assert NoFault("other.py").judge(talking().crashed(3.0).trace()).credit == 1
    for late in (5.0, 5.1):
        stopped = talking().mark(5.0, "stop_signal", "node.py").crashed(late)
        assert NoFault().judge(stopped.trace()).credit == 1
        # nor does it explain what is missing
        missing = GraphEdges((GraphEdge("/b"),)).judge(stopped.trace())
        assert (missing.credit, FAULT_KEY in missing.evidence) == (0, False)
    assert NoFault().judge(talking().mark(5.0, "stop_signal", "other.py").crashed(5.1).trace()).credit == 0


CLEAN = CleanShutdown("node.py")


def stopping(ended_s: float | None) -> Recording:
    rec = Recording(10.0).mark(5.0, "stop_signal", "node.py")
    return rec if ended_s is None else rec.mark(ended_s, "stopped", "node.py")


@pytest.mark.parametrize(
    ("rec", "credit", "said"),
    [
        (stopping(5.0), 1, "ended 0.000 s after Ctrl-C"),
        (stopping(7.0), 1, "ended 2.000 s"),
        (stopping(7.1), 0, "ended 2.100 s after Ctrl-C, expected within 2 s"),
        (stopping(None), 0, "still running 2.0 s after Ctrl-C at t = 5.000 s"),
        (stopping(None).crashed(5.1, "RuntimeError: no"), 0, "t = 5.100 s, after Ctrl-C: node.py:12: RuntimeError"),
        (stopping(None).fault(7.0, FaultKind.HUNG, "did not end"), 0, "did not end"),
        (Recording().crashed(1.0), 0, "it ended before Ctrl-C"),
        (Recording().mark(1.0, "exited", "node.py"), 0, "ended by itself at t = 1.000 s"),
    ],
)
def test_a_stopped_process_ends_tidily(rec: Recording, credit: int, said: str) -> None:
    """In time, and without another error."""
    finding = CLEAN.judge(rec.trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_a_process_that_nobody_stopped_is_ours() -> None:
    """The scenario lacks its shutdown."""
    with pytest.raises(HarnessError):
        CLEAN.judge(Recording().trace())
    assert CleanShutdown("node.py", 100 * NS_PER_MS).judge(stopping(5.2).trace()).credit == 0
