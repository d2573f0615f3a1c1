"""Sensor and controller at once."""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from nodes import right_speed, sensor, together
from tracing import FLOAT32, FLOAT64, Recording

from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.trace import ClockKind

CHECK = known_checks()["answers_together"]("/temperature", "/fan_speed", 25, 100, 0)


def on_change(
    rule: Callable[[float], float] = right_speed, seed: int = 3, until: float = 99.0, first: float = -1
) -> Recording:
    rec, sent = sensor(seed)
    state = first
    for t, v in sent:
        if rule(v) != state and t < until:
            state = rule(v)
            rec.number(t, "/fan_speed", state)
    return rec


def timed(
    rule: Callable[[float], float] = right_speed, period: float = 1.0, phase: float = 0.0, seed: int = 3
) -> Recording:
    rec, sent = sensor(seed)
    for t in itertools.takewhile(lambda t: t < 20.2, (phase + k * period for k in itertools.count())):
        seen = [v for at, v in sent if at < t]
        if seen:
            rec.number(t, "/fan_speed", rule(seen[-1]))
    return rec


@given(
    st.integers(0, 200), st.sampled_from(["each", "delayed", "change", "silent start", "timer"]), st.floats(0.1, 1.0)
)
def test_every_honest_way_of_answering_is_met(seed: int, way: str, period: float) -> None:
    """Whatever the sensor draws."""
    rec = {
        "each": lambda: together(seed=seed),
        "delayed": lambda: together(seed=seed, delay=0.05),
        "change": lambda: on_change(seed=seed),
        "silent start": lambda: on_change(seed=seed, first=0.0),
        "timer": lambda: timed(seed=seed, period=period, phase=0.3),
    }[way]()
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 1, finding.reason


@given(
    st.integers(0, 200),
    st.sampled_from([together, on_change, timed]),
    st.sampled_from(["inverted", "> 28", "on", "nan"]),
)
def test_every_wrong_rule_is_found(seed: int, way: Callable[..., Recording], name: str) -> None:
    """Whatever the sensor draws and however it is answered."""
    rule = {
        "inverted": lambda v: 100.0 - right_speed(v),
        "> 28": lambda v: 100.0 if v > 28 else 0.0,
        "on": lambda v: 100.0,
        "nan": lambda v: float("nan"),
    }[name]
    # once a second it asks too seldom to tell 28 from 25; the controller alone is asked that
    if (way, name) != (timed, "> 28"):
        assert CHECK.judge(way(rule, seed=seed).trace()).credit == 0


@pytest.mark.parametrize("way", [together, on_change])
@pytest.mark.parametrize("until", [0.3, 5.0, 15.0])
def test_a_controller_that_stops_is_found(way: Callable[..., Recording], until: float) -> None:
    """Its last answer stops fitting soon."""
    finding = CHECK.judge(way(until=until).trace())
    assert finding.credit == 0
    assert "no message after" in finding.reason


def test_a_controller_that_only_switches_on_is_found() -> None:
    """Both answers must occur."""
    rec, sent = sensor()
    for t, v in sent:
        if v > 25:
            rec.number(t, "/fan_speed", 100.0)
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 0
    assert "never 0" in finding.reason


def test_a_sensor_that_exits_is_found() -> None:
    """The exit is the reason."""
    rec, sent = sensor(until=5.0)
    for t, v in sent:
        rec.number(t, "/fan_speed", right_speed(v))
    finding = CHECK.judge(rec.exited(5.1).trace())
    assert finding.credit == 0
    assert "temperature_sensor.py exited after 5.1 s" in finding.reason


def test_the_first_wrong_answer_is_named() -> None:
    """With its temperature and what was expected."""
    finding = CHECK.judge(together(lambda v: 55.0).trace())
    assert finding.reason.startswith("t = 0.200 s, /fan_speed: 55 for ")
    assert "expected" in finding.reason


def test_types_that_differ_are_said_exactly() -> None:
    """Each file alone is right, together so no message arrives."""
    rec, _ = sensor()
    rec.endpoint("publisher", "/temperature", FLOAT32, "/temperature_sensor", 1)
    rec.endpoint("subscription", "/temperature", FLOAT64, "/controller", 2)
    rec.log(0.0, "up", process="fan_controller.py", logger="controller").line(0.0, "x", process="temperature_sensor.py")
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 0
    assert finding.reason == (
        "/temperature: temperature_sensor.py publishes std_msgs/msg/Float32, "
        "fan_controller.py subscribes std_msgs/msg/Float64, so no message arrives"
    )


def test_policies_that_differ_are_said_exactly() -> None:
    """Which policy on which side."""
    rec, _ = sensor()
    rec.endpoint("publisher", "/temperature", node="/a", participant=1, reliability="best_effort")
    rec.endpoint("subscription", "/temperature", node="/b", participant=2)
    reason = CHECK.judge(rec.trace()).reason
    assert "/a offers best_effort reliability, /b asks for reliable, so no message arrives" in reason


def answered(values: list[float]) -> Recording:
    rec = Recording(20.2, process="temperature_sensor.py")
    for k, value in enumerate(values):
        rec.number(0.2 + 0.2 * k, "/temperature", value).number(0.2 + 0.2 * k, "/fan_speed", right_speed(value))
    return rec


