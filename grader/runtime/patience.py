"""Time-outs that adapt to the load of the machine, and get short once much has been lost."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Protocol

from grader.runtime.host.originals import wait_until

#: How long to wait for an endpoint or a message that was announced.
SETTLE_S = 5.0
#: On a busy machine, time-outs are multiplied by the load per processor, up to this factor.
MOST_BUSY = 4.0
#: After this many time-outs, further waits are brief; after `MOST_LOSSES`, nothing is waited for again.
LOSSES, BRIEF_S, MOST_LOSSES = 3, 0.05, 20


def load_per_processor() -> float:
    """Return the load average per processor, from 1 to `MOST_BUSY`; 1 if the system does not provide it."""
    try:
        return min(MOST_BUSY, max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1)))
    except OSError:
        return 1.0


class Wait(Protocol):
    """Waits until a condition holds, but no longer than some seconds; returns whether it did: see `wait_until`."""

    def __call__(self, condition: Callable[[], bool], seconds: float, *, pause_s: float) -> bool:
        """Wait, and look at the condition again after each pause."""
        ...


class Patience:
    """The time-out of one recording, which gets short after repeated losses.

    Args:
        full_s: Time-out of the first waits, on an idle machine.
        wait: How to wait.
    """

    def __init__(self, full_s: float = SETTLE_S, wait: Wait = wait_until) -> None:
        self._full_s = full_s * load_per_processor()
        self._wait = wait
        self._losses = 0

    @property
    def wait_s(self) -> float:
        """Time-out of the next wait, in seconds."""
        return self._full_s if self._losses < LOSSES else BRIEF_S

    @property
    def is_left(self) -> bool:
        """Whether it is worth waiting again for something that did not come."""
        return self._losses < MOST_LOSSES

    @property
    def has_lost(self) -> bool:
        """Whether any wait timed out."""
        return self._losses > 0

    def wait(self, condition: Callable[[], bool], *, pause_s: float = 0.00015) -> bool:
        """Wait until a condition holds; return whether it did before the time-out."""
        came = self._wait(condition, self.wait_s, pause_s=pause_s)
        if not came:
            self.lose()
        return came

    def lose(self) -> None:
        """Count one wait that timed out."""
        self._losses += 1
