"""What is on its way to this process, and the messages that were taken before the program asks for them."""

from __future__ import annotations

import weakref
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from . import originals
from .action_ends import Receiver
from .endpoints import Endpoints, is_background, is_valid, service_name

#: How long, in real time, to wait for an announced message before it counts as lost.
ARRIVAL_S = 1.0
#: When nothing more has come for so long, in real time, the newest of several messages has arrived: the middleware
#: delivers them some microseconds apart.
QUIET_S = 0.01
#: How long one wait of rclpy for such a message takes at most.
ONE_WAIT_NS = 10_000_000
#: The wait set of rclpy, which waits in real time: `wait_set` replaces it for programs, not for the host.
REAL_WAIT_SET: Any = _rclpy.WaitSet


def await_ready(receiver: Any, context: Any, within_s: float = ARRIVAL_S) -> bool:
    """Wait, in real time, until one message can be taken from a receiver."""
    if isinstance(receiver, Receiver):
        return receiver.is_ready_within(within_s, REAL_WAIT_SET, context)
    kind = (
        "subscription"
        if hasattr(receiver, "topic_name")
        else "client"
        if hasattr(receiver, "call_async")
        else "service"
    )
    with context.handle, receiver.handle:
        wait_set = REAL_WAIT_SET(kind == "subscription", 0, 0, kind == "client", kind == "service", 0, context.handle)

        def is_ready() -> bool:
            wait_set.clear_entities()
            getattr(wait_set, f"add_{kind}")(receiver.handle)
            wait_set.wait(ONE_WAIT_NS)
            return receiver.handle.pointer in wait_set.get_ready_entities(kind)

        return originals.wait_until(is_ready, within_s, pause_s=0)


