"""The process that grades submissions of a class: reads tasks, writes the result files, and reports each status."""

from __future__ import annotations

import ctypes
import json
import os
import resource
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from datetime import date

import msgspec

from grader.course.classroom import store as kept
from grader.course.classroom.local import Task
from grader.course.classroom.messages import read_collected
from grader.course.classroom.store import REPORT, Conditions, ResultStatus, State, refused
from grader.grading.app.grade import Progress, grade_in
from grader.grading.app.keeping import EvidenceWriter
from grader.grading.app.request import GradeRequest, request_for
from grader.grading.model.exercise import Audience, Exercise
from grader.grading.model.report import Report, Reproduction
from grader.grading.model.run import Run
from grader.grading.reporting.audience import for_student
from grader.grading.reporting.html.render import render_html
from grader.grading.reporting.json_report import dumps
from grader.grading.reporting.platforms.gradescope import render_gradescope
from grader.grading.rubrics.draws import Recorded
from grader.runtime.files import write_whole
from grader.runtime.model.errors import GraderError, SubmissionError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.session import RecordingSession, open_session
from grader.runtime.usage import families, peak_bytes, restart_peak, usage

PAGE, EVIDENCE = "report.html", "evidence"
#: Files for students, with what the rubric lets them see on the day of grading.
HANDED_BACK, HANDED_BACK_PAGE, GRADESCOPE = "feedback.json", "feedback.html", "gradescope.json"
#: All files and folders of a result.
PARTS = (REPORT, PAGE, EVIDENCE, HANDED_BACK, HANDED_BACK_PAGE, GRADESCOPE)
#: Shared files of all pages, relative to a page in `students/NAME/`.
ASSETS = "../../assets"
_SET_PARENT_DEATH_SIGNAL = 1  # linux/prctl.h


def main() -> None:
    """Grade the tasks from standard input; write steps and each status as JSON lines to standard output.

    Before a recording on the wall clock, which leaves the processors to others, it writes that too.
    A recording session serves all tasks that ask for the same one. It never runs anything of a submission in this
    process.
    """
    ctypes.CDLL(None).prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    with ExitStack() as stack:
        sessions = Sessions(stack, lambda: _send({"wall_clock": True}))
        for line in sys.stdin.buffer:
            request = json.loads(line)
            if os.getppid() != request["parent"]:  # the parent died before the signal was set
                return
            os.chdir(request["folder"])
            task = msgspec.convert(request["task"], Task, dec_hook=lambda type_, value: type_(value))
            status = attempt(task, lambda step: _send({"step": step}), sessions.grade, sessions.ended_s)
            _send({"done": json.loads(kept.dump_status(status))})


class Sessions:
    """The recording sessions of a process, which are closed with the stack."""

    def __init__(self, stack: ExitStack, on_wall_clock: Callable[[], None]) -> None:
        self._stack = stack
        self._on_wall_clock = on_wall_clock
        self._opened: dict[tuple[str, int | None], RecordingSession] = {}

    def ended_s(self) -> float:
        """Return the processor time of the workers that were replaced."""
        return sum(session.recorder.ended_ns for session in self._opened.values()) / NS_PER_S

    def grade(
        self, request: GradeRequest, progress: Progress, on_recorded: Callable[[Run, Sequence[Exercise]], None]
    ) -> Report:
        """Grade a submission in a session that is opened if there is none for the request yet; see `grade_in`."""
        started = time.perf_counter()
        wanted = (request.isolation, request.workers)
        if wanted not in self._opened:
            session = open_session(*wanted, progress, on_wall_clock=self._on_wall_clock)
            self._opened[wanted] = self._stack.enter_context(session)
        return grade_in(self._opened[wanted], request, progress, on_recorded, started=started)


#: Grades a submission: `Sessions.grade`.
Grade = Callable[[GradeRequest, Progress, Callable[[Run, Sequence[Exercise]], None]], Report]


