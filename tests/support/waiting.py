"""Waits for what another process or thread does."""

from __future__ import annotations

import time
from collections.abc import Callable

#: Between two looks, in seconds.
PAUSE_S = 0.005


def wait_for(condition: Callable[[], object], seconds: float = 60) -> None:
    """Wait until a condition holds; fail if it never does."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it never came to that"
        time.sleep(PAUSE_S)
