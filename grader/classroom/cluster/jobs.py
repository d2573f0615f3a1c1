"""What a machine of a cluster does: grades a submission as if it lay there, and answers in bytes."""

from __future__ import annotations

import asyncio
import fcntl
import os
import socket
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path, PurePosixPath

from distributed import Worker, get_worker

import grader
from grader.classroom import store as kept
from grader.classroom.local import Attempt, LocalScheduler, Task
from grader.classroom.messages import (
    MAX_ANSWER_BYTES,
    Files,
    Fitness,
    GradingJob,
    JobResult,
    Terms,
    files_below,
    pack,
    unpack,
)
from grader.classroom.store import ResultStatus, State
from grader.core.checkup import NO_WALLS, missing
from grader.core.errors import EnvironmentFault, GraderError, HarnessError
from grader.execution.ros_installation import find_ros
from grader.execution.sandbox.choose import TierChoice, choose_isolation
from grader.execution.temp_dirs import scratch_folder

_AGAIN = "run the same command again"


def fitness(isolation: str, machine: str) -> Fitness:
    """Return whether this machine can grade in the sandbox that was asked for.

    Args:
        isolation: As for one submission.
        machine: What to call this machine.
    """
    try:
        choice = choose_isolation(isolation, find_ros())
    except EnvironmentFault as fault:
        return Fitness(machine, fault.message, fault.hint)
    name = choice.isolation.name
    remarks = [f"sandbox {name}: {found}" for found in missing(choice.containment)]
    if _one_at_a_time(choice):
        remarks.append(f"sandbox {name}: submissions share the network, so this machine grades one at a time")
    return Fitness(machine, remarks=tuple(remarks))


def fulfil(terms: Terms, job: GradingJob, machine: str, hear: Callable[[str], None]) -> JobResult:
    """Grade a submission, in a process of its own and by this machine's own choice of sandbox.

    Args:
        terms: What the class is graded with.
        job: The submission.
        machine: What to call this machine.
        hear: Hears which step begins; whatever it raises ends the grading.
    """
    try:
        choice = choose_isolation(terms.conditions.isolation, find_ros())
    except EnvironmentFault as fault:
        return JobResult(machine, unfit=fault.message, hint=fault.hint)
    try:
        with _alone() if _one_at_a_time(choice) else nullcontext(), scratch_folder() as scratch:
            return _graded(terms, job, scratch, machine, hear)
    except GraderError as error:
        return failure(machine, error.message, error.hint)
    except OSError as error:
        return failure(machine, f"the submission cannot be laid out or read back: {error.strerror}")


def _graded(terms: Terms, job: GradingJob, scratch: Path, machine: str, hear: Callable[[str], None]) -> JobResult:
    task = lay_out(terms, job, scratch)
    here = LocalScheduler(1, folder=_start(terms, scratch))
    with closing(here.run([task], lambda _, step: hear(step))) as attempts:
        attempt = next(attempts)
    files = files_below(task.into) if task.into.is_dir() else ()
    if sum(len(content) for _, content in files) > MAX_ANSWER_BYTES:
        return failure(machine, f"the result holds more than {MAX_ANSWER_BYTES >> 20} MiB")
    return JobResult(machine, kept.dump(_placed(attempt, machine)), files)


def _placed(attempt: Attempt, machine: str) -> ResultStatus:
    """Return how a submission stands; of a failure, with the machine that it happened on."""
    standing = attempt.standing
    if standing.state is not State.FAILED:
        return standing
    return replace(standing, problem=f"{machine}: {standing.problem}")


def failure(machine: str, problem: str, hint: str = _AGAIN) -> JobResult:
    """Return the answer that this machine failed, which is never a mark."""
    return JobResult(machine, kept.dump(ResultStatus(State.FAILED, "", "", "", f"{machine}: {problem}", hint)))


