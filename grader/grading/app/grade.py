"""Grades one submission from end to end, and keeps its recordings as evidence."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import grader
from grader.grading.app.bags import read_given, read_recordings, recordings_digest, refuse_unplayed
from grader.grading.app.interfaces import bag_definitions, definitions, known_interfaces, provided_for
from grader.grading.app.request import GradeRequest, reproduction
from grader.grading.app.seeds import PRACTICE_NOTE
from grader.grading.app.spot_checks import SpotChecks, check
from grader.grading.judging.beginnings import BeginningJudge
from grader.grading.judging.judge_run import judge_run
from grader.grading.model.exercise import Exercise, exercise_name
from grader.grading.model.report import Environment, Report
from grader.grading.model.run import Run
from grader.grading.rubrics.builtin import builtin_exercises, exercise_ids
from grader.grading.submissions.sources import HASHES, read_reaches, read_sources
from grader.grading.submissions.submission import stage_collected, stage_submission
from grader.runtime.interface_packages import Provided
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EvidenceError, SubmissionError
from grader.runtime.model.releases import TRIED
from grader.runtime.model.submission import Submission
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.model.wording import listed, printable
from grader.runtime.plan import Surroundings, derive, known_programs, plan_scenario
from grader.runtime.session import (
    AUTO,
    NO_ISOLATION,
    Job,
    RealTimeBudget,
    RecordingSession,
    TestJob,
    planned_clock,
)

#: Exercise id and scenario id.
Key = tuple[str, str]
#: Called at the start of each step with a short phrase such as `Exercise 1: velocity_publisher.py (alone)`.
Progress = Callable[[str], None]


class EarlyReports:
    """Makes a partial report whenever one exercise is completely recorded and others are not.

    An exercise without a scenario to record is judged along with the first that is recorded.
    """

    def __init__(
        self,
        exercises: Sequence[Exercise],
        scenarios: Collection[Key],
        run: Run,
        on_report: Callable[[Report], None],
    ) -> None:
        self._exercises = exercises
        self._awaited = set(scenarios)
        self._run = run
        self._on_report = on_report
        self._traces = dict(run.traces)
        self._started = time.perf_counter()

    def take(self, key: Key, trace: AssessedTrace) -> None:
        """Take a recording; make a partial report if it completes its exercise but not the whole run."""
        self._traces[key] = trace
        self._awaited.discard(key)
        pending = {exercise for exercise, _ in self._awaited}
        if pending and key[0] not in pending:
            duration_s = self._run.duration_s + time.perf_counter() - self._started
            run = replace(self._run, traces=dict(self._traces), duration_s=duration_s)
            self._on_report(judge_run(self._exercises, run, pictures=False, pending=pending))


def grade_in(  # noqa: PLR0913  what to grade, and where progress goes
    session: RecordingSession,
    request: GradeRequest,
    progress: Progress,
    on_recorded: Callable[[Run, Sequence[Exercise]], None] | None = None,
    on_partial_report: Callable[[Report], None] | None = None,
    *,
    pictures: bool = True,
    started: float | None = None,
) -> Report:
    """Grade one submission in a session, which others may use before and after it.

    Raises a GraderError whose class tells who must act. The complete recording and its exercises are passed to
    `on_recorded`; a partial report to `on_partial_report`, whenever one exercise is done and others are not. Pictures
    are charts, which only some formats show. The duration in the report begins at `started`, a reading of
    `time.perf_counter`; now if it is None.
    """
    started = time.perf_counter() if started is None else started
    with prepared_run(session, request, progress, started) as plans:
        ready, run = plans.ready, plans.run
        exercises, submission = ready.exercises, ready.submission
        asked = {*plans.jobs, *plans.tests}
        take = EarlyReports(exercises, asked, run, on_partial_report).take if on_partial_report else None
        checks = SpotChecks(request.spot_checks, run.seed, submission.digest, ready.reaches)
        later = request.clock == AUTO and checks.certain
        first = None if later else take
        budget = RealTimeBudget(request.time_budget_s, spent_s=ready.provided.spent_s)
        traces = session.record(plans.jobs, request.clock, progress, first, budget=budget)
        tested = session.record_tests(plans.tests, progress, budget)
        if request.clock == AUTO:
            # Spot checks are the grader's choice, so they do not count towards the submission's time budget.
            record = partial(_record_checks, session, progress, RealTimeBudget(request.time_budget_s))
            judge_of = partial(_judge_of, exercises, submission, run.sources)
            traces = check(checks, plans.jobs, traces, record, take or (lambda *_: None), judge_of)
        run = replace(run, traces={**run.traces, **traces, **tested}, duration_s=time.perf_counter() - started)
        run = replace(run, definitions=definitions(run.traces.values(), ready.provided))
        if on_recorded is not None:
            on_recorded(run, exercises)
        return judge_run(exercises, run, pictures=pictures)


@dataclass(frozen=True, slots=True)
class Preparation:
    """A submission that is read and staged, with what each part of the grader has added to its runs so far.

    Attributes:
        installed: An empty folder for what the submission's packages share.
        around: What the runs have besides the submission's files.
        played: Digest of the recordings that are played; empty if there are none.
        provided: The interface packages that are not installed.
        kept: The recordings that need not be made: those of an earlier run, and those that were handed in.
        reaches: What the submission's files use that reaches into their process.
    """

    session: RecordingSession
    request: GradeRequest
    exercises: Sequence[Exercise]
    submission: Submission
    installed: Path
    environment: Environment
    around: Surroundings
    played: str = ""
    provided: Provided = Provided()
    kept: Mapping[Key, AssessedTrace] = field(default_factory=dict)
    reaches: tuple[str, ...] = ()

    @property
    def unrecorded(self) -> list[Exercise]:
        """The exercises of which no recordings were kept."""
        bags = {(exercise.id, one.id) for exercise in self.exercises for one in exercise.scenarios if one.handed_in}
        recorded = {exercise for exercise, scenario in self.kept if (exercise, scenario) not in bags}
        return [exercise for exercise in self.exercises if exercise.id not in recorded]

    def noting(self, problems: Sequence[str]) -> Submission:
        """Return the submission with further notes."""
        return replace(self.submission, notes=(*self.submission.notes, *problems))


def _with_recordings(ready: Preparation) -> Preparation:
    """Add what the scenarios play."""
    recordings = read_recordings(ready.request, ready.exercises)
    played = recordings_digest(read_given(ready.request, recordings))
    return replace(ready, played=played, around=replace(ready.around, recordings=recordings))


def _with_interfaces(ready: Preparation) -> Preparation:
    """Add the interface packages that are not installed."""
    budget_s = ready.request.time_budget_s
    found = provided_for(ready.session, ready.exercises, ready.request.interfaces, ready.submission, budget_s)
    folders, trusted = tuple(map(str, found.folders)), tuple(map(str, found.trusted))
    around = replace(ready.around, interfaces=folders, trusted=trusted)
    return replace(ready, provided=found, submission=ready.noting(found.problems), around=around)


def _with_kept(ready: Preparation) -> Preparation:
    """Add the kept recordings that this run would make again with the same software; none if one is damaged."""
    if ready.request.recordings is None:
        return ready
    # Seldom needed.
    from grader.grading.app.kept_recordings import PlannedRun, kept_traces, recorded_alike  # noqa: PLC0415
    from grader.grading.evidence.store import open_evidence  # noqa: PLC0415 - takes long, and is seldom needed

    planned = PlannedRun(ready.submission.digest, ready.around.seed, ready.played, ready.provided.offered)
    try:
        evidence = open_evidence(ready.request.recordings)
        if evidence.manifest.environment != ready.environment:
            return ready
        return replace(ready, kept=kept_traces(evidence, recorded_alike(evidence, ready.exercises, planned)))
    except EvidenceError:
        return ready


def _with_handed_in(ready: Preparation) -> Preparation:
    """Add the traces of the recordings that were handed in; one that cannot be read counts as missing."""
    asked = [(e, s) for e in ready.exercises for s in e.scenarios if s.handed_in and (e.id, s.id) not in ready.kept]
    if not asked:
        return ready
    # Seldom needed.
    from grader.grading.submissions.bag_traces import UnreadableBag, bag_trace  # noqa: PLC0415

    files, traces = dict(ready.submission.files), dict(ready.kept)
    for exercise, scenario in asked:
        for wanted in scenario.wanted:
            found = files[wanted].found
            if found is None:
                continue
            brought = bag_definitions(exercise, ready.request.interfaces)
            read = bag_trace(ready.submission.root, found, scenario, brought)
            if isinstance(read, UnreadableBag):
                files[wanted] = replace(files[wanted], found=None, problem=read.problem, hint=read.hint)
            else:
                traces[exercise.id, scenario.id] = read
    return replace(ready, kept=traces, submission=replace(ready.submission, files=files))


def _with_shares(ready: Preparation) -> Preparation:
    """Add what the submission's packages share, such as launch files and parameter files."""
    if not ready.unrecorded:
        return ready
    submission = ready.submission
    prefixes, problems = ready.session.install_shares(submission.root, submission.projects, ready.installed)
    return replace(ready, submission=ready.noting(problems), around=replace(ready.around, prefixes=prefixes))


