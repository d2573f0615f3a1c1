"""Converts between ordinary ROS messages and what passes to and from a worker: types by name, and serialized bytes.

It runs in the process that steps a run, and for the messages of a rubric's test in the worker. It needs no rclpy
context, no node and no ROS domain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from grader.runtime.host.quick_imports import import_without_needless
from grader.runtime.message_classes import interface_class, message_class, plain_fields
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.trace import Delivery, Message
from grader.runtime.padding import without_padding

import_without_needless("rosidl_generator_py")  # which takes as long as the rest, and warns of a deprecated module
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy  # noqa: E402
from rclpy.qos import QoSProfile as QoSProfile  # noqa: E402, PLC0414 - whoever publishes may give one
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402

#: The kinds of interfaces.
_KINDS = {"msg": "message", "srv": "service", "action": "action"}


def message_type_name(kind: Any, *wanted: str) -> str:
    """Return the name of a message, service or action type, such as `std_msgs/msg/String`.

    Args:
        kind: Its class, or that of a request, a response, a goal or a result.
        wanted: The kinds of interfaces that it may be of, `msg`, `srv` or `action`; any without one.

    Raises:
        TypeError: It is the class of no such interface.
    """
    parts = getattr(kind, "__module__", "").split(".")
    name = getattr(kind, "__name__", "")
    if not isinstance(kind, type) or len(parts) < 2 or parts[1] not in (wanted or _KINDS):
        shown = name or type(kind).__name__
        kinds = " or ".join(_KINDS[one] for one in wanted or _KINDS)
        raise TypeError(f"expected the class of a ROS {kinds}, found {shown}")
    return f"{parts[0]}/{parts[1]}/{name if parts[1] == 'msg' else name.partition('_')[0]}"


def serialized(message: Any, where: str) -> tuple[str, bytes]:
    """Return type and bytes of a message; raises TypeError for anything else."""
    if isinstance(message, type):
        raise TypeError(f"{where}: expected a message, found the class {message.__name__}; write {message.__name__}()")
    try:
        interface = message_type_name(type(message), "msg")
    except TypeError:
        raise TypeError(f"{where}: expected a ROS message, found {type(message).__name__}") from None
    return interface, bytes_of(message)


def bytes_of(message: Any) -> bytes:
    """Return the bytes of a message, or of a part of a service or action."""
    return without_padding(bytes(serialize_message(message)), type(message))


def type_of_part(value: Any, part: str, where: str) -> tuple[str, Any]:
    """Return name and class of the service type of a request, or of the action type of a goal.

    Args:
        value: The message.
        part: `Request` or `Goal`.
        where: The name of the service or action, for messages.

    Raises:
        TypeError: It is nothing of the kind.
        HarnessError: Its type is not installed.
    """
    kind, find, example = _PARTS[part]
    found = f"the class {value.__name__}" if isinstance(value, type) else type(value).__name__
    wrong = TypeError(f"{where}: expected a {part.lower()} such as {example}.{part}(), found {found}")
    try:
        interface = message_type_name(type(value), kind)
    except TypeError:
        raise wrong from None
    if isinstance(value, type):  # its metaclass is in the same module
        raise wrong
    made = find(interface)
    if not isinstance(value, getattr(made, part)):
        raise wrong
    return interface, made


def read_message(carried: Message | Delivery) -> Any:
    """Return a message that was observed as an object of its class.

    Raises:
        HarnessError: Its type is not installed, or its content was not kept because it is too large or malformed.
    """
    kind = message_class(carried.type)
    if kind is None:
        raise HarnessError(f"{carried.topic}: the type {carried.type} is not installed here")
    if not carried.cdr:
        raise HarnessError(f"{carried.topic}: the content of this message was not kept, because it is too large")
    return deserialize_message(carried.cdr, kind)


def carried_fields(carried: Message | Delivery) -> Mapping[str, Any]:
    """Return the fields of a message as plain values, for recordings; none if they cannot be read."""
    if carried.value or not carried.cdr:
        return carried.value
    try:
        fields: Mapping[str, Any] = plain_fields(read_message(carried))
    except Exception:  # whatever bytes a program sends
        return {}
    return fields


def qos_words(profile: QoSProfile | None) -> tuple[str, str]:
    """Return reliability and durability of a QoS profile, as traces name them; None stands for the usual ones.

    Raises TypeError for anything else, such as the depth that rclpy takes in its place.
    """
    if profile is not None and not isinstance(profile, QoSProfile):
        raise TypeError(f"qos: expected a QoSProfile, found {profile!r}")
    best_effort = profile is not None and profile.reliability == ReliabilityPolicy.BEST_EFFORT
    latched = profile is not None and profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return "best_effort" if best_effort else "reliable", "transient_local" if latched else "volatile"


def action_type(interface: str) -> Any:
    """Return the class of an action type; raises HarnessError if it is not installed."""
    found = interface_class(interface, "action")
    if found is None:
        raise HarnessError(f"the action type {interface} is not installed here")
    return found


def parameter_message(name: str, value: Any) -> Any:
    """Return a parameter as a message for a node's service; raises TypeError for a value that no parameter has."""
    try:
        return Parameter(name, value=list(value) if isinstance(value, tuple) else value).to_parameter_msg()
    except (TypeError, ValueError) as error:
        raise TypeError(f"parameter {name}: expected a value of a ROS parameter, found {value!r}") from error


def service_type(interface: str) -> Any:
    """Return the class of a service type; raises HarnessError if it is not installed."""
    found = interface_class(interface, "srv")
    if found is None:
        raise HarnessError(f"the service type {interface} is not installed here")
    return found


#: The part of an interface that whoever asks sends -> the kind of interface, what finds its class, and an example.
_PARTS: Mapping[str, tuple[str, Callable[[str], Any], str]] = {
    "Request": ("srv", service_type, "Trigger"),
    "Goal": ("action", action_type, "Fibonacci"),
}
