"""The recorded messages of a topic, played with their original timing; `bag.py` reads them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import Kind, MessageType, Topic
from grader.runtime.model.scenario import Event, LongTime, Planned, Stimulus, Time, longest
from grader.runtime.stimuli.drawing import Draws, drawn_time
from grader.runtime.stimuli.events import Appear, Disappear, TopicEvent
from grader.runtime.stimuli.phrases import time_phrase


@dataclass(frozen=True, slots=True)
class TimedMessage:
    """A recorded message to be played."""

    t_ns: int  # time since the start of the stream
    cdr: bytes  # the message as it goes over the wire (CDR with its 4-byte header)
    value: Mapping[str, Any]  # the decoded fields, for judging


@dataclass(frozen=True, slots=True)
class Recording:
    """The recorded messages of one topic.

    Attributes:
        topic: Absolute name of the recorded topic.
        type: Type of its messages.
        messages: In order of receive time, which starts at 0 and strictly increases; at least one.
        began_ns: When the first one was received, in nanoseconds since 1970.
    """

    topic: str
    type: str
    messages: tuple[TimedMessage, ...]
    began_ns: int = field(default=0, compare=False)

    @property
    def span_ns(self) -> int:
        """Time from the first to the last message."""
        return self.messages[-1].t_ns


def window(recording: Recording, *, duration_ns: int, seed: int) -> tuple[TimedMessage, ...]:
    """Cut a window out of a recording, with times counted from its first message.

    Args:
        recording: The recording.
        duration_ns: Minimum time from first to last message of the window; a shorter recording is returned whole.
        seed: Determines where the window starts.
    """
    messages = recording.messages
    latest_ns = messages[-1].t_ns - duration_ns
    starts = max(1, sum(m.t_ns <= latest_ns for m in messages))
    drawn = hashlib.sha256(f"odometry window {seed}".encode()).digest()
    first = int.from_bytes(drawn[:8], "big") % starts
    start_ns = messages[first].t_ns
    stop = next((i for i, m in enumerate(messages) if m.t_ns >= start_ns + duration_ns), len(messages) - 1)
    return tuple(TimedMessage(m.t_ns - start_ns, m.cdr, m.value) for m in messages[first : stop + 1])


@dataclass(frozen=True, slots=True)
class PublishRecorded(TopicEvent):
    """Publish a message of a recording."""

    cdr: bytes
    value: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class PlannedRecording(Planned):
    """Recorded messages to publish unchanged: `(t_ns, cdr, value)`."""

    topic: str
    type: str
    start_ns: int
    stop_ns: int
    messages: tuple[tuple[int, bytes, Mapping[str, Any]], ...]

    def events(self) -> Iterator[Event]:
        """Yield the publisher, its messages, and its end."""
        yield Appear(self.start_ns, self.topic, self.type, fixed=True)
        for t_ns, cdr, value in self.messages:
            yield PublishRecorded(t_ns, self.topic, cdr, value)
        yield Disappear(self.stop_ns, self.topic)


@dataclass(frozen=True, slots=True)
class RecordedStream(Stimulus):
    """A stimulus: the recorded messages of a topic.

    They are played with their original timing by a publisher that disappears afterwards.
    """

    key: ClassVar[str] = "recorded"
    becomes = PlannedRecording
    shown: ClassVar[Mapping[str, Any]] = {"start": 0, "bag": ""}

    topic: Topic  # topic name, absolute
    type: MessageType  # type of the messages, e.g. `sensor_msgs/msg/LaserScan`
    # The rosbag2 recording beside the rubric: a folder, or a .mcap or .db3 file. If it has no messages of this type on
    # the topic, the topic with most of them is played. Without one, a minute of odometry that ships with the grader.
    bag: Annotated[str, Kind("recording")]
    start_ns: Time  # when the publisher appears and the first message is sent
    duration_ns: LongTime  # how much of the recording is played; which part is drawn from the seed

    def planned(self, draws: Draws) -> PlannedRecording:
        """Draw which part is played."""
        seed = draws.shared.getrandbits(32)
        start_ns, duration_ns = drawn_time(self.start_ns, draws.own), drawn_time(self.duration_ns, draws.own)
        messages = window(draws.recordings[self], duration_ns=duration_ns, seed=seed)
        kept = tuple((start_ns + m.t_ns, m.cdr, m.value) for m in messages if m.t_ns <= duration_ns)
        return PlannedRecording(
            topic=self.topic,
            type=self.type,
            start_ns=start_ns,
            stop_ns=kept[-1][0] + 1 if kept else start_ns,
            messages=kept,
        )

    def phrase(self) -> str:
        """Return what the grader does, as a part of a sentence."""
        played = f"from {time_phrase(self.start_ns)} on for {time_phrase(self.duration_ns)}"
        return f"the grader plays recorded {self.type} on {self.topic}, {played}"

    def course_ns(self) -> int:
        """Return the latest time at which it has been played."""
        return longest(self.start_ns) + longest(self.duration_ns)

    def beside(self, folder: str) -> Self:
        """Return it with the path of its recording; without one, a recording that ships with the grader is played."""
        return replace(self, bag=str(Path(folder, self.bag))) if self.bag else self
