"""Runs nodes without a rubric and summarises what they do, for `grade observe`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import field, replace
from pathlib import Path

from grader.app.grade import Progress, builtin_recording
from grader.app.inputs import NamedSimulation, SentMessages, messages, simulated
from grader.app.interface_packages import provide
from grader.app.seeds import PRACTICE
from grader.core.dataclass import dataclass
from grader.core.errors import HarnessError, SubmissionError
from grader.core.quantities import NS_PER_S
from grader.core.report import Summary
from grader.core.scenario import OdometryStream, Scenario, Span
from grader.core.submission import Submission
from grader.core.trace import Trace
from grader.execution.bag import read_odometry
from grader.execution.executables import Executable, executables
from grader.execution.plan import plan_scenario
from grader.execution.recording_session import open_session, planned_clock
from grader.execution.shares import install_shares
from grader.execution.supervisor import Job
from grader.judging.summary import summarise
from grader.judging.values import student_endpoints
from grader.submissions.collected import listed
from grader.submissions.projects import read_projects
from grader.submissions.submission import stage_submission

#: When a given recording starts playing; before that the nodes receive no odometry.
ODOMETRY_AFTER_NS = NS_PER_S


@dataclass(frozen=True, slots=True)
class ObserveRequest:
    """What to observe, and how."""

    # Python files, launch files, packages, workspaces and executables as `FOLDER/NAME`; each runs in its own process
    files: tuple[Path, ...]
    duration_ns: int = 10 * NS_PER_S  # how long they are observed
    odom_bag: Path | None = None  # an /odom recording to play; None for no odometry
    clock: str = "auto"  # `virtual`, `wall` or `auto`
    isolation: str = "auto"  # `auto` or `none`
    interfaces: tuple[Path, ...] = ()  # folders with interface packages
    simulations: tuple[NamedSimulation, ...] = ()  # participants that react to what the programs publish
    sent: SentMessages = field(default_factory=dict)  # messages to send to them


@dataclass(frozen=True, slots=True)
class Watched:
    """The observed behaviour of the nodes."""

    trace: Trace
    processes: tuple[str, ...]  # file names of the processes
    isolation: str


def observe(request: ObserveRequest, progress: Progress) -> Summary:
    """Run the programs together and summarise what they did; twice if messages are sent, to learn their types first.

    Raises:
        GraderError: Nobody subscribes to a topic of a message to send, or it does not fit the type.
    """
    watched = watch(request, progress)
    if request.sent:
        types = {end.topic: end.type for end in student_endpoints(watched.trace, "subscription")}
        sent = messages(request.sent, types, request.duration_ns / NS_PER_S, request.interfaces)
        scenario = undisturbed(request, watched.processes)
        watched = watch(request, progress, replace(scenario, stimuli=(*scenario.stimuli, *sent)))
    return summarise(watched.trace, watched.processes, watched.isolation)


def watch(request: ObserveRequest, progress: Progress, scenario: Scenario | None = None) -> Watched:
    """Run the programs together and return the trace.

    Without a scenario, only the simulations take part, and the given recording is played.
    """
    targets = _targets(request.files)
    names = [target.name for target in targets]
    if scenario is None:
        scenario = undisturbed(request, names)
    plays = any(isinstance(stimulus, OdometryStream) for stimulus in scenario.stimuli)
    odometry = None
    if plays:
        odometry = builtin_recording() if request.odom_bag is None else read_odometry(request.odom_bag)
    with open_session(request.isolation, progress=progress) as session:
        submission = _stage(targets, session.folder)
        seed, clock = PRACTICE.seed(submission.digest), planned_clock(request.clock)
        plan = plan_scenario("observe", scenario, submission, seed=seed, odometry=odometry, clock=clock)
        provided = provide(session, (), request.interfaces, submission)
        installed = session.folder / "installed"
        prefixes, _ = install_shares(submission.root, submission.projects, installed, session.ros)
        plan = replace(plan, interfaces=tuple(map(str, provided.folders)), prefixes=prefixes)
        trace = session.record({scenario.id: Job("observing", plan)}, request.clock, progress)[scenario.id]
    if trace.harness_problem:
        raise HarnessError(f"observe: expected a trace, found none: {trace.harness_problem}")
    return Watched(trace, tuple(names), session.isolation.name)


def undisturbed(request: ObserveRequest, names: Sequence[str]) -> Scenario:
    """Return the scenario of programs with the simulations and the recording of a request, and no messages."""
    stream = OdometryStream("/odom", ODOMETRY_AFTER_NS, max(NS_PER_S, request.duration_ns - ODOMETRY_AFTER_NS))
    stimuli = (*simulated(request.simulations, request.interfaces), *((stream,) if request.odom_bag else ()))
    return Scenario("observed", tuple(names), Span(request.duration_ns), stimuli)


@dataclass(frozen=True, slots=True)
class _Target:
    """One process to run: a file, or an executable of a package."""

    name: str  # file name, or `PACKAGE/EXECUTABLE`
    folder: Path  # the folder of the file, or that of the packages
    file: Path | None = None


_WHAT = "name .py files, launch files, packages, workspaces or FOLDER/EXECUTABLE"


def _targets(paths: tuple[Path, ...]) -> list[_Target]:
    """Return what to run, in the given order; raises SubmissionError for duplicates and for anything else."""
    targets = [target for path in paths for target in _of_path(path)]
    names = [target.name for target in targets]
    for name in names:
        if names.count(name) > 1:
            raise SubmissionError(f"{name}: expected different names, found it twice", "rename one of them")
    return targets


def _of_path(path: Path) -> list[_Target]:
    if path.is_file() and path.suffix == ".py":
        return [_Target(path.name, path.resolve().parent, path)]
    if path.is_dir():
        found = [one for one in _executables(path.resolve()) if one.file is not None]
        if not found:
            text = f"{path}: expected a package or workspace with entry points, found none"
            raise SubmissionError(text, "name the files of the nodes to run, or add console_scripts to setup.py")
        return [_Target(one.words, path.resolve()) for one in found]
    here = path.resolve().parent
    known = _executables(here) if not path.exists() and here.is_dir() and path.suffix == "" else []
    named = [one for one in known if one.name == path.name and one.file is not None]
    if len(named) == 1:
        return [_Target(named[0].words, here)]
    if known:
        names = listed([one.words for one in known[:_SHOWN]])
        raise SubmissionError(
            f"{path}: expected an executable ({names}), found {'several' if named else 'none'}", _WHAT
        )
    raise SubmissionError(f"{path}: expected a .py file, found none", _WHAT)


def _executables(folder: Path) -> list[Executable]:
    projects, _ = read_projects(folder)
    return executables(folder, projects)


#: The most executables that a message lists.
_SHOWN = 12


def _stage(targets: list[_Target], into: Path) -> Submission:
    """Stage what the programs may import: their workspace or package, or else their common folder; one may be alone."""
    names, files = [target.name for target in targets], [target.file for target in targets]
    folder = Path(os.path.commonpath([target.folder for target in targets]))
    package = next((up for up in (folder, *folder.parents) if (up / "package.xml").is_file()), folder)
    for place, root in enumerate(dict.fromkeys((_workspace_of(package), package, folder))):
        staged = into / f"submission_{place}"
        staged.mkdir()
        meant = {
            name: file.resolve().relative_to(root).as_posix() for name, file in zip(names, files, strict=True) if file
        }
        try:
            submission = stage_submission(str(root), names, staged, meant)
        except SubmissionError:
            if root == folder and (len(files) > 1 or files[0] is None):
                raise
            continue
        if all(submission.files[name].found == path for name, path in meant.items()):  # a copy leaves some folders out
            return submission
    alone = into / "alone"
    alone.mkdir()
    return stage_submission(str(files[0]), names, alone)


def _workspace_of(package: Path) -> Path:
    """Return the folder with the packages that one may need: the `src` above it, or the next if it holds others."""
    source = next((up for up in package.parents[:MOST_LEVELS] if up.name == "src"), package.parent)
    found = (manifest for level in ("*", "*/*") for manifest in source.glob(f"{level}/package.xml"))
    beside = (manifest for manifest in found if manifest.parent != package)
    return source if (package / "package.xml").is_file() and any(beside) else package


#: How far above a package the folder `src` of its workspace may be: packages lie in it or in a repository in it.
MOST_LEVELS = 3
