"""Lets time pass for programs that only look whether something has happened, and shows them one state of the graph."""

from __future__ import annotations

import functools
import sys
import weakref
from collections import Counter
from collections.abc import Callable
from types import FrameType
from typing import Any

import rclpy.client
import rclpy.context
import rclpy.executors
import rclpy.node
import rclpy.publisher
import rclpy.subscription
import rclpy.task
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from .clock import VirtualClock
from .endpoints import service_name
from .ros_state import RosState, see_whole_graph

#: The methods with which nodes query the whole graph.
GRAPH_LOOKS = (
    *("count_clients", "count_publishers", "count_services", "count_subscribers"),
    *("get_node_names", "get_node_names_and_namespaces", "get_node_names_and_namespaces_with_enclaves"),
    *("get_fully_qualified_node_names", "get_topic_names_and_types", "get_service_names_and_types"),
    *("get_publisher_names_and_types_by_node", "get_subscriber_names_and_types_by_node"),
    *("get_service_names_and_types_by_node", "get_client_names_and_types_by_node"),
    *("get_publishers_info_by_topic", "get_subscriptions_info_by_topic"),
)
#: Those behind the functions of rclpy.action that list the actions of the graph.
ACTION_LOOKS = (
    *("get_action_names_and_types", "get_action_client_names_and_types_by_node"),
    "get_action_server_names_and_types_by_node",
)
#: Checks whether a task has ended, without counting as a look, which would let time pass.
_DONE = rclpy.task.Future.done


def install_looks(clock: VirtualClock, ros: RosState, settle: Callable[[], None]) -> None:
    """Let time pass for programs that only poll whether something has happened.

    A program that queries the graph has to see its state at that instant, independent of real-time races.

    Args:
        clock: Counts the looks.
        ros: Knows whether the graph has changed.
        settle: Yields to the grader at the same instant.
    """

    def at_the_graph(*, whole: bool = False) -> None:
        if whole:
            see_whole_graph(ros, settle)
        elif ros.endpoints.changed:
            settle()

    def looking(cls: Any, name: str, before: Callable[[], None]) -> None:
        original = getattr(cls, name)

        @functools.wraps(original)
        def looked_at(self: Any, *args: Any, **kwargs: Any) -> Any:
            before()
            clock.idle_look()
            return original(self, *args, **kwargs)

        setattr(cls, name, looked_at)

    looking(rclpy.context.Context, "ok", lambda: None)
    looking(rclpy.task.Future, "done", lambda: None)
    looked_at = rclpy.task.Future.done

    def done(self: Any) -> bool:
        # Who asks decides: a program that asks in a loop waits for time to pass. An executor asks each of its tasks
        # whenever it looks for work; that says nothing about the program. Functions of the
        # host may stand between the two.
        caller: FrameType | None = sys._getframe(1)
        while caller is not None and caller.f_globals["__name__"].startswith(f"{__package__}."):
            caller = caller.f_back
        by_executor = caller is not None and caller.f_globals is vars(rclpy.executors)
        return bool(_DONE(self) if by_executor else looked_at(self))

    rclpy.task.Task.done = functools.wraps(_DONE)(done)
    _note_ended_tasks(clock)
    looking(rclpy.client.Client, "service_is_ready", at_the_graph)
    _note_found(ros, rclpy.client.Client, "service_is_ready")
    _install_counts(clock, at_the_graph)
    looking(_rclpy.ActionClient, "is_action_server_available", at_the_graph)
    _note_found(ros, _rclpy.ActionClient, "is_action_server_available")
    for owner, names in ((rclpy.node.Node, GRAPH_LOOKS), (_rclpy.Node, ACTION_LOOKS)):
        for name in names:
            looking(owner, name, lambda: at_the_graph(whole=True))
    for name in ("get_node_names_and_namespaces", "get_node_names_and_namespaces_with_enclaves"):
        _leave_out_gone_nodes(name)


def _note_found(ros: RosState, cls: Any, name: str) -> None:
    """Note that a program has found a server: on a real clock, this takes the time in which it is discovered itself."""
    look = getattr(cls, name)

    @functools.wraps(look)
    def looked(self: Any, *args: Any, **kwargs: Any) -> Any:
        found = look(self, *args, **kwargs)
        if isinstance(self, rclpy.client.Client):
            ros.note(lambda: f"{'finds' if found else 'misses'} request {service_name(self)}")
        if found:
            ros.outbox.note_waited()
        return found

    setattr(cls, name, looked)


def _leave_out_gone_nodes(name: str) -> None:
    """Let a method that lists nodes leave out those that have gone.

    rmw_fastrtps learns of a participant's nodes and of its end on two threads. If the end comes first, the nodes return
    for good. Each node that exists publishes the changes of its parameters.
    """
    listed = getattr(_rclpy.Node, name)

    @functools.wraps(listed)
    def existing(self: Any) -> Any:
        publishers = _rclpy.rclpy_get_publishers_info_by_topic(self, "/parameter_events", False)  # noqa: FBT003 - C++
        left = Counter((one["node_name"], one["node_namespace"]) for one in publishers)
        return [found for found in listed(self) if left[found[:2]] > 0 and not left.subtract([found[:2]])]

    setattr(_rclpy.Node, name, existing)


def _note_ended_tasks(clock: VirtualClock) -> None:
    """Count the tasks that end, but not those of callbacks: a timer without a period never stops calling its own."""
    create, complete = rclpy.executors.Executor.create_task, rclpy.task.Task._complete_task
    created: weakref.WeakSet[Any] = weakref.WeakSet()

    @functools.wraps(create)
    def noted(self: Any, *args: Any, **kwargs: Any) -> Any:
        task = create(self, *args, **kwargs)
        created.add(task)
        return task

    @functools.wraps(complete)
    def completed(self: Any) -> None:
        if self in created:
            clock.end_task()
        complete(self)

    rclpy.executors.Executor.create_task = noted
    rclpy.task.Task._complete_task = completed


def _install_counts(clock: VirtualClock, before: Callable[[], None]) -> None:
    """Let an endpoint count no counterparts at the instant at which it is created: discovery takes milliseconds."""
    created_ns: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()

    def counting(cls: Any, name: str) -> None:
        make, count = cls.__init__, getattr(cls, name)

        @functools.wraps(make)
        def made(self: Any, *args: Any, **kwargs: Any) -> None:
            make(self, *args, **kwargs)
            created_ns[self] = clock.now_ns

        @functools.wraps(count)
        def counted(self: Any) -> Any:
            before()
            clock.idle_look()
            found = count(self)
            return 0 if created_ns.get(self) == clock.now_ns else found

        cls.__init__ = made
        setattr(cls, name, counted)

    counting(rclpy.publisher.Publisher, "get_subscription_count")
    counting(rclpy.subscription.Subscription, "get_publisher_count")
