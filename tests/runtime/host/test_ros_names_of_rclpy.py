"""The names below rclpy's documented interface that the grader relies on: each exists in the installed release.

What they do is tested by programs that run on real nodes. This test only tells, in a second and by name, what a new
release of ROS has renamed. docs/explanation/rules.md lists the same names.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from places import ROOT

pytest.importorskip("rclpy", reason="needs rclpy")

#: Where rclpy keeps its classes that are written in C++.
BINDINGS = "rclpy.impl.implementation_singleton"

#: Module, or class in a module -> private or undocumented names.
PYTHON = {
    "rclpy.clock:Clock": ("__new__", "handle", "now", "sleep_until"),
    "rclpy.clock:ROSClock": ("_set_ros_time_is_active", "set_ros_time_override"),
    "rclpy.context:Context": ("handle", "ok", "shutdown", "try_shutdown"),
    "rclpy.executors": ("Timer", "await_or_execute"),
    "rclpy.executors:Executor": (
        *("_take_subscription", "_take_client", "_take_service", "_take_timer"),
        *("_wait_for_ready_callbacks", "create_task"),
    ),
    "rclpy.guard_condition:GuardCondition": ("handle", "trigger"),
    "rclpy.impl.rcutils_logger": ("inspect", "_find_caller", "_internal_callers"),
    "rclpy.impl.rcutils_logger:Throttle": ("params",),
    "rclpy.impl.rcutils_logger:CallerId": ("__new__",),
    "rclpy.logging": ("initialize",),
    "rclpy.publisher:Publisher": ("handle", "destroy"),
    "rclpy.subscription:Subscription": ("CallbackType", "handle", "destroy"),
    "rclpy.subscription:Subscription.CallbackType": ("MessageOnly",),
    "rclpy.client:Client": ("handle", "destroy"),
    "rclpy.service:Service": ("handle", "destroy", "send_response"),
    "rclpy.task:Task": ("_complete_task",),
}
#: Attributes that exist only in instances -> the class whose source assigns them.
ASSIGNED = {
    "_clock": "rclpy.clock:JumpHandle",
    "_clock_type": "rclpy.clock:Clock",
    "__clock": "rclpy.clock:Clock",
    "_time_handle": "rclpy.time:Time",
    "_callback_type": "rclpy.subscription:Subscription",
    "_executor_event": "rclpy.service:Service",
    "event_handlers": "rclpy.publisher:Publisher",
    "event_type": "rclpy.event_handler:EventHandler",
    "_parameters": "rclpy.node:Node",
    "_context": "rclpy.node:Node",
    "_publishers": "rclpy.node:Node",
    "_subscriptions": "rclpy.node:Node",
    "_clients": "rclpy.node:Node",
    "_services": "rclpy.node:Node",
    "__node": "rclpy.node:Node",
    "_guard": "rclpy.executors:Executor",
    "_tasks": "rclpy.executors:Executor",
}
#: Class written in C++ -> its methods and attributes; the empty name stands for functions and bare classes.
CPP = {
    "": (
        *("ActionClient", "ActionServer", "Clock", "ClockType", "EventHandle", "EventsExecutor", "InvalidHandle"),
        *("LifecycleStateMachine", "Node", "RCLError"),
        *(
            "SignalHandlerOptions",
            "WaitSet",
            "get_current_signal_handlers_options",
            "rclpy_get_service_names_and_types",
            "rclpy_get_publishers_info_by_topic",
            "rclpy_get_subscriptions_info_by_topic",
            "rmw_liveliness_changed_status_t",
        ),
        *(
            "rclpy_get_topic_names_and_types",
            "rclpy_logging_rcutils_log",
            "rclpy_logging_shutdown",
            "rclpy_resolve_name",
        ),
    ),
    "Clock": ("set_ros_time_override", "set_ros_time_override_is_enabled"),
    "WaitSet": (
        *("add_client", "add_event", "add_guard_condition", "add_service", "add_subscription", "add_timer"),
        *("clear_entities", "get_ready_entities", "is_ready", "wait"),
    ),
    "Timer": ("time_until_next_call",),
    "Node": (
        *("get_action_client_names_and_types_by_node", "get_action_names_and_types"),
        *("get_action_server_names_and_types_by_node", "get_count_clients"),
        *("get_node_names_and_namespaces", "get_node_names_and_namespaces_with_enclaves"),
    ),
    "Publisher": ("get_subscription_count", "get_topic_name"),
    "Subscription": ("get_publisher_count", "get_topic_name", "pointer", "take_message"),
    "EventHandle": ("__init__", "take_event"),
    "GuardCondition": ("pointer",),
    "Client": ("pointer", "send_request", "service_server_is_available", "take_response"),
    "Service": ("pointer", "service_take_request"),
    "LifecycleStateMachine": ("service_change_state", "trigger_transition_by_id", "trigger_transition_by_label"),
    "ActionServer": (
        *("add_to_waitset", "destroy_when_not_in_use", "get_num_entities", "is_ready", "publish_feedback"),
        *("publish_status", "send_cancel_response", "send_goal_response", "send_result_response"),
        *("take_cancel_request", "take_goal_request", "take_result_request"),
    ),
    "ActionClient": (
        *("add_to_waitset", "destroy_when_not_in_use", "get_num_entities", "is_action_server_available", "is_ready"),
        *("send_cancel_request", "send_goal_request", "send_result_request", "take_cancel_response", "take_feedback"),
        *("take_goal_response", "take_result_response", "take_status"),
    ),
}


def found(place: str) -> type[Any] | types.ModuleType:
    """Return a module, or a class in one."""
    module, _, path = place.partition(":")
    value = importlib.import_module(module)
    for name in filter(None, path.split(".")):
        value = getattr(value, name)
    return value


def bindings() -> Any:
    """Return the module written in C++, as rclpy loads it."""
    return importlib.import_module(BINDINGS).rclpy_implementation


@pytest.mark.parametrize(("place", "name"), [(place, name) for place, names in PYTHON.items() for name in names])
def test_a_name_in_python_exists(place: str, name: str) -> None:
    """In the release that is installed."""
    assert hasattr(found(place), name)


@pytest.mark.parametrize(("name", "place"), ASSIGNED.items())
def test_an_attribute_of_instances_is_assigned(name: str, place: str) -> None:
    """No node is made to see it."""
    assert f"self.{name}" in inspect.getsource(found(place))


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, names in CPP.items() for name in names])
def test_a_name_in_cpp_exists(kind: str, name: str) -> None:
    """It has no source to look at and no promise to be kept."""
    assert hasattr(getattr(bindings(), kind) if kind else bindings(), name)


def test_a_wait_set_can_be_derived_from() -> None:
    """Virtual time stands on a subclass with the constructor and the methods of the original."""
    assert type("Derived", (bindings().WaitSet,), {}).__mro__[1] is bindings().WaitSet


def names_used(path: Path) -> Iterator[str]:
    """Yield what a file reads of the bindings, and the private attributes of anything that is not its own."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    own = {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute) and ast.unparse(n.value) in ("self", "cls")}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            owner = ast.unparse(node.value)
            private = node.attr.startswith("_") and not node.attr.endswith("__") and node.attr not in own
            if owner in ("_rclpy", "rclpy_implementation") or private:
                yield node.attr


