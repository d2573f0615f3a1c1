"""The odometry that was played: which poses were current at a moment."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from grader.judging.values import JITTER_NS, Same, field
from grader.model.quantities import NS_PER_MS
from grader.model.trace import Delivery, Trace

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
    """The poses played on a topic, in order, and when the stream began and ended."""

    poses: tuple[Pose, ...]
    times_ns: tuple[int, ...]
    start_ns: int
    stop_ns: int
    jitter_ns: int

    def current(self, t_ns: int) -> range:
        """Return the indices of the poses that a log written at `t_ns` may show; empty before the first."""
        stop = bisect_right(self.times_ns, t_ns + self.jitter_ns)
        start = bisect_left(self.times_ns, t_ns - STALE_NS) - 1
        return range(max(0, min(start, stop - 1)), stop)

    @property
    def moves(self) -> bool:
        """Whether the poses differ by more than a centimetre."""
        xs = [p.at(X) for p in self.poses]
        ys = [p.at(Y) for p in self.poses]
        return bool(xs) and max(max(xs) - min(xs), max(ys) - min(ys)) > 0.01


def track_of(trace: Trace, topic: str) -> Track | None:
    """Return the odometry that was played on a topic, or None if none was."""
    return _track_of(Same(trace), topic)


@lru_cache(maxsize=1)
def _track_of(this: Same[Trace], topic: str) -> Track | None:
    trace = this.value
    poses = tuple(Pose.of(d) for d in trace.deliveries(topic) if d.t_ns < trace.stop_ns)
    if not poses:
        return None
    times = tuple(p.t_ns for p in poses)
    starts, stops = trace.marks("stream_starts", topic), trace.marks("stream_stops", topic)
    start_ns = min(starts[0].t_ns, times[0]) if starts else times[0]
    stop_ns = stops[-1].t_ns if stops else times[-1] + (times[-1] - times[0]) // max(1, len(times) - 1)
    return Track(poses, times, start_ns, min(stop_ns, trace.stop_ns), JITTER_NS[trace.clock])


def _number(fields: Mapping[str, Any], path: str) -> float:
    found = field(fields, path)
    return _NAN if found is None else found
