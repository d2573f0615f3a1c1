"""Transforms along the tree of frames: against matrices, and of a real node; what is missing is named."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from transforms3d.quaternions import quat2mat

from grader.world.errors import NoTransform
from grader.world.frames import last_links, transform_between
from grader.world.opening import Worlds


def message(parent: str, child: str, moved: Any = (0, 0, 0), turned: Any = (0, 0, 0, 1)) -> Any:
    """Return a message with one transform, as tf2_msgs has them."""
    translation = SimpleNamespace(**dict(zip("xyz", moved, strict=True)))
    rotation = SimpleNamespace(**dict(zip("xyzw", turned, strict=True)))
    stamped = SimpleNamespace(
        header=SimpleNamespace(frame_id=parent),
        child_frame_id=child,
        transform=SimpleNamespace(translation=translation, rotation=rotation),
    )
    return SimpleNamespace(transforms=[stamped])


def matrix(moved: Any, turned: Any) -> Any:
    """Return a transform as a matrix, by another library."""
    found = np.eye(4)
    x, y, z, w = turned
    found[:3, :3] = quat2mat([w, x, y, z])
    found[:3, 3] = moved
    return found


numbers = st.floats(-3, 3)
turns = st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: math.hypot(*q) > 0.1)
poses = st.tuples(st.tuples(numbers, numbers, numbers), turns)


@given(one=poses, two=poses, other=poses)
def test_a_chain_is_the_product_of_its_matrices(one: Any, two: Any, other: Any) -> None:
    """From one branch of the tree to another: up with inverses, down without; quaternions need not have length 1."""
    links = last_links([message("map", "odom", *one), message("odom", "base", *two), message("map", "dock", *other)])
    expected = np.linalg.inv(matrix(*other)) @ matrix(*one) @ matrix(*two)
    found = transform_between(links, "dock", "base")
    assert np.allclose(found.matrix, expected, atol=1e-9)
    assert math.isclose(math.hypot(*found.rotation), 1)
    assert np.allclose(transform_between(links, "base", "dock").matrix @ found.matrix, np.eye(4), atol=1e-9)


def test_the_last_transform_of_a_frame_counts() -> None:
    """A frame may get another parent; names may begin with a slash, as those of ROS 1 did."""
    first, second = message("map", "base", (1, 0, 0)), message("/odom", "/base", (2, 0, 0), (0, 0, 1, 1))
    found = transform_between(last_links([first, second]), "odom", "base")
    assert found.translation.tolist() == [2, 0, 0]
    assert found.yaw == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    ("target", "source", "reason", "hint"),
    [
        (
            "map",
            "bas",
            "no transform from bas to map: there is no frame bas; there are base, dock",
            "did you mean base?",
        ),
        (
            "map",
            "base",
            "no transform from base to map: base is below odom, and map below map: "
            "no program publishes a link between map and odom",
            "",
        ),
    ],
)
def test_what_is_missing_is_named(target: str, source: str, reason: str, hint: str) -> None:
    """A frame that nobody publishes, and the link between two trees."""
    links = last_links([message("odom", "base"), message("map", "dock")])
    with pytest.raises(NoTransform) as wrong:
        transform_between(links, target, source)
    assert wrong.value.reason.startswith(reason)
    assert wrong.value.hint == hint


def test_a_loop_and_a_rotation_that_is_none_are_told() -> None:
    """Neither hangs nor gives a number."""
    loop = last_links([message("a", "b"), message("b", "a"), message("map", "dock")])
    with pytest.raises(NoTransform, match="no program publishes a link between"):
        transform_between(loop, "map", "a")
    with pytest.raises(NoTransform, match="base in map: expected a quaternion, found"):
        last_links([message("map", "base", turned=(0, 0, 0, 0))])
    with pytest.raises(NoTransform, match="no program has published on /tf or /tf_static"):
        transform_between({}, "map", "base")


NODE = """\
import math

import rclpy
from geometry_msgs.msg import TransformStamped
from tf2_ros import StaticTransformBroadcaster, TransformBroadcaster

rclpy.init()
node = rclpy.create_node("frames")
moving, fixed = TransformBroadcaster(node), StaticTransformBroadcaster(node)


def sent(parent, child, x, yaw=0.0):
    stamped = TransformStamped(child_frame_id=child)
    stamped.header.frame_id = parent
    stamped.header.stamp = node.get_clock().now().to_msg()
    stamped.transform.translation.x = x
    stamped.transform.rotation.z, stamped.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return stamped


steps = 0


def on_timer():
    global steps
    steps += 1
    moving.sendTransform(sent("odom", "base_link", 0.5 * steps, math.pi / 2))


fixed.sendTransform([sent("map", "odom", 10.0), sent("base_link", "laser", 0.25)])
node.create_timer(0.5, on_timer)
rclpy.spin(node)
"""


@pytest.mark.ros
def test_frames_of_a_node(ros_session: Worlds, tmp_path: Path) -> None:
    """Where the laser is on the map while the robot drives; before it has said so, the link is named."""
    (tmp_path / "frames.py").write_text(NODE, encoding="utf-8")
    with ros_session.open(tmp_path) as ros:
        ros.run("frames.py")
        with pytest.raises(
            NoTransform, match="laser is below base_link, and map below map: no program publishes a link"
        ):
            ros.transform("map", "laser")
        ros.advance(2.0)
        laser = ros.transform("map", "laser")
        assert laser.translation == pytest.approx([12.0, 0.25, 0.0])
        assert laser.yaw == pytest.approx(math.pi / 2)
