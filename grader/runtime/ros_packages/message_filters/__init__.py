"""Collects messages of several topics that belong together by their stamps.

The behaviour is that of https://docs.ros.org/en/jazzy/p/message_filters/ as documented.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

import rclpy
from rclpy.clock import ROSClock
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time

__all__ = ["ApproximateTimeSynchronizer", "Cache", "Chain", "SimpleFilter", "Subscriber", "TimeSynchronizer"]

#: Queue of a subscription without QoS of its own.
DEPTH = 10


class SimpleFilter:
    """Passes messages on to callbacks."""

    def __init__(self) -> None:
        self.callbacks: dict[int, tuple[Callable[..., Any], tuple[Any, ...]]] = {}

    def registerCallback(self, cb: Callable[..., Any], *args: Any) -> int:
        """Call a function with each message, and with further arguments; return the number of the connection."""
        connection = len(self.callbacks)
        self.callbacks[connection] = (cb, args)
        return connection

    def signalMessage(self, *msg: Any) -> None:
        """Call all functions with a message, or with several that belong together."""
        for callback, args in list(self.callbacks.values()):
            callback(*msg, *args)


class Subscriber(SimpleFilter):
    """Passes on the messages of a subscription: `Subscriber(node, Image, "image", qos_profile=10)`."""

    def __init__(self, node: Node, msg_type: Any, topic: str, *, qos_profile: Any = DEPTH, **options: Any) -> None:
        super().__init__()
        self.node, self.msg_type, self.topic = node, msg_type, topic
        self.sub = node.create_subscription(msg_type, topic, self.callback, qos_profile, **options)

    def callback(self, msg: Any) -> None:
        """Pass a message on."""
        self.signalMessage(msg)

    def getTopic(self) -> str:
        """Return the name of the topic."""
        return self.topic

    def __getattr__(self, name: str) -> Any:
        if name == "sub":  # not made yet
            raise AttributeError(name)
        return getattr(self.sub, name)


class Cache(SimpleFilter):
    """Keeps the last messages, to be found by their time.

    Args:
        f: The filter whose messages to keep.
        cache_size: How many.
        allow_headerless: Whether messages without a header are kept, by the time of their arrival.
    """

    def __init__(self, f: Any, cache_size: int = 1, allow_headerless: bool = False) -> None:
        super().__init__()
        self.cache_msgs: list[Any] = []
        self.cache_times: list[Time] = []
        self.cache_size, self.allow_headerless = cache_size, allow_headerless
        self.lock = threading.RLock()
        self.connectInput(f)

    def connectInput(self, f: Any) -> None:
        """Keep the messages of another filter."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg: Any) -> None:
        """Keep a message, and pass it on."""
        stamp = _stamp_of(msg, allow_headerless=self.allow_headerless)
        if stamp is None:
            return
        with self.lock:
            self.cache_msgs = [*self.cache_msgs, msg][-self.cache_size :]
            self.cache_times = [*self.cache_times, stamp][-self.cache_size :]
        self.signalMessage(msg)

    def _pairs(self) -> list[tuple[Time, Any]]:
        with self.lock:
            return list(zip(self.cache_times, self.cache_msgs, strict=True))

    def getInterval(self, from_stamp: Time, to_stamp: Time) -> list[Any]:
        """Return the messages from one time to another, both included."""
        if from_stamp > to_stamp:
            raise AssertionError
        return [msg for stamp, msg in self._pairs() if from_stamp <= stamp <= to_stamp]

    def getElemAfterTime(self, stamp: Time) -> Any:
        """Return the oldest message at or after a time, or None."""
        return next((msg for time, msg in self._pairs() if time >= stamp), None)

    def getElemBeforeTime(self, stamp: Time) -> Any:
        """Return the newest message at or before a time, or None."""
        return next((msg for time, msg in reversed(self._pairs()) if time <= stamp), None)

    def getSurroundingInterval(self, from_stamp: Time, to_stamp: Time) -> list[Any]:
        """Return the messages of an interval, with the nearest before and after it."""
        pairs = self._pairs()
        first = max((n for n, (time, _) in enumerate(pairs) if time <= from_stamp), default=0)
        last = min((n for n, (time, _) in enumerate(pairs) if time >= to_stamp), default=len(pairs) - 1)
        return [msg for _, msg in pairs[first : last + 1]]

    def getLatestTime(self) -> Time | None:
        """Return the time of the newest message, or None."""
        return self._pairs()[-1][0] if self.cache_times else None

    def getLastestTime(self) -> Time | None:
        """Return the time of the newest message, or None."""
        return self.getLatestTime()

    def getOldestTime(self) -> Time | None:
        """Return the time of the oldest message, or None."""
        return self._pairs()[0][0] if self.cache_times else None

    def getLast(self) -> Any:
        """Return the newest message, or None."""
        return self.cache_msgs[-1] if self.cache_msgs else None


