"""The runner before scripted processes: what comes first inside an instant, where time jumps, where it ends."""

from __future__ import annotations

from collections.abc import Collection
from types import SimpleNamespace
from typing import Any, cast

import pytest

pytest.importorskip("rclpy")

from hypothesis import given
from hypothesis import strategies as st
from scripted import (
    FLOAT,
    INT,
    MS,
    Behaviour,
    Program,
    ScriptedObserver,
    ScriptedStudent,
    World,
    claim,
    idle,
    looks,
    numbers,
    plan,
    wait,
)

from grader.runtime import patience
from grader.runtime.host import clock as host_clock
from grader.runtime.host.clock import EPOCH_NS
from grader.runtime.host.protocol import AwaitMatches, Go
from grader.runtime.model.limits import Limits
from grader.runtime.model.trace import (
    ClockKind,
    Delivery,
    Fault,
    FaultKind,
    GraphSnapshot,
    Mark,
    Message,
    Offer,
    OutputLine,
)
from grader.runtime.stimuli.recorded import PlannedRecording
from grader.runtime.worker import trace_recorder
from grader.runtime.worker import virtual_runner as module
from grader.runtime.worker.core import HOP_NS, HOPS, MOST_HOPS, Taken
from grader.runtime.worker.delay import HOPELESS_NS
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.virtual_runner import VirtualRunner


class Run:
    """One run of some programs, before an observer of some kind: its trace, and everybody who took part."""

    def __init__(
        self, *programs: Behaviour, observes: type[ScriptedObserver] = ScriptedObserver, **fields: Any
    ) -> None:
        self.world = World()
        names = ("a.py", "b.py", "c.py")
        self.students = [ScriptedStudent(n, p, self.world) for n, p in zip(names, programs, strict=False)]
        self.observer = observes(self.world)
        students, observer = cast("list[NodeProcess]", self.students), cast("Observer", self.observer)
        self.trace = VirtualRunner(plan(**fields), students, observer, wait=looks).run()

    def seen(self, *kinds: type) -> list[str]:
        """Return observations in short, with their milliseconds, without the graph."""
        return [short(o) for o in self.trace.observations if not isinstance(o, (GraphSnapshot, *kinds))]


def short(o: Any) -> str:
    at = o.t_ns / MS
    at = int(at) if at == int(at) else at
    if isinstance(o, Delivery):
        return f"{at} to {o.topic}: {o.value['data']:g}"
    if isinstance(o, Message):
        return f"{at} from {o.topic}: {o.value['data']:g}"
    if isinstance(o, OutputLine):
        return f"{at} {o.process}: {o.text}"
    if isinstance(o, Fault):
        return f"{at} {o.process} {o.kind.value}: {o.text}"
    return f"{at} {o.name} {o.detail}" if isinstance(o, Mark) else f"{at} {o.process} {o.kind} {o.name} {o.detail}"


def sleeper(*wakes_ms: float) -> Behaviour:
    """A program that wakes at some times and says so."""

    def program(me: ScriptedStudent, world: World) -> Program:
        for wake_ms in wakes_ms:
            yield idle(wake_ms)
            me.write(f"awake for {wake_ms}")
        yield idle()

    return program


def saying(*reports: Any, missing: Any = None) -> Behaviour:
    """A program that makes some reports, whatever it is told, and ends."""

    def program(me: ScriptedStudent, world: World) -> Program:
        me.missing = missing
        yield from (report for report in reports)  # a generator can be sent answers, a list cannot

    return program


def publisher(topic: str, period_ms: float, *, first_ms: float = 0, start_ms: float = 0) -> Behaviour:
    """A program that publishes a counter on a topic, for ever."""

    def program(me: ScriptedStudent, world: World) -> Program:
        yield from wait(first_ms, endpoints=world.have(me.name, claim("publisher", topic)))
        count = 0
        while True:
            world.publish(topic, count)
            count += 1
            yield from wait(first_ms + count * period_ms, sent={f"topic {topic}": 1})

    return program


def listener(topic: str, interface: str = FLOAT, **qos: Any) -> Behaviour:
    """A program that says what arrives, when it is told."""

    def program(me: ScriptedStudent, world: World) -> Program:
        answer = yield from wait(endpoints=world.have(me.name, claim("subscription", topic, interface, **qos)))
        while True:
            me.write(f"got {answer.arrivals}")
            answer = yield from wait()

    return program


