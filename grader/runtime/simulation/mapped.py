"""A simulated robot in a map: it drives among walls, doors and moving obstacles, and measures them with a scanner."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, DurationNs, Topic, seconds
from grader.runtime.model.worlds import Place, Sketch
from grader.runtime.simulation.participant import Moment, Output
from grader.runtime.simulation.robots import DifferentialDrive, arc, nearest_within
from grader.runtime.simulation.walls import Rays, Walls, ranges_to_box, ranges_to_circle

if TYPE_CHECKING:
    from grader.runtime.simulation.walls import Numbers

#: The longest way between two places at which it is looked whether the robot touches something, in m: as thin as the
#: walls of common maps, whose cells measure 0.05 m.
STRIDE = 0.02
#: The most rays of a scan: the message is built and kept for each.
MOST_RAYS = 2000
#: What is only recorded: checks read it, and no node hears it.
TRUTH, CLEARANCE, COLLISIONS = "/truth/odometry", "/truth/clearance", "/truth/collisions"


@dataclass(frozen=True, slots=True)
class Box:
    """A wall beside those of the map, or a door: a rectangle whose sides are parallel to the axes.

    Attributes:
        x: Of its middle, in m.
        y: Of its middle, in m.
        width: Along x, in m.
        depth: Along y, in m.
        opens: When it disappears; 0 for never.
        closes: When it is there again; 0 for never.
    """

    x: float
    y: float
    width: float
    depth: float
    opens: DurationNs = 0
    closes: DurationNs = 0

    def is_there(self, t_ns: int) -> bool:
        """Return whether it is closed at a time since the scenario began, in nanoseconds."""
        return not 0 < self.opens <= t_ns or 0 < self.closes <= t_ns

    @property
    def limits(self) -> tuple[float, float, float, float]:
        """Least x, least y, largest x and largest y, in m."""
        width, depth = self.width / 2, self.depth / 2
        return self.x - width, self.y - depth, self.x + width, self.y + depth


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A round obstacle that moves along a straight line, to its end and back again.

    Attributes:
        x: Where its middle begins, in m.
        y: The same.
        to_x: Where it turns, in m.
        to_y: The same.
        speed: In m/s.
        radius: In m.
        starts: When it sets out.
        once: Whether it stays where it would turn.
    """

    x: float
    y: float
    to_x: float
    to_y: float
    speed: float = 0.5
    radius: float = 0.2
    starts: DurationNs = 0
    once: bool = False

    def place(self, t_ns: int) -> Place:
        """Return where its middle is at a time since the scenario began, in m."""
        length = math.hypot(self.to_x - self.x, self.to_y - self.y)
        way = self.speed * seconds(max(0, t_ns - self.starts))
        if not length or not way > 0:
            return self.x, self.y
        along = min(way, length) if self.once else length - abs(length - way % (2 * length))
        return self.x + (self.to_x - self.x) * along / length, self.y + (self.to_y - self.y) * along / length


