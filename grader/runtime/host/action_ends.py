"""The servers and clients of actions, which do not use rclpy's services and topics, and the queues that they have."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from . import originals
from .protocol import Claim, EndQos

#: The methods of a server and of a client that take something: for each the channel, and the index of its flag in the
#: result of `is_ready`.
TAKES = {
    "service": {
        "take_goal_request": ("request", "send_goal", 0),
        "take_cancel_request": ("request", "cancel_goal", 1),
        "take_result_request": ("request", "get_result", 2),
    },
    "client": {
        "take_feedback": ("topic", "feedback", 0),
        "take_status": ("topic", "status", 1),
        "take_goal_response": ("response", "send_goal", 2),
        "take_cancel_response": ("response", "cancel_goal", 3),
        "take_result_response": ("response", "get_result", 4),
    },
}
#: The methods that send something.
SENDS = {
    "service": {
        "send_goal_response": ("response", "send_goal"),
        "send_cancel_response": ("response", "cancel_goal"),
        "send_result_response": ("response", "get_result"),
        "publish_feedback": ("topic", "feedback"),
        "publish_status": ("topic", "status"),
    },
    "client": {
        "send_goal_request": ("request", "send_goal"),
        "send_cancel_request": ("request", "cancel_goal"),
        "send_result_request": ("request", "get_result"),
    },
}
#: The services and topics of an action in the graph; `{}` is the action's type.
SERVICES = {
    "send_goal": "{}_SendGoal",
    "get_result": "{}_GetResult",
    "cancel_goal": "action_msgs/srv/CancelGoal",
}
#: Checks whether a client has a server, without counting as a look, which would let time pass.
HAS_SERVER = _rclpy.ActionClient.is_action_server_available
#: The name of the class of a generated class: it holds the type support, by which ROS knows the type.
_GENERATED = "Metaclass_"
TOPICS = {"feedback": "{}_FeedbackMessage", "status": "action_msgs/msg/GoalStatusArray"}


def type_name(interface: object) -> str:
    """Return the ROS name of a message, service or action class, e.g. `geometry_msgs/msg/Twist`.

    A class of the student's own has the type of the generated class that it is derived from. So has a message: rclpy
    takes one in place of its class for everything but sending.
    """
    meta: type = type(interface if isinstance(interface, type) else type(interface))
    for generated in meta.__mro__:
        package, _, rest = generated.__module__.partition(".")
        if generated.__name__.startswith(_GENERATED) and rest:
            return f"{package}/{rest.partition('.')[0]}/{generated.__name__.removeprefix(_GENERATED)}"
    raise TypeError(f"expected a ROS type, found {interface!r}")


class Receiver:
    """One of the queues of an action's server or client.

    Args:
        end: The server or client that owns the queue.
        channel: What the queue receives, e.g. `request /count/_action/send_goal`.
        number: Index of its flag in the result of `is_ready`.
    """

    def __init__(self, end: ActionEnd, channel: str, number: int) -> None:
        self._end = end
        self._number = number
        self.channel = channel
        self.topic_name = channel.partition(" ")[2]
        #: The depth of the queue; for the status topic only the last message.
        self.depth = 1 if channel.endswith("/status") else 10

    @property
    def handle(self) -> Any:
        """The handle that rclpy takes messages from."""
        return self._end.handle

    def is_ready_within(self, seconds: float, new_wait_set: Callable[..., Any], context: Any) -> bool:
        """Wait, in real time, until something can be taken; return whether it can."""

        def is_ready() -> bool:
            with context.handle, self.handle:
                subscriptions, guards, timers, clients, services = self.handle.get_num_entities()
                wait_set = new_wait_set(subscriptions, guards, timers, clients, services, 0, context.handle)
                wait_set.clear_entities()
                self.handle.add_to_waitset(wait_set)
                wait_set.wait(0)
                return bool(self.handle.is_ready(wait_set)[self._number])

        return originals.wait_until(is_ready, seconds)


class ActionEnd:
    """The server or client of an action.

    Args:
        kind: `service` or `client`, the kind of its services.
        handle: The handle that rclpy uses.
        name: Absolute name of the action.
        interface: e.g. `test_msgs/action/Fibonacci`.
        freed: Called with this object when the program has freed the handle.
    """

    def __init__(self, kind: str, handle: Any, name: str, interface: str, freed: Callable[[ActionEnd], None]) -> None:
        self.kind = kind
        self._handle = weakref.ref(handle, lambda _: freed(self))
        self._interface = interface
        self._prefix = f"{name}/_action/"
        self.receivers = {
            method: Receiver(self, f"{channel} {self._prefix}{part}", number)
            for method, (channel, part, number) in TAKES[kind].items()
        }

    @property
    def handle(self) -> Any:
        """The handle that rclpy uses; None once the program has freed it, as it may without destroying it."""
        return self._handle()

    def channel(self, method: str) -> str:
        """Return the channel on which a method sends."""
        channel, part = SENDS[self.kind][method]
        return f"{channel} {self._prefix}{part}"

    def services(self) -> list[str]:
        """Return the names of its services."""
        return [f"{self._prefix}{part}" for part in SERVICES]

    def claims(self) -> list[Claim]:
        """Return its services and topics as claims for the grader."""
        services = [(self.kind, part, interface) for part, interface in SERVICES.items()]
        topic = "publisher" if self.kind == "service" else "subscription"
        topics = [(topic, part, interface) for part, interface in TOPICS.items()]
        return [
            Claim(
                kind,
                f"{self._prefix}{part}",
                interface.format(self._interface),
                qos=EndQos(reliable=True, latched=part == "status", deadline_ns=0, manual=False),
            )
            for kind, part, interface in services + topics
        ]
