"""The result of recording submissions several times under conditions that must not matter."""

from __future__ import annotations

from dataclasses import field
from enum import Enum

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import Observation


class DifferenceKind(str, Enum):
    """In what two recordings of the same programs differ first."""

    TIME = "time"  # the same event at another time
    ORDER = "order"  # the same events in another order
    CONTENT = "content"  # another event, or one that is missing
    CLOCK = "clock"  # virtual time suits the programs in one of them only
    GRADER = "grader"  # the programs did the same; what differs is only what the grader saw, such as the ROS graph


class Cause(str, Enum):
    """What a program does that makes it differ from run to run, as far as its text tells."""

    ADDRESS = "address"  # it shows the address of an object
    PROCESSOR_TIME = "processor_time"  # it reads the processor time that it used
    KERNEL = "kernel"  # it reads file times, or files of the kernel
    UNKNOWN = ""


class ConditionState(str, Enum):
    """What became of one condition."""

    SAME = "same"  # each compared scenario is the same, event by event
    DIFFERENT = "different"  # one of them is not
    NOT_TRIED = "not_tried"  # this machine cannot make it, or there was nothing to compare
    FAILED = "failed"  # the grader or the machine failed, so that a scenario could not be compared


@dataclass(frozen=True, slots=True)
class RecordingFact:
    """What belongs to a recording as a whole."""

    name: str  # such as `notes`
    text: str  # its value, shortened


@dataclass(frozen=True, slots=True)
class Difference:
    """The first difference between two recordings of a scenario.

    A side is None if that recording has ended before. The line is that of the log record, of the fault, or of the call
    that creates the publisher; 0 if it is not known.
    """

    kind: DifferenceKind
    number: int  # number of the event in the first recording, from 1; 0 for a fact
    first: Observation | RecordingFact | None  # what the first recording has
    other: Observation | RecordingFact | None  # what the recording under the condition has
    process: str = ""  # file name of the process; empty if it is not known
    file: str = ""
    line: int = 0
    cause: Cause = Cause.UNKNOWN


@dataclass(frozen=True, slots=True)
class Place:
    """One scenario of one submission."""

    submission: str  # its path as the user typed it
    exercise: str
    scenario: str


@dataclass(frozen=True, slots=True)
class Tried:
    """One condition, and what became of it."""

    name: str  # such as `order`, as `--condition` takes it
    words: str  # what is different under it, as a phrase
    state: ConditionState
    why: str = ""  # why it was not tried, or what failed; empty otherwise
    compared: int = 0  # how many scenarios were compared
    different: tuple[tuple[Place, Difference], ...] = ()  # the first difference of each scenario that differs


@dataclass(frozen=True, slots=True)
class LeftOutScenario:
    """A scenario that is not comparable event by event, because the wall clock decides it."""

    place: Place
    why: str  # why virtual time does not suit its programs


@dataclass(frozen=True, slots=True)
class Verification:
    """What is known after recording submissions under several conditions."""

    submissions: tuple[str, ...]  # their paths as the user typed them
    seeds: tuple[int, ...]  # the seed of each
    isolation: str  # the sandbox of the first recording
    scenarios: int  # how many scenarios the first recording has
    events: int  # how many events it has that are compared
    tried: tuple[Tried, ...]  # in the order in which they were tried
    left_out: tuple[LeftOutScenario, ...] = ()
    problems: tuple[str, ...] = field(default=())  # why a part of the first recording cannot be compared, as sentences

    @property
    def state(self) -> ConditionState:
        """The result: different if anything differs, failed if nothing could be compared or a part failed."""
        states = {one.state for one in self.tried}
        if ConditionState.DIFFERENT in states:
            return ConditionState.DIFFERENT
        failed = ConditionState.FAILED in states or bool(self.problems) or not any(one.compared for one in self.tried)
        return ConditionState.FAILED if failed else ConditionState.SAME
