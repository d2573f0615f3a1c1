"""Runs a student's program on the real clock: no clock is replaced, but first and last messages are not lost."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import weakref
from typing import Any

from . import originals
from .link import Link

#: How long, in real time, a new publisher waits for its first subscription before its first message.
MATCH_S = 2.0
#: How long, in real time, to wait until a publisher's messages have arrived before it is destroyed.
ACKNOWLEDGED_S = 0.5


class WallTime:
    """The real clock, with the same interface as `VirtualTime`.

    Args:
        link: The connection to the grader.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._publishing: weakref.WeakSet[Any] = weakref.WeakSet()
        self._patience: Any = None
        self.domain = 0

    def install_ros(self) -> None:
        """Make every publisher wait for a subscription before its first message, as if it joined a running system."""
        import rclpy.publisher
        from rclpy.duration import Duration

        from . import ros
        from .ledger import BACKGROUND

        publish, destroy = rclpy.publisher.Publisher.publish, rclpy.publisher.Publisher.destroy
        matched, time = self._publishing, self
        self._patience = Duration(seconds=ACKNOWLEDGED_S)

        @functools.wraps(publish)
        def publish_when_matched(self: Any, msg: Any) -> Any:
            if self not in matched and self.topic_name not in BACKGROUND:
                # In another domain there are no subscriptions: waiting would only delay the program.
                deadline = originals.perf_counter() + (
                    MATCH_S if _domain_of(self, ros.MADE_NODES, time.domain) == time.domain else 0.0
                )
                while self.get_subscription_count() == 0 and originals.perf_counter() < deadline:
                    originals.sleep(0.001)
                matched.add(self)
            return publish(self, msg)

        @functools.wraps(destroy)
        def destroy_when_heard(publisher: Any) -> None:
            self._leave()
            destroy(publisher)

        rclpy.publisher.Publisher.publish = publish_when_matched
        rclpy.publisher.Publisher.destroy = destroy_when_heard
        ros.note_nodes()
        ros.install_departures(self._leave)

    def _leave(self) -> None:
        """Wait until published messages have arrived, since they are lost when their publisher is destroyed."""
        for publisher in list(self._publishing):
            with contextlib.suppress(Exception):  # it has been destroyed, or its context has been shut down
                publisher.wait_for_all_acked(self._patience)

    def finish(self) -> None:
        """Wait until published messages have arrived, before the publishers are freed with the student's modules."""
        self._leave()

    def end(self) -> bool:
        """Wait until published messages have arrived; the process leaves the graph when it ends."""
        self._leave()
        return False

    def start(self, now_ns: int) -> None:
        """Start waiting for the grader's next answer, which is the request to stop."""
        del now_ns
        self.domain = int(os.environ.get("ROS_DOMAIN_ID", "0"))
        originals.start_new_thread(self._await_stop, ())

    def _await_stop(self) -> None:
        self._link.next_answer()
        originals.kill(os.getpid(), signal.SIGINT)

    def summary(self) -> dict[str, Any]:
        """Return the additional fields of the last report: none."""
        return {}


def _domain_of(publisher: Any, made: list[weakref.ref[Any]], usual: int) -> int:
    """Return the ROS domain of a publisher's node; the usual domain if that cannot be determined."""
    with contextlib.suppress(Exception):  # the node may be being destroyed, or its context shut down
        nodes = [node for reference in made if (node := reference()) is not None]
        owner = next(node for node in nodes if any(publisher is own for own in node.publishers))
        return int(owner.context.get_domain_id())
    return usual
