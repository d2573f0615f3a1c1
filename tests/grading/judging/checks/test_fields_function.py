"""A field that follows a formula: written in several ways, and missed in the ways that students miss it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import pytest
from tracing import FLOAT64, Recording, twist

from grader.grading.judging.checks.fields import FieldFunction
from grader.grading.judging.findings import FAULT_KEY
from grader.runtime.model.trace import ClockKind

CHECK = FieldFunction("/joint_commands", "sin(0.1 * n)", tolerance=1e-6)
DEGREES = 180 / math.pi


def joint(values: Iterable[float], start_s: float = 0.1, period_s: float = 0.1) -> Recording:
    rec = Recording(10.1, process="simple_publisher.py")
    rec.endpoint("publisher", "/joint_commands", FLOAT64, "/joint_command_publisher")
    for k, value in enumerate(values):
        rec.number(start_s + k * period_s, "/joint_commands", value, FLOAT64)
    return rec


def each(write: Callable[[int], float], count: int = 100) -> Recording:
    return joint(write(n) for n in range(count))


def summed(count: int) -> list[float]:
    angle, values = 0.0, []
    for _ in range(count):
        values.append(math.sin(angle))
        angle += 0.1
    return values


@pytest.mark.parametrize(
    "rec",
    [
        each(lambda n: math.sin(n * 0.1)),
        each(lambda n: math.sin(n / 10)),
        each(lambda n: math.cos(n / 10 - math.pi / 2)),
        joint(summed(100)),
        each(lambda n: math.sin(0.1 * n) + 5e-7),
        each(lambda n: math.sin(0.1 * n), 10),
        each(lambda n: math.sin(0.1 * n), 60).crashed(6.1),
    ],
    ids=["product", "quotient", "cosine moved", "summed up", "near", "just enough", "crashed later"],
)
def test_right_values_are_met_however_they_are_computed(rec: Recording) -> None:
    """A crash after enough messages is a question of others."""
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 1, finding.reason
    assert "follows sin(0.1 * n)" in finding.reason


@pytest.mark.parametrize(
    ("write", "said", "hint"),
    [
        (lambda n: math.sin(0.1 * (n + 1)), "starts at 1", "count afterwards"),
        (lambda n: math.sin(0.1 * (n - 2)), "starts at -2", ""),
        (lambda n: 0.0, "0 in every message", "grows by 1"),
        (lambda n: math.sin(0.1), "0.0998334 in every message", "grows by 1"),
        (lambda n: DEGREES * math.sin(0.1 * n), "57.2958 times", "degrees and radians"),
        (lambda n: math.sin(math.radians(0.1 * n)), "converted between degrees", "radians"),
        (lambda n: math.sin(math.degrees(0.1 * n)), "converted between degrees", "radians"),
        (lambda n: -math.sin(0.1 * n), "-1 times", "sign"),
        (lambda n: 0.5 * math.sin(0.1 * n), "0.5 times", ""),
        (math.sin, "10 times too fast", "factor of n"),
        (lambda n: math.sin(0.01 * n), "10 times too slowly", "factor of n"),
        (lambda n: math.sin(0.2 * n), "2 times too fast", "factor of n"),
        (lambda n: math.sin(0.11 * n), "1.1 times too fast", "factor of n"),
        (lambda n: math.cos(0.1 * n), "follow cos(0.1 * n)", "sine and cosine"),
        (lambda n: round(math.sin(0.1 * n), 2), "rounded to 2 decimals", "as it is"),
        (lambda n: math.sin(0.1 * (n // 2)), "each value is published 2 times", "grows by 1"),
        (lambda n: 0.1 * n, "", ""),
        (lambda n: math.nan, "", ""),
        (lambda n: math.inf, "", ""),
    ],
)
def test_what_is_followed_instead_is_named(write: Callable[[int], float], said: str, hint: str) -> None:
    """With a hint where one mistake is very likely."""
    finding = CHECK.judge(each(write).trace())
    assert finding.credit == 0
    assert said in finding.reason
    assert hint in finding.hint
    assert bool(hint) == bool(finding.hint)


def test_the_first_wrong_message_is_named() -> None:
    """One is enough."""
    finding = CHECK.judge(each(lambda n: math.sin(0.1 * n) + (n == 41)).trace())
    assert finding.credit == 0
    assert finding.reason.startswith("t = 4.200 s, /joint_commands: data is 0.181723 in message n = 41, expected sin(")
    assert finding.reason.endswith("wrong in 1 of 100 messages")


def test_a_lost_start_is_found_only_where_it_is_allowed() -> None:
    """By default the first message seen is the first one there is."""
    rec = each(lambda n: math.sin(0.1 * (n + 3)))
    lenient = FieldFunction("/joint_commands", "sin(0.1 * n)", start_tolerance=3)
    assert lenient.judge(rec.trace()).credit == 1
    assert "n = 3" in lenient.judge(rec.trace()).reason
    assert FieldFunction("/joint_commands", "sin(0.1 * n)", start_tolerance=2).judge(rec.trace()).credit == 0
    assert CHECK.judge(rec.trace()).credit == 0


def test_too_few_messages_show_nothing() -> None:
    """The first value alone is right for many; a crash is the reason where there was one."""
    finding = CHECK.judge(each(lambda n: math.sin(0.1 * n), 9).trace())
    assert (finding.credit, finding.blocked_by) == (0, "topic_rate")
    crashed = CHECK.judge(each(lambda n: 0.0, 1).crashed(0.1).trace())
    assert "expected at least 10; node.py:12" in crashed.reason.replace("simple_publisher.py", "node.py")
    assert FAULT_KEY in crashed.evidence


def test_no_message_is_explained() -> None:
    """As for every check on a topic."""
    assert CHECK.judge(Recording().trace()).credit == 0
    assert "/joint_command" in CHECK.judge(Recording().number(1, "/joint_command", 0.0).trace()).reason
    wrong_type = Recording().message(1, "/joint_commands", {"data": "0.1"}, "std_msgs/msg/String")
    assert "has no number data" in CHECK.judge(wrong_type.trace()).reason


def test_time_may_stand_in_a_formula_and_jitters_on_the_wall_clock() -> None:
    """T counts from the first message; on the wall clock, 50 ms are accepted."""
    check = FieldFunction("/cmd_vel", "2 * t", field="linear.x", tolerance=0.001)
    for clock, late, credit in (
        (ClockKind.VIRTUAL, 0.0, 1),
        (ClockKind.VIRTUAL, 0.04, 0),
        (ClockKind.WALL, 0.04, 1),
        (ClockKind.WALL, 0.06, 0),
    ):
        rec = Recording(5.0, clock)
        for k in range(30):
            rec.message(1 + 0.1 * k + late * (k % 2), "/cmd_vel", twist((0.2 * k, 0, 0)))
        assert check.judge(rec.trace()).credit == credit


def test_a_wider_tolerance_never_takes_credit() -> None:
    """Credit grows with the tolerance."""
    trace = each(lambda n: math.sin(0.1 * n) + 0.01).trace()
    earned = [FieldFunction("/joint_commands", "sin(0.1 * n)", tolerance=t).judge(trace).credit for t in (0, 0.01, 1)]
    assert earned == [0, 1, 1]


@pytest.mark.parametrize(
    ("write", "credit", "said"),
    [
        ("Hello World: {}", 1, "data follows n in 20 messages"),
        ("Hello World:{}", 0, "no number where expected in data, 'Hello World:0'"),
        ("Hello World: {}.5", 0, "data is 0.5 in message n = 0, expected n = 0"),
        ("Hello World: 7", 0, "it is 7 in every message"),
    ],
)
def test_the_number_may_stand_in_a_text(write: str, credit: int, said: str) -> None:
    """A pattern tells where."""
    check = FieldFunction("/topic", "n", pattern=r"Hello World: ([\d.]+)")
    rec = Recording(5.0)
    for k in range(20):
        rec.message(0.1 * k, "/topic", {"data": write.format(k)}, "std_msgs/msg/String")
    finding = check.judge(rec.trace())
    assert finding.credit == credit
    assert said in finding.reason