def test_both_sides_agree_on_the_epoch() -> None:
    """A plan says when virtual time starts; without a draw this is the host's first moment."""
    assert plan().epoch_ns == host_clock.EPOCH_NS == EPOCH_NS


def test_time_jumps_from_wish_to_wish() -> None:
    """Nobody is woken in between, and nothing is rounded."""
    run = Run(sleeper(0.000001, 250, 999.999999))
    assert run.students[0].times_ms() == [0, 0.000001, 250, 999.999999]
    assert run.seen() == [
        "1e-06 a.py: awake for 1e-06",
        "250 a.py: awake for 250",
        "999.999999 a.py: awake for 999.999999",
    ]
    assert (run.trace.stop_ns, run.trace.clock) == (1000 * MS, ClockKind.VIRTUAL)


def test_the_end_is_outside() -> None:
    """The window is half open: who wants to wake at its end is not woken."""
    assert Run(sleeper(1000)).seen() == []
    assert Run(sleeper(1_000_000)).seen() == []


def test_processes_take_turns_in_their_order() -> None:
    """At one instant the first goes first, whoever asked first."""
    run = Run(sleeper(200, 300), sleeper(100, 200, 300))
    assert run.seen() == [
        "100 b.py: awake for 100",
        "200 a.py: awake for 200",
        "200 b.py: awake for 200",
        "300 a.py: awake for 300",
        "300 b.py: awake for 300",
    ]


def test_a_stimulus_comes_before_what_processes_do_at_its_instant() -> None:
    """It is published first, and everybody who listens has it when woken."""
    run = Run(sleeper(100, 200), listener("/temperature"), stimuli=(numbers((20.5, 0), (25.0, 0)),))
    assert run.seen() == [
        "0 stream_starts /temperature",
        "100 to /temperature: 20.5",
        "100 a.py: awake for 100",
        "100 b.py: got {'topic /temperature': 1}",
        "200 to /temperature: 25",
        "200 a.py: awake for 200",
        "200 b.py: got {'topic /temperature': 1}",
    ]


def test_a_message_from_one_process_reaches_the_other_at_the_same_instant() -> None:
    """Transport takes no virtual time; an answer comes back before time moves on."""

    def controller(me: ScriptedStudent, world: World) -> Program:
        ends = world.have(me.name, claim("subscription", "/temperature"), claim("publisher", "/fan_speed"))
        yield from wait(endpoints=ends)
        while True:
            world.publish("/fan_speed", 100)
            yield from wait(sent={"topic /fan_speed": 1})

    def sensor(me: ScriptedStudent, world: World) -> Program:
        ends = world.have(me.name, claim("publisher", "/temperature"), claim("subscription", "/fan_speed"))
        yield from wait(200, endpoints=ends)
        for count in range(1, 4):
            world.publish("/temperature", count)
            answer = yield from wait(200 * (count + 1), sent={"topic /temperature": 1})
            me.write(f"got {answer.arrivals}")
            yield from wait(200 * (count + 1))

    assert Run(sensor, controller).seen()[:6] == [
        "200 from /temperature: 1",
        "200 from /fan_speed: 100",
        "200 a.py: got {'topic /fan_speed': 1}",
        "400 from /temperature: 2",
        "400 from /fan_speed: 100",
        "400 a.py: got {'topic /fan_speed': 1}",
    ]


@pytest.mark.parametrize("backwards", [False, True])
def test_messages_of_one_instant_come_in_one_order(*, backwards: bool) -> None:
    """The middleware decides which topic's arrive first; those of one topic keep their order."""

    class TakesOne(ScriptedObserver):
        def take(self, at_once: int = 1000) -> list[Taken]:
            flying = sorted(super().take(), key=lambda taken: taken.topic, reverse=backwards)
            self._world.flying = flying[1:]
            return flying[:1]

    def program(me: ScriptedStudent, world: World) -> Program:
        claims = [claim("publisher", topic) for topic in ("/b", "/a")]
        yield from wait(50, endpoints=world.have(me.name, *claims))
        for topic, value in (("/b", 1), ("/a", 2), ("/b", 3), ("/a", 4)):
            world.publish(topic, value)
        yield from wait(100, sent={"topic /a": 2, "topic /b": 2})
        yield idle()

    run = Run(program, observes=TakesOne)
    assert run.seen() == ["50 from /a: 2", "50 from /a: 4", "50 from /b: 1", "50 from /b: 3"]


