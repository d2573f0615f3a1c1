"""A server that answers the student's client."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Annotated, Any, ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import Kind, ServiceType, Topic
from grader.runtime.model.scenario import Content, CountOrNever, Event, FieldsItem, Planned, Stimulus, Time, TimeOrNever
from grader.runtime.stimuli.drawing import (
    Draws,
    Fields,
    drawn_count,
    drawn_fields,
    drawn_time,
    in_drawn_order,
    planned_as,
)
from grader.runtime.stimuli.phrases import cases_phrase, is_drawn, time_phrase


@dataclass(frozen=True, slots=True)
class PlannedServer(Planned):
    """A server with every response drawn."""

    holds: ClassVar[tuple[Content, ...]] = (Content("responses", "srv", "Response"),)

    service: str
    type: str
    start_ns: int
    stop_ns: int
    delay_ns: int
    cycle: bool
    answers: int
    responses: tuple[Fields, ...]

    @property
    def place(self) -> str:
        """What it is in a message about a mistake in it."""
        return f"server of {self.service}"

    def events(self) -> Iterator[Event]:
        """Yield when it comes and goes; each response follows from a request."""
        yield AddServer(self.start_ns, self)
        if self.stop_ns:
            yield RemoveServer(self.stop_ns, self)

    def response(self, index: int) -> Fields | None:
        """Return the fields of the response to a request, counted from 0; None if it gets no response."""
        if not self.responses or (self.answers and index >= self.answers):
            return None
        return self.responses[index % len(self.responses) if self.cycle else min(index, len(self.responses) - 1)]


@dataclass(frozen=True, slots=True)
class AddServer(Event):
    """Create a server."""

    creates: ClassVar[bool] = True

    server: PlannedServer


@dataclass(frozen=True, slots=True)
class RemoveServer(Event):
    """Remove a server."""

    server: PlannedServer


@dataclass(frozen=True, slots=True)
class Respond(Event):
    """Send a server's response to the request with a number."""

    server: PlannedServer
    number: int


@dataclass(frozen=True, slots=True)
class ServiceServer(Stimulus):
    """A stimulus: a server that answers the student's client; without responses it never answers."""

    key: ClassVar[str] = "server"
    becomes = PlannedServer
    shown: ClassVar[Mapping[str, Any]] = {"stop": None, "answers": None}

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

    def planned(self, draws: Draws) -> PlannedServer:
        """Draw every response once: a response that is sent again has the same values."""
        return planned_as(
            PlannedServer,
            self,
            start_ns=drawn_time(self.start_ns, draws.own),
            delay_ns=drawn_time(self.delay_ns, draws.own),
            answers=drawn_count(self.answers, draws.own),
            responses=tuple(drawn_fields(one, draws.own) for one in in_drawn_order(self.responses, draws.own)),
        )

    def phrase(self) -> str:
        """Return what the grader does, as a part of a sentence."""
        answers = f" with {cases_phrase(self.responses, 'responses')}" if is_drawn(self.responses) else ""
        return f"the grader offers the service {self.service}{answers} from {time_phrase(self.start_ns)} on"
