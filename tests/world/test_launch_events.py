"""What a launch file does while its nodes run, in stepped runs with real nodes: respawn, event handlers, shutdown."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.world.errors import ProgramFailed
from grader.world.opening import Worlds
from grader.world.world import World

pytestmark = pytest.mark.ros

NODE = """
import rclpy
from std_msgs.msg import Int32

rclpy.init()
node = rclpy.create_node("{name}")
ticks = node.create_publisher(Int32, "/{name}", 10)
count = 0


def tick():
    global count
    count += 1
    ticks.publish(Int32(data=count))
    {then}


node.create_timer(1.0, tick)
try:
    rclpy.spin(node)
except KeyboardInterrupt:
    node.get_logger().info("interrupted")
"""
#: A node for each way to go on after three seconds.
NODES = {
    "steady": "pass",
    "crasher": "if count == 3: raise ValueError('worn out')",
    "leaver": "if count == 3: raise SystemExit(0)",
    "dier": "if count == 3: import os; os._exit(7)",
}
LAUNCH = """
from launch import LaunchDescription
from launch.actions import EmitEvent, LogInfo, RegisterEventHandler, Shutdown, TimerAction
from launch.event_handlers import OnExecutionComplete, OnProcessExit, OnProcessStart, OnShutdown
from launch.events import Shutdown as ShutdownEvent
from launch_ros.actions import Node


def of(name, **more):
    return Node(package="here", executable=f"{{name}}.py", **more)


