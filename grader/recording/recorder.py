"""The supervisor's side of recording: keeps workers, hands them plans, takes traces back.

A worker's answer is untrusted input: its size is capped and its shape is checked. A worker that fails is replaced, and
the plan it had is tried once more; a second failure becomes a trace with a problem of ours, which is never judged.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from grader.model.errors import HarnessError
from grader.model.limits import Limits
from grader.model.quantities import NS_PER_S
from grader.model.trace import ClockKind, Trace
from grader.recording.codec import trace_from_json
from grader.recording.ending import is_unexplained
from grader.recording.isolation.environment import worker_environment
from grader.recording.isolation.protocol import Isolation, PythonRuntime, runtime_to_json
from grader.recording.plan import Plan, plan_to_json

#: A worker that has not answered after twice the real time of a scenario and this many seconds is taken for lost.
MARGIN_S = 60.0
#: An answer larger than this, or than so many times the messages that may be in it, is not a trace.
ANSWER_BYTES, ANSWER_BYTES_PER_BYTE = 256 << 20, 12
TRIES = 2


class WorkerProcess:
    """One running worker and the line to it.

    Args:
        isolation: The tier it runs in, and starts student processes in.
        runtime: Interpreter and ROS.
        domains: Gives the number of a ROS domain that nobody else uses.
        scratch: A folder for what ROS writes beside its work.
    """

    def __init__(self, isolation: Isolation, runtime: PythonRuntime, domains: Iterator[int], scratch: Path) -> None:
        self._domains = domains
        self._line, theirs = socket.socketpair()
        request = {"isolation": isolation.name, "line": theirs.fileno(), "runtime": runtime_to_json(runtime)}
        argv = [str(runtime.executable), "-s", "-u", "-m", "grader.recording.worker", json.dumps(request)]
        command = isolation.worker_command(argv, _environment(runtime, scratch), (theirs.fileno(),))
        self._process = subprocess.Popen(
            command.argv,
            env=dict(command.environment),
            pass_fds=command.pass_fds,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=None if os.environ.get("GRADER_DEBUG") == "1" else subprocess.DEVNULL,
            cwd="/",
            start_new_session=True,
        )
        for descriptor in command.opened_fds:
            os.close(descriptor)
        theirs.close()

    def run(self, plan: Plan) -> Trace:
        """Run one plan; raises HarnessError if the worker fails."""
        request = json.dumps({"plan": plan_to_json(plan), "domain": next(self._domains)}) + "\n"
        try:
            self._line.sendall(request.encode())
            answer = json.loads(self._answer(plan.limits))
        except (OSError, ValueError, RecursionError) as error:
            raise HarnessError(f"worker: expected a trace of {plan.scenario}, found none ({error})") from error
        if not isinstance(answer, dict) or "trace" not in answer:
            problem = str(answer.get("problem", "")) if isinstance(answer, dict) else ""
            said = problem.strip().splitlines()
            raise HarnessError(f"worker: {said[-1] if said else 'expected a trace, found none'}"[:600])
        return trace_from_json(answer["trace"])

    def _answer(self, limits: Limits) -> bytes:
        deadline = time.monotonic() + 2 * limits.wall_ns / NS_PER_S + MARGIN_S
        most = max(ANSWER_BYTES, ANSWER_BYTES_PER_BYTE * limits.traffic_bytes)
        received = bytearray()
        while not received.endswith(b"\n"):
            self._line.settimeout(max(0.001, deadline - time.monotonic()))
            found = self._line.recv(1 << 20)
            if not found:
                raise OSError("it ended")
            received += found
            if len(received) > most:
                raise OSError("it answered without end")
        return bytes(received)

    def close(self) -> None:
        """Hang up; the worker and whatever it started end at once."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, 9)
        self._process.wait()
        self._line.close()  # last: a thread that waits for an answer has been woken by the end of the worker


@dataclass(frozen=True, slots=True)
class Job:
    """A plan with the name its progress is told by."""

    title: str
    plan: Plan