class Inbox:
    """The messages that the grader has announced to this process, and that it has not taken yet.

    Args:
        endpoints: Who receives them.
        await_ready: Waits for a message; see `await_ready`.
        pause: Lets some seconds of real time pass.
    """

    def __init__(
        self,
        endpoints: Endpoints,
        await_ready: Callable[..., bool] = await_ready,
        pause: Callable[[float], None] = originals.sleep,
    ) -> None:
        self._endpoints = endpoints
        self._await_ready = await_ready
        self._pause = pause
        self._expected: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()
        self._kept: weakref.WeakKeyDictionary[Any, deque[Any]] = weakref.WeakKeyDictionary()
        #: The messages of each subscription that are still on their way in virtual time, because they are late.
        self._held: weakref.WeakKeyDictionary[Any, deque[Any]] = weakref.WeakKeyDictionary()
        #: How many announced messages have not come, by topic or service.
        self.lost: Counter[str] = Counter()
        #: How many wait sets wait for a receiver now, by the address of its handle: its messages are read at once.
        self.awaited: Counter[int] = Counter()
        self._heard_on: set[str] = set()
        self._successors: weakref.WeakSet[Any] = weakref.WeakSet()
        #: The services that every node has, as long as nobody has called them: waiting for them would take a third of
        #: an executor's time. How many are waited for by now; a wait set that was made before lacks the latest.
        self._left_out: weakref.WeakSet[Any] = weakref.WeakSet()
        self.included = 0

    def add(self, kind: str, endpoint: Any) -> None:
        """Note a new endpoint."""
        if kind == "subscription":
            if endpoint.topic_name in self._heard_on:
                self._successors.add(endpoint)
            self._heard_on.add(endpoint.topic_name)
        if kind == "service" and is_background(endpoint):
            endpoint._executor_event = True  # executors leave it out, until a request is announced
            self._left_out.add(endpoint)

    def _include(self, receiver: Any) -> None:
        """Let executors wait for a service that they have left out so far."""
        if receiver in self._left_out:
            self._left_out.remove(receiver)
            receiver._executor_event = False
            self.included += 1

    def forget(self, receiver: Any) -> None:
        """Discard the expected messages of a receiver that is being destroyed, or was freed."""
        self._expected.pop(receiver, None)
        self._kept.pop(receiver, None)
        self._held.pop(receiver, None)

    def expect(self, arrivals: Mapping[str, int]) -> None:
        """Add messages that the grader has announced, and wait until they have arrived."""
        overflows = False
        for channel, count in arrivals.items():
            for receiver in self._endpoints.receivers(channel):
                of_action = isinstance(receiver, Receiver)
                if not of_action:
                    self._include(receiver)
                depth = receiver.depth if of_action else _depth(receiver)
                before = self._expected.get(receiver, 0)
                if of_action or not channel.startswith("topic "):
                    # What the queue has dropped never comes. Of a status only the last counts.
                    self._expected[receiver] = min(before + count, depth)
                    overflows |= before + count > depth > 1
                    continue
                expected = before + min(count, depth)
                self._expected[receiver] = expected
                # If older messages were left unread, readiness does not show that the newest has arrived.
                unread = expected > 1 or depth == 1 or self.kept(receiver)
                if unread and not self.awaited[receiver.handle.pointer]:
                    self._keep_all(receiver, more=before + count > depth)
        self.await_arrivals(list(self._expected))
        if overflows:
            self._pause(QUIET_S)  # or which requests are dropped would depend on when the newest arrive

    def _keep_all(self, subscription: Any, *, more: bool) -> None:
        """Take all expected messages of a subscription that no wait set reads, and keep as many as its queue holds.

        Args:
            subscription: The subscription.
            more: Whether more were sent than its queue holds. How many of them the middleware has dropped cannot be
                known, so an older one may be there while the newest is still on its way: none may come for a while.
        """
        kept = self._kept.setdefault(subscription, deque(maxlen=_depth(subscription)))

        def take() -> None:
            found = taken_from(subscription)
            if found is not None:
                kept.append(found)

        while self._expected.get(subscription, 0) > 0 and self.await_arrivals([subscription]):
            take()
            self._expected[subscription] -= 1
        context = self._endpoints.context() if more else None
        while context is not None and is_valid(subscription) and self._await_ready(subscription, context, QUIET_S):
            take()

    def kept(self, subscription: Any) -> deque[Any]:
        """Return the messages that were taken for a subscription ahead of time, oldest first."""
        return self._kept.get(subscription) or deque()

    def took(self, receiver: Any) -> None:
        """Note that one message was taken from a subscription, client or service."""
        # negative if a message is taken before it was announced, as a node's own messages are
        self._expected[receiver] = self._expected.get(receiver, 0) - 1

    def await_arrivals(self, receivers: list[Any]) -> bool:
        """Wait, in real time, until everything expected by some receivers can be taken; return whether any can be."""
        arrived = False
        context = self._endpoints.context()
        for receiver in receivers:
            if self._expected.get(receiver, 0) <= 0 or not is_valid(receiver) or context is None:
                continue
            if self._await_ready(receiver, context):
                arrived = True
            else:
                # a subscription that replaced another may have missed messages in between, as in any ROS system
                if receiver not in self._successors:
                    self.lost[channel_name(receiver)] += self._expected[receiver]
                self._expected[receiver] = 0
        return arrived

    def hold(self, held: Mapping[str, Sequence[bool]]) -> None:
        """Take messages, which other processes have just sent, before any executor finds them.

        Args:
            held: By channel of a topic, for each message whether it is kept until it is let go; the others are lost.
        """
        context = self._endpoints.context()
        for channel, flags in held.items():
            for subscription in self._endpoints.receivers(channel):
                if self._expected.get(subscription, 0) > 0:
                    self._keep_all(subscription, more=False)  # what came before stays before
                waiting = self._held.setdefault(subscription, deque())
                for is_kept in flags[-_depth(subscription) :]:  # what the queue has dropped never comes
                    if context is None or not self._await_ready(subscription, context):
                        self.lost[channel_name(subscription)] += 1
                        continue
                    found = taken_from(subscription)
                    if found is not None and is_kept:
                        waiting.append(found)

    def let_go(self, released: Mapping[str, int]) -> None:
        """Let executors find messages that are held, so many of each channel."""
        for channel, count in released.items():
            for subscription in self._endpoints.receivers(channel):
                waiting = self._held.get(subscription) or deque()
                kept = self._kept.setdefault(subscription, deque(maxlen=_depth(subscription)))
                kept.extend(waiting.popleft() for _ in range(min(count, len(waiting))))

    def keeps_anything(self) -> bool:
        """Return whether any message was taken ahead of time and is still kept."""
        return len(self._kept) > 0 and any(self._kept.values())

    def expects_anything(self) -> bool:
        """Return whether any message is expected."""
        return len(self._expected) > 0 and any(count > 0 for count in self._expected.values())


def channel_name(receiver: Any) -> str:
    """Return the name of the topic or service of a subscription, a client or a server."""
    return str(receiver.topic_name) if hasattr(receiver, "topic_name") else service_name(receiver)


def taken_from(subscription: Any) -> Any:
    """Take the next message of a subscription with its information; None if there is none."""
    with subscription.handle:
        return subscription.handle.take_message(subscription.msg_type, subscription.raw)


def _depth(receiver: Any) -> int:
    depth = getattr(receiver.qos_profile, "depth", 1)
    return max(1, int(depth))
