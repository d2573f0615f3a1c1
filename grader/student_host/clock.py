"""The virtual clock: what time it is, and when a program that only looks at the clock has to let time pass."""

from collections.abc import Callable

#: Virtual time starts at 2026-01-01 00:00:00 UTC.
EPOCH_NS = 1_767_225_600_000_000_000

#: A program that never blocks is let go on by this much, each time it has shown that it only waits for time to pass.
STEP_NS = 500_000
#: The same for a program that does not even look at the clock, and only waits for something to happen.
LONG_STEP_NS = 10_000_000
#: So many looks at the clock, or fruitless polls, at one instant show it; fewer once it has been seen to do so.
LOOKS = 200
LOOKS_WHILE_SPINNING = 4
#: A pause of a program that looks at clocks ends by this much late, as it does on any machine. If it ended to the very
#: nanosecond, `now - last > period` would hold one pause later than its author ever saw, or by chance of rounding.
LATE_NS = 1_000
#: So many messages sent at one instant show that a program does not pace itself at all.
MESSAGES_AT_ONCE = 200


class VirtualClock:
    """The time of one process; moves only when the grader says so."""

    def __init__(self) -> None:
        self.now_ns = EPOCH_NS
        self._looks = 0
        self._allowed = LOOKS
        self._yielding = False
        self._sent = 0
        self._looked_at = False
        self._was_looked_at = False
        self._seen_ns = 0
        #: Whether a pause, or a timer's period, has begun at this moment: work before it puts off what comes after it.
        self.counted = False
        self.let_time_pass: Callable[[int], None] = lambda until_ns: None

    def move_to(self, now_ns: int) -> None:
        """Set the time; it never goes back."""
        if now_ns > self.now_ns:
            self.now_ns, self._sent = now_ns, 0
            if not self._yielding:
                self.busy()  # looks between two pauses are no busy loop, however many pauses there are

    def end_of(self, pause_ns: int) -> int:
        """Return when a pause that begins now ends."""
        if pause_ns > 0:
            self.count_pause()
        return self.now_ns + pause_ns + (LATE_NS if self._was_looked_at and pause_ns > 0 else 0)

    def count_pause(self) -> None:
        """Note that a pause begins; who has just looked at a clock may sleep until a deadline, whatever the work."""
        self.counted |= self._seen_ns != self.now_ns

    def look(self, *, by_library: bool = False) -> int:
        """Return the time to a program that asks for it, letting time pass if it does nothing else."""
        self._looked_at = True
        if not by_library:
            self._was_looked_at, self._seen_ns = True, self.now_ns
        self.idle_look()
        return self.now_ns

    def idle_look(self, weight: int = 1) -> None:
        """Count one look at something that only time can change."""
        self._looks += weight
        if self._looks > self._allowed and not self._yielding:
            self._looks, self._allowed = 0, LOOKS_WHILE_SPINNING
            self._yield()

    def _yield(self) -> None:
        self._yielding = True
        try:
            self.let_time_pass(self.now_ns + (STEP_NS if self._looked_at else LONG_STEP_NS))
        finally:
            self._yielding = self._looked_at = False

    def busy(self) -> None:
        """Note that the program did something else than wait."""
        self._looks, self._allowed = 0, LOOKS

    def busy_sending(self) -> None:
        """Note that the program sends a message, letting time pass if it sends without end at one instant."""
        self.busy()
        self._sent += 1
        if self._sent >= MESSAGES_AT_ONCE and not self._yielding:
            self._sent = 0
            self._yield()
