"""Services between the grader and real nodes: in virtual time every call and response has its instant, every time."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from places import TESTS
from tiers import but

from grader.runtime.model.scenario import FieldSpec
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.trace import ClockKind, Fault, LogRecord, Mark, Request, Response
from grader.runtime.plan import Surroundings, plan_scenario
from grader.runtime.recording.codec import trace_to_json
from grader.runtime.stimuli.calls import ServiceCalls
from grader.runtime.stimuli.goals import ActionGoal
from grader.runtime.stimuli.messages import MessageStream
from grader.runtime.stimuli.server import ServiceServer
from grader.runtime.supervisor.supervisor import Job

pytestmark = pytest.mark.ros

NODES = TESTS / "service_nodes"
BATTERY, RELAY, TRIGGER = "/battery/get_status", "/relay", "std_srvs/srv/Trigger"
ANSWERS: tuple[Mapping[str, FieldSpec], ...] = tuple({"success": True, "message": f"n{number}"} for number in range(3))
TEXT = "std_msgs/msg/String"


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    """Record some of the nodes beside this file, for so many seconds."""
    tmp_path.chmod(0o755)

    def run_one(
        files: tuple[str, ...], *stimuli: Any, seconds: int = 4, clock: str = "virtual", times: int = 1, **fields: Any
    ) -> AssessedTrace:
        (tmp_path / "s").mkdir()
        submission = stage_submission(str(NODES), files, tmp_path / "s")
        asked = Scenario("alone", files, Span(seconds * NS_PER_S), stimuli, **fields)
        plan = plan_scenario("services", asked, submission, Surroundings(1, clock))
        traces = [session.record({"t": Job("t", plan)}, clock, lambda _: None)["t"] for _ in range(times)]
        assert [trace.harness_problem for trace in traces] == [""] * times
        assert len({json.dumps(trace_to_json(trace)) for trace in traces}) == 1
        return traces[0]

    return run_one


def short(trace: AssessedTrace) -> list[str]:
    """Return what was asked, answered, logged and marked, in short, with its milliseconds."""
    found = []
    for o in trace.observations:
        at = o.t_ns // NS_PER_MS
        if isinstance(o, Request):
            found.append(f"{at} {o.sender} asks {o.service} {o.number}")
        elif isinstance(o, Response):
            found.append(f"{at} {o.sender} answers {o.number}: {o.value['message']}")
        elif isinstance(o, (LogRecord, Mark, Fault)):
            found.append(f"{at} {o.text if isinstance(o, (LogRecord, Fault)) else f'{o.name} {o.detail}'}")
    return found


def test_a_server_is_called_by_several_clients(run: Callable[..., AssessedTrace]) -> None:
    """Calls of one instant come one after the other, always in the same order; the graph shows the server."""
    trace = run(("server.py",), ServiceCalls(BATTERY, TRIGGER, ({},), calls=2, clients=2), times=2)
    percentages = ["85.0", "84.5", "84.0", "83.5"]
    expected = []
    for index, percentage in enumerate(percentages):
        said = f"Battery: {percentage}% remaining"
        at = 1000 * (index // 2)
        asked, told = f"{at} grader asks {BATTERY} {index + 1}", f"{at} student answers {index + 1}: {said}"
        expected += [asked, f"{at} {said}", told]
    assert short(trace) == expected
    assert [r.client for r in trace.responses(BATTERY, "student")] == [1, 2, 1, 2]
    assert [(e.kind, e.service, e.node) for e in trace.graphs()[-1].services] == [("service", BATTERY, "/battery")]


def test_a_client_waits_for_a_late_server_that_disappears(run: Callable[..., AssessedTrace]) -> None:
    """It polls in virtual time; the last request stays unanswered; then it ends, which it is free to do."""
    server = ServiceServer(BATTERY, TRIGGER, ANSWERS, 1300 * NS_PER_MS, delay_ns=100 * NS_PER_MS, answers=2)
    trace = run(("client_loop.py",), server, seconds=20, may_exit=("client_loop.py",), times=2)
    assert short(trace) == [
        "1000 waiting",
        f"1300 server_starts {BATTERY}",
        f"1500 student asks {BATTERY} 1",
        "1600 grader answers 1: n0",
        "1600 n0",
        f"2600 student asks {BATTERY} 2",
        "2700 grader answers 2: n1",
        "2700 n1",
        f"3700 student asks {BATTERY} 3",
        f"3700 server_stops {BATTERY}",
        "6700 no answer",
        "10700 no answer",
        "14700 no answer",
        "15700 exited client_loop.py",
    ]


@pytest.mark.long
@pytest.mark.parametrize(
    ("file", "asked_ms"),
    [
        ("client_callbacks.py", [1000, 2000, 3000]),
        ("client_async.py", [1000, 2000, 3000]),
        ("client_blocking.py", [0, 1250, 2500]),
        ("client_two.py", [500, 1000, 1500, 2000, 2500, 3000, 3500]),
    ],
)
def test_every_way_to_ask_is_served(run: Callable[..., AssessedTrace], file: str, asked_ms: list[int]) -> None:
    """Callbacks, await, the call that blocks in a thread, and a second client that hears what is not for it."""
    server = ServiceServer(BATTERY, TRIGGER, ANSWERS, delay_ns=250 * NS_PER_MS, cycle=True)
    trace = run((file,), server)
    assert [r.t_ns // NS_PER_MS for r in trace.requests(BATTERY, "student")] == asked_ms
    logged = [r.t_ns // NS_PER_MS for r in trace.records()]
    assert logged == [at + 250 for at in asked_ms]


@pytest.mark.long
def test_a_server_asks_another_one_while_it_answers(run: Callable[..., AssessedTrace]) -> None:
    """Two callbacks of one node wait for each other, in threads."""
    server = ServiceServer(BATTERY, TRIGGER, ANSWERS, delay_ns=100 * NS_PER_MS)
    trace = run(("relay.py",), server, ServiceCalls(RELAY, TRIGGER, ({},), start_ns=NS_PER_S))
    assert [line for line in short(trace) if "server_starts" not in line] == [
        f"1000 grader asks {RELAY} 1",
        f"1000 student asks {BATTERY} 1",
        "1100 grader answers 1: n0",
        "1100 student answers 1: relayed n0",
    ]


@pytest.mark.long
def test_two_processes_meet_when_one_starts_late_and_one_ends(run: Callable[..., AssessedTrace]) -> None:
    """And the one that is left ends at the stop signal."""
    files = ("server.py", "client_loop.py")
    late, free = (("server.py", 2500 * NS_PER_MS),), ("client_loop.py",)
    trace = run(files, seconds=10, starts_ns=late, may_exit=free, shutdown_ns=2 * NS_PER_S, times=2)
    lines = short(trace)
    assert lines[:3] == ["1000 waiting", "2000 waiting", "2500 process_starts server.py"]
    assert lines[3:5] == ["2500 Battery: 85.0% remaining"] * 2
    assert lines[-3:] == ["7500 exited client_loop.py", "10000 stop_signal server.py", "10000 stopped server.py"]
    assert (trace.faults(), trace.stop_ns) == ((), 10 * NS_PER_S)


@pytest.mark.long
def test_parameters_and_messages_of_fixed_types_reach_a_node(run: Callable[..., AssessedTrace]) -> None:
    """The parameter takes effect at its instant; the messages come as often as they are repeated."""
    asked: Any = {"parameters": [{"name": "word", "value": {"type": 4, "string_value": "bye"}}]}
    changed = ServiceCalls("~/set_parameters", "rcl_interfaces/srv/SetParameters", (asked,), start_ns=1200 * NS_PER_MS)
    heard = MessageStream("/heard", TEXT, ({"data": "a"}, {"data": "b"}), 500 * NS_PER_MS, NS_PER_S, repeats=2)
    trace = run(("parrot.py",), changed, heard, times=2)
    (response,) = trace.responses("/parrot/set_parameters", "student")
    assert (response.t_ns, response.value["results"][0]["successful"]) == (1200 * NS_PER_MS, True)
    said = [(m.t_ns // NS_PER_MS, m.value["data"]) for m in trace.messages("/said")]
    assert said == [(1000, "a hello"), (1500, "a bye"), (2000, "b bye"), (2500, "b bye")]


@pytest.mark.long
def test_the_services_that_every_node_has_answer_at_once(run: Callable[..., AssessedTrace]) -> None:
    """Nodes leave them out of their waits until somebody calls; the caller is another process, or the same one."""
    trace = run(("asked.py", "asker.py"), seconds=3, times=2)
    logged = [(o.t_ns // NS_PER_MS, o.text) for o in trace.observations if isinstance(o, LogRecord)]
    both = ("/asked/get_parameters: 3", "/asker/get_parameters: 4")
    assert logged == [(at, text) for at in (1000, 2000) for text in both]


@pytest.mark.long
def test_a_lifecycle_node_is_led_through_its_states(run: Callable[..., AssessedTrace]) -> None:
    """It publishes while it is active; what its state machine tells has its instant too."""
    asked: list[tuple[Any, int]] = [
        ({"transition": {"id": 0, "label": to}}, at) for to, at in (("configure", 600), ("activate", 1200))
    ]
    kind = "lifecycle_msgs/srv/ChangeState"
    calls = [ServiceCalls("~/change_state", kind, (value,), start_ns=at * NS_PER_MS) for value, at in asked]
    state = ServiceCalls("/living/get_state", "lifecycle_msgs/srv/GetState", ({},), start_ns=1300 * NS_PER_MS)
    trace = run(("lifecycle.py",), *calls, state, seconds=2, times=2)
    assert [r.value["success"] for r in trace.responses("/living/change_state", "student")] == [True, True]
    assert trace.responses("/living/get_state", "student")[0].value["current_state"]["label"] == "active"
    assert [m.t_ns // NS_PER_MS for m in trace.messages("/out")] == [1500]
    told = [(m.t_ns // NS_PER_MS, m.value["goal_state"]["label"]) for m in trace.messages("/living/transition_event")]
    assert told == [(600, "configuring"), (600, "inactive"), (1200, "activating"), (1200, "active")]


FIBONACCI, COUNT = "test_msgs/action/Fibonacci", "/count/_action"


def test_goals_are_refused_cancelled_and_followed(run: Callable[..., AssessedTrace]) -> None:
    """An action server with threads that sleeps while it works: requests, feedback and results have their instants."""
    pytest.importorskip("test_msgs")
    refused = ActionGoal("/count", FIBONACCI, {"order": 80}, 500 * NS_PER_MS)
    cancelled = ActionGoal("/count", FIBONACCI, {"order": 8}, NS_PER_S, 1200 * NS_PER_MS)
    trace = run(("counting.py",), refused, cancelled, times=2)
    sent = trace.responses(f"{COUNT}/send_goal", "student")
    assert [(r.t_ns // NS_PER_MS, r.value["accepted"]) for r in sent] == [(500, False), (1000, True)]
    (asked,) = trace.requests(f"{COUNT}/cancel_goal", "grader")
    (result,) = trace.responses(f"{COUNT}/get_result", "student")
    assert (asked.t_ns // NS_PER_MS, result.t_ns // NS_PER_MS) == (2200, 2500)
    assert (result.value["status"], result.value["result"]["sequence"]) == (5, [0, 1, 2, 3])
    told = [(m.t_ns // NS_PER_MS, m.value["feedback"]["sequence"]) for m in trace.messages(f"{COUNT}/feedback")]
    assert told == [(1500, [0, 1]), (2000, [0, 1, 2]), (2500, [0, 1, 2, 3])]
    states = [m.value["status_list"][0]["status"] for m in trace.messages(f"{COUNT}/status")]
    assert states == [1, 2, 3, 5]  # accepted, executing, cancelling, cancelled


@pytest.mark.long
def test_the_client_of_an_action_waits_for_its_server(run: Callable[..., AssessedTrace]) -> None:
    """Both are students; the server starts late."""
    pytest.importorskip("test_msgs")
    trace = run(("counting.py", "goal_client.py"), starts_ns=(("counting.py", NS_PER_S),), may_exit=("goal_client.py",))
    assert [f"{r.t_ns // NS_PER_MS} {r.text}" for r in trace.records("goal_client.py")] == [
        "1000 accepted True",
        "1500 [0, 1]",
        "2000 [0, 1, 2]",
        "2500 [0, 1, 2, 3]",
        "2500 result [0, 1, 2, 3]",
    ]
    assert trace.notes == ()


CLUMSY = ("clumsy.py", "1000 AttributeError: 'Node' object has no attribute 'motor'")


@pytest.mark.parametrize(
    ("file", "end"),
    but(
        [CLUMSY],
        [
            ("tidy.py", "1000 stopped tidy.py"),
            CLUMSY,
            ("deaf.py", "3000 did not end within 2 s after Ctrl-C"),
        ],
    ),
)
def test_how_a_program_ends_after_ctrl_c_is_told(run: Callable[..., AssessedTrace], file: str, end: str) -> None:
    """A second shutdown is normal; an exception of its own is not, and neither is to go on."""
    trace = run((file,), seconds=1, shutdown_ns=2 * NS_PER_S)
    assert [line for line in short(trace) if line.startswith(("1000", "3000"))] == [f"1000 stop_signal {file}", end]


@pytest.mark.long
def test_the_wall_clock_sees_the_same(run: Callable[..., AssessedTrace]) -> None:
    """Only later by what the machine needs."""
    server = ServiceServer(BATTERY, TRIGGER, ANSWERS, 600 * NS_PER_MS, answers=1)
    trace = run(("client_callbacks.py",), server, seconds=6, clock="wall", shutdown_ns=2 * NS_PER_S)
    assert trace.clock is ClockKind.WALL
    lines = [line.partition(" ")[2] for line in short(trace)]
    assert lines[:4] == [
        f"server_starts {BATTERY}",
        f"student asks {BATTERY} 1",
        "grader answers 1: n0",
        "n0",
    ]
    assert lines[-2:] == ["stop_signal client_callbacks.py", "stopped client_callbacks.py"]
