"""Runs a student's program on the real clock: nothing is replaced, but no first message is lost."""

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
#: How long, in real time, what a publisher has sent may take to arrive before the publisher goes.
ACKNOWLEDGED_S = 0.5


class WallTime:
    """The real clock, as the program finds it.

    Args:
        link: The line to the grader.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._publishing: weakref.WeakSet[Any] = weakref.WeakSet()
        self._patience: Any = None

    def install_ros(self) -> None:
        """Let every publisher find a subscription before its first message; in a running system it would have one."""
        import rclpy.publisher
        from rclpy.duration import Duration

        from . import ros
        from .ledger import BACKGROUND

        publish, destroy = rclpy.publisher.Publisher.publish, rclpy.publisher.Publisher.destroy
        matched = self._publishing
        self._patience = Duration(seconds=ACKNOWLEDGED_S)
        domain = int(os.environ.get("ROS_DOMAIN_ID", "0"))

        @functools.wraps(publish)
        def publish_when_matched(self: Any, msg: Any) -> Any:
            if self not in matched and self.topic_name not in BACKGROUND:
                # In another domain nobody listens: waiting there would hold up the rest of the program.
                deadline = originals.perf_counter() + (
                    MATCH_S if _domain_of(self, ros.MADE_NODES, domain) == domain else 0.0
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
        """Let what was published arrive before its publisher goes, which would take it along otherwise."""
        for publisher in list(self._publishing):
            with contextlib.suppress(Exception):  # it has been destroyed, or its context has been shut down
                publisher.wait_for_all_acked(self._patience)

    def finish(self) -> None:
        """Nothing depends on what is freed at the end."""

    def end(self) -> bool:
        """Let what was published arrive; the process leaves the graph with its end."""
        self._leave()
        return False

    def start(self, now_ns: int) -> None:
        """Begin; the time is whatever it is, and the grader's next word is to stop."""
        del now_ns
        originals.start_new_thread(self._await_stop, ())

    def _await_stop(self) -> None:
        self._link.next_answer()
        originals.kill(os.getpid(), signal.SIGINT)

    def summary(self) -> dict[str, Any]:
        """Return what the last report carries."""
        return {}


def _domain_of(publisher: Any, made: list[weakref.ref[Any]], usual: int) -> int:
    """Return the ROS domain of the node that a publisher belongs to; the usual one if that cannot be found out."""
    with contextlib.suppress(Exception):  # a node that is being destroyed, or a context that is being shut down
        nodes = [node for reference in made if (node := reference()) is not None]
        owner = next(node for node in nodes if any(publisher is own for own in node.publishers))
        return int(owner.context.get_domain_id())
    return usual
