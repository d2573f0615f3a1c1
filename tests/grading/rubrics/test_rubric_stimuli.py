"""Stimuli and scenarios of rubric files: what can be written, and the message and place of each mistake."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import RubricError
from grader.runtime.model.scenario import Between, Choose, Scenario, Written
from grader.runtime.stimuli.calls import ServiceCalls
from grader.runtime.stimuli.goals import ActionGoal
from grader.runtime.stimuli.messages import MessageStream
from grader.runtime.stimuli.server import ServiceServer

MS, S = 1_000_000, 1_000_000_000
HEAD = """\
schema: grader/rubric/v1
exercise: {id: battery, number: 7, title: A battery}
files: [server.py, client.py]
scenarios:
  - id: alone
    processes: [server.py, client.py]
    observe: {duration: 20 s}
"""
TAIL = """\
criteria:
  - {id: rate, title: A rate, points: 1, scenario: alone, check: {publishes: {topic: /a, type: std_msgs/msg/String}}}
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Callable[..., Any]:
    """Read the scenario of a rubric with some more lines in it."""

    def read(lines: str) -> Scenario | None:
        path = tmp_path / "r.yaml"
        folded = "".join(f"    {line}\n" for line in lines.splitlines())
        path.write_text(HEAD + folded + TAIL, encoding="utf-8")
        return read_rubric(path).scenarios[0]

    return read


def test_a_server_is_written_with_its_responses(scenario: Callable[..., Any]) -> None:
    """Texts may hold a drawn number; a server without responses never answers."""
    found = scenario("""\
stimuli:
  - server:
      service: /battery/get_status
      type: std_srvs/srv/Trigger
      start: 3 s
      stop: 9 s
      delay: 100 ms
      cycle: true
      answers: 4
      responses:
        - {success: true, message: {text: "Battery: {}% remaining", between: [30, 90]}}
        - {success: {choose: [true, false]}, message: "no"}
  - server: {service: /mute, type: std_srvs/srv/Empty, responses: []}
""").stimuli
    answer = Written("Battery: {}% remaining", Between(30.0, 90.0), 1)
    responses: Any = ({"success": True, "message": answer}, {"success": Choose((True, False)), "message": "no"})
    told: dict[str, Any] = {"start_ns": 3 * S, "stop_ns": 9 * S, "delay_ns": 100 * MS, "cycle": True, "answers": 4}
    assert found[0] == ServiceServer("/battery/get_status", "std_srvs/srv/Trigger", responses, **told)
    assert found[1] == ServiceServer("/mute", "std_srvs/srv/Empty", ())


def test_calls_are_written_with_their_requests(scenario: Callable[..., Any]) -> None:
    """What is left out: an empty request, one call of one client."""
    found = scenario("""\
stimuli:
  - calls: {service: /a, type: std_srvs/srv/Trigger}
  - calls: {service: /b, type: std_srvs/srv/SetBool, requests: [{data: true}], calls: 5, clients: 3, period: 2 s}
""").stimuli
    assert found[0] == ServiceCalls("/a", "std_srvs/srv/Trigger", ({},))
    assert found[1] == ServiceCalls("/b", "std_srvs/srv/SetBool", ({"data": True},), 5, 3, 2 * S)


def test_messages_are_written_with_their_fields(scenario: Callable[..., Any]) -> None:
    """Nested, in lists, not a number, and drawn."""
    (found,) = scenario("""\
stimuli:
  - messages:
      topic: /scan
      type: sensor_msgs/msg/LaserScan
      values: [{header: {frame_id: base}, ranges: [1, .nan, {between: [0.5, 2]}]}]
      repeats: 2
      best_effort: true
""").stimuli
    assert isinstance(found, MessageStream)
    values: Any = found.values
    first, nan, drawn = values[0]["ranges"]
    assert (first, math.isnan(nan), drawn) == (1, True, Between(0.5, 2.0))
    assert type(first) is int
    assert values[0]["header"] == {"frame_id": "base"}
    assert (found.period_ns, found.repeats, found.best_effort, found.latched) == (S, 2, True, False)


