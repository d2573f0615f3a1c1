"""A table of checks of our own: reading is tested without the checks that really judge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from grader.runtime.model.quantities import DurationNs, Hertz


@dataclass(frozen=True, slots=True)
class Publishes:
    """Is there a message of a type on a topic?"""

    topic: str
    type: str


@dataclass(frozen=True, slots=True)
class TopicRate:
    """Does a topic keep a rate?"""

    topic: str
    rate: Hertz
    tolerance: Hertz
    window: DurationNs
    partly_tolerance: Hertz | None = None

    def __post_init__(self) -> None:
        if not self.rate > 0:
            raise ValueError("the rate must be above 0 Hz")


@dataclass(frozen=True, slots=True)
class FieldValues:
    """Do fields hold values?"""

    topic: str
    values: Mapping[str, float]
    tolerance: float = 1e-6


@dataclass(frozen=True, slots=True)
class UsesLogger:
    """Does a process log?"""

    process: str


@dataclass(frozen=True, slots=True)
class Point:
    """A nested value."""

    x: float
    after: DurationNs = 5


@dataclass(frozen=True, slots=True)
class Everything:
    """Every kind of parameter that a check may have."""

    word: str
    count: int
    flag: bool
    side: Literal["above", "at_or_below"]
    pair: tuple[float, str]
    many: tuple[Point, ...] = ()
    one: Point | None = None
    copy: str = "a name that pydantic models have themselves"
    times: tuple[DurationNs, ...] = ()


CHECKS: dict[str, type] = {
    "publishes": Publishes,
    "topic_rate": TopicRate,
    "field_values": FieldValues,
    "uses_logger": UsesLogger,
    "everything": Everything,
}
