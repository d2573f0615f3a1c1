"""The runner of the wall clock, on a clock that the tests advance: what it writes down, and when it says nothing."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, cast

import pytest

pytest.importorskip("rclpy")

from scripted import FLOAT, INT, MS, Behaviour, Program, ScriptedObserver, ScriptedStudent, World, claim, numbers, plan

from grader.runtime.host.clock import EPOCH_NS
from grader.runtime.model.limits import Limits
from grader.runtime.model.trace import ClockKind, FaultKind
from grader.runtime.plan import PlannedConnection
from grader.runtime.stimuli.messages import PlannedMessages
from grader.runtime.stimuli.recorded import PlannedRecording
from grader.runtime.worker.bare_runner import BareRunner
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.wall_runner import WallRunner

SILENT = {"kind": "silent"}


class Clock:
    """Stands for the module `time`: each pause takes a millisecond, and holds up where a test says so.

    Args:
        held_up: How many milliseconds the pause takes that begins at a millisecond.
        work: How many milliseconds of it this process works.
    """

    def __init__(self, held_up: dict[int, int] | None = None, work: dict[int, int] | None = None) -> None:
        self.now_ns = 10**12
        self.held_up = held_up or {}
        self.work = work or {}
        self.used_ns = 0

    def monotonic_ns(self) -> int:
        return self.now_ns

    def time_ns(self) -> int:
        return EPOCH_NS + self.now_ns

    def process_time_ns(self) -> int:
        return self.used_ns

    def sleep(self, seconds: float) -> None:
        elapsed_ms = (self.now_ns - 10**12) // MS
        self.used_ns += self.work.pop(elapsed_ms, 0) * MS
        self.now_ns += self.held_up.pop(elapsed_ms, 1) * MS


class Run:
    """One run of some programs: its trace, and everybody who took part."""

    def __init__(
        self,
        *programs: Behaviour,
        held_up: dict[int, int] | None = None,
        work: dict[int, int] | None = None,
        fills_machine: bool = False,
        **fields: Any,
    ) -> None:
        self.world = World()
        self.students = [ScriptedStudent(n, p, self.world) for n, p in zip(("a.py", "b.py"), programs, strict=False)]
        self.observer = ScriptedObserver(self.world)
        students, observer = cast("list[NodeProcess]", self.students), cast("Observer", self.observer)
        clock = Clock(held_up, work)
        runner = WallRunner(plan(clock="wall", **fields), students, observer, real_time=clock)
        runner.fills_machine = lambda: fills_machine
        self.trace = runner.run()


def publisher(topic: str, *, every_ms: int, first_ms: int = 0, interface: str = FLOAT) -> Behaviour:
    """A program that publishes on a topic in the loops of the runner, one a millisecond."""

    def program(me: ScriptedStudent, world: World) -> Program:
        world.have(me.name, claim("publisher", topic, interface))
        ms = 0
        while True:
            if ms >= first_ms and (ms - first_ms) % every_ms == 0:
                world.publish(topic, ms, interface)
            ms += 1
            yield SILENT

    return program


def quiet(me: ScriptedStudent, world: World) -> Program:
    """A program that does nothing."""
    while True:
        yield SILENT


def test_messages_get_the_time_at_which_they_came() -> None:
    """To the millisecond in which the runner looks."""
    run = Run(publisher("/cmd_vel", every_ms=50))
    assert [m.t_ns // MS for m in run.trace.messages("/cmd_vel")] == list(range(0, 1000, 50))
    assert (run.trace.clock, run.trace.stop_ns, run.trace.harness_problem) == (ClockKind.WALL, 1000 * MS, "")


def test_the_span_begins_with_the_first_message() -> None:
    """A node that starts late is observed as long as one that starts at once."""
    run = Run(publisher("/cmd_vel", every_ms=50, first_ms=700), first_message_on="/cmd_vel")
    messages = run.trace.messages("/cmd_vel")
    assert run.trace.stop_ns == messages[0].t_ns + 1000 * MS
    assert len(messages) == 20


def test_a_first_message_is_waited_for_as_long_as_virtually() -> None:
    """A timer of a long period shows its publisher's rate on either clock."""
    run = Run(
        publisher("/cmd_vel", every_ms=50, first_ms=5000), first_message_on="/cmd_vel", wait_at_most_ns=60_000 * MS
    )
    assert run.trace.stop_ns == run.trace.messages("/cmd_vel")[0].t_ns + 1000 * MS
    assert Run(quiet, first_message_on="/cmd_vel", wait_at_most_ns=60_000 * MS).trace.stop_ns == 60_000 * MS


def test_every_process_is_told_to_start() -> None:
    """Once, and nothing more until the stop signal."""
    run = Run(quiet, quiet)
    assert [len(student.heard) for student in run.students] == [1, 1]


