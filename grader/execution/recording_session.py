"""Everything a recording needs, set up and taken down: ROS, isolation, workers, a folder; and the choice of clock."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from grader.core.checkup import Property
from grader.core.trace import Trace
from grader.execution.byte_code import compile_own
from grader.execution.domains import private_domains, shared_domains
from grader.execution.ros_installation import RosInstallation, find_ros
from grader.execution.sandbox.choose import choose_isolation
from grader.execution.sandbox.protocol import Isolation
from grader.execution.supervisor import Job, Recorder
from grader.execution.temp_dirs import scratch_folder
from grader.execution.worker import FOREVER_S, RealTimeBudget

#: What reports call a run without walls.
NO_ISOLATION = "none"
#: A submission has no more scenarios than this that are worth recording side by side.
MOST_WORKERS = 4
#: Clocks that may be asked for: `auto` is virtual time, and the wall clock where that does no justice.
VIRTUAL, WALL, AUTO = "virtual", "wall", "auto"

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True, slots=True)
class RecordingSession:
    """What a run is recorded with.

    Attributes:
        ros: The ROS installation that nodes run on.
        isolation: The sandbox tier.
        containment: What it was seen to hold back; empty without walls.
        recorder: Its workers.
        folder: A folder of its own, gone afterwards.
    """

    ros: RosInstallation
    isolation: Isolation
    containment: tuple[Property, ...]
    recorder: Recorder
    folder: Path

    def record(
        self,
        jobs: Mapping[Key, Job],
        clock: str,
        progress: Callable[[str], None],
        finished: Callable[[Key, Trace], None] | None = None,
        *,
        budget_s: float = FOREVER_S,
    ) -> dict[Key, Trace]:
        """Record jobs and return their traces.

        Under `auto`, what virtual time does no justice to is recorded again on the wall clock, one at a time: side by
        side they would disturb each other.

        Args:
            jobs: Planned on the virtual clock, or on the wall clock for `wall`.
            clock: `virtual`, `wall` or `auto`.
            progress: Hears which job begins.
            finished: Hears each trace as soon as nothing will replace it, while others are still being recorded.
            budget_s: Real time that all of them may take together.
        """
        budget = RealTimeBudget(budget_s)
        first = [Job(job.title, replace(job.plan, stop_when_unfit=clock == AUTO), budget) for job in jobs.values()]
        traces: dict[Key, Trace] = {}
        for key, trace in zip(jobs, self.recorder.each(first, progress), strict=True):
            traces[key] = trace
            if finished is not None and not _unfit(trace, clock):
                finished(key, trace)
        for key in [key for key, trace in traces.items() if _unfit(trace, clock)]:
            again = Job(f"{jobs[key].title}, on the wall clock", replace(jobs[key].plan, clock=WALL), budget)
            repeated = self.recorder.record([again], progress)[0]
            traces[key] = replace(repeated, clock_reason=traces[key].clock_reason)
            if finished is not None:
                finished(key, traces[key])
        return traces


def _unfit(trace: Trace, clock: str) -> bool:
    """Whether a first recording has to be repeated on the wall clock."""
    return clock == AUTO and bool(trace.clock_reason) and not trace.harness_problem


@contextmanager
def open_session(
    isolation: str, workers: int | None = None, progress: Callable[[str], None] = lambda _: None
) -> Iterator[RecordingSession]:
    """Set a studio up, and take it down.

    Args:
        isolation: `auto`, `none` or the name of a tier.
        workers: How many scenarios are recorded side by side; None for as many as is of use here.
        progress: Hears which sandbox has to be tried, and why.

    Raises:
        EnvironmentFault: This machine lacks ROS or the tier asked for.
    """
    ros = find_ros()
    choice = choose_isolation(isolation, ros, progress)
    tier = choice.isolation
    domains = shared_domains() if tier.shares_network else private_domains()
    workers = workers or min(len(os.sched_getaffinity(0)), MOST_WORKERS)
    # Neither workers nor students' processes write byte code; what they load is compiled once here, not at every start.
    compile_own()
    with scratch_folder() as folder:
        folder.chmod(0o755)  # a student's process of another user reads the staged copy in it
        with Recorder(tier, ros.runtime, domains, scratch=folder, workers=workers) as recorder:
            recorder.warm_up(1)
            yield RecordingSession(ros, tier, choice.containment, recorder, folder)


def planned_clock(clock: str) -> str:
    """Return the clock that jobs are planned on at first."""
    return WALL if clock == WALL else VIRTUAL
