"""Frames and the transforms between them: the buffer behind `tf2_ros`, and its exceptions.

The behaviour is that of https://docs.ros.org/en/jazzy/p/tf2/ as documented; times are rclpy's `Time`, in nanoseconds.
"""

from __future__ import annotations

import bisect
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import transforms3d
from builtin_interfaces.msg import Time as TimeMessage
from geometry_msgs.msg import TransformStamped
from numpy.typing import NDArray
from rclpy.duration import Duration
from rclpy.time import Time

__all__ = [
    "BufferCore",
    "ConnectivityException",
    "ExtrapolationException",
    "InvalidArgumentException",
    "LookupException",
    "TimeoutException",
    "TransformException",
]

NS_PER_S = 1_000_000_000
#: How long a buffer keeps transforms, unless its creator says otherwise.
CACHE_S = 10
#: The square of a quaternion's length may differ from 1 by this; others are not rotations.
NORMALIZED = 1e-2
#: A longer chain of frames is a loop.
LONGEST_CHAIN = 1000


class TransformException(Exception):
    """Base class of all errors about transforms."""


class ConnectivityException(TransformException):
    """Two frames are not in the same tree."""


class LookupException(TransformException):
    """A frame does not exist."""


class ExtrapolationException(TransformException):
    """A time lies outside of what the buffer holds."""


class InvalidArgumentException(TransformException):
    """An argument is not valid, such as an empty name of a frame."""


class TimeoutException(TransformException):
    """A transform did not become available in time."""


@dataclass(frozen=True, order=True)
class _Sample:
    """A frame in its parent at one time: the translation in metres, the rotation as w, x, y, z."""

    stamp_ns: int
    parent: str = field(compare=False)
    translation: NDArray[Any] = field(compare=False)
    rotation: NDArray[Any] = field(compare=False)

    def at(self, later: _Sample, stamp_ns: int) -> _Sample:
        """Interpolate towards a later sample, linearly and along the shortest rotation."""
        if later.stamp_ns == self.stamp_ns or later.parent != self.parent:
            return self
        share = (stamp_ns - self.stamp_ns) / (later.stamp_ns - self.stamp_ns)
        translation = self.translation + share * (later.translation - self.translation)
        return _Sample(stamp_ns, self.parent, translation, _slerp(self.rotation, later.rotation, share))


def _slerp(one: NDArray[Any], other: NDArray[Any], share: float) -> NDArray[Any]:
    cosine = float(np.dot(one, other))
    if cosine < 0:
        other, cosine = -other, -cosine
    if cosine > 1 - 1e-9:
        mixed = one + share * (other - one)
        return mixed / np.linalg.norm(mixed)
    angle = np.arccos(cosine)
    return (np.sin((1 - share) * angle) * one + np.sin(share * angle) * other) / np.sin(angle)


class _Frame:
    """The samples of one frame, sorted by time; a static frame has one that holds for all times."""

    def __init__(self, *, static: bool) -> None:
        self.static = static
        self.samples: list[_Sample] = []
        self.authority = ""

    def insert(self, sample: _Sample, cache_ns: int) -> bool:
        """Add a sample; return whether it is new enough to be kept."""
        if self.static:
            self.samples = [sample]
            return True
        if self.samples and sample.stamp_ns < self.samples[-1].stamp_ns - cache_ns:
            return False
        index = bisect.bisect_left(self.samples, sample)
        if index < len(self.samples) and self.samples[index].stamp_ns == sample.stamp_ns:
            self.samples[index] = sample
        else:
            self.samples.insert(index, sample)
        first = bisect.bisect_left([s.stamp_ns for s in self.samples], self.samples[-1].stamp_ns - cache_ns)
        del self.samples[:first]
        return True

    def at(self, stamp_ns: int) -> _Sample:
        """Return the frame at a time, 0 for the latest; raises ExtrapolationException."""
        samples = self.samples
        if self.static or stamp_ns == 0:
            return samples[-1]
        first, last = samples[0].stamp_ns, samples[-1].stamp_ns
        if first <= stamp_ns <= last:
            index = bisect.bisect_left([s.stamp_ns for s in samples], stamp_ns)
            return (
                samples[index]
                if samples[index].stamp_ns == stamp_ns
                else samples[index - 1].at(samples[index], stamp_ns)
            )
        begin, asked = "Lookup would require extrapolation", _seconds(stamp_ns)
        if len(samples) == 1:
            text = f"{begin} at time {asked}, but only time {_seconds(last)} is in the buffer"
        elif stamp_ns > last:
            text = f"{begin} into the future.  Requested time {asked} but the latest data is at time {_seconds(last)}"
        else:
            text = f"{begin} into the past.  Requested time {asked} but the earliest data is at time {_seconds(first)}"
        raise ExtrapolationException(text)


