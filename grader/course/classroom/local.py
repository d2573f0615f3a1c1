"""Grades submissions on this machine, in processes that are used again; also the interface of schedulers."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import SimpleQueue
from typing import Protocol

import msgspec

from grader.course.classroom import store as kept
from grader.course.classroom.store import Conditions, ResultStatus, State
from grader.runtime.model.checkup import NO_SANDBOX, missing
from grader.runtime.model.dataclass import dataclass
from grader.runtime.session import WALL, TierChoice, sandbox_here


@dataclass(frozen=True, slots=True)
class Task:
    """One submission to grade."""

    name: str  # name of the entry
    label: str  # its name in the source
    submission: Path
    into: Path  # destination folder for the files of `worker.PARTS`; must not exist yet
    conditions: Conditions  # what the result depends on besides the submission, the options of the run among it
    workers: int  # most scenarios recorded in parallel
    standalone: bool  # whether the HTML report includes its scripts, instead of sharing them with the class
    deadline_s: float  # real time after which the attempt is killed
    collected: Path | None = None  # file with the submission as read on another machine; None to read it now
    recordings: Path | None = None  # evidence whose recordings of unchanged exercises are used; None to record all
    spot_check: bool = False  # whether it is drawn for a check on the wall clock, which takes long


@dataclass(frozen=True, slots=True)
class Attempt:
    """The outcome of a task; its files are in the task's folder."""

    task: Task
    status: ResultStatus


#: Called with a submission's name and a step of it that begins, from any thread.
OnStep = Callable[[str, str], None]


class ClassScheduler(Protocol):
    """Grades submissions in parallel, on this machine or on others."""

    def prepare(self, isolation: str) -> Sequence[str]:
        """Return warnings for the instructor; raises EnvironmentFault if nothing can be graded."""

    def run(self, tasks: Sequence[Task], on_step: OnStep) -> Generator[Attempt, None, None]:
        """Yield one attempt for each task as it finishes, in any order.

        Closing the generator aborts the running tasks and leaves no process behind. A failed task yields an attempt in
        the state FAILED; it never raises.
        """


#: Makes a scheduler for a number of parallel submissions.
MakeScheduler = Callable[[int], ClassScheduler]


#: How many submissions may wait on the wall clock beside each of those that need a processor; each takes memory.
WAITING_PER_JOB = 3
#: The hint of a failure.
AGAIN = "run the same command again"
#: Longest line read from a process.
_LINE_BYTES = 1 << 20
#: Real seconds in which a process has to end that is no longer needed; a busy machine takes a while to end all that it
#: has started.
_END_S = 60.0
WORKER = (sys.executable, "-s", "-m", "grader.course.classroom.worker")


@dataclass(frozen=True, slots=True)
class Grading:
    """A submission to grade in a process, and who hears of it."""

    task: Task
    on_step: OnStep  # what it raises ends the process and comes out
    folder: Path  # where relative paths of the task start
    class_: object = None  # equal for one class; a process remembers files by their relative paths, and serves only one
    on_wall_clock: Callable[[], None] = lambda: None  # a recording begins that leaves the processors to others
    keep: Callable[[], bool] = lambda: True  # whether the process waits for another submission at the end


