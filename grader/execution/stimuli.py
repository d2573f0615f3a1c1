"""Builds the schedule of stimulus events that a runner executes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from grader.core.dataclass import dataclass
from grader.execution.exchanges import PlannedCall, PlannedCalls, PlannedMessages, PlannedServer, goal_call
from grader.execution.interfaces import message_class, plain_fields
from grader.execution.plan import Plan, PlannedNumbers, PlannedRecording

#: The numeric types of fields, as the classes of messages name them.
_NUMBER = re.compile(r"float|double|u?int(8|16|32|64)")
#: The distance of "just above" from a limit for floating-point types; integers differ by 1.
FRACTION_STEP = 0.001


@dataclass(frozen=True, slots=True)
class Event:
    """One action of a stimulus.

    Attributes:
        t_ns: Time since the scenario's start.
    """

    t_ns: int


@dataclass(frozen=True, slots=True)
class TopicEvent(Event):
    """An event on a topic, which happens whether or not any node is still running."""

    topic: str


@dataclass(frozen=True, slots=True)
class Appear(TopicEvent):
    """Create a publisher of the type that subscriptions ask for, or of this type alone if it is fixed."""

    type: str
    fixed: bool = False
    field: str = ""  # name of the field that holds a number to publish; see `numeric_field`


@dataclass(frozen=True, slots=True)
class Advertise(TopicEvent):
    """Create a publisher of a fixed type."""

    stream: PlannedMessages


@dataclass(frozen=True, slots=True)
class PublishNumber(TopicEvent):
    """Publish a number in the publisher's type; the second value is the side of a limit: 1 above, -1 below, 0 none."""

    number: tuple[float, int]


@dataclass(frozen=True, slots=True)
class PublishRecorded(TopicEvent):
    """Publish a message of a recording."""

    cdr: bytes
    value: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class PublishFields(TopicEvent):
    """Publish a message of a fixed type."""

    stream: PlannedMessages
    fields: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Disappear(TopicEvent):
    """Remove a publisher."""


@dataclass(frozen=True, slots=True)
class AddServer(Event):
    """Create a server."""

    server: PlannedServer


@dataclass(frozen=True, slots=True)
class RemoveServer(Event):
    """Remove a server."""

    server: PlannedServer


@dataclass(frozen=True, slots=True)
class Respond(Event):
    """Send a server's response to the request with a number."""

    server: PlannedServer
    number: int


@dataclass(frozen=True, slots=True)
class AddClients(Event):
    """Create the clients of some calls."""

    calls: PlannedCalls


@dataclass(frozen=True, slots=True)
class Ask(Event):
    """Send a client's request."""

    call: PlannedCall


@dataclass(frozen=True, slots=True)
class Step(Event):
    """Let time pass for the simulation with a number."""

    number: int


#: Events that create an endpoint; at time 0 they come before all others.
APPEARANCES = (Appear, Advertise, AddServer, AddClients)


def schedule(plan: Plan) -> list[Event]:
    """Return all stimulus events of a plan, sorted by time; number streams are never removed."""
    due: list[Event] = [d for stream in plan.numbers for d in _number_events(stream)]
    due += [d for recording in plan.recordings for d in _recording_events(recording)]
    due += [d for stream in plan.messages for d in _message_events(stream)]
    for server in plan.servers:
        due.append(AddServer(server.start_ns, server))
        due += [RemoveServer(server.stop_ns, server)] if server.stop_ns else []
    for calls in plan.calls:
        due.append(AddClients(calls.start_ns, calls))
        for index in range(len(calls.requests)):
            t_ns = calls.start_ns + index // calls.clients * calls.period_ns
            due.append(Ask(t_ns, PlannedCall(calls, index)))
    for goal in plan.goals:
        call = goal_call(goal)
        parts = [call, *(following for _, following in call.then)]
        due += [AddClients(goal.start_ns, part.calls) for part in parts]
        due.append(Ask(goal.start_ns, call))
    return in_order(due)


def in_order(events: Iterable[Event]) -> list[Event]:
    """Sort events by time; at time 0, endpoints are created before anything else happens."""
    return sorted(events, key=lambda e: (e.t_ns, e.t_ns == 0 and not isinstance(e, APPEARANCES)))


def _message_events(stream: PlannedMessages) -> Iterator[Event]:
    yield Advertise(stream.start_ns, stream.topic, stream)
    for index in range(len(stream.values) * stream.repeats):
        t_ns = stream.start_ns + index * stream.period_ns
        if not stream.stop_ns or t_ns < stream.stop_ns:
            yield PublishFields(t_ns, stream.topic, stream, stream.values[index // stream.repeats])
    if stream.stop_ns:
        yield Disappear(stream.stop_ns, stream.topic)


def _number_events(stream: PlannedNumbers) -> Iterator[Event]:
    yield Appear(0, stream.topic, stream.type, field=stream.field)
    for index in range(len(stream.numbers) * stream.repeats):
        t_ns = stream.start_ns + index * stream.period_ns
        yield PublishNumber(t_ns, stream.topic, stream.numbers[index // stream.repeats])


def _recording_events(recording: PlannedRecording) -> Iterator[Event]:
    yield Appear(recording.start_ns, recording.topic, recording.type, fixed=True)
    for t_ns, cdr, value in recording.messages:
        yield PublishRecorded(t_ns, recording.topic, cdr, value)
    yield Disappear(recording.stop_ns, recording.topic)


def numeric_field(interface: str, field: str = "") -> tuple[str, bool] | None:
    """Return the numeric field of a message type, and whether it is an integer; None if there is none.

    Without a field, that is `data`, or else the only number apart from a variance, as in sensor_msgs/msg/FluidPressure.
    """
    message = message_class(interface)
    if message is None:
        return None
    kinds: Mapping[str, str] = message.get_fields_and_field_types()
    if field or "data" in kinds:
        known = [(field or "data", kinds.get(field or "data", ""))]
    else:
        known = [(name, kind) for name, kind in kinds.items() if name != "variance" and _NUMBER.fullmatch(kind)]
    if len(known) != 1 or not _NUMBER.fullmatch(known[0][1]):
        return None
    name, kind = known[0]
    return name, kind not in ("float", "double")


def number_message(interface: str, number: tuple[float, int], field: str = "") -> tuple[Any, Mapping[str, Any]]:
    """Build a message of a type from a planned number, and return it with its fields; integer types round.

    Raises:
        ValueError: The type has no numeric field.
    """
    found = numeric_field(interface, field)
    if found is None:
        raise ValueError(interface)
    name, whole = found
    value, side = number
    message = message_class(interface)()
    if whole:
        setattr(message, name, round(value) + side)
    else:
        setattr(message, name, float(value) + side * FRACTION_STEP)
    return message, {name: plain_fields(getattr(message, name))}
