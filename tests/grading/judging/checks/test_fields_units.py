"""What a check says of a number comes from its parameters, not from the name of a topic."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tracing import TWIST, Recording

from grader.grading.judging.checks.fields import RandomInRange
from grader.grading.judging.checks.received import LogsReceived
from grader.grading.judging.values import number_of, number_path, published
from grader.grading.model.exercise import Finding
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.message_classes import number_message, numeric_field

ThresholdResponse, AnswersTogether = (known_checks()[name] for name in ("threshold_response", "answers_together"))

RANGE = "sensor_msgs/msg/Range"
DISTANCES = (0.4, 0.9, 0.3, 0.7, 0.5)


def distance(value: float) -> dict[str, object]:
    """Return a message with several numbers, one of which is the distance."""
    return {"header": {"frame_id": ""}, "radiation_type": 1, "field_of_view": 0.1, "range": value}


def braking(wrong: bool = False) -> Recording:
    """A node that stops at 0.5 m and nearer, or drives on, each distance being held for 2 s."""
    rec = Recording(stop_s=2.0 * len(DISTANCES))
    rec.endpoint("subscription", "/distance", RANGE)
    for k, value in enumerate(DISTANCES):
        for n in range(10):
            t_s = 2.0 * k + 0.2 * n + 0.001
            rec.deliver(t_s, "/distance", distance(value), RANGE)
            rec.message(
                t_s, "/speed", {"linear": {"x": 1.0 if value > 0.5 or wrong else 0.0}}, "geometry_msgs/msg/Twist"
            )
    return rec


BRAKE = ThresholdResponse(
    "/distance", "/speed", 0.5, 1, 0, "at_or_below", input_field="range", output_field="linear.x", unit="m"
)


def test_a_switch_may_read_and_write_any_field() -> None:
    """Its reason has the unit that the rubric names."""
    assert BRAKE.judge(braking().trace()).credit == 1
    finding = BRAKE.judge(braking(wrong=True).trace())
    assert (
        finding.reason == "t = 0.001 s, /speed: 1 for 0.4 m on /distance, expected 0; 1 is the only answer ever given"
    )
    assert BRAKE.expected == "0 on /speed for every /distance at or below 0.5 m"


def test_two_nodes_may_use_any_field() -> None:
    """A sensor with several numbers, and a controller that publishes a Twist."""
    rec = Recording(stop_s=20.0)
    for k in range(100):
        value = DISTANCES[k // 10 % len(DISTANCES)]
        rec.message(0.2 * k, "/distance", distance(value), RANGE)
        rec.message(0.2 * k + 0.01, "/speed", {"linear": {"x": 1.0 if value > 0.5 else 0.0}}, TWIST)
    check = AnswersTogether("/distance", "/speed", 0.5, 1, 0, input_field="range", output_field="linear.x", unit="m")
    assert check.judge(rec.trace()).credit == 1
    bare = replace(check, input_field="", output_field="").judge(rec.trace())
    assert bare.reason == f"/distance: {RANGE} carries no number"


def kelvin(topic: str, field: str = "") -> Finding:
    rec = Recording(stop_s=10.0)
    for k in range(50):
        rec.message(0.2 * k, topic, {"temperature": 400.0 + k, "variance": 0.0}, "sensor_msgs/msg/Temperature")
    return RandomInRange(topic, 290, 310, field=field, unit="K").judge(rec.trace())


def test_a_temperature_has_the_unit_of_its_rubric() -> None:
    """No unit is guessed from the name of the topic."""
    assert kelvin("/temperature").reason.startswith("/temperature: first above 310 K at t = 0.000 s (400 K); 50 of 50")
    assert kelvin("/temperature", "temperature") == kelvin("/temperature")
    bare = replace(RandomInRange("/temperature", 20, 30))
    assert bare.expected == "every value on /temperature within 20 to 30, and drawn at random"


@pytest.mark.parametrize(
    ("value", "path"),
    [
        ({"data": 3.0}, "data"),
        ({"header": {"stamp": {"sec": 1}}, "fluid_pressure": 101.3, "variance": 0.0}, "fluid_pressure"),
        ({"data": True, "level": 3}, "level"),
        ({"x": 1.0, "y": 2.0}, ""),
        ({"data": [1, 2]}, ""),
        ({"text": "1"}, ""),
        ({}, ""),
    ],
)
def test_the_number_that_a_message_stands_for(value: dict[str, object], path: str) -> None:
    """`data`, or the only number apart from its variance."""
    assert number_path(value) == path
    (message,) = published(Recording(stop_s=1.0).message(0.1, "/a", value).trace(), "/a")
    assert (number_of(message) is None) == (not path)


def test_numbers_are_published_in_the_field_that_a_rubric_names() -> None:
    """In a type that has it; a type with one number needs no name."""
    assert numeric_field(RANGE, "range") == ("range", False)
    assert numeric_field("std_msgs/msg/Float32", "range") is None
    message, fields = number_message(RANGE, (0.5, 1), "range")
    assert message.range == pytest.approx(0.501)
    assert fields == {"range": pytest.approx(0.501)}


def logging(sent: tuple[float, ...], logged: tuple[float, ...]) -> Finding:
    rec = Recording(stop_s=2.0 * len(sent))
    rec.endpoint("subscription", "/level")
    for k, value in enumerate(sent):
        for n in range(10):
            rec.deliver(2.0 * k + 0.2 * n, "/level", {"data": value})
        if value in logged:
            rec.log(2.0 * k + 0.1, f"level {value:g}", process="a.py")
    return LogsReceived("a.py", "/level").judge(rec.trace())


def test_only_the_ends_of_the_range_are_logged() -> None:
    """Whatever they are; nothing is said of values that are logged in between, or of two values."""
    sent = (-5.0, 1.0, 2.0, 7.5)
    assert "; only -5 and 7.5 are, so the log does not show what" in logging(sent, (-5.0, 7.5)).reason
    assert "; only 7.5 is, so the log does not show what" in logging(sent, (7.5,)).reason
    assert "; only" not in logging(sent, (-5.0, 2.0)).reason
    assert "; only" not in logging((1.0, 2.0, 3.0), (1.0, 3.0)).reason
