"""An action server that counts Fibonacci numbers: goals, results and feedback, rightly and wrongly."""

from __future__ import annotations

from typing import Any

import pytest
from tracing import Recording

from grader.grading.judging.checks.actions import ActionFeedback, ActionResult
from grader.grading.judging.findings import FAULT_KEY
from grader.grading.judging.values import FieldRule
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S

NAME, TYPE = "/fibonacci", "test_msgs/action/Fibonacci"
NUMBERS = [0, 1, 1, 2, 3, 5]
RESULT = ActionResult(NAME, result={"sequence": FieldRule(items=tuple(NUMBERS))}, within=5 * NS_PER_S)
FEEDBACK = ActionFeedback(NAME, at_least=4, grows="sequence", period=NS_PER_S // 2)


def goal(
    rec: Recording,
    number: int = 1,
    at: float = 1.0,
    accepted: bool | None = True,
    status: int | None = 4,
    result: list[int] | None = None,
    feedback: list[list[int]] | None = None,
    pace: float = 0.5,
    took: float = 3.0,
) -> Recording:
    """One goal with what came of it; None is no answer."""
    identity = {"goal_id": {"uuid": [number] * 16}}
    sent = {**identity, "goal": {"order": 5}}
    rec.request(at, f"{NAME}/_action/send_goal", number, value=sent, type_=f"{TYPE}_SendGoal")
    if accepted is None:
        return rec
    rec.response(at, f"{NAME}/_action/send_goal", number, {"accepted": accepted}, type_=f"{TYPE}_SendGoal")
    if not accepted:
        return rec
    rec.request(at, f"{NAME}/_action/get_result", number, value=identity, type_=f"{TYPE}_GetResult")
    partial = feedback if feedback is not None else [NUMBERS[:k] for k in range(2, 6)]
    for k, sequence in enumerate(partial, 1):
        value = {**identity, "feedback": {"sequence": sequence}}
        rec.message(at + pace * k, f"{NAME}/_action/feedback", value, f"{TYPE}_FeedbackMessage")
    if status is not None:
        found = {"status": status, "result": {"sequence": NUMBERS if result is None else result}}
        rec.response(at + took, f"{NAME}/_action/get_result", number, found, type_=f"{TYPE}_GetResult")
    return rec


def one(**kw: Any) -> Recording:
    return goal(Recording(10.0), **kw)


@pytest.mark.parametrize(
    ("check", "rec", "credit", "said"),
    [
        (RESULT, one(), 1, "/fibonacci: 1 goal succeeded, sequence [0, 1, 1, 2, 3, 5]"),
        (RESULT, goal(one(), 2, 5.0), 1, "2 goals succeeded"),
        (RESULT, one(took=5.0), 1, ""),
        (RESULT, one(took=5.1), 0, "its result took 5.100 s, expected within 5 s"),
        (RESULT, one(result=[0, 1, 1, 2]), 0, "in its result sequence is [0, 1, 1, 2], expected [0, 1, 1, 2, 3, 5]"),
        (RESULT, one(status=6), 0, "goal 1: aborted, expected that it succeeds"),
        (RESULT, one(status=0), 0, "status 0, expected"),
        (RESULT, one(accepted=False), 0, "rejected, expected that it succeeds"),
        (RESULT, one(accepted=None), 0, "no response to the goal"),
        (RESULT, one(status=None), 0, "no result in 9.0 s"),
        (RESULT, goal(one(), 2, 5.0, result=[]), 0, "t = 5.000 s, /fibonacci, goal 2: in its result sequence is []"),
        (ActionResult(NAME), one(result=[7]), 1, "1 goal succeeded"),
        (ActionResult(NAME, "canceled"), one(status=5), 1, "1 goal canceled"),
        (ActionResult(NAME, "canceled"), one(), 0, "succeeded, expected that it is canceled"),
        (ActionResult(NAME, "aborted"), one(status=6), 1, ""),
        (ActionResult(NAME, "rejected"), one(accepted=False), 1, "1 goal rejected"),
        (ActionResult(NAME, "rejected"), one(), 0, "accepted, expected that it is rejected"),
        (FEEDBACK, one(), 1, "4 messages of feedback"),
        (FEEDBACK, goal(one(), 2, 5.0), 1, "4, 4 messages of feedback"),
        (FEEDBACK, one(feedback=[]), 0, "0 messages of feedback, expected at least 4"),
        (FEEDBACK, one(feedback=[[0]] * 4), 0, "sequence is [0] at t = 2.000 s, after [0]"),
        (FEEDBACK, one(pace=0.25), 0, "one message every 0.250 s on average, expected every 0.5 s ± 10 %"),
        (FEEDBACK, goal(one(), 2, 5.0, feedback=[]), 0, "goal 2: 0 messages"),
        (ActionFeedback(NAME, at_most=3), one(), 0, "4 messages of feedback, expected at least 1 and at most 3"),
        (ActionFeedback(NAME, fields={"sequence.0": 0}), one(), 1, ""),
        (ActionFeedback(NAME, fields={"sequence.0": 1}), one(), 0, "t = 1.500 s sequence.0 is 0, expected 1"),
        (ActionFeedback(NAME, grows="distance"), one(), 0, "distance is nothing"),
    ],
)
def test_goals_results_and_feedback(check: Any, rec: Recording, credit: int, said: str) -> None:
    """Each goal is looked at by itself."""
    finding = check.judge(rec.trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_a_rejected_goal_has_no_feedback() -> None:
    """The result's criterion reports it."""
    assert FEEDBACK.judge(one(accepted=False).trace()).blocked_by == "action_result"


def test_crashes_and_absent_servers_are_explained() -> None:
    """A goal that was never sent to a server that was there is ours."""
    for check in (RESULT, FEEDBACK):
        assert FAULT_KEY in check.judge(one(status=None, feedback=[]).crashed(1.2).trace()).evidence
        assert FAULT_KEY in check.judge(Recording().crashed(0.0).trace()).evidence
        other = Recording(10.0).service("service", "/fibonaci/_action/send_goal", f"{TYPE}_SendGoal")
        finding = check.judge(other.trace())
        assert finding.hint == "name the action /fibonacci instead of /fibonaci"
        assert "no action server in 10.0 s; seen: /fibonaci" in finding.reason
        with pytest.raises(HarnessError):
            check.judge(Recording().service("service", f"{NAME}/_action/send_goal").trace())
    with pytest.raises(HarnessError):
        RESULT.judge(one(at=6.0, status=None).trace())