def lay_out(terms: Terms, job: GradingJob, scratch: Path) -> Task:
    """Write what was sent into an empty folder, and return the task to grade it.

    Files get the relative paths that they have where the class is graded, so that reports call them the same.

    Raises:
        HarnessError: A path leads out of the folder.
    """
    start = _start(terms, scratch)
    start.mkdir(parents=True)
    for name, content in (*terms.rubrics, *terms.checks):
        _write(start, os.fsdecode(name), content, scratch)
    bag = os.fsdecode(terms.odom_bag)
    for name, content in terms.recording:
        _write(start, str(PurePosixPath(bag, os.fsdecode(name))), content, scratch)
    collected = scratch / "collected"
    collected.write_bytes(job.collected)
    return Task(
        name=job.name,
        label=os.fsdecode(job.label),
        submission=Path(os.fsdecode(job.path)),
        into=scratch / "result",
        exercises=terms.exercises,
        rubrics=tuple(Path(os.fsdecode(name)) for name, _ in terms.rubrics),
        odom_bag=Path(bag) if bag else None,
        conditions=replace(terms.conditions, variants=job.variants, seed=job.seed),
        # A cluster is kept busy by submissions, one a thread.
        workers=1,
        standalone=terms.standalone,
        deadline_s=terms.deadline_s,
        collected=collected,
    )


def _start(terms: Terms, scratch: Path) -> Path:
    """Return where relative paths start from: so deep that those which lead up stay inside."""
    names: Files = (*terms.rubrics, *terms.checks, (terms.odom_bag, b""))
    up = max(name.split(b"/").count(b"..") for name, _ in names)
    return scratch.joinpath("files", *["up"] * up)


def _write(start: Path, name: str, content: bytes, scratch: Path) -> None:
    path = Path(os.path.normpath(start / name))
    if not path.is_relative_to(scratch / "files"):
        raise HarnessError("terms: expected paths that stay inside, found one that does not")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def _one_at_a_time(choice: TierChoice) -> bool:
    return choice.isolation.shares_network and choice.isolation.name != NO_WALLS


@contextmanager
def _alone() -> Iterator[None]:
    """Wait until no other worker of this user grades in the network of this one."""
    network = Path("/proc/self/ns/net").stat().st_ino
    place = Path(tempfile.gettempdir()) / f"grade-network-{os.geteuid()}-{network}.lock"
    lock = os.open(place, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


#: What an event about a submission holds.
NAME, STEP = "name", "step"
_UNWANTED = ("cancelled", "released", "forgotten")


class _UnwantedError(Exception):
    """Nobody waits for this submission any more."""


async def inspect(isolation: str, dask_worker: Worker) -> bytes:
    """Return whether this worker can grade.

    Args:
        isolation: The sandbox that was asked for.
        dask_worker: This worker; Dask fills it in by this name.
    """
    return pack(await asyncio.to_thread(_fitness, isolation, _machine(dask_worker)))


def grade(version: str, terms: bytes, job: bytes, topic: str) -> bytes:
    """Grade a submission.

    Args:
        version: Version of the grader that asks.
        terms: What the class is graded with.
        job: The submission.
        topic: Where steps are told.
    """
    worker = get_worker()
    machine = _machine(worker)
    if version != grader.__version__:
        return pack(JobResult(machine, unfit=other_version(version, grader.__version__), hint=remedy(version)))
    key = worker.get_current_task()

    def hear(step: str) -> None:
        task = worker.state.tasks.get(key)
        if task is None or task.state in _UNWANTED:
            raise _UnwantedError
        worker.log_event(topic, {NAME: what.name, STEP: step})

    try:
        what = unpack(job, GradingJob)
        return pack(fulfil(unpack(terms, Terms), what, machine, hear))
    except _UnwantedError:
        return b""
    except HarnessError as error:
        return pack(JobResult(machine, unfit=error.message, hint=error.hint))
    except Exception as error:  # the last line of defence: a mistake of ours must not look like a low score
        return pack(failure(machine, f"the grader failed: {type(error).__name__}: {error}"))


def other_version(wanted: str, found: str) -> str:
    """Return what to say of a machine with another version of the grader, or none."""
    return f"expected rclpy-grader {wanted}, found {found or 'none'}"


def remedy(version: str) -> str:
    """Return what mends that."""
    return f"install it there: pip install 'rclpy-grader[dask]=={version}'"


def _fitness(isolation: str, machine: str) -> Fitness:
    try:
        return fitness(isolation, machine)
    except Exception as error:  # whatever it is, this machine is no good, and the others need not suffer for it
        return Fitness(machine, f"the grader failed: {type(error).__name__}: {error}")


def _machine(worker: Worker) -> str:
    return f"worker {worker.address} on {socket.gethostname()}"
