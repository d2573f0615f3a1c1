"""The supervisor's side of recording: manages workers, sends them plans and receives traces.

A worker's answer is untrusted input: its size is limited and its structure is checked. A worker that fails is replaced,
and its plan is tried once more, unless the worker had used up its time. A second failure becomes a trace with a harness
problem, which is never judged. If both workers ended at their own limits, the nodes caused it, and the trace has
faults. A failure of a worker that shares its sandbox with a fork of it does not count, as the other may have caused it.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import select
import signal
import socket
import struct
import subprocess
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grader.runtime.domains import Domains
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import NS_PER_S, size
from grader.runtime.model.scenario import is_launch_file
from grader.runtime.model.submission import ReadProgram
from grader.runtime.model.trace import AssessedTrace, ClockKind, Fault, FaultKind
from grader.runtime.recording.codec import to_json
from grader.runtime.ros_installation import PythonRuntime
from grader.runtime.sandbox.environment import worker_environment
from grader.runtime.sandbox.exposure import worker_view
from grader.runtime.sandbox.protocol import Isolation
from grader.runtime.sandbox.starter import starter_command
from grader.runtime.supervisor.memory_groups import MemoryGroup, make_group
from grader.runtime.supervisor.real_time_budget import RealTimeBudget
from grader.runtime.usage import (
    FULL_BYTES,
    FULL_CODE,
    families,
    own_processor_ns,
    processor_words,
    usage,
    worker_processor_s,
)

if TYPE_CHECKING:
    from grader.runtime.plan import Plan

#: A worker that has not answered this many seconds after the real-time limit of a scenario is lost: its resource
#: monitor would have ended the run before. On the wall clock it may have started a second try shortly before the limit.
MARGIN_S = 60.0
#: How long to wait for the exit code of a worker that has ended.
END_S = 5.0
#: Processor time of a worker beyond its own limit, which it and the kernel look at first: its monitor cannot run while
#: the middleware keeps the interpreter waiting, and how a fork ended cannot be seen.
SPARE_CPU_S = 3
#: The interval at which the memory of a worker is looked at. Its resource monitor ends it at the same limit, but cannot
#: run while the middleware deserializes a message.
LOOK_S = 0.05
#: The largest valid answer: this size, or this multiple of the size of the messages that may be in it.
ANSWER_BYTES, ANSWER_BYTES_PER_BYTE = 256 << 20, 12
#: A worker that fails for a reason of the machine succeeds at the second time; one that fails twice in the same way is
#: due to the submission, or to a fault of the grader.
TRIES = 2
MODULE = b"grader.runtime.worker.worker_main"
#: pid, user and group of the sender of a message (`struct ucred`, unix(7)).
_CREDENTIALS = struct.Struct("3i")


@dataclass(frozen=True, slots=True)
class WorkerLimits:
    """What a worker itself may use, besides what its plan allows the nodes.

    Attributes:
        margin_s: Seconds after the end of a plan's real time in which it has to answer.
        answer_bytes: Size of the largest answer, if the messages in it are small.
        memory_bytes: Memory at which it is ended.
        processor_s: Returns its processor time in seconds, from the limits and the duration of a plan.
        spare_cpu_s: Seconds beyond that before the supervisor ends it.
    """

    margin_s: float = MARGIN_S
    answer_bytes: int = ANSWER_BYTES
    memory_bytes: int = FULL_BYTES
    processor_s: Callable[[Limits, int], int] = worker_processor_s
    spare_cpu_s: int = SPARE_CPU_S


OF_WORKERS = WorkerLimits()


class WorkerFailedError(HarnessError):
    """A worker reported a failure of its own.

    Args:
        message: Description of the failure.
        has_started: Whether any of the submission's code had started by then.
    """

    def __init__(self, message: str, *, has_started: bool) -> None:
        super().__init__(message)
        self.has_started = has_started


class WorkerLostError(HarnessError):
    """A worker ended, or did not answer.

    Args:
        message: Description of the failure.
        limit: The worker's own limit that ended it, in words; empty if no limit explains it.
        late: Whether it has used up its time.
    """

    def __init__(self, message: str, *, limit: str = "", late: bool = False) -> None:
        super().__init__(message)
        self.limit = limit
        self.late = late


class WorkerProcess(ABC):
    """A running worker and the socket to it.

    Args:
        line: The socket.
        domains: Lends ROS domains that no other program uses.
        limits: What it may use.

    Attributes:
        worn: Whether it reports that it should be replaced.
        shares: Whether it shares its sandbox with another worker.
        gone: Whether it has ended with another worker.
        forked: Its forks.
    """

    def __init__(self, line: socket.socket, domains: Domains, limits: WorkerLimits) -> None:
        self._line = line
        self._domains = domains
        self._domain: int | None = None
        self._limits = limits
        self._interfaces: tuple[str, ...] = ()
        self._received = bytearray()
        self._pid = 0
        self._group: MemoryGroup | None = None
        self._most_ns = 0
        self.worn = self.shares = self.gone = False
        self.forked: list[ForkedWorker] = []

    def suits(self, plan: Plan) -> bool:
        """Return whether this worker is there and has used no other interface packages than those of a plan."""
        return not self.gone and self._interfaces in ((), plan.interfaces)

    def used_ns(self) -> int:
        """Return the processor time that was used in its sandbox; 0 for a fork, which has none of its own."""
        return 0

    def has_forks(self) -> bool:
        """Return whether there are forks of this worker, which would end with it."""
        return any(not fork.gone for fork in self.forked)

    def _another_domain(self) -> int:
        """Take a ROS domain for a scenario; what may be left of the last one keeps that until now."""
        self.give_back_domain()
        self._domain = self._domains.take()
        return self._domain

    def give_back_domain(self) -> None:
        """Let others have the ROS domain of the last scenario, once nothing runs in it any more."""
        domain, self._domain = self._domain, None
        if domain is not None:
            self._domains.give_back(domain)

    def run(self, plan: Plan, budget: RealTimeBudget) -> AssessedTrace:
        """Run one plan; raises HarnessError if the worker fails, WorkerLostError if it has ended or times out."""
        from grader.runtime.recording.packed import trace_from_json  # noqa: PLC0415 - takes as long as a start

        self._interfaces = plan.interfaces
        own = {"domain": self._another_domain(), "left_ns": budget.left_ns, "budget": budget.words}
        request = json.dumps({"plan": to_json(plan), **own}) + "\n"
        # Of the worker itself: a plan that takes longer gives it more to receive.
        own_s = self._limits.processor_s(plan.limits, plan.duration_ns + plan.wait_at_most_ns)
        expected = f"worker: expected a trace of {plan.scenario}, found none"
        if self._group is not None:
            launches = any(is_launch_file(name) for name, _ in plan.processes)
            self._group.make_room(plan.limits, plan.limits.participants if launches else len(plan.processes))
        try:
            self._line.settimeout(self._limits.margin_s)  # a plan with a recording is larger than the socket buffer
            self._await_start()
            self._line.sendall(request.encode())
            tries = 1 + (plan.clock == ClockKind.WALL.value)
            seconds = min(tries * plan.limits.wall_ns, budget.left_ns) / NS_PER_S + self._limits.margin_s
            # On the wall clock it may start three times.
            begun_ns = own_processor_ns(self._pid) if self._pid else 0
            self._most_ns = begun_ns + (1 + 2 * (tries - 1)) * (own_s + self._limits.spare_cpu_s) * NS_PER_S
            answer = json.loads(self._answer(plan.limits, time.monotonic() + seconds))
        except TimeoutError as error:
            raise WorkerLostError(f"{expected} (it did not answer in time)", late=True) from error
        except MemoryError as error:
            what = f"{size(self._limits.memory_bytes)} of memory"
            raise WorkerLostError(f"{expected} (it had filled {what})", limit=what) from error
        except OverflowError as error:
            what = processor_words(own_s)
            raise WorkerLostError(f"{expected} (it had used {what})", limit=what) from error
        except EOFError as error:
            end = self._end()
            # Limits that the kernel or the worker's own monitor enforces end it in these ways.
            limits = {
                "SIGXCPU": processor_words(own_s),
                f"code {FULL_CODE}": f"{size(self._limits.memory_bytes)} of memory",
            }
            limit = limits.get(end, "")
            raise WorkerLostError(f"{expected} (ended by {end})", limit=limit) from error
        except (OSError, ValueError, RecursionError) as error:
            raise HarnessError(f"{expected} ({error})") from error
        if isinstance(answer, dict) and "author_mistake" in answer:
            self.worn = True  # the recording ended in its middle
            return _without_recording(plan, answer["author_mistake"])
        if not isinstance(answer, dict) or "trace" not in answer:
            problem = str(answer.get("problem", "")) if isinstance(answer, dict) else ""
            lines = problem.strip().splitlines()
            what = f"worker: {lines[-1] if lines else 'expected a trace, found none'}"[:600]
            raise WorkerFailedError(what, has_started=isinstance(answer, dict) and answer.get("has_started") is True)
        self.worn = answer.get("worn") is True
        real_ns, starved_ns = (answer.get(name) for name in ("real_ns", "starved_ns"))
        # From the worker, which parses what students send: nothing of its answer is believed unchecked.
        if isinstance(real_ns, int) and isinstance(starved_ns, int):
            budget.charge(real_ns, starved_ns)
        return trace_from_json(answer["trace"])

    def step(self, plan: Plan) -> None:
        """Begin a run that is stepped by `exchange`; raises HarnessError if the worker fails."""
        self._interfaces = plan.interfaces
        try:
            self._line.settimeout(None)
            self._await_start()
        except (OSError, EOFError) as error:
            raise WorkerLostError(f"worker: expected one that starts, found none (ended by {self._end()})") from error
        self.exchange({"stepped": to_json(plan), "domain": self._another_domain()})

    def exchange(self, told: Mapping[str, Any] | None) -> dict[str, Any]:
        """Tell a worker something in a stepped run, and return what it says next; None only listens.

        Raises:
            WorkerFailedError: Its own code failed.
            WorkerLostError: It has ended.
        """
        try:
            self._line.settimeout(None)
            if told is not None:
                self._line.sendall(json.dumps(told).encode() + b"\n")
            while b"\n" not in self._received:  # two messages may come at once
                found = self._line.recv(1 << 20)
                if not found:
                    raise EOFError
                self._received += found
                if len(self._received) > self._limits.answer_bytes:
                    raise OSError("its answer did not end")
            line, _, self._received = self._received.partition(b"\n")
            answer: dict[str, Any] = json.loads(line)
        except (OSError, EOFError) as error:
            raise WorkerLostError(f"worker: expected an answer, found none (ended by {self._end()})") from error
        if "failed" in answer:
            raise WorkerFailedError(f"worker: {answer['failed']}", has_started=True)
        return answer

    def _await_start(self) -> None:
        """Wait until the worker can be used; raises EOFError if it has ended."""
        return

    def _end(self) -> str:
        """Return how the worker ended: the name of a signal, or its exit code."""
        return "nothing that can be seen"

    def _answer(self, limits: Limits, deadline: float) -> bytes:
        """Wait for the worker's answer.

        Raises:
            TimeoutError: There was no answer before the deadline.
            MemoryError: The worker uses too much memory.
            OverflowError: The worker uses too much processor time.
            EOFError: The worker has ended.
            OSError: The answer is too large, or the connection is broken.
        """
        most = max(self._limits.answer_bytes, ANSWER_BYTES_PER_BYTE * limits.traffic_bytes)
        received = bytearray()
        while not received.endswith(b"\n"):
            self._line.settimeout(LOOK_S)
            try:
                found = self._line.recv(1 << 20)
            except TimeoutError:
                if time.monotonic() > deadline:
                    raise
                self._look()
                continue
            if not found:
                raise EOFError
            received += found
            # A worker that was taken over could otherwise fill the supervisor's memory.
            if len(received) > most:
                raise OSError("its answer did not end")
        return bytes(received)

    def _look(self) -> None:
        """Raise MemoryError or OverflowError if the worker itself uses too much memory or processor time."""
        self._pid = self._pid or self._find()
        if self._pid and usage([self._pid]).memory_bytes > self._limits.memory_bytes:
            raise MemoryError
        if self._pid and own_processor_ns(self._pid) > self._most_ns:
            raise OverflowError

    def _find(self) -> int:
        """Return the pid of the worker; 0 before it has started."""
        return 0

    @abstractmethod
    def close(self) -> None:
        """Kill the worker and everything that it started."""


def _without_recording(plan: Plan, mistake: Any) -> AssessedTrace:
    """Return an empty trace with the mistake of the rubric's author; raises HarnessError if the author made none."""
    import msgspec  # noqa: PLC0415 - takes as long as the import of what reads traces

    try:
        found = msgspec.convert(mistake, AuthorMistake)
    except msgspec.ValidationError as error:
        raise HarnessError(f"worker: expected a mistake with file, line and text, found {error}") from error
    return AssessedTrace(plan.scenario, ClockKind(plan.clock), stop_ns=0, observations=(), author_mistake=found)


