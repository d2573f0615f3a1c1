"""What a topic carries and who listens."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracing import FLOAT32, ODOMETRY, TWIST, Recording, twist, velocity

from grader.grading.judging.checks.topics import FieldValues, Publishes, Subscribes
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import FaultKind

PUBLISHES = Publishes("/cmd_vel", TWIST)
SUBSCRIBES = Subscribes("/odom", ODOMETRY)
LINEAR = FieldValues("/cmd_vel", {"linear.x": 0.5, "linear.y": 0, "linear.z": 0})
ANGULAR = FieldValues("/cmd_vel", {"angular.x": 0, "angular.y": 0, "angular.z": 0.1})
STAMPED = "geometry_msgs/msg/TwistStamped"


def test_one_message_is_enough() -> None:
    """Publishing is judged by its topic and type alone."""
    finding = PUBLISHES.judge(Recording().message(3.0, "/cmd_vel", twist(), TWIST).trace())
    assert finding.credit == 1
    assert finding.reason == f"/cmd_vel: 1 message of type {TWIST}, the first at t = 3.000 s"


@pytest.mark.parametrize(
    ("rec", "said"),
    [
        (velocity(topic="/turtle1/cmd_vel"), ["no message; /turtle1/cmd_vel has 200 messages"]),
        (velocity(topic="/cmdvel"), ["/cmdvel has 200 messages"]),
        (Recording().message(1.0, "/cmd_vel", twist(), STAMPED), [STAMPED, f"expected {TWIST}"]),
        (
            Recording().message(1.0, "/cmd_vel_", {"data": "x"}, "std_msgs/msg/String"),
            ["/cmd_vel_", f"expected {TWIST}"],
        ),
        (Recording().endpoint("publisher", "/cmd_vel", TWIST), ["no message in 10.0 s", "/node has a publisher"]),
        (Recording().endpoint("publisher", "/cmd_vel", STAMPED), ["has a publisher of type", f"expected {TWIST}"]),
        (Recording().endpoint("publisher", "/cmdvel", TWIST), ["/cmdvel: no message", "expected"]),
        (Recording().endpoint("publisher", "/chatter", FLOAT32), ["no publisher in 10.0 s", "/chatter"]),
        (Recording(), ["/cmd_vel: no publisher in 10.0 s"]),
        (
            Recording(0.0).mark(0.0, "limit", "more than 5 nodes"),
            ["/cmd_vel: no publisher in 0.0 s (more than 5 nodes)"],
        ),
        (Recording().crashed(0.1, "NameError: name 'Twist' is not defined", 9), ["node.py:9: NameError"]),
        (Recording().exited(0.0, 1), ["node.py exited after 0.0 s with code 1"]),
        (Recording().fault(4.0, FaultKind.HUNG, "tick() did not return", 24), ["node.py:24: tick() did not return"]),
    ],
)
def test_the_nearest_thing_is_named_when_nothing_was_published(rec: Recording, said: list[str]) -> None:
    """Other topic, other type, idle publisher, fault, or nothing: the reason names it."""
    rec.message(1.0, "/rosout", {}, "rcl_interfaces/msg/Log")
    finding = PUBLISHES.judge(rec.trace())
    assert finding.credit == 0
    assert all(part in finding.reason for part in said), finding.reason
    assert "rosout" not in finding.reason
    assert "cmd_vel" in finding.reason


@pytest.mark.parametrize("topic", ["/cmd_vel", "/chatter"])
def test_who_reached_a_limit_is_told_to_stay_below_it(topic: str) -> None:
    """What came after it was not recorded, so that the program may well publish."""
    finding = PUBLISHES.judge(
        Recording(0.1).endpoint("publisher", topic, TWIST).mark(0.1, "limit", "more than 5 nodes").trace()
    )
    assert "in 0.1 s (more than 5 nodes)" in finding.reason
    assert "stay below the limit" in finding.hint


def test_a_node_that_only_ends_is_told_to_spin() -> None:
    """Exit code 0 without a message is very likely a missing spin."""
    assert "rclpy.spin" in PUBLISHES.judge(Recording().exited(0.2).trace()).hint


def test_right_values_are_met() -> None:
    """Every message is looked at."""
    trace = velocity().trace()
    assert LINEAR.judge(trace).credit == ANGULAR.judge(trace).credit == 1
    assert "200 messages" in LINEAR.judge(trace).reason


@pytest.mark.parametrize(
    ("check", "value", "hint"),
    [
        (LINEAR, {"linear": (-0.5, 0, 0)}, "sign of linear.x"),
        (LINEAR, {"linear": (0, 0.5, 0)}, "0.5 is in linear.y; it belongs in linear.x"),
        (LINEAR, {"linear": (0.1, 0, 0), "angular": (0, 0, 0.5)}, "0.5 is in angular.z; it belongs in linear.x"),
        (ANGULAR, {"linear": (0.1, 0, 0), "angular": (0, 0, 0.5)}, "0.1 is in linear.x; it belongs in angular.z"),
        (ANGULAR, {"angular": (0.1, 0, 0)}, "0.1 is in angular.x"),
        (ANGULAR, {"angular": (0, 0, -0.1)}, "sign of angular.z"),
        (ANGULAR, {"angular": (0, 0, 5.7296)}, "degrees"),
        (LINEAR, {"linear": (500.0, 0, 0)}, "mm/s"),
        (LINEAR, {"linear": (1.8, 0, 0)}, "km/h"),
        (LINEAR, {"linear": (0.5, 0, 0.5)}, "leave linear.z at 0.0"),
        (LINEAR, {"linear": (0.7, 0, 0)}, ""),
        (LINEAR, {"linear": (math.nan, 0, 0)}, ""),
        (LINEAR, {"linear": (math.inf, 0, 0)}, ""),
    ],
)
def test_a_wrong_field_is_named_with_its_likely_slip(check: FieldValues, value: dict[str, Any], hint: str) -> None:
    """Sign, place and unit are recognised; in unclear cases there is no hint."""
    finding = check.judge(velocity(**value).trace())
    assert finding.credit == 0
    assert hint in finding.hint
    assert bool(hint) == bool(finding.hint)
    assert finding.reason.startswith("t = 0.050 s, /cmd_vel: ")
    assert "in all 200 messages" in finding.reason


@pytest.mark.parametrize(("field", "hint"), [("linear.x", "linear.x is in m/s; 36 looks like km/h"), ("data", "")])
def test_only_a_velocity_has_the_unit_of_one(field: str, hint: str) -> None:
    """A number that is 3.6 times the expected one is km/h only in a field of a velocity."""
    content = twist((36.0, 0, 0)) if field == "linear.x" else {"data": 36.0}
    assert FieldValues("/a", {field: 10}).judge(Recording().message(1.0, "/a", content, TWIST).trace()).hint == hint


def test_the_first_wrong_message_is_named() -> None:
    """One wrong message among many is enough, and the reason has its time."""
    rec = velocity().message(4.02, "/cmd_vel", twist((0, 0, 0)), TWIST)
    finding = LINEAR.judge(rec.trace())
    assert finding.reason == "t = 4.020 s, /cmd_vel: linear.x is 0, expected 0.5; wrong in 1 of 201 messages"
    assert ANGULAR.judge(rec.trace()).credit == 1


def test_a_message_without_the_field_earns_nothing() -> None:
    """Another type on the topic has no such field."""
    finding = LINEAR.judge(Recording().message(1.0, "/cmd_vel", {"data": 0.5}, FLOAT32).trace())
    assert finding.credit == 0
    assert "has no field linear.x" in finding.reason


@pytest.mark.parametrize("value", ["0.5", True, None, [0.5], {"x": 0.5}])
def test_only_numbers_are_numbers(value: Any) -> None:
    """A string, a bool or a list in a field is not a number."""
    message = {"linear": {"x": value, "y": 0.0, "z": 0.0}}
    finding = LINEAR.judge(Recording().message(1.0, "/cmd_vel", message, TWIST).trace())
    assert finding.credit == 0
    said = ", expected 0.5; wrong in the only message" if value is not None else "Twist has no field linear.x"
    assert finding.reason.endswith(said)


def test_values_nobody_published_are_explained() -> None:
    """Without a message the reason is the silence."""
    assert "no publisher" in LINEAR.judge(Recording().trace()).reason


@given(st.floats(allow_nan=True), st.floats(0, 1), st.floats(0, 1))
def test_credit_never_falls_as_the_tolerance_grows(got: float, a: float, b: float) -> None:
    """A wider tolerance accepts whatever a narrower one does; NaN is accepted by none."""
    trace = Recording().message(1.0, "/cmd_vel", twist((got, 0, 0)), TWIST).trace()
    narrow, wide = (FieldValues("/cmd_vel", {"linear.x": 0.5}, t).judge(trace).credit for t in sorted((a, b)))
    assert narrow <= wide
    assert not (math.isnan(got) and wide)


@given(st.integers(0, 50))
def test_shifting_all_times_changes_no_credit(shift: int) -> None:
    """Values and types do not depend on when."""
    trace = velocity(start_s=0.05 + shift, stop_s=10.05 + shift).trace()
    assert (PUBLISHES.judge(trace).credit, LINEAR.judge(trace).credit, ANGULAR.judge(trace).credit) == (1, 1, 1)


@pytest.mark.parametrize("reliability", ["reliable", "best_effort"])
def test_subscriptions_of_either_reliability_are_met(reliability: str) -> None:
    """A reliable publisher reaches both."""
    rec = Recording().endpoint("subscription", "/odom", ODOMETRY, reliability=reliability)
    assert SUBSCRIBES.judge(rec.trace()).credit == 1


@pytest.mark.parametrize(
    ("policies", "asks", "default"),
    [
        ({"durability": "transient_local"}, "transient_local durability, which a volatile publisher", "durability"),
        ({"deadline_ns": NS_PER_S // 2}, "a deadline of 0.5 s, which a publisher without one", "deadline"),
        ({"liveliness": "manual_by_topic"}, "manual_by_topic liveliness, which a publisher with auto", "liveliness"),
        ({"lease_ns": NS_PER_S}, "a liveliness lease of 1 s, which a publisher", "liveliness lease duration"),
    ],
)
def test_the_policy_that_keeps_messages_away_is_named(policies: dict[str, Any], asks: str, default: str) -> None:
    """Each that an ordinary publisher does not offer, in the reason and in the hint."""
    finding = SUBSCRIBES.judge(Recording().endpoint("subscription", "/odom", ODOMETRY, **policies).trace())
    assert finding.credit == 0
    assert f"the subscription of /node asks for {asks}" in finding.reason
    assert finding.hint == f"subscribe with the default {default}: pass the queue depth 10 as QoS"


def test_a_transient_local_subscription_hears_nothing() -> None:
    """The policy and the side are named."""
    rec = Recording().endpoint("subscription", "/odom", ODOMETRY, durability="transient_local")
    finding = SUBSCRIBES.judge(rec.trace())
    assert finding.credit == 0
    assert "the subscription of /node asks for transient_local durability" in finding.reason
    rec.endpoint("subscription", "/odom", ODOMETRY, node="/other")
    assert SUBSCRIBES.judge(rec.trace()).credit == 1


@pytest.mark.parametrize(
    ("rec", "said"),
    [
        (Recording().endpoint("subscription", "/odometry", ODOMETRY), "subscribes to /odometry"),
        (Recording().endpoint("subscription", "/robot/odom", ODOMETRY), "subscribes to /robot/odom"),
        (Recording().endpoint("subscription", "/odom", TWIST), f"subscribes with type {TWIST}, expected {ODOMETRY}"),
        (Recording().endpoint("publisher", "/odom", ODOMETRY), "no subscription in 10.0 s"),
        (Recording().endpoint("subscription", "/chatter", FLOAT32), "subscriptions seen: /chatter"),
        (Recording().endpoint("subscription", "/odom", ODOMETRY, participant=-1), "no subscription in 10.0 s"),
        (Recording().crashed(0.0, "TypeError: no", 5), "node.py:5: TypeError: no; no subscription to /odom"),
    ],
)
def test_the_nearest_subscription_is_named(rec: Recording, said: str) -> None:
    """Other topic, other type, fault or nothing."""
    finding = SUBSCRIBES.judge(rec.trace())
    assert finding.credit == 0
    assert said in finding.reason


def test_hostile_names_stay_on_one_line_and_short() -> None:
    """A node's name cannot break out of the sentence."""
    rec = Recording().endpoint("subscription", "/odom", "a\nb" * 300, node="/x\n\n" + "y" * 9000)
    reason = SUBSCRIBES.judge(rec.trace()).reason
    assert "\n" not in reason
    assert len(reason) < 600
