"""Scenarios: a simulated situation with its duration, stimuli and limits, without points or expected answers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from typing import Annotated, Any, ClassVar, NamedTuple, Self

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB, NS_PER_S, Bytes, Kind, Topic
from grader.runtime.model.worlds import WallMap


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
class Event:
    """One action of a stimulus."""

    #: Whether it creates a publisher, server or client; at time 0 these come before everything else.
    creates: ClassVar[bool] = False

    t_ns: int  # time since the scenario's start


class Content(NamedTuple):
    """Where a planned stimulus holds the fields of messages: one mapping, or a tuple of them."""

    field: str  # its field that holds them
    kind: str  # what its type is: `msg`, `srv` or `action`
    part: str = ""  # the part of that type that has the fields, such as `Request` or `Goal`


class Planned:
    """A stimulus with every value drawn, as plain JSON values; times since the scenario's start."""

    __slots__ = ()
    holds: ClassVar[tuple[Content, ...]] = ()

    @property
    def place(self) -> str:
        """What it is in a message about a mistake in the fields that it holds, such as `messages on /scan`."""
        return ""

    def events(self) -> Iterator[Event]:
        """Yield what happens, in any order; nothing if a program decides in the run what does."""
        yield from ()


class Stimulus:
    """Something that the grader does to the student's nodes; each kind is a module of `grader/runtime/stimuli/`.

    The fields of a kind are the parameters in rubrics, and its docstring is their manual.
    """

    __slots__ = ()
    #: Its key in rubrics.
    key: ClassVar[str]
    #: What the seed makes of it.
    becomes: ClassVar[type[Planned]]
    #: Defaults of parameters that the JSON Schema of rubrics shows, where they differ from those of the fields.
    shown: ClassVar[Mapping[str, Any]] = {}
    #: Whether it is published in the type that the student's node subscribes with, and its own type is a default.
    follows_type: ClassVar[bool] = False

    start_ns: Time

    def planned(self, draws: Any) -> Planned:
        """Draw every value from the `Draws` of `grader/runtime/stimuli/drawing.py`."""
        raise NotImplementedError

    def phrase(self) -> str:
        """Return what the grader does, as a part of a sentence."""
        raise NotImplementedError

    def course_ns(self) -> int:
        """Return the latest time at which all its cases have been presented; for a server, when it appears."""
        return longest(self.start_ns)

    def is_open(self) -> bool:
        """Return whether the seed decides anything besides values: times, counts or orders.

        This looks at the parameters. A kind that draws times which no parameter describes says so here.
        """
        parts = [getattr(self, one.name) for one in fields(self)]  # type: ignore[arg-type]  # each kind is a dataclass
        inside = [item for part in parts if isinstance(part, tuple) for item in part]
        return any(isinstance(part, (TimeBetween, CountBetween, AnyOrder, SomeOf)) for part in (*parts, *inside))

    def mistakes(self) -> Iterator[tuple[str, str]]:
        """Yield parameters that do not fit each other: the name of one in rubrics, and what was expected."""
        if 0 < getattr(self, "stop_ns", 0) <= longest(self.start_ns):
            yield "stop", "expected a stop after the start"

    def beside(self, folder: str) -> Self:
        """Return it with the paths of files, which a rubric names relative to its folder."""
        del folder
        return self


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
class RubricTest:
    """A test of the rubric's author, which runs programs itself and judges what they do."""

    file: str  # its file, relative to the rubric
    content: str  # the text of the file
    name: str  # what pytest calls it within the file, such as `test_stops[0.5]` or `TestStop::test_wall`
    # Name, file and its text of each simulation of the rubric's own
    simulations: tuple[tuple[str, str, bytes], ...] = ()
    maps: tuple[tuple[str, WallMap], ...] = ()  # the maps of the rubric, by name


@dataclass(frozen=True, slots=True)
class Connection:
    """What happens to the messages of stimuli on a topic, on their way to the student's nodes."""

    topic: Topic  # topic name, absolute
    # How long a message is on its way. If this is drawn, each message gets its own time; none overtakes another
    delay_ns: Time = 0
    lose: Annotated[float, Kind("share")] = 0.0  # the share of messages that do not arrive, drawn for each


@dataclass(frozen=True, slots=True)
class HandedInBag:
    """A recording that the student hands in: its messages are judged in place of those of a run."""

    # The name of its file or folder, where `*` stands for any characters
    bag: Annotated[str, Kind("bag")]
    # The topics that are read; without any, those that the checks name
    topics: tuple[Topic, ...] = ()
    size_bytes: Annotated[Bytes, Kind("size of a bag"), "the largest recording that is read"] = 256 * MIB
    duration_ns: Annotated[FixedTime, "how much of it is read, from the first message on"] = 600 * NS_PER_S


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
    test: RubricTest | None = None  # the test that runs the programs it needs; None if all are run as planned
    connections: tuple[Connection, ...] = ()  # topics on which messages of stimuli are late or lost, each once
    handed_in: HandedInBag | None = None  # the recording that takes the place of a run; None if programs run
    # Of that recording, the topics that checks take for what the grader publishes in a run
    given: tuple[str, ...] = ()

    @property
    def wanted(self) -> tuple[str, ...]:
        """The files that a student has to hand in for this scenario: programs, then parameter files, or a recording.

        None for a test: only its run shows which programs it needs.
        """
        if self.test is not None:
            return ()
        if self.handed_in is not None:
            return (self.handed_in.bag,)
        used = (*self.processes, *(options.parameters_file for _, options in self.run if options.parameters_file))
        own = dict(self.provided)
        return tuple(dict.fromkeys(name for name in used if name not in own))


#: How the names of launch files end: those in Python, XML and YAML.
LAUNCH_ENDINGS = ("launch.py", "launch.xml", "launch.yaml", "launch.yml")


def is_launch_file(name: str) -> bool:
    """Return whether a file is a launch file, by its name, as `ros2 launch` lists them."""
    return name.endswith(LAUNCH_ENDINGS)


#: How the names of the files of rosbag2 recordings end, and what follows if they are compressed as a whole.
BAG_ENDINGS, BAG_COMPRESSED = (".mcap", ".db3"), ".zstd"


def is_bag_file(name: str) -> bool:
    """Return whether a file is one of a recording, by its name."""
    return name.casefold().removesuffix(BAG_COMPRESSED).endswith(BAG_ENDINGS)


def is_bag_pattern(wanted: str) -> bool:
    """Return whether the name of a wanted file is the pattern of a recording: no program has such a name."""
    return "/" not in wanted and not wanted.endswith((".py", ".yaml", ".yml", ".xml"))


def wants_bag(wanted: Iterable[str]) -> bool:
    """Return whether a recording is among the wanted files."""
    return any(map(is_bag_pattern, wanted))
