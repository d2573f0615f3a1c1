"""The robot in a map: what it measures, what stops it, how it differs from an ideal robot, and what it refuses."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from grader.runtime.model.quantities import NS_PER_S, nanoseconds
from grader.runtime.model.worlds import WallMap
from grader.runtime.simulation import Box, Moment, Obstacle, RobotInMap

CELL = 0.05


def room() -> WallMap:
    """Return a room of 4 m by 3 m around the origin, with walls as thick as a cell inside its edges."""
    grid = np.zeros((60, 80), dtype=bool)
    grid[[0, -1]] = True
    grid[:, [0, -1]] = True
    return WallMap(80, 60, CELL, -2.0, -1.5, np.packbits(grid).tobytes())


def robot(seed: int = 1, **parameters: Any) -> RobotInMap:
    made = RobotInMap(map="room.yaml", **parameters)
    made.maps = {"room.yaml": room()}
    made.begin(random.Random(seed))
    return made


def twist(speed: float, turn_rate: float = 0.0) -> Mapping[str, Any]:
    return {"linear": {"x": speed}, "angular": {"z": turn_rate}}


def run(one: RobotInMap, until_s: float, *commands: tuple[float, float, float]) -> dict[str, list[Mapping[str, Any]]]:
    """Step a robot, with commands as (time, speed, turn rate), and return what it published and recorded by topic."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    left = list(commands)
    for number in range(round(until_s * NS_PER_S / one.period) + 1):
        now = Moment(number * one.period, number * one.period)
        for topic, fields in one.step(now):
            found.setdefault(topic, []).append(fields)
        while left and nanoseconds(left[0][0]) < now.t_ns + one.period:
            t_s, *told = left.pop(0)
            list(one.on_message(Moment(nanoseconds(t_s), 0), "/cmd_vel", twist(*told)))
    return found


def ahead(scan: Mapping[str, Any]) -> float:
    """Return the range of the ray at angle 0."""
    return float(scan["ranges"][round(-scan["angle_min"] / scan["angle_increment"])])


def test_the_scanner_measures_the_room() -> None:
    """All around, every tenth of a second, with the angles that it says."""
    scans = run(robot(), 1.0)["/scan"]
    assert len(scans) == 11
    first = scans[0]
    assert (len(first["ranges"]), first["range_min"], first["range_max"]) == (360, 0.12, 3.5)
    assert first["angle_max"] - first["angle_min"] == pytest.approx(359 * first["angle_increment"])
    by_angle = {
        round(math.degrees(first["angle_min"] + k * first["angle_increment"])): r for k, r in enumerate(first["ranges"])
    }
    assert by_angle[0] == pytest.approx(2.0 - CELL)
    assert by_angle[90] == pytest.approx(1.5 - CELL)
    assert by_angle[-90] == pytest.approx(1.5 - CELL)
    assert by_angle[45] == pytest.approx((1.5 - CELL) * math.sqrt(2))


def test_a_narrow_scanner_looks_ahead() -> None:
    """Its outermost rays are half of its field of view to each side."""
    scan = run(robot(rays=5, field_of_view=math.pi / 2), 0.0)["/scan"][0]
    assert [scan["angle_min"], scan["angle_max"]] == pytest.approx([-math.pi / 4, math.pi / 4])
    assert scan["ranges"][2] == pytest.approx(2.0 - CELL)


def test_a_wall_stops_the_robot_and_not_its_wheels() -> None:
    """One collision, however long it pushes; the bumper and the odometry go on."""
    one = robot(radius=0.2, bumper=True)
    found = run(one, 6.0, (0.0, 0.5, 0.0))
    assert one.x == pytest.approx(2.0 - CELL - 0.2, abs=0.03)
    assert found["/odom"][-1]["pose"]["pose"]["position"]["x"] == pytest.approx(3.0)
    assert found["/truth/odometry"][-1]["pose"]["pose"]["position"]["x"] == pytest.approx(one.x)
    assert [found["/truth/collisions"][k]["data"] for k in (0, -1)] == [0, 1]
    assert [found["/bumper"][k]["data"] for k in (0, -1)] == [False, True]
    assert found["/truth/clearance"][-1]["data"] == pytest.approx(0.2, abs=0.03)


