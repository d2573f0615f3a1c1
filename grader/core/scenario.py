"""Scenarios: one simulated situation with its duration, stimuli and limits; no marks and no answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from grader.core.limits import Limits
from grader.core.quantities import NS_PER_S, ActionType, Kind, MessageType, ServiceType, Topic


@dataclass(frozen=True, slots=True)
class TimeBetween:
    """A time drawn from the seed: whole milliseconds in [low_ns, high_ns]."""

    low_ns: int
    high_ns: int


@dataclass(frozen=True, slots=True)
class CountBetween:
    """A count drawn from the seed, in [low, high]."""

    low: int
    high: int


Time = Annotated[int | TimeBetween, Kind("time")]
#: One that is above 0.
LongTime = Annotated[int | TimeBetween, Kind("time above 0")]
#: Nanoseconds that are never drawn, above 0.
FixedTime = Annotated[int, Kind("fixed time above 0")]
#: The same, or 0 for never.
TimeOrNever = Annotated[int, Kind("fixed time above 0, or nothing")]
Count = Annotated[int | CountBetween, Kind("count")]
#: One that may be 0 for never.
CountOrNever = Annotated[int | CountBetween, Kind("count, or nothing")]


def shortest(time: Time) -> int:
    """Return the least that a time may come to, in nanoseconds."""
    return time.low_ns if isinstance(time, TimeBetween) else time


def longest(time: Time) -> int:
    """Return the most that a time may come to, in nanoseconds."""
    return time.high_ns if isinstance(time, TimeBetween) else time


def fewest(count: Count) -> int:
    """Return the least that a count may come to."""
    return count.low if isinstance(count, CountBetween) else count


def most(count: Count) -> int:
    """Return the most that a count may come to."""
    return count.high if isinstance(count, CountBetween) else count


@dataclass(frozen=True, slots=True)
class InOrder:
    """Cases that follow each other as they are written, wherever among others they come."""

    items: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class SomeOf:
    """A drawn number of cases, each one of several kinds."""

    items: tuple[Any, ...]
    count: Count


@dataclass(frozen=True, slots=True)
class AnyOrder:
    """Cases in an order drawn from the seed, each of them present; those of a SomeOf are scattered among the others."""

    items: tuple[Any, ...]


def cases(items: tuple[Any, ...]) -> tuple[int, int]:
    """Return how many cases a list of items comes to, the fewest and the most."""
    each = [_cases(item) for item in items]
    return sum(low for low, _ in each), sum(high for _, high in each)


def _cases(item: Any) -> tuple[int, int]:
    if isinstance(item, SomeOf):
        return fewest(item.count), most(item.count)
    return cases(item.items) if isinstance(item, (InOrder, AnyOrder)) else (1, 1)


@dataclass(frozen=True, slots=True)
class Span:
    """How long a scenario is observed."""

    duration_ns: LongTime  # observed time
    after_first_message_on: Topic | None = None  # if set, observation starts with the first message on this topic
    wait_at_most_ns: FixedTime = 60 * NS_PER_S  # how long that first message is waited for


@dataclass(frozen=True, slots=True)
class Between:
    """A number drawn from the seed, uniform in [low, high]; whole if the student's type is."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class JustAbove:
    """The limit plus the smallest step worth asking about in the student's type: 0.001, or 1 for whole numbers."""

    limit: float


@dataclass(frozen=True, slots=True)
class JustBelow:
    """The limit minus the smallest step worth asking about in the student's type: 0.001, or 1 for whole numbers."""

    limit: float


NumberSpec = float | Between | JustAbove | JustBelow
#: A number, or several in an order of their own.
NumberItem = NumberSpec | AnyOrder | InOrder | SomeOf


@dataclass(frozen=True, slots=True)
class NumberStream:
    """A stimulus: numbers published on a topic, each held for a while.

    They are published in the type that the student's node takes.
    """

    topic: Topic  # topic name, absolute
    type: MessageType  # message type used while no subscription tells another, e.g. `std_msgs/msg/Float32`
    values: Annotated[tuple[NumberItem, ...], Kind("numbers")]  # numbers in order
    period_ns: FixedTime  # time between two messages
    # How long each number is repeated; where that is drawn, for each number anew, the last one is repeated until the
    # end of an observation that begins with the scenario.
    hold_ns: LongTime
    start_ns: Time  # time of the first message since scenario start


@dataclass(frozen=True, slots=True)
class OdometryStream:
    """A stimulus: the recorded odometry.

    It is played with its own timing by a publisher that then disappears.
    """

    topic: Topic  # topic name, absolute
    start_ns: Time  # when the publisher appears and the first message is sent
    duration_ns: LongTime  # how much of the recording is played; which part is drawn from the seed


@dataclass(frozen=True, slots=True)
class Choose:
    """One of several values, drawn from the seed."""

    options: tuple[str | int | float | bool, ...]


@dataclass(frozen=True, slots=True)
class Written:
    """A text with a drawn number in place of `{}`: `Battery: {}% remaining`."""

    text: str  # holds `{}` once
    number: Between  # what is drawn
    decimals: int = 1  # how many decimals are written


#: What a field of a planned message may hold; mappings are nested messages, tuples are sequences. Mappings have no
#: hash: stimuli that differ in nothing else share theirs, and are told apart by comparing them.
FieldSpec = str | int | float | bool | Between | Choose | Written | Mapping[str, "FieldSpec"] | tuple["FieldSpec", ...]
Fields = Annotated[Mapping[str, FieldSpec], Kind("fields")]
#: The fields of one message, or of several in an order of their own.
FieldsItem = Mapping[str, FieldSpec] | AnyOrder | InOrder | SomeOf


