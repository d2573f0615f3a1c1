"""Rotations and transforms as matrices, Euler angles and quaternions, which are x, y, z, w as in ROS messages.

The functions are those of https://github.com/DLu/tf_transformations as documented; transforms3d computes them.
Matrices are 4x4 and homogeneous; angles are in radians; `axes` is one of the 24 names of transforms3d, such as `sxyz`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import transforms3d
from numpy.typing import NDArray
from transforms3d import affines, euler, quaternions

__all__ = [
    "ROTATION_IDENTITY",
    "SHEAR_IDENTITY",
    "TRANSLATION_IDENTITY",
    "ZOOM_IDENTITY",
    "compose_matrix",
    "concatenate_matrices",
    "decompose_matrix",
    "euler_from_matrix",
    "euler_from_quaternion",
    "euler_matrix",
    "identity_matrix",
    "inverse_matrix",
    "is_same_transform",
    "quaternion_about_axis",
    "quaternion_conjugate",
    "quaternion_from_euler",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_matrix",
    "quaternion_multiply",
    "quaternion_slerp",
    "random_quaternion",
    "random_rotation_matrix",
    "random_vector",
    "reflection_matrix",
    "rotation_from_matrix",
    "rotation_matrix",
    "scale_matrix",
    "translation_from_matrix",
    "translation_matrix",
    "unit_vector",
    "vector_norm",
]

Array = Any

TRANSLATION_IDENTITY, ROTATION_IDENTITY = [0.0, 0.0, 0.0], np.identity(3)
ZOOM_IDENTITY, SHEAR_IDENTITY = [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]
#: Differences below this are due to rounding.
EPSILON = 4 * np.finfo(float).eps


def _ros(quaternion: Array) -> NDArray[Any]:
    """Convert w, x, y, z to x, y, z, w."""
    return np.roll(np.asarray(quaternion, dtype=float), -1)


def _wxyz(quaternion: Array) -> NDArray[Any]:
    """Convert x, y, z, w to w, x, y, z."""
    return np.roll(np.asarray(quaternion, dtype=float), 1)


def _whole(rotation: Array) -> NDArray[Any]:
    """Extend a 3x3 rotation to a 4x4 matrix."""
    matrix = np.identity(4)
    matrix[:3, :3] = rotation
    return matrix


def identity_matrix() -> NDArray[Any]:
    """Return the 4x4 identity."""
    return np.identity(4)


def translation_matrix(direction: Array) -> NDArray[Any]:
    """Return the matrix of a translation by x, y, z."""
    matrix = np.identity(4)
    matrix[:3, 3] = direction[:3]
    return matrix


def translation_from_matrix(matrix: Array) -> NDArray[Any]:
    """Return the translation x, y, z of a matrix."""
    return np.array(matrix, dtype=float, copy=True)[:3, 3]


def reflection_matrix(point: Array, normal: Array) -> NDArray[Any]:
    """Return the matrix that mirrors at a plane through a point with a normal."""
    direction = unit_vector(normal[:3])
    matrix = _whole(np.identity(3) - 2 * np.outer(direction, direction))
    matrix[:3, 3] = 2 * np.dot(point[:3], direction) * direction
    return matrix


def rotation_matrix(angle: float, direction: Array, point: Array = None) -> NDArray[Any]:
    """Return the matrix that turns by an angle about an axis, through a point or the origin."""
    return np.asarray(transforms3d.axangles.axangle2aff(unit_vector(direction[:3]), angle, point))


def rotation_from_matrix(matrix: Array) -> tuple[float, NDArray[Any], NDArray[Any]]:
    """Return angle, axis and a point on the axis of a rotation."""
    axis, angle, point = transforms3d.axangles.aff2axangle(np.asarray(matrix, dtype=float))
    return float(angle), np.asarray(axis), np.append(np.asarray(point)[:3], 1.0)


def scale_matrix(factor: float, origin: Array = None, direction: Array = None) -> NDArray[Any]:
    """Return the matrix that scales by a factor, about an origin and along a direction if they are given."""
    if direction is None:
        matrix = np.diag([factor, factor, factor, 1.0])
        if origin is not None:
            matrix[:3, 3] = (1 - factor) * np.asarray(origin, dtype=float)[:3]
        return matrix
    axis = unit_vector(direction[:3])
    matrix = _whole(np.identity(3) - (1 - factor) * np.outer(axis, axis))
    if origin is not None:
        matrix[:3, 3] = (1 - factor) * np.dot(np.asarray(origin, dtype=float)[:3], axis) * axis
    return matrix


def concatenate_matrices(*matrices: Array) -> NDArray[Any]:
    """Return the product of matrices: the last one is applied first."""
    product = np.identity(4)
    for matrix in matrices:
        product = product @ np.asarray(matrix, dtype=float)
    return product


def inverse_matrix(matrix: Array) -> NDArray[Any]:
    """Return the inverse of a matrix."""
    return np.linalg.inv(np.asarray(matrix, dtype=float))


def is_same_transform(matrix0: Array, matrix1: Array) -> bool:
    """Return whether two matrices perform the same transform."""
    one, other = np.array(matrix0, dtype=float), np.array(matrix1, dtype=float)
    return bool(np.allclose(one / one[3, 3], other / other[3, 3]))


def euler_matrix(ai: float, aj: float, ak: float, axes: str = "sxyz") -> NDArray[Any]:
    """Return the matrix of a rotation by three angles."""
    return _whole(euler.euler2mat(ai, aj, ak, axes=axes))


def euler_from_matrix(matrix: Array, axes: str = "sxyz") -> tuple[float, float, float]:
    """Return the three angles of a rotation."""
    found = euler.mat2euler(np.asarray(matrix, dtype=float)[:3, :3], axes=axes)
    return float(found[0]), float(found[1]), float(found[2])


def euler_from_quaternion(quaternion: Array, axes: str = "sxyz") -> tuple[float, float, float]:
    """Return the three angles, for `sxyz` roll, pitch and yaw, of a quaternion x, y, z, w."""
    found = euler.quat2euler(_wxyz(quaternion), axes=axes)
    return float(found[0]), float(found[1]), float(found[2])


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: str = "sxyz") -> NDArray[Any]:
    """Return the quaternion x, y, z, w of three angles, for `sxyz` roll, pitch and yaw."""
    return _ros(euler.euler2quat(ai, aj, ak, axes=axes))


def quaternion_about_axis(angle: float, axis: Array) -> NDArray[Any]:
    """Return the quaternion of a rotation about an axis."""
    return _ros(quaternions.axangle2quat(axis, angle))


def quaternion_matrix(quaternion: Array) -> NDArray[Any]:
    """Return the matrix of a quaternion."""
    return _whole(quaternions.quat2mat(_wxyz(quaternion)))


def quaternion_from_matrix(matrix: Array, isprecise: bool = False) -> NDArray[Any]:
    """Return the quaternion of a rotation; `isprecise` changes nothing."""
    return _ros(quaternions.mat2quat(np.asarray(matrix, dtype=float)[:3, :3]))


def quaternion_multiply(quaternion1: Array, quaternion0: Array) -> NDArray[Any]:
    """Return the product of two quaternions: the second one is applied first."""
    return _ros(quaternions.qmult(_wxyz(quaternion1), _wxyz(quaternion0)))


def quaternion_conjugate(quaternion: Array) -> NDArray[Any]:
    """Return the conjugate of a quaternion."""
    return _ros(quaternions.qconjugate(_wxyz(quaternion)))


def quaternion_inverse(quaternion: Array) -> NDArray[Any]:
    """Return the inverse of a quaternion."""
    return _ros(quaternions.qinverse(_wxyz(quaternion)))


def quaternion_slerp(
    quat0: Array, quat1: Array, fraction: float, spin: int = 0, shortestpath: bool = True
) -> NDArray[Any]:
    """Return the quaternion at a fraction of the way from one to another; `spin` adds half turns."""
    one, other = unit_vector(np.asarray(quat0, dtype=float)[:4]), unit_vector(np.asarray(quat1, dtype=float)[:4])
    if fraction in (0.0, 1.0):
        return one if fraction == 0.0 else other
    cosine = float(np.dot(one, other))
    if abs(abs(cosine) - 1.0) < EPSILON:
        return one
    if shortestpath and cosine < 0.0:
        cosine, other = -cosine, -other
    angle = math.acos(max(-1.0, min(1.0, cosine))) + spin * math.pi
    if abs(angle) < EPSILON:
        return one
    scale = 1.0 / math.sin(angle)
    return one * (math.sin((1.0 - fraction) * angle) * scale) + other * (math.sin(fraction * angle) * scale)


def random_quaternion(rand: Sequence[float] | None = None) -> NDArray[Any]:
    """Return a unit quaternion, uniformly distributed, of three numbers from 0 to 1, drawn if not given."""
    a, b, c = np.random.rand(3) if rand is None else rand
    low, high = math.sqrt(1.0 - a), math.sqrt(a)
    one, other = 2 * math.pi * b, 2 * math.pi * c
    return np.array([math.sin(one) * low, math.cos(one) * low, math.sin(other) * high, math.cos(other) * high])


def random_rotation_matrix(rand: Sequence[float] | None = None) -> NDArray[Any]:
    """Return the matrix of a uniformly distributed rotation."""
    return quaternion_matrix(random_quaternion(rand))


def random_vector(size: int) -> NDArray[Any]:
    """Return a vector of numbers from 0 to 1."""
    return np.random.random(size)


def vector_norm(data: Array, axis: int | None = None, out: Array = None) -> Any:
    """Return the length of a vector, or of vectors along an axis."""
    found = np.linalg.norm(np.asarray(data, dtype=float), axis=axis)
    if out is None:
        return found
    out[...] = found
    return None


def unit_vector(data: Array, axis: int | None = None, out: Array = None) -> Any:
    """Return a vector of length 1 in the same direction, or vectors along an axis."""
    values = np.asarray(data, dtype=float)
    found = values / np.linalg.norm(values, axis=axis, keepdims=axis is not None)
    if out is None:
        return found
    out[...] = found
    return None


def compose_matrix(
    scale: Array = None, shear: Array = None, angles: Array = None, translate: Array = None, perspective: Array = None
) -> NDArray[Any]:
    """Return a matrix of scale, shear, Euler angles (`sxyz`), translation and perspective."""
    matrix = affines.compose(
        TRANSLATION_IDENTITY if translate is None else translate[:3],
        ROTATION_IDENTITY if angles is None else euler.euler2mat(*angles, axes="sxyz"),
        ZOOM_IDENTITY if scale is None else scale,
        SHEAR_IDENTITY if shear is None else shear,
    )
    if perspective is not None:
        matrix[3, :] = perspective[:4]
    return matrix / matrix[3, 3]


def decompose_matrix(matrix: Array) -> tuple[Any, Any, Any, Any, Any]:
    """Return scale, shear, Euler angles (`sxyz`), translation and perspective of a matrix."""
    whole = np.array(matrix, dtype=float)
    whole /= whole[3, 3]
    perspective = whole[3].copy()
    whole[3] = 0.0, 0.0, 0.0, 1.0
    translate, rotation, scale, shear = affines.decompose44(whole)
    return scale, shear, euler.mat2euler(rotation, axes="sxyz"), translate, perspective