def test_a_machine_that_did_not_keep_up_is_no_judge() -> None:
    """The reference is the loop itself: held up for long, it says nothing about the nodes."""
    assert Run(quiet, held_up={300: 151}).trace.harness_problem.startswith("the machine was too busy")
    assert Run(quiet, held_up={300: 150}).trace.harness_problem == ""
    # Nor is one that was held up until after the end: nobody has looked meanwhile.
    assert Run(quiet, held_up={300: 2000}).trace.harness_problem.startswith("the machine was too busy")


def test_what_the_nodes_make_the_grader_do_is_no_busy_machine() -> None:
    """A graph of hundreds of endpoints, say: what the loop works itself nobody else has taken from it."""
    assert Run(quiet, held_up={300: 400}, work={300: 300}).trace.harness_problem == ""
    # Beside other programs the same work is interrupted many times, each time as briefly as ever.
    assert Run(quiet, held_up={300: 600}, work={300: 300}).trace.harness_problem == ""
    assert Run(quiet, held_up={300: 400}, work={300: 1}).trace.harness_problem != ""
    assert Run(quiet, held_up={300: 400}, work={100: 300}).trace.harness_problem != ""


@pytest.mark.parametrize(
    ("said_ms", "counts_ms"), [(None, 500), (450, 450), (100, 200), (600, 500)], ids=["unknown", "", "before", "after"]
)
def test_what_a_late_look_finds_counts_from_its_arrival(said_ms: int | None, counts_ms: int) -> None:
    """Between the looks, even where the system clock was set meanwhile."""
    clock = Clock()
    runner = BareRunner(plan(clock="wall"), [], cast("Observer", ScriptedObserver(World())))
    runner._real_time, runner._started = clock, clock.now_ns
    for looked_ms in (200, 500):
        clock.now_ns = runner._started + looked_ms * MS
        runner._note_delay()
    said_ns = 0 if said_ms is None else EPOCH_NS + runner._started + said_ms * MS
    assert runner._arrived(said_ns, runner._looked_ns) == counts_ms * MS


def test_nodes_that_fill_the_machine_themselves_are_judged() -> None:
    """With children that compute, for instance."""
    assert Run(quiet, held_up={300: 400}, fills_machine=True).trace.harness_problem == ""


