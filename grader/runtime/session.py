"""The door of the runtime: opens sessions, in which runs are recorded, tests of rubrics run, and own nodes stepped.

A session has what recordings need (ROS, a sandbox, workers, a folder), and chooses the clock.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TypeVar

from grader.runtime.domains import domains_of
from grader.runtime.model.checkup import Property
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.projects import Project
from grader.runtime.model.trace import Trace
from grader.runtime.programs.shares import install_shares
from grader.runtime.ros_installation import RosInstallation, find_ros
from grader.runtime.sandbox.choose import OWN_PROGRAMS, Machine, TierChoice, choose_isolation
from grader.runtime.sandbox.protocol import Isolation
from grader.runtime.supervisor.byte_code import compile_own
from grader.runtime.supervisor.pace import keeps_pace
from grader.runtime.supervisor.real_time_budget import RealTimeBudget
from grader.runtime.supervisor.stepping import SteppedRun
from grader.runtime.supervisor.supervisor import MARGIN_S, TRIES, Job, Recorder, WorkerLostError
from grader.runtime.supervisor.test_runs import VARIABLE, TestJob, collected_tests, record_tests
from grader.runtime.temp_dirs import scratch_folder

__all__ = [
    "AUTO",
    "MORE_IN_CLASS",
    "NO_ISOLATION",
    "OWN_PROGRAMS",
    "VIRTUAL",
    "WALL",
    "Job",
    "RealTimeBudget",
    "RecordingSession",
    "SteppedRun",
    "TestJob",
    "TierChoice",
    "WorkerLostError",
    "attempt_s",
    "collected_tests",
    "open_session",
    "planned_clock",
    "runs_a_test",
    "sandbox_here",
    "workers_for",
]

#: The name of a run without a sandbox in reports.
NO_ISOLATION = "none"
#: How many more scenarios than there are processors are recorded at once, because nodes wait for discovery in between:
#: of a submission alone, and of one in a class, whose others use the processors as well.
MORE_ALONE, MORE_IN_CLASS = 3, 1
#: The most scenarios of a submission that are recorded at once, because each takes memory.
MOST_WORKERS = 6
#: The values of `--clock`: `auto` is virtual time, with the wall clock where virtual time is unsuitable.
VIRTUAL, WALL, AUTO = "virtual", "wall", "auto"

#: The reason for the wall clock where a node is slower than it seems in virtual time.
DRIFTS = "the node pauses after its work, so that virtual time would hide how slow it is"
#: What readers see where the machine was too busy to find out on the wall clock.
CHARGED_NOTE = "the machine was too busy for the wall clock: the measured time of the nodes' work was counted instead"
#: The same work takes longer on a busy machine, which shares caches and cores: by up to a third was seen with ten
#: programs for each processor. A node that keeps its pace if only this share counts may keep it on an idle machine.
SURE_SHARE = 0.75
#: How often the work of such a node is counted at most: the fastest is right.
COUNTED_TIMES = 3
#: Why the recording is not judged if it remains unclear.
UNCLEAR = "the machine was too busy to tell whether the nodes are fast enough"
#: Nodes that waited for a processor for more than this share of the time are slower than on an idle machine, on which
#: they wait for less than 1 %.
HELD_UP_SHARE = 0.03

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True, slots=True)
class RecordingSession:
    """The resources that a run is recorded with.

    Attributes:
        ros: The ROS installation that nodes run on.
        isolation: The sandbox tier.
        containment: What the self-test found the sandbox to prevent; empty without a sandbox.
        shared: Why own programs share the network of this machine, in words; empty if they do not.
        recorder: Runs jobs in its workers.
        folder: A temporary folder, removed at the end.
    """

    ros: RosInstallation
    isolation: Isolation
    containment: tuple[Property, ...]
    shared: str
    recorder: Recorder
    folder: Path

    def record(  # noqa: PLR0913  what to record, and where progress goes
        self,
        jobs: Mapping[Key, Job],
        clock: str,
        progress: Callable[[str], None],
        finished: Callable[[Key, Trace], None] | None = None,
        *,
        budget: RealTimeBudget | None = None,
        on_wall: bool = True,
    ) -> dict[Key, Trace]:
        """Record jobs and return their traces, in the same order.

        With `auto`, a job that virtual time does not suit is recorded again on the wall clock. These jobs run one at a
        time, because parallel ones would disturb each other. Where the work of a node may slow it down, a recording in
        virtual time that counts this work decides whether the wall clock is needed, and takes its place if the machine
        is too busy for it.

        Args:
            jobs: Planned on the virtual clock, or on the wall clock for `wall`.
            clock: `virtual`, `wall` or `auto`.
            progress: Called with the title of each job that starts.
            finished: Called with each trace once it is final, while others are still being recorded.
            budget: Real time that all jobs may take together; None for any.
            on_wall: Whether to record on the wall clock at all. If not, what `auto` would record there is the beginning
                in virtual time, with the reason.
        """
        from grader.runtime.supervisor.newer_python import with_newer  # noqa: PLC0415 - as the next ones
        from grader.runtime.supervisor.numpy_version import other_numpy  # noqa: PLC0415

        # After a worker has been started.
        from grader.runtime.supervisor.unrunnable import trace_without_run  # noqa: PLC0415

        budget = budget or RealTimeBudget()
        # What no interpreter can run needs no worker.
        needless = {key: trace_without_run(job.plan, job.programs) for key, job in jobs.items()}
        known = {key: trace for key, trace in needless.items() if trace is not None}
        to_run = {key: job for key, job in jobs.items() if key not in known}
        first = [Job(job.title, replace(job.plan, stop_when_unfit=clock == AUTO), budget) for job in to_run.values()]
        traces: dict[Key, Trace] = {}
        recorded = zip(to_run, self.recorder.each(first, progress), strict=True)

        def tell(key: Key, trace: Trace) -> None:
            trace = replace(trace, other_numpy=other_numpy(self.ros.distro))
            traces[key] = with_newer(trace, jobs[key].plan.root, self.ros.distro) if trace.faults() else trace
            if finished is not None:
                finished(key, traces[key])

        for key, trace in chain(known.items(), recorded):
            traces[key] = trace
            if not (_unfit(trace, clock) or _doubtful(trace, clock)):
                tell(key, trace)
        # After all others, so that these recordings do not take processors from first ones.
        doubtful = {key: jobs[key] for key, trace in traces.items() if _doubtful(trace, clock)}
        charged = self._charged(doubtful, budget, progress)
        for key, trace in charged.items():
            # The first recording stays, because its times are those of a machine that is fast enough.
            if keeps_pace(traces[key], trace):
                tell(key, traces[key])
            else:
                traces[key] = replace(traces[key], clock_reason=DRIFTS)
        for key in [key for key, trace in traces.items() if _unfit(trace, clock)]:
            if not on_wall:
                tell(key, traces[key])
                continue
            again = Job(f"{jobs[key].title}, on the wall clock", replace(jobs[key].plan, clock=WALL), budget)
            # One at a time: nodes on the wall clock that run beside each other delay each other.
            repeated = replace(self.recorder.record([again], progress)[0], clock_reason=traces[key].clock_reason)
            # Only where work was the reason: a program that waits for something outside needs the wall clock.
            if traces[key].may_drift and _was_held_up(repeated):
                repeated = self._counted(jobs[key], traces[key], repeated, charged.get(key), budget, progress)
            tell(key, repeated)
        return {key: traces[key] for key in jobs}

    def record_tests(
        self,
        jobs: Mapping[Key, TestJob],
        progress: Callable[[str], None],
        budget: RealTimeBudget | None = None,
    ) -> dict[Key, Trace]:
        """Run tests of rubrics and return their traces, in the same order; raises EnvironmentFault without pytest."""
        return record_tests(self.recorder, jobs, progress, budget)

    def install_shares(
        self, root: Path, projects: Sequence[Project], prefix: Path
    ) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Install the shared files of a staged submission's packages below a prefix.

        Returns:
            The folders of AMENT_PREFIX_PATH, none if there is no package; and sentences about what cannot be installed.
        """
        return install_shares(root, projects, prefix, self.ros)

    def _charged(
        self, jobs: Mapping[Key, Job], budget: RealTimeBudget, progress: Callable[[str], None], share: float = 1.0
    ) -> dict[Key, Trace]:
        """Record jobs once more in virtual time, in which time now passes while nodes work, or a share of it."""
        plans = {key: replace(job.plan, charged=share, stop_when_unfit=share == 1) for key, job in jobs.items()}
        again = [Job(f"{jobs[key].title}, with the time of its work", plan, budget) for key, plan in plans.items()]
        return dict(zip(plans, self.recorder.record(again, progress), strict=True)) if again else {}

    def _counted(  # noqa: PLR0913  what was recorded, and what to record with
        self,
        job: Job,
        plain: Trace,
        held_up: Trace,
        charged: Trace | None,
        budget: RealTimeBudget,
        progress: Callable[[str], None],
    ) -> Trace:
        """Return the recording that counts where the machine is too busy for the wall clock.

        Args:
            job: What is recorded.
            plain: The recording in virtual time.
            held_up: The one on the wall clock.
            charged: One in virtual time with the time of the work, if there is one yet.
            budget: See `record`.
            progress: See `record`.
        """

        def record(share: float) -> Trace:
            return self._charged({"": job}, budget, progress, share)[""]

        def surely_slow() -> bool:
            trace = record(SURE_SHARE)
            return not (trace.harness_problem or keeps_pace(plain, trace))

        for number in range(COUNTED_TIMES):
            trace = charged if charged is not None and number == 0 else record(1.0)
            if trace.clock_reason or trace.harness_problem:
                return held_up
            if keeps_pace(plain, trace) or (number == 0 and surely_slow()):
                return replace(trace, notes=(*trace.notes, CHARGED_NOTE))
        return replace(held_up, harness_problem=held_up.harness_problem or UNCLEAR)


