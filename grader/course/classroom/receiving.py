"""Runs on another machine: grades a submission that was sent as bytes, and answers in bytes."""

from __future__ import annotations

import atexit
import fcntl
import os
import socket
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path

import grader
from grader.course.classroom import store as kept
from grader.course.classroom.local import AGAIN, Attempt, Grading, GradingProcesses, Task
from grader.course.classroom.messages import (
    MAX_ANSWER_BYTES,
    Fitness,
    GradingJob,
    JobResult,
    Parcel,
    Terms,
    pack_message,
    plain_files,
    unpack_message,
)
from grader.course.classroom.store import ResultStatus, State
from grader.grading.model.grading_options import paths
from grader.runtime.model.checkup import NO_SANDBOX, missing
from grader.runtime.model.errors import EnvironmentFault, GraderError, HarnessError
from grader.runtime.session import TierChoice, sandbox_here
from grader.runtime.temp_dirs import scratch_folder

#: Real seconds for which a process waits for the next submission of its class. A worker of a busy cluster gets one
#: within a second; one that gets none should not keep the memory, about 100 MiB, for long.
_IDLE_S = 30.0
_PROCESSES = GradingProcesses(idle_s=_IDLE_S)
atexit.register(_PROCESSES.close)


def fitness(isolation: str, machine: str) -> Fitness:
    """Find out whether this machine can grade in the requested sandbox."""
    try:
        choice = sandbox_here(isolation)
    except EnvironmentFault as fault:
        return Fitness(machine, fault.message, fault.hint)
    except Exception as error:  # any failure makes this machine unfit, but not the others
        return Fitness(machine, f"the grader failed: {type(error).__name__}: {error}")
    name = choice.isolation.name
    remarks = [f"sandbox {name}: {found}" for found in missing(choice.containment)]
    if _one_at_a_time(choice):
        remarks.append(f"sandbox {name}: submissions share the network, so this machine grades one at a time")
    return Fitness(machine, remarks=tuple(remarks))


def grade_job(terms: Terms, job: GradingJob, machine: str, on_step: Callable[[str], None]) -> JobResult:
    """Grade a submission in its own process, in a sandbox chosen here; an exception of `on_step` aborts it."""
    try:
        choice = sandbox_here(terms.conditions.options.isolation)
    except EnvironmentFault as fault:
        return JobResult(machine, unfit=fault.message, hint=fault.hint)
    try:
        with _alone() if _one_at_a_time(choice) else nullcontext(), scratch_folder() as scratch:
            return _graded(terms, job, scratch, machine, on_step)
    except GraderError as error:
        return failed_answer(machine, error.message, error.hint)
    except OSError as error:
        return failed_answer(machine, f"the submission cannot be laid out or read back: {error.strerror}")


def _graded(terms: Terms, job: GradingJob, scratch: Path, machine: str, on_step: Callable[[str], None]) -> JobResult:
    task = write_task(terms, job, scratch)
    attempt = _PROCESSES.grade(Grading(task, lambda _, step: on_step(step), _start(terms, scratch), class_=terms))
    files = plain_files(task.into) if task.into.is_dir() else ()
    if sum(len(content) for _, content in files) > MAX_ANSWER_BYTES:
        return failed_answer(machine, f"the result holds more than {MAX_ANSWER_BYTES >> 20} MiB")
    return JobResult(machine, kept.dump_status(_status_with_machine(attempt, machine)), files)


def _status_with_machine(attempt: Attempt, machine: str) -> ResultStatus:
    """Return the status of an attempt; the problem of a failure names the machine."""
    status = attempt.status
    if status.state is not State.FAILED:
        return status
    return replace(status, problem=f"{machine}: {status.problem}")


def failed_answer(machine: str, problem: str, hint: str = AGAIN) -> JobResult:
    """Build the answer for a failure of this machine, which never counts as a mark."""
    return JobResult(machine, kept.dump_status(ResultStatus(State.FAILED, "", "", "", f"{machine}: {problem}", hint)))


