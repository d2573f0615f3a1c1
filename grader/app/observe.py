"""Runs nodes without a rubric and summarises what they do, for `grade observe`."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

from grader.app.grade import Progress, builtin_recording
from grader.app.interface_packages import provide
from grader.app.seeds import PRACTICE
from grader.core.errors import HarnessError, SubmissionError
from grader.core.quantities import NS_PER_S
from grader.core.report import Summary
from grader.core.scenario import OdometryStream, Scenario, Span
from grader.core.submission import Submission
from grader.core.trace import Trace
from grader.execution.bag import read_odometry
from grader.execution.plan import plan_scenario
from grader.execution.recording_session import open_session, planned_clock
from grader.execution.supervisor import Job
from grader.judging.judge_run import summarise
from grader.submissions.submission import stage_submission

#: When a given recording starts playing; before that the nodes receive no odometry.
ODOMETRY_AFTER_NS = NS_PER_S


@dataclass(frozen=True, slots=True)
class ObserveRequest:
    """What to observe, and how."""

    files: tuple[Path, ...]  # Python files; each runs in its own process
    duration_ns: int = 10 * NS_PER_S  # how long they are observed
    odom_bag: Path | None = None  # an /odom recording to play; None for no odometry
    clock: str = "auto"  # `virtual`, `wall` or `auto`
    isolation: str = "auto"  # `auto` or `none`
    interfaces: tuple[Path, ...] = ()  # folders with interface packages


@dataclass(frozen=True, slots=True)
class Watched:
    """The observed behaviour of the nodes."""

    trace: Trace
    processes: tuple[str, ...]  # file names of the processes
    isolation: str


def observe(request: ObserveRequest, progress: Progress) -> Summary:
    """Run the files together and summarise what they did."""
    watched = watch(request, progress)
    return summarise(watched.trace, watched.processes, watched.isolation)


def watch(request: ObserveRequest, progress: Progress, scenario: Scenario | None = None) -> Watched:
    """Run the files together and return the trace; without a scenario, only the given recording is played."""
    names = _names(request.files)
    if scenario is None:
        scenario = _undisturbed(request, names)
    plays = any(isinstance(stimulus, OdometryStream) for stimulus in scenario.stimuli)
    odometry = None
    if plays:
        odometry = builtin_recording() if request.odom_bag is None else read_odometry(request.odom_bag)
    with open_session(request.isolation, progress=progress) as session:
        submission = _stage(request.files, names, session.folder)
        seed, clock = PRACTICE.seed(submission.digest), planned_clock(request.clock)
        plan = plan_scenario("observe", scenario, submission, seed=seed, odometry=odometry, clock=clock)
        provided = provide(session, (), request.interfaces, submission.root)
        plan = replace(plan, interfaces=tuple(map(str, provided.folders)))
        trace = session.record({scenario.id: Job("observing", plan)}, request.clock, progress)[scenario.id]
    if trace.harness_problem:
        raise HarnessError(f"observe: expected a trace, found none: {trace.harness_problem}")
    return Watched(trace, tuple(names), session.isolation.name)


def _undisturbed(request: ObserveRequest, names: list[str]) -> Scenario:
    stream = OdometryStream("/odom", ODOMETRY_AFTER_NS, max(NS_PER_S, request.duration_ns - ODOMETRY_AFTER_NS))
    return Scenario("observed", tuple(names), Span(request.duration_ns), (stream,) if request.odom_bag else ())


def _names(files: tuple[Path, ...]) -> list[str]:
    """Return the file names; raises SubmissionError for duplicates and for anything but .py files."""
    for file in files:
        if not file.is_file() or file.suffix != ".py":
            raise SubmissionError(f"{file}: expected a .py file, found none", "name the files of the nodes to run")
    names = [file.name for file in files]
    for name in names:
        if names.count(name) > 1:
            raise SubmissionError(f"{name}: expected different file names, found it twice", "rename one of them")
    return names


def _stage(files: tuple[Path, ...], names: list[str], into: Path) -> Submission:
    """Stage what the files may import: their package, or else their common folder; a single file may be alone."""
    folder = Path(os.path.commonpath([file.resolve().parent for file in files]))
    package = next((up for up in (folder, *folder.parents) if (up / "package.xml").is_file()), folder)
    for place, root in enumerate(dict.fromkeys((package, folder))):
        staged = into / f"submission_{place}"
        staged.mkdir()
        try:
            submission = stage_submission(str(root), names, staged)
        except SubmissionError:
            if root == folder and len(files) > 1:
                raise
            continue
        # A package may have several files of a name.
        meant = [file.resolve().relative_to(root).as_posix() for file in files]
        if root == folder or [submission.files[name].found for name in names] == meant:
            return submission
    alone = into / "alone"
    alone.mkdir()
    return stage_submission(str(files[0]), names, alone)