def _with_reaches(ready: Preparation) -> Preparation:
    """Add what the submission's files use that reaches into their process."""
    reaches = read_reaches(ready.submission.root, ready.submission.programs)
    return replace(ready, reaches=reaches, around=replace(ready.around, own_hashes=not HASHES.isdisjoint(reaches)))


#: What adds to the runs of a submission, each to what those before it have added: which recordings were kept depends
#: on what is played and built, and nothing is installed where all are.
CONTRIBUTORS: tuple[Callable[[Preparation], Preparation], ...] = (
    _with_recordings,
    _with_interfaces,
    _with_kept,
    _with_handed_in,
    _with_shares,
    _with_reaches,
)


@dataclass(frozen=True, slots=True)
class Prepared:
    """A prepared submission, and the recordings to make of it, by exercise and scenario."""

    ready: Preparation
    jobs: Mapping[Key, Job]
    tests: Mapping[Key, TestJob]
    run: Run  # all but the recordings to make


@contextmanager
def prepared_run(
    session: RecordingSession, request: GradeRequest, progress: Progress, started: float
) -> Iterator[Prepared]:
    """Read and stage a submission for the block, and plan its recordings; raises as `grade_in`."""
    # What cannot be removed now is removed with the folder of the session.
    with (
        TemporaryDirectory(prefix="submission-", dir=session.folder, ignore_cleanup_errors=True) as folder,
        TemporaryDirectory(prefix="installed-", dir=session.folder, ignore_cleanup_errors=True) as installed,
    ):
        progress("reading the submission")
        ready = _read(session, request, Path(folder), Path(installed))
        for add_to in CONTRIBUTORS:
            ready = add_to(ready)
        jobs = plan_jobs(ready.unrecorded, ready.submission, ready.around)
        tests = plan_tests(ready.unrecorded, ready.submission, ready.around)
        yield Prepared(ready, jobs, tests, _run_of(ready, started))


