"""Runs a student's program on the real clock: no clock is replaced, but first and last messages are not lost."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import weakref
from collections.abc import Callable
from typing import Any

from . import originals
from .link import Link

#: How long, in real time, a new publisher waits for its first subscription before its first message.
MATCH_S = 2.0
#: How long, in real time, to wait until what was sent has arrived before its sender is destroyed.
ACKNOWLEDGED_S = 0.5
#: How long the other side may take to pass on a request or a response that it has read: nothing tells when it has.
TAKEN_S = 0.03


class WallTime:
    """The real clock, with the same interface as `VirtualTime`.

    Args:
        link: The connection to the grader.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._publishing: weakref.WeakSet[Any] = weakref.WeakSet()
        self._patience: Any = None
        self._exchanged = False
        self.domain = 0

    def install_ros(self) -> None:
        """Make every publisher wait for a subscription before its first message, as if it joined a running system."""
        import rclpy.client
        import rclpy.publisher
        import rclpy.service
        from rclpy.duration import Duration

        from . import ros
        from .ledger import BACKGROUND, is_in

        publish = rclpy.publisher.Publisher.publish
        matched, time = self._publishing, self
        self._patience = Duration(seconds=ACKNOWLEDGED_S)

        @functools.wraps(publish)
        def publish_when_matched(self: Any, msg: Any) -> Any:
            if self not in matched and self.topic_name not in BACKGROUND:
                # In another domain there are no subscriptions: waiting would only delay the program.
                owner = _owner_of(self, ros.MADE_NODES)
                if owner is None or is_in(time.domain, owner):
                    originals.wait_until(self.get_subscription_count, MATCH_S, pause_s=0.001)
                matched.add(self)
            return publish(self, msg)

        def when_heard(destroy: Callable[..., None]) -> Callable[..., None]:
            @functools.wraps(destroy)
            def destroy_when_heard(sender: Any) -> None:
                self._leave()
                destroy(sender)

            return destroy_when_heard

        def noting(send: Callable[..., Any]) -> Callable[..., Any]:
            @functools.wraps(send)
            def noted(*args: Any, **kwargs: Any) -> Any:
                self._exchanged = True
                return send(*args, **kwargs)

            return noted

        rclpy.publisher.Publisher.publish = publish_when_matched
        for sender in (rclpy.publisher.Publisher, rclpy.client.Client, rclpy.service.Service):
            sender.destroy = when_heard(sender.destroy)
        rclpy.client.Client.call_async = noting(rclpy.client.Client.call_async)
        rclpy.service.Service.send_response = noting(rclpy.service.Service.send_response)
        ros.note_nodes()
        ros.note_other_domains(lambda: self.domain, lambda note: self._link.send({"kind": "note", **note}))
        ros.install_departures(self._leave)

    def _leave(self) -> None:
        """Wait until published messages have arrived, since they are lost when their publisher is destroyed."""
        for publisher in list(self._publishing):
            with contextlib.suppress(Exception):  # it has been destroyed, or its context has been shut down
                publisher.wait_for_all_acked(self._patience)
        if self._exchanged:
            self._exchanged = False
            originals.wait_until(lambda: not originals.unread_bytes(), ACKNOWLEDGED_S)
            originals.sleep(TAKEN_S)

    def finish(self) -> None:
        """Wait until published messages have arrived, before the publishers are freed with the student's modules."""
        self._leave()

    def end(self) -> bool:
        """Wait until published messages have arrived; the process leaves the graph when it ends."""
        self._leave()
        return False

    def start(self, now_ns: int, steady_ns: int) -> None:
        """Start waiting for the grader's next answer, which is the request to stop."""
        del now_ns, steady_ns
        self.domain = int(os.environ.get("ROS_DOMAIN_ID", "0"))
        originals.start_new_thread(self._await_stop, ())

    def _await_stop(self) -> None:
        self._link.next_answer()
        originals.kill(os.getpid(), signal.SIGINT)

    def summary(self) -> dict[str, Any]:
        """Return the additional fields of the last report: none."""
        return {}


def _owner_of(publisher: Any, made: list[weakref.ref[Any]]) -> Any:
    """Return the node of a publisher; None if that cannot be determined."""
    with contextlib.suppress(Exception):  # a node may be being destroyed
        nodes = [node for reference in made if (node := reference()) is not None]
        return next(node for node in nodes if any(publisher is own for own in node.publishers))
    return None
