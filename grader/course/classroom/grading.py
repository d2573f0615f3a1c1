"""The request to grade a class; chooses what is due, and grades it, each with the variant of its student."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import field, replace
from pathlib import Path

from grader.course.classroom.downloads import AUTO
from grader.course.classroom.intake import HandedInEntry
from grader.course.classroom.local import MakeScheduler, Task
from grader.course.classroom.outputs import GradedNow, Platforms
from grader.course.classroom.regrading import KeptRecordings, kept_recordings, regrade
from grader.course.classroom.roster import Person
from grader.course.classroom.store import Conditions, Kept, ResultStatus, State, Store, refused, unusable_digest
from grader.course.classroom.watching import Watcher
from grader.course.similarity.library import ComparedProgram
from grader.grading.app.grade import begun, read_exercises, wanted_files
from grader.grading.app.request import GradeRequest
from grader.grading.app.seeds import ByKey, SeedKey, checked_student, drawn_values, read_key
from grader.grading.model.exercise import Exercise
from grader.grading.reporting.html.assets import bundle
from grader.grading.rubrics.draws import Recorded
from grader.grading.submissions.submission import collect_submission, stage_collected, stage_submission
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError, GraderError, HarnessError, SubmissionError, VariantError
from grader.runtime.session import MORE_IN_CLASS, attempt_s, workers_for
from grader.runtime.temp_dirs import scratch_folder

#: Values of `--rerun`; each includes new and changed submissions.
CHANGED, FAILED, UNDECIDED, ALL = "changed", "failed", "undecided", "all"
#: Free disk space below which nothing can be graded, for results and temporary files.
LEAST_FREE_BYTES = 4 << 20
#: Seconds that an attempt may take in addition to the limits of its recordings.
_BEYOND_S = 300.0
_NOBODY = "cannot choose a variant: no student on the roster matches this submission with certainty"
_NO_ID = "cannot choose a variant: the roster has no number, user name or address for this student"


_GRADING = GradeRequest("")
_NO_PLATFORMS = Platforms()


@dataclass(frozen=True, slots=True)
class ClassRequest:
    """What to grade, and how."""

    sources: tuple[Path, ...]  # folders of submissions, or downloads
    results: Path
    layout: str = AUTO  # how submissions are named; one of those in `downloads`
    pattern: str = ""  # a regular expression for names, used instead of the layout; empty for none
    roster: Path | None = None  # CSV file of the class; None if there is none
    adjustments: Path | None = None  # YAML file of late days and changed scores; None if there is none
    grading: GradeRequest = _GRADING  # the request as for one submission; its path is ignored
    jobs: int | None = None  # submissions graded in parallel; None for one per processor
    rerun: str = CHANGED  # `--rerun`, one of the values above
    seed_key: SeedKey | None = None  # the key that seeds are derived from; None for the one stored with the results
    runs_here: bool = True  # whether programs run on this machine, where the kept recordings are
    title: str = ""  # of the page; empty for the names of the sources
    standalone: bool = False  # whether each HTML report is self-contained
    platforms: Platforms = _NO_PLATFORMS
    # Code handed out to everyone, ignored when submissions are compared; None to skip the comparison
    given: tuple[ComparedProgram, ...] | None = None
    # The options that the next run repeats: name without dashes -> values as they were typed
    options: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def handed_in_digest(entry: HandedInEntry, scratch: Path, wanted: Sequence[str]) -> tuple[str, SubmissionError | None]:
    """Return the digest of a submission, copied to an empty folder, and why it cannot be used, if so.

    Wanted are the names of the files that exercises ask for, for the hint. The digest is empty if it cannot be
    computed; grading the submission in its own process will report why.
    """
    if entry.problem:
        error = SubmissionError(entry.problem)
        return unusable_digest(error), error
    try:
        collected = collect_submission(str(entry.path), wanted, scratch)
        return stage_collected(collected, str(entry.path), (), scratch).digest, None
    except SubmissionError as error:
        return unusable_digest(error), error
    except (GraderError, OSError, MemoryError, RecursionError):
        return "", None


def due_now(store: Store, entries: Sequence[HandedInEntry], keys: Mapping[str, str], rerun: str) -> list[HandedInEntry]:
    """Select the submissions to grade; a stopped run with the same `--rerun` is resumed."""
    pending = store.pending(rerun)
    due = []
    for entry in entries:
        kept, key = store.kept(entry.name), keys[entry.name]
        again = is_due(kept, key, rerun) if pending is None else entry.name in pending
        if again or is_due(kept, key, CHANGED):
            due.append(entry)
    return due


def is_asked_for(store: Store, name: str, rerun: str) -> bool:
    """Whether a submission has to be graded although its result is current."""
    pending, kept = store.pending(rerun), store.kept(name)
    if pending is not None:
        return name in pending
    return kept.result is None or is_due(kept, kept.result.key, rerun)


def is_due(kept: Kept, key: str, rerun: str) -> bool:
    """Whether a submission has to be graded; the key is that of a current result, empty if unknown."""
    result, last = kept.result, kept.last
    if rerun == ALL or result is None or result.state is State.FAILED or not key or result.key != key:
        return True
    assert last is not None
    if rerun == UNDECIDED:
        return State.UNDECIDED in (result.state, last.state)
    return rerun == FAILED and bool({result.state, last.state} & {State.FAILED, State.REFUSED})


def deadline_s(budget_s: float) -> float:
    """Return the real time after which an attempt is killed; all its inner limits have expired by then."""
    return attempt_s(budget_s) + _BEYOND_S


@dataclass(frozen=True, slots=True)
class ClassRun:
    """One run of the command over a class."""

    course: ClassRequest
    exercises: Sequence[Exercise]
    conditions: Mapping[str, Conditions]  # name of a submission -> what its result depends on
    store: Store
    watcher: Watcher
    refusals: Mapping[str, SubmissionError]  # name of a submission -> why it cannot be used
    digests: Mapping[str, str]  # name of a submission -> its digest; empty if it cannot be computed
    # Name of a submission -> its recordings that can be used instead of a run
    recordings: Mapping[str, KeptRecordings] = field(default_factory=dict)

    def with_recordings(self, due: Sequence[HandedInEntry]) -> ClassRun:
        """Find the kept recordings of the submissions that are due only because of a changed rubric."""
        found: dict[str, KeptRecordings] = {}
        for entry in due:
            result, own = self.store.kept(entry.name).result, self.conditions[entry.name]
            if entry.name in self.refusals or is_asked_for(self.store, entry.name, self.course.rerun):
                continue
            if result is not None and result.recorded == own.recorded(self.digests[entry.name]):
                exercises = _graded_by(self.course, entry, own, self.exercises)
                kept = kept_recordings(self.store.place(entry.name), result, own, exercises, self.digests[entry.name])
                if kept is not None and (kept.suffice or self.course.runs_here):
                    found[entry.name] = kept
        return replace(self, recordings=found)

    @property
    def from_recordings(self) -> int:
        """How many submissions need no run, because their kept recordings suffice."""
        return sum(kept.suffice for kept in self.recordings.values())

    def grade(self, due: Sequence[HandedInEntry], warn: Callable[[str], None], make: MakeScheduler) -> GradedNow:
        """Grade submissions, from kept recordings where these suffice.

        Raises EnvironmentFault if nothing can be graded here, HarnessError if a disk is full; results so far are kept.
        """
        left = {entry.name for entry in due}
        if self.course.rerun != CHANGED:  # new or changed submissions are found without a note
            self.store.note_pending(self.course.rerun, left)
        for entry in due:
            if entry.name in self.refusals:
                status = refused(entry.label, self.conditions[entry.name], self.refusals[entry.name])
                self._take(entry.name, self.store.fresh(entry.name), status, left)
        usable = [entry for entry in due if entry.name not in self.refusals]
        if not usable:
            return GradedNow()
        for name, data in ({} if self.course.standalone else bundle().files).items():
            self.store.write(f"assets/{name}", data)
        judged = self._judge(usable, warn, left)
        to_run = [entry for entry in usable if entry.name not in judged]
        partly = [e.name for e in to_run if e.name in self.recordings and not self.recordings[e.name].suffice]
        not_replaced = self._schedule(to_run, warn, make, left) if to_run else ()
        return GradedNow(len(judged), len(to_run), len(partly), not_replaced)

    def _judge(self, usable: Sequence[HandedInEntry], warn: Callable[[str], None], left: set[str]) -> set[str]:
        """Judge kept recordings where these suffice, and return the names of the submissions that this worked for."""
        found = {entry.name: self.recordings[entry.name] for entry in usable if entry.name in self.recordings}
        work = {e.name: (self._task(e), found[e.name]) for e in usable if e.name in found and found[e.name].suffice}
        judged = set()
        with closing(regrade(work, self._jobs)) as attempts:
            for attempt in attempts:
                name, status = attempt.task.name, attempt.status
                if status.state is State.FAILED:
                    shutil.rmtree(attempt.task.into, ignore_errors=True)
                    warn(f"{name}: its recordings cannot be used, so it is run again: {status.problem}")
                    continue
                before = self.store.kept(name).result
                self._take(name, attempt.task.into, replace(status, usage={} if before is None else before.usage), left)
                judged.add(name)
        return judged

    @property
    def _jobs(self) -> int:
        return self.course.jobs or len(os.sched_getaffinity(0))

    def _schedule(
        self, to_run: Sequence[HandedInEntry], warn: Callable[[str], None], make: MakeScheduler, left: set[str]
    ) -> tuple[str, ...]:
        tasks = [self._task(entry) for entry in to_run]
        scheduler = make(self._jobs)
        for line in scheduler.prepare(self.course.grading.isolation):
            warn(line)
        not_replaced = []
        with closing(scheduler.run(tasks, self.watcher.step)) as attempts:
            for attempt in attempts:
                name = attempt.task.name
                if not self._take(name, attempt.task.into, attempt.status, left):
                    not_replaced.append(name)
                self._stop_if_full(attempt.status)
        return tuple(sorted(not_replaced))

    def _take(self, name: str, fresh: Path, status: ResultStatus, left: set[str]) -> bool:
        """Store the result of an attempt; return whether it replaced the earlier one."""
        self.store.remember(name, fresh, status)
        replaced = self.store.commit(name, fresh, status)
        left.discard(name)
        if self.course.rerun != CHANGED:
            self.store.note_done(name, last=not left)
        self.watcher.done(name, status)
        return replaced

    def _task(self, entry: HandedInEntry) -> Task:
        kept = self.recordings.get(entry.name)
        return Task(
            name=entry.name,
            label=entry.label,
            submission=entry.path,
            into=self.store.fresh(entry.name).resolve(),
            conditions=self.conditions[entry.name],
            workers=workers_for(len(os.sched_getaffinity(0)) // self._jobs, MORE_IN_CLASS),
            standalone=self.course.standalone,
            deadline_s=deadline_s(self.course.grading.time_budget_s),
            recordings=None if kept is None else kept.evidence.resolve(),
            spot_check=self.conditions[entry.name].draws(self.digests[entry.name]),
        )

    def _stop_if_full(self, status: ResultStatus) -> None:
        """Raise HarnessError if an attempt failed because a disk is full, as the others would fail too."""
        if status.state is not State.FAILED:
            return
        for place in (self.store, Store(Path(tempfile.gettempdir()))):
            if place.free_bytes < LEAST_FREE_BYTES:
                hint = "free some space; run the same command again to continue"
                raise HarnessError(f"{place.folder}: expected room for results, found the disk full", hint)


def _graded_by(
    course: ClassRequest, entry: HandedInEntry, conditions: Conditions, exercises: Sequence[Exercise]
) -> Sequence[Exercise]:
    """Return the exercises of one submission: of its student's variant, and with `every` only those with a file."""
    if conditions.variants is not None:
        exercises = read_exercises(replace(course.grading, draw=Recorded(conditions.variants)), course.sources)
    if not conditions.options.every:
        return exercises
    with scratch_folder() as scratch:
        staged = stage_submission(str(entry.path), wanted_files(exercises), scratch)
        return begun(exercises, staged)[0]