def _read(session: RecordingSession, request: GradeRequest, root: Path, installed: Path) -> Preparation:
    """Read the exercises, and stage the submission in an empty folder."""
    exercises = read_exercises(request)
    request = replace(request, exercises=exercise_ids(request.exercises, exercises))
    root.chmod(0o755)  # as the folder of the session
    if names_a_program(request):
        exercises, submission = _of_one_file(request, exercises, root)
    else:
        submission = _staged(request, exercises, root)
    if request.every:
        exercises, submission = begun(exercises, submission)
    seed = request.seed_key.seed(submission.digest) if request.seed is None else request.seed
    around = Surroundings(seed, planned_clock(request.clock))
    return Preparation(session, request, exercises, submission, installed, environment_of(session), around)


def _run_of(ready: Preparation, started: float) -> Run:
    """Return what is known of a run before its recordings are made."""
    request, submission, provided = ready.request, ready.submission, ready.provided
    return Run(
        submission=submission,
        traces=ready.kept,
        sources=read_sources(submission),
        environment=ready.environment,
        seed=ready.around.seed,
        duration_s=time.perf_counter() - started,
        notes=(*submission.notes, *_notes(request, ready.session), *provided.notes),
        reproduce=reproduction(request, ready.exercises, ready.played, ready.around.seed),
        interfaces=provided.packages,
        offered=provided.offered,
    )


