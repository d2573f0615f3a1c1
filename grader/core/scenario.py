"""Scenarios: a simulated situation with its duration, stimuli and limits, without points or expected answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Annotated, Any

from grader.core.dataclass import dataclass
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
#: A time above 0.
LongTime = Annotated[int | TimeBetween, Kind("time above 0")]
#: A fixed time in nanoseconds, above 0.
FixedTime = Annotated[int, Kind("fixed time above 0")]
#: A fixed time in nanoseconds; 0 means never.
TimeOrNever = Annotated[int, Kind("fixed time above 0, or nothing")]
Count = Annotated[int | CountBetween, Kind("count")]
#: A count; 0 means never.
CountOrNever = Annotated[int | CountBetween, Kind("count, or nothing")]


def shortest(time: Time) -> int:
    """Return the shortest possible time, in nanoseconds."""
    return time.low_ns if isinstance(time, TimeBetween) else time


def longest(time: Time) -> int:
    """Return the longest possible time, in nanoseconds."""
    return time.high_ns if isinstance(time, TimeBetween) else time


def fewest(count: Count) -> int:
    """Return the smallest possible count."""
    return count.low if isinstance(count, CountBetween) else count


def most(count: Count) -> int:
    """Return the largest possible count."""
    return count.high if isinstance(count, CountBetween) else count


@dataclass(frozen=True, slots=True)
class InOrder:
    """Cases that stay next to each other in the written order, wherever they are placed among others."""

    items: tuple[object, ...]


@dataclass(frozen=True, slots=True)
class SomeOf:
    """A number of cases, each drawn from several kinds."""

    items: tuple[object, ...]
    count: Count


@dataclass(frozen=True, slots=True)
class AnyOrder:
    """Cases that are all used, in an order drawn from the seed; cases of a SomeOf are scattered among the others."""

    items: tuple[object, ...]


def cases(items: tuple[object, ...]) -> tuple[int, int]:
    """Return the smallest and the largest number of cases in a list of items."""
    each = [_cases(item) for item in items]
    return sum(low for low, _ in each), sum(high for _, high in each)


def _cases(item: object) -> tuple[int, int]:
    if isinstance(item, SomeOf):
        return fewest(item.count), most(item.count)
    return cases(item.items) if isinstance(item, (InOrder, AnyOrder)) else (1, 1)


@dataclass(frozen=True, slots=True)
class Span:
    """How long a scenario is observed."""

    duration_ns: LongTime  # observed time
    after_first_message_on: Topic | None = None  # if set, observation starts with the first message on this topic
    wait_at_most_ns: FixedTime = 60 * NS_PER_S  # longest wait for that first message


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
#: A number, or several numbers with an order.
NumberItem = NumberSpec | AnyOrder | InOrder | SomeOf


@dataclass(frozen=True, slots=True)
class NumberStream:
    """A stimulus: numbers published on a topic, each held for a while.

    They are published with the message type that the student's node subscribes to.
    """

    topic: Topic  # topic name, absolute
    type: MessageType  # message type if no subscription has another one, e.g. `std_msgs/msg/Float32`
    values: Annotated[tuple[NumberItem, ...], Kind("numbers")]  # numbers in order
    period_ns: FixedTime  # time between two messages
    # How long each number is repeated. If this is drawn, each number gets its own time, and the last one is repeated
    # until the end of an observation that starts with the scenario.
    hold_ns: LongTime
    start_ns: Time  # time of the first message since scenario start
    # Name of the field that holds the number; by default `data`, or else the only number of a message
    field: Annotated[str, Kind("field name")] = ""


#: The type of messages that the stimulus `odometry` plays and `--odom-bag` replaces. Both are older than `recorded` and
#: `--recording TYPE=BAG`, and aliases of them.
ODOMETRY = "nav_msgs/msg/Odometry"


@dataclass(frozen=True, slots=True)
class RecordedStream:
    """A stimulus: the recorded messages of a topic.

    They are played with their original timing by a publisher that disappears afterwards.
    """

    topic: Topic  # topic name, absolute
    type: MessageType  # type of the messages, e.g. `sensor_msgs/msg/LaserScan`
    # The rosbag2 recording beside the rubric: a folder, or a .mcap or .db3 file. If it has no messages of this type on
    # the topic, the topic with most of them is played.
    bag: Annotated[str, Kind("recording")]
    start_ns: Time  # when the publisher appears and the first message is sent
    duration_ns: LongTime  # how much of the recording is played; which part is drawn from the seed


@dataclass(frozen=True, slots=True)
class Choose:
    """One of several values, drawn from the seed."""

    options: tuple[str | int | float | bool, ...]


@dataclass(frozen=True, slots=True)
class Written:
    """A text with a drawn number in place of `{}`: `{} m left`."""

    text: str  # holds `{}` once
    number: Between  # what is drawn
    decimals: int = 1  # how many decimals are written


#: The value of a field in a planned message: mappings are nested messages, tuples are sequences. Mappings are not
#: hashable, so stimuli that differ only in them have equal hashes and are distinguished by comparison.
FieldSpec = str | int | float | bool | Between | Choose | Written | Mapping[str, "FieldSpec"] | tuple["FieldSpec", ...]
Fields = Annotated[Mapping[str, FieldSpec], Kind("fields")]
#: The fields of one message, or of several messages with an order.
FieldsItem = Mapping[str, FieldSpec] | AnyOrder | InOrder | SomeOf


@dataclass(frozen=True, slots=True)
class MessageStream:
    """A stimulus: messages of one type, one per period; omitted fields keep their defaults."""

    topic: Topic  # topic name, absolute
    # e.g. `std_msgs/msg/String`; unlike that of a number stream, it does not depend on the student's node
    type: MessageType
    values: Annotated[tuple[FieldsItem, ...], Kind("messages")] = field(hash=False)  # fields of each message
    period_ns: FixedTime  # time between two messages
    start_ns: Time = 0  # time of the first message
    repeats: Count = 1  # how often each message is sent, once per period; drawn separately for each message
    stop_ns: TimeOrNever = 0  # when the publisher disappears; 0 for never
    best_effort: bool = False  # whether it offers only best-effort reliability
    latched: bool = False  # whether it offers transient-local durability


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
    # After this many responses it accepts one more request and disappears without answering; 0 for never
    answers: CountOrNever = 0


@dataclass(frozen=True, slots=True)
class ServiceCalls:
    """A stimulus: clients that call the student's server; a call waits until the server exists."""

    # Absolute name; `~/NAME` is a service of the student's only node. Parameters and lifecycle transitions are calls of
    # the services behind them.
    service: Topic
    type: ServiceType  # e.g. `std_srvs/srv/Trigger`
    # Fields of each request in order; with fewer requests than calls, they repeat from the first one
    requests: Annotated[tuple[FieldsItem, ...], Kind("messages")] = field(hash=False)
    calls: Count = 1  # number of requests of each client
    # Number of clients; all of them send their k-th call at the same instant
    clients: Annotated[int, Kind("clients")] = 1
    period_ns: FixedTime = NS_PER_S  # time between two calls of a client, which does not wait for responses
    start_ns: Time = 0  # when the clients appear and send their first call