class Chain(SimpleFilter):
    """Passes messages through filters in turn.

    Args:
        message_filter: The filter whose messages go in; None to give them to `add`.
    """

    def __init__(self, message_filter: Any = None) -> None:
        super().__init__()
        self.incoming_connection: int | None = None
        self._filters: list[Any] = []
        if message_filter is not None:
            self.connectInput(message_filter)

    def connectInput(self, message_filter: Any) -> None:
        """Take the messages of another filter."""
        if self.incoming_connection is not None:
            raise RuntimeError("Already connected")
        self.incoming_connection = message_filter.registerCallback(self.add)

    def add(self, message: Any) -> None:
        """Give a message to the first filter, or pass it on if there is none."""
        if self._filters:
            self._filters[0].add(message)
        else:
            self.signalMessage(message)

    def addFilter(self, message_filter: Any) -> None:
        """Put a filter behind the last one."""
        number = len(self._filters)
        self._filters.append(message_filter)
        message_filter.registerCallback(lambda *msgs: self._pass_on(number, msgs))

    def _pass_on(self, number: int, msgs: tuple[Any, ...]) -> None:
        if number + 1 < len(self._filters):
            self._filters[number + 1].add(*msgs)
        else:
            self.signalMessage(*msgs)

    def getFilter(self, index: int) -> Any:
        """Return a filter by its place."""
        return self._filters[index]


class TimeSynchronizer(SimpleFilter):
    """Passes on the messages of several filters whose stamps are equal.

    Args:
        fs: The filters.
        queue_size: How many messages of each wait for the others.
    """

    def __init__(self, fs: Sequence[Any], queue_size: int) -> None:
        super().__init__()
        self.connectInput(fs)
        self.queue_size = queue_size
        self.lock = threading.Lock()

    def connectInput(self, fs: Sequence[Any]) -> None:
        """Wait for the messages of these filters."""
        self.queues: list[dict[int, Any]] = [{} for _ in fs]
        self.input_connections = [
            f.registerCallback(self.add, q, i) for i, (f, q) in enumerate(zip(fs, self.queues, strict=True))
        ]

    def add(self, msg: Any, my_queue: dict[int, Any], my_queue_index: int | None = None) -> None:
        """Take a message of one filter, and pass it on if the others of its stamp are there."""
        with self.lock:
            stamp = _stamp_of(msg, allow_headerless=False)
            if stamp is None:
                return
            my_queue[stamp.nanoseconds] = msg
            _cut(my_queue, self.queue_size)
            common = reduce(set.intersection, (set(queue) for queue in self.queues))
            found = [[queue.pop(time) for queue in self.queues] for time in sorted(common)]
        for msgs in found:
            self.signalMessage(*msgs)


class ApproximateTimeSynchronizer(TimeSynchronizer):
    """Passes on the messages of several filters whose stamps differ by a little.

    Args:
        fs: The filters.
        queue_size: How many messages of each wait for the others.
        slop: The stamps of a set differ by less than this, in seconds.
        allow_headerless: Whether messages without a header count by the time of their arrival.
        sync_arrival_time: Whether all messages count by the time of their arrival.
    """

    def __init__(
        self,
        fs: Sequence[Any],
        queue_size: int,
        slop: float,
        allow_headerless: bool = False,
        sync_arrival_time: bool = False,
    ) -> None:
        super().__init__(fs, queue_size)
        self.slop = Duration(seconds=slop)
        self.allow_headerless, self.sync_arrival_time = allow_headerless, sync_arrival_time

    def add(self, msg: Any, my_queue: dict[int, Any], my_queue_index: int | None = None) -> None:
        """Take a message of one filter, and pass it on with the nearest ones of the others."""
        now = ROSClock().now() if self.sync_arrival_time else _stamp_of(msg, allow_headerless=self.allow_headerless)
        if now is None:
            return
        slop_ns, own_ns = self.slop.nanoseconds, now.nanoseconds
        with self.lock:
            my_queue[own_ns] = msg
            _cut(my_queue, self.queue_size)
            near = [
                [own_ns]
                if queue is my_queue
                else sorted((t for t in queue if abs(t - own_ns) <= slop_ns), key=lambda t: abs(t - own_ns))
                for queue in self.queues
            ]
            chosen = next((times for times in itertools.product(*near) if max(times) - min(times) < slop_ns), None)
            found = [queue.pop(time) for queue, time in zip(self.queues, chosen, strict=True)] if chosen else None
        if found:
            self.signalMessage(*found)


def _stamp_of(msg: Any, *, allow_headerless: bool) -> Time | None:
    """Return the stamp of a message, or now for one without a header; None, with a warning, if that is not allowed."""
    if hasattr(msg, "header") and hasattr(msg.header, "stamp"):
        return Time.from_msg(msg.header.stamp)
    if allow_headerless:
        return ROSClock().now()
    rclpy.logging.get_logger("message_filters").warning(
        "can not use message filters for messages without timestamp infomation when 'allow_headerless' is disabled. "
        "auto assign ROSTIME to headerless messages once enabling constructor option of 'allow_headerless'."
    )
    return None


def _cut(queue: dict[int, Any], size: int) -> None:
    """Forget the oldest messages of a queue."""
    while len(queue) > size:
        del queue[min(queue)]