def _judge_of(
    exercises: Sequence[Exercise], submission: Submission, sources: Mapping[str, str], key: Key
) -> BeginningJudge:
    """Return what judges the beginnings of the recordings of a scenario."""
    exercise = next(exercise for exercise in exercises if exercise.id == key[0])
    return BeginningJudge(exercise, key[1], submission, sources)


def _record_checks(
    session: RecordingSession, progress: Progress, budget: RealTimeBudget, jobs: Sequence[Job]
) -> Sequence[AssessedTrace]:
    return session.recorder.record([replace(job, budget=budget) for job in jobs], progress)


def read_exercises(
    request: GradeRequest, submissions: Sequence[Path] = (), *, recorded: bool = False
) -> list[Exercise]:
    """Read the exercises to grade, in rubric order; raises RubricError if a rubric or a requested exercise is unusable.

    Args:
        request: Names the rubrics and exercises.
        submissions: Other paths that students control: no rubric may load its own checks from there.
        recorded: Whether nothing will run, so that rubrics may name message types that are not installed here.
    """
    theirs = (*submissions, *([Path(request.submission)] if request.submission else []))
    if request.rubrics:
        # Takes long; built-in rubrics are compiled.
        from grader.grading.rubrics.loader import read_rubric  # noqa: PLC0415

        known = None if recorded else known_interfaces(request.interfaces)
        read = partial(read_rubric, submissions=theirs, draw=request.draw, interfaces=known)
        exercises = [read(path) for path in request.rubrics]
    else:
        exercises = list(builtin_exercises())
    refuse_unplayed(request.bags, exercises)
    chosen = exercise_ids(request.exercises, exercises)
    if request.exercises:
        return [exercise for exercise in exercises if exercise.id in chosen]
    return [e for e in exercises if request.rubrics or request.every or not e.by_request]


def plan_jobs(exercises: Sequence[Exercise], submission: Submission, around: Surroundings) -> dict[Key, Job]:
    """Plan the recordings, by exercise and scenario; scenarios with a missing file are left out."""
    return {
        (exercise.id, scenario.id): Job(
            f"{exercise_name(exercise.number)}: {', '.join(scenario.processes)} ({scenario.id.replace('_', ' ')})",
            plan_scenario(exercise.id, scenario, submission, around),
            programs=submission.programs,
        )
        for exercise in exercises
        for scenario in exercise.scenarios
        if scenario.test is None
        and scenario.handed_in is None
        and all(submission.files[name].found for name in scenario.wanted)
    }


def plan_tests(exercises: Sequence[Exercise], submission: Submission, around: Surroundings) -> dict[Key, TestJob]:
    """Plan the tests of rubrics, by exercise and scenario; a test imports no interfaces that the submission brings."""
    around = replace(around, clock=planned_clock(AUTO))
    jobs: dict[Key, TestJob] = {}
    for exercise in exercises:
        for scenario in exercise.scenarios:
            if scenario.test is None:
                continue
            handed_in = {name: submission.files[name] for name in scenario.processes}
            there = {name: file for name, file in handed_in.items() if file.found}
            jobs[exercise.id, scenario.id] = TestJob(
                f"{exercise_name(exercise.number)}: {scenario.test.name}",
                plan_scenario(exercise.id, scenario, submission, around),
                scenario.test,
                int(derive(around.seed, "test", exercise.id, scenario.id), 16),
                files=tuple((name, file.found or "", file.executable) for name, file in there.items()),
                missing=tuple(name for name in handed_in if name not in there),
                known=tuple(known_programs(submission)),
                provided=scenario.provided,
                paths=around.trusted,
            )
    return jobs


