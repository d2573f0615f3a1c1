"""Computes how late a student's process would be on a real clock, from what its steps cost."""

from __future__ import annotations

from grader.runtime.host.protocol import Progress
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S

#: How long a step may wait for messages that are on their way; more counts as the process's own waiting. And how much
#: of this does not count against the whole run: on an idle machine a message takes less than a millisecond.
ARRIVAL_NS, ARRIVAL_FREE_NS = 20 * NS_PER_MS, 5 * NS_PER_MS
#: A wake-up is late if the work before it delays it by more than LATE_NS, or took longer than SLOW_NS. For comparison:
#: creating a node takes up to 100 ms, and checks wait 250 ms for an answer.
LATE_NS, SLOW_NS = 40 * NS_PER_MS, 200 * NS_PER_MS
#: Virtual time hides too much if more than this share of the wake-ups, and more than this number, are late.
LATE_SHARE, LATE_AT_LEAST = 0.03, 3
#: A loop with a pause, or a timer that is reset, is postponed by its own work each time, if it does not sleep until a
#: deadline. It is postponed in any case if it has not looked at a clock, and its work exceeds the share `CERTAIN`; and
#: may be if the work exceeds `POSSIBLE`, which is less than what rubrics notice. Neither counts the LONGEST pieces of
#: work, nor the grader's own cost of each step and of each pause in it: 0.25 and 0.02 ms were measured, and 0.6 and
#: 0.12 ms with a wait set.
LONGEST = 3
#: The allowed cost of each poll of a busy loop, and the most polls in a step: on a real clock such a loop polls as
#: often as time allows, and is not delayed by it.
POLL_NS, MOST_POLLS = NS_PER_MS // 2, 10
#: A yield of a busy loop lets at least this much time pass.
YIELD_NS = NS_PER_MS // 2
#: Whatever a process reports, its work takes no more than so many times the time that has passed, and `HOPELESS_NS`.
#: Less would be wrong for a busy loop whose polls cost more than the time that they let pass: on a real clock it polls
#: less often.
OUTRUN = 1.5
#: What is allowed while a process waits until its endpoints are matched or messages have arrived, each time: real time,
#: as discovery takes up to 0.2 s; and of this, what does not count against the whole run.
BESIDE_NS, BESIDE_FREE_NS = NS_PER_S // 4, 20 * NS_PER_MS
#: With a longer delay there is no point in continuing in virtual time.
HOPELESS_NS = 2 * NS_PER_S


@dataclass(frozen=True, slots=True)
class Share:
    """How much work may come before pauses: a share of the time, and what each step and each pause in it may cost."""

    most: float
    step_ns: int
    pause_ns: int


