"""Clients that call the student's server."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Annotated, Any, ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S, Kind, ServiceType, Topic, duration
from grader.runtime.model.scenario import (
    Content,
    Count,
    Event,
    FieldsItem,
    FixedTime,
    Planned,
    Stimulus,
    Time,
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
from grader.runtime.stimuli.phrases import count_phrase, time_phrase


@dataclass(frozen=True, slots=True)
class PlannedCalls(Planned):
    """Calls with every request drawn, `clients` of them for each call in turn."""

    holds: ClassVar[tuple[Content, ...]] = (Content("requests", "srv", "Request"),)

    service: str
    type: str
    start_ns: int
    period_ns: int
    clients: int
    requests: tuple[Fields, ...]

    @property
    def place(self) -> str:
        """What it is in a message about a mistake in it."""
        return f"calls of {self.service}"

    def events(self) -> Iterator[Event]:
        """Yield the clients, and the calls of all of them at once, in the order of the clients."""
        yield AddClients(self.start_ns, self)
        for index in range(len(self.requests)):
            yield Ask(self.start_ns + index // self.clients * self.period_ns, PlannedCall(self, index))


@dataclass(frozen=True, slots=True)
class PlannedCall:
    """One request to send.

    Attributes:
        calls: The calls that it belongs to.
        index: Its index in them, from 0.
        then: Requests to send if the response accepts this one, each with its delay after the response.
    """

    calls: PlannedCalls
    index: int
    then: tuple[tuple[int, PlannedCall], ...] = ()

    @property
    def client(self) -> int:
        """Index of the client that sends the request, from 0."""
        return self.index % self.calls.clients


@dataclass(frozen=True, slots=True)
class AddClients(Event):
    """Create the clients of some calls."""

    creates: ClassVar[bool] = True

    calls: PlannedCalls


@dataclass(frozen=True, slots=True)
class Ask(Event):
    """Send a client's request."""

    call: PlannedCall


@dataclass(frozen=True, slots=True)
class ServiceCalls(Stimulus):
    """A stimulus: clients that call the student's server; a call waits until the server exists."""

    key: ClassVar[str] = "calls"
    becomes = PlannedCalls
    shown: ClassVar[Mapping[str, Any]] = {"requests": ({},)}

    # Absolute name; `~/NAME` is a service of the student's only node. Parameters and lifecycle transitions are calls of
    # the services behind them.
    service: Topic
    type: ServiceType  # e.g. `std_srvs/srv/Trigger`
    # Fields of each request in order; with fewer requests than calls, they repeat from the first one
    requests: Annotated[tuple[FieldsItem, ...], Kind("messages")] = field(hash=False)
    calls: Count = 1  # number of requests of each client
    # Number of clients; all of them send their k-th call at the same instant
    clients: Annotated[int, Kind("clients")] = 1
    period_ns: FixedTime = NS_PER_S  # time between two calls of a client, which does not wait for responses
    start_ns: Time = 0  # when the clients appear and send their first call

    def planned(self, draws: Draws) -> PlannedCalls:
        """Draw every request, separately for each call and client."""
        start_ns, count = drawn_time(self.start_ns, draws.own), drawn_count(self.calls, draws.own)
        requests = in_drawn_order(self.requests, draws.own)
        wanted = [requests[call % len(requests)] for call in range(count) for _ in range(self.clients)]
        asked = tuple(drawn_fields(request, draws.own) for request in wanted)
        return planned_as(PlannedCalls, self, start_ns=start_ns, requests=asked)

    def phrase(self) -> str:
        """Return what the grader does, as a part of a sentence."""
        who = "a client" if self.clients == 1 else f"{self.clients} clients"
        times = "once" if self.calls == 1 else f"{count_phrase(self.calls)} times"
        pace = f"{times} from {time_phrase(self.start_ns)} on, every {duration(self.period_ns)}"
        return f"{who} of the grader's calling {self.service} {pace}"

    def course_ns(self) -> int:
        """Return the latest time at which a period has passed after the last call."""
        return longest(self.start_ns) + most(self.calls) * self.period_ns
