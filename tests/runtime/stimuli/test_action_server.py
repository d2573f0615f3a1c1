"""The action server of a rubric: what can be written, what is drawn, and what it does with goals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import RubricError
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.plan import Surroundings, plan_scenario
from grader.runtime.served_actions import GoalState, planned_action
from grader.runtime.simulation import Moment
from grader.runtime.stimuli.action_server import PlannedActionServer, PlannedGoalAnswer

TYPE = "test_msgs/action/Fibonacci"
RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: counting, number: 1, title: Counting}
files: [client.py]
scenarios:
  - id: alone
    processes: [client.py]
    observe: {duration: 9 s}
    stimuli:
      - action_server: {action: /count, type: example_interfaces/action/Fibonacci, MORE}
criteria:
  - {id: sends, title: Sends, points: 1, scenario: alone, check: {sends_goals: {action: /count}}}
"""


def planned(folder: Path, more: str, seed: int = 1) -> PlannedActionServer:
    """Return the server of a rubric as the seed draws it."""
    path = folder / "r.yaml"
    path.write_text(RUBRIC.replace("MORE", more), encoding="utf-8")
    (scenario,) = read_rubric(path).scenarios
    submission = Submission("x", "x", folder, "", {"client.py": StudentFile("client.py", "client.py")})
    (found,) = plan_scenario("counting", scenario, submission, Surroundings(seed, "virtual")).of(PlannedActionServer)
    return found


def test_everything_is_drawn(tmp_path: Path) -> None:
    """Times and fields, from the seed."""
    more = "start: {between: [1 s, 2 s]}, goals: [{result_after: {between: [1 s, 3 s]}}], "
    more += "feedback: [{sequence: [1]}], results: [{sequence: [2]}]"
    first, same, other = (planned(tmp_path, more, seed) for seed in (1, 1, 2))
    assert first == same
    assert (first.start_ns, first.goals) != (other.start_ns, other.goals)
    assert NS_PER_S <= first.start_ns <= 2 * NS_PER_S
    assert NS_PER_S <= first.goals[0].result_after_ns <= 3 * NS_PER_S


def test_without_more_it_accepts_and_succeeds(tmp_path: Path) -> None:
    """At once."""
    found = planned(tmp_path, "start: 0 s")
    assert (found.goals, found.feedback, found.results, found.preempts) == (
        (PlannedGoalAnswer(accepts=True, feedback_every_ns=0, result_after_ns=0, aborts=False),),
        (),
        (),
        False,
    )


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("goals: []", "expected a list with at least one entry, found an empty one"),
        ("goals: [{accepts: false, aborts: true}]", "expected nothing else of a goal that is not accepted, found more"),
        ("goals: [{feedback_every: 1 ms}]", "expected at least 10 ms from one feedback to the next, found less"),
        ("goals: [{acepts: false}]", "found `acepts`"),
        ("goals: [{result_after: 2}]", "expected"),
        ("preempts: 1", "expected true or false, found `1`"),
        ("start: 9 s", "expected a start before the end of `observe`"),
    ],
)
def test_a_mistake_is_told_with_its_place(tmp_path: Path, more: str, message: str) -> None:
    """In the line of the stimulus."""
    with pytest.raises(RubricError) as raised:
        planned(tmp_path, more)
    assert ":9:" in raised.value.message
    assert message in raised.value.message


def server(**rest: Any) -> PlannedActionServer:
    """Return a server that rejects, aborts and then succeeds, each after 1 s with feedback every 400 ms."""
    goals = (
        PlannedGoalAnswer(accepts=False, feedback_every_ns=0, result_after_ns=0, aborts=False),
        *(
            PlannedGoalAnswer(accepts=True, feedback_every_ns=400 * NS_PER_MS, result_after_ns=NS_PER_S, aborts=aborts)
            for aborts in (True, False)
        ),
    )
    given: dict[str, Any] = {"feedback": ({"sequence": [7]},), "results": ({}, {"sequence": [8]}), "preempts": False}
    return PlannedActionServer("/count", TYPE, 0, goals, **{**given, **rest})


def told(does: list[tuple[str, int, Any]]) -> list[Any]:
    """Return what an action does, in short."""
    short: list[Any] = []
    for part, _, content in does:
        if part == "feedback":
            short.append(("feedback", list(content.feedback.sequence)))
        elif part == "send_goal":
            short.append(("accepted", content["accepted"]))
        elif part == "get_result":
            short.append((GoalState(content["status"]).name, list(content["result"]["sequence"])))
    return short


def asked(number: int) -> dict[str, Any]:
    """Return the request that sends a goal."""
    return {"goal_id": {"uuid": [number] * 16}, "goal": {"order": 1}}


def test_goals_are_answered_in_turn() -> None:
    """Rejected, aborted, and from then on as the last line says."""
    pytest.importorskip("test_msgs")
    action = planned_action(server())
    assert told(action.attend(Moment(0, 0), "send_goal", 1, asked(1))["does"]) == [("accepted", False)]
    for number, end in ((2, "ABORTED"), (3, "SUCCEEDED"), (4, "SUCCEEDED")):
        now = number * 10 * NS_PER_S
        begun = action.attend(Moment(now, now), "send_goal", number, asked(number))
        action.attend(Moment(now, now), "get_result", number, {"goal_id": {"uuid": [number] * 16}})
        seen, wakes = told(begun["does"]), begun["wakes_ns"]
        while wakes:
            done = action.attend(Moment(wakes[0], wakes[0]), "", 0, {})
            seen, wakes = seen + told(done["does"]), done["wakes_ns"]
        feedback = ("feedback", [7])
        assert seen == [("accepted", True), feedback, feedback, (end, [8])]


@pytest.mark.parametrize("preempts", [False, True])
def test_a_new_goal_aborts_the_one_before_where_it_preempts(preempts: bool) -> None:
    """As Nav2 does."""
    pytest.importorskip("test_msgs")
    action = planned_action(server(preempts=preempts))
    for number in (1, 2):
        action.attend(Moment(0, 0), "send_goal", number, asked(number))
    action.attend(Moment(0, 0), "get_result", 2, {"goal_id": {"uuid": [2] * 16}})
    second = told(action.attend(Moment(NS_PER_MS, NS_PER_MS), "send_goal", 3, asked(3))["does"])
    aborted: list[Any] = [("ABORTED", [])] if preempts else []
    assert second == [("accepted", True), *aborted]