class GradingProcesses:
    """Processes that grade one submission after the other, each for one class.

    One that waits for a submission ends after `idle_s` real seconds, and at the latest when it is closed.
    """

    def __init__(self, command: Sequence[str] = WORKER, *, idle_s: float = threading.TIMEOUT_MAX) -> None:
        self._command = command
        self._idle_s = idle_s
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._idle: list[_Idle] = []
        self._closed = False
        self._starter: _Starter | None = None

    def grade(self, grading: Grading) -> Attempt:
        """Grade a submission in a process of its class; if one that was kept fails, in a new one."""
        grading.on_step(grading.task.name, "starting")
        process = self._idle_one(grading.class_)
        if process is not None:
            attempt = self._attempt(process, grading)
            if attempt.status.state is not State.FAILED:
                return attempt
            # What a process keeps for the next submission costs no submission its result.
            shutil.rmtree(grading.task.into, ignore_errors=True)
        try:
            process = self._start()
        except OSError as error:
            return failed_attempt(grading.task, f"the grader cannot be started: {error.strerror}")
        return self._attempt(process, grading)

    def close(self) -> None:
        """Kill the processes that grade, and end those that wait."""
        with self._lock:
            self._closed = True
            idle, self._idle = self._idle, []
            grading = self._running.difference(waits.process for waits in idle)
        for process in grading:
            _kill(process)
        for waits in idle:
            waits.timer.cancel()
            self._end(waits.process)
        if self._starter is not None:
            self._starter.close()

    def _attempt(self, process: subprocess.Popen[bytes], grading: Grading) -> Attempt:
        task = grading.task
        overdue, status = threading.Event(), None

        def give_up() -> None:
            overdue.set()
            _kill(process)

        timer = _started_timer(task.deadline_s, give_up)
        try:
            status = self._listen(process, grading)
        except BaseException:
            _kill(process)  # nobody wants its result
            raise
        finally:
            timer.cancel()
            if status is None or status.state is State.FAILED or not self._kept(process, grading):
                self._end(process)
        if status is not None:
            return Attempt(task, status)
        if overdue.is_set():
            return failed_attempt(task, f"the grader was not done after {task.deadline_s:.0f} s")
        return failed_attempt(task, f"the grader ended without a result (exit code {process.returncode})")

    def _idle_one(self, class_: object) -> subprocess.Popen[bytes] | None:
        with self._lock:
            waits = next((waits for waits in reversed(self._idle) if waits.class_ == class_), None)
            if waits is None:
                return None
            self._idle.remove(waits)
        waits.timer.cancel()
        return waits.process

    def _kept(self, process: subprocess.Popen[bytes], grading: Grading) -> bool:
        """Keep a process for the next submission, and return whether it is kept."""
        with self._lock:
            if self._closed or not grading.keep():
                return False
            timer = _started_timer(self._idle_s, lambda: self._end_idle(process))
            self._idle.append(_Idle(process, grading.class_, timer))
        return True

    def _end_idle(self, process: subprocess.Popen[bytes]) -> None:
        """End a process that has waited in vain."""
        with self._lock:
            left = [waits for waits in self._idle if waits.process is not process]
            taken, self._idle = len(left) == len(self._idle), left
        if not taken:
            self._end(process)

    def _start(self) -> subprocess.Popen[bytes]:
        root = str(Path(__file__).resolve().parents[3])
        paths = [root, *filter(None, [os.environ.get("PYTHONPATH", "")])]
        with self._lock:
            if self._closed:
                raise InterruptedError(0, "interrupted")
            self._starter = self._starter or _Starter()
            process = self._starter.start(
                lambda: subprocess.Popen(
                    self._command,
                    env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=None if os.environ.get("GRADER_DEBUG") == "1" else subprocess.DEVNULL,
                    # Python imports from here first, and the user's directory may contain a student's `json.py`.
                    cwd="/",
                    start_new_session=True,
                )
            )
            self._running.add(process)
        return process

    def _listen(self, process: subprocess.Popen[bytes], grading: Grading) -> ResultStatus | None:
        """Read messages from a process until it reports its result; None if it ends without one."""
        assert process.stdin is not None
        assert process.stdout is not None
        task = msgspec.to_builtins(grading.task, enc_hook=str)
        request = {"task": task, "folder": str(grading.folder), "parent": os.getpid()}
        with suppress(OSError):
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
        while line := process.stdout.readline(_LINE_BYTES):
            message = _message(line)
            if "done" in message:
                return kept.load_status(json.dumps(message["done"]).encode())
            if "step" in message:
                grading.on_step(grading.task.name, str(message["step"]))
            if "wall_clock" in message:
                grading.on_wall_clock()
        return None

    def _end(self, process: subprocess.Popen[bytes]) -> None:
        if process.stdin is not None:
            with suppress(OSError):
                process.stdin.close()  # it cleans up and ends
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=_END_S)
        _kill(process)
        process.wait()
        if process.stdout is not None:
            process.stdout.close()
        with self._lock:
            self._running.discard(process)


@dataclass(frozen=True, slots=True)
class _Idle:
    """A process that waits for a submission of its class."""

    process: subprocess.Popen[bytes]
    class_: object
    timer: threading.Timer  # ends it


class _Starter:
    """A thread that starts processes and lasts: the kernel kills them when the thread ends that started them."""

    def __init__(self) -> None:
        self._wanted: SimpleQueue[tuple[Callable[[], subprocess.Popen[bytes]], Future[subprocess.Popen[bytes]]] | None]
        self._wanted = SimpleQueue()
        threading.Thread(target=self._serve, name="starter", daemon=True).start()

    def start(self, process: Callable[[], subprocess.Popen[bytes]]) -> subprocess.Popen[bytes]:
        """Return the process that the function starts; raises what it raises."""
        started: Future[subprocess.Popen[bytes]] = Future()
        self._wanted.put((process, started))
        return started.result()

    def close(self) -> None:
        """End the thread, and with it what it started."""
        self._wanted.put(None)

    def _serve(self) -> None:
        while (wanted := self._wanted.get()) is not None:
            process, started = wanted
            try:
                started.set_result(process())
            except BaseException as error:  # raised where it is waited for
                started.set_exception(error)


