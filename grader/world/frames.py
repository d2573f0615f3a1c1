"""Puts the transforms on /tf and /tf_static together, from one frame to another along the tree of frames."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from grader.grading.model.wording import first_few, nearest
from grader.runtime.model.dataclass import dataclass
from grader.world.errors import NoTransform

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: The topics that transforms come on.
TRANSFORMS = ("/tf", "/tf_static")


@dataclass(frozen=True, slots=True)
class FrameTransform:
    """Where a frame is in another one, and how it is turned there."""

    translation: NDArray[Any]  # shape (3,), x, y, z in metres
    rotation: NDArray[Any]  # shape (4,), a unit quaternion x, y, z, w

    @property
    def yaw(self) -> float:
        """The rotation about the axis z, in radians, from -pi to pi."""
        x, y, z, w = map(float, self.rotation)
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    @property
    def matrix(self) -> NDArray[Any]:
        """The same as a matrix of shape (4, 4), by which points `x, y, z, 1` of the frame are multiplied."""
        import numpy as np  # noqa: PLC0415 - most tests need none of it

        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([_rotated(self.rotation, axis) for axis in np.eye(3)], axis=1)
        matrix[:3, 3] = self.translation
        return matrix


class FrameLink(NamedTuple):
    """A frame in its parent, as it was published last."""

    parent: str
    child: str
    transform: FrameTransform


def last_links(messages: Iterable[Any]) -> dict[str, FrameLink]:
    """Return the last link of each frame to its parent, by the frame.

    Args:
        messages: Those of the class `tf2_msgs.msg.TFMessage`, in the order in which they came.
    """
    import numpy as np  # noqa: PLC0415 - as above

    found: dict[str, FrameLink] = {}
    for stamped in (one for message in messages for one in message.transforms):
        parent, child = stamped.header.frame_id.lstrip("/"), stamped.child_frame_id.lstrip("/")
        moved, turned = stamped.transform.translation, stamped.transform.rotation
        rotation = np.array([turned.x, turned.y, turned.z, turned.w])
        length = float(np.linalg.norm(rotation))
        if not math.isfinite(length) or length == 0:
            raise NoTransform(f"{child} in {parent}: expected a quaternion, found {tuple(map(float, rotation))}")
        found[child] = FrameLink(
            parent, child, FrameTransform(np.array([moved.x, moved.y, moved.z]), rotation / length)
        )
    return found


def transform_between(links: Mapping[str, FrameLink], target: str, source: str) -> FrameTransform:
    """Return where a frame is in another one; raises NoTransform, which names the link that is missing.

    Args:
        links: As `last_links` returns them.
        target: The frame in which the other one is looked for.
        source: The other frame.
    """
    from_target, from_source = [*_up(links, target)], [*_up(links, source)]
    roots = from_target[-1], from_source[-1]
    common = next((frame for frame in from_source if frame in from_target), None)
    if common is None:
        raise _missing(links, target, source, roots)
    return _after(_inverse(_in(links, common, target)), _in(links, common, source))


def _up(links: Mapping[str, FrameLink], frame: str) -> Iterator[str]:
    """Yield a frame and all above it; a loop ends where it begins again."""
    seen: set[str] = set()
    while frame not in seen:
        seen.add(frame)
        yield frame
        if frame in links:
            frame = links[frame].parent


def _in(links: Mapping[str, FrameLink], above: str, frame: str) -> FrameTransform:
    """Return where a frame is in one above it."""
    import numpy as np  # noqa: PLC0415 - as above

    found = FrameTransform(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    while frame != above:
        found = _after(links[frame].transform, found)
        frame = links[frame].parent
    return found


def _missing(links: Mapping[str, FrameLink], target: str, source: str, roots: tuple[str, str]) -> NoTransform:
    """Return the error for two frames that are in no tree together."""
    frames = sorted({name for link in links.values() for name in (link.parent, link.child)})
    what = f"no transform from {source} to {target}"
    if not frames:
        return NoTransform(f"{what}: no program has published on /tf or /tf_static")
    for name in (target, source):
        if name not in frames:
            close = nearest(name, frames)
            known = f"; there are {first_few(frames)}"
            return NoTransform(f"{what}: there is no frame {name}{known}", f"did you mean {close}?" if close else "")
    ends = f"{source} is below {roots[1]}, and {target} below {roots[0]}"
    return NoTransform(f"{what}: {ends}: no program publishes a link between {roots[0]} and {roots[1]}")


def _product(one: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
    """Return the product of two quaternions x, y, z, w: the rotation by the other one, then by the first."""
    import numpy as np  # noqa: PLC0415 - as above

    a, b = one[:3], other[:3]
    return np.append(one[3] * b + other[3] * a + np.cross(a, b), one[3] * other[3] - a @ b)


def _rotated(rotation: NDArray[Any], point: NDArray[Any]) -> NDArray[Any]:
    import numpy as np  # noqa: PLC0415 - as above

    twice = 2 * np.cross(rotation[:3], point)
    found: NDArray[Any] = point + rotation[3] * twice + np.cross(rotation[:3], twice)
    return found


def _after(outer: FrameTransform, inner: FrameTransform) -> FrameTransform:
    """Return a transform within another one."""
    turned = _rotated(outer.rotation, inner.translation)
    return FrameTransform(outer.translation + turned, _product(outer.rotation, inner.rotation))


def _inverse(transform: FrameTransform) -> FrameTransform:
    import numpy as np  # noqa: PLC0415 - as above

    back = transform.rotation * np.array([-1.0, -1.0, -1.0, 1.0])
    return FrameTransform(-_rotated(back, transform.translation), back)
