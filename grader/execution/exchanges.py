"""Planned messages, servers, calls and goals: stimuli with all random values drawn, as plain JSON values."""

from __future__ import annotations

import inspect
import math
import random
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from grader.core.dataclass import dataclass
from grader.core.quantities import NS_PER_MS
from grader.core.scenario import (
    ActionGoal,
    AnyOrder,
    Between,
    Choose,
    Count,
    CountBetween,
    FieldSpec,
    InOrder,
    MessageStream,
    ServiceCalls,
    ServiceServer,
    Simulated,
    SomeOf,
    Time,
    TimeBetween,
    Written,
)


def drawn_time(time: Time, draw: random.Random) -> int:
    """Draw a time in nanoseconds; a fixed time consumes no randomness."""
    if not isinstance(time, TimeBetween):
        return time
    # both ends are included, even if they are not whole milliseconds
    return min(time.high_ns, time.low_ns + NS_PER_MS * draw.randint(0, -(-(time.high_ns - time.low_ns) // NS_PER_MS)))


def drawn_count(count: Count, draw: random.Random) -> int:
    """Draw a count; a fixed count consumes no randomness."""
    return draw.randint(count.low, count.high) if isinstance(count, CountBetween) else count


def in_drawn_order(items: Sequence[Any], draw: random.Random) -> list[Any]:
    """Flatten a list of cases and draw their order; a list with a fixed order consumes no randomness."""
    return [case for item in items for block in _blocks(item, draw) for case in block]


def _blocks(item: Any, draw: random.Random) -> list[list[Any]]:
    """Expand an item to its cases; cases that must stay together form one list."""
    if isinstance(item, InOrder):
        return [list(item.items)]
    if isinstance(item, SomeOf):
        return [[draw.choice(item.items)] for _ in range(drawn_count(item.count, draw))]
    if isinstance(item, AnyOrder):
        blocks = [block for inner in item.items for block in _blocks(inner, draw)]
        draw.shuffle(blocks)
        return blocks
    return [[item]]


Planned = TypeVar("Planned")
Fields = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class PlannedMessages:
    """A message stream with every field drawn; see `grader.core.scenario.MessageStream`."""

    topic: str
    type: str
    start_ns: int
    stop_ns: int
    period_ns: int
    repeats: int
    best_effort: bool
    latched: bool
    values: tuple[Fields, ...]


@dataclass(frozen=True, slots=True)
class PlannedServer:
    """A server with every response drawn; see `grader.core.scenario.ServiceServer`."""

    service: str
    type: str
    start_ns: int
    stop_ns: int
    delay_ns: int
    cycle: bool
    answers: int
    responses: tuple[Fields, ...]

    def response(self, index: int) -> Fields | None:
        """Return the fields of the response to a request, counted from 0; None if it gets no response."""
        if not self.responses or (self.answers and index >= self.answers):
            return None
        return self.responses[index % len(self.responses) if self.cycle else min(index, len(self.responses) - 1)]


@dataclass(frozen=True, slots=True)
class PlannedCalls:
    """Calls with every request drawn, `clients` of them for each call in turn; see `ServiceCalls`."""

    service: str
    type: str
    start_ns: int
    period_ns: int
    clients: int
    requests: tuple[Fields, ...]


@dataclass(frozen=True, slots=True)
class PlannedCall:
    """One request to send.

    Attributes:
        calls: The calls that it belongs to.
        index: Its index in them, from 0.
        then: Requests to send if the response accepts this one, each with its delay after the response.
    """

    calls: PlannedCalls
    index: int
    then: tuple[tuple[int, PlannedCall], ...] = ()

    @property
    def client(self) -> int:
        """Index of the client that sends the request, from 0."""
        return self.index % self.calls.clients


@dataclass(frozen=True, slots=True)
class PlannedGoal:
    """A goal with every field drawn, and its goal id; see `grader.core.scenario.ActionGoal`."""

    action: str
    type: str
    start_ns: int
    cancel_after_ns: int
    goal: Fields
    uuid: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class PlannedSimulation:
    """A simulation with every parameter drawn, and the seed of its noise; see `grader.core.scenario.Simulated`."""

    name: str
    path: str
    content: bytes
    parameters: Fields
    seed: int


def goal_call(goal: PlannedGoal) -> PlannedCall:
    """Return the request that sends a goal, with the requests that follow: for its result, and perhaps to cancel it."""
    name, identity = f"{goal.action}/_action", {"uuid": list(goal.uuid)}

    def once(service: str, interface: str, request: Fields) -> PlannedCalls:
        return PlannedCalls(f"{name}/{service}", interface, goal.start_ns, 1, 1, (request,))

    then = [(0, PlannedCall(once("get_result", f"{goal.type}_GetResult", {"goal_id": identity}), 0))]
    if goal.cancel_after_ns:
        asked = once("cancel_goal", "action_msgs/srv/CancelGoal", {"goal_info": {"goal_id": identity}})
        then.append((goal.cancel_after_ns, PlannedCall(asked, 0)))
    sent = once("send_goal", f"{goal.type}_SendGoal", {"goal_id": identity, "goal": goal.goal})
    return PlannedCall(sent, 0, tuple(then))


def plan_messages(stream: MessageStream, draw: random.Random) -> PlannedMessages:
    """Draw every field of a message stream, and the order and number of its messages unless they are fixed."""
    start_ns, values, repeats = drawn_time(stream.start_ns, draw), in_drawn_order(stream.values, draw), stream.repeats
    each = [(value, drawn_count(repeats, draw)) for value in values] if isinstance(repeats, CountBetween) else []
    planned = [drawn_fields(value, draw) for value in values]
    if each:
        planned = [fields for fields, (_, times) in zip(planned, each, strict=True) for _ in range(times)]
    times = 1 if isinstance(repeats, CountBetween) else repeats
    return _planned(PlannedMessages, stream, start_ns=start_ns, repeats=times, values=tuple(planned))


def plan_server(server: ServiceServer, draw: random.Random) -> PlannedServer:
    """Draw every response of a server once: a response that is sent again has the same values."""
    return _planned(
        PlannedServer,
        server,
        start_ns=drawn_time(server.start_ns, draw),
        delay_ns=drawn_time(server.delay_ns, draw),
        answers=drawn_count(server.answers, draw),
        responses=tuple(drawn_fields(response, draw) for response in in_drawn_order(server.responses, draw)),
    )


def plan_calls(calls: ServiceCalls, draw: random.Random) -> PlannedCalls:
    """Draw every request of some calls, separately for each call and client."""
    start_ns, count = drawn_time(calls.start_ns, draw), drawn_count(calls.calls, draw)
    requests = in_drawn_order(calls.requests, draw)
    wanted = [requests[call % len(requests)] for call in range(count) for _ in range(calls.clients)]
    asked = tuple(drawn_fields(request, draw) for request in wanted)
    return _planned(PlannedCalls, calls, start_ns=start_ns, requests=asked)


def plan_goal(goal: ActionGoal, draw: random.Random) -> PlannedGoal:
    """Draw every field of a goal."""
    start_ns, asked = drawn_time(goal.start_ns, draw), drawn_fields(goal.goal, draw)
    return _planned(PlannedGoal, goal, start_ns=start_ns, goal=asked, uuid=tuple(draw.randbytes(16)))


def plan_simulation(simulated: Simulated, draw: random.Random) -> PlannedSimulation:
    """Draw every parameter of a simulation, and the seed of its noise."""
    parameters = drawn_fields(simulated.parameters, draw)
    return _planned(PlannedSimulation, simulated, parameters=parameters, seed=draw.getrandbits(48))


def _planned(kind: Callable[..., Planned], stimulus: Any, **drawn: Any) -> Planned:
    """Build a planned stimulus from drawn values, and take all other fields from the scenario."""
    same = {name: getattr(stimulus, name) for name in inspect.signature(kind).parameters if name not in drawn}
    return kind(**same, **drawn)


def drawn_fields(fields: Mapping[str, FieldSpec], draw: random.Random) -> Fields:
    """Draw every value in the fields of a message."""
    return {name: _drawn(value, draw) for name, value in fields.items()}


def _drawn(value: FieldSpec, draw: random.Random) -> Any:
    if isinstance(value, Mapping):
        return drawn_fields(value, draw)
    if isinstance(value, tuple):
        return [_drawn(item, draw) for item in value]
    if isinstance(value, Choose):
        return draw.choice(value.options)
    if isinstance(value, Written):
        number = draw.uniform(value.number.low, value.number.high)
        return value.text.replace("{}", f"{number:.{value.decimals}f}")
    return drawn_number(value, draw) if isinstance(value, Between) else value


def drawn_number(spec: Between, draw: random.Random) -> int | float:
    """Draw a number: an integer between integer bounds, otherwise rounded to a hundredth of the range or finer."""
    if float(spec.low).is_integer() and float(spec.high).is_integer():
        return draw.randint(int(spec.low), int(spec.high))
    decimals = max(2, 2 - math.floor(math.log10(spec.high - spec.low)))
    return round(draw.uniform(spec.low, spec.high), decimals)
