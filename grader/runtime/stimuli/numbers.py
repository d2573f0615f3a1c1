"""Numbers on a topic, in the message type that the student's node subscribes with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from random import Random
from typing import Annotated, Any, ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import Kind, MessageType, Topic, duration
from grader.runtime.model.scenario import (
    AnyOrder,
    Between,
    Event,
    FixedTime,
    InOrder,
    JustAbove,
    JustBelow,
    LongTime,
    Planned,
    SomeOf,
    Stimulus,
    Time,
    TimeBetween,
    cases,
    longest,
    shortest,
)
from grader.runtime.stimuli.drawing import Draws, drawn_time, in_drawn_order
from grader.runtime.stimuli.events import Appear, TopicEvent
from grader.runtime.stimuli.phrases import cases_phrase, time_phrase

NumberSpec = float | Between | JustAbove | JustBelow
#: A number, or several numbers with an order.
NumberItem = NumberSpec | AnyOrder | InOrder | SomeOf
#: A number to publish, or the limit it lies just above (1) or just below (-1) in the student's own type.
PlannedNumber = tuple[float, int]


@dataclass(frozen=True, slots=True)
class PublishNumber(TopicEvent):
    """Publish a number in the publisher's type; the second value is the side of a limit: 1 above, -1 below, 0 none."""

    number: PlannedNumber


@dataclass(frozen=True, slots=True)
class PlannedNumbers(Planned):
    """Numbers to publish in the type that the student's node subscribes with."""

    topic: str
    type: str
    start_ns: int
    period_ns: int
    repeats: int
    numbers: tuple[PlannedNumber, ...]
    field: str = ""

    def events(self) -> Iterator[Event]:
        """Yield the publisher, which is never removed, and each number as often as it is repeated."""
        yield Appear(0, self.topic, self.type, field=self.field)
        for index in range(len(self.numbers) * self.repeats):
            yield PublishNumber(self.start_ns + index * self.period_ns, self.topic, self.numbers[index // self.repeats])


@dataclass(frozen=True, slots=True)
class NumberStream(Stimulus):
    """A stimulus: numbers published on a topic, each held for a while.

    They are published with the message type that the student's node subscribes to.
    """

    key: ClassVar[str] = "numbers"
    becomes = PlannedNumbers
    shown: ClassVar[Mapping[str, Any]] = {"start": 0, "field": None}
    follows_type: ClassVar[bool] = True

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

    def planned(self, draws: Draws) -> PlannedNumbers:
        """Draw the numbers from what all of the scenario are drawn from, and their times and order."""
        start_ns = drawn_time(self.start_ns, draws.own)
        numbers = tuple(_number(spec, draws.shared) for spec in in_drawn_order(self.values, draws.own))
        repeats = max(1, shortest(self.hold_ns) // self.period_ns)
        if isinstance(self.hold_ns, TimeBetween) and numbers:
            each = [max(1, drawn_time(self.hold_ns, draws.own) // self.period_ns) for _ in numbers]
            # a node may switch off when messages stop, so the last number is repeated until the observation ends
            each[-1] = max(each[-1], -(-(draws.until_ns - start_ns) // self.period_ns) - sum(each[:-1]))
            numbers, repeats = tuple(n for n, times in zip(numbers, each, strict=True) for _ in range(times)), 1
        return PlannedNumbers(self.topic, self.type, start_ns, self.period_ns, repeats, numbers, self.field)

    def phrase(self) -> str:
        """Return what the grader does, as a part of a sentence."""
        pace = f"one every {duration(self.period_ns)}, each value for {time_phrase(self.hold_ns)}"
        return f"the grader publishes {cases_phrase(self.values, 'values')} on {self.topic}, {pace}"

    def course_ns(self) -> int:
        """Return the latest time at which each number has been held."""
        return longest(self.start_ns) + cases(self.values)[1] * longest(self.hold_ns)

    def mistakes(self) -> Iterator[tuple[str, str]]:
        """Yield a `hold` that is too short."""
        if shortest(self.hold_ns) < self.period_ns:
            yield "hold", "expected each number to be held for at least one period, found a shorter `hold`"


def _number(spec: NumberSpec, draw: Random) -> PlannedNumber:
    if isinstance(spec, Between):
        if float(spec.low).is_integer() and float(spec.high).is_integer():
            return float(draw.randint(int(spec.low), int(spec.high))), 0
        # Two decimals: exactly what a student's "%.2f" shows.
        return round(draw.uniform(spec.low, spec.high), 2), 0
    if isinstance(spec, JustAbove):
        return spec.limit, 1
    if isinstance(spec, JustBelow):
        return spec.limit, -1
    return spec, 0
