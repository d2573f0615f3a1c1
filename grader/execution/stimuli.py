"""What the grader publishes in a scenario, and when: plain schedules that the conductor reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from grader.execution.exchanges import Call, PlannedMessages, goal_call
from grader.execution.interfaces import message_class, plain_fields
from grader.execution.plan import Plan, PlannedNumbers, PlannedRecording

#: The step that tells "just above" a limit for types with a fraction; whole numbers step by 1.
FRACTION_STEP = 0.001


#: What makes something appear; at the start it comes before everything else.
APPEARANCES = frozenset({"appear", "offer", "serve", "meet"})
#: What concerns topics, and happens whether or not anybody still listens.
BROADCASTS = frozenset({"appear", "offer", "publish", "say", "disappear"})


@dataclass(frozen=True, slots=True)
class Due:
    """One thing to do at a time.

    Attributes:
        t_ns: When.
        action: On a topic `appear` (a publisher of the type that is asked for), `offer` (one of a fixed type),
            `publish`, `say` (a message of that fixed type) or `disappear`; of a service `serve`, `dismiss` and `answer`
            as its server, `meet` and `call` as its client.
        topic: Name of the topic or service.
        payload: What it needs: what to publish, the planned stimulus.
    """

    t_ns: int
    action: str
    topic: str
    payload: Any = None


def schedule(plan: Plan) -> list[Due]:
    """Return everything that stimuli do, in order of time; number streams never disappear."""
    due = [d for stream in plan.numbers for d in _number_events(stream)]
    due += [d for recording in plan.recordings for d in _recording_events(recording)]
    due += [d for stream in plan.messages for d in _message_events(stream)]
    for server in plan.servers:
        due.append(Due(server.start_ns, "serve", server.service, server))
        due += [Due(server.stop_ns, "dismiss", server.service, server)] if server.stop_ns else []
    for calls in plan.calls:
        due.append(Due(calls.start_ns, "meet", calls.service, calls))
        for index in range(len(calls.requests)):
            t_ns = calls.start_ns + index // calls.clients * calls.period_ns
            due.append(Due(t_ns, "call", calls.service, Call(calls, index)))
    for goal in plan.goals:
        call = goal_call(goal)
        parts = [call, *(following for _, following in call.then)]
        due += [Due(goal.start_ns, "meet", part.calls.service, part.calls) for part in parts]
        due.append(Due(goal.start_ns, "call", call.calls.service, call))
    return sorted(due, key=lambda d: (d.t_ns, d.t_ns == 0 and d.action not in APPEARANCES))


def _message_events(stream: PlannedMessages) -> Iterator[Due]:
    yield Due(stream.start_ns, "offer", stream.topic, stream)
    for index in range(len(stream.values) * stream.repeats):
        t_ns = stream.start_ns + index * stream.period_ns
        if not stream.stop_ns or t_ns < stream.stop_ns:
            yield Due(t_ns, "say", stream.topic, (stream, stream.values[index // stream.repeats]))
    if stream.stop_ns:
        yield Due(stream.stop_ns, "disappear", stream.topic)


def _number_events(stream: PlannedNumbers) -> Iterator[Due]:
    yield Due(0, "appear", stream.topic, stream.type)
    for index in range(len(stream.numbers) * stream.repeats):
        yield Due(
            stream.start_ns + index * stream.period_ns, "publish", stream.topic, stream.numbers[index // stream.repeats]
        )


def _recording_events(recording: PlannedRecording) -> Iterator[Due]:
    yield Due(recording.start_ns, "appear", recording.topic, recording.type)
    for t_ns, cdr, value in recording.messages:
        yield Due(t_ns, "publish", recording.topic, (cdr, value))
    yield Due(recording.stop_ns, "disappear", recording.topic)


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
