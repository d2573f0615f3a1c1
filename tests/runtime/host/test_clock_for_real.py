"""Nodes see the same of time on both clocks: simulated clocks, the times of messages, and timed events."""

import ast
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tiers import but, more

from grader.runtime.model.trace import AssessedTrace, ClockKind, FaultKind, OutputLine
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import record

from grader.runtime.model.quantities import NS_PER_S

pytestmark = pytest.mark.ros

BEFORE = """
import sys, threading, time
import rclpy
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Int32

rclpy.init()

def say(text):
    sys.stdout.write(text + "\\n")  # at once, or lines of two threads would be mixed
    sys.stdout.flush()
"""
#: Publishes simulated time on /clock, five times as fast as time passes.
FAST_CLOCK = """
node, count = Node("fast"), 0
publisher = node.create_publisher(Clock, "/clock", 10)

def publish():
    global count
    count += 1
    told = Clock()
    told.clock.sec, told.clock.nanosec = count // 2, count % 2 * 500_000_000
    publisher.publish(told)

node.create_timer(0.1, publish)
rclpy.spin(node)
"""
SIMULATED = """
node = Node("simulated", parameter_overrides=[Parameter("use_sim_time", value=True)])

def simulated_ms():
    return node.get_clock().now().nanoseconds // 1_000_000
"""
#: Publishes 1, 2, 3 and so on every 300 ms.
COUNTER = """
node, count = Node("counter"), 0
publisher = node.create_publisher(Int32, "/count", 10)

def publish():
    global count
    count += 1
    publisher.publish(Int32(data=count))

node.create_timer(0.3, publish)
rclpy.spin(node)
"""


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    tmp_path.chmod(0o755)

    def run_all(*programs: str, clock: str, **fields: Any) -> AssessedTrace:
        whole = [BEFORE + textwrap.dedent(program) for program in programs]
        trace = record(session, tmp_path / "s", *whole, clock=clock, **{"duration_ns": 4 * NS_PER_S, **fields})
        assert trace.harness_problem == ""
        return trace

    return run_all


def said(trace: AssessedTrace, process: str = "a.py") -> list[tuple[float, str]]:
    """Return what a program wrote, with the time in seconds."""
    lines = [o for o in trace.observations if isinstance(o, OutputLine) and o.process == process]
    return [(round(line.t_ns / NS_PER_S, 3), line.text) for line in lines]


def _ms(text: str) -> int:
    return int(text.split()[1])


@pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
def test_a_simulated_clock_follows_the_messages_on_clock(run: Callable[..., AssessedTrace], clock: str) -> None:
    """Timers, rates and sleeps of a node with use_sim_time are as fast as /clock; the wall clock only starts later."""
    program = """
    node.create_timer(1.0, lambda: say(f"timer {simulated_ms()}"))
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    rate = node.create_rate(0.5)
    for _ in range(2):
        rate.sleep()
        say(f"rate {simulated_ms()}")
    node.get_clock().sleep_for(Duration(seconds=3))
    say(f"slept {simulated_ms()}")
    time.sleep(60)
    """
    # The first message would be lost if it were sent before the other node and the grader's had been found.
    wait = "time.sleep(0.5)\nwhile publisher.get_subscription_count() < 2:\n    time.sleep(0.01)\n"
    later = FAST_CLOCK.replace("node.create_timer", f"{wait}node.create_timer")
    found = said(run(SIMULATED + textwrap.dedent(program), later, clock=clock, duration_ns=7 * NS_PER_S))
    others = [(at, text) for at, text in found if not text.startswith("timer")]
    timers = [text for _, text in found if text.startswith("timer")][:10]
    wanted = ["rate 2000", "rate 4000", "slept 7000", *(f"timer {n}000" for n in range(1, 11))]
    said_of_it = [*(text for _, text in others), *timers]
    if clock == "virtual":
        assert said_of_it == wanted
        assert [at for at, _ in others] == [0.9, 1.3, 1.9]
    # On the wall clock a busy machine wakes a thread late, in simulated time as well; never early
    assert [text.split()[0] for text in said_of_it] == [text.split()[0] for text in wanted]
    assert [text for text, at_least in zip(said_of_it, wanted, strict=True) if _ms(text) < _ms(at_least)] == []


@pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
def test_without_messages_on_clock_a_simulated_clock_stands_still(
    run: Callable[..., AssessedTrace], clock: str
) -> None:
    """The classical mistake: use_sim_time without a simulation. No timer fires, until the parameter is taken back."""
    program = """
    fired = []

    def fire():
        say("timer")
        fired.append(1)
        if len(fired) == 7:
            rclpy.shutdown()

    node.create_timer(0.2, fire)
    for _ in range(4):
        rclpy.spin_once(node, timeout_sec=0.5)
    say(f"now {simulated_ms()}")
    node.set_parameters([Parameter("use_sim_time", value=False)])
    say(f"real {simulated_ms() > 1_000_000_000_000}")
    rclpy.spin(node)
    """
    found = said(run(SIMULATED + textwrap.dedent(program), clock=clock, duration_ns=60 * NS_PER_S))
    assert [text for _, text in found] == ["now 0", "real True", *["timer"] * 7]
    assert all(at >= 2 for at, _ in found)


@pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
def test_callbacks_are_told_when_their_messages_were_sent(run: Callable[..., AssessedTrace], clock: str) -> None:
    """Also if the program sleeps meanwhile, and if it sent them itself.

    On the wall clock, what a busy machine takes is unknown, but each message was sent while it was being published.
    """
    program = """
    node = Node("late")
    own = node.create_publisher(Int32, "/own", 10)
    heard = []

    def now_ns():
        return node.get_clock().now().nanoseconds

    def hear(message, info):
        heard.append((message.data, info["source_timestamp"], info["received_timestamp"], now_ns()))

    node.create_subscription(Int32, "/count", hear, 10)
    node.create_subscription(Int32, "/own", hear, 10)
    while not heard:
        rclpy.spin_once(node)
    before_ns = now_ns()
    own.publish(Int32(data=100))
    after_ns = now_ns()
    time.sleep(0.7)
    wanted = {1, 2, 3, 100}
    while not wanted <= {number for number, *_ in heard}:
        rclpy.spin_once(node, timeout_sec=0.0)
    say(repr([(100, before_ns, after_ns)]))
    say(repr(sorted(each for each in heard if each[0] in wanted)))
    """
    counter = """
    node, count = Node("counter"), 0
    publisher = node.create_publisher(Int32, "/count", 10)
    while publisher.get_subscription_count() < 2:
        time.sleep(0.01)

    def publish():
        global count
        count += 1
        before_ns = node.get_clock().now().nanoseconds
        publisher.publish(Int32(data=count))
        say(repr([(count, before_ns, node.get_clock().now().nanoseconds)]))

    node.create_timer(0.3, publish)
    rclpy.spin(node)
    """
    trace = run(program, counter, clock=clock)
    sent = {number: times for text in said(trace, "b.py") for number, *times in ast.literal_eval(text[1])}
    own, heard = (ast.literal_eval(text) for _, text in said(trace))
    sent |= {number: times for number, *times in own}
    assert [number for number, *_ in heard] == [1, 2, 3, 100]
    assert all(sent_ns <= received_ns <= now_ns for _, sent_ns, received_ns, now_ns in heard)
    if clock == "virtual":
        ages_ns = [now_ns - sent_ns for _, sent_ns, _, now_ns in heard]
        assert [round(age_ns / NS_PER_S, 1) for age_ns in ages_ns] == [0.0, 0.4, 0.1, 0.7]
    else:
        assert all(sent[number][0] <= sent_ns <= sent[number][1] for number, sent_ns, *_ in heard)


