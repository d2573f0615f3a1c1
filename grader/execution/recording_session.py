"""Sets up and closes what recordings need (ROS, a sandbox, workers, a folder), and chooses the clock."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TypeVar

from grader.core.checkup import Property
from grader.core.dataclass import dataclass
from grader.core.trace import Trace
from grader.execution.byte_code import compile_own
from grader.execution.domains import private_domains, shared_domains
from grader.execution.real_time_budget import FOREVER_S, RealTimeBudget
from grader.execution.ros_installation import RosInstallation, find_ros
from grader.execution.sandbox.choose import choose_isolation
from grader.execution.sandbox.protocol import Isolation
from grader.execution.supervisor import Job, Recorder
from grader.execution.temp_dirs import scratch_folder

#: The name of a run without a sandbox in reports.
NO_ISOLATION = "none"
#: How many more scenarios than there are processors are recorded at once, because nodes wait for discovery in between:
#: of a submission alone, and of one in a class, whose others use the processors as well.
MORE_ALONE, MORE_IN_CLASS = 3, 1
#: The most scenarios of a submission that are recorded at once, because each takes memory.
MOST_WORKERS = 6
#: The values of `--clock`: `auto` is virtual time, with the wall clock where virtual time is unsuitable.
VIRTUAL, WALL, AUTO = "virtual", "wall", "auto"

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True, slots=True)
class RecordingSession:
    """The resources that a run is recorded with.

    Attributes:
        ros: The ROS installation that nodes run on.
        isolation: The sandbox tier.
        containment: What the self-test found the sandbox to prevent; empty without a sandbox.
        recorder: Runs jobs in its workers.
        folder: A temporary folder, removed at the end.
    """

    ros: RosInstallation
    isolation: Isolation
    containment: tuple[Property, ...]
    recorder: Recorder
    folder: Path

    def record(  # noqa: PLR0913  what to record, and who is told
        self,
        jobs: Mapping[Key, Job],
        clock: str,
        progress: Callable[[str], None],
        finished: Callable[[Key, Trace], None] | None = None,
        *,
        budget_s: float = FOREVER_S,
        under_way: Callable[[], None] = lambda: None,
    ) -> dict[Key, Trace]:
        """Record jobs and return their traces, in the same order.

        With `auto`, a job that virtual time does not suit is recorded again on the wall clock. These jobs run one at a
        time, because parallel ones would disturb each other.

        Args:
            jobs: Planned on the virtual clock, or on the wall clock for `wall`.
            clock: `virtual`, `wall` or `auto`.
            progress: Called with the title of each job that starts.
            finished: Called with each trace once it is final, while others are still being recorded.
            budget_s: Real time that all jobs may take together.
            under_way: Called once while jobs are being recorded, for work that need not wait for them.
        """
        from grader.execution.unrunnable import trace_without_run  # noqa: PLC0415 - after a worker has been started

        budget = RealTimeBudget(budget_s)
        known = {key: trace for key, job in jobs.items() if (trace := trace_without_run(job.plan)) is not None}
        to_run = {key: job for key, job in jobs.items() if key not in known}
        first = [Job(job.title, replace(job.plan, stop_when_unfit=clock == AUTO), budget) for job in to_run.values()]
        traces: dict[Key, Trace] = {}
        recorded = zip(to_run, self.recorder.each(first, progress), strict=True)
        under_way()
        for key, trace in chain(known.items(), recorded):
            traces[key] = trace
            if finished is not None and not _unfit(trace, clock):
                finished(key, trace)
        for key in [key for key, trace in traces.items() if _unfit(trace, clock)]:
            again = Job(f"{jobs[key].title}, on the wall clock", replace(jobs[key].plan, clock=WALL), budget)
            repeated = self.recorder.record([again], progress)[0]
            traces[key] = replace(repeated, clock_reason=traces[key].clock_reason)
            if finished is not None:
                finished(key, traces[key])
        return {key: traces[key] for key in jobs}


def workers_for(processors: int, more: int = MORE_ALONE) -> int:
    """Return how many scenarios of one submission to record in parallel on so many processors."""
    return min(max(1, processors) + more, MOST_WORKERS)


def _unfit(trace: Trace, clock: str) -> bool:
    """Return whether a first recording has to be repeated on the wall clock.

    A failure of the grader's own code that makes virtual time unsuitable is not one of the wall clock, where little of
    that code runs.
    """
    failed = trace.harness_problem not in ("", trace.clock_reason)
    return clock == AUTO and bool(trace.clock_reason) and not failed


@contextmanager
def open_session(
    isolation: str,
    workers: int | None = None,
    progress: Callable[[str], None] = lambda _: None,
    *,
    warm: bool = True,
    on_wall_clock: Callable[[], None] = lambda: None,
) -> Iterator[RecordingSession]:
    """Open a recording session, and close it at the end of the block.

    Args:
        isolation: `auto`, `none` or the name of a tier.
        workers: How many scenarios to record in parallel; None to choose by the number of processors.
        progress: Called with a message when a sandbox has to be tested.
        warm: Whether to start a worker at once, not when something is recorded.
        on_wall_clock: See `Recorder`.

    Raises:
        EnvironmentFault: This machine lacks ROS or the requested tier.
    """
    ros = find_ros()
    choice = choose_isolation(isolation, ros, progress)
    tier = choice.isolation
    domains = shared_domains() if tier.shares_network else private_domains()
    workers = workers or workers_for(len(os.sched_getaffinity(0)))
    # Neither workers nor student processes write byte code, so their modules are compiled here, once.
    compile_own()
    with scratch_folder() as folder:
        folder.chmod(0o755)  # students' processes may run as another user and have to read the staged copy
        kept = Recorder(tier, ros.runtime, domains, scratch=folder, workers=workers, on_wall_clock=on_wall_clock)
        with kept as recorder:
            if warm:
                recorder.warm_up(workers)
            yield RecordingSession(ros, tier, choice.containment, recorder, folder)


def planned_clock(clock: str) -> str:
    """Return the clock to plan jobs on for a value of `--clock`."""
    return WALL if clock == WALL else VIRTUAL
