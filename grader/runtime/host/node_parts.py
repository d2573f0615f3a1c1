"""What a node consists of, whatever methods and attributes its class has: they may hide those of `rclpy.node.Node`.

A class may call a method of its own `context` or `services`, or keep something of its own in `_parameters`. rclpy works
with it as long as it does not need that name itself, so the host must not need it either.
"""

from __future__ import annotations

from typing import Any

from rclpy.client import Client
from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rclpy.utilities import get_default_context

#: The attribute of a node that holds its ends of each kind.
_ENDS = {"_publishers": Publisher, "_subscriptions": Subscription, "_clients": Client, "_services": Service}
#: What tells of the publishers and subscriptions of a topic in the graph, without counting as a look of the program.
_LOOKS = {
    "publisher": _rclpy.rclpy_get_publishers_info_by_topic,
    "subscription": _rclpy.rclpy_get_subscriptions_info_by_topic,
}


def handle_of(node: Any) -> Any:
    """Return the handle of a node."""
    return node._Node__node  # the name that Python gives to `self.__node` in rclpy, and to none of another class


def context_of(node: Any) -> Context:
    """Return the context of a node; the default one if its attribute was overwritten."""
    found = vars(node).get("_context")
    return found if isinstance(found, Context) else get_default_context()


def name_of(node: Any) -> tuple[str, str]:
    """Return the name and the namespace of a node."""
    handle = handle_of(node)
    with handle:
        return str(handle.get_node_name()), str(handle.get_namespace())


def full_name_of(node: Any) -> str:
    """Return the name of a node with its namespace."""
    handle = handle_of(node)
    with handle:
        return str(handle.get_fully_qualified_name())


def publishers_of(node: Any) -> list[Any]:
    """Return the publishers of a node."""
    return _kept(node, "_publishers", Publisher)


def ends_of(node: Any) -> list[Any]:
    """Return the publishers, subscriptions, clients and services of a node."""
    return [end for attribute, kind in _ENDS.items() for end in _kept(node, attribute, kind)]


def seen_by(node: Any, kind: str, topic: str) -> list[Any]:
    """Return the publishers or subscriptions of a topic in the graph, as a node sees it.

    Args:
        node: The node.
        kind: `publisher` or `subscription`.
        topic: The resolved name of the topic.
    """
    handle = handle_of(node)
    with handle:
        return [TopicEndpointInfo(**one) for one in _LOOKS[kind](handle, topic, False)]  # noqa: FBT003 - C++


def declared_by(node: Any) -> dict[str, Parameter]:
    """Return the parameters that a node has declared, by their names."""
    found = vars(node).get("_parameters")
    if not isinstance(found, dict):
        return {}
    return {name: one for name, one in [*found.items()] if isinstance(one, Parameter) and isinstance(name, str)}


def _kept(node: Any, attribute: str, kind: type) -> list[Any]:
    found = vars(node).get(attribute)
    return [one for one in [*found] if isinstance(one, kind)] if isinstance(found, list) else []
