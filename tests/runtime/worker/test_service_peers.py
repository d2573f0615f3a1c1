"""The grader's servers and clients before scripted ends: who is asked, who is answered, and what is taken down."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, cast

import pytest

pytest.importorskip("rclpy")

from scripted import plan
from std_srvs.srv import Trigger

from grader.runtime.host.protocol import Exited
from grader.runtime.model.limits import Limits
from grader.runtime.model.trace import Mark, Request, Response
from grader.runtime.stimuli.calls import Ask, PlannedCall, PlannedCalls
from grader.runtime.stimuli.server import PlannedServer, Respond
from grader.runtime.worker.ending import is_free_exit, is_normal_stop
from grader.runtime.worker.service_ends import Arrived, ServiceEnds
from grader.runtime.worker.service_peers import ServicePeers
from grader.runtime.worker.trace_recorder import TraceRecorder

#: ROS loads a type's support when it is first used, and imports what Python would rather see gone.
pytestmark = pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning")

KIND, NAME = "std_srvs/srv/Trigger", "/battery/get_status"


class Ends:
    """Stands for the servers and clients of the grader's node: what a test lets arrive, and what was done."""

    def __init__(self) -> None:
        self.requests: list[Arrived] = []
        self.responses: list[Arrived] = []
        self.done: list[str] = []

    def add_server(self, service: str, interface: str) -> None:
        self.done.append(f"add server {service} {interface}")

    def remove_server(self, service: str) -> None:
        self.done.append(f"remove {service}")

    def add_client(self, service: str, interface: str, number: int) -> None:
        self.done.append(f"add client {service} {number}")

    def ask(self, service: str, number: int, request: Any) -> int:
        self.done.append(f"ask {service} {number}")
        return len(self.done)

    def answer(self, service: str, header: Any, response: Any) -> None:
        self.done.append(f"answer {header} {response.message}")

    def take_requests(self, service: str) -> list[Arrived]:
        taken, self.requests = self.requests, []
        return taken

    def take_responses(self, service: str) -> list[Arrived]:
        taken, self.responses = self.responses, []
        return taken


class Run:
    """A desk with what it works with."""

    def __init__(self, *, nodes: Sequence[str] = ("/node",), limits: Limits | None = None, **planned: Any) -> None:
        self.ends = Ends()
        self.due: list[Any] = []
        self.recorder = TraceRecorder(limits or Limits())
        made = plan(limits=limits or Limits(), **planned)
        self.services = ServicePeers(
            made, cast("ServiceEnds", self.ends), self.recorder, nodes=lambda: nodes, later=self.due.append
        )

    def ask(self, *headers: Any, at_ns: int = 0) -> Counter[str]:
        """Let requests come that were sent in the order of their headers' numbers."""
        self.ends.requests = [Arrived(NAME, header, Trigger.Request(), header=header) for header in headers]
        came = self.services.take()
        self.services.record(at_ns)
        return came


def server(*texts: str, **fields: Any) -> PlannedServer:
    usual: dict[str, Any] = {"start_ns": 0, "stop_ns": 0, "delay_ns": 0, "cycle": False, "answers": 0}
    return PlannedServer(NAME, KIND, responses=tuple({"message": t} for t in texts), **{**usual, **fields})


def calls(service: str = NAME, **fields: Any) -> PlannedCalls:
    usual: dict[str, Any] = {"start_ns": 0, "period_ns": 1, "clients": 1, "requests": ({},)}
    return PlannedCalls(service, KIND, **{**usual, **fields})


def test_requests_are_answered_in_the_order_in_which_they_were_sent() -> None:
    """Whatever order they arrive in, and each in its time."""
    run = Run()
    asked = server("a", "b", delay_ns=5)
    run.services.add_server(0, asked)
    assert run.ask(3, 2, at_ns=10) == {f"request {NAME}": 2}
    assert run.due == [Respond(15, asked, 1), Respond(15, asked, 2)]
    assert all(run.services.answer(15, due.server, due.number) for due in run.due)
    assert run.ends.done[1:] == ["answer 2 a", "answer 3 b"]
    observed: list[Any] = run.recorder.observations[1:]
    kinds = [(type(o), o.t_ns, o.number) for o in observed]
    assert kinds == [(Request, 10, 1), (Request, 10, 2), (Response, 15, 1), (Response, 15, 2)]


def test_a_server_that_has_given_its_answers_takes_nothing_more() -> None:
    """The request that comes too late is none that it has seen."""
    run = Run()
    asked = server("a", answers=1)
    run.services.add_server(0, asked)
    run.ask(1, 2)
    assert len(run.due) == 1
    assert run.services.done() == []
    run.services.answer(0, run.due[0].server, run.due[0].number)
    assert run.services.done() == [asked]
    run.services.remove_server(7, asked)
    assert run.recorder.observations[-1] == Mark(7, "server_stops", NAME)
    assert not run.services.serves(NAME, KIND)


