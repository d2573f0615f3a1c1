"""The virtual clock: the current time, and the rules by which time passes for a program that never blocks."""

from bisect import bisect_left
from collections import deque
from collections.abc import Callable

#: The first moment at which virtual time may start, 2026-11-01 00:00:00 UTC, and how much later it may: a plan draws
#: the moment from the year after the release of the grader, so that no date shows that time is virtual, and a file gets
#: the same report on every day. Each release sets it to the first day of its month.
EPOCH_NS, EPOCH_SPAN_S = 1_793_491_200_000_000_000, 365 * 24 * 60 * 60
#: What monotonic clocks show when virtual time starts, at least, and how much more: a machine that has run for a while.
UPTIME_NS, UPTIME_SPAN_S = 1_000_000_000_000, 20 * 24 * 60 * 60

#: How far time advances for a program that never blocks, each time it shows that it only waits for time to pass.
STEP_NS = 500_000
#: The same for a program that does not look at the clock, and only waits for something to happen.
LONG_STEP_NS = 10_000_000
#: The number of looks at the clock, or of polls without a result, at one instant that shows this; and the smaller
#: number for a program that has just done so.
LOOKS = 200
LOOKS_WHILE_SPINNING = 4
#: How late a pause ends in a program that looks at clocks, as on any real machine. If it ended exactly on time, whether
#: `now - last > period` holds would depend on rounding, or it would hold one pause later than its author ever saw.
LATE_NS = 1_000
#: This many messages sent at one instant show that a program does not pace itself.
MESSAGES_AT_ONCE = 200


#: How many pauses of the program are remembered, to tell when a message was sent.
PAUSES = 10_000


class VirtualClock:
    """The virtual time of one process; it advances only when the grader allows it."""

    def __init__(self) -> None:
        self.now_ns = EPOCH_NS
        #: What is subtracted for monotonic clocks, which start neither at zero nor at the epoch.
        self.steady_ns = EPOCH_NS - UPTIME_NS
        self._looks = 0
        self._allowed = LOOKS
        self._yielding = False
        self._sent = 0
        self._looked_at = False
        self._was_looked_at = False
        self._seen_ns = 0
        #: Whether a pause or a timer's period has begun at this moment, so that the work before it delays what follows.
        self.counted = False
        #: Returns the system clock in nanoseconds since 1970, once rclpy is there to read it.
        self.real_ns: Callable[[], int] = lambda: 0
        #: The latest pauses: when each began in real time, in nanoseconds since 1970, and the virtual time then.
        self._pauses: deque[tuple[int, int]] = deque(maxlen=PAUSES)
        self.let_time_pass: Callable[[int], None] = lambda until_ns: None

    def pause(self) -> None:
        """Note that the program begins to wait."""
        self._pauses.append((self.real_ns(), self.now_ns))

    def at(self, real_ns: int) -> int:
        """Return the virtual time of a moment, in nanoseconds since 1970.

        What others send while this program waits, they send at the time at which it continues.
        """
        index = bisect_left(self._pauses, real_ns, key=lambda pause: pause[0])
        return self._pauses[index][1] if index < len(self._pauses) else self.now_ns

    def move_to(self, now_ns: int) -> None:
        """Set the time; it never goes back."""
        if now_ns > self.now_ns:
            self.now_ns, self._sent = now_ns, 0
            if not self._yielding:
                self.busy()  # looks between two pauses do not add up to a busy loop

    def end_of(self, pause_ns: int) -> int:
        """Return when a pause that begins now ends."""
        if pause_ns > 0:
            self.count_pause()
        return self.now_ns + pause_ns + (LATE_NS if self._was_looked_at and pause_ns > 0 else 0)

    def count_pause(self) -> None:
        """Note that a pause begins, unless the program has just looked at a clock: it may sleep until a deadline."""
        self.counted |= self._seen_ns != self.now_ns

    def look(self, *, by_library: bool = False) -> int:
        """Return the time to the program, and let time pass if the program does nothing but look."""
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
        """Note that the program did something other than wait."""
        self._looks, self._allowed = 0, LOOKS

    def busy_sending(self) -> None:
        """Note that the program sends a message, and let time pass after many messages at one instant."""
        self.busy()
        self._sent += 1
        if self._sent >= MESSAGES_AT_ONCE and not self._yielding:
            self._sent = 0
            self._yield()
