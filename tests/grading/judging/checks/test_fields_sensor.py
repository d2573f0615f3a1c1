"""The sensor of exercise 3: its range, its chance, its log of the fan speed."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest
from nodes import SPEEDS, drawn, hearing, sensed
from tracing import Recording, held_at, scripted

from grader.grading.judging.checks.fields import RandomInRange
from grader.grading.judging.checks.received import LogsReceived
from grader.grading.model.exercise import Problem, ProblemKind
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import Trace

RANGE = RandomInRange("/temperature", 20, 30, unit="°C")
LOGS = LogsReceived("temperature_sensor.py", "/fan_speed")


def test_drawn_values_in_the_range_are_met() -> None:
    """The evidence holds the extremes."""
    finding = RANGE.judge(sensed(drawn()).trace())
    assert finding.credit == 1
    assert finding.evidence["messages"] == 60


def test_temperature_messages_count_like_data() -> None:
    """sensor_msgs/msg/Temperature carries its number elsewhere."""
    rec = Recording(12.0)
    for k, value in enumerate(drawn()):
        rec.message(k * 0.2, "/temperature", {"temperature": value, "variance": 0.0}, "sensor_msgs/msg/Temperature")
    assert RANGE.judge(rec.trace()).credit == 1


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (31.4, "above 30 °C at t = 3.200 s (31.4 °C)"),
        (19.9, "below 20 °C at t = 3.200 s (19.9 °C)"),
        (math.nan, "not a number"),
        (math.inf, "above 30"),
        (-math.inf, "below 20"),
    ],
)
def test_the_first_value_outside_is_named(bad: float, said: str) -> None:
    """One is enough, with its time and value; NaN and infinities are outside."""
    values = drawn()
    values[15] = bad
    finding = RANGE.judge(sensed(values).trace())
    assert finding.credit == 0
    assert said in finding.reason
    assert "1 of 60" in finding.reason


@pytest.mark.parametrize("edge", [20.0, 30.0, 30.000001907])
def test_the_edges_are_inside(edge: float) -> None:
    """So is what single precision makes of them."""
    assert RANGE.judge(sensed([*drawn(), edge]).trace()).credit == 1


@pytest.mark.parametrize("value", [25.0, 22.5])
def test_a_constant_is_not_random(value: float) -> None:
    """The reason has the value and the count."""
    finding = RANGE.judge(sensed([value] * 60).trace())
    assert finding.credit == 0
    assert f"constant, {value:g} °C in all 60 messages" in finding.reason
    assert "random.uniform(20.0, 30.0)" in finding.hint


def test_a_ramp_is_not_random() -> None:
    """The pattern is named."""
    assert "ramp" in RANGE.judge(sensed([20 + k / 10 for k in range(60)]).trace()).reason


def sent(values: list[float]) -> Trace:
    rec = Recording(0.2 * len(values) + 0.4, process="temperature_sensor.py")
    for k, value in enumerate(values, 1):
        rec.number(0.2 * k, "/temperature", value)
    return rec.trace()


def evenly(low: float, high: float, count: int = 100) -> list[float]:
    rng = random.Random(8)
    return [rng.uniform(low, high) for _ in range(count)]


@pytest.mark.parametrize(("low", "high"), [(22, 28), (20, 25), (25.5, 30), (23.0, 27.0), (20, 27.5)])
def test_an_even_draw_from_a_part_of_the_range_is_told(low: float, high: float) -> None:
    """With what it covers, and what was asked for."""
    finding = RANGE.judge(sent(evenly(low, high)))
    assert finding.credit == 0
    assert "only values from " in finding.reason
    assert "expected them from all of 20 to 30 °C" in finding.reason
    assert finding.problem == Problem(ProblemKind.WRONG_VALUE, detail="narrow")
    assert RANGE.judge(sent(evenly(low, high, 64))).credit == 1  # too few to tell


def wandering(step: float) -> list[float]:
    rng, values = random.Random(8), [25.0]
    for _ in range(99):
        values.append(min(28.0, max(22.0, values[-1] + rng.uniform(-step, step))))
    return values


OTHERWISE = {
    "evenly": evenly(20, 30),
    "whole": [float(round(v)) for v in evenly(20, 30)],
    "few": [random.Random(k).choice([21.0, 24.0, 26.0, 29.0]) for k in range(100)],
    "gathered around 25": [random.Random(k).gauss(25.0, 0.9) for k in range(100)],
    "wandering": wandering(0.5),
    "wandering far": wandering(1.5),
}


@pytest.mark.parametrize("values", OTHERWISE.values(), ids=OTHERWISE)
def test_other_draws_may_stay_near_the_middle(values: list[float]) -> None:
    """A normal distribution and a random walk need not come near the ends."""
    finding = RANGE.judge(sent(values))
    assert finding.credit == 1, finding.reason


def test_one_value_leaves_the_question_open() -> None:
    """Chance cannot be seen in one value; the rate criterion names the mistake."""
    assert RANGE.judge(sensed([25.3]).trace()).blocked_by == "topic_rate"
    assert RANGE.judge(sensed([25.3, 21.0]).trace()).credit == 1
    assert RANGE.judge(sensed([25.0, 25.0]).trace()).blocked_by == "topic_rate"


def test_no_value_leaves_the_question_open() -> None:
    """So does silence."""
    assert RANGE.judge(Recording().trace()).blocked_by == "topic_rate"


def test_a_string_is_no_temperature() -> None:
    """The type is named."""
    rec = Recording().message(1.0, "/temperature", {"data": "25.0"}, "std_msgs/msg/String")
    finding = RANGE.judge(rec.trace())
    assert finding.credit == 0
    assert "std_msgs/msg/String carries no number" in finding.reason


ON_CHANGE = [0.5, 2.5, 4.5, 6.5, 8.5]
EACH_SECOND = [0.7 + k for k in range(11)]
WORDINGS: dict[str, Callable[[float], str]] = {
    "plain": lambda v: f"Fan speed: {v}",
    "percent": lambda v: f"fan {v:.0f}%",
    "two decimals": lambda v: f"Received fan_speed: {v:.2f}",
    "whole": lambda v: f"speed={int(v)}",
    "German": lambda v: f"Lüfter: {v:.1f}".replace(".", ","),
    "repr": lambda v: f"std_msgs.msg.Float32(data={v})",
    "Chinese": lambda v: f"风扇转速{v:.1f}",
    "with temperature": lambda v: f"T=24.51 °C, fan={v:.1f}",
}


@pytest.mark.parametrize("write", WORDINGS.values(), ids=WORDINGS)
@pytest.mark.parametrize("times", [None, ON_CHANGE, EACH_SECOND], ids=["each message", "on change", "each second"])
def test_logged_speeds_count_however_they_are_worded(write: Callable[[float], str], times: list[float] | None) -> None:
    """Each message, on change or on a timer; printed they are half."""
    assert LOGS.judge(hearing(write, times).trace()).credit == 1
    printed = LOGS.judge(hearing(write, times, printed=True).trace())
    assert printed.credit == Fraction(1, 2)
    assert "get_logger" in printed.hint


def test_a_log_up_to_a_second_late_counts() -> None:
    """A timer of 1 s may show the value before."""
    rec = hearing(str, [])
    for t, value in zip([3.4, 5.4, 7.4, 9.4, 11.0], SPEEDS, strict=True):
        rec.log(t, f"fan {value}")
    assert LOGS.judge(rec.trace()).credit == 1
    rec = hearing(str, [])
    for t, value in zip([3.6, 5.6, 7.6, 9.6, 11.0], SPEEDS, strict=True):
        rec.log(t, f"fan {value}")
    assert LOGS.judge(rec.trace()).credit == 0


def test_one_message_behind_is_no_log_of_what_came() -> None:
    """A log at every message that has the speed before; a timer that publishes at that instant may be behind."""
    times = [0.5 + 0.2 * k for k in range(50)]
    rec = hearing(str, [])
    for t in times:
        rec.log(t, f"fan {held_at(t - 0.2, SPEEDS) or 0.0}")
    finding = LOGS.judge(rec.trace())
    assert finding.credit == 0
    assert "the number of the previous message on /fan_speed: 100 at t = 2.500 s, when 0 was received" in finding.reason
    assert finding.problem == Problem(ProblemKind.BEHIND)
    for t in times:
        rec.number(t, "/temperature", 24.0)
    assert LOGS.judge(rec.trace()).credit == 1


def test_something_of_its_own_is_seen_through() -> None:
    """A sensor that logs 100 or 0 by its own temperature never shows the drawn values."""
    finding = LOGS.judge(hearing(lambda v: f"fan {100 if v > 50 else 0}").trace())
    assert finding.credit == 0
    assert "the log does not show what was received" in finding.reason


def test_a_first_value_only_is_not_enough() -> None:
    """The first value that is missing is named."""
    finding = LOGS.judge(hearing(lambda v: "fan 100.0").trace())
    assert finding.credit == 0
    assert "3 of 5 values" in finding.reason
    assert "the first is 0 at t = 2.500 s" in finding.reason


def test_no_subscription_is_the_reason() -> None:
    """Nothing can be logged that is not heard."""
    rec = scripted(SPEEDS, "/fan_speed", 12.2).endpoint("subscription", "/fanspeed")
    assert "subscribes to /fanspeed" in LOGS.judge(rec.trace()).reason


@pytest.mark.parametrize(
    ("policies", "said"),
    [
        ({"durability": "transient_local"}, "asks for transient_local durability, which a volatile publisher does not"),
        ({"deadline_ns": NS_PER_S}, "asks for a deadline of 1 s, which a publisher without one does not offer"),
        ({"liveliness": "manual_by_topic"}, "asks for manual_by_topic liveliness, which a publisher with automatic"),
        ({"lease_ns": NS_PER_S}, "asks for a liveliness lease of 1 s, which a publisher without one does not offer"),
    ],
)
def test_a_subscription_that_asks_for_too_much_is_the_reason(policies: dict[str, Any], said: str) -> None:
    """Whatever the policy is that an ordinary publisher does not offer."""
    rec = scripted(SPEEDS, "/fan_speed", 12.2).endpoint("subscription", "/fan_speed", **policies)
    assert said in LOGS.judge(rec.trace()).reason


def test_a_subscription_to_text_is_the_reason() -> None:
    """A type without a number cannot be tried."""
    rec = Recording().endpoint("subscription", "/fan_speed", "std_msgs/msg/String")
    rec.deliver(0.5, "/fan_speed", {"data": "x"}, "std_msgs/msg/String")
    assert "carries no number" in LOGS.judge(rec.trace()).reason


def test_values_sent_before_anybody_listened_are_not_asked_for() -> None:
    """A node that takes 5 s to start heard the later values only."""
    rec = scripted(SPEEDS, "/fan_speed", 12.2)
    rec.process = "temperature_sensor.py"
    rec.endpoint("subscription", "/fan_speed", t_s=5.0)
    for t in (6.0, 7.0, 9.0, 10.0):
        rec.log(t, f"fan {held_at(t, SPEEDS)}")
    assert LOGS.judge(rec.trace()).credit == 1


def test_a_crash_is_the_reason() -> None:
    """The fault is named with its line."""
    finding = LOGS.judge(hearing(str, [0.6]).crashed(0.7, "TypeError: no", 40).trace())
    assert finding.credit == 0
    assert "temperature_sensor.py:40: TypeError: no" in finding.reason


def test_a_recording_without_values_cannot_be_judged() -> None:
    """Nothing was asked, so nothing was answered wrongly."""
    with pytest.raises(HarnessError):
        LOGS.judge(Recording().endpoint("subscription", "/fan_speed").trace())