@dataclass
class RobotInMap(DifferentialDrive):
    """A round robot with a laser scanner among the walls of a map: commands in, scans and odometry out.

    It stops where it would touch something, while its wheels go on turning. What it really does is recorded on three
    topics that no node hears: `/truth/odometry` (nav_msgs/msg/Odometry), `/truth/clearance` (std_msgs/msg/Float64,
    distance from its middle to the nearest thing, in m) and `/truth/collisions` (std_msgs/msg/UInt32, how often it has
    touched something).

    Attributes:
        map: One of the files under `maps` of the rubric; empty for a world without walls of a map.
        boxes: Walls beside those of the map; one that opens is a door.
        obstacles: Obstacles that move.
        radius: Of the robot, in m.
        max_turn_acceleration: Largest change of the turn rate, in rad/s²; 0 for any.
        min_turn_radius: The tightest turn, in m, for a car with Ackermann steering; 0 for one that turns on the spot.
        delay: Time from a command until the wheels obey.
        slip: Share of the way that the wheels turn in vain; the odometry does not notice.
        drift: Standard deviation of the error of the odometry, as a share of the way and of turns, drawn once.
        scan: Topic of the scanner: sensor_msgs/msg/LaserScan, in the middle of the robot.
        scan_frame: Frame of the scanner.
        rays: Number of rays.
        field_of_view: Angle that they cover, half of it on each side, in rad; 6.2832 or more for all around.
        range_min: Smallest distance that the scanner can measure, in m.
        range_max: Largest distance that it can measure, in m; what is beyond reads as infinite.
        range_noise: Standard deviation of a distance, in m.
        dropped: Share of the rays that measure nothing, and read as NaN.
        dust: Share of the rays that meet dust on the scanner, and read as less than `range_min`.
        scan_period: Time between two scans, a multiple of `period`.
        bumper: Whether it publishes on /bumper whether it touches something: std_msgs/msg/Bool.
    """

    map: str = ""
    boxes: tuple[Box, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    radius: float = 0.15
    max_turn_acceleration: float = 0.0
    min_turn_radius: float = 0.0
    delay: DurationNs = 0
    slip: float = 0.0
    drift: float = 0.0
    scan: Topic = "/scan"
    scan_frame: str = "base_scan"
    rays: int = 360
    field_of_view: float = math.tau
    range_min: float = 0.12
    range_max: float = 3.5
    range_noise: float = 0.0
    dropped: float = 0.0
    dust: float = 0.0
    scan_period: DurationNs = 100 * NS_PER_MS
    bumper: bool = False
    _walls: Walls | None = field(default=None, init=False, repr=False)
    _waiting: list[tuple[int, tuple[float, float]]] = field(default_factory=list, init=False, repr=False)
    _way: list[Place] = field(default_factory=list, init=False, repr=False)
    _hits: list[Place] = field(default_factory=list, init=False, repr=False)
    _wheels: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), init=False, repr=False)
    _errors: tuple[float, float] = field(default=(0.0, 0.0), init=False, repr=False)
    _touches: bool = field(default=False, init=False, repr=False)
    _next_scan_ns: int = field(default=0, init=False, repr=False)
    _noise: Any = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse what no scanner or robot has."""
        super().__post_init__()
        if not 1 <= self.rays <= MOST_RAYS:
            raise ValueError(f"expected 1 to {MOST_RAYS} `rays`, found {self.rays}")
        if not 0 <= self.range_min < self.range_max or not math.isfinite(self.range_max):
            raise ValueError(f"expected `range_min` below `range_max`, found {self.range_min:g} and {self.range_max:g}")
        for name in ("slip", "dropped", "dust"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"expected a share from 0 to 1 in `{name}`, found {getattr(self, name):g}")
        for name in ("radius", "field_of_view"):
            if not 0 < getattr(self, name) < math.inf:
                raise ValueError(f"expected `{name}` above 0, found {getattr(self, name):g}")

    def publishes(self) -> Mapping[str, str]:
        """Return what the robot says of itself, and the scan."""
        return {
            **super().publishes(),
            self.scan: "sensor_msgs/msg/LaserScan",
            **({"/bumper": "std_msgs/msg/Bool"} if self.bumper else {}),
        }

    def records(self) -> Mapping[str, str]:
        """Return what is only recorded."""
        return {TRUTH: "nav_msgs/msg/Odometry", CLEARANCE: "std_msgs/msg/Float64", COLLISIONS: "std_msgs/msg/UInt32"}

    def begin(self, draw: random.Random) -> None:
        """Look up the map, and draw the error of the odometry; raises ValueError for a robot that begins in a wall."""
        super().begin(draw)
        if self.map:
            if self.map not in self.maps:
                known = ", ".join(self.maps) or "it lists none"
                raise ValueError(f"expected a map that the rubric lists under `maps` ({known}), found {self.map}")
            self._walls = Walls(self.maps[self.map])
        self._wheels = self.x, self.y, self.heading
        self._errors = (draw.gauss(0.0, self.drift), draw.gauss(0.0, self.drift)) if self.drift else (0.0, 0.0)
        if self.range_noise or self.dropped or self.dust:
            import numpy as np  # noqa: PLC0415 - see `walls`

            # of all generators of numpy the one whose numbers never change (NEP 19); a call for each ray would cost
            # more than the rays
            self._noise = np.random.RandomState(draw.getrandbits(32))
        if self.clearance(self.x, self.y) < self.radius:
            raise ValueError(f"expected a start that touches nothing, found x = {self.x:g}, y = {self.y:g}")

    # --------------------------------------------------------------- driving

    def command(self, now: Moment, twist: Mapping[str, Any]) -> None:
        """Obey a command after the delay."""
        if not self.delay:
            super().command(now, twist)
            return
        self.advance(now)
        self._waiting.append((now.t_ns + self.delay, self.asked(twist)))

    def advance(self, now: Moment) -> None:
        """Move until now, by each command from when it is obeyed."""
        while self._waiting and self._waiting[0][0] <= now.t_ns:
            due_ns, told = self._waiting.pop(0)
            super().advance(Moment(due_ns, now.clock_ns))
            self.tell(due_ns, told)
        super().advance(now)

    def follow(self, speed: float, turn_rate: float, dt_s: float) -> float:
        """Take up the commanded speeds within the limits of the robot."""
        turn_rate = nearest_within(turn_rate, self.max_turn_rate)
        if self.max_turn_acceleration > 0:
            change = nearest_within(turn_rate - self.turn_rate, self.max_turn_acceleration * dt_s)
            turn_rate = self.turn_rate + change
        way = super().follow(speed, turn_rate, dt_s)
        if self.min_turn_radius > 0:
            self.turn_rate = nearest_within(self.turn_rate, abs(self.speed) / self.min_turn_radius)
        return way

    def move(self, way: float, turn: float) -> None:
        """Let the wheels turn, and the robot move as far as they grip and nothing is in the way."""
        for_way, for_turn = self._errors
        self._wheels = arc(*self._wheels, way * (1 + for_way), turn * (1 + for_turn))
        super().move(way * (1 - self.slip), turn * (1 - self.slip))

    def place(self, x: float, y: float) -> None:
        """Move towards a position in a straight line, and stop before what is there."""
        begin_x, begin_y = self.x, self.y
        steps = max(1, math.ceil(math.hypot(x - begin_x, y - begin_y) / STRIDE))
        clearance = self.clearance(self.x, self.y)
        for number in range(1, steps + 1):
            next_x, next_y = begin_x + (x - begin_x) * number / steps, begin_y + (y - begin_y) * number / steps
            # nothing comes nearer than the robot moves
            clearance -= math.hypot(next_x - self.x, next_y - self.y)
            if clearance < self.radius:
                here, clearance = self.clearance(self.x, self.y), self.clearance(next_x, next_y)
                if clearance < self.radius and clearance <= here:  # it may leave what has run into it
                    self._hit()
                    return
            self.x, self.y = next_x, next_y

    def clearance(self, x: float, y: float) -> float:
        """Return the distance from a place to the nearest thing that is there now, in m; infinite without any."""
        nearest = self._walls.distance(x, y) if self._walls is not None else math.inf
        for least_x, least_y, most_x, most_y in self._boxes():
            nearest = min(nearest, math.hypot(max(least_x - x, x - most_x, 0), max(least_y - y, y - most_y, 0)))
        for there_x, there_y, radius in self._circles():
            nearest = min(nearest, max(0.0, math.hypot(there_x - x, there_y - y) - radius))
        return nearest

    def _hit(self) -> None:
        """Count a collision, once until the robot has left what it touches."""
        if not self._touches:
            self._hits.append((self.x, self.y))
        self._touches = True

    def _boxes(self) -> Iterator[tuple[float, float, float, float]]:
        return (box.limits for box in self.boxes if box.is_there(self.at_ns))

    def _circles(self) -> Iterator[tuple[float, float, float]]:
        return ((*obstacle.place(self.at_ns), obstacle.radius) for obstacle in self.obstacles)

    # -------------------------------------------------------------- sensing

    def step(self, now: Moment) -> Iterable[Output]:
        """Move, and publish what the robot measures; record what is true."""
        self.advance(now)
        clearance = self.clearance(self.x, self.y)
        if clearance < self.radius:
            self._hit()  # something has run into it
        elif clearance > self.radius + STRIDE:
            self._touches = False
        self._way.append((self.x, self.y))
        yield from self.told(now, *self._wheels)
        if now.t_ns >= self._next_scan_ns:
            self._next_scan_ns = now.t_ns + self.scan_period
            yield self.scan, self._scanned(now)
        if self.bumper:
            yield "/bumper", {"data": self._touches}
        yield TRUTH, self.odometry_fields(now, self.x, self.y, self.heading)
        yield CLEARANCE, {"data": clearance}
        yield COLLISIONS, {"data": len(self._hits)}

    def told(self, now: Moment, x: float, y: float, heading: float) -> Iterator[Output]:
        """Yield the odometry, with the transform of the scanner."""
        for topic, fields in super().told(now, x, y, heading):
            if topic == "/tf":
                header = {"stamp": now.stamp, "frame_id": self.child_frame}
                mount = {"header": header, "child_frame_id": self.scan_frame, "transform": {"rotation": {"w": 1.0}}}
                yield topic, {"transforms": [*fields["transforms"], mount]}
            else:
                yield topic, fields

    def _scanned(self, now: Moment) -> Mapping[str, Any]:
        around = self.field_of_view >= math.tau - 1e-3
        angle = math.tau if around else self.field_of_view
        increment = angle / self.rays if around else angle / max(1, self.rays - 1)
        return {
            "header": {"stamp": now.stamp, "frame_id": self.scan_frame},
            "angle_min": -angle / 2,
            "angle_max": -angle / 2 + increment * (self.rays - 1),
            "angle_increment": increment,
            "scan_time": seconds(self.scan_period),
            "range_min": self.range_min,
            "range_max": self.range_max,
            "ranges": self.ranges(Rays(self.heading, -angle / 2, increment, self.rays)),
        }

    def ranges(self, rays: Rays) -> list[float]:
        """Return what the scanner measures along rays, in m."""
        import numpy as np  # noqa: PLC0415 - see `walls`

        found: Numbers = np.full(rays.count, math.inf)
        if self._walls is not None:
            found = self._walls.ranges(self.x, self.y, rays, self.range_max)
        for box in self._boxes():
            found = np.minimum(found, ranges_to_box(self.x, self.y, rays, box))
        for circle in self._circles():
            found = np.minimum(found, ranges_to_circle(self.x, self.y, rays, circle))
        if self.range_noise:
            found = np.maximum(found + self.range_noise * self._noise.standard_normal(found.size), 0.0)
        found[found > self.range_max] = math.inf
        if self.dropped:
            found[self._noise.random_sample(found.size) < self.dropped] = math.nan
        if self.dust:
            dusty = self._noise.random_sample(found.size) < self.dust
            found[dusty] = self.range_min * self._noise.random_sample(int(dusty.sum()))
        measured: list[float] = found.tolist()
        return measured

    def drawing(self) -> Iterator[Sketch]:
        """Yield the walls, what else stood or moved there, the way that the robot took, and where it hit something."""
        if self._walls is not None:
            yield Sketch("walls", tuple(self._walls.outlines()), tone="faint")
        for name, boxes in (
            ("boxes", [box for box in self.boxes if not box.opens]),
            ("doors", [box for box in self.boxes if box.opens]),
        ):
            if boxes:
                yield Sketch(name, tuple(map(_rectangle, boxes)), tone="faint" if name == "boxes" else "second")
        if self.obstacles:
            ways = tuple(((one.x, one.y), (one.to_x, one.to_y)) for one in self.obstacles)
            yield Sketch("ways of obstacles", ways, tone="warning")
        if self._way:
            yield Sketch("way of the robot", (tuple(self._way),))
            yield Sketch("start", ((self._way[0],),), dots=True, tone="good")
        if self._hits:
            yield Sketch("collisions", (tuple(self._hits),), dots=True, tone="bad")


def _rectangle(box: Box) -> tuple[Place, ...]:
    left, low, right, high = box.limits
    return (left, low), (right, low), (right, high), (left, high), (left, low)
