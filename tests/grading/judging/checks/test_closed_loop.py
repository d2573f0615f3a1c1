"""What a simulation publishes: goals that are reached in time and kept, and numbers that stay in a range."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from tracing import ODOMETRY, Recording

from grader.grading.judging.checks.closed_loop import ReachesGoal, StaysInRange
from grader.grading.judging.plots import chart_of
from grader.grading.model.exercise import Finding
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import ClockKind, Fault, FaultKind, Mark, Trace

SCAN = "sensor_msgs/msg/LaserScan"
FIELDS = {"pose.pose.position.x": "x", "pose.pose.position.y": "y"}


def drive(x: Callable[[float], float], *goals: tuple[float, float], stop_s: float = 20.0) -> Recording:
    """Record a robot on the x axis, ten times a second, and goals of the form (t_s, x)."""
    recording = Recording(stop_s)
    for t_s, goal in goals:
        recording.deliver(t_s, "/goal", {"x": goal, "y": 0.0, "z": 0.0}, "geometry_msgs/msg/Point")
    for number in range(round(stop_s * 10)):
        position = {"x": x(number / 10), "y": 0.0, "z": 0.0}
        recording.deliver(number / 10, "/odom", {"pose": {"pose": {"position": position}}}, ODOMETRY)
    return recording


def reached(trace: Trace, within_s: float = 5.0, *, stays: bool = True) -> Finding:
    return ReachesGoal("/odom", "/goal", FIELDS, 0.1, round(within_s * NS_PER_S), stays=stays).judge(trace)


def test_a_goal_is_reached_in_time_and_kept() -> None:
    """At 0.5 m/s, 2 m take 4 s."""
    trace = drive(lambda t: min(2.0, 0.5 * t), (0.0, 2.0)).trace()
    assert reached(trace).credit == 1
    late = reached(trace, 3.0)
    assert late.credit == 0
    assert "not reached within 3.0 s, the closest was 0.5 away, expected at most 0.1" in late.reason


def test_a_goal_that_is_passed_counts_only_where_it_need_not_be_kept() -> None:
    """The robot drives on at the same speed."""
    trace = drive(lambda t: 0.5 * t, (0.0, 2.0)).trace()
    assert reached(trace, stays=False).credit == 1
    left = reached(trace)
    assert left.credit == 0
    assert "left again: 0.55 away at t = 5.100 s" in left.reason


def test_each_goal_counts_and_one_sent_again_is_the_same() -> None:
    """A goal that is replaced before its time is over is not judged."""
    goals = [(0.0, 0.0), (1.0, 0.0), (6.0, 9.0), (7.0, 0.05), (13.0, 4.0)]
    missed = reached(drive(lambda _: 0.0, *goals).trace())
    assert missed.evidence["goals"] == 3
    assert missed.evidence["missed"] == 1
    assert missed.evidence["first_missed_s"] == 13.0


def test_the_edge_of_the_tolerance_is_inside_and_no_number_is_nowhere() -> None:
    """NaN is infinitely far away."""
    assert reached(drive(lambda _: 1.9, (0.0, 2.0)).trace()).credit == 1
    assert reached(drive(lambda _: 1.89, (0.0, 2.0)).trace()).credit == 0
    assert reached(drive(lambda _: math.nan, (0.0, 2.0)).trace()).credit == 0


def test_what_the_student_publishes_on_the_topic_is_no_evidence() -> None:
    """Only the simulation says where the robot is."""
    recording = drive(lambda _: 0.0, (0.0, 2.0))
    for number in range(200):
        pose = {"pose": {"pose": {"position": {"x": 2.0, "y": 0.0, "z": 0.0}}}}
        recording.message(number / 10, "/odom", pose, ODOMETRY)
    trace = recording.trace()
    assert reached(trace).credit == 0
    assert StaysInRange("/odom", field="pose.pose.position.x", high=1.0).judge(trace).credit == 1


def test_without_a_goal_that_was_observed_long_enough_nothing_is_decided() -> None:
    """Unless the nodes themselves ended the recording, by a fault or a flood."""
    recording = drive(lambda _: 0.0, (0.0, 2.0), stop_s=3.0)
    with pytest.raises(HarnessError, match=r"no goal was observed for 5\.0 s"):
        reached(recording.trace())
    flooded = drive(lambda _: 0.0, stop_s=3.0).add(Mark(NS_PER_S, "limit", "more than 20,000 messages"))
    for check in (ReachesGoal("/odom", "/goal", FIELDS, 0.1, NS_PER_S), StaysInRange("/scan", field="ranges", low=1.0)):
        found = check.judge(flooded.trace())
        assert (found.credit, "more than 20,000 messages" in found.reason) == (0, True)


def test_a_robot_whose_node_has_crashed_misses_its_goal_because_of_that() -> None:
    """The reason says both."""
    recording = drive(lambda _: 0.0, (0.0, 2.0))
    recording.add(Fault(NS_PER_S, "node.py", FaultKind.EXCEPTION, "ValueError: no", "node.py", 3))
    found = reached(recording.trace())
    assert "the closest was 2 away" in found.reason
    assert "ValueError: no" in found.reason


def scan(*ranges: tuple[float, ...]) -> Trace:
    recording = Recording(float(len(ranges)))
    for second, values in enumerate(ranges):
        recording.deliver(second, "/scan", {"ranges": list(values)}, SCAN)
    return recording.trace()


@pytest.mark.parametrize(
    ("ranges", "credit"), [((0.3, math.inf), 1), ((0.29, 4.0), 0), ((math.nan, 4.0), 0), ((0.29999999, 1.0), 1)]
)
def test_a_list_of_numbers_lies_in_a_range_if_each_of_them_does(ranges: tuple[float, ...], credit: int) -> None:
    """The edge is inside, even after rounding to single precision; NaN is in no range."""
    assert StaysInRange("/scan", field="ranges", low=0.3).judge(scan((2.0, 2.0), ranges)).credit == credit


def test_what_came_before_a_time_is_not_judged() -> None:
    """So a robot may take its time to arrive."""
    trace = scan((5.0,), (4.0,), (0.4,), (0.4,))
    assert StaysInRange("/scan", field="ranges.0", high=0.5).judge(trace).credit == 0
    assert StaysInRange("/scan", field="ranges[0]", high=0.5, after=2 * NS_PER_S).judge(trace).credit == 1


def test_a_field_without_numbers_decides_nothing() -> None:
    """It is the author's mistake."""
    with pytest.raises(HarnessError, match="expected a number at header"):
        StaysInRange("/scan", field="header", low=0.3).judge(scan((1.0,)))


