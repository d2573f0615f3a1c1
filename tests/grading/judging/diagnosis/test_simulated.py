"""The hints about what does not pass between a node and a simulation, and about a robot that does not obey."""

from __future__ import annotations

from typing import Any

import pytest

from grader.grading.judging.diagnosis import RULES
from grader.testing import TraceBuilder, builtin_check, explain

TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
FILE = """
class Driver(Node):
    def __init__(self):
        super().__init__("driver")
        self.pub = self.create_publisher(TwistStamped, "/cmd_vel", 10)
        self.create_subscription(Odometry, "/odom", self.seen, 10)
"""
RULE = next(rule for rule in RULES if rule.id == "unheard_by_simulation")
ODOMETRY = {"topic": "/odom", "field": "pose.pose.position.x", "low": 1.0}


def clue(check: str, *, listens: bool = True, **parameters: Any) -> str:
    """Return the line and the hint for a check of a program whose commands the simulation does not hear."""
    trace = TraceBuilder(process="driver.py").mark(0, "simulation_hears", f"/cmd_vel {TWIST}")
    trace.publisher("/cmd_vel", STAMPED)
    trace.delivery(1, "/odom", "nav_msgs/msg/Odometry", {"pose": {"pose": {"position": {"x": 0.0}}}})
    if listens:
        trace.subscription("/odom", "nav_msgs/msg/Odometry")
    found = explain(RULE, builtin_check(check, **parameters), trace.trace(), {"driver.py": FILE})
    return "" if found is None or found.location is None else f"{found.location.line}: {found.hint}"


HINT = f"5: /node publishes {STAMPED} on /cmd_vel; the simulation hears {TWIST} on /cmd_vel: publish {TWIST}"


@pytest.mark.parametrize(
    ("check", "parameters", "told"),
    [
        ("stays_in_range", ODOMETRY, HINT),
        ("publishes", {"topic": "/cmd_vel", "type": TWIST}, HINT),
        ("stays_in_range", {**ODOMETRY, "listens": False}, ""),
    ],
    ids=["what the robot does", "the commands", "what the node hears"],
)
def test_what_a_simulation_does_not_hear_is_told(check: str, parameters: dict[str, Any], told: str) -> None:
    """Of the criteria about the commands, and about what comes of them."""
    assert clue(check, **parameters) == told


SCAN = "sensor_msgs/msg/LaserScan"
FOLLOWER = """
class Follower(Node):
    def __init__(self):
        super().__init__("follower")
        self.near = 0.0
        self.pub = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(LaserScan, "/laser", self.seen, 10)

    def seen(self, scan):
        command = Twist()
        command.linear.x = 0.1
        command.angular.z = 0.5
        self.pub.publish(command)
"""


def told(rule: str, text: str, *, listens: str = "/scan", commands: tuple[float, ...] = ()) -> str:
    """Return the line and the hint of a rule for a robot that is not where it should be.

    Args:
        rule: The rule.
        text: The program.
        listens: The topic that the program subscribes to.
        commands: What it turns by, around x and around z.
    """
    trace = TraceBuilder(process="driver.py").mark(0, "simulation_hears", f"/cmd_vel {TWIST}")
    trace.publisher("/cmd_vel", TWIST).subscription(listens, SCAN)
    for t_s in (1.0, 1.1, 1.2):
        trace.delivery(t_s, "/scan", SCAN, {"ranges": [1.0]})
        trace.delivery(t_s, "/truth/odometry", "nav_msgs/msg/Odometry", {"pose": {"pose": {"position": {"x": 0.0}}}})
        if commands:
            angular = dict(zip(("x", "z"), commands, strict=True))
            trace.message(t_s, "/cmd_vel", TWIST, {"linear": {"x": 0.1}, "angular": angular})
    check = builtin_check("stays_in_range", **{**ODOMETRY, "topic": "/truth/odometry"})
    found = explain(next(r for r in RULES if r.id == rule), check, trace.trace(), {"driver.py": text})
    return "" if found is None or found.location is None else f"{found.location.line}: {found.hint}"


