"""What answers the goals of a served action, and what is told where it does something that no goal can."""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest
from test_msgs.action import Fibonacci

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.served_actions import MOST_TOLD, GoalAborted, GoalRejected, ServedAction
from grader.runtime.simulation import Moment

ID = [1] * 16


def served(answer: Any, *at_s: float) -> list[tuple[str, int, Any]]:
    """Return what an action does with one goal, at its begin and at some moments after that."""
    action = ServedAction("/count", "test_msgs/action/Fibonacci", answer)
    goal: Mapping[str, Any] = {"goal": {"order": 3}, "goal_id": {"uuid": ID}}
    does = [*action.attend(Moment(0, 0), "send_goal", 1, goal)["does"]]
    for t_s in at_s:
        does += action.attend(Moment(round(t_s * NS_PER_S), 0), "", 0, {})["does"]
    return does


def refused_late(goal: Fibonacci.Goal) -> Iterator[float]:
    """Refuse a goal after a pause."""
    del goal
    yield 1.0
    raise GoalRejected


def endless(goal: Fibonacci.Goal) -> Iterator[float]:
    """Never pause."""
    while goal.order:
        yield 0.0


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        ([math.nan], "/count: expected seconds, or a test_msgs/action/Fibonacci feedback, as a step, found nan"),
        ([math.inf], "/count: expected seconds, or a test_msgs/action/Fibonacci feedback, as a step, found inf"),
        ([True], "/count: expected seconds, or a test_msgs/action/Fibonacci feedback, as a step, found True"),
        (lambda _: Fibonacci.Goal(), "/count: expected a result of test_msgs/action/Fibonacci, found Fibonacci_Goal"),
        ([GoalAborted("too far")], "/count: expected a result of test_msgs/action/Fibonacci, found str"),
        (endless, "/count: expected a pause, found 100,000 steps at one moment"),
    ],
)
def test_what_no_goal_can_do_is_told(answer: Any, says: str) -> None:
    """With what is expected, and without another error that it would have been raised in the middle of."""
    with pytest.raises((TypeError, RuntimeError), match=f"^{says}$") as told:
        served(answer)
    assert told.value.__context__ is None


@pytest.mark.parametrize("answer", [refused_late, [1.0, GoalRejected()]])
def test_a_goal_that_was_accepted_is_not_refused(answer: Callable[[Any], Any]) -> None:
    """The error says what to raise instead."""
    says = "/count: a goal can be refused before the first pause only; after it, raise GoalAborted"
    with pytest.raises(GoalRejected, match=says):
        served(answer, 1.0)


def test_a_list_ends_with_an_error_or_its_class() -> None:
    """As `raise` takes both."""
    assert served([GoalRejected]) == served([GoalRejected()]) == [("send_goal", 1, {"accepted": False})]


def test_many_feedbacks_and_empty_pauses_come_at_one_moment() -> None:
    """More than a recursion would bear."""
    steps = [*([Fibonacci.Feedback(), 0.0] * 2000), 1.0]
    assert [part for part, _, _ in served(steps)].count("feedback") == 2000


def test_a_client_that_sends_without_end_costs_no_more_with_each_goal() -> None:
    """A status names the goals that changed last, and a wake is said once however many requests come before it."""
    action = ServedAction("/count", "test_msgs/action/Fibonacci", [1.0])
    does: list[tuple[str, int, Any]] = []
    waiting: list[int] = []
    visits = 0
    for number in range(1, 201):
        now = number * NS_PER_S // 10
        while waiting and min(waiting) <= now:  # as an agenda
            waiting.remove(at_ns := min(waiting))
            visits += 1
            answer = action.attend(Moment(at_ns, at_ns), "", 0, {})
            does, waiting = [*does, *answer["does"]], [*waiting, *answer["wakes_ns"]]
        uuid = {"uuid": [number] * 16}
        for part, request in (
            ("send_goal", {"goal_id": uuid, "goal": {"order": 3}}),
            ("get_result", {"goal_id": uuid}),
        ):
            answer = action.attend(Moment(now, now), part, number, request)
            does, waiting = [*does, *answer["does"]], [*waiting, *answer["wakes_ns"]]
    results = [number for part, number, _ in does if part == "get_result"]
    assert results == list(range(1, 191))
    assert visits == len(results)
    assert len(waiting) == 1
    told = [message.status_list for part, _, message in does if part == "status"]
    assert len(told) == 200 + len(results)
    assert max(map(len, told)) == MOST_TOLD
    assert [(each[-1].goal_info.goal_id.uuid[0], each[-1].status) for each in told[-2:]] == [(190, 4), (200, 2)]
