"""The door of the runtime: opens sessions, in which runs are recorded, tests of rubrics run, and own nodes stepped.

A session has what recordings need (ROS, a sandbox, workers, a folder), and chooses the clock.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from grader.runtime.domains import domains_of
from grader.runtime.model.checkup import Property
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.projects import Project
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.plan import Plan
from grader.runtime.programs.shares import install_shares
from grader.runtime.ros_installation import RosInstallation, find_ros
from grader.runtime.sandbox.choose import OWN_PROGRAMS, Machine, TierChoice, choose_isolation
from grader.runtime.sandbox.protocol import Isolation
from grader.runtime.supervisor.byte_code import compile_own
from grader.runtime.supervisor.next_recording import AUTO, VIRTUAL, WALL, NextRecording, next_recording
from grader.runtime.supervisor.real_time_budget import RealTimeBudget
from grader.runtime.supervisor.stepping import LentWorker, SteppedRun, lend_stepped
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
    "LentWorker",
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
        finished: Callable[[Key, AssessedTrace], None] | None = None,
        *,
        budget: RealTimeBudget | None = None,
        on_wall: bool = True,
    ) -> dict[Key, AssessedTrace]:
        """Record jobs and return their traces, in the same order.

        With `auto`, a job that virtual time does not suit is recorded again; see `next_recording`. On the wall clock,
        jobs run one at a time, after all others, because they delay each other.

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
        traces: dict[Key, AssessedTrace] = {}

        def tell(key: Key, trace: AssessedTrace) -> None:
            trace = replace(trace, other_numpy=other_numpy(self.ros.distro))
            traces[key] = with_newer(trace, jobs[key].plan.root, self.ros.distro) if trace.faults() else trace
            if finished is not None:
                finished(key, traces[key])

        made: dict[Key, list[tuple[NextRecording, AssessedTrace]]] = {}
        wanted: dict[Key, NextRecording] = {}

        def go_on(key: Key) -> None:
            following = next_recording(made[key], clock, on_wall=on_wall)
            if isinstance(following, NextRecording):
                wanted[key] = following
            else:
                wanted.pop(key, None)
                tell(key, following)

        for key, job in jobs.items():
            # What no interpreter can run needs no worker.
            if (needless := trace_without_run(job.plan, job.programs)) is not None:
                tell(key, needless)
            else:
                made[key] = []
                go_on(key)
        while wanted:
            wave = [(key, want) for key, want in wanted.items() if want.clock != WALL or clock == WALL]
            wave = wave or [*wanted.items()][:1]
            again = [
                Job(f"{jobs[key].title}{want.title if made[key] else ''}", want.planned(jobs[key].plan), budget)
                for key, want in wave
            ]
            for (key, want), trace in zip(wave, self.recorder.each(again, progress), strict=True):
                made[key].append((want, trace))
                go_on(key)
        return {key: traces[key] for key in jobs}

    def record_tests(
        self,
        jobs: Mapping[Key, TestJob],
        progress: Callable[[str], None],
        budget: RealTimeBudget | None = None,
    ) -> dict[Key, AssessedTrace]:
        """Run tests of rubrics and return their traces, in the same order; raises EnvironmentFault without pytest."""
        return record_tests(self.recorder, jobs, progress, budget)

    def begin(self, plan: Plan) -> LentWorker:
        """Begin a run that is stepped, and return the worker that it has to itself; see `SteppedRun`.

        Args:
            plan: Limits, seed and clock of the run.

        Raises:
            HarnessError: No worker can be started.
        """
        return lend_stepped(self.recorder, plan)

    def install_shares(
        self, root: Path, projects: Sequence[Project], prefix: Path
    ) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Install the shared files of a staged submission's packages below a prefix.

        Returns:
            The folders of AMENT_PREFIX_PATH, none if there is no package; and sentences about what cannot be installed.
        """
        return install_shares(root, projects, prefix, self.ros)


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


@contextmanager
def open_session(  # noqa: PLR0913  what to open, and where progress goes
    isolation: str,
    workers: int | None = None,
    progress: Callable[[str], None] = lambda _: None,
    *,
    warm: bool = True,
    on_wall_clock: Callable[[], None] = lambda: None,
    executes: bool = False,
    own_network: bool = True,
) -> Iterator[RecordingSession]:
    """Open a recording session, and close it at the end of the block.

    Args:
        isolation: As for `choose_isolation`.
        workers: How many scenarios to record in parallel; None to choose by the number of processors.
        progress: Called with a message when a sandbox has to be tested.
        warm: Whether to start a worker at once, not when something is recorded.
        on_wall_clock: See `Recorder`.
        executes: See `Recorder`.
        own_network: Whether own programs get a network of their own, if possible.

    Raises:
        EnvironmentFault: This machine lacks ROS or the requested tier.
    """
    ros = find_ros(workspaces=isolation == OWN_PROGRAMS)
    choice = choose_isolation(isolation if own_network else NO_ISOLATION, Machine(ros), progress)
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