class LocalScheduler:
    """Grades on this machine.

    A submission that is recorded on the wall clock because virtual time does not suffice spends its time waiting.
    Another one is begun beside it, and up to `WAITING_PER_JOB` wait for each of the jobs. That many of those that are
    drawn for a spot check are graded at a time, from the beginning, so that the class does not end with them. While
    there are more of them, the processes that this needs are kept, because each takes a second to start.
    """

    def __init__(
        self, jobs: int, command: Sequence[str] = WORKER, *, sandbox: Callable[[str], TierChoice] = sandbox_here
    ) -> None:
        self._jobs = jobs
        self._on_wall_clock = WAITING_PER_JOB * jobs
        self._processes = GradingProcesses(command)
        self._sandbox = sandbox
        self._lock = threading.Lock()
        self._checks = 0  # submissions that are being graded and are drawn for a spot check

    def prepare(self, isolation: str) -> Sequence[str]:
        """Find ROS and test the sandbox; see `ClassScheduler`."""
        choice = self._sandbox(isolation)
        name = choice.isolation.name
        warnings = [f"sandbox {name}: {found}" for found in missing(choice.containment)]
        if choice.isolation.shares_network and name != NO_SANDBOX:
            if self._jobs > 1:
                warnings.append(f"sandbox {name}: submissions share the network, so they are graded one at a time")
            self._jobs, self._on_wall_clock = 1, 0
        return warnings

    def run(self, tasks: Sequence[Task], on_step: OnStep) -> Generator[Attempt, None, None]:
        """Yield an attempt for each task; see `ClassScheduler`."""
        pool = ThreadPoolExecutor(self._jobs + self._on_wall_clock, thread_name_prefix="batch")
        places, waiting = threading.Semaphore(self._jobs), _Waiting(tasks)
        try:
            for future in as_completed([pool.submit(self._next, waiting, on_step, places) for _ in tasks]):
                yield future.result()
        finally:
            self._processes.close()
            pool.shutdown(wait=True, cancel_futures=True)

    def _next(self, waiting: _Waiting, on_step: OnStep, places: threading.Semaphore) -> Attempt:
        with _Place(places) as place, self._next_task(waiting) as task:
            # With `--clock wall`, all would be recorded beside each other.
            keeps_place = task.conditions.options.clock == WALL
            grading = Grading(
                task,
                on_step,
                Path.cwd(),
                on_wall_clock=(lambda: None) if keeps_place else place.leave,
                # Unless others have taken its place.
                keep=lambda: place.taken or bool(waiting.drawn),
            )
            return self._processes.grade(grading)

    @contextmanager
    def _next_task(self, waiting: _Waiting) -> Iterator[Task]:
        """Take the task that is graded next, and count it while it is graded."""
        with self._lock:
            task = waiting.take(drawn=self._checks < max(1, self._on_wall_clock))
            self._checks += task.spot_check
        try:
            yield task
        finally:
            with self._lock:
                self._checks -= task.spot_check


class _Waiting:
    """The tasks that nobody has begun, those that are drawn for a spot check apart from the others."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        self.drawn = deque(task for task in tasks if task.spot_check)
        self._others = deque(task for task in tasks if not task.spot_check)

    def take(self, *, drawn: bool) -> Task:
        """Take the next task, of the wanted ones while there are any."""
        wanted, others = (self.drawn, self._others) if drawn else (self._others, self.drawn)
        return (wanted or others).popleft()


class _Place:
    """One of the places for submissions that need a processor; it is left once, at the latest at the end."""

    def __init__(self, places: threading.Semaphore) -> None:
        self._places = places
        self.taken = False

    def __enter__(self) -> _Place:
        self._places.acquire()
        self.taken = True
        return self

    def __exit__(self, *_: object) -> None:
        self.leave()

    def leave(self) -> None:
        """Leave the place to the next submission."""
        if self.taken:
            self.taken = False
            self._places.release()


def _started_timer(seconds: float, function: Callable[[], None]) -> threading.Timer:
    timer = threading.Timer(seconds, function)
    timer.daemon = True
    timer.start()
    return timer


def _message(line: bytes) -> dict[str, object]:
    try:
        message = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return message if isinstance(message, dict) else {}


def _kill(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def failed_attempt(task: Task, problem: str, hint: str = AGAIN) -> Attempt:
    """Build a failed attempt, which is never the student's fault."""
    return Attempt(task, ResultStatus(State.FAILED, "", "", task.label, problem, hint))