def test_what_a_server_has_not_answered_when_it_goes_stays_unanswered() -> None:
    """A second removal does nothing."""
    run = Run()
    asked = server("a", delay_ns=5)
    run.services.add_server(0, asked)
    run.ask(1)
    run.services.remove_server(3, asked)
    run.services.remove_server(4, asked)
    assert not run.services.answer(5, run.due[0].server, run.due[0].number)
    assert run.ends.done == [f"add server {NAME} {KIND}", f"remove {NAME}"]


def test_calls_go_from_client_to_client_and_are_paired_with_their_answers() -> None:
    """Numbers count on over all clients of a service."""
    run = Run()
    several = calls(clients=2, requests=({},) * 4)
    for index in range(4):
        run.services.call(index, PlannedCall(several, index))
    assert run.ends.done == [f"add client {NAME} 1", f"add client {NAME} 2", *(f"ask {NAME} {n}" for n in (1, 2, 1, 2))]
    assert run.services.expected({f"response {NAME}": 9, "response /other": 1, "topic /a": 1}) == {
        f"response {NAME}": 4
    }
    answers = [(6, 2, "last"), (3, 1, "first"), (3, 1, "twice")]
    run.ends.responses = [Arrived(NAME, 0, Trigger.Response(message=text), None, n, s) for s, n, text in answers]
    run.services.take()
    run.services.record(9)
    found = [(r.number, r.client, r.value["message"]) for r in run.recorder.observations if isinstance(r, Response)]
    assert found == [(4, 2, "last"), (1, 1, "first")]


@pytest.mark.parametrize(("nodes", "asked"), [(("/car",), "/car/get_state"), ((), None), (("/a", "/b"), None)])
def test_a_service_of_the_only_node_has_a_name_when_there_is_one(nodes: tuple[str, ...], asked: str | None) -> None:
    """Calls wait until then."""
    run = Run(nodes=nodes)
    assert run.services.resolved("~/get_state") == asked
    assert run.services.add_clients(calls("~/get_state")) == asked


def test_calls_wait_for_their_server() -> None:
    """All that are due meanwhile follow in their order."""
    run = Run()
    waiting = calls(requests=({}, {}))
    due = [Ask(at, PlannedCall(waiting, at)) for at in (0, 1)]
    for one in due:
        run.services.wait(one)
    assert run.services.ready(lambda _: False) == []
    assert run.services.ready(lambda _: True) == due
    assert run.services.ready(lambda _: True) == []


def test_what_follows_an_accepted_request_is_sent_in_its_time() -> None:
    """And nothing follows a refused one."""
    run = Run()
    following = PlannedCall(calls("/second"), 0)
    for accepted in (False, True):
        run.services.call(0, PlannedCall(calls(), 0, ((5, following),)))
        answer = Trigger.Response()
        run.services._content = lambda _, accepted=accepted: ({"accepted": accepted}, 1)  # type: ignore[method-assign, misc]
        run.ends.responses = [Arrived(NAME, 0, answer, None, 1 + accepted, len(run.ends.done))]
        run.services.take()
        run.services.record(10)
    assert run.due == [Ask(15, following)]


def test_more_requests_than_the_limit_end_the_recording() -> None:
    """They count like messages on a topic; the content of a large one is not looked at."""
    run = Run(limits=Limits(messages=3, message_bytes=64))
    run.services.add_server(0, server())
    run.ask(*range(1, 6))
    assert [type(o) for o in run.recorder.observations] == [Mark, Request, Request, Request, Mark]
    assert run.recorder.full == f"more than 3 requests and responses of {NAME}: the rest was ignored"
    run = Run(limits=Limits(message_bytes=64))
    run.services.call(0, PlannedCall(calls(), 0))
    run.ends.responses = [Arrived(NAME, 0, Trigger.Response(message="x" * 99), None, 1, 2)]
    run.services.take()
    run.services.record(0)
    last: Any = run.recorder.observations[-1]
    assert last.value == {}
    assert "larger than the limit" in run.recorder.notes(())[0]


@pytest.mark.parametrize(
    ("report", "free", "normal"),
    [
        ({"code": 0}, True, True),
        ({"code": 130}, False, True),
        ({"code": 1}, False, False),
        ({}, False, False),
        ({"code": 0, "fault": {"code": "exception", "type": "AttributeError", "message": "no"}}, False, False),
        ({"code": 1, "fault": {"code": "exception", "type": "rclpy.executors.ExternalShutdownException"}}, False, True),
        (
            {
                "code": 1,
                "fault": {"code": "exception", "type": "RCLError", "message": "rcl_shutdown already called on"},
            },
            False,
            True,
        ),
    ],
)
def test_ends_that_are_no_faults(report: dict[str, int], free: bool, normal: bool) -> None:
    """A process that is free to end does with code 0; one that was sent Ctrl-C, as ROS programs do."""
    ended = Exited.checked(report)
    assert (is_free_exit(ended), is_normal_stop(ended)) == (free, normal)
