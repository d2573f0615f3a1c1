"""Closed loops run for as long as the scenario lasts, if their nodes rest between the messages; on real nodes."""

from pathlib import Path

import pytest
from places import REPORTED

from grader.runtime.model.trace import Trace
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import record

from grader.runtime.model.quantities import NS_PER_S

pytestmark = pytest.mark.ros

BEFORE = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import Int32

rclpy.init()
node = Node("loop")
"""
#: Hears what it publishes at 200 Hz.
ITSELF = """
publisher = node.create_publisher(Int32, "/n", 10)
node.create_subscription(Int32, "/n", lambda message: None, 10)
node.create_timer(0.005, lambda: publisher.publish(Int32(data=1)))
rclpy.spin(node)
"""
#: Two nodes that answer each other at once, without end.
SERVES = """
publisher = node.create_publisher(Int32, "/{mine}", 10)
node.create_subscription(Int32, "/{theirs}", lambda message: publisher.publish(message), 10)
timer = node.create_timer(0.1, lambda: (timer.cancel(), publisher.publish(Int32(data=1))))
rclpy.spin(node)
"""


def limits(trace: Trace) -> list[str]:
    """Return the limits that ended a recording."""
    return [mark.detail for mark in trace.marks("limit")]


@pytest.mark.nightly
def test_a_node_that_hears_itself_goes_on(session: RecordingSession, tmp_path: Path) -> None:
    """It takes more messages than nodes may take from each other without a rest, and rests between them."""
    trace = record(session, tmp_path / "s", BEFORE + ITSELF, duration_ns=24 * NS_PER_S)
    assert (limits(trace), len(trace.messages("/n"))) == ([], 4799)


@pytest.mark.nightly
def test_nodes_that_answer_each_other_without_a_rest_are_ended(session: RecordingSession, tmp_path: Path) -> None:
    """No time would ever pass."""
    both = [BEFORE + SERVES.format(mine=mine, theirs=theirs) for mine, theirs in ("ab", "ba")]
    trace = record(session, tmp_path / "s", *both, duration_ns=24 * NS_PER_S)
    assert trace.stop_ns < 2 * NS_PER_S
    assert len(limits(trace)) == 1


@pytest.mark.nightly
def test_a_robot_and_its_controller_go_on(session: RecordingSession, tmp_path: Path) -> None:
    """The controller answers each odometry of a robot that is simulated at 50 Hz."""
    both = [(REPORTED / "hops_loop" / name).read_text(encoding="utf-8") for name in ("robot.py", "controller.py")]
    trace = record(session, tmp_path / "s", *both, duration_ns=90 * NS_PER_S)
    assert limits(trace) == []
    assert min(len(trace.messages(topic)) for topic in {m.topic for m in trace.messages()}) > 4_000
