"""When a node that ends has left the graph: at once with a farewell, and by its lease without one, in virtual time."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import pytest

from grader.world.world import World

pytestmark = pytest.mark.ros

HEAD = """
import os, signal, sys
import rclpy
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import LivelinessPolicy, QoSProfile
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node(__file__.rpartition("/")[2][:-3])

def leased(seconds, **more):
    return QoSProfile(depth=10, liveliness_lease_duration=Duration(seconds=seconds), **more)
"""
#: Logs what it sees of a node's topic and service whenever that has changed, once a second from half a second on.
WATCHER = """
client, seen = node.create_client(Trigger, "/{0}/serve"), []

def look():
    now = node.count_publishers("/{0}/ticks"), client.service_is_ready(), "{0}" in node.get_node_names()
    if seen[-1:] != [now]:
        seen.append(now)
        node.get_logger().info(str(now))

node.create_timer(1.0, look)
"""
TICKER = """
ticks = node.create_publisher(Int32, "~/ticks", 10)
node.create_service(Trigger, "~/serve", lambda _, response: response)
node.create_timer(1.0, lambda: ticks.publish(Int32()))

def end():
    {}

node.create_timer(3.0, end)
"""
#: How programs end after three seconds, by the names of their nodes: those that leave then, and those that do not.
FAREWELL = {"returns": "rclpy.shutdown()", "leaves": "sys.exit(1)", "raises": "raise ValueError('over')"}
SILENT = {"exits": "os._exit(3)", "killed": "os.kill(os.getpid(), signal.SIGKILL)"}
THERE, GONE = str((1, True, True)), str((0, False, False))


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str], str]:
    """Write a node of a name, which spins, and return its path."""

    def written(name: str, text: str) -> str:
        path = tmp_path / f"{name}.py"
        path.write_text(f"{HEAD}{text}\nrclpy.spin(node)\n", encoding="utf-8")
        return str(path)

    return written


def test_who_says_farewell_leaves_at_once_and_who_does_not_by_the_lease(
    ros: World, write: Callable[[str, str], str]
) -> None:
    """As on the wall clock: Python's own endings say farewell, SIGKILL and os._exit do not, and the lease is 20 s."""
    names = [*FAREWELL, *SILENT, "stopped", "shot"]
    watchers = {name: ros.run(write(f"watcher_{name}", WATCHER.format(name))) for name in names}
    ros.advance(0.5)
    started = {name: ros.run(write(name, TICKER.format({**FAREWELL, **SILENT}.get(name, "pass")))) for name in names}
    ros.advance(2.5)
    with ros.expects_failure("over|SIGKILL"):
        ros.advance(0.5)
    started["stopped"].interrupt()
    started["shot"].kill()
    assert [name for name, program in started.items() if program.running] == []
    watching = {f"/watcher_{name}" for name in names}
    assert {*ros.nodes()} - watching == {"/exits", "/killed", "/shot"}
    ros.advance(19.999)
    assert {*ros.nodes()} - watching == {"/exits", "/killed", "/shot"}
    ros.advance(0.001)
    assert {*ros.nodes()} == watching
    ros.advance(1.0)
    for name, watcher in watchers.items():
        ended = 24.0 if name in ("exits", "killed", "shot") else 4.0
        assert [(log.t_ns / 1e9, log.text) for log in watcher.logs] == [(1.0, THERE), (ended, GONE)], name


def test_the_last_one_leaves_as_well(ros: World, write: Callable[[str, str], str]) -> None:
    """Though nobody is left who could see it; one that is killed by its lease."""
    first = ros.run(write("first", TICKER.format("pass")))
    ros.advance(1.5)
    first.interrupt()
    assert (ros.nodes(), ros.graph().endpoints) == ([], ())
    second = ros.run(write("second", TICKER.format("pass")))
    ros.advance(1.5)
    second.kill()
    ros.advance(19.9)
    assert ros.nodes() == ["/second"]
    ros.advance(0.1)
    assert (ros.nodes(), ros.graph().endpoints) == ([], ())


