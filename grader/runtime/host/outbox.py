"""What this process has sent since its last report, and what of it may not have arrived yet."""

from __future__ import annotations

import weakref
from collections import Counter
from typing import Any

from .qos import is_latched

#: After so many messages in a row, the next one waits until they have arrived, so that no queue overflows.
MESSAGES_PER_FLUSH = 8
#: A publisher that was created before so much work has been discovered, although virtual time stands still: where other
#: nodes run already, this takes some milliseconds.
DISCOVERED_NS = 200_000_000


class Outbox:
    """The messages that this process has sent.

    The counts only tell the grader when an instant is settled; no verdict depends on them.
    """

    def __init__(self) -> None:
        #: How many messages were sent since the last report, by channel, such as `topic /x`.
        self.sent: Counter[str] = Counter()
        #: How many of them were sent before anybody could have discovered their publisher.
        self.early: Counter[str] = Counter()
        #: For each publisher that was created since the program last waited, how much it had worked then.
        self._fresh: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()
        #: How many messages were sent since `must_settle` last said so.
        self._in_a_row = 0
        #: Handles that have sent messages which may not have arrived yet. The middleware drops what a destroyed
        #: publisher has not delivered, so they are kept alive until then.
        self._sending: dict[int, Any] = {}

    def note_created(self, publisher: Any, work_ns: int) -> None:
        """Note a new publisher, unless who discovers it later gets its messages as well."""
        if not is_latched(publisher):
            self._fresh[publisher.handle] = work_ns

    def note_waited(self) -> None:
        """Note that the program waits, or knows of the graph: whoever is there has discovered its publishers."""
        self._fresh.clear()

    def must_settle(self, *, changed: bool) -> bool:
        """Count a message that is about to be sent, and return whether the grader has to know something before it.

        Args:
            changed: Whether endpoints have changed: it has to match a new publisher before that one's first message.
        """
        self._in_a_row += 1
        if not changed and self._in_a_row < MESSAGES_PER_FLUSH:
            return False
        self._in_a_row = 0
        return True

    def note_sent(self, channel: str, handle: Any, work_ns: int) -> None:
        """Count one message, and keep its sender alive until the message has arrived.

        Args:
            channel: Where it is sent.
            handle: The handle of its sender.
            work_ns: How much processor time the program has used so far.
        """
        self.sent[channel] += 1
        if handle in self._fresh and work_ns - self._fresh[handle] < DISCOVERED_NS:
            self.early[channel] += 1
        self._sending[id(handle)] = handle

    @property
    def sending(self) -> bool:
        """Whether a sent message may not have arrived yet."""
        return bool(self._sending)

    def settled(self) -> None:
        """Note that everything sent has arrived."""
        self._sending.clear()
