"""A client of a service: how often it asks, and that it waits for its server."""

from __future__ import annotations

from typing import Any

import pytest
from nodes import BATTERY, CLIENT, asking, battery, chapter
from tracing import TRIGGER, Recording

from grader.grading.judging.checks.clients import CallsOfClient, WaitsForService
from grader.grading.judging.findings import FAULT_KEY
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.trace import ClockKind

CALLS = CallsOfClient(BATTERY, 5, period=NS_PER_S, tolerance=300 * NS_PER_MS)
WAITS = WaitsForService(CLIENT, BATTERY)


def test_no_client_is_explained() -> None:
    """By a crash, by another name, by nothing."""
    crashed = Recording(9, process=CLIENT).crashed(0.0, process=CLIENT)
    assert FAULT_KEY in CALLS.judge(crashed.trace()).evidence
    other = Recording(9, process=CLIENT).service("client", "/get_status", TRIGGER)
    assert "calls /get_status" in CALLS.judge(other.trace()).reason
    assert CALLS.judge(Recording(9).trace()).credit == 0


def five(**kw: Any) -> Recording:
    return asking(chapter, [battery(84.5 - 0.5 * k) for k in range(5)], **kw)


@pytest.mark.parametrize(
    ("rec", "credit", "said"),
    [
        (five(), 1, "5 requests, 1.1 s apart"),
        (five(delay_s=0.0), 1, "1 s apart"),
        (five(delay_s=0.8), 1, "1.8 s apart"),
        (five(pause_s=1.3), 1, ""),
        (five(pause_s=1.31), 0, "1.410 s from number 1 to number 2, expected 1.0 s ± 0.3 s"),
        (five(pause_s=0.7, delay_s=0.0), 1, ""),
        (five(pause_s=0.69, delay_s=0.0), 0, "0.690 s from number 1"),
        (five(pause_s=0.0, delay_s=0.0), 0, "0.000 s from number 1"),
        (five(pause_s=3.0), 0, "3.100 s from number 1"),
        (five(pause_s=1.5, clock=ClockKind.WALL), 1, ""),
        (asking(chapter, [battery(84.5)] * 4).mark(7.0, "exited", CLIENT), 0, "4 requests, expected 5; battery"),
        (asking(chapter, [battery(84.5)] * 6), 0, "6 requests, expected 5"),
        (asking(chapter, [battery(84.5)] * 3).crashed(8.0), 0, "3 requests, expected 5; battery_service_client.py:12"),
        (asking(chapter, [battery(84.5), None]), 0, "2 requests, expected 5; the last one got no response"),
        (asking(chapter, [battery(84.5), None, *[battery(60.0)] * 3]), 1, "5 requests"),
    ],
)
def test_number_and_gaps_of_the_requests(rec: Recording, credit: int, said: str) -> None:
    """The time a response takes is not the client's; a gap after a lost one is free."""
    finding = CALLS.judge(rec.trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_more_requests_may_be_allowed_and_too_short_a_recording_is_ours() -> None:
    """`at_most` lets a client ask again."""
    six = asking(chapter, [battery(84.5)] * 6)
    assert CallsOfClient(BATTERY, 5, at_most=6).judge(six.trace()).credit == 1
    short = asking(chapter, [battery(84.5)] * 3)
    short.stop_s = 6.0
    with pytest.raises(HarnessError):
        CALLS.judge(short.trace())


def test_waiting_may_be_said_once_or_as_a_warning() -> None:
    """Only not as an error, and not by nothing at all."""
    for waiting, credit in (
        ((("WARN", "no service yet"),), 1),
        ((("ERROR", "no service yet"),), 0),
        ((("FATAL", "no service yet"),), 0),
        ((), 0),
    ):
        assert WAITS.judge(five(waiting=waiting).trace()).credit == credit
    silent = WAITS.judge(five(waiting=()).trace())
    assert "logs nothing while it waits" in silent.reason
    assert "wait_for_service" in silent.hint


def waiting_only(**kw: Any) -> Recording:
    rec = Recording(20.0, process=CLIENT).service("client", BATTERY, TRIGGER, "/mission_planner")
    return rec.log(0.5, "waiting").mark(3.0, "server_starts", BATTERY)


def test_giving_up_is_not_waiting() -> None:
    """By an exception, by ending, or by never asking although the server is there."""
    raised = WAITS.judge(waiting_only().crashed(1.0, "SystemExit: 1").trace())
    assert "while /battery/get_status was not available" in raised.reason
    assert FAULT_KEY in raised.evidence
    early = Recording(1.0, process=CLIENT).log(0.5, "waiting").crashed(1.0)
    assert FAULT_KEY in WAITS.judge(early.trace()).evidence
    ended = WAITS.judge(waiting_only().mark(2.0, "exited", CLIENT).trace())
    assert "ended at t = 2.000 s" in ended.reason
    never = WAITS.judge(waiting_only().trace())
    assert "no request was sent, expected one within 5.0 s" in never.reason
    late = WAITS.judge(waiting_only().request(9.0, BATTERY, 1, "student").trace())
    assert "the first request was sent at t = 9.000 s" in late.reason
    deaf = Recording(20.0, process=CLIENT).log(0.5, "waiting").mark(3.0, "server_starts", BATTERY)
    assert WAITS.judge(deaf.trace()).blocked_by == "service_calls"


def test_a_recording_without_a_wait_is_ours() -> None:
    """The server was there from the start, or never came."""
    for rec in (Recording(9, process=CLIENT), Recording(9, process=CLIENT).mark(0.0, "server_starts", BATTERY)):
        with pytest.raises(HarnessError):
            WAITS.judge(rec.trace())


@pytest.mark.parametrize(("a", "credit"), [(17, 1), (18, 0)])
def test_what_a_client_asks_may_be_asked_for(a: int, credit: int) -> None:
    """The fields of every request."""
    check = CallsOfClient("/add_two_ints", 1, fields={"a": 17, "b": 25})
    rec = Recording(5.0).request(1.0, "/add_two_ints", 1, "student", {"a": a, "b": 25})
    finding = check.judge(rec.trace())
    assert finding.credit == credit
    assert finding.reason.startswith("/add_two_ints: 1 request" if credit else "t = 1.000 s, /add_two_ints: a is 18, ")
