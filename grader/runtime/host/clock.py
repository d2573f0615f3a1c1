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
#: How much later each further look at one instant is, as on any real machine: programs divide by the difference. It is
#: the smallest difference that `datetime` shows.
LOOK_NS = 1_000
#: So far ahead of the instant, looks make time pass. It is less than STEP_NS, so that time never seems to go back.
AHEAD_NS = 400_000
#: This many messages sent at one instant show that a program does not pace itself.
MESSAGES_AT_ONCE = 200
#: This many tasks that have ended at one instant show that they only create each other. Each callback that runs in
#: `spin_until_future_complete` leaves one until the future is done: a minute at 100 Hz leaves 6,000.
TASKS_AT_ONCE = 10_000

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
        self._ended_tasks = 0
        self._looked_at = False
        #: Whether the program has looked at a clock, so that it may pace itself by what it has seen.
        self.was_looked_at = False
        self._seen_ns = 0
        #: The latest time that the program was shown, which may be after `now_ns`.
        self._shown_ns = 0
        #: Whether a pause or a timer's period has begun since the last report, so that the work before it delays what
        #: follows; and whether one did before which the program had not looked at a clock.
        self.paused = self.counted = False
        #: Returns how long it is until each of the program's timers is due: it may poll them.
        self.timers_due_in_ns: Callable[[], list[int]] = list
        #: The latest instant at which time did not pass because a timer was due.
        self._spared_ns = 0
        #: Lets the time pass that the program has worked, if that is part of the recording.
        self.charge: Callable[[], None] = lambda: None
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
                self._ended_tasks = 0
                self.busy()  # looks between two pauses do not add up to a busy loop

    def end_of(self, pause_ns: int) -> int:
        """Return when a pause that begins now ends."""
        if pause_ns <= 0:
            return self.now_ns + pause_ns
        self.count_pause()
        # If it is counted from a look, it ends at the deadline that the program has in mind, or after it.
        late_ns = LATE_NS if self.was_looked_at else 0
        return max(self.now_ns, self._shown_ns) + pause_ns + late_ns

    def count_pause(self) -> None:
        """Note that a pause begins which is counted from now; after a look at a clock, it may be until a deadline."""
        self.begin_pause()
        self.counted |= self._seen_ns != self.now_ns

    def begin_pause(self) -> None:
        """Note that a pause begins which may be counted from now."""
        self.charge()
        self.paused = True

    def look(self, *, paces: bool = True, shown: bool = True) -> int:
        """Return the time to the program, and let time pass if the program does nothing but look.

        Args:
            paces: Whether the program may pace itself by what it sees; a library that only notes the time does not.
            shown: Whether the program sees the time itself. Looks of libraries, whose number is theirs, take no time.
        """
        self.charge()
        self._looked_at = True
        if paces:
            self.was_looked_at, self._seen_ns = True, self.now_ns
        self.idle_look()
        if not shown:
            return max(self.now_ns, self._shown_ns)
        if self._shown_ns >= self.now_ns + AHEAD_NS and not self._yielding:
            self._yield()
        self._shown_ns = max(self.now_ns, self._shown_ns + LOOK_NS)
        return self._shown_ns

    def idle_look(self, weight: int = 1) -> None:
        """Count one look at something that only time can change."""
        self._looks += weight
        if self._looks > self._allowed and not self._yielding:
            self._looks, self._allowed = 0, LOOKS_WHILE_SPINNING
            self._yield()

    def _yield(self) -> None:
        """Let a step pass, but not beyond the next timer: a program that polls it calls it on time."""
        waits_ns = self.timers_due_in_ns()
        if 0 in waits_ns and self._spared_ns != self.now_ns:  # it is about to be called, if the program polls it
            self._spared_ns, self._allowed = self.now_ns, LOOKS
            return
        self._yielding = self.paused = True
        step_ns = STEP_NS if self._looked_at else LONG_STEP_NS
        try:
            self.let_time_pass(self.now_ns + min((wait for wait in waits_ns if 0 < wait < step_ns), default=step_ns))
        finally:
            self._yielding = self._looked_at = False

    def busy(self) -> None:
        """Note that the program did something other than wait."""
        self._looks, self._allowed = 0, LOOKS

    def end_task(self) -> None:
        """Note that a task of an executor has ended, which is work, but not if tasks create each other without end."""
        self._ended_tasks += 1
        if self._ended_tasks <= TASKS_AT_ONCE:
            self.busy()

    def busy_sending(self) -> None:
        """Note that the program sends a message, and let time pass after many messages at one instant."""
        self.charge()
        self.busy()
        self._sent += 1
        if self._sent >= MESSAGES_AT_ONCE and not self._yielding:
            self._sent = 0
            self._yield()