class ExecutedWorker(WorkerProcess):
    """A worker in a sandbox of its own; it may make forks of itself there before it runs anything.

    Args:
        isolation: The tier that it runs in and starts student processes in.
        runtime: Interpreter and ROS.
        domains: Lends ROS domains that no other program uses.
        scratch: A folder for files that ROS writes, such as logs.
        forks: How many forks it makes; each costs less than another start.
        executes: Whether it executes each student's process, also in a tier in which they can be forked.
        limits: What it may use.
    """

    def __init__(  # noqa: PLR0913  what it records with
        self,
        isolation: Isolation,
        runtime: PythonRuntime,
        domains: Domains,
        scratch: Path,
        *,
        forks: int,
        executes: bool,
        limits: WorkerLimits,
    ) -> None:
        lines = [socket.socketpair() for _ in range(1 + forks)]
        super().__init__(lines[0][0], domains, limits)
        self.shares = forks > 0
        self.forked = [ForkedWorker(line, domains, limits) for line, _ in lines[1:]]
        self._executable = os.fsencode(runtime.executable)
        numbers = tuple(theirs.fileno() for _, theirs in lines)
        clock, host = ClockKind.VIRTUAL.value, isolation.host_seen_at
        can_fork = isolation.can_fork and not executes
        request = {
            "isolation": isolation.name,
            "line": numbers[0],
            "lines_of_forks": numbers[1:],
            "runtime": to_json(runtime),
            "can_fork": can_fork,
            "starter": starter_command(clock, runtime, host, users=len(lines)) if can_fork else None,
        }
        argv = [str(runtime.executable), "-s", "-S", "-u", "-m", MODULE.decode(), json.dumps(request)]
        environment, view = _environment(runtime, scratch), worker_view(runtime, scratch)
        command = isolation.worker_command(argv, environment, numbers, view)
        self._group = make_group(len(lines))
        for fork in self.forked:
            fork.join(self._group)
        self._process = subprocess.Popen(
            command.argv if self._group is None else self._group.inside(command.argv),
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
        for _, theirs in lines:
            theirs.close()

    def used_ns(self) -> int:
        """Return the processor time that was used in its sandbox, by forks and students' processes as well."""
        return usage(families([self._process.pid])[self._process.pid]).processor_ns

    def _end(self) -> str:
        try:
            code = self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            return super()._end()
        number = -code if code < 0 else code - 128  # bubblewrap passes a signal on as a shell does
        return signal.Signals(number).name if number in {*signal.Signals} else f"code {code}"

    def _find(self) -> int:
        for pid in sorted(families([self._process.pid])[self._process.pid]):
            with contextlib.suppress(OSError):
                words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
                if words[0] == self._executable and MODULE in words:
                    return pid
        return 0

    def close(self) -> None:
        """Kill the worker, its forks, and everything that they started."""
        for fork in self.forked:
            fork.gone = True
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, 9)
        self._process.wait()
        for worker in (self, *self.forked):
            worker.give_back_domain()
        if self._group is not None:
            self._group.remove()
        self._line.close()  # last, so that a thread waiting for an answer is woken by the end of the worker


