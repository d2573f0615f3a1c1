"""Simulated robots that drive as commanded: one with two wheels that publishes odometry, and a turtle."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from typing import Any

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S, DurationNs, Topic, seconds
from grader.runtime.simulation.participant import Hears, Moment, Output, Simulation

#: Larger numbers in commands count as this.
LARGEST = 1e6
#: Below this turn, in rad, an arc is computed as a straight line.
STRAIGHT = 1e-9


@dataclass
class Unicycle(Simulation):
    """Something that moves forward and turns; it follows each command exactly until the next one.

    With a constant speed and turn rate it moves on a circular arc (Thrun, Burgard and Fox, Probabilistic Robotics,
    section 5.3). A number in a command that is NaN or infinite counts as 0, one beyond a million as a million.

    Attributes:
        x: Start position, in m.
        y: Start position, in m.
        heading: Start direction, in rad, counter-clockwise from the x axis.
    """

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    speed: float = field(default=0.0, init=False)  # m/s, forward
    turn_rate: float = field(default=0.0, init=False)  # rad/s, counter-clockwise
    _told: tuple[float, float] = field(default=(0.0, 0.0), init=False)
    _told_ns: int | None = field(default=None, init=False)
    at_ns: int = field(default=0, init=False)  # the time that it has reached

    def command(self, now: Moment, twist: Mapping[str, Any]) -> None:
        """Obey the fields of a geometry_msgs/msg/Twist from now on: linear.x in m/s, angular.z in rad/s."""
        self.advance(now)
        self.tell(now.t_ns, self.asked(twist))

    def asked(self, twist: Mapping[str, Any]) -> tuple[float, float]:
        """Return the speed and the turn rate in the fields of a geometry_msgs/msg/Twist, both finite."""
        return _finite(twist["linear"]["x"]), _finite(twist["angular"]["z"])

    def tell(self, t_ns: int, told: tuple[float, float]) -> None:
        """Let it drive at a speed and a turn rate from a time on."""
        self._told, self._told_ns = told, t_ns

    def advance(self, now: Moment) -> None:
        """Move until now."""
        limit_ns = self.obeys_for_ns()
        if limit_ns and self._told_ns is not None and now.t_ns > self._told_ns + limit_ns:
            self._move_to(self._told_ns + limit_ns)
            self._told, self._told_ns = (0.0, 0.0), None
        self._move_to(now.t_ns)

    def _move_to(self, t_ns: int) -> None:
        dt_s, self.at_ns = seconds(t_ns - self.at_ns), max(t_ns, self.at_ns)
        if dt_s > 0:
            way = self.follow(*self._told, dt_s)
            self.move(way, self.turn_rate * dt_s)

    def move(self, way: float, turn: float) -> None:
        """Drive a way in m, and turn by an angle in rad meanwhile."""
        x, y, heading = arc(self.x, self.y, self.heading, way, turn)
        self.place(x, y)
        self.heading = heading

    def obeys_for_ns(self) -> int:
        """Return how long a command lasts, in nanoseconds; 0 for until the next one."""
        return 0

    def follow(self, speed: float, turn_rate: float, dt_s: float) -> float:
        """Take up the commanded speeds, and return the distance driven in a time."""
        self.speed, self.turn_rate = speed, turn_rate
        return speed * dt_s

    def place(self, x: float, y: float) -> None:
        """Move to a position, or to where something stops it."""
        self.x, self.y = x, y


@dataclass
class DifferentialDrive(Unicycle):
    """A robot with two wheels: geometry_msgs/msg/Twist or TwistStamped in, nav_msgs/msg/Odometry out.

    Attributes:
        commands: Topic of the commands: linear.x in m/s, angular.z in rad/s.
        odometry: Topic of the odometry: position in m, orientation as a quaternion, twist in the robot's own frame.
        max_speed: Largest speed, forward or backward, in m/s.
        max_turn_rate: Largest turn rate, in rad/s.
        max_acceleration: Largest change of the speed, in m/s²; 0 for any.
        timeout: Time without a command after which it stops; 0 for never.
        noise: Standard deviation of the published x and y, in m; it drives from where it really is.
        frame: Frame of the odometry.
        child_frame: Frame of the robot.
        transforms: Whether it also publishes the transform between them, on /tf as tf2_msgs/msg/TFMessage.
        twist: Whether it hears geometry_msgs/msg/Twist.
        twist_stamped: Whether it hears geometry_msgs/msg/TwistStamped, which robots of ROS 2 Jazzy hear by default; the
            time in its header is not looked at.
        period: Time between two messages.
    """

    commands: Topic = "/cmd_vel"
    odometry: Topic = "/odom"
    max_speed: float = 10.0
    max_turn_rate: float = 10.0
    max_acceleration: float = 0.0
    timeout: DurationNs = 0
    noise: float = 0.0
    frame: str = "odom"
    child_frame: str = "base_link"
    transforms: bool = False
    twist: bool = True
    twist_stamped: bool = False
    period: DurationNs = 50 * NS_PER_MS
    _draw: random.Random = field(default_factory=random.Random, init=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse a robot that nobody can command."""
        if not (self.twist or self.twist_stamped):
            raise ValueError("expected `twist` or `twist_stamped`, found neither")

    def publishes(self) -> Mapping[str, str]:
        """Return the odometry, and perhaps the transforms."""
        return {
            self.odometry: "nav_msgs/msg/Odometry",
            **({"/tf": "tf2_msgs/msg/TFMessage"} if self.transforms else {}),
        }

    def hears(self) -> Hears:
        """Return the topic of the commands."""
        asked = {"geometry_msgs/msg/Twist": self.twist, "geometry_msgs/msg/TwistStamped": self.twist_stamped}
        return {self.commands: tuple(type_ for type_, heard in asked.items() if heard)}

    def begin(self, draw: random.Random) -> None:
        """Keep the source of the noise."""
        self._draw = draw

    def step(self, now: Moment) -> Iterable[Output]:
        """Move, and publish where it is."""
        self.advance(now)
        yield from self.told(now, self.x, self.y, self.heading)

    def told(self, now: Moment, x: float, y: float, heading: float) -> Iterator[Output]:
        """Yield the odometry of a pose with noise, in m and rad, and perhaps the transform."""
        x, y = (value + (self._draw.gauss(0.0, self.noise) if self.noise else 0.0) for value in (x, y))
        fields = self.odometry_fields(now, x, y, heading)
        yield self.odometry, fields
        if self.transforms:
            transform = {"translation": {"x": x, "y": y}, "rotation": fields["pose"]["pose"]["orientation"]}
            one = {"header": fields["header"], "child_frame_id": self.child_frame, "transform": transform}
            yield "/tf", {"transforms": [one]}

    def odometry_fields(self, now: Moment, x: float, y: float, heading: float) -> Mapping[str, Any]:
        """Return the fields of nav_msgs/msg/Odometry for a pose in m and rad."""
        turned = {"z": math.sin(heading / 2), "w": math.cos(heading / 2)}
        header = {"stamp": now.stamp, "frame_id": self.frame}
        pose = {"position": {"x": x, "y": y}, "orientation": turned}
        twist = {"linear": {"x": self.speed}, "angular": {"z": self.turn_rate}}
        return {
            "header": header,
            "child_frame_id": self.child_frame,
            "pose": {"pose": pose},
            "twist": {"twist": twist},
        }

    def on_message(self, now: Moment, topic: str, message: Mapping[str, Any]) -> Iterable[Output]:
        """Obey a command."""
        del topic
        self.command(now, message.get("twist", message))
        return ()

    def obeys_for_ns(self) -> int:
        """Return the time-out."""
        return self.timeout

    def follow(self, speed: float, turn_rate: float, dt_s: float) -> float:
        """Take up the commanded speeds within the robot's limits, and return the distance driven in a time."""
        before, wanted = self.speed, nearest_within(speed, self.max_speed)
        if not self.max_acceleration > 0:
            return super().follow(wanted, nearest_within(turn_rate, self.max_turn_rate), dt_s)
        after = before + nearest_within(wanted - before, self.max_acceleration * dt_s)
        super().follow(after, nearest_within(turn_rate, self.max_turn_rate), dt_s)
        return (before + after) / 2 * dt_s