@pytest.mark.parametrize("low", [20.0, 0.0, 25.01])
def test_temperatures_drawn_from_one_side_never_change_the_fan(low: float) -> None:
    """Every answer is right, but the fan speed never changes."""
    rng = random.Random(5)
    finding = CHECK.judge(answered([rng.uniform(low, low + 4.9) for _ in range(100)]).trace())
    assert finding.credit == 0
    assert "/fan_speed: never changes, because /temperature stays between" in finding.reason


@given(st.integers(0, 10_000), st.floats(0.01, 0.3))
def test_a_slow_random_walk_need_not_reach_the_threshold(seed: int, step: float) -> None:
    """It wanders within one side for 20 s, through no fault of its own."""
    rng = random.Random(seed)
    values = list(itertools.accumulate((rng.uniform(-step, step) for _ in range(99)), initial=22.0))
    if max(values) <= 25:
        assert CHECK.judge(answered(values).trace()).credit == 1


@pytest.mark.parametrize(
    ("offered", "said"),
    [
        (
            {"reliability": "best_effort"},
            "/b offers best_effort reliability, /a asks for reliable, so no message arrives",
        ),
        (
            {"type_": FLOAT64},
            "/b publishes std_msgs/msg/Float64, /a subscribes std_msgs/msg/Float32, so no message arrives",
        ),
    ],
)
def test_right_answers_that_the_sensor_cannot_hear_are_not_enough(offered: dict[str, Any], said: str) -> None:
    """Each file alone is right, but the two cannot talk in both directions."""
    rec = together()
    rec.endpoint("subscription", "/fan_speed", FLOAT32, "/a", 1)
    rec.endpoint("publisher", "/fan_speed", **{"type_": FLOAT32, **offered}, node="/b", participant=2)
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 0
    assert said in finding.reason


def test_one_way_in_which_the_sensor_hears_the_answers_is_enough() -> None:
    """A second subscription that does not fit takes nothing away."""
    rec = together()
    rec.endpoint("subscription", "/fan_speed", FLOAT32, "/a", 1)
    rec.endpoint("subscription", "/fan_speed", FLOAT64, "/a", 1)
    rec.endpoint("publisher", "/fan_speed", FLOAT32, "/b", 2)
    assert CHECK.judge(rec.trace()).credit == 1


def test_silence_is_explained() -> None:
    """No temperature, or no answer."""
    assert "/temperature: no publisher" in CHECK.judge(Recording().trace()).reason
    rec, _ = sensor()
    assert "/fan_speed: no publisher" in CHECK.judge(rec.trace()).reason
    assert "node.py:12" in CHECK.judge(Recording().crashed(0.0).trace()).reason
    rec, _ = sensor()
    rec.message(1.0, "/fan_speed", {"data": "100"}, "std_msgs/msg/String")
    assert "carries no number" in CHECK.judge(rec.trace()).reason


@pytest.mark.parametrize(("behind", "said"), [(2, "2 messages earlier"), (7, "7 messages earlier")])
def test_answers_to_an_earlier_value_are_recognised(behind: int, said: str) -> None:
    """A controller that compares the previously stored value gets a hint."""
    rec, sent = sensor()
    for k, (t, _) in enumerate(sent):
        rec.number(
            t, "/fan_speed", right_speed(sent[k - behind][1]) if k >= behind else 100.0 - right_speed(sent[0][1])
        )
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 0
    assert f"the answers fit the input of {said}" in finding.reason
    assert finding.evidence["behind"] == behind


def test_one_value_behind_is_told_from_a_timer_by_the_check_of_the_controller_alone() -> None:
    """A timer of the sensor's own pace answers like this, and what it says first is of before the first value."""
    rec, sent = sensor()
    for k, (t, _) in enumerate(sent):
        rec.number(t, "/fan_speed", right_speed(sent[k - 1][1]) if k else 100.0 - right_speed(sent[0][1]))
    assert CHECK.judge(rec.trace()).credit == 1


def test_wrong_answers_are_not_called_late() -> None:
    """Inverted logic fits no earlier value."""
    finding = CHECK.judge(together(lambda v: 100.0 - right_speed(v)).trace())
    assert finding.credit == 0
    assert "before" not in finding.reason


def test_on_the_wall_clock_an_answer_may_be_seen_before_its_input() -> None:
    """The sensor sends to the controller first, and is held up before it sends to the observer; not so virtually."""
    assert CHECK.judge(replace(together(delay=-0.02).trace(), clock=ClockKind.WALL)).credit == 1
    assert CHECK.judge(together(delay=-0.02).trace()).credit == 0
    assert CHECK.judge(replace(together(delay=-0.08).trace(), clock=ClockKind.WALL)).credit == 0


@pytest.mark.parametrize("last", [0.0, 100.0])
def test_two_answers_at_one_instant_are_contradictory(last: float) -> None:
    """The last one is not right by luck."""
    rec = together(lambda _v: 100.0 - last).add(*together(lambda _v: last).trace().messages("/fan_speed"))
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 0
    assert "0 and 100 at the same time" in finding.reason
    assert finding.hint == "publish one answer to each number on /temperature"


def test_a_timer_may_still_have_the_old_answer_at_the_instant_of_a_new_one() -> None:
    """It belongs to the temperature before."""
    rec = timed(period=0.2, phase=0.4).add(*together().trace().messages("/fan_speed"))
    assert CHECK.judge(rec.trace()).credit == 1
