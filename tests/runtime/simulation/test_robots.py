"""The built-in simulated robots: exact motion, limits, noise, and commands that no real robot would obey."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Mapping
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.runtime.model.quantities import NS_PER_S, nanoseconds
from grader.runtime.simulation import DifferentialDrive, Moment, Output, Simulation, Turtle, Unicycle, types_heard


def at(t_s: float) -> Moment:
    return Moment(nanoseconds(t_s), nanoseconds(1_000 + t_s))


def twist(speed: float, turn_rate: float = 0.0) -> Mapping[str, Any]:
    return {"linear": {"x": speed, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": turn_rate}}


def fields(outputs: Iterable[Output], topic: str) -> Mapping[str, Any]:
    return dict(outputs)[topic]


def drive(robot: Unicycle, speed: float, turn_rate: float, *, until_s: float, step_s: float = 0.05) -> None:
    """Command once, at the beginning, and let time pass in steps."""
    robot.begin(random.Random(1))
    robot.command(at(0.0), twist(speed, turn_rate))
    for number in range(1, round(until_s / step_s) + 1):
        robot.advance(at(number * step_s))


@given(st.floats(-2, 2), st.floats(-3, 3), st.sampled_from([0.01, 0.1, 0.5]))
def test_a_constant_command_gives_a_circle_whatever_the_steps(speed: float, turn_rate: float, step_s: float) -> None:
    """With the radius v/w: the motion is exact and not a sum of short straight lines."""
    robot = Unicycle(x=1.0, y=2.0, heading=0.3)
    drive(robot, speed, turn_rate, until_s=2.0, step_s=step_s)
    if abs(turn_rate) < 1e-6:
        want = 1.0 + 2 * speed * math.cos(0.3), 2.0 + 2 * speed * math.sin(0.3)
    else:
        radius, end = speed / turn_rate, 0.3 + 2 * turn_rate
        want = 1.0 + radius * (math.sin(end) - math.sin(0.3)), 2.0 - radius * (math.cos(end) - math.cos(0.3))
    assert (robot.x, robot.y) == pytest.approx(want, abs=1e-5)
    assert math.remainder(robot.heading - 0.3 - 2 * turn_rate, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_a_command_counts_from_the_moment_at_which_it_came() -> None:
    """Not only from the next step on."""
    robot = Unicycle()
    robot.command(at(0.0), twist(1.0))
    robot.command(at(0.513), twist(0.0))
    robot.advance(at(3.0))
    assert robot.x == pytest.approx(0.513)


def test_a_robot_keeps_to_its_limits() -> None:
    """Of speed, turn rate and acceleration: to 0.5 m/s at 0.25 m/s² it takes 2 s and half a metre."""
    robot = DifferentialDrive(max_speed=0.5, max_turn_rate=1.0, max_acceleration=0.25)
    drive(robot, 9.0, 0.0, until_s=2.0)
    assert (robot.x, robot.speed) == pytest.approx((0.5, 0.5))
    robot.command(at(2.0), twist(-9.0, -9.0))
    robot.advance(at(2.1))
    assert (robot.speed, robot.turn_rate) == pytest.approx((0.475, -1.0))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
def test_no_command_takes_a_robot_out_of_the_world(bad: float) -> None:
    """What is no number counts as 0, and what is too large as a million."""
    for robot in (Unicycle(), DifferentialDrive(), Turtle()):
        drive(robot, bad, bad, until_s=5.0)
        assert all(map(math.isfinite, (robot.x, robot.y, robot.heading)))


def test_a_robot_with_a_timeout_stops_when_commands_stay_away() -> None:
    """In the middle of a step, if need be; without one it drives on."""
    careful, careless = DifferentialDrive(timeout=NS_PER_S // 2), DifferentialDrive()
    for robot in (careful, careless):
        drive(robot, 1.0, 0.0, until_s=3.0, step_s=0.3)
    assert careful.x == pytest.approx(0.5)
    assert careful.speed == 0
    assert careless.x == pytest.approx(3.0)


def test_odometry_tells_pose_twist_and_time_with_noise_from_the_seed_alone() -> None:
    """The same seed gives the same noise; the robot itself is where it is."""

    def published(seed: int, noise: float) -> Mapping[str, Any]:
        robot = DifferentialDrive(x=1.0, y=-1.0, heading=math.pi / 2, noise=noise, transforms=True)
        robot.begin(random.Random(seed))
        robot.command(at(0.0), twist(0.5))
        told = dict(robot.step(at(2.0)))
        assert told["/tf"]["transforms"][0]["transform"]["translation"] == told["/odom"]["pose"]["pose"]["position"]
        assert (robot.x, robot.y) == pytest.approx((1.0, 0.0))
        return told["/odom"]

    exact = published(1, 0.0)
    assert exact["header"] == {"stamp": {"sec": 1_002, "nanosec": 0}, "frame_id": "odom"}
    assert exact["pose"]["pose"]["position"] == pytest.approx({"x": 1.0, "y": 0.0})
    assert exact["pose"]["pose"]["orientation"] == pytest.approx({"z": math.sqrt(0.5), "w": math.sqrt(0.5)})
    assert exact["twist"]["twist"]["linear"] == {"x": 0.5}
    assert published(1, 0.1) == published(1, 0.1) != published(2, 0.1)


def test_a_turtle_stays_in_its_field_and_obeys_for_a_second() -> None:
    """As in turtlesim."""
    turtle = Turtle()
    drive(turtle, 2.0, 0.0, until_s=3.0)
    assert turtle.x == pytest.approx(5.544445 + 2.0)
    turtle.command(at(3.0), twist(1e9))
    turtle.advance(at(3.5))
    assert (turtle.x, turtle.y) == pytest.approx((11.088889, 5.544445))
    pose = fields(turtle.step(at(3.5)), "/turtle1/pose")
    assert pose["x"] == turtle.x
    assert pose.keys() == {"x", "y", "theta", "linear_velocity", "angular_velocity"}


@pytest.mark.parametrize("types", [("Twist",), ("TwistStamped",), ("Twist", "TwistStamped")])
def test_a_robot_hears_the_types_that_it_is_given(types: tuple[str, ...]) -> None:
    """With a header the command is the same; a robot that hears nothing is refused."""
    robots = [DifferentialDrive(twist="Twist" in types, twist_stamped="TwistStamped" in types) for _ in range(2)]
    assert types_heard(robots[0].hears()) == {"/cmd_vel": tuple(f"geometry_msgs/msg/{name}" for name in types)}
    for robot, message in zip(robots, (twist(0.5, 0.1), {"header": {}, "twist": twist(0.5, 0.1)}), strict=True):
        robot.on_message(at(0.0), "/cmd_vel", message)
        robot.advance(at(1.0))
    assert (robots[0].x, robots[0].y) == (robots[1].x, robots[1].y) != (0.0, 0.0)
    with pytest.raises(ValueError, match="expected `twist` or `twist_stamped`, found neither"):
        DifferentialDrive(twist=False)


def test_a_turtle_is_moved_by_its_services() -> None:
    """Also by one who asks for a place outside."""
    turtle = Turtle(x=1.0, y=2.0)
    turtle.begin(random.Random(1))
    assert turtle.on_request(at(1.0), "/turtle1/teleport_absolute", {"x": 99.0, "y": math.nan, "theta": 7.0}) == {}
    assert (turtle.x, turtle.y, turtle.heading) == pytest.approx((11.088889, 0.0, 7.0 - math.tau))
    turtle.command(at(1.0), twist(1.0))
    turtle.on_request(at(2.0), "/reset", {})
    turtle.advance(at(5.0))
    assert (turtle.x, turtle.y, turtle.heading) == (1.0, 2.0, 0.0)


def test_a_simulation_does_nothing_unless_told_to() -> None:
    """The base class publishes, hears and answers nothing."""
    one = Simulation()
    one.begin(random.Random(1))
    offered: list[object] = [one.publishes(), one.hears(), one.serves()]
    done: list[object] = [one.step(at(0)), one.on_message(at(0), "/x", {}), one.on_request(at(0), "/x", {})]
    assert not any((*offered, *done))