@pytest.mark.parametrize("ending", FAREWELL.values(), ids=FAREWELL)
def test_the_last_one_leaves_when_it_ends_by_itself(ros: World, write: Callable[[str, str], str], ending: str) -> None:
    """At the moment at which its program ends."""
    program = ros.run(write("alone", TICKER.format(ending)))
    ros.advance(2.5)
    assert ros.nodes() == ["/alone"]
    with ros.expects_failure() if "raise" in ending else nullcontext():
        ros.advance(0.5)
    assert not program.running
    assert (ros.nodes(), ros.graph().endpoints, ros.graph().services) == ([], (), ())


def test_a_node_that_is_shut_down_stays_while_its_program_runs(ros: World, write: Callable[[str, str], str]) -> None:
    """As other programs see it on the wall clock: rclpy.shutdown() destroys no node."""
    path = Path(write("lasting", TICKER.format("rclpy.shutdown()")))
    path.write_text(f"{path.read_text(encoding='utf-8')}import time\ntime.sleep(5.0)\n", encoding="utf-8")
    ros.run(path)
    ros.advance(7.9)
    assert ros.nodes() == ["/lasting"]
    ros.advance(0.1)
    assert ros.nodes() == []


def test_who_comes_after_the_end_never_hears_of_the_dead(ros: World, write: Callable[[str, str], str]) -> None:
    """And whoever was there counts both, until the lease of the first one ends."""
    ticker = write("ticker", TICKER.format("pass"))
    early = ros.run(write("early", WATCHER.format("ticker")))
    first = ros.run(ticker)
    ros.advance(2.5)
    first.kill()
    ros.advance(1.0)
    late = ros.run(write("late", WATCHER.format("ticker")))
    ros.advance(1.5)
    second = ros.run(ticker)
    ros.advance(1.0)
    second.interrupt()
    ros.advance(30.0)
    none, two = GONE, str((2, True, True))
    assert [(log.t_ns / 1e9, log.text) for log in early.logs] == [(1.0, THERE), (6.0, two), (7.0, THERE), (23.0, none)]
    assert [(log.t_ns / 1e9, log.text) for log in late.logs] == [(4.5, none), (5.5, THERE), (6.5, none)]
    assert ros.nodes() == ["/early", "/late"]
    ros.close()
    assert (ros.problem, ros.trace().notes) == ("", ())


LISTENER = """
def changed(event):
    node.get_logger().info(f"{event.alive_count} {event.not_alive_count}"
                           f" {event.alive_count_change} {event.not_alive_count_change}")

events = SubscriptionEventCallbacks(liveliness=changed)
node.create_subscription(Int32, "/x", lambda _: None, leased(%s), event_callbacks=events)
"""


def test_a_subscription_hears_that_its_publisher_is_dead_by_its_own_lease(
    ros: World, write: Callable[[str, str], str]
) -> None:
    """As on the wall clock: not that of the publisher, which is just gone where it has left the graph before that."""
    listeners = {lease: ros.run(write(f"listener_{lease}", LISTENER % lease)) for lease in (1, 3, 25)}
    ros.advance(0.5)
    alive = ros.run(write("alive", 'node.create_publisher(Int32, "/x", leased(1))'))
    ros.advance(1.0)
    alive.interrupt()
    ros.advance(1.0)
    ros.run(write("dead", 'node.create_publisher(Int32, "/x", leased(1))')).kill()
    ros.advance(30.0)
    leaves = [(0.5, "1 0 1 0"), (1.5, "0 0 -1 0"), (2.5, "1 0 1 0")]
    assert {lease: [(log.t_ns / 1e9, log.text) for log in p.logs] for lease, p in listeners.items()} == {
        1: [*leaves, (3.5, "0 1 -1 1"), (22.5, "0 0 0 -1")],
        3: [*leaves, (5.5, "0 1 -1 1"), (22.5, "0 0 0 -1")],
        25: [*leaves, (22.5, "0 0 -1 0")],
    }
