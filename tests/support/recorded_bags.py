"""Recordings for tests: those that other people made, and ones that are written here."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from places import SHARED
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from grader.runtime.model.quantities import NS_PER_S

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types
TYPE = "nav_msgs/msg/Odometry"
START_NS = 1_700_000_000 * NS_PER_S


def others(name: str) -> Path:
    """Return a recording that other people made, or skip: they are not part of the project."""
    path = SHARED / "bags" / name
    if not path.exists():
        pytest.skip(f"{name} is not beside this checkout")
    return path


def odometry_cdr(x: float, y: float = 2.0, *, little_endian: bool = True) -> bytes:
    import numpy as np

    point, quaternion, vector = (T[f"geometry_msgs/msg/{n}"] for n in ("Point", "Quaternion", "Vector3"))
    pose = T["geometry_msgs/msg/Pose"](
        position=point(x=x, y=y, z=0.25), orientation=quaternion(x=0.0, y=0.0, z=0.6, w=0.8)
    )
    twist = T["geometry_msgs/msg/Twist"](linear=vector(x=0.5, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=-0.125))
    header = T["std_msgs/msg/Header"](stamp=T["builtin_interfaces/msg/Time"](sec=1, nanosec=2), frame_id="odom")
    message = T[TYPE](
        header=header,
        child_frame_id="base_link",
        pose=T["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
        twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36)),
    )
    return bytes(STORE.serialize_cdr(message, TYPE, little_endian=little_endian))


def drive(count: int = 60, period_ns: int = NS_PER_S // 10) -> list[tuple[int, bytes]]:
    """Return `count` messages as (receive time, bytes), x counting up by a hundredth."""
    return [(START_NS + n * period_ns, odometry_cdr(n / 100)) for n in range(count)]


def write_bag(
    path: Path,
    topics: dict[str, Sequence[tuple[int, bytes]]],
    *,
    plugin: StoragePlugin = StoragePlugin.MCAP,
    compression: CompressionMode = CompressionMode.NONE,
    types: dict[str, str] | None = None,
) -> Path:
    """Write a recording with these topics, of odometry unless `types` says otherwise."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg("int32 left\nint32 right\n", "robo_msgs/msg/Wheels"))
    writer = Writer(path, version=9, storage_plugin=plugin)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        for topic, messages in topics.items():
            connection = writer.add_connection(topic, (types or {}).get(topic, TYPE), typestore=store)
            for t_ns, data in messages:
                writer.write(connection, t_ns, data)
    return path
