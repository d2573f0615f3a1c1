"""A class graded from end to end: the visible list of stages."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import grader
from grader.batch.adjustments import Adjustments, read_adjustments
from grader.batch.choosing import CHANGED, is_due, key_of
from grader.batch.classbook import Classbook, ReportData, decisions_for, make_classbook
from grader.batch.intake import Entry, Intake, take_in
from grader.batch.keys import Conditions, unusable_digest
from grader.batch.layouts import AUTO
from grader.batch.local import LocalScheduler
from grader.batch.matching import Matching, match
from grader.batch.outputs import CLASS, Platforms, class_files, exports
from grader.batch.people import read_roster
from grader.batch.standing import Standing, State
from grader.batch.store import Store, open_store
from grader.batch.summary import Graded, summary_json
from grader.batch.tasks import Attempt, MakeScheduler, Task
from grader.batch.watching import Watcher
from grader.batch.worker import GRADESCOPE, REPORT
from grader.model.containment import missing
from grader.model.errors import HarnessError, SubmissionError
from grader.model.exercise import Exercise
from grader.model.quantities import NS_PER_S
from grader.recording.isolation.choose import choose_isolation
from grader.recording.leftovers import scratch_folder
from grader.recording.recorder import MARGIN_S, TRIES
from grader.recording.ros_installation import find_ros
from grader.reports.html.bundle import shared_assets
from grader.reproducing import recording_digest
from grader.session import Request, read_exercises, read_recording

#: Less room than this, where results or scratch files go, and nothing can be graded.
LEAST_FREE_BYTES = 4 << 20
#: Seconds that an attempt may take beyond what its recordings may.
_BEYOND_S = 300.0
_GRADING = Request("")
_NO_PLATFORMS = Platforms()


@dataclass(frozen=True, slots=True)
class Course:
    """What is to be graded, and how.

    Attributes:
        sources: Folders of submissions, or downloads.
        results: Folder for results.
        layout: How submissions are named; see `layouts`.
        pattern: A regular expression for names, instead; empty for none.
        roster: CSV file of the people; None if there is none.
        adjustments: YAML file of late days and other scores; None if there is none.
        grading: As for one submission; its path says nothing.
        jobs: Submissions at a time; None for one a processor.
        rerun: See `choosing`.
        standalone: Whether each HTML report can be sent away alone.
        platforms: What else is written for the class.
    """

    sources: tuple[Path, ...]
    results: Path
    layout: str = AUTO
    pattern: str = ""
    roster: Path | None = None
    adjustments: Path | None = None
    grading: Request = _GRADING
    jobs: int | None = None
    rerun: str = CHANGED
    standalone: bool = False
    platforms: Platforms = _NO_PLATFORMS


def grade_class(
    course: Course,
    watcher: Watcher,
    warn: Callable[[str], None],
    make_scheduler: MakeScheduler = LocalScheduler,
) -> Graded:
    """Grade a class, or go on with it.

    Args:
        course: What is to be graded, and how.
        watcher: Hears how it gets on.
        warn: Hears what an instructor must know before it begins.
        make_scheduler: Makes what grades so many submissions at a time.

    Raises:
        GraderError: Something that grading needs cannot be used; its class says who must act.
    """
    exercises = read_exercises(course.grading)
    conditions = conditions_of(course.grading, exercises)
    roster = None if course.roster is None else read_roster(course.roster)
    adjustments = Adjustments() if course.adjustments is None else read_adjustments(course.adjustments)
    with open_store(course.results) as store:
        intake = take_in(course.sources, course.results, layout=course.layout, pattern=course.pattern)
        matching = match(intake.entries, roster)
        decisions_for(intake.entries, matching, adjustments)  # a slip in it is told before hours of grading
        with scratch_folder() as scratch:
            keys = {entry.name: _key(entry, conditions, scratch) for entry in intake.entries}
        due = [e for e in intake.entries if is_due(store.kept(e.name), keys[e.name], course.rerun)]
        not_replaced = _grade_due(course, due, exercises, conditions, store, watcher, warn, make_scheduler)
        book = _book(store, intake, matching, adjustments, keys)
        graded = Graded(book, len(due), len(intake.entries) - len(due), tuple(not_replaced))
        return _written(graded, store, course.platforms)


def conditions_of(grading: Request, exercises: Sequence[Exercise]) -> Conditions:
    """Return what all results of a class depend on; raises RecordingError for a recording that cannot be used."""
    odometry = read_recording(grading, exercises)
    return Conditions(
        grader=grader.__version__,
        rubrics=tuple((exercise.id, exercise.digest) for exercise in exercises),
        recording="" if odometry is None else recording_digest(odometry),
        seed=grading.seed,
        clock=grading.clock,
        isolation=grading.isolation,
    )


def deadline_s(exercises: Sequence[Exercise]) -> float:
    """Return the real time after which grading one submission is given up: every limit inside has passed by then."""
    each = [2 * s.limits.wall_ns / NS_PER_S + MARGIN_S for e in exercises for s in e.scenarios]
    clocks = 2
    return clocks * TRIES * sum(each) + _BEYOND_S


def _key(entry: Entry, conditions: Conditions, scratch: Path) -> str:
    if entry.problem:
        return conditions.key(unusable_digest(SubmissionError(entry.problem)))
    with tempfile.TemporaryDirectory(dir=scratch) as folder:
        return key_of(entry, conditions, Path(folder))


def _grade_due(  # noqa: PLR0913  the stages hand on what they made
    course: Course,
    due: Sequence[Entry],
    exercises: Sequence[Exercise],
    conditions: Conditions,
    store: Store,
    watcher: Watcher,
    warn: Callable[[str], None],
    make_scheduler: MakeScheduler,
) -> list[str]:
    """Grade what is due; return the names of those whose result is still the one of before."""
    refused = [entry for entry in due if entry.problem]
    usable = [entry for entry in due if not entry.problem]
    watcher.begin(len(due), 0)
    not_replaced: list[str] = []
    for entry in refused:
        standing = _refused(entry, conditions)
        store.commit(entry.name, store.fresh(entry.name), standing)
        watcher.done(entry.name, standing)
    if not usable:
        return not_replaced
    _prepare(course, store, warn)
    jobs = course.jobs or len(os.sched_getaffinity(0))
    workers = max(1, len(os.sched_getaffinity(0)) // jobs)
    tasks = [_task(entry, course, exercises, conditions, store, workers) for entry in usable]
    with closing(make_scheduler(jobs).run(tasks, watcher.step)) as attempts:
        for attempt in attempts:
            if not _commit(store, attempt):
                not_replaced.append(attempt.task.name)
            watcher.done(attempt.task.name, attempt.standing)
            _stop_if_full(store, attempt.standing)
    return not_replaced


def _prepare(course: Course, store: Store, warn: Callable[[str], None]) -> None:
    """Make sure that this machine can grade, and write what all HTML reports share."""
    choice = choose_isolation(course.grading.isolation, find_ros())
    for found in missing(choice.containment):
        warn(f"sandbox {choice.isolation.name}: {found}")
    for name, data in ({} if course.standalone else shared_assets()).items():
        store.write(f"assets/{name}", data)


def _task(  # noqa: PLR0913  as above
    entry: Entry, course: Course, exercises: Sequence[Exercise], conditions: Conditions, store: Store, workers: int
) -> Task:
    grading = course.grading
    return Task(
        name=entry.name,
        label=entry.label,
        submission=entry.path,
        into=store.fresh(entry.name).resolve(),
        exercises=grading.exercises,
        rubrics=grading.rubrics,
        odom_bag=grading.odom_bag,
        conditions=conditions,
        workers=workers,
        standalone=course.standalone,
        deadline_s=deadline_s(exercises),
    )


def _refused(entry: Entry, conditions: Conditions) -> Standing:
    digest = unusable_digest(SubmissionError(entry.problem))
    return Standing(State.REFUSED, conditions.key(digest), digest, entry.label, entry.problem)


def _commit(store: Store, attempt: Attempt) -> bool:
    return store.commit(attempt.task.name, attempt.task.into, attempt.standing)


def _stop_if_full(store: Store, standing: Standing) -> None:
    """Raise HarnessError if an attempt failed because a disk is full: the others would fail too."""
    if standing.state is not State.FAILED:
        return
    scratch = Path(tempfile.gettempdir())
    for place, free in ((store.folder, store.free_bytes), (scratch, Store(scratch).free_bytes)):
        if free < LEAST_FREE_BYTES:
            hint = "free some space; the same command goes on where it was"
            raise HarnessError(f"{place}: expected room for results, found the disk full", hint)


def _book(
    store: Store, intake: Intake, matching: Matching, adjustments: Adjustments, keys: Mapping[str, str]
) -> Classbook:
    names = {entry.name for entry in intake.entries}
    return make_classbook(
        intake,
        matching,
        adjustments,
        kept={name: store.kept(name) for name in names},
        keys=keys,
        report_of=lambda name: _report(store.place(name) / REPORT),
        foreign=[name for name in store.names() if name not in names],
    )


def _written(graded: Graded, store: Store, wanted: Platforms) -> Graded:
    """Write what is made for the whole class, and return the class with what was written."""
    names = [row.name for row in graded.book.rows if row.report is not None] if wanted.gradescope else []
    results = {name: text for name in names if (text := _text(store.place(name) / GRADESCOPE))}
    made = exports(graded.book, wanted, results)
    left_out = {platform: export.left_out for platform, export in made.items() if export.left_out}
    graded = replace(graded, left_out=left_out)
    texts = {**class_files(graded.book, made), CLASS: summary_json(graded)}
    return replace(graded, files=tuple(store.write(name, text.encode()) for name, text in texts.items()))


def _report(path: Path) -> ReportData | None:
    try:
        report: Any = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return report if isinstance(report, dict) and "exercises" in report else None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""
