"""Rules of virtual time that a runner keeps, with scripted processes; and that each numbered rule has a test."""

from __future__ import annotations

import ast
import gc
import re
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias, cast

import pytest

pytest.importorskip("rclpy")

from scripted import MS, Behaviour, Program, ScriptedObserver, ScriptedStudent, World, claim, idle, looks, plan, wait

from grader.runtime.host.outbox import Outbox
from grader.runtime.host.protocol import (
    NO_COUNTERPARTS,
    Answer,
    AwaitMatches,
    Counterparts,
    Expect,
    Go,
    MessagesArrived,
    Report,
)
from grader.runtime.model.trace import AssessedTrace, GraphSnapshot, Message, OutputLine
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.virtual_runner import VirtualRunner

ROOT = Path(__file__).resolve().parents[3]
#: The middleware shows a change only after so many looks at the graph.
LOOKS = 4


class Look:
    """A look of the observer at the graph."""


Said: TypeAlias = Answer | Look


class Student(ScriptedStudent):
    """A scripted process that also waits for messages when it is told to; what everybody is told is kept in order."""

    log: list[tuple[str, Said]]

    def tell(self, answer: Answer) -> None:
        self.log.append((self.name, answer))
        self._receives = isinstance(answer, Expect)
        if not self._receives:
            super().tell(answer)

    def report(self) -> Report | None:
        if getattr(self, "_receives", False):
            self._receives = False
            return MessagesArrived()
        return super().report()


class SlowObserver(ScriptedObserver):
    """Sees a change in the graph only when it has been looked at some times, and logs each look."""

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self.log: list[tuple[str, Said]] = []
        self._shown: dict[str, list[dict[str, Any]]] = {}
        self._left = LOOKS

    def graph(self, *args: Any, **kwargs: Any) -> GraphSnapshot:
        real = self._world.claims
        self.log.append(("observer", Look()))
        if self._shown != real:
            self._left -= 1
            if not self._left:
                self._shown, self._left = dict(real), LOOKS
        self._world.claims = self._shown
        try:
            return super().graph(*args, **kwargs)
        finally:
            self._world.claims = real


class Run:
    """A run of scripted programs before an observer of some kind."""

    def __init__(self, kind: type[ScriptedObserver], *programs: Behaviour, **fields: Any) -> None:
        world = World()
        self.log: list[tuple[str, Said]] = []
        self.students = [Student(name, made, world) for name, made in zip(("a.py", "b.py"), programs, strict=False)]
        for student in self.students:
            student.log = self.log
        self.observer = kind(world)
        if isinstance(self.observer, SlowObserver):
            self.observer.log = self.log
        students, observer = cast("list[NodeProcess]", self.students), cast("Observer", self.observer)
        self.trace: AssessedTrace = VirtualRunner(plan(**fields), students, observer, wait=looks).run()

    def told(self, name: str, kind: type) -> list[int]:
        """Return at which places in the log a process was told something."""
        return [place for place, (told, said) in enumerate(self.log) if told == name and isinstance(said, kind)]

    def at(self, place: int) -> Any:
        """Return what stands at a place in the log."""
        return self.log[place][1]


@pytest.mark.rule(11)
def test_a_message_that_did_not_arrive_is_noted_and_the_recording_is_made_again() -> None:
    """The process says so, which nobody believes as evidence."""

    def misses(me: ScriptedStudent, world: World) -> Program:
        yield idle(100)
        yield idle(None, lost={"topic /x": 2})

    run = Run(ScriptedObserver, misses)
    assert run.trace.notes == ("a.py: 2 messages on topic /x did not arrive in time",)
    assert run.trace.incomplete


