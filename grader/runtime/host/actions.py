"""Counts the traffic of actions, whose servers and clients do not use rclpy's services and topics."""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from .action_ends import SENDS, TAKES, ActionEnd, type_name
from .clock import VirtualClock
from .ros_state import RosState

#: A function that sends a message on a channel from a handle, and counts it.
Counted = Callable[[str, Any, Callable[[], Any]], Any]


def install_actions(
    ros: RosState, clock: VirtualClock, counted: Counted, *, settle: Callable[[], None], leave: Callable[[], None]
) -> None:
    """Count what servers and clients of actions send and take; `settle` and `leave` as for `install_traffic`."""
    for kind, cls in (("service", _rclpy.ActionServer), ("client", _rclpy.ActionClient)):
        _register(kind, cls, ros, settle, leave)
        for method in TAKES[kind]:
            setattr(cls, method, _counting_take(getattr(cls, method), method, ros, clock))
        for method in SENDS[kind]:
            setattr(cls, method, _counting_send(getattr(cls, method), method, ros, counted))


def _register(kind: str, cls: Any, ros: RosState, settle: Callable[[], None], leave: Callable[[], None]) -> None:
    make, destroy = cls.__init__, cls.destroy_when_not_in_use
    #: A server's timer reads the clock of its node, which a program frees at once with its node and server.
    clocks: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()

    def forgotten(end: ActionEnd) -> None:
        ros.endpoints.forget_action(end)
        for receiver in end.receivers.values():
            ros.inbox.forget(receiver)

    def made(self: Any, node: Any, *arguments: Any) -> None:
        if ros.endpoints.removed:
            settle()
        make(self, node, *arguments)
        # the first argument of a server is the clock of its node
        if kind == "service":
            clocks[self] = arguments[0]
        interface, name = arguments[1:3] if kind == "service" else arguments[:2]
        resolved = _rclpy.rclpy_resolve_name(node, name, False, False)  # noqa: FBT003 - C++
        ros.endpoints.add_action(ActionEnd(kind, self, resolved, type_name(interface), forgotten))

    def destroyed(self: Any) -> None:
        leave()
        if (end := ros.endpoints.action(self)) is not None:
            forgotten(end)
        destroy(self)

    cls.__init__ = functools.wraps(make)(made)
    cls.destroy_when_not_in_use = functools.wraps(destroy)(destroyed)


def _counting_take(take: Any, method: str, ros: RosState, clock: VirtualClock) -> Any:
    def counting(self: Any, *arguments: Any) -> Any:
        clock.busy()
        taken = take(self, *arguments)
        end = ros.endpoints.action(self)
        if end is not None:
            ros.inbox.took(end.receivers[method])
        return taken

    return counting


def _counting_send(send: Any, method: str, ros: RosState, counted: Counted) -> Any:
    def counting(self: Any, *arguments: Any) -> Any:
        end = ros.endpoints.action(self)
        if end is None:
            return send(self, *arguments)
        return counted(end.channel(method), self, lambda: send(self, *arguments))

    return counting
