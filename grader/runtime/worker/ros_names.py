"""Checks names that students' nodes choose by ROS's rules, and asks the middleware about them without failing."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, TypeVar

#: The longest name of a topic or service, and of a node with its namespace: RMW_TOPIC_MAX_NAME_LENGTH, and below the
#: sum of RMW_NAMESPACE_MAX_LENGTH and RMW_NODE_NAME_MAX_NAME_LENGTH of rmw.
LONGEST, LONGEST_NODE = 247, 300
#: The rules of rmw_validate_full_topic_name: absolute, no empty part, no part that begins with a digit.
_NAME = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+")
Answer = TypeVar("Answer")


def is_name(name: Any) -> bool:
    """Return whether a value is the absolute name of a topic or a service that ROS accepts."""
    return isinstance(name, str) and len(name) <= LONGEST and _NAME.fullmatch(name) is not None


def is_node_name(name: Any) -> bool:
    """Return whether a value is the absolute name of a node."""
    return isinstance(name, str) and len(name) <= LONGEST_NODE and _NAME.fullmatch(name) is not None


def asked(question: Callable[..., Answer], *names: Any, nothing: Answer) -> Answer:
    """Ask rcl about names in the graph; return `nothing` if it refuses one.

    It refuses names that break its rules and names of nodes that are gone; its exceptions for that differ between
    functions and releases. Raw DDS packets can put any name into the graph.
    """
    try:
        return question(*names)
    except Exception:
        return nothing


def ask_for_all(question: Callable[[], list[Answer]]) -> list[Answer]:
    """Ask rcl for everything in the graph; nothing if a name in it is not text. Other failures are the grader's own."""
    try:
        return question()
    except UnicodeDecodeError:
        return []
