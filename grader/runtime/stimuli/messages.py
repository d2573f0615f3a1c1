"""Messages of one type on a topic, whatever the student's node subscribes with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Annotated, Any, ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S, Kind, MessageType, Topic, duration
from grader.runtime.model.scenario import (
    Content,
    Count,
    CountBetween,
    Event,
    FieldsItem,
    FixedTime,
    Planned,
    Stimulus,
    Time,
    TimeOrNever,
    cases,
    longest,
    most,
)
from grader.runtime.stimuli.drawing import (
    Draws,
    Fields,
    drawn_count,
    drawn_fields,
    drawn_time,
    in_drawn_order,
    planned_as,
)
from grader.runtime.stimuli.events import Disappear, TopicEvent
from grader.runtime.stimuli.phrases import cases_phrase, count_phrase, time_phrase


@dataclass(frozen=True, slots=True)
class PlannedMessages(Planned):
    """A message stream with every field drawn."""

    holds: ClassVar[tuple[Content, ...]] = (Content("values", "msg"),)

    topic: str
    type: str
    start_ns: int
    stop_ns: int
    period_ns: int
    repeats: int
    best_effort: bool
    latched: bool
    values: tuple[Fields, ...]

    @property
    def place(self) -> str:
        """What it is in a message about a mistake in it."""
        return f"messages on {self.topic}"

    def events(self) -> Iterator[Event]:
        """Yield the publisher, its messages until it stops, and its end."""
        yield Advertise(self.start_ns, self.topic, self)
        for index in range(len(self.values) * self.repeats):
            t_ns = self.start_ns + index * self.period_ns
            if not self.stop_ns or t_ns < self.stop_ns:
                yield PublishFields(t_ns, self.topic, self, self.values[index // self.repeats])
        if self.stop_ns:
            yield Disappear(self.stop_ns, self.topic)


@dataclass(frozen=True, slots=True)
class Advertise(TopicEvent):
    """Create a publisher of a fixed type."""

    creates: ClassVar[bool] = True

    stream: PlannedMessages


@dataclass(frozen=True, slots=True)
class PublishFields(TopicEvent):
    """Publish a message of a fixed type."""

    stream: PlannedMessages
    fields: Mapping[str, Any]
    message: Any = field(default=None, compare=False)  # made of these fields; None if it has not been made yet


@dataclass(frozen=True, slots=True)
class MessageStream(Stimulus):
    """A stimulus: messages of one type, one per period; omitted fields keep their defaults."""

    key: ClassVar[str] = "messages"
    becomes = PlannedMessages
    shown: ClassVar[Mapping[str, Any]] = {"period": NS_PER_S, "stop": None}

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

    def planned(self, draws: Draws) -> PlannedMessages:
        """Draw every field, and the order and number of the messages unless they are fixed."""
        draw, repeats = draws.own, self.repeats
        start_ns, values = drawn_time(self.start_ns, draw), in_drawn_order(self.values, draw)
        each = [(value, drawn_count(repeats, draw)) for value in values] if isinstance(repeats, CountBetween) else []
        planned = [drawn_fields(value, draw) for value in values]
        if each:
            planned = [fields for fields, (_, times) in zip(planned, each, strict=True) for _ in range(times)]
        times = 1 if isinstance(repeats, CountBetween) else repeats
        return planned_as(PlannedMessages, self, start_ns=start_ns, repeats=times, values=tuple(planned))

    def phrase(self) -> str:
        """Return what the grader does, as a part of a sentence."""
        pace = f"one every {duration(self.period_ns)} from {time_phrase(self.start_ns)} on"
        times = "" if self.repeats == 1 else f", each {count_phrase(self.repeats)} times"
        return f"the grader publishes {cases_phrase(self.values, 'messages')}{times} on {self.topic}, {pace}"

    def course_ns(self) -> int:
        """Return the latest time at which a period has passed after the last message."""
        return longest(self.start_ns) + cases(self.values)[1] * most(self.repeats) * self.period_ns