@dataclass(frozen=True, slots=True)
class ActionGoal:
    """A stimulus: a goal for the student's action server, which may be cancelled later.

    In the trace it appears as calls of the action's services, `/NAME/_action/send_goal`, `get_result` and
    `cancel_goal`; feedback and status are messages on `/NAME/_action/feedback` and `/NAME/_action/status`.
    """

    action: Topic  # absolute name
    type: ActionType  # e.g. `test_msgs/action/Fibonacci`
    goal: Fields = field(hash=False)  # fields of the goal
    start_ns: Time = 0  # when the client appears and sends the goal; it waits for the server, as a real client does
    cancel_after_ns: TimeOrNever = 0  # time from the acceptance of the goal to the request to cancel it; 0 for never


@dataclass(frozen=True, slots=True)
class Simulated:
    """A stimulus: a participant that reacts to what the student's nodes publish, such as a simulated robot.

    It exists from the beginning to the end of the observation.
    """

    name: str  # one of the built-in simulations, or one in the table of the file
    parameters: Fields = field(hash=False)  # its parameters; those left out keep their defaults
    path: str = ""  # the author's file with its class, for messages; empty for a built-in one
    content: bytes = b""  # the text of that file
    start_ns: int = 0


Stimulus = NumberStream | RecordedStream | MessageStream | ServiceServer | ServiceCalls | ActionGoal | Simulated