def sandbox_here(wanted: str) -> TierChoice:
    """Choose the sandbox that a session would use on this machine, which may be tested for it.

    Args:
        wanted: As for `open_session`.

    Raises:
        EnvironmentFault: This machine lacks ROS or the requested tier.
    """
    return choose_isolation(wanted, Machine(find_ros()))


def attempt_s(budget_s: float) -> float:
    """Return the real time, in seconds, in which a session gives up what has a budget, and each worker that hangs."""
    return budget_s + TRIES * MARGIN_S


def runs_a_test() -> bool:
    """Return whether this process runs the tests of a rubric: its programs run in the session of another process."""
    return bool(os.environ.get(VARIABLE))


def workers_for(processors: int, more: int = MORE_ALONE) -> int:
    """Return how many scenarios of one submission to record in parallel on so many processors."""
    # More than processors, because a recording also waits for discovery, which takes no processor time.
    return min(max(1, processors) + more, MOST_WORKERS)


def _unfit(trace: Trace, clock: str) -> bool:
    """Return whether a first recording has to be repeated on the wall clock.

    A failure of the grader's own code that makes virtual time unsuitable is not one of the wall clock, where little of
    that code runs.
    """
    failed = trace.harness_problem not in ("", trace.clock_reason)
    return clock == AUTO and bool(trace.clock_reason) and not failed


