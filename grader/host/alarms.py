"""Gives virtual time up for programs that have the system send them signals after a while.

An alarm rings in real time, of which a virtual second has only a small part.
"""

import signal
from collections.abc import Callable
from typing import Any


def install_alarms(give_up: Callable[[], None]) -> None:
    """Call `give_up` before a real-time alarm is set; clearing one, or timing the processor, does no harm."""
    setitimer, alarm = signal.setitimer, signal.alarm

    def guarded_setitimer(which: int, seconds: float, interval: float = 0.0, /) -> Any:
        if which == signal.ITIMER_REAL and seconds > 0:
            give_up()
        return setitimer(which, seconds, interval)

    def guarded_alarm(seconds: int, /) -> int:
        if seconds > 0:
            give_up()
        return alarm(seconds)

    signal.setitimer, signal.alarm = guarded_setitimer, guarded_alarm