def test_parameters_and_transitions_are_calls(scenario: Callable[..., Any]) -> None:
    """The equivalent service calls; without `node` the only node is meant."""
    found = scenario("""\
stimuli:
  - parameter: {name: speed, set: 0.5, start: 2 s}
  - parameter: {node: /ns/car, name: names, set: [a, b]}
  - parameter: {name: speed, set: {between: [1, 2]}}
  - parameter: {name: on, set: false}
  - parameter: {name: speed}
  - transition: {to: shutdown}
  - state: {node: /car, start: 1 s}
""").stimuli
    types = ["SetParameters"] * 4 + ["GetParameters"]
    assert [s.type for s in found[:5]] == [f"rcl_interfaces/srv/{name}" for name in types]
    assert [s.service for s in found[:2]] == ["~/set_parameters", "/ns/car/set_parameters"]
    values = [s.requests[0]["parameters"][0]["value"] for s in found[:4]]
    assert values == [
        {"type": 3, "double_value": 0.5},
        {"type": 9, "string_array_value": ("a", "b")},
        {"type": 3, "double_value": Between(1.0, 2.0)},
        {"type": 1, "bool_value": False},
    ]
    assert found[4].requests == ({"names": ("speed",)},)
    assert (found[5].service, found[5].requests) == (
        "~/change_state",
        ({"transition": {"id": 0, "label": "shutdown"}},),
    )
    assert (found[6].service, found[6].type, found[6].start_ns) == ("/car/get_state", "lifecycle_msgs/srv/GetState", S)


def test_a_goal_is_written_with_its_fields(scenario: Callable[..., Any]) -> None:
    """It may be cancelled."""
    (found,) = scenario("""\
stimuli:
  - goal: {action: /count, type: test_msgs/action/Fibonacci, goal: {order: {between: [5, 9]}}, cancel_after: 2 s}
""").stimuli
    assert found == ActionGoal("/count", "test_msgs/action/Fibonacci", {"order": Between(5, 9)}, 0, 2 * S)


def test_processes_may_start_late_end_and_be_stopped(scenario: Callable[..., Any]) -> None:
    """And usually do none of it."""
    usual = scenario("")
    assert (usual.starts_ns, usual.may_exit, usual.shutdown_ns) == ((), (), 0)
    found = scenario("start: {client.py: 3 s}\nmay_exit: [client.py]\nshutdown: 2 s\n")
    assert (found.starts_ns, found.may_exit, found.shutdown_ns) == ((("client.py", 3 * S),), ("client.py",), 2 * S)


SERVER = "stimuli:\n  - server: {service: /a, type: std_srvs/srv/Trigger, responses: [{message: %s}]}"
CALLS = "stimuli:\n  - calls: {service: /a, type: std_srvs/srv/Trigger, %s}"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("start: {|other.py: 1 s}", "expected one of `processes` (server.py or client.py), found `other.py`"),
        ("start: {client.py: |20 s}", "expected a start before the end of `observe`"),
        ("may_exit: [|other.py]", "expected one of `processes` (server.py or client.py), found `other.py`"),
        ("shutdown: |0 s", "expected more than 0 s, found `0 s`"),
        (SERVER % "|~", "expected a number, found nothing"),
        (SERVER % "{between: |[2, 1]}", "expected two numbers, the lower one first, found a list of 2"),
        (SERVER % "{choose: |[]}", "expected a list with at least one entry, found nothing"),
        (SERVER % "|{choose: [a], decimals: 1}", "expected `text` and `decimals` beside `between` only"),
        (SERVER % "|{between: [1, 2], text: no}", "expected a text that holds {} once, where the number goes"),
        (SERVER % "|{between: [1, 2], decimals: 2}", "expected `decimals` beside `text` only"),
        (SERVER % "{Data: |1}", "expected the name of a field such as data, found `Data`"),
        (CALLS % "calls: |0", "expected a whole number from 1 to 1,000, found `0`"),
        (CALLS % "clients: |21", "expected a whole number from 1 to 20, found `21`"),
        (CALLS % "start: |20 s", "expected a start before the end of `observe`"),
        ("stimuli:\n  - calls: {service: /a, type: |std_srvs/Trigger}", "expected a service type such as"),
        ((SERVER % "a").replace("responses", "start: 2 s, stop: |2 s, responses"), "expected a stop after the start"),
        ("stimuli:\n  - transition: {to: |fly}", "expected `configure`, `activate`, `deactivate`, `cleanup` or"),
    ],
)
def test_a_mistake_is_named_with_its_place(scenario: Callable[..., Any], lines: str, message: str) -> None:
    """Line and column of the mistake, here behind the bar, and what was expected."""
    before = lines.partition("|")[0].split("\n")
    place = f"{HEAD.count(chr(10)) + len(before)}:{5 + len(before[-1])}"
    with pytest.raises(RubricError) as refused:
        scenario(lines.replace("|", ""))
    assert f"{place}: {message}" in refused.value.message