def test_a_subscription_that_hears_nobody_is_told() -> None:
    """With the topic of the grader's that has its type; one that hears the scanner is left alone."""
    hint = told("hears_nobody", FOLLOWER, listens="/laser")
    assert hint.startswith("7: self.create_subscription(LaserScan, ")
    assert hint.endswith("hears nobody: LaserScan is published on /scan, subscribe to that")
    assert told("hears_nobody", FOLLOWER.replace("/laser", "/scan")) == ""


def test_a_turn_around_another_axis_is_told() -> None:
    """Unless the robot is turned around the right one, too."""
    beside = FOLLOWER.replace("angular.z", "angular.x")
    hint = "12: command.angular.x = 0.5: a robot on wheels turns by angular.z, which is always 0: set angular.z"
    assert told("beside_the_wheels", beside, commands=(0.5, 0.0)) == hint
    assert told("beside_the_wheels", beside, commands=(0.5, 0.1)) == ""
    assert told("beside_the_wheels", FOLLOWER, commands=(0.0, 0.5)) == ""


def test_a_callback_that_sleeps_past_the_next_message_is_told() -> None:
    """A short pause, one outside of callbacks, or one beside which other callbacks run, is left alone."""
    sleeps = FOLLOWER.replace("/laser", "/scan") + "        time.sleep(0.5)\n"
    assert told("robot_waits", sleeps).startswith("14: time.sleep(0.5) holds up every callback for 0.5 s")
    assert told("robot_waits", sleeps.replace("0.5)\n", "0.05)\n")) == ""
    assert told("robot_waits", FOLLOWER + "\n\ntime.sleep(0.5)\n") == ""
    assert told("robot_waits", sleeps + "\n\nexecutor = MultiThreadedExecutor()\n") == ""


def test_a_value_under_a_misspelled_name_is_told() -> None:
    """If nothing reads it, and what is read never changes."""
    kept = FOLLOWER.replace(
        "        command = Twist()\n", "        self.naer = scan.ranges[0]\n        command = Twist()\n"
    )
    slip = kept.replace("= 0.5\n", "= self.near\n")
    hint = "10: nothing reads self.naer, and self.near never changes: write self.near"
    assert told("stored_as_another", slip) == hint
    for right in (kept, slip + "        self.near = self.naer\n", slip.replace("naer", "scan")):
        assert told("stored_as_another", right) == ""


SEES = """
class Follower(Node):
    def __init__(self):
        super().__init__("follower")
        self.last = 0.0
        self.pub = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(LaserScan, "/scan", self.seen, 10)

    def seen(self, scan):
        found = []
        for k, r in enumerate(scan.ranges):
            angle = scan.angle_min + k * scan.angle_increment
            if scan.range_min <= r <= scan.range_max:
                x, y = r * math.cos(angle), r * math.sin(angle)
                found.append((x, y))
        self.last = min(found)[0]
        command = Twist()
        command.linear.x = self.last
        command.angular.z = math.atan2(y, x)
        self.pub.publish(command)
"""


@pytest.mark.parametrize("rule", ["empty_slice", "number_is_no_angle", "nan_is_kept", "sine_for_cosine"])
def test_a_program_that_reads_a_scan_rightly_is_left_alone(rule: str) -> None:
    """Whatever else it does wrong."""
    assert told(rule, SEES) == ""


@pytest.mark.parametrize("rule", ["arguments_of_atan2", "last_value_stays", "flag_stays", "never_leaves_a_state"])
def test_a_program_whose_values_change_is_left_alone(rule: str) -> None:
    """Neither a value that each scan sets nor a right angle is taken for a mistake."""
    assert told(rule, SEES) == ""


def test_a_last_value_that_nothing_sets_is_told() -> None:
    """With the line that reads it."""
    assert told("last_value_stays", SEES.replace("self.last = min(found)[0]", "nearest = min(found)[0]")).startswith(
        "18: self.last stays 0.0"
    )
