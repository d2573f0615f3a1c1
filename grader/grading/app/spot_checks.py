"""Spot checks: records a scenario again on the wall clock, with no code of the grader in the student's process.

If a criterion that is met in the first recording is not met in the second, or the recordings differ in another way, the
wall clock decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from grader.grading.judging.agreement import ClockDifference, differences, observation_start, sentence
from grader.grading.judging.beginnings import cut
from grader.grading.judging.idle_machine import quicker, shown_until_ns
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import AssessedTrace, ClockKind
from grader.runtime.plan import Plan, derive
from grader.runtime.session import WALL, Job

if TYPE_CHECKING:
    from grader.grading.judging.beginnings import BeginningJudge

#: The share of submissions of which scenarios with several programs are checked as well. Each program is checked in a
#: scenario of its own; a program that is wrong only beside the other one is found in this share.
TOGETHER = 0.25
#: How much longer than in virtual time the first message may take.
PATIENCE_NS = 10 * NS_PER_S
#: How often a disagreement must occur to count, and after how many attempts on a busy machine the check is given up.
TIMES = 2
BUSY_TIMES = 3
BUSY = "the machine was too busy for a check on the wall clock"

#: Exercise id and scenario id.
Key = tuple[str, str]
Record = Callable[[Sequence[Job]], Sequence[AssessedTrace]]
Finished = Callable[[Key, AssessedTrace], None]
#: Returns what judges the beginnings of the recordings of a scenario.
JudgeOf = Callable[[Key], "BeginningJudge"]


def shortened(plan: Plan, virtual: AssessedTrace, judge: BeginningJudge) -> Plan:
    """Shorten a plan to its beginning, for a spot check on the wall clock with the same stimuli."""
    bare = bare_plan(plan, virtual)
    if plan.first_message_on:
        messages = virtual.messages(plan.first_message_on)
        watched_ns = judge.length_ns(virtual, messages[0].t_ns if messages else 0)
        first_ns = messages[0].t_ns if messages else watched_ns
        watched_ns, waited_ns = min(plan.duration_ns, watched_ns), min(plan.wait_at_most_ns, first_ns + PATIENCE_NS)
        return replace(bare, duration_ns=watched_ns, wait_at_most_ns=waited_ns, shutdown_ns=0)
    begins_ns = min((due.t_ns for due in plan.events() if due.t_ns > 0), default=0)
    watched_ns = begins_ns + judge.length_ns(virtual, begins_ns)
    return replace(bare, duration_ns=min(plan.duration_ns, watched_ns), shutdown_ns=0)


def bare_plan(plan: Plan, virtual: AssessedTrace) -> Plan:
    """Change a plan to the wall clock, with no code of the grader in the student's processes."""
    first_node_ns = next((graph.t_ns for graph in virtual.graphs() if graph.nodes), 0)
    publishers = tuple(dict.fromkeys(e for g in virtual.graphs() for e in g.endpoints if e.kind == "publisher"))
    return replace(
        plan, clock=WALL, bare=True, first_node_ns=first_node_ns, publishers=publishers, stop_when_unfit=False
    )


def is_spot_checked(share: float, seed: int, digest: str) -> bool:
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
        return is_spot_checked(self.share, self.seed, self.digest)

    @property
    def certain(self) -> bool:
        """Whether this submission is checked no matter what its processes do."""
        return self.drawn or bool(self.reaches)

    def due(self, jobs: Mapping[Key, Job], traces: Mapping[Key, AssessedTrace]) -> list[Key]:
        """Select the recordings to check.

        Of a submission that is drawn these are valid recordings in virtual time, of each program at least one. Of a
        suspect these are all, also those on the wall clock.
        """
        drawn = self._drawn_of(jobs, traces) if self.drawn else ()
        return [
            key
            for key, job in jobs.items()
            if _is_due(job.plan, traces[key], drawn=key in drawn, suspect=self.suspects(key, traces))
        ]

    def _drawn_of(self, jobs: Mapping[Key, Job], traces: Mapping[Key, AssessedTrace]) -> set[Key]:
        """Draw one scenario of each program in which as few others as possible run; of some, also other scenarios.

        Starting Python is most of the cost of a check. Nobody but the owner of the key can predict which are drawn.
        """
        able = [key for key, job in jobs.items() if _is_due(job.plan, traces[key], drawn=True, suspect=False)]
        found = {
            key for key in able if len(jobs[key].plan.processes) > 1 and self._draws(TOGETHER, f"{key[0]} {key[1]}")
        }
        for exercise, program in dict.fromkeys((key[0], name) for key in able for name in _programs(jobs[key])):
            own = [key for key in able if key[0] == exercise and program in _programs(jobs[key])]
            fewest = min(len(_programs(jobs[key])) for key in own)
            own = [key for key in own if len(_programs(jobs[key])) == fewest]
            found.add(own[int(derive(self.seed, "spot check of", exercise, program, self.digest)[:12], 16) % len(own)])
        return found

    def _draws(self, share: float, what: str) -> bool:
        return is_spot_checked(share, self.seed, f"{self.digest} {what}")

    def suspects(self, key: Key, traces: Mapping[Key, AssessedTrace]) -> bool:
        """Whether the exercise must pass its check, because a program accesses internals of its process."""
        return bool(self.reaches) or any(t.reached for (exercise, _), t in traces.items() if exercise == key[0])


