"""Spot checks: what was recorded with the grader in the student's process is recorded once more on the wall clock.

There, nothing of the grader is in the student's process. Where the two disagree, the wall clock decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from grader.core.quantities import NS_PER_S
from grader.core.trace import ClockKind, Trace
from grader.execution.plan import Plan, derive
from grader.execution.recording_session import WALL
from grader.execution.stimuli import schedule
from grader.execution.supervisor import Job
from grader.judging.agreement import Difference, differences, sentence

#: How long a program is watched from its first message, or from the first stimulus, on.
WATCHED_NS = 6 * NS_PER_S
#: How much longer than in virtual time a first message is waited for.
PATIENCE_NS = 10 * NS_PER_S
#: So often a disagreement has to be seen, and so often the machine may be too busy to show one.
TIMES = 2
BUSY_TIMES = 3
BUSY = "the machine was too busy for a check on the wall clock"

#: Exercise id and scenario id.
Key = tuple[str, str]
Record = Callable[[Job], Trace]
Finished = Callable[[Key, Trace], None]


def shortened(plan: Plan, virtual: Trace) -> Plan:
    """Return the beginning of a plan for the wall clock, with the same stimuli.

    Args:
        plan: The whole plan.
        virtual: What came of it in virtual time.
    """
    bare = bare_plan(plan, virtual)
    if plan.first_message_on:
        messages = virtual.messages(plan.first_message_on)
        first_ns = messages[0].t_ns if messages else WATCHED_NS
        watched_ns, waited_ns = min(plan.duration_ns, WATCHED_NS), min(plan.wait_at_most_ns, first_ns + PATIENCE_NS)
        return replace(bare, duration_ns=watched_ns, wait_at_most_ns=waited_ns, shutdown_ns=0)
    begins_ns = min((due.t_ns for due in schedule(plan) if due.t_ns > 0), default=0)
    return replace(bare, duration_ns=min(plan.duration_ns, begins_ns + WATCHED_NS), shutdown_ns=0)


def bare_plan(plan: Plan, virtual: Trace) -> Plan:
    """Return a plan for the wall clock with nothing of the grader in the students' processes."""
    first_node_ns = next((graph.t_ns for graph in virtual.graphs() if graph.nodes), 0)
    return replace(plan, clock=WALL, bare=True, first_node_ns=first_node_ns, stop_when_unfit=False)


def is_drawn(share: float, seed: int, digest: str) -> bool:
    """Return whether a submission is one of a share of them: always or never, and only who has the key knows."""
    return int(derive(seed, "spot check", digest)[:12], 16) < share * 16**12


@dataclass(frozen=True, slots=True)
class SpotChecks:
    """Which submissions are checked, and how.

    Attributes:
        share: The share of submissions that are drawn, from 0 to 1.
        seed: The seed of a submission's drawn values; decides with its digest whether it is drawn.
        digest: The submission's digest.
        reaches: By what names its files reach for the insides of their process.
    """

    share: float
    seed: int
    digest: str
    reaches: tuple[str, ...] = ()

    @property
    def drawn(self) -> bool:
        """Whether this submission is one of the share."""
        return is_drawn(self.share, self.seed, self.digest)

    @property
    def certain(self) -> bool:
        """Whether it is checked whatever its processes do."""
        return self.drawn or bool(self.reaches)

    def due(self, jobs: Mapping[Key, Job], traces: Mapping[Key, Trace]) -> list[Key]:
        """Return what is checked: recordings that nothing was wrong with; in virtual time, unless it is suspected."""
        drawn = self.drawn
        return [
            key
            for key, job in jobs.items()
            if _is_due(job.plan, traces[key], drawn=drawn, suspect=self.suspects(key, traces))
        ]

    def suspects(self, key: Key, traces: Mapping[Key, Trace]) -> bool:
        """Return whether a program has to pass its check, since it reaches for the insides of its process."""
        return bool(self.reaches) or any(t.reached for (exercise, _), t in traces.items() if exercise == key[0])


def check(
    checks: SpotChecks,
    jobs: Mapping[Key, Job],
    traces: Mapping[Key, Trace],
    record: Record,
    finished: Finished,
) -> dict[Key, Trace]:
    """Check what is due and return all traces, those of an exercise whose clocks disagree from the wall clock.

    A machine that is too busy for a check says nothing: virtual time counts then, with a note; only of a program that
    reaches for the insides of its process nothing is decided.

    Args:
        checks: What is to be checked.
        jobs: What was recorded, by exercise and scenario.
        traces: What came of it.
        record: Records a job.
        finished: Hears each trace of an exercise that was checked.
    """
    found = dict(traces)
    due = checks.due(jobs, traces)
    for exercise in dict.fromkeys(exercise for exercise, _ in due):
        own = [key for key in due if key[0] == exercise]
        difference = None
        for key in own:
            difference, busy = _disagreement(jobs[key], traces[key], record)
            if difference is not None:
                break
            if busy:
                found[key] = _unchecked(found[key], suspect=checks.suspects(key, traces))
        if difference is not None:
            found |= _decided(difference, {k: j for k, j in jobs.items() if k[0] == exercise}, traces, record)
        for key in (key for key in jobs if key[0] == exercise):
            finished(key, found[key])
    return found


def _is_due(plan: Plan, trace: Trace, *, drawn: bool, suspect: bool) -> bool:
    """Return whether a recording of processes that all start at once is checked.

    One in virtual time is if it is drawn or suspected; one on the wall clock only if it is suspected: the program may
    find the grader in its process.
    """
    on_virtual = (drawn or suspect) and not trace.clock_reason
    wanted = suspect if trace.clock is ClockKind.WALL else on_virtual
    return wanted and not trace.harness_problem and not plan.starts_ns


def _disagreement(job: Job, virtual: Trace, record: Record) -> tuple[Difference | None, bool]:
    """Return how the clocks disagree, each time that it is tried, and whether the machine was too busy to tell."""
    plan = shortened(job.plan, virtual)
    seen: list[Difference] = []
    busy = 0
    while busy < BUSY_TIMES:
        wall = record(Job(f"{job.title}, checked on the wall clock", plan))
        found = differences(virtual, wall, plan.first_message_on)
        if not found:
            return None, False  # a busy machine makes clocks disagree, never agree
        if wall.harness_problem:
            busy += 1
            continue
        seen.append(found[0])
        if len(seen) == TIMES:
            return seen[0], False
    return None, True


def _unchecked(trace: Trace, *, suspect: bool) -> Trace:
    if suspect:
        return replace(trace, harness_problem=f"{BUSY}, and this submission reaches for the insides of its process")
    return replace(trace, notes=(*trace.notes, f"{BUSY}: what was recorded in virtual time counts"))


def _decided(
    difference: Difference, jobs: Mapping[Key, Job], traces: Mapping[Key, Trace], record: Record
) -> dict[Key, Trace]:
    """Record all of an exercise on the wall clock, which decides."""
    decided = {}
    for key, job in jobs.items():
        virtual = traces[key]
        if virtual.harness_problem:
            continue
        plan = replace(bare_plan(job.plan, virtual), bare=not job.plan.starts_ns)
        wall = record(Job(f"{job.title}, on the wall clock", plan))
        decided[key] = replace(wall, clock_reason=sentence(difference, virtual.clock), starts=virtual.starts)
    return decided
