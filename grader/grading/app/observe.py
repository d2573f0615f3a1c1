"""Runs nodes without a rubric and summarises what they do, for `grade observe`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path

from grader.grading.app.bags import played_bags, recordings_of
from grader.grading.app.grade import Progress
from grader.grading.app.inputs import NamedSimulation, SentMessages, messages, simulated
from grader.grading.app.interfaces import types_in
from grader.grading.app.programs import find_targets, stage
from grader.grading.app.seeds import PRACTICE
from grader.grading.judging.summary import summarise
from grader.grading.judging.values import student_endpoints
from grader.grading.model.report import Summary
from grader.grading.rubrics.simulations import offered_by
from grader.grading.submissions.sources import read_files
from grader.runtime.interface_packages import provide
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.limits import MOST_LAUNCHED, Limits
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import RunOptions, Scenario, Span, is_launch_file
from grader.runtime.model.submission import Submission
from grader.runtime.model.trace import AssessedTrace, ClockKind
from grader.runtime.plan import Surroundings, plan_scenario
from grader.runtime.session import AUTO, VIRTUAL, Job, RecordingSession, open_session, planned_clock
from grader.runtime.stimuli import RecordedStream

#: When a given recording starts playing; before that the nodes receive nothing of it.
RECORDED_AFTER_NS = NS_PER_S


@dataclass(frozen=True, slots=True)
class ObserveRequest:
    """What to observe, and how."""

    # Python files, launch files, packages, workspaces and executables as `FOLDER/NAME`; each runs in its own process
    files: tuple[Path, ...]
    duration_ns: int = 10 * NS_PER_S  # how long they are observed
    bags: tuple[tuple[str, Path], ...] = ()  # recordings to play: `(topic or message type, path)`
    clock: str = "auto"  # `virtual`, `wall` or `auto`
    isolation: str = "auto"  # `auto` or `none`
    interfaces: tuple[Path, ...] = ()  # folders with interface packages
    simulations: tuple[NamedSimulation, ...] = ()  # participants that react to what the programs publish
    sent: SentMessages = field(default_factory=dict)  # messages to send to them
    launch_arguments: tuple[tuple[str, str], ...] = ()  # name and value, for the launch files among the programs


@dataclass(frozen=True, slots=True)
class Watched:
    """The observed behaviour of the nodes."""

    trace: AssessedTrace
    processes: tuple[str, ...]  # file names of the processes
    isolation: str
    sources: Mapping[str, str] = field(default_factory=dict)  # the text of their files, and of those that faults name


def observe_programs(request: ObserveRequest, progress: Progress) -> Summary:
    """Run the programs together and summarise what they did; twice if messages are sent, to learn their types first.

    Raises:
        GraderError: Nobody subscribes to a topic of a message to send, or it does not fit the type.
    """
    watched = watch(request, progress)
    scenario = undisturbed(request, watched.processes)
    if request.sent:
        types = {end.topic: end.type for end in student_endpoints(watched.trace, "subscription")}
        sent = messages(request.sent, types, request.duration_ns / NS_PER_S, request.interfaces)
        watched = watch(request, progress, replace(scenario, stimuli=(*scenario.stimuli, *sent)))
    served = [service for one in offered_by(scenario.stimuli) for service in one.serves]
    return summarise(watched.trace, watched.processes, watched.isolation, watched.sources, served)


def watch(request: ObserveRequest, progress: Progress, scenario: Scenario | None = None) -> Watched:
    """Run the programs together and return the trace.

    Without a scenario, only the simulations take part, and the given recording is played.
    """
    known = find_targets(request.files)
    targets = known.targets
    names = [target.name for target in targets]
    if scenario is None:
        scenario = undisturbed(request, names)
    streams = [stimulus for stimulus in scenario.stimuli if isinstance(stimulus, RecordedStream)]
    recordings = recordings_of(streams, request.interfaces)
    with open_session(request.isolation, progress=progress) as session:
        submission = stage(targets, session.folder)
        provided = provide(session, submission, course=request.interfaces, text=types_in([scenario]))
        installed = session.folder / "installed"
        prefixes, _ = session.install_shares(submission.root, submission.projects, installed)
        around = Surroundings(
            PRACTICE.seed(submission.digest),
            planned_clock(request.clock),
            recordings,
            tuple(map(str, provided.folders)),
            prefixes=prefixes,
        )
        plan = plan_scenario("observe", scenario, submission, around)
        job = Job("observing", plan, programs=submission.programs)
        trace = session.record({scenario.id: job}, request.clock, progress)[scenario.id]
        if trace.harness_problem and trace.clock is ClockKind.WALL and request.clock == AUTO:
            trace = _in_virtual_time(session, scenario, job, trace, progress)
        sources = _sources(trace, submission)
    if trace.harness_problem:
        raise HarnessError(f"observe: expected a trace, found none: {trace.harness_problem}")
    trace = replace(trace, notes=(*known.notes, *submission.notes, *trace.notes))
    return Watched(trace, tuple(names), session.isolation.name, sources)


#: What is true of the summary of programs that virtual time does not suit, where the machine is too busy for the other
#: clock: nothing is judged by it.
_TOO_BUSY = "recorded in virtual time, which hides how slow a program is, because this machine is too busy for the wall"


def _in_virtual_time(
    session: RecordingSession, scenario: Scenario, job: Job, held_up: AssessedTrace, progress: Progress
) -> AssessedTrace:
    """Return a whole recording in virtual time where there is none on the wall clock, with the reason; or that one."""
    again = replace(job, title="observing in virtual time")
    whole = session.record({scenario.id: again}, VIRTUAL, progress)[scenario.id]
    if whole.harness_problem:
        return held_up
    why = f": {held_up.clock_reason}" if held_up.clock_reason else ""
    return replace(whole, clock_reason="", notes=(f"{_TOO_BUSY} clock{why}", *whole.notes))


def _sources(trace: AssessedTrace, submission: Submission) -> dict[str, str]:
    """Return the text of the programs and of the files that faults name, by path; none for one that is not text."""
    named = {fault.file for fault in trace.faults()} | {start.file for start in trace.starts}
    named |= {file.found for file in submission.files.values() if file.found}
    # the paths are those of staged files: a process cannot name others
    return dict(read_files(submission, sorted(filter(None, named))))


def undisturbed(request: ObserveRequest, names: Sequence[str]) -> Scenario:
    """Return the scenario of programs with the simulations and the recording of a request, and no messages."""
    played = played_bags(request.bags, RECORDED_AFTER_NS, max(NS_PER_S, request.duration_ns - RECORDED_AFTER_NS))
    stimuli = (*simulated(request.simulations, request.interfaces), *played)
    launched = sum(map(is_launch_file, names)) * MOST_LAUNCHED
    limits = Limits(participants=Limits().participants + len(names) + launched)
    options = RunOptions(launch_arguments=request.launch_arguments)
    run = tuple((name, options) for name in names if is_launch_file(name) and request.launch_arguments)
    return Scenario("observed", tuple(names), Span(request.duration_ns), stimuli, limits=limits, run=run)
