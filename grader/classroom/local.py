"""Grades submissions on this machine, one process each; and what any scheduler of a class does."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import msgspec

from grader.classroom import store as kept
from grader.classroom.store import Conditions, ResultStatus, State
from grader.core.checkup import NO_WALLS, missing
from grader.execution.ros_installation import find_ros
from grader.execution.sandbox.choose import choose_isolation


@dataclass(frozen=True, slots=True)
class Task:
    """One submission to grade.

    Attributes:
        name: Name of the entry.
        label: What the source calls it.
        submission: Path of what was handed in.
        into: Folder that is not there yet: receives what `worker.PARTS` names.
        exercises: Exercise ids to grade; empty for all of the rubrics.
        rubrics: Rubric files; empty for the built-in ones.
        odom_bag: An /odom recording to play instead of the project's own.
        conditions: What the result depends on besides the submission.
        workers: Most scenarios recorded side by side.
        standalone: Whether the HTML report holds its scripts, instead of sharing them with the class.
        deadline_s: Real time after which the attempt is given up.
        collected: File of what was read of the submission on another machine; None to read it now.
        variant_key: File with the course key, for the line that repeats the run; nothing is read from it.
    """

    name: str
    label: str
    submission: Path
    into: Path
    exercises: tuple[str, ...]
    rubrics: tuple[Path, ...]
    odom_bag: Path | None
    conditions: Conditions
    workers: int
    standalone: bool
    deadline_s: float
    collected: Path | None = None
    variant_key: Path | None = None


@dataclass(frozen=True, slots=True)
class Attempt:
    """What came of a task; its files are in the folder that the task named."""

    task: Task
    standing: ResultStatus


class Hear(Protocol):
    """Hears, from any thread, which step of which submission begins."""

    def __call__(self, name: str, step: str) -> None:
        """Take note of it."""
        ...


class ClassScheduler(Protocol):
    """Grades submissions, several at the same time, on this machine or on others."""

    def prepare(self, isolation: str) -> Sequence[str]:
        """Make sure that grading is possible at all, and return what an instructor must know before it begins.

        Args:
            isolation: The sandbox that was asked for.

        Raises:
            EnvironmentFault: It is not.
        """
        ...

    def run(self, tasks: Sequence[Task], hear: Hear) -> Generator[Attempt, None, None]:
        """Yield what comes of each task, once, as soon as it is there and in any order.

        Closing the iterator gives up what is under way and leaves no process behind. A failure of one task is its
        attempt's state, never an exception.
        """
        ...


#: Makes the scheduler for so many submissions at a time.
MakeScheduler = Callable[[int], ClassScheduler]


#: Longest line that a process may say.
_LINE_BYTES = 1 << 20
WORKER = (sys.executable, "-s", "-m", "grader.classroom.worker")


class LocalScheduler:
    """Grades on this machine.

    Args:
        jobs: Submissions at a time.
        command: What grades one; another one only in tests.
        folder: What relative paths start from; None for the folder that this process is in.
    """

    def __init__(self, jobs: int, command: Sequence[str] = WORKER, *, folder: Path | None = None) -> None:
        self._jobs = jobs
        self._command = command
        self._folder = folder
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._closed = False

    def prepare(self, isolation: str) -> Sequence[str]:
        """Look for ROS and try the sandbox; see `ClassScheduler`."""
        choice = choose_isolation(isolation, find_ros())
        name = choice.isolation.name
        warnings = [f"sandbox {name}: {found}" for found in missing(choice.containment)]
        if choice.isolation.shares_network and name != NO_WALLS and self._jobs > 1:
            self._jobs = 1
            warnings.append(f"sandbox {name}: submissions share the network, so they are graded one at a time")
        return warnings

    def run(self, tasks: Sequence[Task], hear: Hear) -> Generator[Attempt, None, None]:
        """Yield what comes of each task; see `ClassScheduler`."""
        # The system ends a process with the thread that started it: these threads live until all is done.
        pool = ThreadPoolExecutor(self._jobs, thread_name_prefix="batch")
        try:
            for future in as_completed([pool.submit(self._one, task, hear) for task in tasks]):
                yield future.result()
        finally:
            self._close()
            pool.shutdown(wait=True, cancel_futures=True)

    def _one(self, task: Task, hear: Hear) -> Attempt:
        hear(task.name, "starting")
        try:
            process = self._start()
        except OSError as error:
            return _failed(task, f"the grader cannot be started: {error.strerror}")
        overdue = threading.Event()

        def give_up() -> None:
            overdue.set()
            _kill(process)

        timer = threading.Timer(task.deadline_s, give_up)
        timer.daemon = True
        timer.start()
        try:
            standing = self._listen(process, task, hear)
        finally:
            timer.cancel()
            self._end(process)
        if standing is not None:
            return Attempt(task, standing)
        if overdue.is_set():
            return _failed(task, f"the grader was not done after {task.deadline_s:.0f} s")
        return _failed(task, f"the grader ended without a result (exit code {process.returncode})")

    def _start(self) -> subprocess.Popen[bytes]:
        root = str(Path(__file__).resolve().parents[2])
        paths = [root, *filter(None, [os.environ.get("PYTHONPATH", "")])]
        with self._lock:
            if self._closed:
                raise InterruptedError(0, "interrupted")
            process = subprocess.Popen(
                self._command,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=None if os.environ.get("GRADER_DEBUG") == "1" else subprocess.DEVNULL,
                cwd="/",  # Python imports from here first, and where the user is may lie a student's `json.py`
                start_new_session=True,
            )
            self._running.add(process)
        return process

    def _listen(self, process: subprocess.Popen[bytes], task: Task, hear: Hear) -> ResultStatus | None:
        """Return what a process says of its task at last; None if it ends before."""
        assert process.stdin is not None
        assert process.stdout is not None
        folder = self._folder or Path.cwd()
        request = {"task": msgspec.to_builtins(task, enc_hook=str), "folder": str(folder), "parent": os.getpid()}
        with suppress(OSError):
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.close()
        while line := process.stdout.readline(_LINE_BYTES):
            said = _message(line)
            if "done" in said:
                return kept.load(json.dumps(said["done"]).encode())
            if "step" in said:
                hear(task.name, str(said["step"]))
        return None

    def _end(self, process: subprocess.Popen[bytes]) -> None:
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=10)  # it has said all it had to say, and takes down what it set up
        _kill(process)
        process.wait()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        with self._lock:
            self._running.discard(process)

    def _close(self) -> None:
        with self._lock:
            self._closed = True
            running = list(self._running)
        for process in running:
            _kill(process)


def _message(line: bytes) -> dict[str, Any]:
    try:
        said = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}


def _kill(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def _failed(task: Task, problem: str) -> Attempt:
    return Attempt(task, ResultStatus(State.FAILED, "", "", task.label, problem, "run the same command again"))