def _seconds(stamp_ns: int) -> str:
    return f"{stamp_ns / NS_PER_S:.6f}"


def _ns(time: Any) -> int:
    """Return nanoseconds of an rclpy Time or of a message."""
    if isinstance(time, TimeMessage):
        return int(time.sec) * NS_PER_S + int(time.nanosec)
    return int(time.nanoseconds)


def _invalid(frame: str) -> str:
    """Return why a text is not a valid name of a frame; empty if it is."""
    if not frame:
        return "in tf2 frame_ids cannot be empty"
    return "in tf2 frame_ids cannot start with a '/'" if frame.startswith("/") else ""


class BufferCore:
    """A tree of frames over time.

    Args:
        cache_time: How long transforms are kept, as a Duration; 10 s if None.
    """

    def __init__(self, cache_time: Duration | None = None) -> None:
        self._cache_ns = CACHE_S * NS_PER_S if cache_time is None else int(cache_time.nanoseconds)
        self._frames: dict[str, _Frame] = {}
        self._lock = threading.RLock()

    def clear(self) -> None:
        """Forget all transforms that are not static."""
        with self._lock:
            self._frames = {name: frame for name, frame in self._frames.items() if frame.static}

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform; one that makes no sense is left out, with a line on stderr, as tf2 does."""
        self._set(transform, authority, static=False)

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform that holds for all times."""
        self._set(transform, authority, static=True)

    def _set(self, transform: TransformStamped, authority: str, *, static: bool) -> None:
        parent, child = transform.header.frame_id.lstrip("/"), transform.child_frame_id.lstrip("/")
        shift, turn = transform.transform.translation, transform.transform.rotation
        translation = np.array([shift.x, shift.y, shift.z], dtype=float)
        rotation = np.array([turn.w, turn.x, turn.y, turn.z], dtype=float)
        problems = list(_problems(parent, child, authority, translation, rotation))
        for problem in problems:
            print(f"Error:   {problem}", file=sys.stderr)
        if problems:
            return
        sample = _Sample(_ns(transform.header.stamp), parent, translation, rotation / np.linalg.norm(rotation))
        with self._lock:
            frame = self._frames.get(child)
            if frame is None or frame.static != static:
                frame = self._frames[child] = _Frame(static=static)
            frame.authority = authority
            if not frame.insert(sample, self._cache_ns):
                print(
                    f"Warning: TF_OLD_DATA ignoring data from the past for frame {child} at time "
                    f"{_seconds(sample.stamp_ns)} according to authority {authority}",
                    file=sys.stderr,
                )

    def lookup_transform_core(self, target_frame: str, source_frame: str, time: Any) -> TransformStamped:
        """Return the transform that takes coordinates in the source frame to the target frame.

        Args:
            target_frame: Frame of the result.
            source_frame: Frame of the data.
            time: When; 0 is the latest time at which all frames between the two are known.
        """
        with self._lock:
            if target_frame == source_frame:  # also for a frame that does not exist
                return _message(_ns(time) or self._latest_ns(target_frame), target_frame, source_frame, *_nothing())
            target, source = self._known(target_frame, "target_frame"), self._known(source_frame, "source_frame")
            stamp_ns = _ns(time) or self._latest_common_ns(target, source)
            translation, rotation = self._between(target, source, stamp_ns)
            return _message(stamp_ns, target, source, translation, rotation)

    def lookup_transform_full_core(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> TransformStamped:
        """Return the transform between two frames at two times, over a frame that does not move in between."""
        with self._lock:
            self._known(target_frame, "target_frame")
            self._known(source_frame, "source_frame")
            fixed = self._known(fixed_frame, "fixed_frame")
            there = self.lookup_transform_core(fixed, source_frame, source_time)
            back = self.lookup_transform_core(target_frame, fixed, target_time)
            translation, rotation = _chained(_parts(back), _parts(there))
            return _message(_ns(back.header.stamp), target_frame, source_frame, translation, rotation)

    def can_transform_core(self, target_frame: str, source_frame: str, time: Any) -> tuple[bool, str]:
        """Return whether a transform is available, and why not."""
        if target_frame == source_frame:
            return True, ""
        return self._answer(
            {"target_frame": target_frame, "source_frame": source_frame},
            lambda: self.lookup_transform_core(target_frame, source_frame, time),
        )

    def can_transform_full_core(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> tuple[bool, str]:
        """Return whether a transform between two times is available, and why not."""
        return self._answer(
            {"target_frame": target_frame, "source_frame": source_frame, "fixed_frame": fixed_frame},
            lambda: self.lookup_transform_full_core(target_frame, target_time, source_frame, source_time, fixed_frame),
        )

    def _answer(self, frames: Mapping[str, str], look: Callable[[], object]) -> tuple[bool, str]:
        """Return whether a look-up succeeds, and why not, after a look at its arguments."""
        names = self._names()
        for argument, frame in frames.items():
            why = _invalid(frame) or ("" if frame in names else "frame does not exist")
            if why:
                return False, f'Invalid frame ID "{frame}" passed to canTransform argument {argument} - {why}'
        try:
            look()
        except TransformException as error:
            return False, str(error)
        return True, ""

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Time:
        """Return the latest time at which all frames between two are known; 0 if all of them are static."""
        with self._lock:
            target, source = self._known(target_frame, "target_frame"), self._known(source_frame, "source_frame")
            return Time(nanoseconds=self._latest_common_ns(target, source))

    def all_frames_as_string(self) -> str:
        """Return a line for each frame and its parent."""
        with self._lock:
            newest = ((name, frame.samples[-1].parent) for name, frame in sorted(self._frames.items()))
            return "".join(f"Frame {name} exists with parent {parent}.\n" for name, parent in newest)

    def all_frames_as_yaml(self) -> str:
        """Return the frames with their parents and times, as YAML."""
        with self._lock:
            return "\n".join(self._described(name, frame) for name, frame in sorted(self._frames.items())) or "{}"

    def _described(self, name: str, frame: _Frame) -> str:
        first, last = frame.samples[0].stamp_ns, frame.samples[-1].stamp_ns
        rate = (len(frame.samples) - 1) * NS_PER_S / (last - first) if last > first else 10_000.0
        parent, length = frame.samples[-1].parent, (last - first) / NS_PER_S
        return (
            f"{name}: \n  parent: '{parent}'\n  broadcaster: '{frame.authority}'\n  rate: {rate:.3f}\n"
            f"  most_recent_transform: {_seconds(last)}\n  oldest_transform: {_seconds(first)}\n"
            f"  buffer_length: {length:.3f}"
        )

    def _frameExists(self, frame: str) -> bool:
        return frame in self._names()

    def _getFrameStrings(self) -> list[str]:
        return sorted(self._names())

    def _names(self) -> set[str]:
        with self._lock:
            return {*self._frames, *(sample.parent for frame in self._frames.values() for sample in frame.samples[-1:])}

    def _known(self, frame: str, argument: str) -> str:
        argument = f"lookupTransform argument {argument}"
        why = _invalid(frame)
        if why:
            raise InvalidArgumentException(f'Invalid argument "{frame}" passed to {argument} - {why}')
        if frame not in self._names():
            raise LookupException(f'"{frame}" passed to {argument} does not exist. ')
        return frame

    def _ancestors(self, frame: str, stamp_ns: int) -> list[str]:
        """Return a frame and those above it; where a time is not known, the chain of the latest samples goes on."""
        chain = [frame]
        while (above := self._frames.get(chain[-1])) is not None:
            try:
                chain.append(above.at(stamp_ns).parent)
            except ExtrapolationException:
                chain.append(above.samples[-1].parent)
            if len(chain) > LONGEST_CHAIN:
                raise LookupException("The tf tree is invalid because it contains a loop.")
        return chain

    def _common(self, target: str, source: str, stamp_ns: int) -> tuple[list[str], list[str]]:
        """Return the frames below the nearest common one: above the target and above the source."""
        up, down = self._ancestors(target, stamp_ns), self._ancestors(source, stamp_ns)
        shared = next((frame for frame in down if frame in up), None)
        if shared is None:
            raise ConnectivityException(
                f"Could not find a connection between '{target}' and '{source}' because they are not part of the same "
                "tree.Tf has two or more unconnected trees."
            )
        return up[: up.index(shared)], down[: down.index(shared)]

    def _latest_ns(self, name: str) -> int:
        frame = self._frames.get(name)
        return 0 if frame is None or frame.static else frame.samples[-1].stamp_ns

    def _latest_common_ns(self, target: str, source: str) -> int:
        up, down = self._common(target, source, 0)
        moving = [self._frames[name].samples[-1].stamp_ns for name in (*up, *down) if not self._frames[name].static]
        return min(moving, default=0)

    def _between(self, target: str, source: str, stamp_ns: int) -> tuple[NDArray[Any], NDArray[Any]]:
        up, down = self._common(target, source, stamp_ns)
        try:
            to_common, to_target = self._upwards(down, stamp_ns), self._upwards(up, stamp_ns)
        except ExtrapolationException as error:
            text = f"{error}, when looking up transform from frame [{source}] to frame [{target}]"
            raise ExtrapolationException(text) from None
        return _chained(_inverse(to_target), to_common)

    def _upwards(self, frames: Sequence[str], stamp_ns: int) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the transform from the first of some frames, each the child of the next, to the parent of the last."""
        found = _nothing()
        for name in frames:
            sample = self._frames[name].at(stamp_ns)
            found = _chained((sample.translation, sample.rotation), found)
        return found


def _problems(
    parent: str, child: str, authority: str, translation: NDArray[Any], rotation: NDArray[Any]
) -> Iterator[str]:
    """Yield why a transform makes no sense, each with the word that tf2 begins it with."""
    whose = f'authority "{authority}"'
    given = f'Ignoring transform for child_frame_id "{child}" from {whose} because of'
    turn = " ".join(f"{part:f}" for part in rotation[[1, 2, 3, 0]])
    if parent == child:
        yield (
            f"TF_SELF_TRANSFORM: Ignoring transform from {whose} with frame_id and  child_frame_id "
            f'"{child}" because they are the same'
        )
    if not child:
        yield f"TF_NO_CHILD_FRAME_ID: Ignoring transform from {whose} because child_frame_id not set "
    if not parent:
        yield (
            f'TF_NO_FRAME_ID: Ignoring transform with child_frame_id "{child}"  from {whose} because frame_id not set'
        )
    if np.isnan(translation).any() or np.isnan(rotation).any():
        shift = " ".join(f"{part:f}" for part in translation)
        yield f"TF_NAN_INPUT: {given} a nan value in the transform ({shift}) ({turn})"
    if not abs(float(np.dot(rotation, rotation)) - 1) < NORMALIZED:
        yield f"TF_DENORMALIZED_QUATERNION: {given} an invalid quaternion in the transform ({turn})"


Parts = tuple[NDArray[Any], NDArray[Any]]


def _chained(outer: Parts, inner: Parts) -> Parts:
    """Return the transform that applies the inner one first."""
    translation = outer[0] + transforms3d.quaternions.rotate_vector(inner[0], outer[1])
    return translation, transforms3d.quaternions.qmult(outer[1], inner[1])


def _nothing() -> Parts:
    """Return the transform that changes nothing."""
    return np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])


def _inverse(parts: Parts) -> Parts:
    back = transforms3d.quaternions.qconjugate(parts[1])
    return -np.asarray(transforms3d.quaternions.rotate_vector(parts[0], back)), back


def _parts(message: TransformStamped) -> Parts:
    shift, turn = message.transform.translation, message.transform.rotation
    return np.array([shift.x, shift.y, shift.z]), np.array([turn.w, turn.x, turn.y, turn.z])


def _message(
    stamp_ns: int, target: str, source: str, translation: NDArray[Any], rotation: NDArray[Any]
) -> TransformStamped:
    found = TransformStamped()
    found.header.stamp = TimeMessage(sec=stamp_ns // NS_PER_S, nanosec=stamp_ns % NS_PER_S)
    found.header.frame_id, found.child_frame_id = target, source
    shift, turn = found.transform.translation, found.transform.rotation
    shift.x, shift.y, shift.z = map(float, translation)
    turn.w, turn.x, turn.y, turn.z = map(float, rotation)
    return found
