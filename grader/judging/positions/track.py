"""The odometry that was played: which poses were current at a moment."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from grader.core.quantities import NS_PER_MS
from grader.core.trace import Delivery, Trace
from grader.judging.values import JITTER_NS, delivered
from grader.judging.values import field as number_in

#: How long a pose stays acceptable after the next one arrived: a slow loop reads a queue.
STALE_NS = 500 * NS_PER_MS

X = "pose.pose.position.x"
Y = "pose.pose.position.y"
_NAN = float("nan")


@dataclass(frozen=True, slots=True)
class Pose:
    """One odometry message: when it was delivered, its position, and all its fields."""

    t_ns: int
    x: float
    y: float
    fields: Mapping[str, Any]

    @classmethod
    def of(cls, delivery: Delivery) -> Pose:
        """Return the pose that a message carries."""
        fields = delivery.value
        try:
            position = fields["pose"]["pose"]["position"]
            x, y = position["x"], position["y"]
        except (KeyError, TypeError):
            x = y = None
        if type(x) is float and type(y) is float:  # nearly always, and there are many
            return cls(delivery.t_ns, x, y, fields)
        return cls(delivery.t_ns, _number(fields, X), _number(fields, Y), fields)

    def at(self, path: str) -> float:
        """Return a number of the message; NaN, which matches nothing, if it has none there."""
        if path == X:
            return self.x
        return self.y if path == Y else _number(self.fields, path)


@dataclass(frozen=True, slots=True)
class Track:
    """The odometry played on a topic, in order, and when the stream began and ended."""

    deliveries: tuple[Delivery, ...]
    times_ns: tuple[int, ...]
    start_ns: int
    stop_ns: int
    jitter_ns: int
    _spans: list[tuple[float, float]] = field(default_factory=list, init=False, repr=False, compare=False)
    _made: dict[int, Pose] = field(default_factory=dict, init=False, repr=False, compare=False)

    def current(self, t_ns: int) -> range:
        """Return the indices of the poses that a log written at `t_ns` may show; empty before the first."""
        stop = bisect_right(self.times_ns, t_ns + self.jitter_ns)
        start = bisect_left(self.times_ns, t_ns - STALE_NS) - 1
        return range(max(0, min(start, stop - 1)), stop)

    def pose(self, index: int) -> Pose:
        """Return one of the poses; each is made when first asked for, because half of them never are."""
        pose = self._made.get(index)
        if pose is None:
            pose = self._made[index] = Pose.of(self.deliveries[index])
        return pose

    @property
    def poses(self) -> tuple[Pose, ...]:
        """All poses."""
        return tuple(map(self.pose, range(len(self.deliveries))))

    @property
    def moves(self) -> bool:
        """Whether the poses differ by more than a centimetre."""
        return bool(self.times_ns) and max(self.spans) > 0.01

    @property
    def spans(self) -> tuple[float, float]:
        """How far the poses reach in x and in y, metres, at least a centimetre each for the sake of divisions."""
        if not self._spans:
            xs, ys = [p.x for p in self.poses], [p.y for p in self.poses]
            self._spans.append((max(max(xs) - min(xs), 0.01), max(max(ys) - min(ys), 0.01)))
        return self._spans[0]


def track_of(trace: Trace, topic: str) -> Track | None:
    """Return the odometry that was played on a topic, or None if none was."""
    return trace.once((track_of, topic), lambda: _track_of(trace, topic))


def _track_of(trace: Trace, topic: str) -> Track | None:
    played = delivered(trace, topic)
    if not played:
        return None
    times = tuple(d.t_ns for d in played)
    starts, stops = trace.marks("stream_starts", topic), trace.marks("stream_stops", topic)
    start_ns = min(starts[0].t_ns, times[0]) if starts else times[0]
    stop_ns = stops[-1].t_ns if stops else times[-1] + (times[-1] - times[0]) // max(1, len(times) - 1)
    return Track(played, times, start_ns, min(stop_ns, trace.stop_ns), JITTER_NS[trace.clock])


def _number(fields: Mapping[str, Any], path: str) -> float:
    found = number_in(fields, path)
    return _NAN if found is None else found
