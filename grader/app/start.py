"""Starts what records, and grades one submission with it; the rest of the grader is imported meanwhile."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING

from grader.execution.recording_session import RecordingSession, open_session

if TYPE_CHECKING:
    from grader.app.grade import Progress
    from grader.app.request import GradeRequest
    from grader.core.exercise import Exercise
    from grader.core.report import Report
    from grader.core.submission import Run


def grade(  # noqa: PLR0913  what to grade, and who is told
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
    with opened(request, progress) if session is None else nullcontext(session) as used:
        from grader.app.grade import grade_in  # noqa: PLC0415 - takes as long as the worker takes to start

        return grade_in(used, request, progress, on_recorded, on_partial_report, pictures=pictures, started=started)


def opened(request: GradeRequest, progress: Progress) -> AbstractContextManager[RecordingSession]:
    """Return a session for a request, which may be graded in it many times."""
    return open_session(request.isolation, request.workers, progress)