class ForkedWorker(WorkerProcess):
    """A fork of a worker in the same sandbox, made before that one has run anything."""

    def __init__(self, line: socket.socket, domains: Domains, limits: WorkerLimits) -> None:
        super().__init__(line, domains, limits)
        self.shares = True
        self._process: int | None = None  # a descriptor of the process, because its pid may be given to another one
        line.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)

    def join(self, group: MemoryGroup | None) -> None:
        """Tell in which group of the kernel it is."""
        self._group = group

    def _await_start(self) -> None:
        """Receive the first message, with which the kernel tells the sender's pid."""
        if self._process is not None:
            return
        received, told, _, _ = self._line.recvmsg(1, socket.CMSG_SPACE(_CREDENTIALS.size))
        if not received:
            raise EOFError
        for level, kind, data in told:
            if (level, kind) == (socket.SOL_SOCKET, socket.SCM_CREDENTIALS):
                self._pid = _CREDENTIALS.unpack(data[: _CREDENTIALS.size])[0]
                self._process = os.pidfd_open(self._pid)

    def close(self) -> None:
        """Kill the worker, and wait for its end; what it started ends with it."""
        self.gone = True
        with contextlib.suppress(OSError, EOFError):
            self._line.settimeout(0)
            self._await_start()
        if self._process is not None:
            with contextlib.suppress(OSError):
                signal.pidfd_send_signal(self._process, signal.SIGKILL)
            ended = select.poll()
            ended.register(self._process, select.POLLIN)
            ended.poll(END_S * 1000)
            os.close(self._process)
            self._process = None
        self.give_back_domain()
        with contextlib.suppress(OSError):
            self._line.shutdown(socket.SHUT_RDWR)  # wakes a thread that waits for an answer
        self._line.close()