def test_charts_show_the_distance_and_the_nearest_range() -> None:
    """Each with the edge of what is accepted."""
    driven = drive(lambda t: t, (0.0, 2.0)).trace()
    chart = chart_of(ReachesGoal("/odom", "/goal", FIELDS, 0.1, NS_PER_S), driven)
    assert chart is not None
    away = chart.panels[-1]
    assert away.levels[0].value == 0.1
    assert away.series[0].points[0] == (0.0, 2.0)
    nearest = chart_of(StaysInRange("/scan", field="ranges", low=0.3), scan((2.0, 1.0), (0.5, math.inf)))
    assert nearest is not None
    assert nearest.panels[0].series[0].points == ((0.0, 1.0), (1.0, 0.5))
    assert chart_of(StaysInRange("/odom", field="pose.pose.position.x", low=0.3), driven) is not None
    assert chart_of(StaysInRange("/nothing", field="x", low=0.3), driven) is None


def test_on_the_wall_clock_a_moment_is_granted() -> None:
    """The recording has other times than the robot."""
    recording = drive(lambda t: min(2.0, 0.5 * (t - 0.02)), (0.0, 2.0))
    assert reached(recording.trace(), 3.86).credit == 0
    recording.clock = ClockKind.WALL
    assert reached(recording.trace(), 3.86).credit == 1
