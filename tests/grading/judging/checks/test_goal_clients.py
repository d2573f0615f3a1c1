"""Clients of an action: what they send, when they cancel, and what follows a goal."""

from __future__ import annotations

import math
from typing import Any

import pytest
from goal_recordings import ACTION, TYPE, Client, client
from tracing import Recording

from grader.grading.judging.checks.goal_clients import AfterGoal, CancelsGoal, SendsGoals, sent_goals
from grader.grading.model.exercise import Finding, ProblemKind
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.trace import Trace


def found(check: Any, recording: Client) -> tuple[float, str]:
    """Return credit and reason."""
    finding: Finding = check.judge(recording.trace())
    return float(finding.credit), finding.reason


def test_goals_are_read_with_their_ends() -> None:
    """By their ids, whatever the order of the results."""
    recording = client().goal(1, 1, 5).goal(2, 2, 6, accepted=False).goal(3, 3, 7).result(9, 3, "aborted").cancel(4, 3)
    goals = sent_goals(recording.result(6, 1, "succeeded").trace(), ACTION)
    assert [(g.content["order"], g.end, g.end_ns // NS_PER_S) for g in goals] == [
        (5, "succeeded", 6),
        (6, "rejected", 2),
        (7, "aborted", 9),
    ]
    assert [g.cancels_ns for g in goals] == [(), (), (4 * NS_PER_S,)]


@pytest.mark.parametrize(
    ("check", "credit", "words"),
    [
        (SendsGoals(ACTION), 1, "2 goals, as expected"),
        (SendsGoals(ACTION, ({"order": 5}, {"order": 6})), 1, "as expected"),
        (SendsGoals(ACTION, ({"order": 6},)), 0, "t = 1.000 s, /count, goal 1: order is 5, expected 6"),
        (SendsGoals(ACTION, every={"order": 5}), 0, "goal 2: order is 6, expected 5"),
        (SendsGoals(ACTION, at_least=3), 0, "2 goals, expected at least 3"),
        (SendsGoals(ACTION, at_most=1), 0, "2 goals, expected at least 1 and at most 1"),
        (SendsGoals(ACTION, one_at_a_time=True), 0, "t = 2.000 s, /count: a goal is sent while the one before runs"),
    ],
)
def test_what_is_sent(check: SendsGoals, credit: float, words: str) -> None:
    """Content, number and turn."""
    earned, reason = found(check, client().goal(1, 1, 5).goal(2, 2, 6).result(3, 1, "succeeded"))
    assert (earned, words in reason) == (credit, True), reason


def test_one_after_the_other() -> None:
    """As soon as the result is there."""
    recording = client().goal(1, 1, 5).result(2, 1, "succeeded").goal(2, 2, 6)
    assert found(SendsGoals(ACTION, one_at_a_time=True), recording)[0] == 1


@pytest.mark.parametrize(
    ("asked", "credit", "words"),
    [
        ((5.2,), 1, "1 goal cancelled in time"),
        ((6.5,), 0, "the goal had to be cancelled, and was only 1.500 s later"),
        ((), 0, "t = 5.000 s, /count: the goal had to be cancelled, and was never"),
        ((4.0,), 0, "t = 4.000 s, /count: the goal was cancelled too early"),
    ],
)
def test_a_goal_is_cancelled_at_a_feedback(asked: tuple[float, ...], credit: float, words: str) -> None:
    """Not before, and soon."""
    recording = client().goal(1, 1, 5).feedback(3, 1, 1).feedback(5, 1, 3)
    for t_s in asked:
        recording.cancel(t_s, 1).result(t_s, 1, "canceled")
    earned, reason = found(CancelsGoal(ACTION, {"sequence[0]": 3}), recording)
    assert (earned, words in reason) == (credit, True), reason


def test_a_goal_may_be_cancelled_after_a_time() -> None:
    """Counted from the acceptance; one that ends before need not be."""
    check = CancelsGoal(ACTION, after=2 * NS_PER_S, within=500 * NS_PER_MS)
    recording = (
        client().goal(1, 1, 5).result(2, 1, "succeeded").goal(4, 2, 6).cancel(6.25, 2).result(6.25, 2, "canceled")
    )
    assert found(check, recording)[0] == 1
    assert [reading.value for reading in check.judge(recording.trace()).readings] == [0.25]
    ended = client().goal(1, 1, 5).result(2, 1, "succeeded")
    assert "0 goals came to the moment to cancel, expected at least 1" in found(check, ended)[1]


def test_a_request_to_cancel_is_about_goals_that_run() -> None:
    """One without an id is about all of them, and none is about a goal that has ended."""
    recording = client().goal(1, 1, 5).result(2, 1, "succeeded").goal(2, 2, 6).feedback(4, 2, 3).cancel(4, 0)
    recording.result(4, 2, "canceled").cancel(5, 1)
    assert [g.cancels_ns for g in sent_goals(recording.trace(), ACTION)] == [(), (4 * NS_PER_S,)]
    assert found(CancelsGoal(ACTION, {"sequence[0]": 3}), recording) == (1, "/count: 1 goal cancelled in time")


@pytest.mark.parametrize(("then", "numbers"), [("same", [math.inf]), ("next", [0.5]), ("goal", [0.5])])
def test_only_the_expected_goal_takes_a_time(then: Any, numbers: list[float]) -> None:
    """With another one, what is measured never came."""
    recording = client().goal(2, 1, 5, accepted=False).goal(2.5, 2, 6)
    finding = AfterGoal(ACTION, "rejected", then).judge(recording.trace())
    assert [reading.value for reading in finding.readings] == numbers


def test_too_few_ends_are_told_in_the_plural() -> None:
    """None was, and several were."""
    recording = client().goal(1, 1, 5).result(2, 1, "succeeded")
    assert "0 goals were aborted in time" in found(AfterGoal(ACTION, "aborted"), recording)[1]
    recording = client().goal(1, 1, 5, accepted=False).goal(2, 2, 5, accepted=False).goal(3, 3, 5)
    assert "after 2 goals that were rejected" in found(AfterGoal(ACTION, "rejected"), recording)[1]


@pytest.mark.parametrize(
    ("then", "order", "t_s", "credit", "words"),
    [
        ("same", 5, 3, 1, "the same goal again after 1 goal that was rejected"),
        ("same", 6, 3, 0, "another one was sent"),
        ("next", 6, 3, 1, "another goal after 1 goal"),
        ("next", 5, 3, 0, "the same one was sent again"),
        ("goal", 6, 4.5, 0, "the next one was sent only after 2.500 s"),
        ("goal", 6, None, 0, "t = 2.000 s, /count: goal 1 was rejected, then no goal was sent"),
        ("nothing", 6, None, 1, "no goal after 1 goal"),
        ("nothing", 6, 3, 0, "a goal was sent at t = 3.000 s"),
        ("nothing", 6, 5, 1, "no goal after 1 goal"),
    ],
)
def test_what_follows_a_goal(then: Any, order: int, t_s: float | None, credit: float, words: str) -> None:
    """The same one, another one, any, or none."""
    recording = client().goal(2, 1, 5, accepted=False)
    if t_s is not None:
        recording.goal(t_s, 2, order)
    earned, reason = found(AfterGoal(ACTION, "rejected", then), recording)
    assert (earned, words in reason) == (credit, True), reason


def test_only_the_first_ones_count_where_the_rubric_says_so() -> None:
    """And what ends shortly before the recording does is not judged."""
    recording = client(10).goal(1, 1, 5).result(2, 1, "succeeded").goal(2.5, 2, 6).result(4, 2, "succeeded")
    assert found(AfterGoal(ACTION, "succeeded"), recording)[0] == 0
    check = AfterGoal(ACTION, "succeeded", first=1)
    assert found(check, recording)[0] == 1
    assert [reading.value for reading in check.judge(recording.trace()).readings] == [0.5]
    late = client(10).goal(1, 1, 5).result(9, 1, "succeeded")
    assert "0 goals succeeded in time, expected at least 1" in found(AfterGoal(ACTION, "succeeded"), late)[1]


@pytest.mark.parametrize("check", [SendsGoals(ACTION), CancelsGoal(ACTION), AfterGoal(ACTION, "aborted")])
def test_why_no_goal_came(check: SendsGoals | CancelsGoal | AfterGoal) -> None:
    """No client, one of another action, one that is silent, a crash; without the stimulus the rubric is wrong."""

    def why(recording: Recording) -> tuple[ProblemKind | None, str]:
        finding = check.judge(recording.trace())
        return finding.problem.kind if finding.problem else None, finding.hint

    assert why(client())[0] is ProblemKind.ABSENT
    other = client().service("client", "/cout/_action/send_goal", f"{TYPE}_SendGoal")
    assert why(other) == (ProblemKind.OTHER_NAME, "name the action /count instead of /cout")
    silent = client().service("client", f"{ACTION}/_action/send_goal", f"{TYPE}_SendGoal")
    assert why(silent)[0] is ProblemKind.SILENT
    typed = client().service("client", f"{ACTION}/_action/send_goal", "test_msgs/action/NestedMessage_SendGoal")
    assert why(typed) == (ProblemKind.OTHER_TYPE, f"create the ActionClient with {TYPE}")
    reason = f"/count: /node has a client of type test_msgs/action/NestedMessage, expected {TYPE}"
    assert check.judge(typed.trace()).reason == reason
    crashed = check.judge(client().crashed(1).trace())
    assert "fault" in crashed.evidence
    with pytest.raises(HarnessError):
        check.judge(Recording(5).trace())


def test_a_student_may_send_anything() -> None:
    """Requests without the fields that they should have."""
    recording = client()
    odd: list[dict[str, Any]] = [{}, {"goal_id": 1, "goal": 2}, {"goal_id": {"uuid": "x"}, "goal": {}}]
    for number, value in enumerate(odd, 1):
        recording.request(number, f"{ACTION}/_action/send_goal", number, "student", value, f"{TYPE}_SendGoal")
    trace: Trace = recording.trace()
    assert [goal.content for goal in sent_goals(trace, ACTION)] == [{}, {}, {}]
    assert SendsGoals(ACTION, ({"order": 5},)).judge(trace).credit == 0
