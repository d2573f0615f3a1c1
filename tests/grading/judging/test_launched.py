"""When a program that was not started may be why a criterion is not met, and when it may not."""

from __future__ import annotations

import pytest

from grader.grading.judging.checks.graph import NodeName
from grader.grading.judging.checks.rate import TopicRate
from grader.grading.judging.checks.topics import Publishes, Subscribes
from grader.grading.judging.launched import excuses
from grader.grading.model.exercise import Check
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import (
    ClockKind,
    Delivery,
    Endpoint,
    GraphSnapshot,
    Observation,
    Request,
    Response,
    ServiceEnd,
    Trace,
)

TWIST, TRIGGER = "geometry_msgs/msg/Twist", "std_srvs/srv/Trigger"
PUBLISHES: Check = Publishes(topic="/cmd_vel", type=TWIST)
RATE: Check = TopicRate(topic="/cmd_vel", rate=20.0, tolerance=1.0)
HEARS: Check = Subscribes(topic="/cmd_vel", type=TWIST)
NAMED: Check = NodeName(name="driver")

SENDS = Endpoint("publisher", "/cmd_vel", TWIST, "/driver", 1, "reliable", "volatile")
LISTENS = Endpoint("subscription", "/scan", "sensor_msgs/msg/LaserScan", "/driver", 1, "reliable", "volatile")
SCANS = Endpoint("publisher", "/scan", "sensor_msgs/msg/LaserScan", "/laser", 2, "reliable", "volatile")
FED = Delivery(0, "/scan", "sensor_msgs/msg/LaserScan", {})
CLIENT, SERVER = (ServiceEnd(kind, "/go", TRIGGER, "/driver") for kind in ("client", "service"))
ACTION = ServiceEnd("service", "/turn/_action/send_goal", "example_interfaces/action/Fibonacci_SendGoal", "/driver")
ASKED = Request(0, "/go", TRIGGER, 1, "grader", 1, {})
ANSWERED = Response(1, "/go", TRIGGER, 1, "grader", 1, {})


def may_explain(check: Check, unstarted: str, *parts: Observation | Endpoint | ServiceEnd) -> bool:
    ends = tuple(part for part in parts if isinstance(part, Endpoint))
    services = tuple(part for part in parts if isinstance(part, ServiceEnd))
    others = tuple(part for part in parts if not isinstance(part, (Endpoint, ServiceEnd)))
    graph = GraphSnapshot(0, ("/driver",), ends, services)
    trace = Trace(
        "s", ClockKind.VIRTUAL, NS_PER_S, (graph, *others), unstarted=(("a program was not started", unstarted),)
    )
    return bool(list(excuses(check, trace)))


ANY = ""


@pytest.mark.parametrize("check", [PUBLISHES, RATE])
def test_a_topic_of_the_student_s_own_node_is_its_own(check: Check) -> None:
    """Whatever else the launch file asks for."""
    assert not may_explain(check, ANY, SENDS)
    assert not may_explain(check, "/cmd_vel", SENDS)
    assert not may_explain(check, "/other", SENDS)


@pytest.mark.parametrize("check", [PUBLISHES, RATE])
def test_a_topic_that_nobody_publishes_may_be_the_other_program_s(check: Check) -> None:
    """Unless it is known to use another name."""
    assert may_explain(check, ANY)
    assert may_explain(check, "/cmd_vel")
    assert not may_explain(check, "/other")


def test_a_node_may_wait_for_the_other_program() -> None:
    """For messages or answers that nobody else sends."""
    assert may_explain(RATE, ANY, SENDS, LISTENS)
    assert may_explain(RATE, "/scan", SENDS, LISTENS)
    assert not may_explain(RATE, "/other", SENDS, LISTENS)
    for other in (SCANS, FED):
        assert not may_explain(RATE, ANY, SENDS, LISTENS, other)
        assert not may_explain(RATE, "/scan", SENDS, LISTENS, other)
    assert may_explain(RATE, ANY, SENDS, CLIENT)
    assert not may_explain(RATE, ANY, SENDS, CLIENT, ASKED, ANSWERED)


def test_a_server_may_wait_for_the_call_of_a_command() -> None:
    """Until somebody has called it; the same for an action."""
    assert may_explain(RATE, "/go", SENDS, SERVER)
    assert not may_explain(RATE, "/go", SENDS, SERVER, ASKED)
    assert not may_explain(RATE, "/stop", SENDS, SERVER)
    assert may_explain(RATE, "/turn", SENDS, ACTION)


def test_what_is_not_about_a_publisher_may_be_about_any_program() -> None:
    """A subscription or the name of a node."""
    assert may_explain(HEARS, ANY, SENDS)
    assert may_explain(NAMED, ANY, SENDS)
    assert not may_explain(NAMED, "/other", SENDS)
    assert may_explain(HEARS, "/cmd_vel", SENDS)


def test_what_may_change_the_nodes_themselves_explains_everything() -> None:
    """An action of a launch file that is not evaluated, for instance."""
    graph = GraphSnapshot(0, ("/driver",), (SENDS,))
    trace = Trace("s", ClockKind.VIRTUAL, NS_PER_S, (graph,), left_out=("the action X was left out",))
    assert list(excuses(RATE, trace)) == ["the action X was left out"]