#: The modules of the host that use rclpy's names.
USERS = (
    *("ros", "ros_clocks", "wait_set", "traffic", "lifetimes", "looks", "endpoints", "inbox", "outbox", "seen_graph"),
    *("qos", "events", "actions", "action_ends", "link", "wall"),
)


@pytest.mark.parametrize("file", USERS)
def test_the_tables_hold_what_the_host_uses(file: str) -> None:
    """A new use of a private name has to be entered."""
    known = {name for table in (PYTHON, CPP) for names in table.values() for name in names} | set(ASSIGNED)
    # how Python spells `__clock` from outside; the other three are documented
    known |= {"_Clock__clock", "_exit", "_getframe", "_replace"}
    assert set(names_used(ROOT / f"grader/runtime/host/{file}.py")) <= known


def test_the_tables_hold_what_the_host_takes_and_sends() -> None:
    """The host wraps the methods of actions by name."""
    actions = importlib.import_module("grader.runtime.host.action_ends")
    for table in (actions.TAKES, actions.SENDS):
        assert table["service"].keys() <= set(CPP["ActionServer"])
        assert table["client"].keys() <= set(CPP["ActionClient"])


def test_the_names_are_in_the_documents() -> None:
    """Who takes over reads there what a new release may break."""
    text = (ROOT / "docs/explanation/rules.md").read_text(encoding="utf-8")
    names = {name for names in PYTHON.values() for name in names} | set(ASSIGNED) | set(CPP[""])
    known = {"Clock", "ClockType"}  # the bindings of rclpy.clock's own
    assert [name for name in sorted(names - known) if not re.search(rf"\b{name}`", text)] == []
