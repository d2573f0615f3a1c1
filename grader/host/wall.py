"""Runs a student's program on the real clock: nothing is replaced, but no first message is lost."""

from __future__ import annotations

import functools
import os
import signal
from typing import Any

import rclpy.publisher

from . import originals, ros
from .ledger import BACKGROUND
from .link import Link

#: How long, in real time, a new publisher waits for its first subscription before its first message.
MATCH_S = 2.0


class WallTime:
    """The real clock, as the program finds it.

    Args:
        link: The line to the grader.
    """

    def __init__(self, link: Link) -> None:
        self._link = link

    def install_ros(self) -> None:
        """Let every publisher find a subscription before its first message; in a running system it would have one."""
        publish = rclpy.publisher.Publisher.publish
        matched = set()

        @functools.wraps(publish)
        def publish_when_matched(self: Any, msg: Any) -> Any:
            if id(self) not in matched and self.topic_name not in BACKGROUND:
                deadline = originals.perf_counter() + MATCH_S
                while self.get_subscription_count() == 0 and originals.perf_counter() < deadline:
                    originals.sleep(0.001)
                matched.add(id(self))
            return publish(self, msg)

        rclpy.publisher.Publisher.publish = publish_when_matched
        ros.note_nodes()

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
