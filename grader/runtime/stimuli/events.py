"""Events of more than one kind of stimulus: publishers that appear and disappear; and the order of all events."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.scenario import Event


@dataclass(frozen=True, slots=True)
class TopicEvent(Event):
    """An event on a topic, which happens whether or not any node is still running."""

    topic: str


@dataclass(frozen=True, slots=True)
class Appear(TopicEvent):
    """Create a publisher of the type that subscriptions ask for, or of this type alone if it is fixed."""

    creates: ClassVar[bool] = True

    type: str
    fixed: bool = False
    field: str = ""  # name of the field that holds a number to publish; see `numeric_field`


@dataclass(frozen=True, slots=True)
class Disappear(TopicEvent):
    """Remove a publisher."""


def events_in_order(events: Iterable[Event]) -> list[Event]:
    """Sort events by time; at time 0, endpoints are created before anything else happens."""
    return sorted(events, key=lambda event: (event.t_ns, event.t_ns == 0 and not event.creates))
