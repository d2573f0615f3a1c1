"""Draws what happens to the messages of a topic on their way to programs: some are lost, and the rest arrive late."""

from __future__ import annotations

import random

from grader.runtime.plan import PlannedConnection


class Transit:
    """The way of the messages of a topic; none overtakes another.

    Attributes:
        over_ns: When all messages that were sent so far have arrived, and their publisher may leave: one that left at
            the instant of a message would take it along.
    """

    def __init__(self, connection: PlannedConnection) -> None:
        self._connection = connection
        self._draw = random.Random(connection.seed)  # noqa: S311 - it has to repeat
        self.over_ns = 0

    def arrives_ns(self, sent_ns: int) -> int | None:
        """Draw when the next message arrives; None if it is lost."""
        least_ns, most_ns = self._connection.delay_ns
        # two draws for each message, so that the same ones are lost whatever the delay
        share, delay_ns = self._draw.random(), least_ns + round((most_ns - least_ns) * self._draw.random())
        if share < self._connection.lose:
            return None
        arrives_ns = max(self.over_ns - 1, sent_ns + delay_ns)
        self.over_ns = arrives_ns + 1
        return arrives_ns