def test_a_process_may_go_on_alone_until_somebody_else_wants_something() -> None:
    """It is told how far: the next stimulus, the other's wish, or the end."""
    run = Run(sleeper(50), sleeper(400), stimuli=(numbers((1.0, 0), start_ms=300),))
    free = [[(a.free_until_ns - EPOCH_NS) / MS for a in s.heard if isinstance(a, Go)] for s in run.students]
    assert free[0] == [0, 300] or free[0] == [300, 300]
    assert free[1][-1] == 1000


@pytest.mark.rule(3)
def test_a_process_that_went_on_alone_takes_time_with_it() -> None:
    """What it reports then happened then; it cannot go further than it was let."""

    def program(me: ScriptedStudent, world: World) -> Program:
        yield idle(10)
        me.write("at 40")
        yield idle(500, now_ns=EPOCH_NS + 40 * MS)
        me.write("far beyond")
        yield idle(None, now_ns=EPOCH_NS + 10**15)

    run = Run(program, sleeper(700))
    assert run.seen() == ["40 a.py: at 40", "700 a.py: far beyond", "700 b.py: awake for 700"]


def test_the_span_begins_with_the_first_message() -> None:
    """A node that starts late is observed as long as one that starts at once."""
    run = Run(publisher("/cmd_vel", 100, first_ms=2500), first_message_on="/cmd_vel")
    assert run.trace.stop_ns == 3500 * MS
    messages = run.trace.messages("/cmd_vel")
    assert [m.t_ns // MS for m in messages] == list(range(2500, 3500, 100))


def test_only_the_topic_asked_for_begins_the_span() -> None:
    """Another topic's messages are observed meanwhile, but begin nothing."""
    run = Run(publisher("/other", 1000), first_message_on="/cmd_vel")
    assert run.trace.stop_ns == 5000 * MS
    assert len(run.trace.messages("/other")) == 5


def test_a_first_message_is_not_waited_for_for_ever() -> None:
    """The trace ends where waiting ends."""
    assert Run(sleeper(), first_message_on="/cmd_vel").trace.stop_ns == 5000 * MS


def test_too_many_messages_end_the_run_with_a_mark() -> None:
    """A flood is evidence enough; the mark and the note say on which topic."""
    run = Run(publisher("/cmd_vel", 1), limits=Limits(messages=5))
    said = "more than 5 messages on /cmd_vel: the rest was ignored"
    assert run.seen()[-1] == f"5 limit {said}"
    assert run.trace.notes == (said,)
    assert len(run.trace.messages()) == 5
    assert run.trace.stop_ns == 5 * MS


def player(mine: str, theirs: str, *, serves: bool = False, last: int = 10_000, cost_ns: int = 0) -> Behaviour:
    """A program that answers each message at once, up to a last number; one of two begins at 10 ms."""

    def program(me: ScriptedStudent, world: World) -> Program:
        ends = world.have(me.name, claim("publisher", mine), claim("subscription", theirs))
        yield from wait(10 if serves else None, endpoints=ends)
        for count in range(last):
            world.publish(mine, count)
            yield from wait(None, sent={f"topic {mine}": 1}, cost_ns=cost_ns)
        yield idle(None)

    return program


def test_nodes_that_answer_each_other_without_end_end_the_run() -> None:
    """After some messages at one instant each takes time, and after many more the run ends, however busy a node is."""
    slow = player("/a", "/b", serves=True, cost_ns=HOPELESS_NS // (HOPS // 2 + 1))
    run = Run(slow, player("/b", "/a"), stop_when_unfit=True)
    later = [10 * MS + n * HOP_NS for n in range(1, MOST_HOPS - HOPS + 1)]
    assert [m.t_ns for m in run.trace.messages()] == [*[10 * MS] * (HOPS + 1), *later]
    said = f"the nodes answered each other {MOST_HOPS:,} times without a pause: the rest was ignored"
    assert run.seen(Message) == [f"{(later[-1] + HOP_NS) / MS} limit {said}"]
    assert not run.trace.clock_reason


def test_a_process_that_hears_itself_after_each_rest_goes_on() -> None:
    """It is woken for its own message, and then lets time pass on its own until it sends the next: that is a rest."""
    wakes_ns = range(10 * MS, 990 * MS, 980 * MS // (MOST_HOPS + HOPS))

    def program(me: ScriptedStudent, world: World) -> Program:
        claims = world.have(me.name, claim("publisher", "/x"), claim("subscription", "/x"))
        yield from wait(5, endpoints=claims)
        for at_ns in wakes_ns:
            world.publish("/x")
            answer = yield idle(at_ns / MS, sent={"topic /x": 1}, now_ns=EPOCH_NS + at_ns)
            assert answer.arrivals == {"topic /x": 1}
        yield idle(None)

    run = Run(program)
    assert [m.t_ns for m in run.trace.messages()] == list(wakes_ns)
    assert not run.trace.marks("limit")


def test_nodes_may_answer_each_other_for_a_while_at_one_instant() -> None:
    """A rest begins the count again."""
    each = HOPS // 2
    run = Run(player("/a", "/b", serves=True, last=each + 1), player("/b", "/a", last=each))
    assert [m.t_ns / MS for m in run.trace.messages()] == [10] * (HOPS + 1)
    assert run.seen(Message) == []


def test_a_process_that_talks_without_waiting_is_ended() -> None:
    """Notes and faults of one breath are counted."""

    def talker(me: ScriptedStudent, world: World) -> Program:
        while True:
            yield {"kind": "note", "code": "main_not_called"}

    run = Run(talker, sleeper(500))
    assert run.seen() == ["0 a.py killed: ended by SIGKILL", "500 b.py: awake for 500"]
    assert len(run.students[0].notes) == module.MOST_REPORTS
    assert run.trace.notes == ("main_not_called",)


def test_a_thread_that_raised_is_written_down_and_the_process_goes_on() -> None:
    """A fault is no end."""

    def program(me: ScriptedStudent, world: World) -> Program:
        yield idle(100)
        me.write("before")
        place = {"file": "scripted.py", "line": 3, "frames": [["scripted.py", 3, "f"]]}
        yield {"kind": "fault", "fault": {"code": "exception", "type": "ValueError", "message": "no", **place}}
        yield idle(200)
        me.write("after")

    run = Run(program)
    assert run.seen() == [
        "100 a.py: before",
        "100 a.py exception: ValueError: no",
        "200 a.py: after",
        "200 a.py exited: exited with code 0",
    ]
    assert run.trace.faults()[0].frames == ("scripted.py:3 in f",)


def test_an_end_is_a_fault_and_the_others_go_on() -> None:
    """An exit, an exception or a death without a word; what was written before is kept."""

    def leaves(me: ScriptedStudent, world: World) -> Program:
        yield idle(100)
        me.write("bye")
        yield {"kind": "exited", "code": 3}

    def raises(me: ScriptedStudent, world: World) -> Program:
        yield idle(200)
        yield {"kind": "exited", "code": 1, "fault": {"code": "alarm", "line": -1}}

    def dies(me: ScriptedStudent, world: World) -> Program:
        yield idle(300)
        me.write("last words")
        yield None

    assert Run(leaves, raises, dies).seen() == [
        "100 a.py: bye",
        "100 a.py exited: exited with code 3",
        "200 b.py hung: sets an alarm that rings in real time",
        "300 c.py: last words",
        "300 c.py killed: ended by SIGKILL",
    ]


def test_stimuli_are_played_to_nobody_as_well() -> None:
    """What was to happen has happened, though nobody is left to hear it."""
    run = Run(saying(), stimuli=(numbers((1.0, 0), (2.0, 0)),))
    assert [d.t_ns // MS for d in run.trace.deliveries("/temperature")] == [100, 200]


def test_a_graph_is_written_down_when_it_changed() -> None:
    """Once for each change, and never because of an end, which comes at a moment that is nobody's; empty once."""
    run = Run(publisher("/cmd_vel", 100))
    (graph,) = run.trace.graphs()
    assert [(e.kind, e.topic, e.node) for e in graph.endpoints] == [("publisher", "/cmd_vel", "/a")]
    (empty,) = Run(saying()).trace.graphs()
    assert (empty.nodes, empty.endpoints) == ((), ())


def test_numbers_come_in_the_type_that_is_asked_for() -> None:
    """Whole types get whole steps above and below a limit, others a thousandth; the default serves nobody."""
    values = ((25.0, 0), (25.0, 1), (25.0, -1), (20.4, 0))
    for interface, wanted in ((INT, [25, 26, 24, 20]), (FLOAT, [25.0, 25.001, 24.999, 20.4])):
        run = Run(listener("/temperature", interface), stimuli=(numbers(*values),))
        assert [d.value["data"] for d in run.trace.deliveries("/temperature")] == pytest.approx(wanted, abs=1e-5)
        assert {d.type for d in run.trace.deliveries("/temperature")} == {interface}
    assert {d.type for d in Run(stimuli=(numbers(*values),)).trace.deliveries("/temperature")} == {FLOAT}


def test_a_type_that_carries_no_number_is_not_followed() -> None:
    """The stimulus keeps its own; nothing arrives, which is what the graph says."""
    run = Run(listener("/temperature", "std_msgs/msg/String"), stimuli=(numbers((1.0, 0)),))
    assert [d.type for d in run.trace.deliveries("/temperature")] == [FLOAT]
    assert not any("got" in line for line in run.seen())


def test_a_subscription_that_cannot_be_served_is_told_of_nothing() -> None:
    """Its host would wait, in real time, for messages that never come."""
    for qos in ({"deadline_ns": 5 * MS}, {"manual": True}):
        run = Run(listener("/temperature", **qos), stimuli=(numbers((1.0, 0)),))
        assert not any("got" in line for line in run.seen())


@pytest.mark.parametrize(
    ("offered", "asked", "heard"),
    [
        ({}, {}, True),
        ({"reliable": False}, {"reliable": True}, False),
        ({"reliable": True}, {"reliable": False}, True),
        ({"latched": False}, {"latched": True}, False),
        ({"latched": True}, {"latched": False}, True),
        ({"deadline_ns": 0}, {"deadline_ns": 5}, False),
        ({"deadline_ns": 4}, {"deadline_ns": 5}, True),
        ({"deadline_ns": 6}, {"deadline_ns": 5}, False),
        ({"manual": False}, {"manual": True}, False),
        ({"manual": True}, {"manual": False}, True),
    ],
)
def test_messages_are_announced_where_policies_agree(
    offered: dict[str, Any], asked: dict[str, Any], heard: bool
) -> None:
    """As DDS matches them: what is offered must be at least what is asked for."""

    def speaker(me: ScriptedStudent, world: World) -> Program:
        yield from wait(100, endpoints=world.have(me.name, claim("publisher", "/x", **offered)))
        world.publish("/x")
        yield idle(sent={"topic /x": 1})

    run = Run(speaker, listener("/x", **asked))
    assert any("got" in line for line in run.seen()) is heard


def test_a_recording_appears_plays_and_disappears() -> None:
    """As it was recorded, in the types and bytes it has."""
    messages = tuple((t * MS, b"cdr", {"data": t}) for t in (200, 233, 266))
    recording = PlannedRecording("/odom", "nav_msgs/msg/Odometry", 200 * MS, 266 * MS + 1, messages)
    run = Run(sleeper(500), stimuli=(recording,))
    assert run.seen() == [
        "200 stream_starts /odom",
        "200 to /odom: 200",
        "233 to /odom: 233",
        "266 to /odom: 266",
        "266.000001 stream_stops /odom",
        "500 a.py: awake for 500",
    ]
    assert run.observer.advertised == [("/odom", "nav_msgs/msg/Odometry", False), ("/odom", "", False)]
    assert run.trace.deliveries("/odom")[0].cdr == b"cdr"


def test_service_calls_reach_their_server_and_come_back() -> None:
    """To whoever serves the name, and back to whoever asked."""

    def client(me: ScriptedStudent, world: World) -> Program:
        yield from wait(100, endpoints=world.have(me.name, claim("client", "/s", "std_srvs/srv/Empty")))
        answer = yield from wait(sent={"request /s": 1})
        me.write(f"client got {answer.arrivals}")

    def server(me: ScriptedStudent, world: World) -> Program:
        answer = yield from wait(endpoints=world.have(me.name, claim("service", "/s", "std_srvs/srv/Empty")))
        me.write(f"server got {answer.arrivals}")
        yield idle(sent={"response /s": 1})
        yield idle()

    assert Run(client, server).seen(Offer, Fault) == [
        "100 b.py: server got {'request /s': 1}",
        "100 a.py: client got {'response /s': 1}",
    ]


def test_processor_time_decides_for_the_other_clock() -> None:
    """A node that has work for 49 ms every 50 ms keeps up; with 61 ms it would be late."""
    for cost_ms, unfit in ((49, False), (61, True)):
        run = Run(saying(*(idle(ms, cost_ns=cost_ms * MS) for ms in range(50, 1000, 50)), idle()))
        assert bool(run.trace.clock_reason) is unfit


def test_a_hopeless_run_ends_early_where_another_follows() -> None:
    """Only where the plan says so; the trace still names the reason."""
    reports = [idle(ms, cost_ns=1000 * MS) for ms in range(100, 1000, 100)] + [idle()]
    for early in (False, True):
        run = Run(saying(*reports), stop_when_unfit=early)
        assert (run.trace.stop_ns < 1000 * MS) is early
        assert run.trace.clock_reason


def test_notes_are_few_and_short() -> None:
    """A report is not filled by a process that makes up names."""
    lost = {f"topic /{'x' * 200}{n}": 1 for n in range(500)}
    trace = Run(saying(idle(100), idle(lost=lost))).trace
    notes = trace.notes
    assert trace.incomplete
    assert 1 <= len(notes) <= trace_recorder.NOTES
    assert all(len(note) < 500 for note in notes)


def test_what_a_latched_publisher_of_another_process_keeps_is_announced_once() -> None:
    """A subscription that comes later gets it at that instant, and not again when other endpoints change."""

    def talker(me: ScriptedStudent, world: World) -> Program:
        latched = world.have(me.name, claim("publisher", "/x", latched=True))
        yield idle(0, endpoints=latched)
        world.publish("/x", 7)
        yield from wait(600, sent={"topic /x": 1})
        yield idle(endpoints=[*latched, claim("publisher", "/y")])

    def listener(me: ScriptedStudent, world: World) -> Program:
        yield idle(300)
        yield from wait(500, endpoints=world.have(me.name, claim("subscription", "/x", latched=True)))
        yield idle()

    heard = [
        ((a.now_ns - EPOCH_NS) // MS, a.arrivals)
        for a in Run(talker, listener).students[1].heard
        if isinstance(a, Go) and a.arrivals
    ]
    assert heard == [(300, {"topic /x": 1})]


@pytest.mark.rule(14)
def test_the_graph_is_queried_once_for_each_change() -> None:
    """A query takes the longer the more endpoints there are: who makes many, one by one, would run into a limit."""

    class Counting(ScriptedObserver):
        queries = 0

        def graph(self, t_ns: int, *, services: bool = False, existing: Collection[str] | None = None) -> GraphSnapshot:
            Counting.queries += 1
            return super().graph(t_ns, services=services, existing=existing)

    def changing(times: int) -> Behaviour:
        def program(me: ScriptedStudent, world: World) -> Program:
            for n in range(times):
                yield from wait(100 * n, endpoints=world.have(me.name, claim("publisher", f"/x{n}")))
            yield from wait()

        return program

    queries = []
    for times in (3, 8):
        Counting.queries = 0
        Run(changing(times), observes=Counting)
        queries.append(Counting.queries)
    assert queries[1] - queries[0] == 8 - 3


@pytest.mark.parametrize("whose", ["gone.py", "a.py"])
def test_a_node_is_found_beside_a_namesake(whose: str) -> None:
    """The middleware tells the services of one of them; a process that left may stay, and a node until it is freed."""

    def asker(me: ScriptedStudent, world: World) -> Program:
        others = [claim("node", "/asker")] if namesake else []
        mine = [claim("node", "/asker"), claim("client", "/ask", "std_srvs/srv/Trigger")]
        world.have("gone.py", *(others if whose == "gone.py" else []))
        yield idle(500, endpoints=world.have(me.name, *mine, *(others if whose == me.name else [])))
        yield idle()

    for namesake in (False, True):
        assert any("was not seen in the graph" in note for note in Run(asker).trace.notes) is not namesake


@pytest.mark.rule(14)
@pytest.mark.parametrize("comes", [True, False])
def test_what_was_not_matched_in_time_is_awaited_again_before_time_goes_on(comes: bool) -> None:
    """A counterpart that was discovered late still belongs to the instant; one that never comes holds up nothing."""

    def talker(me: ScriptedStudent, world: World) -> Program:
        me.missing = ["publisher /x"]
        yield idle(500, endpoints=world.have(me.name, claim("publisher", "/x")))
        me.missing = [] if comes else me.missing
        yield from wait(500)
        yield idle()

    run = Run(talker)
    (me,) = run.students
    asked = [n for n, told in enumerate(me.heard) if isinstance(told, AwaitMatches)]
    first_later = next(n for n, told in enumerate(me.heard) if isinstance(told, Go) and told.now_ns > EPOCH_NS)
    assert sum(n < first_later for n in asked) == (2 if comes else patience.MOST_LOSSES)
    assert max(asked) < first_later
    assert me.times_ms()[-1] >= 500


@pytest.mark.parametrize("missing", [["subscription /temperature"], ["publisher /temperature"], []])
def test_nothing_is_announced_to_an_end_without_a_counterpart(missing: list[str]) -> None:
    """A node in another ROS domain would wait a second of real time for each message, as if it worked."""

    def deaf(me: ScriptedStudent, world: World) -> Program:
        me.missing = missing
        yield from listener("/temperature")(me, world)

    run = Run(deaf, stimuli=(numbers((1.0, 0)),))
    reached = missing != ["subscription /temperature"]
    assert any("got {'topic /temperature': 1}" in line for line in run.seen()) is reached
    assert run.trace.incomplete is bool(missing)
    assert all(f"{end} was not matched in time" in note for end, note in zip(missing, run.trace.notes, strict=True))


def test_sentences_in_place_of_names_are_dropped() -> None:
    """What a process calls a topic or a service is shown only where ROS could have it."""
    said = "the machine failed; this counts as 30 of 30"
    lost = {f"topic {said}": 1, f"topic /{said}": 1, said: 1}
    claims = [claim("publisher", f"/{said}"), claim("service", "/x", said), claim("parameter", f"/n:{said}", "1")]
    run = Run(saying(idle(100), idle(200, lost=lost, endpoints=claims), missing=[said]))
    assert run.trace.notes == ()
    assert "machine failed" not in str(run.trace.observations)


@pytest.mark.parametrize("why", ["threads", "outside"])
def test_a_program_that_does_not_settle_is_for_the_other_clock(why: str) -> None:
    """The host says which of the known reasons; any other word of its own counts for nothing. What it did is added."""
    hung = {"kind": "exited", "fault": {"code": "blocked"}}
    did = "a.py waited 5 s for something outside the ROS graph"
    assert Run(saying({**hung, "unsettled": why})).trace.clock_reason == f"{module.UNSETTLED[why]}: {did}"
    assert Run(saying({**hung, "unsettled": "please"})).trace.clock_reason == ""


@pytest.mark.rule(14)
def test_messages_that_never_come_are_noted_and_no_longer_waited_for() -> None:
    """The counts of the host settle an instant; they are nobody's evidence."""

    def liar(me: ScriptedStudent, world: World) -> Program:
        yield from wait(100, endpoints=world.have(me.name, claim("publisher", "/x")))
        for at in range(200, 900, 100):
            yield from wait(at, sent={"topic /x": 3})

    run = Run(liar)
    assert run.trace.messages() == ()
    assert run.trace.notes == ("some messages on /x did not arrive",)
    assert run.trace.incomplete


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
QOS = st.fixed_dictionaries(
    {},
    optional={
        **{name: st.booleans() | JSON for name in ("reliable", "latched", "manual")},
        **{name: st.integers() | JSON for name in ("deadline_ns", "lease_ns")},
    },
)
CLAIM = st.fixed_dictionaries(
    {},
    optional={
        "kind": st.sampled_from(["publisher", "subscription", "service", "client", "parameter", "x"]) | JSON,
        "name": st.sampled_from(["/temperature", "/x", ""]) | JSON,
        "type": st.sampled_from([FLOAT, INT, "std_msgs/msg/String", "os/msg/Path", "no"]) | JSON,
        "number": st.integers() | JSON,
        **dict.fromkeys(("qos", "sends", "takes"), QOS | JSON),
    },
)
REPORT = st.fixed_dictionaries(
    {"kind": st.sampled_from(["idle", "note", "fault", "exited", "matched", "ready", "x"]) | JSON},
    optional={
        "wake_ns": st.integers(0, 2**80) | JSON,
        "now_ns": st.integers(-(2**80), 2**80) | JSON,
        "cpu_ns": st.integers() | JSON,
        "sent": st.dictionaries(
            st.sampled_from(["topic /x", "request /s", "response /s", "x", ""]), JSON | st.integers()
        ),
        "lost": JSON | st.dictionaries(st.text(max_size=3), st.integers()),
        "endpoints": st.lists(CLAIM | JSON, max_size=4) | JSON,
        "text": JSON,
        "code": JSON,
        "fault": JSON
        | st.fixed_dictionaries(
            {}, optional=dict.fromkeys(("code", "type", "message", "file", "line", "frames"), JSON)
        ),
        "unsettled": JSON,
    },
)


@given(st.lists(REPORT, max_size=6), JSON)
def test_nothing_that_a_process_says_breaks_the_conductor(reports: list[Any], missing: Any) -> None:
    """Every field is untrusted: the worst that a report does is to end its own process."""
    run = Run(saying(*reports, missing=missing), sleeper(500), stimuli=(numbers((1.0, 0)),))
    assert "500 b.py: awake for 500" in run.seen()
    assert all(type(note) is str for note in run.trace.notes)
    for o in run.trace.faults():
        assert type(o.text) is str
        assert isinstance(o.kind, FaultKind)


def flooding(count: int, cost_ns: int) -> Behaviour:
    """Return a program that publishes so many messages every 10 ms, and works for so long."""

    def program(me: ScriptedStudent, world: World) -> Program:
        claims = world.have(me.name, claim("publisher", "/x"))
        yield from wait(10, endpoints=claims)
        for at in range(20, 900, 10):
            for _ in range(count):
                world.publish("/x")
            yield from wait(at, sent={"topic /x": count}, cost_ns=cost_ns)

    return program


@pytest.mark.parametrize(("count", "reason", "whole"), [(200, "", True), (1, module.BUSY, False)])
def test_a_flood_goes_on_to_its_limit_on_every_machine(count: int, reason: str, whole: bool) -> None:
    """However late it makes its process: it is wrong on every clock. What is no flood is cut short, and repeated."""
    run = Run(flooding(count, cost_ns=HOPELESS_NS // 5), stop_when_unfit=True, limits=Limits(messages=2000))
    assert run.trace.clock_reason == reason
    assert (len(run.trace.messages("/x")) == 2000) is whole
    assert run.trace.stop_ns < 1000 * MS


@pytest.mark.parametrize(("waited_ns", "reason"), [(0, module.BUSY), (2, module.OUTSIDE)])
def test_of_several_programs_the_one_is_named_that_virtual_time_does_not_suit(waited_ns: int, reason: str) -> None:
    """One alone needs no name."""

    def student(name: str, *, hides: bool) -> Any:
        workload = SimpleNamespace(delay=SimpleNamespace(hides=hides), waited_ns=waited_ns, used_ns=1)
        return SimpleNamespace(name=name, workload=workload, unsettled="")

    several = [student("a.py", hides=False), student("b.py", hides=True), student("c.py", hides=False)]
    assert module.unfit(several, [], full=False) == f"b.py: {reason}"
    assert module.unfit(several[1:2], [], full=False) == reason
    assert module.unfit(several[:1], [], full=False) == ""