class RarelyLooking(WallRunner):
    """Looks less often at a graph that does not change, as a run without the host does."""

    rarest_graph_ns = 200 * MS

    def __init__(self, *given: Any, **options: Any) -> None:
        super().__init__(*given, **options)
        self.looks: list[int] = []

    def _look_at_graph(self, now_ns: int) -> bool:
        self.looks.append(now_ns // MS)
        return super()._look_at_graph(now_ns)


def test_a_graph_that_does_not_change_is_looked_at_less_often() -> None:
    """Up to the longest interval; a change is followed by a look as soon as in any other run."""
    world = World()

    def late(me: ScriptedStudent, world: World) -> Program:
        for _ in range(700):
            yield SILENT
        world.have(me.name, claim("publisher", "/late", FLOAT))
        while True:
            yield SILENT

    student, observer = cast("NodeProcess", ScriptedStudent("a.py", late, world)), ScriptedObserver(world)
    runner = RarelyLooking(plan(clock="wall"), [student], cast("Observer", observer), real_time=Clock())
    trace = runner.run()
    gaps = [after - before for before, after in pairwise(runner.looks[:-1])]
    assert max(gaps) <= 201
    assert len(gaps) < 10
    (seen_ms,) = {g.t_ns // MS for g in trace.graphs() if any(e.topic == "/late" for e in g.endpoints)}
    assert 700 <= seen_ms <= 901
    assert runner.looks[runner.looks.index(seen_ms) + 1] - seen_ms <= 51


def test_numbers_are_published_when_they_are_due() -> None:
    """In the type that the student's subscription asks for, as soon as it is seen."""

    def program(me: ScriptedStudent, world: World) -> Program:
        world.have(me.name, claim("subscription", "/temperature", INT))
        yield from quiet(me, world)

    run = Run(program, stimuli=(numbers((25.0, 1), (20.0, 0)),))
    deliveries = run.trace.deliveries("/temperature")
    assert [d.t_ns // MS for d in deliveries] == [100, 200]
    assert [(d.type, d.value["data"]) for d in deliveries] == [(INT, 26), (INT, 20)]
    assert [message.data for _, message in run.observer.published] == [26, 20]


def test_a_recording_appears_plays_and_disappears() -> None:
    """The publisher is there exactly while it plays."""
    messages = tuple((t * MS, b"cdr", {"data": t}) for t in (200, 233, 266))
    recording = PlannedRecording("/odom", "nav_msgs/msg/Odometry", 200 * MS, 266 * MS + 1, messages)
    trace = Run(quiet, stimuli=(recording,)).trace
    assert [d.t_ns // MS for d in trace.deliveries("/odom")] == [200, 233, 266]
    assert [m.t_ns // MS for m in (*trace.marks("stream_starts", "/odom"), *trace.marks("stream_stops", "/odom"))] == [
        200,
        267,
    ]


def test_too_many_messages_end_the_run_with_a_mark() -> None:
    """A flood is evidence enough."""
    trace = Run(publisher("/cmd_vel", every_ms=1), limits=Limits(messages=5)).trace
    assert len(trace.messages()) == 5
    (mark,) = trace.marks("limit")
    assert mark.detail == "more than 5 messages on /cmd_vel: the rest was ignored"
    assert trace.stop_ns == mark.t_ns


def test_ends_are_faults_and_the_run_ends_with_the_last() -> None:
    """An exit with a fault, a death without a word, and what was written before."""

    def leaves(me: ScriptedStudent, world: World) -> Program:
        yield {"kind": "note", "code": "main_not_called"}
        me.write("bye")
        yield {"kind": "exited", "code": 1, "fault": {"code": "exception", "type": "ValueError", "message": "x"}}

    def dies(me: ScriptedStudent, world: World) -> Program:
        yield {"kind": "fault", "fault": {"code": "exception", "type": "KeyError", "message": "in a thread"}}
        me.write("last words")
        yield None

    trace = Run(leaves, dies).trace
    assert [(f.process, f.kind, f.text) for f in trace.faults()] == [
        ("b.py", FaultKind.EXCEPTION, "KeyError: in a thread"),
        ("a.py", FaultKind.EXCEPTION, "ValueError: x"),
        ("b.py", FaultKind.KILLED, "ended by SIGKILL"),
    ]
    assert [line.text for line in trace.lines()] == ["bye", "last words"]
    assert trace.notes == ("main_not_called",)
    assert trace.stop_ns == 1000 * MS


def test_the_graph_is_written_down_when_it_changed() -> None:
    """Looked at now and then, since looking costs much."""
    run = Run(publisher("/cmd_vel", every_ms=50))
    assert len(run.trace.graphs()) == 1
    assert [e.topic for e in run.trace.graphs()[0].endpoints] == ["/cmd_vel"]


def test_a_recording_s_publisher_stays_until_its_last_message_has_arrived() -> None:
    """A publisher that goes at once takes with it what is still on its way."""
    recording = PlannedRecording("/odom", "nav_msgs/msg/Odometry", 200 * MS, 266 * MS + 1, ((200 * MS, b"cdr", {}),))
    gone = ("/odom", "", False)
    assert Run(quiet, stimuli=(recording,), duration_ns=600 * MS).observer.advertised[-1] != gone
    assert Run(quiet, stimuli=(recording,), duration_ns=700 * MS).observer.advertised[-1] == gone


def test_a_node_that_floods_is_no_excuse() -> None:
    """What holds the machine up is then the node itself: it is judged, not let off."""
    trace = Run(publisher("/cmd_vel", every_ms=1), limits=Limits(messages=500), held_up={300: 400}).trace
    assert (trace.harness_problem, len(trace.messages("/cmd_vel"))) == ("", 500)


def test_two_recordings_on_one_topic_do_not_end_each_other() -> None:
    """The first one's publisher, which stays for its last message, goes before the second one's comes."""
    first = PlannedRecording("/odom", "nav_msgs/msg/Odometry", 200 * MS, 300 * MS, ((200 * MS, b"cdr", {}),))
    second = PlannedRecording("/odom", "nav_msgs/msg/Odometry", 400 * MS, 900 * MS, ((800 * MS, b"cdr", {}),))
    run = Run(quiet, stimuli=(first, second))
    assert [(topic, bool(kind)) for topic, kind, _ in run.observer.advertised] == [
        ("/odom", True),
        ("/odom", False),
        ("/odom", True),
    ]
    assert len(run.trace.deliveries("/odom")) == 2


@pytest.mark.parametrize("latched", [False, True])
@pytest.mark.parametrize("delay_ms", [0, 80])
def test_a_stream_that_follows_soon_takes_the_publisher_over_or_comes_after_it(latched: bool, delay_ms: int) -> None:
    """One with the same QoS goes on with the publisher; otherwise the first one goes before the second one comes."""
    usual: dict[str, Any] = {"type": FLOAT, "period_ns": 100 * MS, "repeats": 1, "best_effort": False}
    first = PlannedMessages("/a", start_ns=400 * MS, stop_ns=500 * MS, latched=False, values=({},), **usual)
    second = PlannedMessages("/a", start_ns=550 * MS, stop_ns=0, latched=latched, values=({}, {}), **usual)
    connections = (PlannedConnection("/a", (delay_ms * MS, delay_ms * MS), 0.0, "1"),) if delay_ms else ()
    run = Run(quiet, stimuli=(first, second), connections=connections, duration_ns=900 * MS)
    assert len(run.trace.deliveries("/a")) == 3
    changes = [(bool(kind), latched) for _, kind, latched in run.observer.advertised]
    assert changes == ([(True, False), (False, False), (True, True)] if latched else [(True, False)])
