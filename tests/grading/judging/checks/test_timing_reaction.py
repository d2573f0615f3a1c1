"""A planner that turns words into goals: at once, on a timer, and in the ways that students get it wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from tracing import Recording

from grader.grading.judging.checks.timing import Reaction, ReactionCase
from grader.grading.judging.findings import FAULT_KEY
from grader.grading.judging.values import FieldRule
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import ClockKind

TEXT, GOAL = "std_msgs/msg/String", "geometry_msgs/msg/PoseStamped"
PLACES = {"kitchen": (2.0, 1.5), "office": (-1.0, 3.25)}
WORDS = ["go to the kitchen", "go to the office", "sing a song", "go to the kitchen"]
CHECK = Reaction(
    "/voice_command",
    "/nav2/goal",
    (
        ReactionCase(
            {"data": FieldRule(pattern=".*kitchen")},
            {"header.frame_id": "map", "pose.position.x": 2.0, "pose.position.y": 1.5},
        ),
        ReactionCase({"data": "go to the office"}, {"header.frame_id": "map", "pose.position.x": -1.0}),
        ReactionCase({"data": "sing a song"}, silent=True),
    ),
    within=NS_PER_S,
    tolerance=0.01,
)


def goal(x: float, y: float, frame: str = "map") -> dict[str, Any]:
    return {"header": {"frame_id": frame}, "pose": {"position": {"x": x, "y": y, "z": 0.0}}}


def planner(
    plan: Callable[[str], list[tuple[float, dict[str, Any]]]],
    words: list[str] = WORDS,
    clock: ClockKind = ClockKind.VIRTUAL,
) -> Recording:
    """Words every 2 s; the plan gives delays and goals."""
    rec = Recording(1.0 + 2 * len(words), clock, "voice_planner.py")
    rec.endpoint("subscription", "/voice_command", TEXT).endpoint("publisher", "/nav2/goal", GOAL)
    for k, word in enumerate(words):
        rec.deliver(1.0 + 2 * k, "/voice_command", {"data": word}, TEXT)
        for delay, value in plan(word):
            rec.message(1.0 + 2 * k + delay, "/nav2/goal", value, GOAL)
    return rec


def right(word: str) -> tuple[float, float] | None:
    return next((place for name, place in PLACES.items() if name in word), None)


def at_once(word: str) -> list[tuple[float, dict[str, Any]]]:
    place = right(word)
    return [(0.0, goal(*place))] if place else []


@pytest.mark.parametrize(
    "rec",
    [
        planner(at_once),
        planner(lambda w: [(0.9, v) for _, v in at_once(w)]),
        planner(lambda w: [(d, v) for _, v in at_once(w) for d in (0.0, 0.5, 1.0, 1.5)]),
        planner(lambda w: [(0.0, goal(x + 0.009, y)) for _, v in at_once(w) for x, y in [right(w) or (0, 0)]]),
        planner(lambda w: [(-0.01, v) for _, v in at_once(w)], clock=ClockKind.WALL),
        planner(at_once, [*WORDS, "hello", "go to the office"]),
    ],
    ids=["at once", "later", "repeated", "nearly", "seen before", "other words too"],
)
def test_right_reactions_are_met(rec: Recording) -> None:
    """Once, late, or again and again."""
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 1, finding.reason


def test_the_old_goal_may_go_on_until_the_next_period() -> None:
    """A node on a timer of half a second publishes the old value once more."""
    check = Reaction(CHECK.input, CHECK.output, CHECK.cases[:2], tolerance=0.01)
    rec = planner(
        lambda w: [(0.1, goal(0.0, 0.0)), *((d, v) for _, v in at_once(w) for d in (0.6, 1.1, 1.6))],
        ["go to the kitchen", "go to the office"] * 2,
    )
    assert check.judge(rec.trace()).credit == 1


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        (lambda w: [(0.0, goal(y, x)) for _, v in at_once(w) for x, y in [right(w) or (0, 0)]], "x is 1.5, expected 2"),
        (
            lambda w: [(0.0, goal(x, y, "odom")) for _ in at_once(w) for x, y in [right(w) or (0, 0)]],
            "frame_id is 'odom', expected",
        ),
        (lambda w: [(0.0, goal(2.0, 1.5))] if right(w) else [], "after data = go to the office on /voice_command"),
        (lambda w: [(1.2, v) for _, v in at_once(w)], "was published after 1.200 s, expected within 1.0 s"),
        (lambda w: at_once(w) or [(0.0, goal(0, 0))], "a message was published, expected none"),
        (lambda w: [*at_once(w), (0.5, goal(9, 9))] if right(w) else [], "right at first, then t = 1.500 s"),
        (lambda w: at_once(w) if "office" in w else [], "no message within 1.0 s, expected header.frame_id 'map'"),
        (lambda w: [(0.0, {"data": 2.0}) for _ in at_once(w)], "there is no field header.frame_id"),
    ],
)
def test_wrong_reactions_are_named(plan: Callable[[str], Any], said: str) -> None:
    """The input, the moment, what was found and what was expected."""
    finding = CHECK.judge(planner(plan).trace())
    assert finding.credit == 0
    assert said in finding.reason


def test_fields_can_be_copied_from_the_input() -> None:
    """Numbers, texts and lists."""
    check = Reaction("/in", "/out", (ReactionCase({}, copies={"back": "data", "all": "items"}),))
    for back, items, credit in ((3.0, [1, 2], 1), (2.0, [1, 2], 0), (3.0, [2, 1], 0), (3.0, [1], 0)):
        rec = Recording(5).deliver(1, "/in", {"data": 3, "items": [1, 2]})
        rec.message(1, "/out", {"back": back, "all": items})
        assert check.judge(rec.trace()).credit == credit
    with pytest.raises(HarnessError):
        check.judge(Recording(5).deliver(1, "/in", {}).message(1, "/out", {}).trace())


def test_what_a_students_node_publishes_may_be_the_input() -> None:
    """Where the grader publishes nothing."""
    check = Reaction("/in", "/out", (ReactionCase({}, copies={"data": "data"}),))
    rec = Recording(5)
    for k in range(3):
        rec.number(1 + k, "/in", k).number(1.1 + k, "/out", k)
    assert check.judge(rec.trace()).credit == 1
    assert check.judge(Recording(5).number(1, "/out", 1).trace()).blocked_by == "publishes"


def test_silence_and_crashes_are_explained() -> None:
    """What never came is ours, unless the node had ended."""
    assert "publisher of type" in CHECK.judge(planner(lambda w: []).trace()).reason
    crashed = CHECK.judge(planner(at_once, WORDS[:1]).crashed(2.0).trace())
    assert FAULT_KEY in crashed.evidence
    during = CHECK.judge(planner(lambda w: at_once(w) if "office" not in w else []).crashed(3.0).trace())
    assert FAULT_KEY in during.evidence
    with pytest.raises(HarnessError):
        CHECK.judge(planner(at_once, WORDS[:2]).trace())
    deaf = Recording(9).endpoint("subscription", "/voice_commands", TEXT)
    for k, word in enumerate(WORDS):
        deaf.deliver(1.0 + 2 * k, "/voice_command", {"data": word}, TEXT)
    assert "/voice_commands" in CHECK.judge(deaf.trace()).reason


def test_an_output_may_follow_a_formula_of_the_input() -> None:
    """Half the angle and twice the distance; the first that does not is named, and NaN has none."""
    case = ReactionCase({"x": FieldRule(low=-9)}, formulas={"data": "sin(theta / 2) + 2 * x"})
    check = Reaction("/pose", "/half", (case,), tolerance=0.001)

    def follower(*thetas: float, factor: float = 0.5) -> Recording:
        rec = Recording(9.0).endpoint("subscription", "/pose", "turtlesim/msg/Pose")
        for k, theta in enumerate(thetas):
            rec.deliver(1.0 + k, "/pose", {"x": 1.5, "theta": theta}, "turtlesim/msg/Pose")
            rec.number(1.1 + k, "/half", math.sin(factor * theta if math.isfinite(theta) else 0) + 3)
        return rec

    assert check.judge(follower(0.4, -1.2).trace()).credit == 1
    finding = check.judge(follower(0.0, 1.0, factor=1.0).trace())
    assert finding.credit == 0
    assert "data is 3.84147, expected 3.47943" in finding.reason
    with pytest.raises(HarnessError, match="has no value"):
        check.judge(follower(math.inf).trace())