def _doubtful(trace: Trace, clock: str) -> bool:
    """Return whether only another recording can tell that virtual time suits the nodes."""
    return clock == AUTO and trace.may_drift and not trace.clock_reason and not trace.harness_problem


def _was_held_up(trace: Trace) -> bool:
    """Return whether a recording on the wall clock shows how busy the machine was, more than how fast the nodes are."""
    return bool(trace.harness_problem) or trace.most_starved_ns > HELD_UP_SHARE * trace.stop_ns


@contextmanager
def open_session(  # noqa: PLR0913  what to open, and where progress goes
    isolation: str,
    workers: int | None = None,
    progress: Callable[[str], None] = lambda _: None,
    *,
    warm: bool = True,
    on_wall_clock: Callable[[], None] = lambda: None,
    executes: bool = False,
) -> Iterator[RecordingSession]:
    """Open a recording session, and close it at the end of the block.

    Args:
        isolation: As for `choose_isolation`.
        workers: How many scenarios to record in parallel; None to choose by the number of processors.
        progress: Called with a message when a sandbox has to be tested.
        warm: Whether to start a worker at once, not when something is recorded.
        on_wall_clock: See `Recorder`.
        executes: See `Recorder`.

    Raises:
        EnvironmentFault: This machine lacks ROS or the requested tier.
    """
    ros = find_ros(workspaces=isolation == OWN_PROGRAMS)
    choice = choose_isolation(isolation, Machine(ros), progress)
    tier = choice.isolation
    workers = workers or workers_for(len(os.sched_getaffinity(0)))
    # Neither workers nor student processes write byte code, so their modules are compiled here, once.
    compile_own()
    with domains_of(shared=tier.shares_network) as domains, scratch_folder() as folder:
        folder.chmod(0o755)  # students' processes may run as another user and have to read the staged copy
        kept = Recorder(
            tier,
            ros.runtime,
            domains,
            scratch=folder,
            workers=workers,
            on_wall_clock=on_wall_clock,
            executes=executes,
        )
        with kept as recorder:
            if warm:
                recorder.warm_up(workers)
            yield RecordingSession(ros, tier, choice.containment, choice.lacks, recorder, folder)


def planned_clock(clock: str) -> str:
    """Return the clock to plan jobs on for a value of `--clock`."""
    return WALL if clock == WALL else VIRTUAL