def check(  # noqa: PLR0913  what to check, with what, and where progress goes
    checks: SpotChecks,
    jobs: Mapping[Key, Job],
    traces: Mapping[Key, AssessedTrace],
    record: Record,
    finished: Finished,
    judge_of: JudgeOf,
) -> dict[Key, AssessedTrace]:
    """Run the spot checks that are due; where the clocks disagree, replace the exercise's traces by wall-clock ones.

    All are recorded at the same time first. That can make the clocks disagree, never agree, so whatever disagrees is
    recorded again, one at a time, and only this counts.

    If the machine is too busy for a check, the trace in virtual time counts, but the result is not final. For a
    program that accesses internals of its process, it is undecided. Each trace of a checked exercise is passed to
    `finished`.
    """
    found = dict(traces)
    due = {key: _Checked(jobs[key], traces[key], judge_of(key)) for key in checks.due(jobs, traces)}
    agreed = _agreed(due, record)
    for exercise in dict.fromkeys(exercise for exercise, _ in due):
        own = [key for key in due if key[0] == exercise and key not in agreed]
        difference = None
        for key in own:
            difference, busy = due[key].disagreement(record)
            if difference is not None:
                break
            if busy:
                found[key] = _unchecked(found[key], suspect=checks.suspects(key, traces))
        if difference is not None:
            decided = _decided(difference, {k: j for k, j in jobs.items() if k[0] == exercise}, traces, record)
            suspect = any(checks.suspects(key, traces) for key in own)
            # A machine that is too busy to decide may have caused such a difference as well.
            if difference.by_load and not suspect and any(trace.harness_problem for trace in decided.values()):
                decided = {key: _unchecked(traces[key], suspect=False) for key in decided}
            found |= decided
        for key in (key for key in jobs if key[0] == exercise):
            finished(key, found[key])
    return found


def _programs(job: Job) -> list[str]:
    return [name for name, _ in job.plan.processes]


def _is_due(plan: Plan, trace: AssessedTrace, *, drawn: bool, suspect: bool) -> bool:
    """Whether a recording is checked; one whose processes start at different times never is.

    A recording in virtual time is checked if it is drawn or suspect. One on the wall clock is checked only if it is
    suspect, because the program may find the grader in its process.
    """
    on_virtual = (drawn or suspect) and not trace.clock_reason
    wanted = suspect if trace.clock is ClockKind.WALL else on_virtual
    return wanted and not trace.harness_problem and not plan.starts_ns


@dataclass(frozen=True, slots=True)
class _Checked:
    """A scenario that is checked: its recording, and what judges the beginning of another one."""

    job: Job
    recorded: AssessedTrace
    judge: BeginningJudge

    def again(self) -> Job:
        """Return the job that records the beginning on the wall clock."""
        plan = shortened(self.job.plan, self.recorded, self.judge)
        return Job(f"{self.job.title}, checked on the wall clock", plan)

    def compared(self, wall: AssessedTrace) -> tuple[ClockDifference | None, bool]:
        """Return the most obvious difference, and whether a busy machine prevented a comparison.

        What no busy machine can cause comes first, and counts however busy it was.
        """
        first_message_on = self.job.plan.first_message_on
        starts_ns = observation_start(self.recorded, first_message_on), observation_start(wall, first_message_on)
        judged = self.judge.compare(self.recorded, wall, starts_ns)
        other = differences(self.recorded, wall, first_message_on)
        if certain := next((difference for difference in other if not difference.by_load), None):
            return certain, False
        found = (*judged.lost, *other)
        busy = bool(found and wall.harness_problem) or (judged.unsure and not found)
        if found and not judged.lost:  # the checks of criteria have been asked about an idle machine already
            busy = busy or any(not differences(self.recorded, one, first_message_on) for one in quicker(wall))
            # nor do they know of what the programs had no time for
            shown = cut(self.recorded, shown_until_ns(self.recorded, wall, starts_ns))
            late = {(one.aspect, one.name) for one in differences(shown, wall, first_message_on)}
            busy = busy or not any((one.aspect, one.name) in late for one in found)
        return next(iter(found), None), busy

    def disagreement(self, record: Record) -> tuple[ClockDifference | None, bool]:
        """Return a difference that occurred in repeated attempts, and whether the machine was too busy to find out."""
        seen: list[ClockDifference] = []
        busy = 0
        while busy < BUSY_TIMES:
            (wall,) = record([self.again()])
            found, too_busy = self.compared(wall)
            if too_busy:
                busy += 1
            elif found is None:
                return None, False  # a busy machine makes clocks disagree, never agree
            else:
                seen.append(found)
            if len(seen) == TIMES:
                return seen[0], False
        return None, True


def _agreed(due: Mapping[Key, _Checked], record: Record) -> set[Key]:
    """Record what is due in parallel, and return where the clocks agree; a single one needs no such round."""
    if len(due) < 2:
        return set()
    walls = record([replace(one.again(), parallel=True) for one in due.values()])
    pairs = zip(due.items(), walls, strict=True)
    return {key for (key, one), wall in pairs if one.compared(wall) == (None, False)}


def _unchecked(trace: AssessedTrace, *, suspect: bool) -> AssessedTrace:
    if suspect:
        return replace(trace, harness_problem=f"{BUSY}, and this submission inspects its own process")
    return replace(trace, unchecked=BUSY)


def _decided(
    difference: ClockDifference, jobs: Mapping[Key, Job], traces: Mapping[Key, AssessedTrace], record: Record
) -> dict[Key, AssessedTrace]:
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
