"""Starts what records, and grades one submission with it; the rest of the grader is imported meanwhile."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from grader.grading.model.rubric_files import rubrics_in
from grader.runtime.session import RecordingSession, open_session
from grader.runtime.shipped import shipped

if TYPE_CHECKING:
    from grader.grading.app.grade import Progress
    from grader.grading.app.request import GradeRequest
    from grader.grading.model.exercise import Exercise
    from grader.grading.model.report import Report
    from grader.grading.model.run import Run


#: The files that a shipped rubric requires, in its text.
_FILES = re.compile(r"^files: \[(.+)\]$", re.MULTILINE)
#: In a larger submission, no names are compared.
_MOST_FOLDERS = 200


def grade_once(  # noqa: PLR0913  what to grade, and where progress goes
    request: GradeRequest,
    progress: Progress,
    on_recorded: Callable[[Run, Sequence[Exercise]], None] | None = None,
    on_partial_report: Callable[[Report], None] | None = None,
    *,
    pictures: bool = True,
    session: RecordingSession | None = None,
) -> Report:
    """Grade one submission, in a session of its own unless one is given; see `grade_in`."""
    started = time.perf_counter()
    with _own_session(request, progress) if session is None else nullcontext(session) as used:
        from grader.grading.app.grade import grade_in  # noqa: PLC0415 - takes as long as the worker takes to start

        told = (on_recorded, on_partial_report)
        return grade_in(used, request, progress, *told, pictures=pictures, started=started)


def _own_session(request: GradeRequest, progress: Progress) -> AbstractContextManager[RecordingSession]:
    warm = request.collected is not None or may_run(request.submission, request.rubrics)
    return open_session(request.isolation, request.workers, progress, warm=warm)


def opened(request: GradeRequest, progress: Progress) -> AbstractContextManager[RecordingSession]:
    """Return a session for a request, which may be graded in it many times."""
    return open_session(request.isolation, request.workers, progress)


def opened_early(
    submission: str, rubrics: Sequence[Path], isolation: str, progress: Progress
) -> AbstractContextManager[RecordingSession | None]:
    """Return a session whose worker starts at once; None if there is nothing to run."""
    there = os.path.exists(submission) and may_run(submission, rubrics)  # noqa: PTH110 - False for any unusable name
    return open_session(isolation, None, progress) if there else nullcontext()


def may_run(submission: str, rubrics: Sequence[Path] = ()) -> bool:
    """Return whether a submission may hold a file to run, judged by names alone; True in doubt.

    If not, no worker is started in advance, which saves 80 ms of real time and more where nothing can run. Reading the
    rubrics instead would take as long as the start of a worker.
    """
    place, is_folder = Path(submission), os.path.isdir(submission)  # noqa: PTH112 - False for any unusable name
    if rubrics or not (is_folder or place.suffix == ".py"):
        return True
    texts = (path.read_text(encoding="utf-8") for path in rubrics_in(shipped("rubrics")))
    wanted = {name.strip() for text in texts for found in _FILES.findall(text) for name in found.split(",")}
    if not is_folder:
        return place.name in wanted
    for number, (_, _, names) in enumerate(os.walk(place)):
        if number >= _MOST_FOLDERS or not wanted.isdisjoint(names):
            return True
    return False
