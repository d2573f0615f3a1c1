"""The process that grades one submission of a class: reads a task, writes the result files, and reports its status."""

from __future__ import annotations

import ctypes
import json
import os
import resource
import signal
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from datetime import date

import msgspec

from grader.app.grade import EvidenceWriter, Progress, grade
from grader.app.request import GradeRequest
from grader.classroom import store as kept
from grader.classroom.local import Task
from grader.classroom.messages import read_collected
from grader.classroom.store import Conditions, ResultStatus, State, refused
from grader.core.errors import GraderError, SubmissionError
from grader.core.report import Report, Reproduction
from grader.reporting.audience import for_student
from grader.reporting.delivery import write_whole
from grader.reporting.html.render import render_html
from grader.reporting.json_report import dumps
from grader.reporting.platforms.gradescope import render_gradescope
from grader.rubrics.variants import Recorded

REPORT, PAGE, EVIDENCE = "report.json", "report.html", "evidence"
#: Files for students, with what the rubric lets them see on the day of grading.
HANDED_BACK, HANDED_BACK_PAGE, GRADESCOPE = "feedback.json", "feedback.html", "gradescope.json"
#: All files and folders of a result.
PARTS = (REPORT, PAGE, EVIDENCE, HANDED_BACK, HANDED_BACK_PAGE, GRADESCOPE)
#: Shared files of all pages, relative to a page in `students/NAME/`.
ASSETS = "../../assets"
_SET_PARENT_DEATH_SIGNAL = 1  # linux/prctl.h


def main() -> None:
    """Grade the task from standard input; write steps and finally the status as JSON lines to standard output."""
    ctypes.CDLL(None).prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    request = json.loads(sys.stdin.buffer.readline())
    if os.getppid() != request["parent"]:  # the parent died before the signal was set
        return
    os.chdir(request["folder"])
    task = msgspec.convert(request["task"], Task, dec_hook=lambda type_, value: type_(value))
    status = attempt(task, lambda step: _send({"step": step}))
    _send({"done": json.loads(kept.dump(status))})


def attempt(task: Task, progress: Progress) -> ResultStatus:
    """Grade a submission, write the result, and return its status; never raises because of the submission."""
    started = time.perf_counter()
    try:
        status = _graded(task, progress)
    except SubmissionError as error:
        status = refused(task.label, task.conditions, error)
    except GraderError as error:
        status = _failed(task, error.message, error.hint)
    except OSError as error:
        status = _failed(task, f"the result cannot be written: {error.strerror}")
    except Exception as error:  # the last line of defence: a bug of the grader must not look like a low score
        status = _failed(task, f"the grader failed: {type(error).__name__}: {error}")
    return replace(status, duration_s=round(time.perf_counter() - started, 3), usage=_usage())


def _graded(task: Task, progress: Progress) -> ResultStatus:
    conditions, own = task.conditions, task.conditions.variants
    request = GradeRequest(
        submission=str(task.submission),
        exercises=task.exercises,
        every=conditions.every,
        rubrics=task.rubrics,
        seed=conditions.seed,
        odom_bag=task.odom_bag,
        clock=conditions.clock,
        isolation=conditions.isolation,
        time_budget_s=conditions.time_budget_s,
        spot_checks=conditions.spot_checks,
        workers=task.workers,
        collected=None if task.collected is None else read_collected(task.collected.read_bytes()),
        student=own.student if own is not None else "",
        variant_key=task.variant_key if own is not None else None,
        draw=Recorded(own) if own is not None else None,
    )
    task.into.mkdir()
    writer = EvidenceWriter([task.into / EVIDENCE], request)
    report = grade(request, progress, writer.remember)
    progress("writing the results")
    today = date.today().isoformat()  # noqa: DTZ011  the local date where it is graded
    for name, text in _files(report, task, today).items():
        write_whole(task.into / name, text.encode())
    writer.write(report)
    key = _used(conditions, report.reproduce).key(report.digest)
    return ResultStatus(
        state=State.GRADED if report.final else State.UNDECIDED,
        key=key,
        digest=report.digest,
        label=task.label,
        score=float(report.score),
        max_score=float(report.max_score),
    )


def _used(conditions: Conditions, given: Reproduction) -> Conditions:
    """Return the conditions with the digests that were read; those of skipped exercises are kept as they were."""
    if not conditions.every:
        return replace(conditions, rubrics=given.rubrics, recording=given.recording)
    read = dict(given.rubrics)
    rubrics = tuple((id_, read.get(id_, digest)) for id_, digest in conditions.rubrics)
    return replace(conditions, rubrics=rubrics, recording=given.recording or conditions.recording)


def _files(report: Report, task: Task, today: str) -> Mapping[str, str]:
    assets = None if task.standalone else ASSETS
    page, seen = render_html(report, assets=assets), for_student(report, today)
    return {
        REPORT: dumps(report),
        PAGE: page,
        HANDED_BACK: dumps(seen),
        HANDED_BACK_PAGE: page if seen is report else render_html(seen, assets=assets),
        GRADESCOPE: render_gradescope(report, day=today),
    }


def _failed(task: Task, problem: str, hint: str = "") -> ResultStatus:
    return ResultStatus(State.FAILED, "", "", task.label, problem, hint)


def _usage() -> dict[str, float]:
    """Return the resources used so far by this process and its children."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return {
        "processor_s": round(sum(u.ru_utime + u.ru_stime for u in used), 3),
        "peak_bytes": 1024 * max(u.ru_maxrss for u in used),
    }


def _send(message: Mapping[str, object]) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