@dataclass(frozen=True, slots=True)
class Job:
    """A plan with a title for progress messages, and the real-time budget that it shares; unlimited by default.

    `programs` is what is known of the submission's Python files, by path.
    """

    title: str
    plan: Plan
    budget: RealTimeBudget = field(default_factory=RealTimeBudget, compare=False)
    parallel: bool = False  # on the wall clock, whether other jobs like it may be recorded at the same time
    programs: Mapping[str, ReadProgram] = field(default_factory=dict, compare=False)


class Recorder:
    """A pool of workers that record scenarios in parallel, which virtual time makes safe.

    Args:
        isolation: The sandbox tier.
        runtime: Interpreter and ROS.
        domains: Lends ROS domains; one is taken for every scenario.
        scratch: A folder for files that ROS writes, and for everything that is recorded: a worker may see no other
            folder. The caller removes it.
        workers: How many scenarios to record at the same time.
        on_wall_clock: Called before each recording on the wall clock, which takes much time and little of a processor.
        executes: Whether each student's process is executed, also in a tier in which they can be forked.
        limits: What each worker may use.

    Attributes:
        ended_ns: Processor time of the workers that were replaced.
    """

    def __init__(  # noqa: PLR0913  what it records with, and where progress goes
        self,
        isolation: Isolation,
        runtime: PythonRuntime,
        domains: Domains,
        *,
        scratch: Path,
        workers: int,
        on_wall_clock: Callable[[], None] = lambda: None,
        executes: bool = False,
        limits: WorkerLimits = OF_WORKERS,
    ) -> None:
        self._isolation = isolation
        self._executes = executes
        self._limits = limits
        self._runtime = runtime
        self._domains = domains
        self._idle: queue.LifoQueue[WorkerProcess | None] = queue.LifoQueue()  # a warm worker first
        self._alive: list[WorkerProcess] = []
        self._lock = threading.Lock()
        self.ended_ns = 0
        self._closed = False
        self._count = self._places = workers
        self._scratch = scratch
        self._on_wall_clock = on_wall_clock
        self._on_the_wall = threading.Lock()  # in real time, recordings would disturb each other
        # The kernel kills a worker when the thread that started it ends; these threads live as long as the recorder.
        self._pool = ThreadPoolExecutor(workers, thread_name_prefix="recorder")
        for _ in range(workers):
            self._idle.put(None)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def warm_up(self, count: int) -> None:
        """Start so many workers before anything is recorded: one, and forks that it makes of itself.

        The thread that calls this has to outlive the recorder, as those of the pool do.
        """
        count = min(count, self._count)
        for _ in range(count):
            self._idle.get()
        self._fill(count)

    def _fill(self, count: int) -> None:
        """Fill so many places, which nobody else can take before, with a worker and forks of it; empty if it fails."""
        workers: Sequence[WorkerProcess | None] = [None] * count
        try:
            executed = self._start(forks=count - 1)
            workers = (*executed.forked, executed)  # the last one is the next to be taken, and is ready first
        finally:
            for worker in workers:
                self._idle.put(worker)

    def _prepare(self, plans: Sequence[Plan]) -> None:
        """Start a worker with forks if none is busy and plans lack workers; forks share its memory and its starter."""
        with self._lock:
            idle: list[WorkerProcess | None] = []
            with contextlib.suppress(queue.Empty):
                while True:
                    idle.append(self._idle.get_nowait())
            suitable = [w for w in idle if w is not None and all(map(w.suits, plans))]
            if len(idle) < self._places or len(suitable) >= min(len(plans), self._count):
                for worker in reversed(idle):
                    self._idle.put(worker)
                return
            alive, self._alive = self._alive, []
            self._places = self._count
        for worker in alive:
            self._close(worker)
        self._fill(self._count)

    def lend(self, plan: Plan | None = None) -> WorkerProcess:
        """Return a worker for one user, who gives it back; one more is started if all are in use.

        Args:
            plan: What it has to suit; None for a plan without interface packages.
        """
        others: list[WorkerProcess | None] = []
        found: WorkerProcess | None = None
        with contextlib.suppress(queue.Empty):
            while found is None:
                worker = self._idle.get_nowait()
                if worker is not None and worker.gone:
                    worker = None
                if worker is not None and (plan is None or worker.suits(plan)):
                    found = worker
                else:
                    others.append(worker)
        if found is None and others:  # its place is that of the new one
            self._discard(others.pop(others.index(None) if None in others else 0))
        for worker in reversed(others):
            self._idle.put(worker)
        return found or self._pool.submit(self._start).result()

    def take_back(self, worker: WorkerProcess, *, usable: bool) -> None:
        """Keep a worker for the next user, or end it and leave its place empty."""
        if not usable:
            self._discard(worker)
        self._idle.put(worker if usable else None)

    def record(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> list[AssessedTrace]:
        """Record every job and return the traces in the same order."""
        return list(self.each(jobs, progress))

    def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[AssessedTrace]:
        """Begin to record every job, and yield the traces in the same order, each as soon as it is available.

        With several workers, the longest scenarios begin first, so that no worker is left alone with one at the end.
        """
        self._pool.submit(self._prepare, [job.plan for job in jobs]).result()
        order = sorted(range(len(jobs)), key=lambda at: 0 if self._count == 1 else -_length(jobs[at]))
        futures = {at: self._pool.submit(self._record, jobs[at], progress) for at in order}
        return (futures[at].result() for at in range(len(jobs)))

    def _record(self, job: Job, progress: Callable[[str], None]) -> AssessedTrace:
        """Record a job, and repeat it if a signal ended a process or messages were lost: a real fault happens again."""
        progress(job.title)
        if job.plan.clock != ClockKind.WALL.value:
            return self._recorded_surely(job)
        self._on_wall_clock()
        with contextlib.nullcontext() if job.parallel else self._on_the_wall:
            return self._recorded_surely(job)

    def _recorded_surely(self, job: Job) -> AssessedTrace:
        trace = self._recorded(job)
        # A signal that no limit explains may come from the machine, such as one that is out of memory.
        doubtful = trace.incomplete or any(f.signal for f in trace.faults())
        return self._recorded(job) if doubtful and job.budget.left_ns else trace

    def _recorded(self, job: Job) -> AssessedTrace:
        problem = ""
        limits: list[str] = []
        with_submission = 0  # failures after its code had started, as far as that is known
        tries = 0
        while tries < TRIES:
            if not job.budget.left_ns:
                return job.budget.unrecorded(job.plan)
            worker = self._idle.get()
            while worker is not None and worker.gone and self._drops_place():
                worker = self._idle.get()
            usable = None
            try:
                if worker is not None and not worker.suits(job.plan):
                    self._discard(worker)
                    worker = None
                worker = worker or self._start()
                trace = worker.run(job.plan, job.budget)
                if not worker.worn:
                    usable = worker
                elif not worker.has_forks():
                    self._discard(worker)
                return trace
            except HarnessError as error:
                problem = error.message
                self._discard(worker)
                limit, late = (error.limit, error.late) if isinstance(error, WorkerLostError) else ("", False)
                limits += [limit] if limit else []
                started = isinstance(error, WorkerFailedError) and error.has_started
                with_submission += started or (isinstance(error, WorkerLostError) and not late)
                tries += worker is None or not worker.shares or bool(limit)  # a replacement does not share its sandbox
                if late or self._closed:
                    break
            finally:
                if usable is not None or not self._drops_place():
                    self._idle.put(usable)
        clock = ClockKind(job.plan.clock)
        if len(limits) == TRIES:
            faults = tuple(
                Fault(
                    0,
                    name,
                    FaultKind.KILLED,
                    f"stopped: receiving what the nodes sent took the grader's process to {limits[-1]}",
                )
                for name, _ in job.plan.processes
            )
            return AssessedTrace(job.plan.scenario, clock, stop_ns=job.plan.duration_ns, observations=faults)
        suspected = with_submission >= TRIES
        if suspected:
            problem += f" ({with_submission} times, each time in another worker, while this submission was recorded)"
        return AssessedTrace(
            job.plan.scenario, clock, stop_ns=0, observations=(), harness_problem=problem, suspected=suspected
        )

    def _drops_place(self) -> bool:
        """Return whether a worker is not replaced until none is busy: the others go on, and a start takes long."""
        with self._lock:
            drops = self._places > 1
            self._places -= drops
            return drops

    def _start(self, *, forks: int = 0) -> ExecutedWorker:
        with self._lock:
            if self._closed:
                raise HarnessError("worker: the recorder is closed")
            given = (self._isolation, self._runtime, self._domains, self._scratch)
            worker = ExecutedWorker(*given, forks=forks, executes=self._executes, limits=self._limits)
            self._alive += [worker, *worker.forked]
            return worker

    def _discard(self, worker: WorkerProcess | None) -> None:
        with self._lock:
            if worker in self._alive and worker is not None:
                self._alive.remove(worker)
                self._close(worker)

    def _close(self, worker: WorkerProcess) -> None:
        # The kernel never credits this time: the parents that would reap these processes die with them.
        self.ended_ns += worker.used_ns()
        worker.close()

    def close(self) -> None:
        """Kill every worker; running jobs are abandoned."""
        with self._lock:
            self._closed = True
            alive, self._alive = self._alive, []
        for worker in alive:
            worker.close()
        self._pool.shutdown(wait=True, cancel_futures=True)


def _length(job: Job) -> int:
    """Return an estimate of how long a recording takes, for comparison."""
    return job.plan.duration_ns * len(job.plan.processes)


def _environment(runtime: PythonRuntime, scratch: Path) -> Mapping[str, str]:
    """Return the complete environment of a worker; nothing but these variables comes from the caller's."""
    names = ("PATH", "GRADER_DEBUG", "PYTHONHASHSEED")
    from_caller = {name: os.environ[name] for name in names if name in os.environ}
    return {**worker_environment(runtime, scratch), **from_caller}
