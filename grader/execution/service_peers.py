"""The grader's servers and clients of one run: which are there, what was asked and answered; on either clock."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from grader.core.trace import Mark, Request, Response
from grader.execution.exchanges import PlannedCall, PlannedCalls, PlannedServer
from grader.execution.interfaces import built, plain_fields, wanted_class
from grader.execution.observer import size_of
from grader.execution.plan import Plan
from grader.execution.service_ends import Arrived, ServiceEnds
from grader.execution.stimuli import Ask, Event, Respond
from grader.execution.trace_recorder import TraceRecorder

#: Of a flood of requests and responses no more is taken before it is written down.
UNREAD = 50_000
#: Who sends: the grader itself, or a student's node.
GRADER, STUDENT = "grader", "student"


@dataclass(slots=True)
class _Served:
    """A server that is there."""

    plan: PlannedServer
    taken: int = 0
    unanswered: dict[int, tuple[Any, int]] = field(default_factory=dict)


class ServicePeers:
    """Serves and calls.

    Args:
        plan: Its servers and calls; refused with a HarnessError where a type or field is unknown on this machine.
        ends: The servers and clients of the grader's node.
        recorder: Where requests and responses are taken down.
        nodes: Returns the names of the students' nodes.
        later: Takes what is to be done at a later time.
    """

    def __init__(
        self,
        plan: Plan,
        ends: ServiceEnds,
        recorder: TraceRecorder,
        *,
        nodes: Callable[[], Sequence[str]],
        later: Callable[[Event], None],
    ) -> None:
        self._ends = ends
        self._recorder = recorder
        self._nodes = nodes
        self._later = later
        self._message_bytes = plan.limits.message_bytes
        self._servers: dict[str, _Served] = {}
        self._requests: Counter[str] = Counter()
        self._clients: dict[tuple[str, int, int], int] = {}
        self._called: dict[str, str] = {}
        self._kept: list[PlannedCalls] = []  # clients are known by the identity of their calls, which must last
        self._open: dict[tuple[str, int, int], tuple[int, PlannedCall]] = {}
        self._waiting: list[Ask] = []
        self._arrived: list[Arrived] = []
        self._large = False
        check_types(plan)

    def serves(self, service: str, interface: str) -> bool:
        """Return whether the grader has a server of a service and type now."""
        served = self._servers.get(service)
        return served is not None and served.plan.type == interface

    def ends_of(self, kind: str, service: str) -> int:
        """Return how many servers (`service`) or clients (`client`) of a service the grader has now."""
        if kind == "service":
            return int(service in self._servers)
        return sum(asked == service for asked, _, _ in self._clients)

    def calls(self) -> dict[str, str]:
        """Return the services that the grader has clients of, with their types."""
        return self._called

    def serve(self, now_ns: int, server: PlannedServer) -> None:
        """Let a server appear."""
        self._ends.serve(server.service, server.type)
        self._servers[server.service] = _Served(server)
        self._recorder.add(Mark(now_ns, "server_starts", server.service))

    def dismiss(self, now_ns: int, server: PlannedServer) -> None:
        """Let a server disappear, if it has not done so; what it has not answered stays unanswered."""
        served = self._servers.get(server.service)
        if served is not None and served.plan is server:
            del self._servers[server.service]
            self._ends.dismiss(server.service)
            self._recorder.add(Mark(now_ns, "server_stops", server.service))

    def done(self) -> list[PlannedServer]:
        """Return the servers that were asked once more after all the answers they are to give."""
        return [s.plan for s in self._servers.values() if 0 < s.plan.answers < s.taken and not s.unanswered]

    def meet(self, calls: PlannedCalls) -> str | None:
        """Let the clients of some calls appear, and return the service; None while its name is not known."""
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
                self._ends.meet(service, calls.type, number)
        return service

    def resolved(self, service: str) -> str | None:
        """Return a service by its whole name; one of the only node is known when there is exactly one node."""
        if not service.startswith("~"):
            return service
        nodes = self._nodes()
        return nodes[0] + service[1:] if len(nodes) == 1 else None

    def call(self, now_ns: int, call: PlannedCall) -> str:
        """Send a request, and return the service that was asked; its clients are there."""
        calls = call.calls
        service = self.meet(calls) or calls.service
        number = self._clients[service, id(calls), call.client]
        request = built(wanted_class(calls.type, "srv", service).Request, calls.requests[call.index], service)
        count = self._numbered(service, GRADER)
        value = plain_fields(request)
        self._recorder.exchange(Request(now_ns, service, calls.type, count, GRADER, number, value), 0)
        self._open[service, number, self._ends.ask(service, number, request)] = (count, call)
        return service

    def wait(self, due: Ask) -> None:
        """Keep a call until its server is there."""
        self._waiting.append(due)

    def ready(self, is_served: Callable[[PlannedCalls], bool]) -> list[Ask]:
        """Return the calls whose servers are there now, which wait no longer."""
        calls = {id(due.call.calls): due.call.calls for due in self._waiting}
        served = {key for key, one in calls.items() if is_served(one)}
        found = [due for due in self._waiting if id(due.call.calls) in served]
        self._waiting = [due for due in self._waiting if id(due.call.calls) not in served]
        return found

    def expected(self, sent: Mapping[str, int]) -> Counter[str]:
        """Return how much of what a process has sent, by channel, is to arrive here."""
        expected: Counter[str] = Counter()
        for channel, count in sent.items():
            kind, _, service = channel.partition(" ")
            if kind == "request" and service in self._servers:
                expected[channel] = count
            elif kind == "response":
                expected[channel] = min(count, sum(asked == service for asked, _, _ in self._open))
        return +expected

    def take(self) -> Counter[str]:
        """Take what has arrived, and return how many requests and responses came, by channel."""
        came: Counter[str] = Counter()
        if len(self._arrived) > UNREAD:
            return came  # nobody asks so much: what is there ends the recording
        for service in list(self._servers):
            requests = self._ends.take_requests(service)
            self._arrived += requests
            came[f"request {service}"] += len(requests)
        for service in {asked for asked, _, _ in self._open}:
            responses = self._ends.take_responses(service)
            self._arrived += responses
            came[f"response {service}"] += len(responses)
        return came

    def write_down(self, now_ns: int) -> None:
        """Take down what was taken, in the order in which it was sent, and have requests answered in their time."""
        arrived, self._arrived = sorted(self._arrived, key=lambda a: (a.sent_ns, a.service)), []
        for one in arrived:
            if one.header is None:
                self._answered(now_ns, one)
            else:
                self._asked(now_ns, one)

    def _asked(self, now_ns: int, request: Arrived) -> None:
        served = self._servers.get(request.service)
        if served is None or 0 < served.plan.answers < served.taken:
            return  # it disappears with the request before this one
        plan, number = served.plan, self._numbered(request.service, STUDENT)
        value, size = self._content(request.message)
        self._recorder.exchange(Request(now_ns, plan.service, plan.type, number, STUDENT, 0, value), size)
        if plan.response(served.taken) is not None:
            served.unanswered[number] = (request.header, served.taken)
            self._later(Respond(now_ns + plan.delay_ns, plan, number))
        served.taken += 1

    def answer(self, now_ns: int, server: PlannedServer, number: int) -> bool:
        """Send the response to a request, if the server is still there; return whether it was sent."""
        served = self._servers.get(server.service)
        if served is None or served.plan is not server or number not in served.unanswered:
            return False
        header, index = served.unanswered.pop(number)
        interface = wanted_class(server.type, "srv", server.service)
        response = built(interface.Response, server.response(index) or {}, server.service)
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
        for delay_ns, following in call.then if value.get("accepted") else ():
            self._later(Ask(now_ns + delay_ns, following))

    def _content(self, message: Any) -> tuple[dict[str, Any], int]:
        """Return the fields of what a student's node sent, and its size; of what is too large, none."""
        size = size_of(message)
        if size <= self._message_bytes:
            return plain_fields(message), size
        if not self._large:
            self._large = True
            self._recorder.note("a service: the content of a message that is larger than the limit was not looked at")
        return {}, size

    def _numbered(self, service: str, sender: str) -> int:
        key = f"{sender} {service}"
        self._requests[key] += 1
        return self._requests[key]


def check_types(plan: Plan) -> None:
    """Make sure that this machine has every type a plan names, with the fields; raises HarnessError otherwise."""
    for stream in plan.messages:
        where = f"scenario {plan.scenario}, messages on {stream.topic}"
        message = wanted_class(stream.type, "msg", where)
        for value in stream.values:
            built(message, value, where)
    for server in plan.servers:
        where = f"scenario {plan.scenario}, server of {server.service}"
        for value in ({}, *server.responses):
            built(wanted_class(server.type, "srv", where).Response, value, where)
    for calls in plan.calls:
        where = f"scenario {plan.scenario}, calls of {calls.service}"
        for value in calls.requests:
            built(wanted_class(calls.type, "srv", where).Request, value, where)
    for goal in plan.goals:
        where = f"scenario {plan.scenario}, goal of {goal.action}"
        built(wanted_class(goal.type, "action", where).Goal, goal.goal, where)
