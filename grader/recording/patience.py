"""How long, in real time, is waited for what a process has announced: a few times in full, then only briefly.

What an honest process announces comes, but for rare losses. One that announces what never comes would cost the full
wait each time.
"""

from __future__ import annotations

import os
from collections.abc import Callable

from grader.recording.observer import wait_until

#: How long an endpoint or a message that was announced is waited for.
SETTLE_S = 5.0
#: On a busy machine, so many times as long as there are processes that want each processor, up to this.
MOST_BUSY = 4.0
#: After so many that never came, later ones are waited for only briefly.
LOSSES, BRIEF_S = 3, 0.05


def load_per_processor() -> float:
    """Return how many processes want each processor, from 1 to `MOST_BUSY`; 1 if the system does not say."""
    try:
        return min(MOST_BUSY, max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1)))
    except OSError:
        return 1.0


class Patience:
    """The patience of one recording.

    Args:
        full_s: How long a wait may take at first, on a quiet machine.
    """

    def __init__(self, full_s: float = SETTLE_S) -> None:
        self._full_s = full_s * load_per_processor()
        self._losses = 0

    @property
    def wait_s(self) -> float:
        """How long the next wait may take."""
        return self._full_s if self._losses < LOSSES else BRIEF_S

    def wait(self, condition: Callable[[], bool], *, pause_s: float = 0.0003) -> bool:
        """Wait until a condition holds; return whether it came to."""
        came = wait_until(condition, self.wait_s, pause_s=pause_s)
        if not came:
            self.lose()
        return came

    def lose(self) -> None:
        """Note that something was waited for in vain."""
        self._losses += 1