CERTAIN = Share(0.08, 3 * NS_PER_MS // 2, NS_PER_MS)
POSSIBLE = Share(0.02, 7 * NS_PER_MS // 10, 3 * NS_PER_MS // 10)


class PutOff:
    """Adds up the work that comes before pauses, and tells whether it exceeds a share of the time."""

    def __init__(self, share: Share) -> None:
        self._share = share
        self._sum_ns = 0
        self._longest_ns = [0] * LONGEST

    def add(self, real_ns: int, pauses: int) -> None:
        """Add the work of one step, with so many pauses in it."""
        real_ns = max(0, real_ns - self._share.step_ns - self._share.pause_ns * pauses)
        self._sum_ns += real_ns
        self._longest_ns = sorted([*self._longest_ns, real_ns])[1:]

    def exceeds(self, time_ns: int) -> bool:
        """Return whether it is more than the share of a time."""
        return self._sum_ns - sum(self._longest_ns) > self._share.most * time_ns


class Delay:
    """Computes how late a process would be on a real clock.

    It follows Lindley's recursion for queues: a wake-up inherits the part of the previous work that exceeds the time
    between the two. Work before the first wait delays nothing: the program only starts later.

    Args:
        start_ns: Virtual time at which the program starts.

    Attributes:
        wake_ups: Number of moments of virtual time at which the process continued after waiting.
        late: How many of them would have been late, or followed a long piece of work.
    """

    def __init__(self, start_ns: int = 0) -> None:
        self._at_ns = start_ns
        self._starting = True
        self._work_ns = 0
        self._delay_ns = 0
        self._began_ns = start_ns
        self._total_ns = 0
        self._certain, self._possible = PutOff(CERTAIN), PutOff(POSSIBLE)
        self.wake_ups = 0
        self.late = 0

    def wake(self, t_ns: int) -> None:
        """Note that the process continues at a virtual time."""
        if t_ns <= self._at_ns:
            return
        if not self._starting:
            self.wake_ups += 1
            # Lindley's recursion: what is not done by the next wake-up delays it, and waiting makes up for it.
            self._delay_ns = max(0, self._delay_ns + self._work_ns - (t_ns - self._at_ns))
            self.late += self._work_ns > SLOW_NS or self._delay_ns > LATE_NS
        else:
            self._began_ns = t_ns
        self._starting = False
        self._at_ns, self._work_ns = t_ns, 0

    def work(self, real_ns: int) -> None:
        """Add the time that the process would have worked at this moment."""
        self._work_ns += real_ns

    def put_off(self, real_ns: int, *, pauses: int = 0, certain: bool = True) -> None:
        """Note that the next pause or period may be counted from the end of some work.

        Args:
            real_ns: The work.
            pauses: How many pauses the process made on its own meanwhile.
            certain: Whether it is: the program has not looked at a clock since.
        """
        if not self._starting:
            self._possible.add(real_ns, pauses)
            if certain:
                self._certain.add(real_ns, pauses)

    def take(self, real_ns: int) -> None:
        """Add real time in which the process worked, whatever for, to the bound of the whole run."""
        if not self._starting:
            self._total_ns += max(0, real_ns)

    def step(
        self, taken_ns: int, progress: Progress, passed_ns: int, *, forgiven_ns: int = 0, moved_on: bool = False
    ) -> None:
        """Add a step, from an answer to the report that the process waits or has ended.

        Args:
            taken_ns: What it has cost, without the time that was forgiven.
            progress: What the process reports of the step.
            passed_ns: The virtual time that has passed in the step; it bounds the number of polls.
            forgiven_ns: How long it waited for messages that were on their way to it.
            moved_on: Whether virtual time has passed since the step before.
        """
        # The process reports this number: it is worth no more than the time that has passed allows.
        moves = min(max(progress.moved, 0), MOST_POLLS, passed_ns // YIELD_NS)
        self.work(max(0, taken_ns - POLL_NS * moves))
        waited_ns = max(0, forgiven_ns - ARRIVAL_FREE_NS)
        self.take(taken_ns + waited_ns - (POSSIBLE.step_ns if moved_on else 0))
        if (progress.paused or progress.counted) and not progress.charged:
            self.put_off(taken_ns, pauses=min(max(progress.moved, 0), MOST_POLLS), certain=progress.counted)

    def beside(self, taken_ns: int) -> None:
        """Add what a process did beside its steps, while the grader made it wait for matches or messages."""
        self.work(max(0, taken_ns - BESIDE_NS))
        self.take(taken_ns - BESIDE_FREE_NS)

    @property
    def hides(self) -> bool:
        """Whether virtual time hides how late the process would be."""
        # A share, because one slow callback in a thousand is what any node has; and a number, because of few wake-ups
        # one is a large share.
        late = self.late > max(LATE_AT_LEAST, LATE_SHARE * self.wake_ups)
        return self.hopeless or late or self._outruns or self._certain.exceeds(self._at_ns - self._began_ns)

    @property
    def may_drift(self) -> bool:
        """Whether virtual time may hide that the process is slower."""
        return self._possible.exceeds(self._at_ns - self._began_ns)

    @property
    def _outruns(self) -> bool:
        return self._total_ns > OUTRUN * (self._at_ns - self._began_ns) + HOPELESS_NS

    @property
    def hopeless(self) -> bool:
        """Whether the process is so late that the rest of the run cannot change the result."""
        return not self._starting and self._delay_ns + self._work_ns > HOPELESS_NS