@pytest.mark.rule(12)
def test_a_message_is_recorded_before_whoever_hears_it_runs() -> None:
    """The runner waits until its own node has all of them, at the time at which they were sent."""

    class Late(ScriptedObserver):
        left = 5

        def take(self, at_once: int = 1000) -> Any:
            if self._world.flying and self.left:
                self.left -= 1
                return []
            return super().take(at_once)

    def speaks(me: ScriptedStudent, world: World) -> Program:
        yield from wait(100, endpoints=world.have(me.name, claim("publisher", "/x")))
        world.publish("/x", 1)
        world.publish("/x", 2)
        yield idle(None, sent={"topic /x": 2})

    def hears(me: ScriptedStudent, world: World) -> Program:
        answer = yield from wait(endpoints=world.have(me.name, claim("subscription", "/x")))
        me.write(f"{answer.arrivals}")
        yield idle(None)

    seen = [o for o in Run(Late, speaks, hears).trace.observations if isinstance(o, (Message, OutputLine))]
    assert [(o.t_ns // MS, o.value["data"] if isinstance(o, Message) else o.text) for o in seen] == [
        (100, 1),
        (100, 2),
        (100, "{'topic /x': 2}"),
    ]


@pytest.mark.rule(12)
def test_every_eighth_message_in_a_row_is_settled_before_the_next_one() -> None:
    """No queue has to hold more."""
    outbox = Outbox()
    assert [number for number in range(1, 25) if outbox.must_settle(changed=False)] == [8, 16, 24]


@pytest.mark.rule(13)
def test_a_new_endpoint_is_reported_before_anything_is_sent() -> None:
    """Also by another endpoint than the new one."""
    outbox = Outbox()
    assert not outbox.must_settle(changed=False)
    assert outbox.must_settle(changed=True)


@pytest.mark.rule(13)
def test_a_process_goes_on_when_the_graph_shows_what_it_has_created() -> None:
    """Its counterparts wait for the match as well, before any of them runs again."""

    def speaks(me: ScriptedStudent, world: World) -> Program:
        yield idle(0, endpoints=world.have(me.name, claim("publisher", "/x")))
        yield idle(None)

    def hears(me: ScriptedStudent, world: World) -> Program:
        yield idle(None, endpoints=world.have(me.name, claim("subscription", "/x")))

    run = Run(SlowObserver, speaks, hears)
    for name in ("a.py", "b.py"):
        created, goes_on, *_ = run.told(name, Go)
        assert sum(created < look < goes_on for look in run.told("observer", Look)) >= LOOKS
        assert created < run.told(name, AwaitMatches)[0] < goes_on
    assert run.at(run.told("b.py", AwaitMatches)[0]).expected == Counterparts(subscription={"/x": [1]})
    assert run.trace.notes == ()


@pytest.mark.rule(15)
def test_a_counterpart_whose_qos_does_not_fit_is_told_and_wakes_both_ends() -> None:
    """At the instant at which it appears; nothing of it is announced."""

    def speaks(me: ScriptedStudent, world: World) -> Program:
        yield idle(None, endpoints=world.have(me.name, claim("publisher", "/x", number=1, reliable=False)))
        me.write("woken")
        yield idle(None)

    def asks_for_more(me: ScriptedStudent, world: World) -> Program:
        yield idle(300)
        yield idle(None, endpoints=world.have(me.name, claim("subscription", "/x", number=7, reliable=True)))
        me.write("woken")
        yield idle(None)

    run = Run(ScriptedObserver, speaks, asks_for_more)
    lines = [(line.t_ns // MS, line.process) for line in run.trace.lines()]
    assert sorted(lines) == [(0, "a.py"), (300, "b.py")] or sorted(lines) == [(300, "a.py"), (300, "b.py")]
    refused = [said.expected.refused for _, said in run.log if isinstance(said, AwaitMatches)]
    assert {"1": 1} in refused
    assert {"7": 1} in refused


@pytest.mark.rule(16)
def test_before_a_process_leaves_what_it_has_sent_is_recorded_and_has_arrived() -> None:
    """It is answered when the others have received it, and not before."""

    def leaves(me: ScriptedStudent, world: World) -> Program:
        yield from wait(100, endpoints=world.have(me.name, claim("publisher", "/x")))
        world.publish("/x", 5)
        yield idle(100, sent={"topic /x": 1}, leaving=True)
        yield {"kind": "exited", "code": 0}

    def hears(me: ScriptedStudent, world: World) -> Program:
        yield from wait(endpoints=world.have(me.name, claim("subscription", "/x")))

    run = Run(ScriptedObserver, leaves, hears)
    (expected,) = run.told("b.py", Expect)
    assert run.at(expected).arrivals == {"topic /x": 1}
    before, after = (run.at(place).now_ns for place in run.told("a.py", Go)[-2:])
    assert before == after
    assert run.told("a.py", Go)[-2] < expected < run.told("a.py", Go)[-1]
    assert [m.value["data"] for m in run.trace.messages("/x")] == [5]


@pytest.mark.long
@pytest.mark.rule(17)
def test_what_has_sent_is_kept_alive_until_its_messages_have_arrived() -> None:
    """Nobody else holds it any more."""

    class Handle:
        pass

    outbox, handle = Outbox(), Handle()
    alive = weakref.ref(handle)
    outbox.note_sent("topic /x", handle, 0)
    del handle
    gc.collect()
    assert alive() is not None
    outbox.settled()
    gc.collect()
    assert alive() is None


@pytest.mark.rule(18)
def test_a_process_goes_on_when_what_it_has_destroyed_has_left_the_graph() -> None:
    """Otherwise the old endpoint could be taken for a new one."""
    run = Run(SlowObserver, remakes)
    ends = [len(graph.endpoints) for graph in run.trace.graphs()]
    assert ends == [1, 0, 1]
    assert [len(graph.endpoints) for graph in Run(ScriptedObserver, remakes).trace.graphs()] == ends
    assert run.trace.notes == ()


def remakes(me: ScriptedStudent, world: World) -> Program:
    """Destroy a publisher and make another one, at one instant."""
    for claims in ([claim("publisher", "/x")], [], [claim("publisher", "/x")]):
        yield idle(0, endpoints=world.have(me.name, *claims))
    yield idle(None)


@pytest.mark.rule(19)
@pytest.mark.parametrize("left", [True, False])
def test_the_others_see_that_a_process_has_left_before_time_goes_on(left: bool) -> None:
    """What a process that dies has had stays in the graph, and nobody waits for it to go."""

    def ends(me: ScriptedStudent, world: World) -> Program:
        yield from wait(100, endpoints=world.have(me.name, claim("publisher", "/x")))
        if left:
            world.have(me.name)
        yield {"kind": "exited", "code": 0, "left": True} if left else None

    def stays(me: ScriptedStudent, world: World) -> Program:
        yield from wait(200, endpoints=world.have(me.name, claim("subscription", "/x")))
        yield idle(endpoints=world.have(me.name, claim("subscription", "/x"), claim("subscription", "/y")))

    run = Run(SlowObserver, ends, stays)
    graphs = {graph.t_ns // MS: [(e.kind, e.topic) for e in graph.endpoints] for graph in run.trace.graphs()}
    assert (("publisher", "/x") in graphs[200]) is not left
    if left:
        assert graphs[100] == [("subscription", "/x")]
        assert run.at(run.told("b.py", AwaitMatches)[-1]).expected == NO_COUNTERPARTS
    else:
        assert 100 not in graphs
    assert len(run.told("observer", Look)) < 20 * LOOKS


@pytest.mark.rule(19)
@pytest.mark.parametrize("looks_left", range(1, 7))
def test_no_graph_is_recorded_from_before_a_process_left(looks_left: int) -> None:
    """Whichever look is the first one after it has left: that at the names of nodes, at a service, or at the graph."""
    ended = False

    class Leaves(ScriptedObserver):
        left = looks_left

        def look(self) -> None:
            if ended:
                self.left -= 1
                if not self.left:
                    del self._world.claims["a.py"]

        def graph(self, *args: Any, **kwargs: Any) -> GraphSnapshot:
            self.look()
            return super().graph(*args, **kwargs)

        def students_nodes(self, *args: Any) -> list[str]:
            self.look()
            return super().students_nodes(*args)

        def ends_of(self, *args: Any) -> int:
            self.look()
            return super().ends_of(*args)

    def ends(me: ScriptedStudent, world: World) -> Program:
        nonlocal ended
        serves = claim("service", "/serve", "std_srvs/srv/Trigger")
        yield from wait(100, endpoints=world.have(me.name, claim("node", "/a"), serves))
        ended = True
        yield {"kind": "exited", "code": 0, "left": True}

    def stays(me: ScriptedStudent, world: World) -> Program:
        yield from wait(200, endpoints=world.have(me.name, claim("node", "/b")))
        yield idle()

    graphs = Run(Leaves, ends, stays).trace.graphs()
    assert {graph.t_ns // MS: graph.nodes for graph in graphs}[100] == ("/b",)


# ------------------------------------------------------------------------------ all of them

#: How a rule begins on its page.
RULE = re.compile(r"^(\d+)\. ", re.MULTILINE)


def numbered_rules(text: str) -> list[int]:
    """Return the numbers of the rules of virtual time on their page."""
    return [int(number) for number in RULE.findall(text)]


def marked_rules(source: str) -> Iterator[int]:
    """Yield the numbers of the rules that the tests of a module are marked with."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            for mark in node.decorator_list:
                if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.rule":
                    yield from (ast.literal_eval(argument) for argument in mark.args)


def test_each_rule_of_virtual_time_has_a_test() -> None:
    """And each mark a rule: whoever adds or moves one is told."""
    rules = numbered_rules((ROOT / "docs/explanation/rules.md").read_text(encoding="utf-8"))
    assert rules == list(range(1, len(rules) + 1))
    tests = (path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    assert {rule for text in tests if "mark.rule(" in text for rule in marked_rules(text)} == set(rules)


def test_a_rule_without_a_test_is_found() -> None:
    """The list and the marks are read as they are written."""
    assert numbered_rules("# Rules\n\n1. a\n   b\n2. c\n\n## After\n\nIn 3. y\n") == [1, 2]
    marked = "@pytest.mark.rule(2)\ndef test_x(): ...\n@pytest.mark.rule(3)\ndef helper(): ...\ndef test_y(): ...\n"
    assert list(marked_rules(marked)) == [2]
