"""A battery server: there, answering everybody, in the right words and numbers; and what students make of it."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from nodes import BATTERY, answering, asked, levels, status
from tracing import TRIGGER, Recording

from grader.grading.judging.checks.services import ServiceAnswersAll, ServiceAvailable, ServiceFunction, ServiceResponse
from grader.grading.judging.findings import FAULT_KEY
from grader.grading.judging.values import FieldRule
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import ClockKind

FORM = FieldRule(pattern=r"Battery: [0-9]+\.[0-9]% remaining", example="Battery: 84.5% remaining")
AVAILABLE = ServiceAvailable(BATTERY, TRIGGER)
RESPONSE = ServiceResponse(BATTERY, {"success": True, "message": FORM})
ALL = ServiceAnswersAll(BATTERY, NS_PER_S)


def single(value: float) -> float:
    """Return a number as a field of type float32 holds it."""
    return float(struct.unpack("f", struct.pack("f", value))[0])


def test_the_chapters_server_meets_everything() -> None:
    """More than two hundred calls."""
    trace = answering().trace()
    for check in (AVAILABLE, RESPONSE, ALL):
        finding = check.judge(trace)
        assert finding.credit == 1, finding.reason


WRONG_TEXTS = {
    "two decimals": lambda v: {"success": True, "message": f"Battery: {v:.2f}% remaining"},
    "no percent sign": lambda v: {"success": True, "message": f"Battery: {v:.1f} remaining"},
    "a space": lambda v: {"success": True, "message": f"Battery: {v:.1f} % remaining"},
    "more text": lambda v: {"success": True, "message": f"Battery: {v:.1f}% remaining."},
    "no success": lambda v: {"success": False, "message": f"Battery: {v:.1f}% remaining"},
    "whole numbers": lambda v: {"success": True, "message": f"Battery: {v:.0f}% remaining"},
    "empty": lambda v: {"success": True, "message": ""},
    "one as a number": lambda v: {"success": 1, "message": f"Battery: {v:.1f}% remaining"},
    "no field": lambda v: {"success": True},
}


@pytest.mark.parametrize("write", WRONG_TEXTS.values(), ids=WRONG_TEXTS)
def test_other_words_are_named(write: Any) -> None:
    """What is in the response, and what was expected."""
    finding = RESPONSE.judge(answering(9, write).trace())
    assert finding.credit == 0
    assert finding.reason.startswith("t = 1.000 s, /battery/get_status: ")
    assert "expected" in finding.reason
    assert "wrong in 9 of 9 responses" in finding.reason
    assert "\\." not in finding.reason


def test_a_field_at_its_default_was_forgotten() -> None:
    """The hint names the place where it is set."""
    hint = RESPONSE.judge(answering(9, WRONG_TEXTS["no success"]).trace()).hint
    assert hint == "set response.success before the response is returned"
    assert RESPONSE.judge(answering(9, WRONG_TEXTS["two decimals"]).trace()).hint == ""


def test_a_server_that_is_not_there_is_explained() -> None:
    """By another name, with another type, by a crash, or not at all."""
    other = Recording(5).service("service", "/get_status", TRIGGER, "/battery_monitor")
    assert "'/get_status'" not in AVAILABLE.judge(other.trace()).reason
    assert "offers /get_status [std_srvs/srv/Trigger]" in AVAILABLE.judge(other.trace()).reason
    typed = Recording(5).service("service", BATTERY, "std_srvs/srv/SetBool")
    assert "of type std_srvs/srv/SetBool, expected std_srvs/srv/Trigger" in AVAILABLE.judge(typed.trace()).reason
    crashed = AVAILABLE.judge(Recording(5).crashed(0.0).trace())
    assert FAULT_KEY in crashed.evidence
    assert "not in the ROS graph in 5.0 s" in AVAILABLE.judge(Recording(5).trace()).reason
    for check in (RESPONSE, ALL):
        finding = check.judge(other.trace())
        assert (finding.credit, finding.blocked_by) == (0, "service_available")


def test_a_server_that_nobody_asked_is_ours() -> None:
    """Unless it ended before."""
    there = Recording(5).service("service", BATTERY)
    for check in (RESPONSE, ALL):
        with pytest.raises(HarnessError):
            check.judge(there.trace())
    there.crashed(0.5)
    for check in (RESPONSE, ALL):
        assert FAULT_KEY in check.judge(there.trace()).evidence


def test_an_answer_shows_a_server_without_a_graph() -> None:
    """The graph is not looked at in every recording."""
    rec = Recording(5).request(1, BATTERY, 1).response(1, BATTERY, 1, status(84.5))
    assert AVAILABLE.judge(rec.trace()).credit == 1


def test_a_callback_that_returns_nothing_answers_nobody() -> None:
    """In silence or with an exception."""
    silent = ALL.judge(asked([None] * 5).trace())
    assert silent.credit == 0
    assert "return response" in silent.hint
    assert RESPONSE.judge(asked([None] * 5).trace()).blocked_by == "service_answers_all"
    raised = ALL.judge(asked([None] * 5).crashed(1.0, "TypeError: no response", 20).trace())
    assert FAULT_KEY in raised.evidence
    assert FAULT_KEY in RESPONSE.judge(asked([None] * 5).crashed(1.0).trace()).evidence


def test_a_slow_answer_is_late_on_one_clock_and_let_pass_on_the_other() -> None:
    """A quarter of a second is the machine's."""
    values = [status(v) for v, _ in zip(levels(), range(5), strict=False)]
    for late_s, clock, credit in (
        (1.0, ClockKind.VIRTUAL, 1),
        (1.1, ClockKind.VIRTUAL, 0),
        (1.2, ClockKind.WALL, 1),
        (1.3, ClockKind.WALL, 0),
    ):
        rec = asked(values, late_s=late_s, period_s=2.0)
        rec.clock = clock
        assert ALL.judge(rec.trace()).credit == credit
    late = ALL.judge(asked(values, late_s=1.5, period_s=2.0).trace())
    assert "the response took 1.500 s" in late.reason


