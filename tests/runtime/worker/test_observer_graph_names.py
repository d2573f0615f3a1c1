"""What the grader's node takes for the graph while names come and go."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs rclpy")
from rclpy.qos import QoSProfile

from grader.runtime.worker.observer import Observer

pytestmark = pytest.mark.ros
UNKNOWN = "_NODE_NAME_UNKNOWN_"


def info(node: str, number: int) -> Any:
    """What rclpy tells of an endpoint."""
    space = UNKNOWN if node == UNKNOWN else "/"
    gid = bytes([number] * 12) + bytes(12)
    qos = QoSProfile(depth=10)
    return SimpleNamespace(
        node_name=node, node_namespace=space, endpoint_gid=gid, qos_profile=qos, topic_type="std_msgs/msg/Float32"
    )


def observer(publishers: list[Any], nodes: list[tuple[str, str]]) -> Observer:
    """An observer that sees a graph without joining any."""
    found: Observer = Observer.__new__(Observer)
    found._names, found._participants = {"_observer_1"}, {}
    found.node = SimpleNamespace(
        get_node_names_and_namespaces=lambda: nodes,
        get_topic_names_and_types=lambda: [("/fan_speed", ["std_msgs/msg/Float32"])],
        get_publishers_info_by_topic=lambda _: publishers,
        get_subscriptions_info_by_topic=lambda _: [],
        get_publisher_names_and_types_by_node=lambda name, _: [p.topic_type for p in publishers if p.node_name == name],
    )
    return found


def test_an_endpoint_whose_node_has_no_name_yet_is_not_there_yet() -> None:
    """No report draws a node that rclpy has no name for."""
    seen = observer([info("fan_controller", 1), info(UNKNOWN, 2)], [("fan_controller", "/"), (UNKNOWN, UNKNOWN)])
    graph = seen.graph(0)
    assert [e.node for e in graph.endpoints] == ["/fan_controller"]
    assert graph.nodes == ("/fan_controller",)
    assert seen.unnamed == {("publisher", "/fan_speed", "std_msgs/msg/Float32"): 1}


def test_an_endpoint_is_there_as_soon_as_its_node_has_a_name() -> None:
    """Both of two nodes, in order."""
    graph = observer([info("b", 2), info("a", 1)], [("b", "/"), ("a", "/")]).graph(0)
    assert [e.node for e in graph.endpoints] == ["/a", "/b"]


def test_a_node_that_returns_after_its_participant_has_left_is_not_there() -> None:
    """It has no endpoint; a node that has none yet is there if it is known to exist."""
    seen = observer([info("new", 1)], [("new", "/"), ("gone", "/"), ("young", "/")])
    assert seen.graph(0).nodes == ("/gone", "/new", "/young")
    assert seen.graph(0, existing={"/young"}).nodes == ("/new", "/young")
    assert seen.students_nodes({"/young"}) == ["/new", "/young"]
    seen.node.get_service_names_and_types = list
    seen.node.count_publishers = seen.node.count_subscribers = lambda _: 0
    assert [name for name in seen.counts() if name.startswith("node ")] == ["node /new"]
