"""Judges a class again from kept recordings where only the judging of a rubric changed; nothing of a student runs."""

from __future__ import annotations

import ctypes
import signal
import time
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

from grader.course.classroom.local import Attempt, Task, failed_attempt
from grader.course.classroom.store import Conditions, ResultStatus, State
from grader.course.classroom.worker import EVIDENCE, request_of_task, result_status, write_reports
from grader.grading.app.kept_recordings import PlannedRun, recorded_alike
from grader.grading.app.rejudge import WORTH_A_POOL, judged_again
from grader.grading.app.request import request_to_json
from grader.grading.evidence.store import carry_over, open_evidence
from grader.grading.model.exercise import Exercise
from grader.grading.reporting.json_report import dumps
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EvidenceError, GraderError

_SET_PARENT_DEATH_SIGNAL = 1  # linux/prctl.h


@dataclass(frozen=True, slots=True)
class KeptRecordings:
    """Recordings of a submission that a run would make again."""

    evidence: Path
    exercises: tuple[Exercise, ...]  # what the submission is graded by now
    reused: frozenset[str]  # ids of the exercises whose recordings can be used

    @property
    def suffice(self) -> bool:
        """Whether no program has to run."""
        return len(self.reused) == len(self.exercises)


def kept_recordings(
    place: Path, result: ResultStatus | None, conditions: Conditions, exercises: Sequence[Exercise], digest: str
) -> KeptRecordings | None:
    """Return the recordings of an earlier result that fit the submission as it is graded now; None without any.

    The earlier result must be of the same files, seed, clock, sandbox, limits and version of the grader; rubrics are
    compared by their scenarios.
    """
    if result is None or result.state not in (State.GRADED, State.UNDECIDED) or conditions.options.seed is None:
        return None
    if not digest or result.recorded != conditions.recorded(digest):
        return None
    try:
        evidence = open_evidence(place / EVIDENCE)
    except EvidenceError:
        return None
    planned = PlannedRun(digest, conditions.options.seed, conditions.recording, conditions.interfaces)
    reused = frozenset(exercise.id for exercise in recorded_alike(evidence, exercises, planned))
    return KeptRecordings(place / EVIDENCE, tuple(exercises), reused) if reused else None


def regrade(work: Mapping[str, tuple[Task, KeptRecordings]], jobs: int) -> Generator[Attempt, None, None]:
    """Yield an attempt for each task, in any order; one whose recordings cannot be used is in the state FAILED."""
    workers = min(jobs, max(1, len(work) // WORTH_A_POOL))
    if workers == 1:
        yield from (_attempt(*one) for one in work.values())
        return
    pool = ProcessPoolExecutor(workers, initializer=_prepare, initargs=(work,))
    try:
        for future in as_completed([pool.submit(_attempt_there, name) for name in work]):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


#: What a pool process has to do; set once when it starts.
_work: dict[str, tuple[Task, KeptRecordings]] = {}


def _prepare(work: Mapping[str, tuple[Task, KeptRecordings]]) -> None:
    """Prepare a pool process, which ends with its parent and leaves Ctrl-C to it."""
    ctypes.CDLL(None).prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _work.update(work)


def _attempt_there(name: str) -> Attempt:
    return _attempt(*_work[name])


def _attempt(task: Task, kept: KeptRecordings) -> Attempt:
    began_s = time.perf_counter()
    try:
        status = _judged(task, kept)
    except GraderError as error:
        return failed_attempt(task, error.message)
    except OSError as error:
        return failed_attempt(task, f"the result cannot be written: {error.strerror}")
    except Exception as error:  # as in `worker.attempt`; the submission is run then
        return failed_attempt(task, f"the grader failed: {type(error).__name__}: {error}")
    return Attempt(task, replace(status, duration_s=round(time.perf_counter() - began_s, 3)))


def _judged(task: Task, kept: KeptRecordings) -> ResultStatus:
    request = request_of_task(task)
    evidence = open_evidence(kept.evidence)
    report = judged_again(evidence, kept.exercises, request, task.conditions.recording)
    task.into.mkdir()
    write_reports(report, task)
    asked = request_to_json(request, kept.exercises)
    carry_over(evidence, task.into / EVIDENCE, request=asked, report=dumps(report).encode())
    return result_status(report, task)