def attempt(task: Task, progress: Progress, grade: Grade, ended_s: Callable[[], float] = lambda: 0.0) -> ResultStatus:
    """Grade a submission, write the result, and return its status; never raises because of the submission.

    `ended_s` returns processor time that the kernel does not count as used by this process and its descendants.
    """
    started, before_s = time.perf_counter(), _processor_s() + ended_s()
    restart_peak()
    children_before = _children_peak_bytes()
    try:
        status = _graded(task, progress, grade)
    except SubmissionError as error:
        status = refused(task.label, task.conditions, error)
    except GraderError as error:
        status = _failed(task, error.message, error.hint)
    except OSError as error:
        status = _failed(task, f"the result cannot be written: {error.strerror}")
    except Exception as error:  # the last line of defence: a bug of the grader must not look like a low score
        status = _failed(task, f"the grader failed: {type(error).__name__}: {error}")
    duration_s, processor_s = time.perf_counter() - started, _processor_s() + ended_s() - before_s
    used = {"processor_s": round(processor_s, 3), "peak_bytes": float(_peak_since(children_before))}
    return replace(status, duration_s=round(duration_s, 3), usage=used)


def _graded(task: Task, progress: Progress, grade: Grade) -> ResultStatus:
    request = request_of_task(task)
    task.into.mkdir()
    writer = EvidenceWriter([task.into / EVIDENCE], request)
    report = grade(request, progress, writer.remember)
    progress("writing the results")
    write_reports(report, task)
    writer.write(report)
    return result_status(report, task)


def request_of_task(task: Task) -> GradeRequest:
    """Return the request to grade the submission of a task."""
    options, own = task.conditions.options, task.conditions.variants
    student, key = (own.student, options.variant_key) if own is not None else ("", None)
    return request_for(
        str(task.submission),
        replace(options, student=student, variant_key=key),
        workers=task.workers,
        collected=None if task.collected is None else read_collected(task.collected.read_bytes()),
        draw=Recorded(own) if own is not None else None,
        recordings=task.recordings,
    )


def write_reports(report: Report, task: Task) -> None:
    """Write a report in all its formats into the folder of a task; raises OSError."""
    today = date.today().isoformat()  # noqa: DTZ011  the local date where it is graded
    for name, text in _files(report, task, today).items():
        write_whole(task.into / name, text.encode())


def result_status(report: Report, task: Task) -> ResultStatus:
    """Return the status of a submission with a report."""
    return ResultStatus(
        state=State.GRADED if report.final else State.UNDECIDED,
        key=_used(task.conditions, report.reproduce).key(report.digest),
        recorded=task.conditions.recorded(report.digest),
        digest=report.digest,
        label=task.label,
        score=float(report.score),
        max_score=float(report.max_score),
    )


def _used(conditions: Conditions, given: Reproduction) -> Conditions:
    """Return the conditions with the digests that were read; those of skipped exercises are kept as they were."""
    if not conditions.options.every:
        return replace(conditions, rubrics=given.rubrics, recording=given.recording)
    read = dict(given.rubrics)
    rubrics = tuple((id_, read.get(id_, digest)) for id_, digest in conditions.rubrics)
    return replace(conditions, rubrics=rubrics, recording=given.recording or conditions.recording)


def _files(report: Report, task: Task, today: str) -> Mapping[str, str]:
    assets = None if task.standalone else ASSETS
    page, seen = render_html(report, assets=assets, recordings=EVIDENCE), for_student(report, today)
    read_by_students = replace(seen, audience=Audience.STUDENT)
    return {
        REPORT: dumps(report),
        PAGE: page,
        HANDED_BACK: dumps(seen),
        HANDED_BACK_PAGE: render_html(read_by_students, assets=assets),
        GRADESCOPE: render_gradescope(replace(report, audience=Audience.STUDENT), day=today),
    }


def _failed(task: Task, problem: str, hint: str = "") -> ResultStatus:
    return ResultStatus(State.FAILED, "", "", task.label, problem, hint)


def _processor_s() -> float:
    """Return the processor time used so far by this process and all that it has started."""
    return usage(families([os.getpid()])[os.getpid()]).processor_ns / NS_PER_S


def _peak_since(children_before: int) -> int:
    """Return the most memory of this process since `restart_peak`, or of one that it has waited for meanwhile.

    The kernel tells the largest of all processes that were waited for: one counts if it is larger than all before it,
    so that the peak of a submission is never shown as that of a later one.
    """
    children = _children_peak_bytes()
    return max(peak_bytes(), children if children > children_before else 0)


def _children_peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss << 10


def _send(message: Mapping[str, object]) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