#: The side of turtlesim's field and the middle of it, in m, as turtlesim's window has them.
FIELD, MIDDLE = 11.088889, 5.544445


@dataclass
class Turtle(Unicycle):
    """A turtle as in turtlesim: geometry_msgs/msg/Twist in, turtlesim/msg/Pose out, in a square field.

    It obeys a command for a second, and stops at the edges of its field, from 0 to 11.09 m. `/reset` and
    `/NAME/teleport_absolute` are answered as in turtlesim; nothing is drawn.

    Attributes:
        name: Name of the turtle, with which its topics begin.
        x: Start position, in m.
        y: Start position, in m.
        period: Time between two poses.
    """

    name: str = "turtle1"
    x: float = MIDDLE
    y: float = MIDDLE
    period: DurationNs = 16 * NS_PER_MS
    _home: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), init=False)

    def publishes(self) -> Mapping[str, str]:
        """Return the poses."""
        return {f"/{self.name}/pose": "turtlesim/msg/Pose"}

    def hears(self) -> Hears:
        """Return the topic of the commands."""
        return {f"/{self.name}/cmd_vel": "geometry_msgs/msg/Twist"}

    def serves(self) -> Mapping[str, str]:
        """Return the services that move the turtle."""
        return {"/reset": "std_srvs/srv/Empty", f"/{self.name}/teleport_absolute": "turtlesim/srv/TeleportAbsolute"}

    def begin(self, draw: random.Random) -> None:
        """Note where it starts."""
        del draw
        self._home = self.x, self.y, self.heading

    def step(self, now: Moment) -> Iterable[Output]:
        """Move, and publish where it is."""
        self.advance(now)
        pose = {"x": self.x, "y": self.y, "theta": self.heading}
        yield f"/{self.name}/pose", {**pose, "linear_velocity": self.speed, "angular_velocity": self.turn_rate}

    def on_message(self, now: Moment, topic: str, message: Mapping[str, Any]) -> Iterable[Output]:
        """Obey a command."""
        del topic
        self.command(now, message)
        return ()

    def on_request(self, now: Moment, service: str, request: Mapping[str, Any]) -> Mapping[str, Any]:
        """Go back to the start, or to where the request says."""
        self.advance(now)
        if service == "/reset":
            self.x, self.y, self.heading = self._home
            self.command(now, {"linear": {"x": 0.0}, "angular": {"z": 0.0}})
        else:
            self.place(_finite(request["x"]), _finite(request["y"]))
            self.heading = math.remainder(_finite(request["theta"]), math.tau)
        return {}

    def obeys_for_ns(self) -> int:
        """Return a second, as in turtlesim."""
        return NS_PER_S

    def place(self, x: float, y: float) -> None:
        """Move within the field."""
        self.x, self.y = min(max(x, 0.0), FIELD), min(max(y, 0.0), FIELD)


def _finite(value: float) -> float:
    return nearest_within(float(value), LARGEST) if math.isfinite(value) else 0.0


def nearest_within(value: float, most: float) -> float:
    """Return the number nearest to a value that is not beyond a limit on either side."""
    return min(max(value, -most), most)


def arc(x: float, y: float, heading: float, way: float, turn: float) -> tuple[float, float, float]:
    """Return the pose after an arc of a circle, in m and rad; see `Unicycle`."""
    middle = heading + turn / 2
    chord = way if abs(turn) < STRAIGHT else way * math.sin(turn / 2) / (turn / 2)
    return x + chord * math.cos(middle), y + chord * math.sin(middle), math.remainder(heading + turn, math.tau)
