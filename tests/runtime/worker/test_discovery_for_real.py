"""What a program publishes before anybody can have discovered the publisher is recorded, and marked, on both clocks."""

import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tiers import NIGHTLY, but, more

from grader.runtime.model.trace import AssessedTrace, OutputLine
from grader.runtime.plan import Plan
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import planned, record
from side_by_side import rows_of

from grader.grading.judging.judge_run import notes_on_unheard
from grader.runtime.model.quantities import NS_PER_S

pytestmark = pytest.mark.ros

CLOCKS = pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
BEFORE = """
import threading, time
import rclpy
import rclpy.executors
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

rclpy.init()
node = Node("talking")

def send(number=1):
    publisher.publish(Int32(data=number))
"""
MAKE = "publisher = node.create_publisher(Int32, '/count', 10)\n"
#: Programs whose first message nobody would hear.
EARLY = {
    "at once": MAKE + "send()\nrclpy.spin(node)",
    "best effort": MAKE.replace("10", "qos_profile_sensor_data") + "send()\nrclpy.spin(node)",
    "after other work": MAKE + "sum(range(1000))\nnode.get_logger().info('sends')\nsend()\nrclpy.spin(node)",
    "after a poll": MAKE + "rclpy.spin_once(node, timeout_sec=0.0)\nsend()\nrclpy.spin(node)",
    "beside a spinning thread": MAKE
    + "threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()\nsend()\ntime.sleep(9)",
    "with another publisher": "other = node.create_publisher(Int32, '/other', 10)\n"
    + MAKE
    + "other.publish(Int32())\nsend()\nrclpy.spin(node)",
    "later": "time.sleep(0.5)\n" + MAKE + "send()\nrclpy.spin(node)",
    "without looking at the count": MAKE + "publisher.get_subscription_count()\nsend()\nrclpy.spin(node)",
    "and with a timer": MAKE + "send()\nnode.create_timer(0.3, lambda: send(2))\nrclpy.spin(node)",
}
#: Programs that do it right, or whose messages are kept for those who come later.
HEARD = {
    "from a timer": MAKE + "node.create_timer(0.3, send)\nrclpy.spin(node)",
    "after a pause": MAKE + "time.sleep(0.1)\nsend()\nrclpy.spin(node)",
    "after a spin": MAKE + "rclpy.spin_once(node, timeout_sec=0.2)\nsend()\nrclpy.spin(node)",
    "after a spin until a future is done": MAKE
    + "rclpy.spin_until_future_complete(node, rclpy.Future(), timeout_sec=0.2)\nsend()\nrclpy.spin(node)",
    "after a spin of an executor": MAKE
    + "executor = rclpy.executors.SingleThreadedExecutor()\nexecutor.add_node(node)\n"
    + "executor.spin_once(timeout_sec=0.2)\nsend()\nexecutor.spin()",
    "once there is a subscription": MAKE
    + "while not publisher.get_subscription_count():\n    time.sleep(0.05)\nsend()\nrclpy.spin(node)",
    "at a match": """
        events = PublisherEventCallbacks(matched=lambda e: send())
        publisher = node.create_publisher(Int32, "/count", 10, event_callbacks=events)
        rclpy.spin(node)
        """,
    "latched": MAKE.replace("10", "QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)")
    + "send()\nrclpy.spin(node)",
    "in an answer": MAKE
    + """
node.create_service(Trigger, "/own", lambda _, response: (send(), response)[1])
client = node.create_client(Trigger, "/own")
time.sleep(0.2)
client.call_async(Trigger.Request())
rclpy.spin(node)
""",
}


#: Two seconds from the first message on: a busy machine takes long to get there.
USUAL: dict[str, Any] = {"duration_ns": 2 * NS_PER_S, "first_message_on": "/count"}
#: Those that are recorded on the wall clock with `--long`; the others are every night.
ON_THE_WALL = ("at once", "beside a spinning thread", "from a timer", "latched")


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    tmp_path.chmod(0o755)

    def run_all(*programs: str, clock: str, **fields: Any) -> AssessedTrace:
        whole = [BEFORE + textwrap.dedent(program) for program in programs]
        trace = record(session, tmp_path / "s", *whole, clock=clock, **{**USUAL, **fields})
        assert trace.harness_problem == ""
        return trace

    return run_all


def early(trace: AssessedTrace) -> list[bool]:
    """Return of each message on the topic whether it was sent before discovery."""
    return [message.before_discovery for message in trace.messages("/count")]


def plan(folder: Path, program: str, clock: str) -> Plan:
    return planned(folder, BEFORE + textwrap.dedent({**EARLY, **HEARD}[program]), clock=clock, **USUAL)