class Recorder:
    """A few workers that record scenarios side by side; virtual time makes that safe.

    Args:
        isolation: The tier.
        runtime: Interpreter and ROS.
        domains: Gives ROS domains, a new one for every scenario.
        scratch: A folder for what ROS writes beside its work; the caller removes it.
        workers: How many scenarios are recorded at the same time.
    """

    def __init__(
        self, isolation: Isolation, runtime: PythonRuntime, domains: Iterator[int], *, scratch: Path, workers: int
    ) -> None:
        self._isolation = isolation
        self._runtime = runtime
        self._domains = _Shared(domains)
        self._idle: queue.LifoQueue[WorkerProcess | None] = queue.LifoQueue()  # a warm worker first
        self._alive: list[WorkerProcess] = []
        self._lock = threading.Lock()
        self._closed = False
        self._count = workers
        self._scratch = scratch
        # The system ends a worker with the thread that started it: these threads live as long as the recorder.
        self._pool = ThreadPoolExecutor(workers, thread_name_prefix="recorder")
        for _ in range(workers):
            self._idle.put(None)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def warm_up(self, count: int) -> None:
        """Start so many workers now, so that they are ready when the first plan comes."""
        # In the caller's thread, which outlives the recorder. All places are taken before any is given back: the
        # queue would hand the first worker out again.
        places = [self._idle.get() for _ in range(min(count, self._count))]
        for place in places:
            self._idle.put(place or self._start())

    def record(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> list[Trace]:
        """Record every job and return the traces in the same order."""
        return list(self.each(jobs, progress))

    def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[Trace]:
        """Record every job and yield the traces in the same order, each as soon as those before it are there."""
        futures = [self._pool.submit(self._record, job, progress) for job in jobs]
        for future in futures:
            yield future.result()

    def _record(self, job: Job, progress: Callable[[str], None]) -> Trace:
        """Record a job; once more where a signal ended a process and no limit explains it: a real fault comes again."""
        progress(job.title)
        trace = self._recorded(job)
        return self._recorded(job) if any(map(is_unexplained, trace.faults())) else trace

    def _recorded(self, job: Job) -> Trace:
        problem = ""
        for _ in range(TRIES):
            worker = self._idle.get()
            usable = None
            try:
                worker = worker or self._start()
                trace = worker.run(job.plan)
                usable = worker
                return trace
            except HarnessError as error:
                problem = error.message
                self._discard(worker)
                if self._closed:
                    break
            finally:
                self._idle.put(usable)
        clock = ClockKind(job.plan.clock)
        return Trace(job.plan.scenario, clock, stop_ns=0, observations=(), harness_problem=problem)

    def _start(self) -> WorkerProcess:
        with self._lock:
            if self._closed:
                raise HarnessError("worker: the recorder is closed")
            worker = WorkerProcess(self._isolation, self._runtime, self._domains, self._scratch)
            self._alive.append(worker)
            return worker

    def _discard(self, worker: WorkerProcess | None) -> None:
        with self._lock:
            if worker in self._alive and worker is not None:
                self._alive.remove(worker)
                worker.close()

    def close(self) -> None:
        """End every worker; what is under way is given up."""
        with self._lock:
            self._closed = True
            alive, self._alive = self._alive, []
        for worker in alive:
            worker.close()
        self._pool.shutdown(wait=True, cancel_futures=True)


class _Shared:
    """An iterator that several threads may use."""

    def __init__(self, numbers: Iterator[int]) -> None:
        self._numbers = numbers
        self._lock = threading.Lock()

    def __iter__(self) -> _Shared:
        return self

    def __next__(self) -> int:
        with self._lock:
            return next(self._numbers)


def _environment(runtime: PythonRuntime, scratch: Path) -> Mapping[str, str]:
    """Return the whole environment of a worker: nothing of the caller's but where to find programs."""
    from_caller = {name: os.environ[name] for name in ("PATH", "GRADER_DEBUG") if name in os.environ}
    return {**worker_environment(runtime, scratch), **from_caller}