def generate_launch_description():
    steady, crasher, leaver, dier = map(of, ("steady", "crasher", "leaver", "dier"))
    return LaunchDescription([{actions}])
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the nodes."""
    for name, then in NODES.items():
        (tmp_path / f"{name}.py").write_text(NODE.format(name=name, then=then))
    return tmp_path


def launched(ros: World, folder: Path, actions: str) -> None:
    (folder / "it.launch.py").write_text(LAUNCH.format(actions=actions))
    ros.launch("it.launch.py")


def ended(ros: World) -> dict[str, int | None]:
    return {program.name: program.exit_code for program in ros.programs}


def times(ros: World, topic: str) -> list[float]:
    return [message.t_ns / 1e9 for message in ros.trace().messages(topic)]


def test_a_node_that_has_crashed_is_started_again(ros_session: Worlds, folder: Path) -> None:
    """After its delay, with a new process, for whatever reason it has ended, and as often as the file says."""
    with ros_session.open(folder) as ros:
        with ros.expects_failure("worn out"):
            launched(ros, folder, "of('crasher', respawn=True, respawn_delay=2.0, respawn_max_retries=2)")
            ros.advance(4.0)
            assert ended(ros) == {"crasher.py": 1}
            ros.advance(1.0)
            assert ended(ros) == {"crasher.py": 1, "crasher.py (2)": None}
            ros.advance(20.0)
        assert ended(ros) == {"crasher.py": 1, "crasher.py (2)": 1, "crasher.py (3)": 1}
        assert times(ros, "/crasher") == [1.0, 2.0, 3.0, 6.0, 7.0, 8.0, 11.0, 12.0, 13.0]
        assert ros.remarks == []


def test_a_node_that_crashes_fails_a_test_that_does_not_expect_it(ros_session: Worlds, folder: Path) -> None:
    """Though it is started again."""
    with ros_session.open(folder) as ros:
        launched(ros, folder, "of('crasher', respawn=True)")
        with pytest.raises(ProgramFailed, match="worn out"):
            ros.advance(10.0)


@pytest.mark.parametrize("how", ["kill", "interrupt", "exit"])
def test_a_node_is_started_again_however_it_has_ended(ros_session: Worlds, folder: Path, how: str) -> None:
    """At once, where no delay is given."""
    with ros_session.open(folder) as ros:
        launched(ros, folder, f"of('{'leaver' if how == 'exit' else 'steady'}', respawn=True)")
        (first,) = ros.programs
        ros.advance(1.5 if how != "exit" else 3.0)
        if how != "exit":
            getattr(first, how)()
            ros.settle()
        _, second = ros.programs
        assert (first.running, second.running) == (False, True)
        ros.advance(1.0)
        assert ros.messages(f"/{'leaver' if how == 'exit' else 'steady'}")[-1].data == 1


def test_a_node_that_fails_at_once_is_not_started_again_for_ever(ros_session: Worlds, folder: Path) -> None:
    """ROS does, where a start takes time; here it takes none."""
    (folder / "broken.py").write_text("raise SystemExit(3)\n")
    with ros_session.open(folder) as ros:
        launched(ros, folder, "of('broken', respawn=True), steady")
        ros.advance(2.0)
        assert len(ros.programs) == 102
        assert len(ros.messages("/steady")) == 2
    assert "it.launch.py: nodes were started again 100 times, and are not any more" in ros.trace().notes


#: What is registered beside the node that leaves after three seconds, and when the steady node then sends.
STARTED = {
    "RegisterEventHandler(OnProcessExit(target_action=leaver, on_exit=[LogInfo(msg='over'), steady]))": [4, 5],
    "RegisterEventHandler(OnProcessExit(on_exit=[TimerAction(period=1.0, actions=[steady])]))": [5],
    "RegisterEventHandler(OnExecutionComplete(target_action=leaver, on_completion=[steady]))": [4, 5],
    "RegisterEventHandler(OnProcessStart(target_action=leaver, on_start=[steady]))": [1, 2, 3, 4, 5],
    "RegisterEventHandler(OnProcessStart(target_action=steady, on_start=[crasher]))": [],
}


@pytest.mark.parametrize(("handler", "sent"), STARTED.items(), ids=STARTED)
def test_a_node_starts_when_another_one_has_started_or_ended(
    ros_session: Worlds, folder: Path, handler: str, sent: list[int]
) -> None:
    """At that moment, or after a timer."""
    with ros_session.open(folder) as ros:
        launched(ros, folder, f"leaver, {handler}")
        ros.advance(5.5)
        assert times(ros, "/steady") == sent
        assert ended(ros) == {"leaver.py": 0, **({"steady.py": None} if sent else {})}
        assert ros.remarks == []


#: What ends the launch file after three seconds; by the action in place of `leaver`.
ENDING = {
    "of('leaver', on_exit=Shutdown())": 3.0,
    "of('dier', on_exit=[Shutdown(reason='dead')])": 3.0,
    "of('leaver', respawn=True, on_exit=Shutdown())": 3.0,
    "leaver, RegisterEventHandler(OnProcessExit(on_exit=EmitEvent(event=ShutdownEvent(reason='over'))))": 3.0,
    "TimerAction(period=3.0, actions=[Shutdown()])": 3.0,
}


@pytest.mark.parametrize(("what", "at"), ENDING.items(), ids=ENDING)
def test_a_shutdown_stops_all_nodes(ros_session: Worlds, folder: Path, what: str, at: float) -> None:
    """With Ctrl-C; nothing is started afterwards, neither by a timer nor again."""
    with ros_session.open(folder) as ros:
        later = "TimerAction(period=4.0, actions=[of('steady')])"
        launched(ros, folder, f"of('steady', respawn=True), {later}, {what}")
        steady = ros.programs[0]
        ros.advance(30.0)
        assert [(log.t_ns / 1e9, log.text) for log in steady.logs] == [(at, "interrupted")]
        assert steady.exit_code == 0
        assert not any(program.running for program in ros.programs)
        assert len(ros.programs) <= 2
        assert ros.nodes() == []


def test_a_node_that_ignores_the_stop_signal_is_killed(ros_session: Worlds, folder: Path) -> None:
    """Ten seconds later, as launch does."""
    stubborn = "import signal, time\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\nwhile True: time.sleep(1.0)\n"
    (folder / "stubborn.py").write_text(stubborn)
    with ros_session.open(folder) as ros:
        launched(ros, folder, "of('stubborn'), of('leaver', on_exit=Shutdown())")
        stubborn_program = ros.programs[0]
        ros.advance(12.9)
        assert stubborn_program.running
        ros.advance(0.1)
        assert not stubborn_program.running


def test_a_handler_of_the_shutdown_may_start_a_node(ros_session: Worlds, folder: Path) -> None:
    """As in launch, where nobody stops it then."""
    with ros_session.open(folder) as ros:
        save = "RegisterEventHandler(OnShutdown(on_shutdown=[LogInfo(msg='saving'), of('steady')]))"
        launched(ros, folder, f"steady, {save}, of('leaver', on_exit=Shutdown())")
        ros.advance(5.0)
        assert ended(ros) == {"steady.py": 0, "leaver.py": 0, "steady.py (2)": None}


def test_a_launch_file_in_xml_starts_its_nodes_again(ros_session: Worlds, folder: Path) -> None:
    """With its attributes; one node is required."""
    (folder / "it.launch.xml").write_text(
        "<launch><node pkg='here' exec='leaver.py' respawn='true' respawn_delay='1' respawn_max_retries='1'/>"
        "<node pkg='here' exec='steady.py'/><timer period='10'><shutdown reason='over'/></timer></launch>"
    )
    with ros_session.open(folder) as ros:
        ros.launch("it.launch.xml")
        ros.advance(9.0)
        assert ended(ros) == {"leaver.py": 0, "steady.py": None, "leaver.py (2)": 0}
        ros.advance(1.0)
        assert ended(ros)["steady.py"] == 0


@pytest.mark.long
def test_the_wall_clock_does_the_same(ros_session: Worlds, folder: Path) -> None:
    """In real time: a node is started again, another one when it has ended for good, and all is shut down."""
    with ros_session.open(folder, clock="wall") as ros:
        then = "RegisterEventHandler(OnExecutionComplete(target_action=again, on_completion=[Shutdown()]))"
        launched(ros, folder, f"steady, *[again := of('leaver', respawn=True, respawn_max_retries=1), {then}]")
        ros.wait_until(lambda: not any(program.running for program in ros.programs), timeout=60.0)
        assert ended(ros) == {"steady.py": 0, "leaver.py": 0, "leaver.py (2)": 0}
        assert [message.data for message in ros.messages("/leaver")] == [1, 2, 3, 1, 2, 3]
