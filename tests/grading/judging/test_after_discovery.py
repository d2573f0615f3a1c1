"""Messages that nobody would have heard outside: what is said of them, and checks for which they do not count."""

from typing import Any

import pytest

from grader.grading.judging.checks.fields import FieldEqual, FieldInRange, FieldMonotone, RandomInRange
from grader.grading.judging.checks.rate import TopicRate
from grader.grading.judging.checks.topics import FieldValues, Publishes, Transform
from grader.grading.judging.judge_run import notes_on_unheard
from grader.grading.judging.summary import summarise
from grader.grading.model.exercise import ProblemKind
from grader.grading.reporting.observed import render_summary
from grader.runtime.model.trace import AssessedTrace
from grader.testing import TraceBuilder

FLOAT, TF = "std_msgs/msg/Float32", "tf2_msgs/msg/TFMessage"
STAMPED = {
    "header": {"frame_id": "odom"},
    "child_frame_id": "base_link",
    "transform": {
        "translation": {"x": 0.0, "y": 0.0, "z": 0.0},
        "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    },
}
#: Checks that look at single messages, with the topic, the type, and a right message.
CHECKS: dict[str, tuple[Any, str, str, Any]] = {
    "publishes": (Publishes("/news", FLOAT, after_discovery=True), "/news", FLOAT, {"data": 1.0}),
    "topic_rate": (TopicRate("/news", 10.0, 1.0, after_discovery=True), "/news", FLOAT, {"data": 1.0}),
    "field_values": (FieldValues("/news", {"data": 1.0}, after_discovery=True), "/news", FLOAT, {"data": 1.0}),
    "field_equal": (FieldEqual("/news", {"data": 1.0}, after_discovery=True), "/news", FLOAT, {"data": 1.0}),
    "field_in_range": (FieldInRange("/news", 0.0, 2.0, after_discovery=True), "/news", FLOAT, {"data": 1.0}),
    "field_monotone": (FieldMonotone("/news", "rising", after_discovery=True), "/news", FLOAT, {"data": 1.0}),
    "random_in_range": (RandomInRange("/news", 0.0, 2.0, after_discovery=True), "/news", FLOAT, {"data": 1.0}),
    "transform": (Transform("odom", "base_link", after_discovery=True), "/tf", TF, {"transforms": [STAMPED]}),
}


def sent(topic: str, type_: str, value: Any, *times_s: float, early: int) -> AssessedTrace:
    """Return a trace with messages of which the first ones were sent before discovery."""
    built = TraceBuilder()
    for number, t_s in enumerate(times_s):
        built.message(t_s, topic, type_, value, before_discovery=number < early)
    return built.trace()


@pytest.mark.parametrize(("check", "topic", "type_", "value"), CHECKS.values(), ids=CHECKS)
def test_what_nobody_would_have_heard_does_not_count(check: Any, topic: str, type_: str, value: Any) -> None:
    """If a rubric asks for it, with the reason and what to do."""
    found = check.judge(sent(topic, type_, value, 0.0, early=1))
    assert found.credit == 0
    assert found.problem.kind is ProblemKind.TOO_EARLY
    reason = f"t = 0.000 s, {topic}: the only message was sent as soon as the publisher was created"
    assert found.reason == f"{reason}, before any subscription could discover it"
    assert found.blocked_by or "get_subscription_count()" in found.hint


def test_later_messages_count() -> None:
    """The others of the topic are judged as ever; without the parameter, all are."""
    trace = sent("/news", FLOAT, {"data": 1.0}, 0.0, 0.5, 1.0, early=1)
    check = Publishes("/news", FLOAT, after_discovery=True)
    assert check.judge(trace).evidence["messages"] == 2
    assert Publishes("/news", FLOAT).judge(trace).evidence["messages"] == 3
    alone = sent("/news", FLOAT, {"data": 1.0}, 0.0, early=1)
    assert Publishes("/news", FLOAT).judge(alone).credit == 1


def test_a_wrong_value_that_nobody_heard_is_no_mistake() -> None:
    """And the other way round: it is one if all messages count."""
    trace = TraceBuilder().message(0, "/news", FLOAT, {"data": 9.0}, before_discovery=True)
    trace.message(0.5, "/news", FLOAT, {"data": 1.0})
    assert FieldValues("/news", {"data": 1.0}, after_discovery=True).judge(trace.trace()).credit == 1
    assert FieldValues("/news", {"data": 1.0}).judge(trace.trace()).credit == 0


def test_a_silent_publisher_is_not_early() -> None:
    """Nothing was sent at all."""
    found = Publishes("/news", FLOAT, after_discovery=True).judge(TraceBuilder().trace())
    assert found.problem is not None
    assert found.problem.kind is ProblemKind.ABSENT


@pytest.mark.parametrize(
    ("early", "which"),
    [
        (
            (1, 1),
            "the only message was published as soon as the publisher was created; on a real system no subscription",
        ),
        ((3, 3), "all messages were published as soon"),
        ((1, 3), "the first message was published as soon"),
        ((2, 3), "the first messages were published as soon"),
    ],
)
def test_a_note_says_which_messages_nobody_would_have_heard(early: tuple[int, int], which: str) -> None:
    """In reports and in what `observe` shows; nothing is said of a topic whose messages were all heard."""
    trace = sent("/news", FLOAT, {"data": 1.0}, *(n / 2 for n in range(early[1])), early=early[0])
    (note,) = notes_on_unheard(trace)
    assert note.startswith(f"/news: {which}")
    assert note in render_summary(summarise(trace, ["a.py"], "none"))
    assert notes_on_unheard(sent("/news", FLOAT, {"data": 1.0}, 0.0, early=0)) == ()
