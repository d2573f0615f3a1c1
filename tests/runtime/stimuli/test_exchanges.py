"""Planned messages, servers and calls: what is drawn, from what, and which types and fields this machine knows."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping
from typing import Any

import pytest

from grader.runtime.model.scenario import FieldSpec

pytest.importorskip("rclpy")

from scripted import plan

from grader.grading.evidence.manifest import scenario_digest
from grader.runtime.message_classes import built, interface_class, plain_fields
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.scenario import Between, Choose, Planned, Scenario, Span, Written
from grader.runtime.plan import Plan
from grader.runtime.recording.codec import from_json, to_json
from grader.runtime.stimuli.calls import ServiceCalls
from grader.runtime.stimuli.drawing import Draws, drawn_fields, drawn_number
from grader.runtime.stimuli.goals import ActionGoal
from grader.runtime.stimuli.messages import MessageStream
from grader.runtime.stimuli.server import PlannedServer, ServiceServer
from grader.runtime.worker.service_peers import check_types

TRIGGER, SCAN = "std_srvs/srv/Trigger", "sensor_msgs/msg/LaserScan"
TOLD: Mapping[str, FieldSpec] = {
    "success": Choose((True, False)),
    "message": Written("Battery: {}% remaining", Between(30, 90), 1),
}


def draw(seed: int = 1) -> random.Random:
    return random.Random(seed)


def draws() -> Draws:
    return Draws(own=draw(), shared=draw())


def test_everything_is_drawn_and_follows_from_the_seed() -> None:
    """Nested, in lists, in texts; what is written is kept."""
    fields: Mapping[str, FieldSpec] = {"a": {"b": (Between(1, 6), 2, math.inf)}, **TOLD}
    drawn = drawn_fields(fields, draw())
    assert drawn == drawn_fields(fields, draw())
    assert drawn != drawn_fields(fields, draw(2))
    number, *rest = drawn["a"]["b"]
    assert number in range(1, 7)
    assert rest == [2, math.inf]
    assert drawn["success"] in (True, False)
    text = drawn["message"].removeprefix("Battery: ").removesuffix("% remaining")
    assert 30 <= float(text) <= 90
    assert len(text.partition(".")[2]) == 1


@pytest.mark.parametrize(("low", "high", "decimals"), [(0.5, 2.0, 2), (0.001, 0.002, 5), (0.25, 0.75, 3)])
def test_a_drawn_fraction_has_as_many_decimals_as_its_range_needs(low: float, high: float, decimals: int) -> None:
    """A hundredth of the range can be told apart."""
    numbers = [drawn_number(Between(low, high), draw(seed)) for seed in range(50)]
    assert all(low <= n <= high and round(n, decimals) == n for n in numbers)
    assert len(set(numbers)) > 20


def test_calls_are_drawn_for_each_client() -> None:
    """Requests begin again after the last one, and no two drawn ones need be alike."""
    calls = ServiceCalls("/s", "t", ({"a": Between(0, 999999)}, {"a": 7}), calls=3, clients=2).planned(draws())
    assert [r["a"] == 7 for r in calls.requests] == [False, False, True, True, False, False]
    assert len({r["a"] for r in calls.requests}) == 5


@pytest.mark.parametrize(
    ("server", "answers"),
    [
        ({"responses": ({"n": 1}, {"n": 2})}, [1, 2, 2, 2]),
        ({"responses": ({"n": 1}, {"n": 2}), "cycle": True}, [1, 2, 1, 2]),
        ({"responses": ({"n": 1},), "answers": 2}, [1, 1, None, None]),
        ({"responses": ()}, [None, None, None, None]),
    ],
)
def test_responses_are_given_in_order(server: dict[str, Any], answers: list[int | None]) -> None:
    """The last one is repeated, or the first one follows, or nothing does."""
    planned = ServiceServer("/s", TRIGGER, **server).planned(draws())
    given = [planned.response(index) for index in range(4)]
    assert [None if g is None else g["n"] for g in given] == answers


def test_a_plan_crosses_the_line() -> None:
    """With everything that was drawn."""
    exchanges = plan(
        stimuli=(
            MessageStream("/a", SCAN, ({"ranges": (1, Between(1, 2))},), 5).planned(draws()),
            ServiceServer("/s", TRIGGER, (TOLD,)).planned(draws()),
            ServiceCalls("/s", TRIGGER, ({},), calls=2).planned(draws()),
            ActionGoal("/g", "test_msgs/action/Fibonacci", {"order": 5}).planned(draws()),
        ),
        starts_ns=(("a.py", 5),),
        may_exit=("a.py",),
        shutdown_ns=7,
    )
    assert from_json(Plan, to_json(exchanges)) == exchanges


def test_a_message_is_built_from_plain_fields() -> None:
    """Whole numbers become fractions where the type has them; what is left out keeps its default."""
    fields = {"header": {"frame_id": "base", "stamp": {"sec": 5}}, "ranges": [1, math.inf], "range_max": 3}
    made = plain_fields(built(interface_class(SCAN, "msg"), fields, "here"))
    assert made["header"] == {"stamp": {"sec": 5, "nanosec": 0}, "frame_id": "base"}
    assert (made["ranges"], made["range_max"], made["intensities"]) == ([1.0, math.inf], 3.0, [])


@pytest.mark.parametrize(
    ("interface", "fields", "message"),
    [
        (SCAN, {"range": 1.0}, "here: expected a field of sensor_msgs/LaserScan"),
        (SCAN, {"range_max": "far"}, "here: expected a value of the type float in `range_max`, found 'far'"),
        (SCAN, {"ranges": 1.0}, "here: expected a value of the type sequence<float> in `ranges`"),
        (SCAN, {"header": {"stamp": {"sec": 1.5}}}, "here, header, stamp: expected a value of the type int32 in `sec`"),
        ("std_msgs/msg/UInt8", {"data": 256}, "here: expected a value of the type uint8 in `data`, found '256'"),
        ("std_msgs/msg/Bool", {"data": 1}, "here: expected a value of the type boolean in `data`"),
        ("std_msgs/msg/String", {"data": {"text": "a"}}, "here: expected a value of the type string in `data`"),
    ],
)
def test_a_field_that_the_type_lacks_is_named(interface: str, fields: dict[str, Any], message: str) -> None:
    """A rubric's mistake is nobody's fault but its author's, and is never sent."""
    with pytest.raises(HarnessError) as refused:
        built(interface_class(interface, "msg"), fields, "here")
    assert refused.value.message.startswith(message)


