"""Packs submissions for other machines, and stores their answers; how both travel is up to the scheduler."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import grader
from grader.course.classroom import store as kept
from grader.course.classroom.local import Attempt, Task, failed_attempt
from grader.course.classroom.messages import (
    Files,
    GradingJob,
    JobResult,
    Parcel,
    Terms,
    pack_collected,
    pack_message,
    plain_files,
    travelling_name,
    unpack_message,
    write_answer,
)
from grader.course.classroom.store import ResultStatus, State, refused
from grader.course.classroom.worker import PARTS
from grader.grading.app.grade import read_exercises, wanted_files
from grader.grading.app.request import request_for
from grader.grading.model.grading_options import GradingOptions, with_paths
from grader.grading.rubrics.draws import First
from grader.grading.rubrics.loader import side_files
from grader.grading.submissions.submission import collect_submission
from grader.runtime.interfaces.definitions import files_in
from grader.runtime.model.errors import HarnessError, RecordingError, RubricError, SubmissionError

_PARTS = frozenset(PARTS)


def terms_of(task: Task) -> Terms:
    """Collect what the class of a task is graded with; raises GraderError if a file cannot be read."""
    return Terms(
        # Seed and variants of a submission travel with its job.
        conditions=replace(task.conditions, options=_travelling(task.conditions.options), variants=None),
        files=tuple(_files(task.conditions.options)),
        standalone=task.standalone,
        deadline_s=task.deadline_s,
    )


def _travelling(options: GradingOptions) -> GradingOptions:
    """Return the options as another machine reads them, without a seed."""
    return replace(with_paths(options, lambda path: Path(os.fsdecode(travelling_name(path)))), seed=None)


def _files(options: GradingOptions) -> Iterator[tuple[bytes, bytes]]:
    """Yield relative path and content of the files that the options name; the variant key is not among them."""
    yield from ((travelling_name(path), _content(path)) for path in options.rubrics)
    yield from checks_of(options.rubrics)
    yield from _definitions(options.interfaces)
    for _, path in options.bags:
        bag = travelling_name(path)
        yield from ((b"/".join(filter(None, (bag, name))), content) for name, content in _recording(path))


def checks_of(rubrics: Sequence[Path]) -> Iterator[tuple[bytes, bytes]]:
    """Yield the files that the rubrics bring, which were validated when the rubrics were read."""
    for path in rubrics:
        for file in side_files(path):
            yield travelling_name(file.path), file.content


def _definitions(folders: Sequence[Path]) -> Iterator[tuple[bytes, bytes]]:
    """Yield the files of the class's interface packages."""
    for path in files_in(folders):
        yield travelling_name(path), _content(path)


def files_wanted(task: Task) -> Sequence[str]:
    """Return the names of the files that the class of a task has to hand in; all tasks of a class share them."""
    return _files_wanted(replace(task.conditions.options, bags=(), seed=None))


@cache
def _files_wanted(options: GradingOptions) -> Sequence[str]:
    return wanted_files(read_exercises(request_for("", options, draw=First())))


def job_for(task: Task, wanted: Sequence[str]) -> GradingJob | Attempt:
    """Pack a submission for the cluster, or return an attempt at once if it cannot be used."""
    try:
        with tempfile.TemporaryDirectory() as nowhere:
            collected = collect_submission(str(task.submission), wanted, Path(nowhere))
    except SubmissionError as error:
        return Attempt(task, refused(task.label, task.conditions, error))
    except (OSError, MemoryError, RecursionError) as error:
        return failed_attempt(task, f"the submission cannot be read: {type(error).__name__}")
    return GradingJob(
        task.name,
        os.fsencode(task.label),
        travelling_name(task.submission),
        pack_collected(collected),
        task.conditions.variants,
        task.conditions.options.seed,
    )


def has_report(status: ResultStatus) -> bool:
    """Return whether a report belongs to a status."""
    return status.state in (State.GRADED, State.UNDECIDED)


def doubt(task: Task, status: object) -> str:
    """Return why the status of a task that was graded elsewhere cannot be believed; empty if it can."""
    if not isinstance(status, ResultStatus) or not isinstance(status.state, State):
        return "expected a result, found something else"
    if has_report(status) and status.key != task.conditions.key(status.digest):
        return "graded by other rubrics or another recording than those here"
    return ""


def store_result(task: Task, answer: JobResult) -> Attempt:
    """Write the result from an answer into the task's folder."""
    status = kept.load_status(answer.status)
    if status is None:
        return failed_attempt(task, f"{answer.machine}: expected a result, found something else")
    if wrong := doubt(task, status):
        return failed_attempt(task, f"{answer.machine}: {wrong}")
    try:
        if has_report(status):
            write_answer(answer.files, task.into, _PARTS)
    except HarnessError as error:
        return failed_attempt(task, f"{answer.machine}: {error.message}")
    except OSError as error:
        return failed_attempt(task, f"the result cannot be written: {error.strerror}")
    return Attempt(task, replace(status, label=task.label))


def pack_task(task: Task) -> bytes | Attempt:
    """Pack a submission with all that another machine needs to grade it, for `grade_packed` there.

    Return an attempt instead if the submission cannot be used, or cannot be read. Raises GraderError if a rubric, a
    recording or an interface package cannot be read.
    """
    job = job_for(task, files_wanted(task))
    if isinstance(job, Attempt):
        return job
    return pack_message(Parcel(grader.__version__, pack_message(terms_of(task)), pack_message(job)))


def store_answer(task: Task, answer: object, machine: str) -> Attempt:
    """Write the files of an answer of `grade_packed` into the task's folder, and return the attempt.

    Whatever came instead of an answer makes it a failure of the machine, which is named so, and never a mark.
    """
    result = answer_in(answer, machine)
    if result.unfit:
        return failed_attempt(task, f"{result.machine}: {result.unfit}", *filter(None, [result.hint]))
    return store_result(task, result)


def answer_in(data: object, machine: str) -> JobResult:
    """Unpack an answer from the cluster; invalid data becomes an empty result, which counts as a failure."""
    try:
        if isinstance(data, bytes):
            return unpack_message(data, JobResult)
    except HarnessError:
        pass
    return JobResult(machine)


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise RubricError(f"{path}: cannot be read: {error.strerror}") from None


def _recording(path: Path) -> Files:
    try:
        return plain_files(path) if path.is_dir() else ((b"", path.read_bytes()),)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from None