def student_of(person: Person | None) -> str:
    """Return the id that a person's variants are drawn for: number, else user name, else email address."""
    return "" if person is None else next((text for text in (person.id, person.user, person.email) if text), "")


def with_known_students(
    entries: Sequence[HandedInEntry], people: Mapping[str, Person], exercises: Sequence[Exercise]
) -> tuple[HandedInEntry, ...]:
    """If rubrics have variants, refuse the submissions whose student is not known."""
    if not vary(exercises):
        return tuple(entries)
    return tuple(entry if entry.problem else _known(entry, people.get(entry.name)) for entry in entries)


def _known(entry: HandedInEntry, person: Person | None) -> HandedInEntry:
    try:
        checked_student(student_of(person))
    except VariantError:
        return replace(entry, problem=_NOBODY if person is None else _NO_ID)
    return entry


def vary(exercises: Sequence[Exercise]) -> bool:
    """Whether any exercise has variants."""
    return any(exercise.variant is not None for exercise in exercises)


def refuse_without_key(course: ClassRequest, exercises: Sequence[Exercise]) -> None:
    """Raise VariantError or ClassError if exercises have variants and there is no variant key or no roster."""
    if not vary(exercises):
        return
    if course.grading.variant_key is None:
        text = "--variant-key: expected the variant key, because a rubric has variants, found none"
        raise VariantError(text, "name its file with --variant-key FILE")
    if course.roster is None:
        text = "--roster: expected the people of the class, because a rubric has variants, found no roster"
        raise ClassError(text, "name it with --roster CSV: it says which variant each student has")


def own_conditions(
    course: ClassRequest,
    entries: Sequence[HandedInEntry],
    people: Mapping[str, Person],
    exercises: Sequence[Exercise],
    conditions: Conditions,
) -> dict[str, Conditions]:
    """Return name of a submission -> the conditions it is graded with, which include its student's variant."""
    if not vary(exercises) or course.grading.variant_key is None:
        return {entry.name: conditions for entry in entries}
    key = read_key(course.grading.variant_key, "variant key")
    found: dict[str, Conditions] = {}
    for entry in entries:
        found[entry.name] = conditions
        if not entry.problem:
            draw = ByKey(key, checked_student(student_of(people.get(entry.name))))
            own = read_exercises(replace(course.grading, draw=draw), course.sources)
            digests = tuple((exercise.id, exercise.digest) for exercise in own)
            found[entry.name] = replace(conditions, rubrics=digests, variants=drawn_values(own, draw.student))
    return found