def begun(exercises: Sequence[Exercise], submission: Submission) -> tuple[list[Exercise], Submission]:
    """Return the exercises that a submission has a file for, and the submission limited to their files."""
    begun = [e for e in exercises if any(submission.files[name].found for name in e.wanted)]
    if not begun:
        where = printable(submission.path, 500)
        files = listed(wanted_files(exercises))
        raise SubmissionError(f"{where}: expected a file of an exercise, found none", f"the files are {files}")
    return begun, replace(submission, files={name: submission.files[name] for name in wanted_files(begun)})


def names_a_program(request: GradeRequest) -> bool:
    """Return whether a request names one .py file and no exercises: then those are graded that the file belongs to."""
    chosen = bool(request.exercises) or request.every or request.collected is not None
    named = not chosen and request.submission.casefold().endswith(".py")
    try:
        return named and Path(request.submission).is_file()
    except OSError:  # no file can have this name, which staging says
        return False


def _of_one_file(request: GradeRequest, usual: Sequence[Exercise], root: Path) -> tuple[list[Exercise], Submission]:
    """Stage the file of a request; return it with the exercises that it belongs to, or else with the usual ones."""
    every = read_exercises(replace(request, every=True))
    submission = _staged(request, every, root)
    chosen = belonging(every, submission) or list(usual)
    return chosen, replace(submission, files={name: submission.files[name] for name in wanted_files(chosen)})


def belonging(exercises: Sequence[Exercise], submission: Submission) -> list[Exercise]:
    """Return the exercises that the one file of a submission belongs to, by its name or else by its likeness."""
    looked_for = [(exercise, [submission.files[name] for name in exercise.files]) for exercise in exercises]
    named = [exercise for exercise, files in looked_for if any(file.found for file in files)]
    similar = [exercise for exercise, files in looked_for if any(file.similar for file in files)]
    return named or similar or [exercise for exercise, files in looked_for if any(file.likely for file in files)]


def wanted_files(exercises: Sequence[Exercise]) -> list[str]:
    """Return the names of the files that exercises require, and the patterns of recordings, without repetitions."""
    return list(dict.fromkeys(name for exercise in exercises for name in exercise.wanted))


def _staged(request: GradeRequest, exercises: Sequence[Exercise], root: Path) -> Submission:
    wanted = wanted_files(exercises)
    if request.collected is not None:
        return stage_collected(request.collected, request.submission, wanted, root)
    return stage_submission(request.submission, wanted, root)


def _notes(request: GradeRequest, session: RecordingSession) -> Iterator[str]:
    """Yield what readers must know of the seed, the release and the sandbox."""
    if request.seed is None and request.seed_key.public:
        yield PRACTICE_NOTE
    if session.ros.distro not in TRIED:
        yield f"this grader was never tested with ROS 2 {session.ros.distro}, only with {' and '.join(TRIED)}"
    lacking = [str(found) for found in session.containment if not found.holds]
    if session.isolation.name == NO_ISOLATION:
        yield "the submission ran without a sandbox, as requested"
    elif lacking:
        yield f"sandbox {session.isolation.name}: {'; '.join(lacking)}"


def environment_of(session: RecordingSession) -> Environment:
    """Return the software that a session records with."""
    return Environment(
        grader=grader.__version__,
        ros_distro=session.ros.distro,
        rclpy=session.ros.rclpy_version,
        rmw="rmw_fastrtps_cpp",
        python=platform.python_version(),
        isolation=session.isolation.name,
        containment=session.containment,
    )
