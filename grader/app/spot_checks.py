"""Spot checks: records a scenario again on the wall clock, with no code of the grader in the student's process.

If the two recordings disagree, the wall clock decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from grader.core.dataclass import dataclass
from grader.core.quantities import NS_PER_S
from grader.core.trace import ClockKind, Trace
from grader.execution.plan import Plan, derive
from grader.execution.recording_session import WALL
from grader.execution.stimuli import schedule
from grader.execution.supervisor import Job
from grader.judging.agreement import Difference, differences, sentence

#: How long a program is observed after its first message or the first stimulus.
WATCHED_NS = 6 * NS_PER_S
#: How much longer than in virtual time the first message may take.
PATIENCE_NS = 10 * NS_PER_S
#: How often a disagreement must occur to count, and after how many attempts on a busy machine the check is given up.
TIMES = 2
BUSY_TIMES = 3
BUSY = "the machine was too busy for a check on the wall clock"

#: Exercise id and scenario id.
Key = tuple[str, str]
Record = Callable[[Sequence[Job]], Sequence[Trace]]
Finished = Callable[[Key, Trace], None]


def shortened(plan: Plan, virtual: Trace) -> Plan:
    """Shorten a plan to its beginning, for a spot check on the wall clock with the same stimuli."""
    bare = bare_plan(plan, virtual)
    if plan.first_message_on:
        messages = virtual.messages(plan.first_message_on)
        first_ns = messages[0].t_ns if messages else WATCHED_NS
        watched_ns, waited_ns = min(plan.duration_ns, WATCHED_NS), min(plan.wait_at_most_ns, first_ns + PATIENCE_NS)
        return replace(bare, duration_ns=watched_ns, wait_at_most_ns=waited_ns, shutdown_ns=0)
    begins_ns = min((due.t_ns for due in schedule(plan) if due.t_ns > 0), default=0)
    return replace(bare, duration_ns=min(plan.duration_ns, begins_ns + WATCHED_NS), shutdown_ns=0)


def bare_plan(plan: Plan, virtual: Trace) -> Plan:
    """Change a plan to the wall clock, with no code of the grader in the student's processes."""
    first_node_ns = next((graph.t_ns for graph in virtual.graphs() if graph.nodes), 0)
    publishers = tuple(dict.fromkeys(e for g in virtual.graphs() for e in g.endpoints if e.kind == "publisher"))
    return replace(
        plan, clock=WALL, bare=True, first_node_ns=first_node_ns, publishers=publishers, stop_when_unfit=False
    )


def is_drawn(share: float, seed: int, digest: str) -> bool:
    """Whether a submission is drawn. Depends only on seed and digest, so only the owner of the key can predict it."""
    return int(derive(seed, "spot check", digest)[:12], 16) < share * 16**12


@dataclass(frozen=True, slots=True)
class SpotChecks:
    """Decides which recordings of a submission are checked."""

    share: float  # share of submissions that are drawn, from 0 to 1
    seed: int  # seed of the submission's drawn values; together with the digest it decides whether it is drawn
    digest: str
    reaches: tuple[str, ...] = ()  # names in its files that access internals of their process

    @property
    def drawn(self) -> bool:
        """Whether this submission is drawn for a spot check."""
        return is_drawn(self.share, self.seed, self.digest)

    @property
    def certain(self) -> bool:
        """Whether this submission is checked no matter what its processes do."""
        return self.drawn or bool(self.reaches)

    def due(self, jobs: Mapping[Key, Job], traces: Mapping[Key, Trace]) -> list[Key]:
        """Select the recordings to check: valid ones in virtual time, and of a suspect also those on the wall clock."""
        drawn = self.drawn
        return [
            key
            for key, job in jobs.items()
            if _is_due(job.plan, traces[key], drawn=drawn, suspect=self.suspects(key, traces))
        ]

    def suspects(self, key: Key, traces: Mapping[Key, Trace]) -> bool:
        """Whether the exercise must pass its check, because a program accesses internals of its process."""
        return bool(self.reaches) or any(t.reached for (exercise, _), t in traces.items() if exercise == key[0])


def check(
    checks: SpotChecks,
    jobs: Mapping[Key, Job],
    traces: Mapping[Key, Trace],
    record: Record,
    finished: Finished,
) -> dict[Key, Trace]:
    """Run the spot checks that are due; where the clocks disagree, replace the exercise's traces by wall-clock ones.

    All are recorded at the same time first. That can make the clocks disagree, never agree, so whatever disagrees is
    recorded again, one at a time, and only this counts.

    If the machine is too busy for a check, the trace in virtual time counts and gets a note. Only for a program that
    accesses internals of its process, the result is then undecided. Each trace of a checked exercise is passed to
    `finished`.
    """
    found = dict(traces)
    due = checks.due(jobs, traces)
    agreed = _agreed(due, jobs, traces, record)
    for exercise in dict.fromkeys(exercise for exercise, _ in due):
        own = [key for key in due if key[0] == exercise and key not in agreed]
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
    """Whether a recording is checked; one whose processes start at different times never is.

    A recording in virtual time is checked if it is drawn or suspect. One on the wall clock is checked only if it is
    suspect, because the program may find the grader in its process.
    """
    on_virtual = (drawn or suspect) and not trace.clock_reason
    wanted = suspect if trace.clock is ClockKind.WALL else on_virtual
    return wanted and not trace.harness_problem and not plan.starts_ns


def _agreed(due: Sequence[Key], jobs: Mapping[Key, Job], traces: Mapping[Key, Trace], record: Record) -> set[Key]:
    """Record what is due in parallel, and return where the clocks agree; a single one needs no such round."""
    if len(due) < 2:
        return set()
    walls = record([replace(_check_of(jobs[key], traces[key]), parallel=True) for key in due])
    return {key for key, wall in zip(due, walls, strict=True) if not _differences(jobs[key], traces[key], wall)}


def _check_of(job: Job, virtual: Trace) -> Job:
    return Job(f"{job.title}, checked on the wall clock", shortened(job.plan, virtual))


def _differences(job: Job, virtual: Trace, wall: Trace) -> Sequence[Difference]:
    return differences(virtual, wall, job.plan.first_message_on)


def _disagreement(job: Job, virtual: Trace, record: Record) -> tuple[Difference | None, bool]:
    """Return a difference that occurred in repeated attempts, and whether the machine was too busy to find out."""
    seen: list[Difference] = []
    busy = 0
    while busy < BUSY_TIMES:
        (wall,) = record([_check_of(job, virtual)])
        found = _differences(job, virtual, wall)
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
    """Record all scenarios of an exercise on the wall clock, which decides."""
    decided = {}
    for key, job in jobs.items():
        virtual = traces[key]
        if virtual.harness_problem:
            continue
        plan = replace(bare_plan(job.plan, virtual), bare=not job.plan.starts_ns)
        (wall,) = record([Job(f"{job.title}, on the wall clock", plan)])
        decided[key] = replace(wall, clock_reason=sentence(difference, virtual.clock), starts=virtual.starts)
    return decided