@pytest.mark.long
def test_a_watched_deadline_needs_the_wall_clock(run: Callable[..., AssessedTrace]) -> None:
    """The middleware times deadlines itself; virtual time would never miss one, and says so."""
    program = """
    node = Node("deadline")
    qos = QoSProfile(depth=10, deadline=Duration(seconds=0.5))
    node.create_subscription(
        Int32, "/x", lambda _: None, qos, event_callbacks=SubscriptionEventCallbacks(deadline=lambda _: say("missed"))
    )
    publisher = node.create_publisher(Int32, "/x", qos)
    publisher.publish(Int32())
    rclpy.spin(node)
    """
    virtual = run(program, clock="virtual")
    assert [fault.kind for fault in virtual.faults()] == [FaultKind.HUNG]
    assert virtual.clock_reason.endswith(
        " waits for a missed deadline or a lost liveliness, which the middleware times in real time"
    )
    wall = run(program, clock="wall")
    assert wall.clock is ClockKind.WALL
    assert {text for _, text in said(wall)} == {"missed"}


def test_events_that_time_does_not_bring_stay_in_virtual_time(run: Callable[..., AssessedTrace]) -> None:
    """A deadline that nobody watches, and callbacks for what discovery finds."""
    program = """
    node = Node("matched")
    qos = QoSProfile(depth=10, deadline=Duration(seconds=5))
    events = SubscriptionEventCallbacks(matched=lambda e: say(f"matched {e.current_count}"), liveliness=lambda _: None)
    node.create_subscription(Int32, "/count", lambda m: say(f"heard {m.data}"), 10, event_callbacks=events)
    node.create_publisher(Int32, "/x", qos)
    rclpy.spin(node)
    """
    trace = run(program, COUNTER, clock="virtual")
    assert said(trace)[:3] == [(0.0, "matched 1"), (0.3, "heard 1"), (0.6, "heard 2")]
    assert trace.clock_reason == ""


#: Ways to poll without ever blocking.
POLLING = {
    "spin_once": "while rclpy.ok():\n    rclpy.spin_once(node, timeout_sec=0)",
    "looking": "while rclpy.ok():\n    rclpy.spin_once(node, timeout_sec=0)\n    node.get_clock().now()",
    "own_executor": "executor.add_node(node)\nwhile rclpy.ok():\n    executor.spin_once(timeout_sec=0)",
    "coroutine": "executor.create_task(wait)\nexecutor.add_node(node)\nwhile rclpy.ok():\n    executor.spin_once()",
    "added_each_time": "executor.create_task(wait)\nwhile rclpy.ok():\n    rclpy.spin_once(node, executor=executor)",
    "tasks": "def again():\n    executor.create_task(again)\n"
    "executor.create_task(again)\nexecutor.add_node(node)\nexecutor.spin()",
    "until": "future = rclpy.task.Future()\nwhile rclpy.ok():\n"
    "    rclpy.spin_until_future_complete(node, future, timeout_sec=0)",
}


@pytest.mark.breadth(1, 2)
@pytest.mark.parametrize("loop", but([POLLING["spin_once"]], POLLING.values()), ids=POLLING)
def test_a_timer_that_is_polled_fires_on_time(run: Callable[..., AssessedTrace], loop: str) -> None:
    """Although time passes in larger steps for a program that polls: never beyond its next timer."""
    program = """
        from rclpy.executors import SingleThreadedExecutor

        async def wait():
            await rclpy.task.Future()

        node, executor = Node("polled"), SingleThreadedExecutor()
        node.create_timer(0.004, lambda: say("quick"))
        node.create_timer(0.125, lambda: say("slow"))
    """
    trace = run(textwrap.dedent(program) + loop, clock="virtual", duration_ns=NS_PER_S)
    told = [(line.text, line.t_ns / 1e6) for line in trace.of(OutputLine) if line.t_ns < NS_PER_S]
    assert [t for text, t in told if text == "quick"] == [4 * number for number in range(1, 250)]
    assert [t for text, t in told if text == "slow"] == [125 * number for number in range(1, 8)]