@pytest.mark.parametrize(
    ("planned", "message"),
    [
        (
            PlannedServer("/s", "no_msgs/srv/None", 0, 0, 0, False, 0, ()),
            "scenario alone, server of /s: expected the type no_msgs/srv/None on this machine, found none",
        ),
        (
            PlannedServer("/s", TRIGGER, 0, 0, 0, False, 0, ({"succes": True},)),
            "scenario alone, server of /s: expected a field of std_srvs/Trigger_Response (success, message)",
        ),
        (
            ServiceCalls("/s", TRIGGER, ({"data": 1},)).planned(draws()),
            "scenario alone, calls of /s: expected a field of std_srvs/Trigger_Request (no fields)",
        ),
        (
            MessageStream("/a", "std_msgs/srv/Trigger", ({},), 5).planned(draws()),
            "scenario alone, messages on /a: expected the type std_msgs/srv/Trigger on this machine",
        ),
    ],
)
def test_what_a_plan_needs_is_looked_for_before_it_runs(planned: Planned, message: str) -> None:
    """A type that this machine lacks is not the student's fault."""
    with pytest.raises(HarnessError) as refused:
        check_types(plan(stimuli=(planned,)))
    assert refused.value.message.startswith(message)


@pytest.mark.parametrize(
    ("interface", "kind", "known"),
    [
        ("std_msgs/msg/String", "msg", True),
        ("std_msgs/msg/String", "srv", False),
        (TRIGGER, "srv", True),
        (TRIGGER, "msg", False),
        ("std_srvs/srv/Trigger_Request", "srv", False),
        ("std_srvs/srv/Trigger_Request", "msg", False),
        ("os/msg/String", "msg", False),
        ("../msg/String", "msg", False),
    ],
)
def test_a_type_is_known_by_its_name_and_kind(interface: str, kind: str, known: bool) -> None:
    """Names come from students too: nothing else is looked up."""
    assert (interface_class(interface, kind) is not None) == known


def test_scenarios_can_be_told_apart_and_looked_up() -> None:
    """By their digest, which is remembered: what only differs in a field is another one."""
    one, same, other = (
        Scenario("a", ("a.py",), Span(5), (ServiceServer("/s", TRIGGER, ({"message": text},)),)) for text in "aab"
    )
    assert {one: 1}[same] == 1
    assert one != other
    assert scenario_digest(one) == scenario_digest(same) != scenario_digest(other)
