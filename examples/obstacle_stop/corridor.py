"""A robot with a laser scanner in a corridor: a wall ahead, which may open, and a pole that stands beside the way."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from grader.api import DifferentialDrive, DurationNs, Moment, Output

#: The scanner: number of rays, the angle of the outermost ones in rad, and its limits in m.
RAYS, OUTERMOST, RANGE_MIN, RANGE_MAX = 31, 1.0, 0.05, 6.0
#: Radius of the pole and of the robot, in m.
POLE, ROBOT = 0.05, 0.04


@dataclass
class Corridor(DifferentialDrive):
    """A robot with a laser scanner on /scan, which drives towards a wall and is stopped by what it runs into.

    Attributes:
        wall: Distance of the wall ahead, in m from the origin.
        opens: When the wall disappears; 0 for never.
        pole_x: Position of the pole, in m ahead; 0 for no pole.
        pole_y: Position of the pole, in m to the left.
        invalid: Share of the rays that measure 0.0, as dust on the scanner makes them.
    """

    wall: float = 3.0
    opens: DurationNs = 0
    pole_x: float = 0.0
    pole_y: float = 0.0
    invalid: float = 0.0
    max_acceleration: float = 0.5
    period: DurationNs = 100_000_000
    _is_open: bool = field(default=False, init=False)

    def publishes(self) -> Mapping[str, str]:
        """Return the odometry and the scan."""
        return {**super().publishes(), "/scan": "sensor_msgs/msg/LaserScan"}

    def step(self, now: Moment) -> Iterable[Output]:
        """Drive, and publish the odometry and what the scanner measures."""
        self._is_open = 0 < self.opens <= now.t_ns
        yield from super().step(now)
        angles = [OUTERMOST * (2 * ray / (RAYS - 1) - 1) for ray in range(RAYS)]
        scan = {
            "header": {"stamp": now.stamp, "frame_id": "laser"},
            "angle_min": -OUTERMOST,
            "angle_max": OUTERMOST,
            "angle_increment": 2 * OUTERMOST / (RAYS - 1),
            "range_min": RANGE_MIN,
            "range_max": RANGE_MAX,
            "ranges": [self._measured(self.heading + angle) for angle in angles],
        }
        yield "/scan", scan

    def _measured(self, angle: float) -> float:
        """Return the distance of what a ray meets first, infinite if that is out of reach."""
        if self.invalid and self._draw.random() < self.invalid:
            return 0.0
        nearest = min(self._to_wall(angle), self._to_pole(angle))
        return nearest if nearest <= RANGE_MAX else math.inf

    def _to_wall(self, angle: float) -> float:
        ahead = math.cos(angle)
        return math.inf if self._is_open or ahead <= 0 else (self.wall - self.x) / ahead

    def _to_pole(self, angle: float) -> float:
        """Return the distance of the pole along a ray: the nearer intersection of a line and a circle."""
        if not self.pole_x:
            return math.inf
        dx, dy = self.pole_x - self.x, self.pole_y - self.y
        along, beside = dx * math.cos(angle) + dy * math.sin(angle), dy * math.cos(angle) - dx * math.sin(angle)
        return along - math.sqrt(POLE**2 - beside**2) if along > 0 and abs(beside) < POLE else math.inf

    def place(self, x: float, y: float) -> None:
        """Move, unless something is in the way."""
        hits_wall = not self._is_open and x > self.wall - ROBOT
        hits_pole = self.pole_x and math.hypot(self.pole_x - x, self.pole_y - y) < POLE + ROBOT
        if not (hits_wall or hits_pole):
            self.x, self.y = x, y


SIMULATIONS = {"corridor": Corridor}
