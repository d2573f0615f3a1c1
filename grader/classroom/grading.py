"""Grades the submissions of a class that are due, and takes in each result when it is ready."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from grader.classroom.cache_key import Conditions, unusable_digest
from grader.classroom.intake import HandedInEntry
from grader.classroom.local import MakeScheduler, Task
from grader.classroom.request import CHANGED, ClassRequest
from grader.classroom.store import ResultStatus, State, Store
from grader.classroom.watching import Watcher
from grader.core.errors import HarnessError, SubmissionError
from grader.core.exercise import Exercise
from grader.execution.supervisor import MARGIN_S, TRIES
from grader.reporting.html.assets import shared_assets

#: Less room than this, where results or scratch files go, and nothing can be graded.
LEAST_FREE_BYTES = 4 << 20
#: Seconds that an attempt may take beyond what its recordings may.
_BEYOND_S = 300.0


def deadline_s(budget_s: float) -> float:
    """Return the real time after which grading one submission is given up: every limit inside has passed by then."""
    return budget_s + TRIES * MARGIN_S + _BEYOND_S


@dataclass(frozen=True, slots=True)
class ClassRun:
    """One run of the command over a class.

    Attributes:
        course: What was asked for.
        exercises: What is graded.
        conditions: Name of a submission -> what its result depends on.
        store: Where they go.
        watcher: Hears how it gets on.
    """

    course: ClassRequest
    exercises: Sequence[Exercise]
    conditions: Mapping[str, Conditions]
    store: Store
    watcher: Watcher

    def grade(self, due: Sequence[HandedInEntry], warn: Callable[[str], None], make: MakeScheduler) -> tuple[str, ...]:
        """Grade what is due, and return the names of those whose result is still the one of before.

        Args:
            due: The submissions.
            warn: Hears what an instructor must know before it begins.
            make: Makes the scheduler.

        Raises:
            EnvironmentFault: Nothing can be graded here.
            HarnessError: A disk is full; what was done is kept.
        """
        left = {entry.name for entry in due}
        self._note(left)
        for entry in due:
            if entry.problem:
                self._take(entry.name, self.store.fresh(entry.name), self._refused(entry), left)
        usable = [entry for entry in due if not entry.problem]
        if not usable:
            return ()
        return self._schedule(usable, warn, make, left)

    def _schedule(
        self, usable: Sequence[HandedInEntry], warn: Callable[[str], None], make: MakeScheduler, left: set[str]
    ) -> tuple[str, ...]:
        for name, data in ({} if self.course.standalone else shared_assets()).items():
            self.store.write(f"assets/{name}", data)
        cores = len(os.sched_getaffinity(0))
        jobs = self.course.jobs or cores
        tasks = [self._task(entry, max(1, cores // jobs)) for entry in usable]
        scheduler = make(jobs)
        for line in scheduler.prepare(self.course.grading.isolation):
            warn(line)
        not_replaced = []
        with closing(scheduler.run(tasks, self.watcher.step)) as attempts:
            for attempt in attempts:
                name = attempt.task.name
                if not self._take(name, attempt.task.into, attempt.standing, left):
                    not_replaced.append(name)
                self._stop_if_full(attempt.standing)
        return tuple(sorted(not_replaced))

    def _take(self, name: str, fresh: Path, standing: ResultStatus, left: set[str]) -> bool:
        """Take in what came of a submission; return whether it is its result now."""
        replaced = self.store.commit(name, fresh, standing)
        left.discard(name)
        self._note(left)
        self.watcher.done(name, standing)
        return replaced

    def _note(self, left: set[str]) -> None:
        """Note what is still to be graded again; what is new or changed shows without a note."""
        if self.course.rerun != CHANGED:
            self.store.note_pending(self.course.rerun, left)

    def _task(self, entry: HandedInEntry, workers: int) -> Task:
        grading = self.course.grading
        return Task(
            name=entry.name,
            label=entry.label,
            submission=entry.path,
            into=self.store.fresh(entry.name).resolve(),
            exercises=grading.exercises,
            rubrics=grading.rubrics,
            odom_bag=grading.odom_bag,
            conditions=self.conditions[entry.name],
            variant_key=grading.variant_key,
            workers=workers,
            standalone=self.course.standalone,
            deadline_s=deadline_s(self.course.grading.time_budget_s),
        )

    def _refused(self, entry: HandedInEntry) -> ResultStatus:
        digest = unusable_digest(SubmissionError(entry.problem))
        return ResultStatus(State.REFUSED, self.conditions[entry.name].key(digest), digest, entry.label, entry.problem)

    def _stop_if_full(self, standing: ResultStatus) -> None:
        """Raise HarnessError if an attempt failed because a disk is full: the others would fail too."""
        if standing.state is not State.FAILED:
            return
        for place in (self.store, Store(Path(tempfile.gettempdir()))):
            if place.free_bytes < LEAST_FREE_BYTES:
                hint = "free some space; the same command goes on where it was"
                raise HarnessError(f"{place.folder}: expected room for results, found the disk full", hint)