def rows(programs: dict[str, str], default: str) -> pytest.MarkDecorator:
    """Return a mark: each program on each clock."""
    virtual = but([(default, "virtual")], [(name, "virtual") for name in programs])
    wall = [(name, "wall") for name in programs]
    often, others = ([row for row in wall if (row[0] in ON_THE_WALL) is kept] for kept in (True, False))
    return pytest.mark.parametrize(("program", "clock"), [*virtual, *more(often), *more(others, NIGHTLY)])


@pytest.mark.breadth(1, 4)
@rows_of(plan)
@rows(EARLY, "beside a spinning thread")
def test_a_message_without_a_wait_is_early(trace: AssessedTrace, program: str, clock: str) -> None:
    """Only the first: those that come after a wait are heard."""
    assert trace.harness_problem == ""
    found = early(trace)
    assert found[0]
    assert not any(found[1:])


@rows_of(plan)
@rows(HEARD, "once there is a subscription")
def test_a_message_after_a_wait_is_not(trace: AssessedTrace, program: str, clock: str) -> None:
    """Whatever the program has waited for; and nothing is said of it."""
    assert trace.harness_problem == ""
    assert early(trace)
    assert not any(early(trace))
    assert notes_on_unheard(trace) == ()


def test_what_a_message_of_the_same_instant_causes_is_not_early(run: Callable[..., AssessedTrace]) -> None:
    """An answer in the instant in which everything begins: whoever gets a message has been discovered."""
    answering = """
    publisher = node.create_publisher(Int32, "/count", 10)
    node.create_subscription(Int32, "/asked", lambda m: send(m.data), 10)
    rclpy.spin(node)
    """
    asking = """
    publisher = node.create_publisher(Int32, "/asked", 10)
    send()
    rclpy.spin(node)
    """
    trace = run(answering, asking, clock="virtual")
    assert [(m.t_ns, m.before_discovery) for m in trace.messages("/count")] == [(0, False)]
    assert [(m.t_ns, m.before_discovery) for m in trace.messages("/asked")] == [(0, True)]


@pytest.mark.long
def test_a_found_server_is_a_wait(run: Callable[..., AssessedTrace]) -> None:
    """On a real clock the program itself is discovered meanwhile; in virtual time the server is there at once."""
    serving = """
    node.create_service(Trigger, "/own", lambda _, response: response)
    rclpy.spin(node)
    """
    asking = """
    publisher = node.create_publisher(Int32, "/count", 10)
    client = node.create_client(Trigger, "/own")
    client.wait_for_service()
    send()
    rclpy.spin(node)
    """
    assert early(run(serving, asking, clock="virtual")) == [False]


@pytest.mark.long
def test_long_work_is_a_wait(run: Callable[..., AssessedTrace]) -> None:
    """Virtual time stands still meanwhile, discovery would not."""
    working = """
    publisher = node.create_publisher(Int32, "/count", 10)
    began = time.process_time()
    while time.process_time() < began + 0.6:
        pass
    send()
    rclpy.spin(node)
    """
    assert early(run(working, clock="virtual")) == [False]


@CLOCKS
def test_all_of_a_burst_is_early(run: Callable[..., AssessedTrace], clock: str) -> None:
    """More than are sent between two reports."""
    program = MAKE + "for number in range(30):\n    send(number)\nrclpy.spin(node)"
    trace = run(program, clock=clock)
    assert len(early(trace)) == 30
    assert early(trace)[0]
    if clock == "virtual":
        assert all(early(trace))
    assert notes_on_unheard(trace)[0].startswith(
        "/count: all messages were" if all(early(trace)) else "/count: the first message"
    )


@pytest.mark.long
@pytest.mark.parametrize("paces", ["node.create_timer(9, send)", "node.create_rate(10)", "rclpy.spin_once(node)"])
def test_a_timer_begins_after_the_publishers_are_heard(run: Callable[..., AssessedTrace], paces: str) -> None:
    """On the wall clock a timer that began before would send late once and in time the next time."""
    program = """
    publisher, other = (node.create_publisher(Int32, topic, 10) for topic in ("/count", "/other"))
    node.create_guard_condition(lambda: None).trigger()
    PACES
    for one in (publisher, other):
        print(one.topic_name, one.get_subscription_count(), flush=True)
    send()
    rclpy.spin(node)
    """
    trace = run(program.replace("PACES", paces), clock="wall")
    lines = [seen for seen in trace.observations if isinstance(seen, OutputLine)]
    assert [line.text for line in lines if line.stream == "stdout"] == ["/count 1", "/other 1"]
