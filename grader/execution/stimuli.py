"""What stimuli do in a scenario, and when: the schedule of events that a runner works through."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from grader.execution.exchanges import PlannedCall, PlannedCalls, PlannedMessages, PlannedServer, goal_call
from grader.execution.interfaces import message_class, plain_fields
from grader.execution.plan import Plan, PlannedNumbers, PlannedRecording

#: The step that tells "just above" a limit for types with a fraction; whole numbers step by 1.
FRACTION_STEP = 0.001


@dataclass(frozen=True, slots=True)
class Event:
    """One thing that a stimulus does.

    Attributes:
        t_ns: When.
    """

    t_ns: int


@dataclass(frozen=True, slots=True)
class TopicEvent(Event):
    """What concerns a topic, and happens whether or not anybody still listens."""

    topic: str


@dataclass(frozen=True, slots=True)
class Appear(TopicEvent):
    """A publisher appears, of the type that subscriptions ask for."""

    type: str


@dataclass(frozen=True, slots=True)
class Advertise(TopicEvent):
    """A publisher of a fixed type appears."""

    stream: PlannedMessages


@dataclass(frozen=True, slots=True)
class PublishNumber(TopicEvent):
    """A number is published, in the type of the publisher; the second value is the side of a limit it is on."""

    number: tuple[float, int]


@dataclass(frozen=True, slots=True)
class PublishRecorded(TopicEvent):
    """A message of a recording is published."""

    cdr: bytes
    value: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class PublishFields(TopicEvent):
    """A message of a fixed type is published."""

    stream: PlannedMessages
    fields: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Disappear(TopicEvent):
    """A publisher disappears."""


@dataclass(frozen=True, slots=True)
class AddServer(Event):
    """A server appears."""

    server: PlannedServer


@dataclass(frozen=True, slots=True)
class RemoveServer(Event):
    """A server disappears."""

    server: PlannedServer


@dataclass(frozen=True, slots=True)
class Respond(Event):
    """A server answers the request with a number."""

    server: PlannedServer
    number: int


@dataclass(frozen=True, slots=True)
class AddClients(Event):
    """The clients of some calls appear."""

    calls: PlannedCalls


@dataclass(frozen=True, slots=True)
class Ask(Event):
    """A client sends a request."""

    call: PlannedCall


#: What makes something appear; at the start it comes before everything else.
APPEARANCES = (Appear, Advertise, AddServer, AddClients)


def schedule(plan: Plan) -> list[Event]:
    """Return everything that stimuli do, in order of time; number streams never disappear."""
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
    return sorted(due, key=lambda d: (d.t_ns, d.t_ns == 0 and not isinstance(d, APPEARANCES)))


def _message_events(stream: PlannedMessages) -> Iterator[Event]:
    yield Advertise(stream.start_ns, stream.topic, stream)
    for index in range(len(stream.values) * stream.repeats):
        t_ns = stream.start_ns + index * stream.period_ns
        if not stream.stop_ns or t_ns < stream.stop_ns:
            yield PublishFields(t_ns, stream.topic, stream, stream.values[index // stream.repeats])
    if stream.stop_ns:
        yield Disappear(stream.stop_ns, stream.topic)


def _number_events(stream: PlannedNumbers) -> Iterator[Event]:
    yield Appear(0, stream.topic, stream.type)
    for index in range(len(stream.numbers) * stream.repeats):
        t_ns = stream.start_ns + index * stream.period_ns
        yield PublishNumber(t_ns, stream.topic, stream.numbers[index // stream.repeats])


def _recording_events(recording: PlannedRecording) -> Iterator[Event]:
    yield Appear(recording.start_ns, recording.topic, recording.type)
    for t_ns, cdr, value in recording.messages:
        yield PublishRecorded(t_ns, recording.topic, cdr, value)
    yield Disappear(recording.stop_ns, recording.topic)


def numeric_field(interface: str) -> tuple[str, bool] | None:
    """Return the field of a message type that carries a number, and whether it holds whole numbers only."""
    message = message_class(interface)
    if message is None:
        return None
    kinds: Mapping[str, str] = message.get_fields_and_field_types()
    for name in ("data", "temperature"):
        kind = kinds.get(name, "")
        if kind in ("float", "double"):
            return name, False
        if kind.startswith(("int", "uint")) and "[" not in kind and "<" not in kind:
            return name, True
    return None


def number_message(interface: str, number: tuple[float, int]) -> tuple[Any, Mapping[str, Any]]:
    """Return a message that carries a planned number in a type, and its fields; a whole type rounds it.

    Raises:
        ValueError: If the type carries no number.
    """
    found = numeric_field(interface)
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
