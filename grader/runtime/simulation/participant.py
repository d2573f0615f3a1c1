"""The base class of simulations: what a participant publishes, hears and answers, and when it is asked to act."""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S, seconds
from grader.runtime.model.worlds import Sketch, WallMap

#: The shortest time between two steps of a simulation: no sensor is faster, and each step takes the grader's time.
SHORTEST_PERIOD_NS = NS_PER_MS
#: The topics that a simulation listens to, each with the message type that it takes, or with several.
Hears = Mapping[str, str | tuple[str, ...]]
#: A message to publish: its topic, and its fields as plain values, nested by name; fields left out keep their defaults.
Output = tuple[str, Mapping[str, Any]]


@dataclass(frozen=True, slots=True)
class Moment:
    """A moment of a recording."""

    t_ns: int  # time since the scenario began, in nanoseconds; never less than that of an earlier moment
    clock_ns: int  # what the clock of the student's node shows, in nanoseconds since 1970

    @property
    def t_s(self) -> float:
        """Time since the scenario began, in seconds."""
        return seconds(self.t_ns)

    @property
    def stamp(self) -> dict[str, int]:
        """The time for a header, as the fields of builtin_interfaces/msg/Time."""
        return {"sec": self.clock_ns // NS_PER_S, "nanosec": self.clock_ns % NS_PER_S}


class Simulation:
    """A participant of a scenario that reacts to what the student's nodes publish.

    A subclass is a dataclass: its fields are its parameters in rubrics, and each may be drawn from the seed there. It
    may hold state; every recording begins with a new instance. Its methods depend on nothing but their arguments, the
    state and `draw`: no clocks, files or other sources of chance. On the virtual clock, a program that does the same
    again is then answered the same again, to the last bit.

    Attributes:
        period: Nanoseconds between two calls of `step`, at least a millisecond; the first call is at the beginning.
        maps: The maps that the rubric lists under `maps`, by name; there from `begin` on.
    """

    period: int = NS_PER_S // 20
    maps: Mapping[str, WallMap] = MappingProxyType({})

    def publishes(self) -> Mapping[str, str]:
        """Return the topics that it publishes on, with their message types."""
        return {}

    def records(self) -> Mapping[str, str]:
        """Return the topics that it only records, with their message types: checks read them, and no node hears them.

        `step` and `on_message` give messages on them as on those that it publishes on.
        """
        return {}

    def hears(self) -> Hears:
        """Return the topics that it listens to, with their message types; messages of another type are not for it.

        A topic on which it understands several types has a tuple of them.
        """
        return {}

    def serves(self) -> Mapping[str, str]:
        """Return the services that it offers, with their types."""
        return {}

    def begin(self, draw: random.Random) -> None:
        """Prepare for a recording.

        Args:
            draw: Source of chance for noise; it follows from the seed of the submission.
        """

    def step(self, now: Moment) -> Iterable[Output]:
        """Let time pass, and return the messages to publish; called once per period."""
        return ()

    def on_message(self, now: Moment, topic: str, message: Mapping[str, Any]) -> Iterable[Output]:
        """React to a message of a student's node, and return the messages to publish at once.

        Args:
            now: When the message was published.
            topic: One of `hears`.
            message: Its fields as plain values, nested by name; numbers may be NaN or infinite.
        """
        return ()

    def on_request(self, now: Moment, service: str, request: Mapping[str, Any]) -> Mapping[str, Any]:
        """Answer a request of a student's client, and return the fields of the response."""
        return {}

    def drawing(self) -> Iterable[Sketch]:
        """Return a picture of what has happened, seen from above; asked once, at the end of a recording."""
        return ()


def types_heard(hears: Hears) -> dict[str, tuple[str, ...]]:
    """Return the types that a simulation takes on each topic."""
    return {topic: (types,) if isinstance(types, str) else tuple(types) for topic, types in hears.items()}
