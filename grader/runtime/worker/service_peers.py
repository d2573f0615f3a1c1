"""Tracks the grader's service servers and clients of one run, with their requests and responses; for both clocks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from types import MappingProxyType
from typing import Any

from grader.runtime.message_classes import built, plain_fields, wanted_class
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.scenario import Event
from grader.runtime.model.trace import Mark, Request, Response
from grader.runtime.plan import Plan
from grader.runtime.stimuli.calls import Ask, PlannedCall, PlannedCalls
from grader.runtime.stimuli.server import PlannedServer, Respond
from grader.runtime.worker.observer import size_of
from grader.runtime.worker.service_ends import Arrived, ServiceEnds
from grader.runtime.worker.trace_recorder import TraceRecorder

#: The most requests and responses that are held before they are recorded.
UNREAD = 50_000
#: What says that a response comes later: the request stays open until then.
LATER: Mapping[str, Any] = MappingProxyType({})
#: The sender of a request or response.
GRADER, STUDENT = "grader", "student"


@dataclass(slots=True)
class _Served:
    """A server that exists now."""

    plan: PlannedServer
    taken: int = 0
    # Header of each open request, and the fields of its response
    unanswered: dict[int, tuple[Any, Mapping[str, Any]]] = field(default_factory=dict)


class ServicePeers:
    """Creates servers and clients, and sends and records requests and responses.

    Args:
        plan: Provides the servers and calls.
        ends: The servers and clients of the grader's node.
        recorder: Records requests and responses.
        nodes: Returns the names of the students' nodes.
        later: Schedules an event.
        simulated: Returns the response of a simulation to a request at a time, which has a number among those to its
            service; None if none offers the service, and `LATER` if it comes later.

    Raises:
        HarnessError: The plan names a type or field that is unknown on this machine.
    """

    def __init__(  # noqa: PLR0913 - all that a server or client can depend on
        self,
        plan: Plan,
        ends: ServiceEnds,
        recorder: TraceRecorder,
        *,
        nodes: Callable[[], Sequence[str]],
        later: Callable[[Event], None],
        simulated: Callable[[int, str, Mapping[str, Any], int], Mapping[str, Any] | None] = lambda *_: None,
    ) -> None:
        self._ends = ends
        self._recorder = recorder
        self._nodes = nodes
        self._later = later
        self._simulated = simulated
        self._message_bytes = plan.limits.message_bytes
        self._servers: dict[str, _Served] = {}
        self._requests: Counter[str] = Counter()
        self._clients: dict[tuple[str, int, int], int] = {}
        self._called: dict[str, str] = {}
        self._kept: list[PlannedCalls] = []  # clients are keyed by the id() of their calls, which must stay alive
        self._open: dict[tuple[str, int, int], tuple[int, PlannedCall]] = {}
        self._waiting: list[Ask] = []
        self._arrived: list[Arrived] = []
        self._large = False
        check_types(plan)

    def serves(self, service: str, interface: str) -> bool:
        """Return whether the grader has a server for a service and type now."""
        served = self._servers.get(service)
        return served is not None and served.plan.type == interface

    def ends_of(self, kind: str, service: str) -> int:
        """Return the number of the grader's servers (`service`) or clients (`client`) of a service."""
        if kind == "service":
            return int(service in self._servers)
        return sum(asked == service for asked, _, _ in self._clients)

    def clients_of(self, service: str) -> int:
        """Return the number of the client of a service that was created last."""
        return max((number for (asked, _, _), number in self._clients.items() if asked == service), default=0)

    def calls(self) -> dict[str, str]:
        """Return the services that the grader has clients for, with their types."""
        return self._called

    def add_server(self, now_ns: int, server: PlannedServer) -> None:
        """Create a server."""
        self._ends.add_server(server.service, server.type)
        self._servers[server.service] = _Served(server)
        self._recorder.add(Mark(now_ns, "server_starts", server.service))

    def remove_server(self, now_ns: int, server: PlannedServer) -> None:
        """Destroy a server, if it still exists; its open requests stay unanswered."""
        served = self._servers.get(server.service)
        # The plan may have put another server in its place since.
        if served is not None and served.plan is server:
            del self._servers[server.service]
            self._ends.remove_server(server.service)
            self._recorder.add(Mark(now_ns, "server_stops", server.service))

    def done(self) -> list[PlannedServer]:
        """Return the servers that have given all their answers and received one more request."""
        return [s.plan for s in self._servers.values() if 0 < s.plan.answers < s.taken and not s.unanswered]

    def add_clients(self, calls: PlannedCalls) -> str | None:
        """Create the clients of some calls, and return the service; None while its name is not known."""
        service = self.resolved(calls.service)
        if service is None:
            return None
        for client in range(calls.clients):
            key = (service, id(calls), client)
            if key not in self._clients:
                self._called[service] = calls.type
                self._kept.append(calls)
                number = 1 + sum(known == service for known, _, _ in self._clients)
                self._clients[key] = number
                self._ends.add_client(service, calls.type, number)
        return service

    def resolved(self, service: str) -> str | None:
        """Return the absolute name of a service; `~` stands for the only node, and gives None unless there is one."""
        if not service.startswith("~"):
            return service
        nodes = self._nodes()
        return nodes[0] + service[1:] if len(nodes) == 1 else None

    def call(self, now_ns: int, call: PlannedCall) -> str:
        """Send a request, and return the service; its clients must exist."""
        calls = call.calls
        service = self.add_clients(calls) or calls.service
        number = self._clients[service, id(calls), call.client]
        request = built(wanted_class(calls.type, "srv", service).Request, calls.requests[call.index], service)
        count = self._numbered(service, GRADER)
        value = plain_fields(request)
        self._recorder.exchange(Request(now_ns, service, calls.type, count, GRADER, number, value), 0)
        self._open[service, number, self._ends.ask(service, number, request)] = (count, call)
        return service

    def wait(self, due: Ask) -> None:
        """Keep a call until its server exists."""
        self._waiting.append(due)

    def ready(self, is_served: Callable[[PlannedCalls], bool]) -> list[Ask]:
        """Remove and return the waiting calls whose servers exist now."""
        calls = {id(due.call.calls): due.call.calls for due in self._waiting}
        served = {key for key, one in calls.items() if is_served(one)}
        found = [due for due in self._waiting if id(due.call.calls) in served]
        self._waiting = [due for due in self._waiting if id(due.call.calls) not in served]
        return found

    def expected(self, sent: Mapping[str, int]) -> Counter[str]:
        """Return how many of the messages that a process has sent, by channel, the grader should receive."""
        expected: Counter[str] = Counter()
        for channel, count in sent.items():
            kind, _, service = channel.partition(" ")
            if kind == "request" and service in self._servers:
                expected[channel] = count
            elif kind == "response":
                expected[channel] = min(count, sum(asked == service for asked, _, _ in self._open))
        return +expected

    def take(self) -> Counter[str]:
        """Take the requests and responses that have arrived, and return their number by channel."""
        came: Counter[str] = Counter()
        # Taken from the middleware and not yet recorded: without a bound, a flood would fill the worker.
        if len(self._arrived) > UNREAD:
            return came  # a flood: what has arrived is enough to end the recording
        for service in list(self._servers):
            requests = self._ends.take_requests(service)
            self._arrived += requests
            came[f"request {service}"] += len(requests)
        for service in {asked for asked, _, _ in self._open}:
            responses = self._ends.take_responses(service)
            self._arrived += responses
            came[f"response {service}"] += len(responses)
        return came

    def record(self, now_ns: int) -> None:
        """Record everything that was taken, in the order in which it was sent, and schedule the responses."""
        # By the time of sending: the middleware hands over the requests of two clients in any order.
        arrived, self._arrived = sorted(self._arrived, key=lambda a: (a.sent_ns, a.service)), []
        for one in arrived:
            if one.header is None:
                self._answered(now_ns, one)
            else:
                self._asked(now_ns, one)

    def _asked(self, now_ns: int, request: Arrived) -> None:
        served = self._servers.get(request.service)
        if served is None or 0 < served.plan.answers < served.taken:
            return  # the request before this one ended the server
        plan, number = served.plan, self._numbered(request.service, STUDENT)
        # Numbered before it is known whether its content is kept: a request that is too large counts.
        value, size = self._content(request.message)
        self._recorder.exchange(Request(now_ns, plan.service, plan.type, number, STUDENT, 0, value), size)
        known = size <= self._message_bytes
        # A simulation decides first; a plan has responses only for servers of its own.
        response = self._simulated(now_ns, request.service, value, number) if known else None
        response = plan.response(served.taken) if response is None else response
        if response is not None:
            served.unanswered[number] = (request.header, response)
        if response is not None and response is not LATER:
            self._later(Respond(now_ns + plan.delay_ns, plan, number))
        # Counted last: the index of the response is the number of requests before this one.
        served.taken += 1

    def respond(self, now_ns: int, service: str, number: int, fields: Mapping[str, Any]) -> bool:
        """Send a response that was to come later; return whether it was sent."""
        served = self._servers.get(service)
        if served is None or number not in served.unanswered:
            return False
        served.unanswered[number] = (served.unanswered[number][0], fields)
        return self.answer(now_ns, served.plan, number)

    def answer(self, now_ns: int, server: PlannedServer, number: int) -> bool:
        """Send the response to a request, if the server still exists; return whether it was sent."""
        served = self._servers.get(server.service)
        if served is None or served.plan is not server or number not in served.unanswered:
            return False
        header, fields = served.unanswered.pop(number)
        interface = wanted_class(server.type, "srv", server.service)
        response = built(interface.Response, fields, server.service)
        value = plain_fields(response)
        self._recorder.exchange(Response(now_ns, server.service, server.type, number, GRADER, 0, value), 0)
        self._ends.answer(server.service, header, response)
        return True

    def _answered(self, now_ns: int, response: Arrived) -> None:
        found = self._open.pop((response.service, response.client, response.sequence), None)
        if found is None:
            return
        number, call = found
        value, size = self._content(response.message)
        interface = self.calls()[response.service]
        answer = Response(now_ns, response.service, interface, number, STUDENT, response.client, value)
        self._recorder.exchange(answer, size)
        # A goal that was refused has no result, and nothing that could be canceled.
        for delay_ns, following in call.then if value.get("accepted") else ():
            self._later(Ask(now_ns + delay_ns, following))

    def _content(self, message: Any) -> tuple[dict[str, Any], int]:
        """Return the fields and the size of what a student's node sent; no fields if it is too large."""
        size = size_of(message)
        if size <= self._message_bytes:
            return plain_fields(message), size
        if not self._large:
            self._large = True
            self._recorder.note("a service: the content of a message that is larger than the limit was ignored")
        return {}, size

    def _numbered(self, service: str, sender: str) -> int:
        key = f"{sender} {service}"
        self._requests[key] += 1
        return self._requests[key]


def check_types(plan: Plan) -> None:
    """Check that this machine has every type and field that a plan names; raises HarnessError otherwise."""
    for planned in plan.stimuli:
        check_fields(planned, f"scenario {plan.scenario}, {planned.place}")


def check_fields(planned: Any, where: str) -> None:
    """Check that this machine has the type and the fields of a stimulus; raises HarnessError otherwise."""
    for name, kind, part in planned.holds:
        message, fields = wanted_class(planned.type, kind, where), getattr(planned, name)
        for value in ({}, *((fields,) if isinstance(fields, Mapping) else fields)):
            built(getattr(message, part) if part else message, value, where)
