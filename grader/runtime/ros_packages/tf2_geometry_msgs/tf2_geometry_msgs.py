"""The functions that transform geometry messages, registered for their types."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import tf2_ros
import transforms3d
from geometry_msgs.msg import (
    Point,
    PointStamped,
    PolygonStamped,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3,
    Vector3Stamped,
    WrenchStamped,
)
from numpy.typing import NDArray

__all__ = [
    "PointStamped",
    "PolygonStamped",
    "PoseStamped",
    "PoseWithCovarianceStamped",
    "Vector3Stamped",
    "WrenchStamped",
    "do_transform_point",
    "do_transform_polygon_stamped",
    "do_transform_pose",
    "do_transform_pose_stamped",
    "do_transform_pose_with_covariance_stamped",
    "do_transform_vector3",
    "do_transform_wrench",
    "from_msg_msg",
    "to_msg_msg",
    "transform_covariance",
]


def to_msg_msg(msg: Any) -> Any:
    """Return a message: it is one."""
    return msg


def from_msg_msg(msg: Any) -> Any:
    """Return a message: it is one."""
    return msg


def _rotation(transform: TransformStamped) -> NDArray[Any]:
    turn = transform.transform.rotation
    return np.array([turn.w, turn.x, turn.y, turn.z])


def _rotated(vector: Any, transform: TransformStamped) -> NDArray[Any]:
    return np.asarray(transforms3d.quaternions.rotate_vector([vector.x, vector.y, vector.z], _rotation(transform)))


def _moved(point: Any, transform: TransformStamped) -> NDArray[Any]:
    shift = transform.transform.translation
    return _rotated(point, transform) + np.array([shift.x, shift.y, shift.z])


def _turned(quaternion: Any, transform: TransformStamped) -> Quaternion:
    own = [quaternion.w, quaternion.x, quaternion.y, quaternion.z]
    w, x, y, z = map(float, transforms3d.quaternions.qmult(_rotation(transform), own))
    return Quaternion(w=w, x=x, y=y, z=z)


def _point(values: NDArray[Any]) -> Point:
    return Point(x=float(values[0]), y=float(values[1]), z=float(values[2]))


def _vector(values: NDArray[Any]) -> Vector3:
    return Vector3(x=float(values[0]), y=float(values[1]), z=float(values[2]))


def do_transform_point(point: PointStamped, transform: TransformStamped) -> PointStamped:
    """Return a point in another frame."""
    return PointStamped(header=transform.header, point=_point(_moved(point.point, transform)))


def do_transform_vector3(vector3: Vector3Stamped, transform: TransformStamped) -> Vector3Stamped:
    """Return a vector in another frame: it is turned, not moved."""
    return Vector3Stamped(header=transform.header, vector=_vector(_rotated(vector3.vector, transform)))


def do_transform_pose(pose: Pose, transform: TransformStamped) -> Pose:
    """Return a pose, without a header, in another frame."""
    return Pose(position=_point(_moved(pose.position, transform)), orientation=_turned(pose.orientation, transform))


def do_transform_pose_stamped(pose: PoseStamped, transform: TransformStamped) -> PoseStamped:
    """Return a pose in another frame."""
    return PoseStamped(header=transform.header, pose=do_transform_pose(pose.pose, transform))


def transform_covariance(cov_in: Any, transform: TransformStamped) -> NDArray[Any]:
    """Return a covariance of 36 numbers, turned as a pose is."""
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = matrix[3:, 3:] = transforms3d.quaternions.quat2mat(_rotation(transform))
    return (matrix @ np.asarray(cov_in, dtype=float).reshape(6, 6) @ matrix.T).ravel()


def do_transform_pose_with_covariance_stamped(
    pose: PoseWithCovarianceStamped, transform: TransformStamped
) -> PoseWithCovarianceStamped:
    """Return a pose and its covariance, which is turned with it, in another frame."""
    found = PoseWithCovarianceStamped(header=transform.header)
    found.pose.pose = do_transform_pose(pose.pose.pose, transform)
    found.pose.covariance = transform_covariance(pose.pose.covariance, transform)
    return found


def do_transform_polygon_stamped(polygon: PolygonStamped, transform: TransformStamped) -> PolygonStamped:
    """Return a polygon in another frame."""
    found = deepcopy(polygon)
    found.header = transform.header
    for point in found.polygon.points:
        point.x, point.y, point.z = map(float, _moved(point, transform))
    return found


def do_transform_wrench(wrench: WrenchStamped, transform: TransformStamped) -> WrenchStamped:
    """Return force and torque in another frame: the torque is that about the new origin."""
    found = WrenchStamped(header=transform.header)
    force, shift = _rotated(wrench.wrench.force, transform), transform.transform.translation
    found.wrench.force = _vector(force)
    found.wrench.torque = _vector(
        _rotated(wrench.wrench.torque, transform) + np.cross([shift.x, shift.y, shift.z], force)
    )
    return found


for _type, _function in (
    (PointStamped, do_transform_point),
    (Vector3Stamped, do_transform_vector3),
    (PoseStamped, do_transform_pose_stamped),
    (PoseWithCovarianceStamped, do_transform_pose_with_covariance_stamped),
    (PolygonStamped, do_transform_polygon_stamped),
    (WrenchStamped, do_transform_wrench),
):
    tf2_ros.TransformRegistration().add(_type, _function)
    tf2_ros.ConvertRegistration().add_to_msg(_type, to_msg_msg)
    tf2_ros.ConvertRegistration().add_from_msg(_type, from_msg_msg)