def longest_course_ns(stimulus: Stimulus) -> int:
    """Return the latest time at which a stimulus has presented all its cases; for a server, when it appears."""
    start_ns = longest(stimulus.start_ns)
    if isinstance(stimulus, NumberStream):
        return start_ns + cases(stimulus.values)[1] * longest(stimulus.hold_ns)
    if isinstance(stimulus, MessageStream):
        return start_ns + cases(stimulus.values)[1] * most(stimulus.repeats) * stimulus.period_ns
    if isinstance(stimulus, ServiceCalls):
        return start_ns + most(stimulus.calls) * stimulus.period_ns
    return start_ns + longest(stimulus.duration_ns) if isinstance(stimulus, RecordedStream) else start_ns


def is_open(stimulus: Stimulus) -> bool:
    """Return whether the seed decides anything besides values: times, counts or orders."""
    parts = [getattr(stimulus, name) for name in stimulus.__slots__]
    inside = [item for part in parts if isinstance(part, tuple) for item in part]
    return any(isinstance(part, (TimeBetween, CountBetween, AnyOrder, SomeOf)) for part in (*parts, *inside))


@dataclass(frozen=True, slots=True)
class RunOptions:
    """What a process is given when it is started, as on the command line of `ros2 run` or `ros2 launch`."""

    arguments: tuple[str, ...] = ()  # arguments of the program, before the ROS arguments
    name: str = ""  # node name; empty for the program's own
    namespace: str = ""
    remappings: tuple[tuple[str, str], ...] = ()
    parameters: tuple[tuple[str, str], ...] = ()  # name, with dots for nested ones, and value as YAML
    parameters_file: str = ""  # name of a YAML file in ROS's format, handed in or provided
    launch_arguments: tuple[tuple[str, str], ...] = ()  # of a launch file


@dataclass(frozen=True, slots=True)
class Connection:
    """What happens to the messages of stimuli on a topic, on their way to the student's nodes."""

    topic: Topic  # topic name, absolute
    # How long a message is on its way. If this is drawn, each message gets its own time; none overtakes another
    delay_ns: Time = 0
    lose: Annotated[float, Kind("share")] = 0.0  # the share of messages that do not arrive, drawn for each


@dataclass(frozen=True, slots=True)
class Scenario:
    """One situation that is recorded once."""

    id: str  # unique within the exercise
    processes: tuple[str, ...]  # file names of the student processes that run in it, in start order
    span: Span  # when and how long it is observed
    stimuli: tuple[Stimulus, ...] = ()  # what the grader publishes
    # Limits of the processes and of the recording
    limits: Limits = Limits()
    # `(process, t_ns)` of processes that start late; the others start at 0
    starts_ns: tuple[tuple[str, Time], ...] = ()
    may_exit: tuple[str, ...] = ()  # processes that may end by themselves; exit code 0 is then no fault
    shutdown_ns: int = 0  # how long the processes may take to end after the stop signal; 0 if this is not checked
    run: tuple[tuple[str, RunOptions], ...] = ()  # `(process, options)` of processes that are started with some
    provided: tuple[tuple[str, str], ...] = ()  # name and text of the rubric's own files that this scenario uses
    connections: tuple[Connection, ...] = ()  # topics on which messages of stimuli are late or lost, each once

    @property
    def handed_in(self) -> tuple[str, ...]:
        """The files that a student has to hand in for this scenario: programs, then parameter files."""
        used = (*self.processes, *(options.parameters_file for _, options in self.run if options.parameters_file))
        own = dict(self.provided)
        return tuple(dict.fromkeys(name for name in used if name not in own))


def is_launch_file(name: str) -> bool:
    """Return whether a file is a launch file, by its name: `ros2 launch` takes all that end in `launch.py`."""
    return name.endswith("launch.py")


@dataclass(frozen=True, slots=True)
class TimedMessage:
    """A recorded message to be played."""

    t_ns: int  # time since the start of the stream
    cdr: bytes  # the message as it goes over the wire (CDR with its 4-byte header)
    value: Mapping[str, Any]  # the decoded fields, for judging
