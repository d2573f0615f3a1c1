"""The server of project 3: its number changes with each call; and what students make of it."""

from __future__ import annotations

import math
from typing import Any

import pytest
from nodes import BATTERY, answering, asked, levels, status
from tracing import TRIGGER, Recording

from grader.grading.judging.checks.services import ServiceAnswersAll, ServiceResponse
from grader.grading.judging.findings import FAULT_KEY
from grader.grading.judging.values import FieldRule
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S

FORM = FieldRule(pattern=r"Battery: [0-9]+\.[0-9]% remaining", example="Battery: 84.5% remaining")
RESPONSE = ServiceResponse(BATTERY, {"success": True, "message": FORM})
SEQUENCE = known_checks()["service_sequence"](BATTERY, first=84.5, step=-0.5, floor=0.0, reset_to=100.0)
ALL = ServiceAnswersAll(BATTERY, NS_PER_S)


def test_the_chapters_server_meets_it() -> None:
    """More than two hundred calls, past the reset."""
    finding = SEQUENCE.judge(answering().trace())
    assert finding.credit == 1, finding.reason
    numbers = finding.evidence["numbers"]
    assert numbers[:2] == [84.5, 84.0]
    assert numbers[168:172] == [0.5, 0.0, 100.0, 99.5]


def test_what_is_no_fault_of_the_numbers_is_said_as_of_other_checks() -> None:
    """No server of that name, no response, a crash, a server that nobody asked."""
    other = Recording(5).service("service", "/get_status", TRIGGER, "/battery_monitor")
    finding = SEQUENCE.judge(other.trace())
    assert (finding.credit, finding.blocked_by) == (0, "service_available")
    assert SEQUENCE.judge(asked([None] * 5).trace()).blocked_by == "service_answers_all"
    there = Recording(5).service("service", BATTERY)
    with pytest.raises(HarnessError):
        SEQUENCE.judge(there.trace())
    assert FAULT_KEY in SEQUENCE.judge(there.crashed(0.5).trace()).evidence


@pytest.mark.parametrize("clients", [2, 3, 5])
def test_several_clients_share_one_number(clients: int) -> None:
    """The calls of one instant may be answered in any order."""
    values = [next(source) for source in [levels()] for _ in range(60)]
    groups = [values[k : k + clients] for k in range(0, 60, clients)]
    backwards = [status(v) for group in groups for v in reversed(group)]
    trace = asked(backwards, clients=clients).trace()
    assert SEQUENCE.judge(trace).credit == 1
    assert f"of {clients} clients" in ALL.judge(trace).reason
    own = asked([status(84.5 - 0.5 * (k // clients)) for k in range(60)], clients=clients).trace()
    assert SEQUENCE.judge(own).credit == 0
    assert "are repeated" in SEQUENCE.judge(own).reason


def test_a_server_that_lags_behind_counts_what_it_answers() -> None:
    """Its queue overflows: some requests are lost, and the others are answered in the order of the queue."""
    rec = Recording(30.0, process="battery_service_server.py").service("service", BATTERY, TRIGGER, "/battery_monitor")
    for k in range(9):
        rec.request(1.0 + 0.1 * k, BATTERY, k + 1)
    for place, k in enumerate([0, 4, 2, 7]):
        rec.response(3.0 + 2.0 * place, BATTERY, k + 1, status(84.5 - 0.5 * place))
    assert SEQUENCE.judge(rec.trace()).credit == 1
    assert ALL.judge(rec.trace()).credit == 0


def test_a_lost_response_does_not_move_the_numbers() -> None:
    """It is missing in the one check, and its number was used up in the other."""
    source = levels()
    values = [status(next(source)) for _ in range(40)]
    trace = asked([None if k == 7 else v for k, v in enumerate(values)]).trace()
    assert SEQUENCE.judge(trace).credit == 1
    finding = ALL.judge(trace)
    assert finding.credit == 0
    assert finding.reason.startswith("t = 1.350 s, /battery/get_status: no response, expected one within 1.0 s")
    assert "late or unanswered: 1 of 40 requests" in finding.reason


WRONG_NUMBERS = {
    "told before lowered": (
        lambda: (85.0 - 0.5 * k for k in range(99)),
        "each response has the old number",
        "first, then",
    ),
    "whole steps": (lambda: levels(step=1.0), "changes by -1 with each call, expected -0.5", ""),
    "rises": (lambda: (85.5 + 0.5 * k for k in range(99)), "changes by 0.5", ""),
    "constant": (lambda: (84.5 for _ in range(99)), "84.5 in every response", "attribute"),
    "starts at 100": (lambda: levels(100.0), "the first number is 99.5", ""),
    "reset to 85": (lambda: levels(reset=85.0), "85 after 0 in response 171, expected 100", ""),
    "reset a step later": (lambda: (84.5 - 0.5 * k for k in range(300)), "-0.5 after 0 in response 171", ""),
    "stops at 0": (lambda: (max(0.0, 84.5 - 0.5 * k) for k in range(300)), "0 after 0 in response 171", ""),
    "every second call": (lambda: (84.5 - 0.5 * (k // 2) for k in range(300)), "are repeated", "attribute"),
    "no number": (lambda: (math.nan for _ in range(300)), "nan in response 1", ""),
}


@pytest.mark.parametrize(("source", "said", "hint"), WRONG_NUMBERS.values(), ids=WRONG_NUMBERS)
def test_other_numbers_are_named(source: Any, said: str, hint: str) -> None:
    """The first wrong response, and what the numbers do instead where that is plain."""
    values = [v for v, _ in zip(source(), range(210), strict=False)]
    finding = SEQUENCE.judge(asked(map(status, values)).trace())
    assert finding.credit == 0
    assert said in finding.reason
    assert hint in finding.hint
    texts = [status(v) for v in values if v >= 0]
    assert not texts or RESPONSE.judge(asked(texts).trace()).credit == 1


def test_the_words_and_the_numbers_are_two_questions() -> None:
    """Two decimals lose one of them only; a text without a number loses both."""
    two_decimals = answering(9, lambda v: {"success": True, "message": f"Battery: {v:.2f}% remaining"})
    assert SEQUENCE.judge(two_decimals.trace()).credit == 1
    assert RESPONSE.judge(two_decimals.trace()).credit == 0
    empty = SEQUENCE.judge(answering(9, lambda v: {"success": True, "message": ""}).trace())
    assert "no number in ''" in empty.reason


def test_a_number_may_be_a_field_or_found_by_a_pattern() -> None:
    """Rising numbers work as well."""
    rec = asked([{"sum": 2 * k} for k in range(9)])
    assert type(SEQUENCE)(BATTERY, 0, 2, field="sum").judge(rec.trace()).credit == 1
    rec = asked([{"message": f"node 7 says {3 * k}!"} for k in range(9)])
    assert type(SEQUENCE)(BATTERY, 0, 3, pattern="says ([0-9]+)").judge(rec.trace()).credit == 1
    assert type(SEQUENCE)(BATTERY, 0, 3).judge(rec.trace()).credit == 0
    rec = asked([{"message": str(min(k, 4))} for k in range(9)])
    assert type(SEQUENCE)(BATTERY, 0, 1, floor=4).judge(rec.trace()).credit == 1
