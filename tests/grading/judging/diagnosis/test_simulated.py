"""The hint about what a simulation does not hear, for the criteria that it may explain."""

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
