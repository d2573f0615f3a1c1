"""Fields that equal, lie in a range, or go one way; and records found by their text."""

from __future__ import annotations

import math
import struct
from fractions import Fraction
from typing import Any

import pytest
from tracing import Recording

from grader.grading.judging.checks.fields import FieldEqual, FieldInRange, FieldMonotone
from grader.grading.judging.checks.logs import LogsMatching
from grader.grading.judging.checks.topics import FieldValues
from grader.grading.judging.findings import FAULT_KEY
from grader.grading.judging.values import FieldRule
from grader.runtime.model.quantities import NS_PER_S


def sending(values: list[Any]) -> Recording:
    rec = Recording(10.0)
    for k, value in enumerate(values):
        rec.message(1 + 0.1 * k, "/a", value if isinstance(value, dict) else {"data": value})
    return rec


STAMPED = {"header": {"frame_id": "map"}, "ok": True, "pose": {"x": 1.0, "list": [1, 2.0]}}
EQUAL = FieldEqual(
    "/a", {"header.frame_id": "map", "ok": True, "pose.x": 1, "pose.list": FieldRule(items=(1, 2)), "pose.list.1": 2}
)


@pytest.mark.parametrize(
    ("change", "credit", "said"),
    [
        ({}, 1, "/a: header.frame_id = 'map', ok = true, pose.x = 1, pose.list = [1, 2], pose.list.1 = 2"),
        ({"header": {"frame_id": "odom"}}, 0, "t = 1.300 s, /a: header.frame_id is 'odom', expected 'map'; wrong in 1"),
        ({"ok": False}, 0, "ok is false, expected true"),
        ({"ok": 1}, 0, "ok is 1, expected true"),
        ({"pose": {"x": 1.0 + 5e-7, "list": [1, 2]}}, 1, ""),
        ({"pose": {"x": math.nan, "list": [1, 2]}}, 0, "pose.x is nan, expected 1"),
        (
            {"pose": {"x": 1, "list": [2, 1]}},
            0,
            "pose.list is [2, 1], pose.list.1 is 1, expected [1, 2], 2; wrong",
        ),
        ({"pose": {"x": 1, "list": [1]}}, 0, "pose.list is [1], expected [1, 2]"),
        ({"header": 3}, 0, "/a: std_msgs/msg/Float32 has no field header.frame_id"),
        ({"ok": "yes"}, 0, "ok is 'yes', expected true"),
    ],
)
def test_fields_of_every_kind_are_compared(change: dict[str, Any], credit: int, said: str) -> None:
    """One message that differs is enough."""
    finding = EQUAL.judge(sending([STAMPED, STAMPED, STAMPED, {**STAMPED, **change}]).trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_what_was_expected_and_found_is_in_the_evidence() -> None:
    """By either name of the check: what is expected, a range as a text, and the wrong numbers that were found."""
    check = FieldEqual("/a", {"ok": True, "pose.x": FieldRule(low=0, high=1), "header.frame_id": "map"})
    wrong = {**STAMPED, "pose": {"x": 3}, "header": {"frame_id": "m" * 999}}
    found = check.judge(sending([STAMPED, wrong, wrong]).trace()).evidence
    assert found["values"] == {"ok": True, "pose.x": "0 to 1", "header.frame_id": "map"}
    assert (found["messages"], found["wrong"], found["field"], found["found"]) == (3, 2, "pose.x", {"pose.x": 3.0})
    numbers = FieldValues("/a", {"ok": 1, "pose.x": 1}).judge(sending([wrong]).trace()).evidence
    assert (numbers["values"], numbers["field"], numbers["found"]) == ({"ok": 1, "pose.x": 1}, "ok", {"pose.x": 3.0})


@pytest.mark.parametrize(("values", "where"), [([2], "the only message"), ([2, 3], "all 2 messages")])
def test_it_says_if_every_message_is_wrong(values: list[int], where: str) -> None:
    """By either name of the check."""
    for check in (FieldEqual("/a", {"data": 1}), FieldValues("/a", {"data": 1})):
        finding = check.judge(sending(values).trace())
        assert finding.reason == f"t = 1.000 s, /a: data is 2, expected 1; wrong in {where}"
        assert finding.brief == "/a: data is 2, expected 1"


@pytest.mark.parametrize(
    ("values", "credit", "said"),
    [
        ([0.0, 0.5, 1.0], 1, "from 0 to 1 in 3 messages, expected 0 to 1"),
        ([0.0, 1.1, 2.0], 0, "t = 1.100 s, /a: data is 1.1, expected 0 to 1; outside in 2 of 3 messages"),
        ([-0.1], 0, "data is -0.1"),
        ([math.nan], 0, "data is nan"),
        ([math.inf], 0, "data is inf"),
        (["1"], 0, "has no number data"),
        ([True], 0, "has no number data"),
        ([], 0, "no publisher"),
    ],
)
def test_a_range_has_its_edges_inside(values: list[Any], credit: int, said: str) -> None:
    """NaN and infinities are outside."""
    finding = FieldInRange("/a", 0, 1).judge(sending(values).trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


@pytest.mark.parametrize(
    ("values", "credit", "said"),
    [
        ([[0.0, 1.0], [0.5]], 1, "from 0 to 1 in 2 messages"),
        ([[0.0, 1.0], [0.5, 1.1, 2.0]], 0, "data is 1.1, expected 0 to 1; outside in 1 of 2 messages"),
        ([[0.5], []], 0, "has no number data"),
        ([[0.5, "1"]], 0, "has no number data"),
    ],
)
def test_a_list_lies_in_a_range_if_each_number_does(values: list[Any], credit: int, said: str) -> None:
    """As in the messages of a simulation; an empty list shows nothing."""
    finding = FieldInRange("/a", 0, 1).judge(sending(values).trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_an_edge_that_single_precision_has_rounded_is_inside() -> None:
    """A node that publishes its limit as float32 keeps it."""
    rounded = struct.unpack("f", struct.pack("f", 0.1))[0]
    assert rounded > 0.1
    assert FieldInRange("/a", 0, 0.1).judge(sending([rounded]).trace()).credit == 1
    assert FieldInRange("/a", 0, 0.1).judge(sending([0.1001]).trace()).credit == 0


@pytest.mark.parametrize(
    ("check", "values", "credit", "said"),
    [
        (FieldMonotone("/a"), [1, 2, 2, 3], 1, "only rising, from 1 to 3"),
        (FieldMonotone("/a", strictly=True), [1, 2, 2, 3], 0, "goes from 2 to 2"),
        (
            FieldMonotone("/a"),
            [1, 2, 1, 3],
            0,
            "t = 1.200 s, /a: data goes from 2 to 1, expected rising values; 1 time",
        ),
        (FieldMonotone("/a", "falling"), [3, 2, 1], 1, ""),
        (FieldMonotone("/a", "falling"), [1, 2, 3], 0, "2 times in all"),
        (FieldMonotone("/a"), [1, 1, 1], 0, "never changes"),
        (FieldMonotone("/a"), [1, math.nan, 3], 0, "goes from 1 to nan"),
        (FieldMonotone("/a"), [1, 2], 0, "2 messages, expected at least 3"),
        (FieldMonotone("/a"), [1, "x", 3], 0, "has no number"),
    ],
)
def test_a_series_goes_one_way(check: FieldMonotone, values: list[Any], credit: int, said: str) -> None:
    """Each step is looked at."""
    finding = check.judge(sending(values).trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_too_few_messages_before_a_crash_are_its_fault() -> None:
    """For each of the three."""
    for check in (FieldEqual("/a", {"data": 1}, at_least=5), FieldInRange("/a", 0, 1, at_least=5), FieldMonotone("/a")):
        assert FAULT_KEY in check.judge(sending([1]).crashed(1.05).trace()).evidence
        assert check.judge(sending([1]).trace()).credit == 0


def logging(texts: list[tuple[str, str]], printed: bool = False) -> Recording:
    rec = Recording(10.0)
    for k, (level, text) in enumerate(texts):
        if printed:
            rec.line(1.0 + k, text)
        else:
            rec.log(1.0 + k, text, level)
    return rec


SAID = [("INFO", "speed 1.5"), ("WARN", "speed too high"), ("INFO", "done"), ("ERROR", "speed lost")]


@pytest.mark.parametrize(
    ("check", "credit", "said"),
    [
        (LogsMatching("node.py", "speed"), 1, "3 records, the first at t = 1.000 s: speed 1.5"),
        (LogsMatching("node.py", r"speed \d"), 1, "1 record"),
        (LogsMatching("node.py", "velocity"), 0, "0 records of that kind; expected at least 1"),
        (LogsMatching("node.py", "speed", "WARN"), 1, "2 records"),
        (LogsMatching("node.py", "speed", "WARN", exactly=True), 1, "1 record"),
        (LogsMatching("node.py", "done", "WARN"), 0, "logged: INFO speed 1.5, WARN speed too high and 2 more"),
        (LogsMatching("node.py", at_least=4, at_most=4), 1, "4 records"),
        (LogsMatching("node.py", at_most=3), 0, "4 records of that kind"),
        (LogsMatching("node.py", level="ERROR", at_least=0, at_most=0), 0, "1 record"),
        (LogsMatching("node.py", level="FATAL", at_least=0, at_most=0), 1, "0 records"),
        (LogsMatching("node.py", period=NS_PER_S), 1, ""),
        (LogsMatching("node.py", period=2 * NS_PER_S), 0, "one every 1.000 s on average"),
        (LogsMatching("node.py", "done", period=NS_PER_S), 0, "too few to measure a period"),
        (LogsMatching("other.py"), 0, "nothing was logged"),
    ],
)
def test_records_are_counted_by_level_text_and_period(check: LogsMatching, credit: int, said: str) -> None:
    """A higher level counts as well, unless it is asked for exactly."""
    finding = check.judge(logging(SAID).trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_printing_is_half_and_a_crash_is_the_reason() -> None:
    """As for every log."""
    assert LogsMatching("node.py", "speed").judge(logging(SAID, printed=True).trace()).credit == Fraction(1, 2)
    assert LogsMatching("node.py", "velocity").judge(logging(SAID, printed=True).trace()).credit == 0
    assert FAULT_KEY in LogsMatching("node.py").judge(Recording().crashed(0.0).trace()).evidence
