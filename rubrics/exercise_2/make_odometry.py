"""Makes `rubrics/exercise_2/odometry/`: a minute of wheel odometry from a simulated differential-drive robot.

    python rubrics/exercise_2/make_odometry.py --out /tmp/odometry

The robot is the ideal unicycle. Left and right wheel speeds v_l, v_r (m/s) and the distance b between the wheels give

    v = (v_r + v_l) / 2        omega = (v_r - v_l) / b
    dx/dt = v cos(theta)       dy/dt = v sin(theta)       dtheta/dt = omega

and each step of length h is integrated with the heading at its middle:

    x += v h cos(theta + omega h / 2)    y += v h sin(theta + omega h / 2)    theta += omega h

It laps a circle right of the origin, crosses over above it, laps a circle on the left, and comes back below: all four
quadrants, both signs of x and of y, and nearly nowhere |x| close to |y|, so that a log that swaps the two or drops a
sign differs from a right one at any instant. The wheel commands are piecewise constant, then averaged over 0.8 s as a
drive with limited acceleration would have it. What is published carries white noise of a few millimetres.

Messages come at 26.8 Hz on average, on purpose not at a rate of which some round divisor is 1 s. Every number is drawn
from one fixed seed: the same script writes the same messages.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

TOPIC = "/odom"
TYPE = "nav_msgs/msg/Odometry"
EPOCH_NS = 1_700_000_000 * 10**9
DURATION_S = 60.0
RATE_HZ = 26.8
STEP_S = 0.001
SMOOTHING_S = 0.8
WHEEL_BASE_M = 0.35
SEED = 2068

RADIUS_M = 0.9
LAP_MPS = 0.42
STRAIGHT_MPS = 0.6

POSE_VARIANCE = (4e-6, 4e-6, 1e-6, 1e-6, 1e-6, 9e-6)  # m^2 for x, y, z, then rad^2 for roll, pitch, yaw
TWIST_VARIANCE = (1.6e-5, 1e-6, 1e-6, 1e-6, 1e-6, 2.5e-5)  # (m/s)^2, then (rad/s)^2


class Wheels(NamedTuple):
    """Wheel speeds, m/s."""

    left: float
    right: float


class State(NamedTuple):
    """Pose in the odom frame (m, rad) and body velocities (m/s, rad/s)."""

    x: float
    y: float
    theta: float
    v: float
    omega: float


START = State(x=2.45, y=-0.25, theta=math.pi / 2 - 0.28, v=0.0, omega=0.0)


def plan() -> list[tuple[float, float, float]]:
    """Return the drive as (length in m, curvature in 1/m, speed in m/s), one entry a stretch."""
    lap = 2 * math.pi * RADIUS_M
    turn = 1 / RADIUS_M
    to_the_top = RADIUS_M * (math.pi - START.theta)
    return [
        (to_the_top + lap, turn, LAP_MPS),
        (3.2, 0.0, STRAIGHT_MPS),
        (1.5 * lap, turn, LAP_MPS),
        (3.2, 0.0, STRAIGHT_MPS),
        (2.0 * lap, turn, LAP_MPS),
    ]


def commands() -> list[Wheels]:
    """Return the wheel speeds of every step, smoothed, from rest."""
    raw: list[tuple[float, float]] = []
    for length, curvature, speed in plan():
        raw += [(speed, speed * curvature)] * round(length / speed / STEP_S)
    width = round(SMOOTHING_S / STEP_S)
    kernel = np.full(width, 1 / width)
    padded = np.vstack([np.zeros((width - 1, 2)), np.array(raw)])
    v, omega = (np.convolve(padded[:, column], kernel, mode="valid") for column in (0, 1))
    left, right = v - omega * WHEEL_BASE_M / 2, v + omega * WHEEL_BASE_M / 2
    return [Wheels(float(a), float(b)) for a, b in zip(left, right, strict=True)]


def drive(wheels: list[Wheels]) -> list[State]:
    """Return the state after every step, the start first."""
    states = [START]
    for left, right in wheels:
        x, y, theta, _, _ = states[-1]
        v, omega = (right + left) / 2, (right - left) / WHEEL_BASE_M
        middle = theta + omega * STEP_S / 2
        states.append(
            State(
                x + v * STEP_S * math.cos(middle),
                y + v * STEP_S * math.sin(middle),
                theta + omega * STEP_S,
                v,
                omega,
            )
        )
    return states


def sample_times_s(rng: random.Random) -> Iterator[float]:
    """Yield the sampling times: a steady grid, jitter of a few milliseconds, one in fifty 10 ms late."""
    last = -1.0
    for number in range(int(DURATION_S * RATE_HZ)):
        jitter = max(-0.006, min(0.006, rng.gauss(0.0, 0.002)))
        late = 0.010 if rng.random() < 0.02 else 0.0
        last = max(last + 0.005, number / RATE_HZ + jitter + late)
        yield max(0.0, last)


def stamp(t_ns: int) -> tuple[int, int]:
    """Return whole seconds and the nanoseconds that remain."""
    return divmod(t_ns, 10**9)


def odometry(types: dict[str, Any], state: State, t_ns: int, rng: random.Random) -> object:
    """Return the message for one state, noise included."""
    x, y = state.x + rng.gauss(0, 0.002), state.y + rng.gauss(0, 0.002)
    half_yaw = (state.theta + rng.gauss(0, 0.003)) / 2
    vector, still = types["geometry_msgs/msg/Vector3"], 0.0
    pose = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](x=x, y=y, z=0.0),
        orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=math.sin(half_yaw), w=math.cos(half_yaw)),
    )
    twist = types["geometry_msgs/msg/Twist"](
        linear=vector(x=state.v + rng.gauss(0, 0.004), y=still, z=still),
        angular=vector(x=still, y=still, z=state.omega + rng.gauss(0, 0.005)),
    )
    sec, nanosec = stamp(t_ns)
    return types[TYPE](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec), frame_id="odom"
        ),
        child_frame_id="base_link",
        pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.diag(POSE_VARIANCE).ravel()),
        twist=types["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.diag(TWIST_VARIANCE).ravel()),
    )


def offered_qos() -> Qos:
    """Return what wheel odometry is usually offered with: reliable, volatile, the last ten kept."""
    forever = QosTime(9223372036, 854775807)
    return Qos(
        QosHistory.KEEP_LAST,
        10,
        QosReliability.RELIABLE,
        QosDurability.VOLATILE,
        forever,
        forever,
        QosLiveliness.AUTOMATIC,
        forever,
        avoid_ros_namespace_conventions=False,
    )


def write(out: Path) -> int:
    """Write the recording to a folder that must not exist yet, and return how many messages it holds."""
    rng = random.Random(SEED)  # noqa: S311 - noise, not a secret
    states = drive(commands())
    store = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(out, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    count = 0
    with writer:
        connection = writer.add_connection(TOPIC, TYPE, typestore=store, offered_qos_profiles=[offered_qos()])
        for t_s in sample_times_s(rng):
            t_ns = EPOCH_NS + round(t_s * 1e9)
            message = odometry(store.types, states[round(t_s / STEP_S)], t_ns, rng)
            received_ns = t_ns + 400_000 + round(rng.random() * 900_000)
            writer.write(connection, received_ns, store.serialize_cdr(message, TYPE))
            count += 1
    return count


def main() -> int:
    """Write the recording where `--out` says."""
    parser = argparse.ArgumentParser(description="Write the simulated /odom recording.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "odometry", help="a folder to be made")
    out: Path = parser.parse_args().out
    if out.exists():
        sys.stderr.write(f"{out}: expected a folder that does not exist yet\nhint: remove it, or name another\n")
        return 2
    count = write(out)
    sys.stdout.write(f"{out}: {count} messages on {TOPIC}\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
