"""Reads points from `sensor_msgs/msg/PointCloud2`, and makes such messages.

The behaviour is that of https://docs.ros.org/en/jazzy/p/sensor_msgs_py/ as documented.
"""

from __future__ import annotations

import sys
from collections import namedtuple
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

__all__ = [
    "create_cloud",
    "create_cloud_xyz32",
    "dtype_from_fields",
    "read_points",
    "read_points_list",
    "read_points_numpy",
]

#: numpy's type for each type of a field.
_DATATYPES: dict[int, np.dtype[Any]] = {
    PointField.INT8: np.dtype(np.int8),
    PointField.UINT8: np.dtype(np.uint8),
    PointField.INT16: np.dtype(np.int16),
    PointField.UINT16: np.dtype(np.uint16),
    PointField.INT32: np.dtype(np.int32),
    PointField.UINT32: np.dtype(np.uint32),
    PointField.FLOAT32: np.dtype(np.float32),
    PointField.FLOAT64: np.dtype(np.float64),
}
#: Name of a field without one.
DUMMY_FIELD_PREFIX = "unnamed_field"


def dtype_from_fields(fields: Iterable[PointField], point_step: int | None = None) -> np.dtype[Any]:
    """Return numpy's type of a point.

    Args:
        fields: The fields of a point; one with a count above 1 becomes that many, with numbered names.
        point_step: Bytes of a point; as many as the fields need if None.
    """
    names, offsets, formats = [], [], []
    for number, field in enumerate(fields):
        name, kind = field.name or f"{DUMMY_FIELD_PREFIX}_{number}", _DATATYPES[field.datatype]
        for part in range(field.count):
            names.append(f"{name}_{part}" if field.count > 1 else name)
            offsets.append(field.offset + part * kind.itemsize)
            formats.append(kind.str)
    layout: dict[str, Any] = {"names": names, "formats": formats, "offsets": offsets}
    if point_step is not None:
        layout["itemsize"] = point_step
    return np.dtype(layout)  # type: ignore[call-overload]


def read_points(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[Any] | None = None,
    reshape_organized_cloud: bool = False,
) -> NDArray[Any]:
    """Return the points of a cloud as a structured array, (n,), or (height, width) if it is reshaped.

    Args:
        cloud: The message.
        field_names: Fields to return; all if None.
        skip_nans: Whether to leave out points in which a field is not a number.
        uvs: Indices of points, or pairs of column and row, to return; all if None.
        reshape_organized_cloud: Whether to keep rows and columns of a cloud that has them.
    """
    if not isinstance(cloud, PointCloud2):
        raise AssertionError("cloud is not a sensor_msgs.msg.PointCloud2")
    rows = np.frombuffer(bytes(cloud.data), np.uint8).reshape(cloud.height, -1)[:, : cloud.width * cloud.point_step]
    points = np.frombuffer(rows.tobytes(), dtype=dtype_from_fields(cloud.fields, cloud.point_step))
    if bool(sys.byteorder != "little") != bool(cloud.is_bigendian):
        points = points.byteswap()
    if field_names is not None:
        missing = [name for name in field_names if name not in (points.dtype.names or ())]
        if missing:
            raise AssertionError(f"Requests field {missing[0]!r} is not in the fields of the cloud!")
        points = points[list(field_names)]
    if skip_nans and not cloud.is_dense:
        whole = np.ones(len(points), dtype=bool)
        for name in points.dtype.names or ():
            whole &= ~np.isnan(points[name]) if points[name].dtype.kind == "f" else True
        points = points[whole]
    if uvs is not None:
        chosen = np.asarray(list(uvs) if not isinstance(uvs, np.ndarray) else uvs)
        points = points[chosen[:, 0] + chosen[:, 1] * cloud.width if chosen.ndim == 2 else chosen]
    if reshape_organized_cloud and cloud.height > 1:
        points = points.reshape(cloud.height, cloud.width)
    return points


def read_points_numpy(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[Any] | None = None,
    reshape_organized_cloud: bool = False,
) -> NDArray[Any]:
    """Return the points of a cloud as a plain array, (n, fields); all fields must have one type.

    Arguments are those of `read_points`.
    """
    if not all(cloud.fields[0].datatype == field.datatype for field in _asked(cloud, field_names)):
        raise AssertionError("All fields need to have the same datatype. Use `read_points()` otherwise.")
    points = read_points(cloud, field_names, skip_nans, uvs, reshape_organized_cloud)
    names = points.dtype.names or ()
    return np.stack([points[name] for name in names], axis=-1)


def _asked(cloud: PointCloud2, field_names: Sequence[str] | None) -> list[PointField]:
    return [field for field in cloud.fields if field_names is None or field.name in field_names]


def read_points_list(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[Any] | None = None,
) -> list[Any]:
    """Return the points of a cloud as a list of named tuples; arguments are those of `read_points`."""
    points = read_points(cloud, field_names, skip_nans, uvs)
    point = namedtuple("Point", points.dtype.names or ())  # type: ignore[misc]
    return [point(*values) for values in points.tolist()]


def create_cloud(
    header: Header,
    fields: Sequence[PointField],
    points: Any,
    step: int | None = None,
    point_step: int | None = None,
) -> PointCloud2:
    """Make a message of points.

    Args:
        header: Of the message.
        fields: The fields of a point.
        points: A structured array, (n,) or (height, width), or rows of one number for each field: an array,
            (n, fields) or (height, width, fields), or a list.
        step: Bytes of a point; as many as the fields need if None.
        point_step: The same, by the name that newer releases use.
    """
    layout = dtype_from_fields(fields, point_step if point_step is not None else step)
    if isinstance(points, np.ndarray) and points.dtype.names is not None:
        if points.dtype != layout and set(points.dtype.names) != set(layout.names or ()):
            raise AssertionError("PointFields and structured NumPy array dtype do not match for all fields!")
        whole = np.zeros(points.shape, dtype=layout)
        for name in layout.names or ():
            whole[name] = points[name]
    else:
        values = np.asarray(points)
        if values.size == 0:
            values = values.reshape(0, len(layout.names or ()))
        whole = np.zeros(values.shape[:-1], dtype=layout)
        for number, name in enumerate(layout.names or ()):
            whole[name] = values[..., number]
    if whole.ndim > 2:
        raise AssertionError(
            "Too many dimensions for organized cloud! Points can only be organized in max. two dimensional space"
        )
    height, width = whole.shape if whole.ndim == 2 else (1, len(whole))
    cloud = PointCloud2(
        header=header,
        height=height,
        width=width,
        is_dense=False,
        is_bigendian=sys.byteorder != "little",
        fields=list(fields),
        point_step=layout.itemsize,
        row_step=layout.itemsize * width,
    )
    cloud.data = whole.tobytes()
    return cloud


def create_cloud_xyz32(header: Header, points: Any, step: int | None = None) -> PointCloud2:
    """Make a message of points with x, y and z, as 32-bit numbers."""
    fields = [PointField(name=name, offset=4 * n, datatype=PointField.FLOAT32, count=1) for n, name in enumerate("xyz")]
    return create_cloud(header, fields, points, step)
