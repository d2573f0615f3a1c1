"""Tells a program what discovery has found of its endpoints, at the moment at which the grader has matched them.

A match, and a counterpart whose QoS does not fit, are events of the middleware. It reports them in real time, as soon
as it learns of them. Here they are taken while the grader waits for the match, and are ready for the program from then
on. Whether publishers live it judges by real time as well: of a subscription with a lease, the grader tells instead.
All other events are left to the middleware.
"""

from __future__ import annotations

import contextlib
import functools
import weakref
from collections.abc import Iterator
from typing import Any

from rclpy.event_handler import QoSPublisherEventType, QoSSubscriptionEventType
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

#: The events that discovery causes: of counterparts that were matched or have gone, of those whose QoS does not fit,
#: and of publishers that live or do not. They are kept by their type, because the numbers of the two types overlap.
MATCHED, REFUSED, ALIVE = range(3)
KINDS = {
    QoSPublisherEventType: {
        QoSPublisherEventType.RCL_PUBLISHER_MATCHED: MATCHED,
        QoSPublisherEventType.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS: REFUSED,
    },
    QoSSubscriptionEventType: {
        QoSSubscriptionEventType.RCL_SUBSCRIPTION_MATCHED: MATCHED,
        QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS: REFUSED,
        QoSSubscriptionEventType.RCL_SUBSCRIPTION_LIVELINESS_CHANGED: ALIVE,
    },
}
#: What an event says has changed since the last one; its other numbers count from the beginning.
CHANGES = ("total_count_change", "current_count_change")
_TAKE = _rclpy.EventHandle.take_event


class Events:
    """The events of one process that discovery causes, from the middleware to the program.

    Every key is a handle of rclpy: of an endpoint, or of one of its kinds of events.
    """

    def __init__(self) -> None:
        self._of: weakref.WeakKeyDictionary[Any, list[weakref.ref[Any]]] = weakref.WeakKeyDictionary()
        self._kinds: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()
        self._last: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()
        self._new: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()
        self._told: weakref.WeakKeyDictionary[Any, list[Any]] = weakref.WeakKeyDictionary()
        self._lives: weakref.WeakKeyDictionary[Any, tuple[int, int]] = weakref.WeakKeyDictionary()

    def install(self, left_alone: frozenset[str]) -> None:
        """Keep the events of all endpoints that are created from now on, except of those on some topics."""
        make = _rclpy.EventHandle.__init__

        @functools.wraps(make)
        def made(handle: Any, endpoint: Any, kind: Any) -> None:
            make(handle, endpoint, kind)
            known = KINDS.get(type(kind), {}).get(kind)
            if known is not None and endpoint.get_topic_name() not in left_alone:
                self._of.setdefault(endpoint, []).append(weakref.ref(handle))
                self._kinds[handle] = known

        @functools.wraps(_TAKE)
        def taken(handle: Any) -> Any:
            if not self.keeps(handle):
                return _TAKE(handle)
            told = self._told.get(handle)
            return told.pop(0) if told else None

        _rclpy.EventHandle.__init__ = made
        _rclpy.EventHandle.take_event = taken

    def leave_alone(self, endpoint: Any, *kinds: int) -> None:
        """Leave the events of an endpoint, or those of some kinds, to the middleware: the grader does not know them."""
        for handle in list(self._handles(endpoint)):
            if not kinds or self._kinds[handle] in kinds:
                self._kinds.pop(handle, None)

    def keeps(self, handle: Any) -> bool:
        """Return whether a handle is of an event that is kept here."""
        return handle in self._kinds

    def has(self, endpoint: Any, kind: int) -> bool:
        """Return whether the program waits for the events of a kind of an endpoint, and they are kept here."""
        return any(self._kinds[handle] == kind for handle in self._handles(endpoint))

    def is_ready(self, handle: Any) -> bool:
        """Return whether the program may take an event that is kept here."""
        return bool(self._told.get(handle))

    def _handles(self, endpoint: Any) -> Iterator[Any]:
        for reference in self._of.get(endpoint, ()):
            handle = reference()
            if handle is not None and self.keeps(handle):
                yield handle

    def has_all(self, endpoint: Any, *, matches: int | None, refused: int) -> bool:
        """Take what has happened to an endpoint; return whether that is all that the grader knows of.

        Args:
            endpoint: Its handle.
            matches: How many counterparts it is matched with; None if that is not known.
            refused: How many counterparts there have been whose QoS does not fit.
        """
        known = [self._has(handle, matches, refused) for handle in self._handles(endpoint)]  # each is taken
        return all(known)

    def _has(self, handle: Any, matches: int | None, refused: int) -> bool:
        if self._kinds[handle] == ALIVE:
            return True
        self._take(handle)
        last = self._last.get(handle)
        if self._kinds[handle] == MATCHED:
            return matches is None or matches == (0 if last is None else last.current_count)
        return refused <= (0 if last is None else last.total_count)

    def _take(self, handle: Any) -> None:
        """Take an event from the middleware, if there is one, and add it to what the program does not know yet."""
        with contextlib.suppress(_rclpy.InvalidHandle, _rclpy.RCLError), handle:
            status = _TAKE(handle)
            if status is None or not any(getattr(status, name, 0) for name in CHANGES):
                return
            self._last[handle] = status
            earlier = self._new.get(handle)
            self._new[handle] = status if earlier is None else _sum(earlier, status)

    def live(self, endpoint: Any, alive: int, silent: int) -> None:
        """Let the program take how many publishers of a subscription live, and how many do not, if that has changed."""
        for handle in self._handles(endpoint):
            before = self._lives.get(handle, (0, 0))
            if self._kinds[handle] == ALIVE and before != (alive, silent):
                self._lives[handle] = alive, silent
                numbers = {"alive_count": alive, "not_alive_count": silent}
                changes = {"alive_count_change": alive - before[0], "not_alive_count_change": silent - before[1]}
                self._told.setdefault(handle, []).append(
                    _made(_rclpy.rmw_liveliness_changed_status_t, numbers | changes)
                )

    def tell(self) -> None:
        """Let the program take what has happened, as one event of each kind and endpoint."""
        for handle, status in list(self._new.items()):
            self._told.setdefault(handle, []).append(status)
        self._new.clear()


def _sum(earlier: Any, later: Any) -> Any:
    """Return one event for two, whose changes are added up; rclpy has no way to make one with other numbers."""
    kind = type(later)
    changes = {name: getattr(earlier, name) + getattr(later, name) for name in CHANGES if hasattr(later, name)}
    numbers = {name: getattr(later, name) for name in vars(kind) if not name.startswith("_")}
    return _made(kind, numbers | changes)


def _made(kind: Any, numbers: dict[str, Any]) -> Any:
    """Return an event of a kind with some numbers; those of rclpy cannot be set."""
    return type(kind.__name__, (kind,), numbers)()
