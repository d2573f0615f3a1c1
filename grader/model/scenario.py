"""Scenarios: one simulated situation with its duration, stimuli and limits; no marks and no answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from grader.model.limits import Limits
from grader.model.quantities import NS_PER_S


@dataclass(frozen=True, slots=True)
class Span:
    """How long a scenario is observed.

    Attributes:
        duration_ns: Observed time.
        after_first_message_on: If set, observation starts with the first message on this topic.
        wait_at_most_ns: How long that first message is waited for.
    """

    duration_ns: int
    after_first_message_on: str | None = None
    wait_at_most_ns: int = 60 * NS_PER_S


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


@dataclass(frozen=True, slots=True)
class NumberStream:
    """A stimulus: numbers published on a topic, each held for a while, in the type that the student's node takes.

    Attributes:
        topic: Topic name, absolute.
        type: Message type used while no subscription tells another, e.g. `std_msgs/msg/Float32`.
        values: Numbers in order.
        period_ns: Time between two messages.
        hold_ns: How long each number is repeated.
        start_ns: Time of the first message since scenario start.
    """

    topic: str
    type: str
    values: tuple[NumberSpec, ...]
    period_ns: int
    hold_ns: int
    start_ns: int


@dataclass(frozen=True, slots=True)
class OdometryStream:
    """A stimulus: the recorded odometry, played with its own timing by a publisher that then disappears.

    Attributes:
        topic: Topic name, absolute.
        start_ns: When the publisher appears and the first message is sent.
        duration_ns: How much of the recording is played; which part is drawn from the seed.
    """

    topic: str
    start_ns: int
    duration_ns: int


Stimulus = NumberStream | OdometryStream


@dataclass(frozen=True, slots=True)
class Scenario:
    """One situation that is recorded once.

    Attributes:
        id: Unique within the exercise.
        processes: File names of the student processes that run in it, in start order.
        span: How long it is observed.
        stimuli: What the grader publishes.
        limits: How much the processes may use, and how much is recorded.
    """

    id: str
    processes: tuple[str, ...]
    span: Span
    stimuli: tuple[Stimulus, ...] = ()
    limits: Limits = Limits()  # noqa: RUF009 - a value that never changes


@dataclass(frozen=True, slots=True)
class TimedMessage:
    """A recorded message to be played.

    Attributes:
        t_ns: Time since the start of the stream.
        cdr: The message as it goes over the wire (CDR with its 4-byte header).
        value: The decoded fields that judging reads.
    """

    t_ns: int
    cdr: bytes
    value: Mapping[str, Any]