def write_task(terms: Terms, job: GradingJob, scratch: Path) -> Task:
    """Write the received files into an empty folder, and return the task to grade them.

    Files keep the relative paths of the sending machine, so that reports name them the same. Raises HarnessError for a
    path that points outside of the folder.
    """
    start = _start(terms, scratch)
    start.mkdir(parents=True)
    for name, content in terms.files:
        path = _inside(start, Path(os.fsdecode(name)), scratch)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    for path in paths(terms.conditions.options):
        _inside(start, path, scratch)
    collected = scratch / "collected"
    collected.write_bytes(job.collected)
    return Task(
        name=job.name,
        label=os.fsdecode(job.label),
        submission=Path(os.fsdecode(job.path)),
        into=scratch / "result",
        conditions=terms.conditions.of_submission(job.seed, job.variants),
        # The parallelism of a cluster is one submission per thread.
        workers=1,
        standalone=terms.standalone,
        deadline_s=terms.deadline_s,
        collected=collected,
    )


def _start(terms: Terms, scratch: Path) -> Path:
    """Return where relative paths start from: so deep that those which lead up stay inside."""
    named = (*(Path(os.fsdecode(name)) for name, _ in terms.files), *paths(terms.conditions.options))
    up = max((path.parts.count("..") for path in named), default=0)
    return scratch.joinpath("files", *["up"] * up)


def _inside(start: Path, named: Path, scratch: Path) -> Path:
    """Return where a path leads from the start; raises HarnessError if that is outside of what was laid out here."""
    path = Path(os.path.normpath(start / named))
    if not path.is_relative_to(scratch / "files"):
        raise HarnessError("terms: expected paths that stay inside, found one that does not")
    return path


def _one_at_a_time(choice: TierChoice) -> bool:
    return choice.isolation.shares_network and choice.isolation.name != NO_SANDBOX


@contextmanager
def _alone() -> Iterator[None]:
    """Wait until no other worker of this user grades in the same network namespace."""
    network = Path("/proc/self/ns/net").stat().st_ino
    place = Path(tempfile.gettempdir()) / f"grade-network-{os.geteuid()}-{network}.lock"
    lock = os.open(place, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


class UnwantedError(Exception):
    """The result is no longer wanted: raised by an `on_step`, it ends the grading and comes out."""


def _unheard(step: str) -> None:
    """Report steps to nobody."""


def grade_packed(parcel: bytes, on_step: Callable[[str], None] = _unheard) -> bytes:
    """Grade a submission that `pack_task` packed on another machine, and return the answer for `store_answer` there.

    Steps are passed to `on_step`, which may raise UnwantedError; nothing else is raised.
    """
    machine = socket.gethostname()
    try:
        given = unpack_message(parcel, Parcel)
    except HarnessError as error:
        return pack_message(JobResult(machine, unfit=error.message, hint=error.hint))
    return answer(given.version, given.terms, given.job, machine, on_step)


def answer(version: str, terms: bytes, job: bytes, machine: str, on_step: Callable[[str], None]) -> bytes:
    """Grade a submission for a grader of this version, and return a packed `JobResult`; see `grade_packed`."""
    if version != grader.__version__:
        return pack_message(JobResult(machine, unfit=other_version(version, grader.__version__), hint=remedy(version)))
    try:
        return pack_message(grade_job(unpack_message(terms, Terms), unpack_message(job, GradingJob), machine, on_step))
    except UnwantedError:
        raise
    except HarnessError as error:
        return pack_message(JobResult(machine, unfit=error.message, hint=error.hint))
    except Exception as error:  # the last line of defence: a bug of the grader must not look like a low score
        return pack_message(failed_answer(machine, f"the grader failed: {type(error).__name__}: {error}"))


def other_version(wanted: str, found: str) -> str:
    """Describe the problem of a machine that lacks this version of the grader."""
    return f"expected rclpy-grader {wanted}, found {found or 'none'}"


def remedy(version: str) -> str:
    """Return the hint that fixes a wrong version."""
    return f"install rclpy-grader {version} there"