def test_it_backs_off_and_hits_again() -> None:
    """Each contact counts once."""
    found = run(robot(), 9.0, (0.0, 1.0, 0.0), (3.0, -0.5, 0.0), (4.0, 0.5, 0.0), (7.0, 0.0, 0.0))
    assert found["/truth/collisions"][-1]["data"] == 2


def test_a_door_opens_and_closes() -> None:
    """It is in the way and in the scan until then, and again afterwards."""
    door = Box(x=1.0, y=0.0, width=0.1, depth=2.8, opens=2 * NS_PER_S, closes=4 * NS_PER_S)
    scans = run(robot(boxes=(door,)), 5.0)["/scan"]
    assert [ahead(scans[k]) for k in (0, 19, 20, 39, 40)] == pytest.approx([0.95, 0.95, 1.95, 1.95, 0.95])


def test_an_obstacle_moves_to_and_fro_and_runs_into_the_robot() -> None:
    """Which is a collision, and the robot may drive away from it."""
    walker = Obstacle(x=1.5, y=0.0, to_x=0.2, to_y=0.0, speed=0.5, radius=0.2)
    assert [walker.place(round(t * NS_PER_S))[0] for t in (0, 1, 2.6, 3.6)] == pytest.approx([1.5, 1.0, 0.2, 0.7])
    one = robot(obstacles=(walker,), radius=0.15)
    found = run(one, 6.0, (2.5, -0.5, 0.0))
    assert found["/truth/collisions"][-1]["data"] == 1
    assert one.x == pytest.approx(-2.0 + CELL + 0.15, abs=0.03) or one.x < -1.0
    assert ahead(found["/scan"][0]) == pytest.approx(1.3)
    still = Obstacle(x=0.0, y=0.0, to_x=1.0, to_y=0.0, starts=NS_PER_S, once=True)
    assert [still.place(round(t * NS_PER_S))[0] for t in (1, 2, 9)] == pytest.approx([0.0, 0.5, 1.0])


def test_dust_and_dropped_rays_read_as_no_distance() -> None:
    """Of each its share: below range_min, and NaN; what is left is noisy."""
    ranges = [r for scan in run(robot(dust=0.2, dropped=0.1, range_noise=0.01), 3.0)["/scan"] for r in scan["ranges"]]
    dusty = sum(r < 0.12 for r in ranges) / len(ranges)
    dropped = sum(map(math.isnan, ranges)) / len(ranges)
    assert dusty == pytest.approx(0.2, abs=0.02)
    assert dropped == pytest.approx(0.08, abs=0.02)
    assert all(r >= 0 or math.isnan(r) for r in ranges)


def test_noise_has_the_deviation_that_is_asked_for() -> None:
    """Of the ray straight ahead, over many scans."""
    values = [ahead(scan) for scan in run(robot(range_noise=0.02), 40.0)["/scan"]]
    mean = sum(values) / len(values)
    assert mean == pytest.approx(1.95, abs=0.005)
    assert math.sqrt(sum((v - mean) ** 2 for v in values) / len(values)) == pytest.approx(0.02, abs=0.004)


def test_slip_moves_less_than_the_wheels_and_drift_misleads_the_odometry() -> None:
    """Slip is what the odometry does not notice; drift is drawn, and grows with the way."""
    slipping = robot(slip=0.25)
    found = run(slipping, 2.0, (0.0, 0.4, 0.0))
    assert slipping.x == pytest.approx(0.6)
    assert found["/odom"][-1]["pose"]["pose"]["position"]["x"] == pytest.approx(0.8)
    drifts = []
    for seed in range(20):
        drifting = robot(seed, drift=0.05)
        found = run(drifting, 2.0, (0.0, 0.4, 0.0))
        assert drifting.x == pytest.approx(0.8)
        drifts.append(found["/odom"][-1]["pose"]["pose"]["position"]["x"] - 0.8)
    assert 0.01 < math.sqrt(sum(d * d for d in drifts) / len(drifts)) < 0.08