@dataclass(frozen=True, slots=True)
class MessageStream:
    """A stimulus: messages of one type, one a period; fields left out keep their defaults."""

    topic: Topic  # topic name, absolute
    type: MessageType  # e.g. `std_msgs/msg/String`; fixed, unlike a number stream's.
    values: Annotated[tuple[FieldsItem, ...], Kind("messages")] = field(hash=False)  # fields of each message
    period_ns: FixedTime  # time between two messages
    start_ns: Time = 0  # time of the first message
    repeats: Count = 1  # how often each is sent, one a period; where that is drawn, for each anew
    stop_ns: TimeOrNever = 0  # when the publisher disappears; 0 for never
    best_effort: bool = False  # whether it offers best effort only
    latched: bool = False  # whether it offers transient local


@dataclass(frozen=True, slots=True)
class ServiceServer:
    """A stimulus: a server that answers the student's client; without responses it never answers."""

    service: Topic  # absolute name
    type: ServiceType  # e.g. `std_srvs/srv/Trigger`
    # Fields of each response in order
    responses: Annotated[tuple[FieldsItem, ...], Kind("messages, or none")] = field(hash=False)
    start_ns: Time = 0  # when it appears
    stop_ns: TimeOrNever = 0  # when it disappears; 0 for never
    delay_ns: Time = 0  # time from a request to its response
    cycle: bool = False  # whether the responses begin again after the last one; otherwise the last one is repeated
    # After so many responses it takes one more request, and disappears without a response; 0 for never
    answers: CountOrNever = 0


@dataclass(frozen=True, slots=True)
class ServiceCalls:
    """A stimulus: clients that call the student's server; a call waits for the server to be there."""

    # Absolute name; `~/NAME` is a service of the student's only node. Parameters and lifecycle transitions are calls of
    # the services behind them.
    service: Topic
    type: ServiceType  # e.g. `std_srvs/srv/Trigger`
    # Fields of each request in order, repeated from the first one if there are fewer than calls
    requests: Annotated[tuple[FieldsItem, ...], Kind("messages")] = field(hash=False)
    calls: Count = 1  # how many requests each client sends
    # How many clients there are; the k-th call of all of them is sent at the same instant
    clients: Annotated[int, Kind("clients")] = 1
    period_ns: FixedTime = NS_PER_S  # time between two calls of a client; it does not wait for the response
    start_ns: Time = 0  # when the clients appear and call first


@dataclass(frozen=True, slots=True)
class ActionGoal:
    """A stimulus: a goal for the student's action server, which may be cancelled after a while.

    In the trace its parts are calls of the services behind an action, `/NAME/_action/send_goal`, `get_result` and
    `cancel_goal`; what the server publishes are messages on `/NAME/_action/feedback` and `status`.
    """

    action: Topic  # absolute name
    type: ActionType  # e.g. `test_msgs/action/Fibonacci`
    goal: Fields = field(hash=False)  # fields of the goal
    start_ns: Time = 0  # when the client appears and sends the goal; it waits for the server as a real client would
    cancel_after_ns: TimeOrNever = 0  # time from the goal's acceptance until it asks to cancel it; 0 for never


Stimulus = NumberStream | OdometryStream | MessageStream | ServiceServer | ServiceCalls | ActionGoal


def longest_course_ns(stimulus: Stimulus) -> int:
    """Return when a stimulus has shown all of its cases at the latest; for a server, when it appears."""
    start_ns = longest(stimulus.start_ns)
    if isinstance(stimulus, NumberStream):
        return start_ns + cases(stimulus.values)[1] * longest(stimulus.hold_ns)
    if isinstance(stimulus, MessageStream):
        return start_ns + cases(stimulus.values)[1] * most(stimulus.repeats) * stimulus.period_ns
    if isinstance(stimulus, ServiceCalls):
        return start_ns + most(stimulus.calls) * stimulus.period_ns
    return start_ns + longest(stimulus.duration_ns) if isinstance(stimulus, OdometryStream) else start_ns


def is_open(stimulus: Stimulus) -> bool:
    """Return whether anything but values is left to the seed."""
    parts = [getattr(stimulus, name) for name in stimulus.__slots__]
    inside = [item for part in parts if isinstance(part, tuple) for item in part]
    return any(isinstance(part, (TimeBetween, CountBetween, AnyOrder, SomeOf)) for part in (*parts, *inside))


@dataclass(frozen=True, slots=True)
class Scenario:
    """One situation that is recorded once."""

    id: str  # unique within the exercise
    processes: tuple[str, ...]  # file names of the student processes that run in it, in start order
    span: Span  # how long it is observed
    stimuli: tuple[Stimulus, ...] = ()  # what the grader publishes
    # How much the processes may use, and how much is recorded
    limits: Limits = Limits()  # noqa: RUF009 - a value that never changes
    # `(process, t_ns)` of processes that start late; the others start at 0
    starts_ns: tuple[tuple[str, Time], ...] = ()
    may_exit: tuple[str, ...] = ()  # processes that are free to end by themselves: with code 0 that is no fault
    shutdown_ns: int = 0  # how long the processes may take to end after the stop signal, if that is looked at; 0 if not


@dataclass(frozen=True, slots=True)
class TimedMessage:
    """A recorded message to be played."""

    t_ns: int  # time since the start of the stream
    cdr: bytes  # the message as it goes over the wire (CDR with its 4-byte header)
    value: Mapping[str, Any]  # the decoded fields that judging reads