def test_what_cannot_have_been_answered_yet_is_left_out() -> None:
    """A request at the very end needs no answer."""
    rec = answering(5)
    rec.request(29.9, BATTERY, 6)
    assert ALL.judge(rec.trace()).credit == 1


@pytest.mark.parametrize(
    ("rule", "right", "wrong"),
    [
        (FieldRule(equals=1.5, tolerance=0.1), [1.4, 1.6, 1.5], [1.3, math.nan, "1.5", True, None, math.inf]),
        (FieldRule(equals="a"), ["a"], ["b", 1, None]),
        (FieldRule(equals="yes"), [True, "yes"], [False, 1, "no"]),
        (FieldRule(equals=False), [False], [True, 0, 0.0, ""]),
        (FieldRule(low=1), [1, 2, math.inf], [0.9, math.nan, "2", True]),
        (FieldRule(high=1), [1, -5], [1.1, math.nan]),
        (FieldRule(low=-0.1, high=0.1), [single(0.1), single(-0.1), 0.1], [0.10001, -0.10001]),
        (FieldRule(high=1_000_000.8), [single(1_000_000.8), 1_000_000], [1_000_001, 1_000_001.0]),
        (FieldRule(low=0, high=1, pattern="x"), [], [0.5, "x"]),
        (FieldRule(pattern="a+"), ["aa"], ["ab", "", 1, "a" * 3000]),
    ],
)
def test_a_rule_allows_what_it_says(rule: FieldRule, right: list[Any], wrong: list[Any]) -> None:
    """Yes is no 1, and no number is in a range."""
    assert all(map(rule.allows, right))
    assert not any(map(rule.allows, wrong))


@pytest.mark.parametrize(
    ("add", "credit", "said"),
    [
        (lambda a, b: {"sum": a + b}, 1, "sum = a + b in 3 responses, such as 5"),
        (lambda a, b: {"sum": a - b}, 0, "t = 1.010 s, /add_two_ints: sum is -8, expected a + b = 42; wrong in 3 of 3"),
        (lambda a, b: {"sum": a + abs(b)}, 0, "sum is 9, expected a + b = 5; wrong in 1 of 3"),
        (lambda a, b: {"sum": 0}, 0, "sum is 0"),
        (lambda a, b: {"total": a + b}, 0, "sum is no number"),
    ],
)
def test_an_answer_may_follow_a_formula_of_its_request(add: Any, credit: int, said: str) -> None:
    """The numbers of each request are drawn, so that no table of answers helps."""
    check = ServiceFunction("/add_two_ints", "sum", "a + b", at_least=3)
    rec = Recording(9.0).service("service", "/add_two_ints", TRIGGER)
    for k, (a, b) in enumerate([(17, 25), (0, 3), (7, -2)], 1):
        rec.request(k, "/add_two_ints", k, value={"a": a, "b": b}).response(k + 0.01, "/add_two_ints", k, add(a, b))
    finding = check.judge(rec.trace())
    assert finding.credit == credit
    assert said in finding.reason
    assert ("set response.sum" in finding.hint) == (add(17, 25).get("sum", 0) == 0)


def test_too_few_answers_and_requests_without_a_value_prove_no_formula() -> None:
    """A request that the formula has no value for asks nothing."""
    check = ServiceFunction("/divide", "quotient", "a / b")
    rec = Recording(9.0).service("service", "/divide", TRIGGER)
    rec.request(1, "/divide", 1, value={"a": 1, "b": 0}).response(1.1, "/divide", 1, {"quotient": 9.0})
    assert check.judge(rec.trace()).reason == "/divide: 0 responses, expected at least 1"
    rec.request(2, "/divide", 2, value={"a": 1, "b": 2}).response(2.1, "/divide", 2, {"quotient": 0.5})
    assert check.judge(rec.trace()).credit == 1