def test_commands_are_obeyed_after_the_delay() -> None:
    """Each in its turn."""
    one = robot(delay=nanoseconds(0.3))
    found = run(one, 2.0, (0.0, 0.4, 0.0), (1.0, 0.0, 0.0))
    assert one.x == pytest.approx(0.4)
    moving = [k * 0.05 for k, told in enumerate(found["/odom"]) if told["twist"]["twist"]["linear"]["x"]]
    assert (moving[0], moving[-1]) == pytest.approx((0.35, 1.3))


def test_limits_of_a_car() -> None:
    """It turns no tighter than its radius, not at all where it stands, and takes up speed as fast as it can."""
    standing = robot(min_turn_radius=0.5)
    run(standing, 1.0, (0.0, 0.0, 1.0))
    assert standing.heading == 0.0
    driving = robot(min_turn_radius=0.5)
    run(driving, 1.0, (0.0, 0.25, 3.0))
    assert driving.heading == pytest.approx(0.5, abs=0.03)
    slow = robot(max_turn_acceleration=1.0, max_acceleration=0.5)
    found = run(slow, 1.0, (0.0, 1.0, 2.0))
    assert found["/odom"][10]["twist"]["twist"]["linear"]["x"] == pytest.approx(0.25)
    assert found["/odom"][10]["twist"]["twist"]["angular"]["z"] == pytest.approx(0.5)


def test_the_same_seed_measures_the_same() -> None:
    """To the last bit, and another seed something else."""
    parameters = {"range_noise": 0.01, "dust": 0.1, "dropped": 0.1, "drift": 0.02, "noise": 0.01}
    first, second, other = (run(robot(seed, **parameters), 2.0, (0.0, 0.3, 0.2)) for seed in (1, 1, 2))
    assert repr(first) == repr(second) != repr(other)


def test_it_publishes_the_transform_of_the_scanner() -> None:
    """Beside that of the odometry."""
    told = run(robot(transforms=True, heading=0.5), 0.0)["/tf"][0]["transforms"]
    assert [(one["header"]["frame_id"], one["child_frame_id"]) for one in told] == [
        ("odom", "base_link"),
        ("base_link", "base_scan"),
    ]


def test_it_draws_what_has_happened() -> None:
    """The walls, what stood and moved there, the way of the robot and where it hit something."""
    one = robot(
        boxes=(Box(1.0, 1.0, 0.2, 0.2), Box(-1.0, 1.0, 0.2, 0.2, opens=1)),
        obstacles=(Obstacle(0.0, 1.0, 0.5, 1.0),),
    )
    run(one, 6.0, (0.0, 0.5, 0.0))
    names = [sketch.name for sketch in one.drawing()]
    assert names == ["walls", "boxes", "doors", "ways of obstacles", "way of the robot", "start", "collisions"]


@pytest.mark.parametrize(
    ("parameters", "told"),
    [
        ({"rays": 0}, "expected 1 to 2000 `rays`, found 0"),
        ({"range_min": 4.0}, "expected `range_min` below `range_max`, found 4 and 3.5"),
        ({"dust": 1.5}, "expected a share from 0 to 1 in `dust`, found 1.5"),
        ({"radius": 0.0}, "expected `radius` above 0, found 0"),
        ({"x": 1.9}, "expected a start that touches nothing, found x = 1.9, y = 0"),
        ({"twist": False}, "expected `twist` or `twist_stamped`, found neither"),
    ],
)
def test_impossible_parameters_are_refused(parameters: Mapping[str, Any], told: str) -> None:
    """With what was expected."""
    with pytest.raises(ValueError, match="expected") as caught:
        robot(**parameters)
    assert str(caught.value) == told


def test_a_map_has_to_be_listed() -> None:
    """The message names those that are."""
    one = RobotInMap(map="hall.yaml")
    one.maps = {"room.yaml": room()}
    with pytest.raises(ValueError, match=r"lists under `maps` \(room.yaml\), found hall.yaml"):
        one.begin(random.Random(1))
