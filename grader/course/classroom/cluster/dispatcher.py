"""Distributes the submissions of a class over a Dask cluster, and yields the result of each exactly once."""

from __future__ import annotations

import importlib.metadata
import json
import logging
import os
import queue
import secrets
import threading
from collections import deque
from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import field
from pathlib import Path

from distributed import Client, Future, KilledWorker, Security

import grader
from grader.course.classroom.cluster import workers as remote
from grader.course.classroom.local import Attempt, ClassScheduler, OnStep, Task, failed_attempt
from grader.course.classroom.messages import Fitness, Terms, pack_message, unpack_message
from grader.course.classroom.receiving import other_version
from grader.course.classroom.sending import answer_in, files_wanted, job_for, store_result, terms_of
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault, HarnessError

#: Larger payloads are scattered to a worker instead of passing through the scheduler with the task.
SCATTERED_BYTES = 1 << 20
#: Most attempts for a submission after failures that neither it nor the death of its worker caused.
TRIES = 3
#: How long to wait for an answer before looking whether the scheduler is still there, which nothing announces.
_POLL_S = 0.5
_CLUSTER = "cluster"
_PACKAGE = "rclpy-grader"


class WorkerPool:
    """Knows which workers can grade; asks each worker once, when it first appears.

    Workers must have this version of the grader. If one that joins later is not used, `warn` is called with the reason.
    """

    def __init__(self, client: Client, version: str, warn: Callable[[str], None]) -> None:
        self._client = client
        self._version = version
        self._warn = warn
        self._known: dict[str, Fitness] = {}
        self._isolation = ""

    def inspect(self, isolation: str) -> Sequence[str]:
        """Ask all present workers whether they can grade, and return warnings for the instructor.

        Raises EnvironmentFault if the scheduler lacks the package, or if there are workers but none of them can grade.
        """
        self._isolation = isolation
        self._check_scheduler()
        threads = self._threads()
        self._ask(threads)
        found = [self._known[address] for address in threads if address in self._known]
        unfit = [fitness for fitness in found if fitness.unfit]
        if found and len(unfit) == len(found):
            first = unfit[0]
            raise EnvironmentFault(
                f"cluster: expected a worker that can grade, found none among {len(found)} ({_problem(first)})",
                first.hint,
            )
        if not threads:
            return ("cluster: no worker yet; grading starts when one joins",)
        remarks = dict.fromkeys(f"{fitness.machine}: {remark}" for fitness in found for remark in fitness.remarks)
        return (*(f"{_problem(fitness)}; it is not used" for fitness in unfit), *remarks)

    def usable(self) -> Mapping[str, int]:
        """Return the workers that can grade and their thread counts; asks new workers first."""
        threads = self._threads()
        newcomers = [address for address in threads if address not in self._known]
        if newcomers:
            self._ask(newcomers)
            for fitness in (self._known.get(address) for address in newcomers):
                if fitness is not None and fitness.unfit:
                    self._warn(f"{_problem(fitness)}; it is not used")
        return {address: count for address, count in threads.items() if self._fit(address)}

    def only(self, fit: Collection[str]) -> tuple[str, ...]:
        """Return the workers that a submission is restricted to; empty if every worker can grade."""
        unfit = any(fitness.unfit for fitness in self._known.values())
        return tuple(sorted(fit)) if unfit else ()

    def rule_out(self, machine: str, problem: str, hint: str) -> None:
        """Stop using a worker that turned out to be unable to grade."""
        for address in self._threads():
            if f" {address} " in machine and self._fit(address):
                self._known[address] = fitness = Fitness(machine, problem, hint)
                self._warn(f"{_problem(fitness)}; it is not used")

    def forget(self, addresses: Collection[str]) -> None:
        """Ask these workers again the next time."""
        for address in addresses:
            self._known.pop(address, None)

    def _fit(self, address: str) -> bool:
        fitness = self._known.get(address)
        return fitness is None or not fitness.unfit

    def _threads(self, tries: int = 2) -> dict[str, int]:
        try:
            return dict(self._client.nthreads())
        except (OSError, TimeoutError):
            if tries == 1 or self._client.status != "running":
                raise scheduler_lost() from None
        # One of several connections was closed, perhaps because a worker ended.
        return self._threads(tries - 1)

    def _check_scheduler(self) -> None:
        """Check the scheduler's version of the grader: it deserialises tasks before it forwards them."""
        try:
            found = str(self._client.run_on_scheduler(importlib.metadata.version, _PACKAGE))
        except importlib.metadata.PackageNotFoundError:
            found = ""
        if found != self._version:
            problem = other_version(self._version, found)
            raise EnvironmentFault(f"scheduler of the cluster: {problem}", _remedy(self._version))

    def _ask(self, addresses: Collection[str]) -> None:
        """Ask workers for their version, which works without the grader; then inspect those with the right one."""
        right = []
        for address, found in self._run(importlib.metadata.version, _PACKAGE, addresses).items():
            if found == self._version:
                right.append(address)
            elif isinstance(found, (str, importlib.metadata.PackageNotFoundError)):
                problem = other_version(self._version, found if isinstance(found, str) else "")
                self._known[address] = Fitness(f"worker {address}", problem, _remedy(self._version))
        for address, reply in self._run(remote.inspect_worker, self._isolation, right).items():
            if isinstance(reply, bytes):
                self._known[address] = unpack_message(reply, Fitness)
            elif not isinstance(reply, OSError):  # the worker has left in the meantime
                self._known[address] = Fitness(f"worker {address}", f"the grader failed: {type(reply).__name__}")

    def _run(self, function: Callable[..., object], argument: str, addresses: Collection[str]) -> dict[str, object]:
        if not addresses:
            return {}
        try:
            return dict(self._client.run(function, argument, workers=list(addresses), on_error="return"))
        except (OSError, TimeoutError):
            raise scheduler_lost() from None


def scheduler_lost() -> HarnessError:
    """Build the error for a scheduler that no longer answers."""
    return HarnessError(
        "cluster: the scheduler no longer answers",
        "what was graded is kept; run the same command again when the scheduler is back",
    )


def _remedy(version: str) -> str:
    return f"install rclpy-grader {version} with its extra dask there"


def _problem(fitness: Fitness) -> str:
    return f"{fitness.machine}: {fitness.unfit}"


@dataclass(slots=True)
class _Sending:
    """A submission that is being graded on the cluster."""

    task: Task
    tries: int = 0  # how often it was sent
    only: tuple[str, ...] = ()  # workers that may grade it; empty for any worker
    future: Future[bytes] | None = None
    payloads: list[object] = field(default_factory=list)  # its scattered data; kept alive until the answer arrives


class Dispatcher:
    """Grades one batch; events of progress arrive on a Dask topic of its own.

    At most `jobs` submissions are graded in parallel; None for as many as the workers have threads.
    """

    def __init__(  # noqa: PLR0913  each is needed for as long as the batch runs
        self, client: Client, worker_pool: WorkerPool, jobs: int | None, terms: Terms, on_step: OnStep, topic: str
    ) -> None:
        self._client = client
        self._worker_pool = worker_pool
        self._jobs = jobs
        self._terms = pack_message(terms)
        self._on_step = on_step
        self._topic = topic
        self._waiting: deque[_Sending] = deque()
        self._under_way: dict[str, _Sending] = {}
        self._arrived: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._count = 0
        self._lock = threading.Lock()
        self._names: set[str] = set()

    def run(self, tasks: Sequence[Task]) -> Generator[Attempt, None, None]:
        """Yield the attempt for each task exactly once; raises HarnessError if the scheduler is gone."""
        self._client.subscribe_topic(self._topic, self._on_event)
        self._waiting.extend(map(_Sending, tasks))
        wanted = files_wanted(tasks[0]) if tasks else ()
        while self._waiting or self._under_way:
            yield from self._send_due(wanted)
            key = self._next()
            if key is not None and key in self._under_way:
                attempt = self._finish(key)
                if attempt is not None:
                    yield from self._pass_on(attempt, wanted)

    def _pass_on(self, attempt: Attempt, wanted: Sequence[str]) -> Generator[Attempt, None, None]:
        """Send further submissions before yielding an attempt, so that no worker waits for the disk here."""
        try:
            yield from self._send_due(wanted)
        except HarnessError:
            yield attempt
            raise
        yield attempt

    def close(self) -> None:
        """Cancel all submissions that are being graded."""
        with self._lock:
            self._names.clear()
        futures = [sending.future for sending in self._under_way.values() if sending.future is not None]
        self._under_way.clear()
        if self._client.status == "running":
            with suppress(OSError, TimeoutError, ValueError):
                self._client.unsubscribe_topic(self._topic)
                self._client.cancel(futures, force=True)

    def _next(self) -> str | None:
        """Wait briefly for an answer, and return its key; None if none arrived."""
        try:
            key = self._arrived.get(timeout=_POLL_S)
        except queue.Empty:
            key = None
        if self._client.status != "running":
            raise scheduler_lost()
        return key

    def _send_due(self, wanted: Sequence[str]) -> Generator[Attempt, None, None]:
        """Send as many submissions as the workers have capacity for; yield attempts for those that cannot be sent."""
        fit = self._worker_pool.usable()
        self._take_back_orphaned(fit.keys())
        most = self._jobs or max(1, sum(fit.values()))
        while self._waiting and len(self._under_way) < most:
            sending = self._waiting.popleft()
            job = job_for(sending.task, wanted)
            if isinstance(job, Attempt):
                yield job
            else:
                self._send(sending, pack_message(job), self._worker_pool.only(fit), near=bool(fit))

    def _send(self, sending: _Sending, job: bytes, only: tuple[str, ...], *, near: bool) -> None:
        self._count += 1
        key = f"{self._topic}-{self._count}"  # never reused, so that an answer cannot be mistaken for another one
        sending.tries += 1
        sending.only = only
        with self._lock:
            self._names.add(sending.task.name)
        sending.payloads = [self._payload(data, near=near) for data in (self._terms, job)]
        sending.future = self._client.submit(
            remote.grade_packed_job,
            grader.__version__,
            *sending.payloads,
            self._topic,
            key=key,
            pure=False,
            workers=list(only) or None,
        )
        self._under_way[key] = sending
        sending.future.add_done_callback(lambda future: self._arrived.put(str(future.key)))

    def _payload(self, data: bytes, *, near: bool) -> object:
        """Scatter large data to a worker if there is one; return the data or its future."""
        if not near or len(data) <= SCATTERED_BYTES:
            return data
        try:
            return self._client.scatter(data, hash=False)
        except (OSError, TimeoutError):  # the target worker has just ended: send the data with the task
            return data

    def _take_back_orphaned(self, alive: Collection[str]) -> None:
        """Queue submissions again whose allowed workers are all gone: no other worker would take them."""
        for key, sending in list(self._under_way.items()):
            if sending.only and not set(sending.only).intersection(alive) and sending.future is not None:
                del self._under_way[key]
                self._client.cancel([sending.future], force=True)
                self._waiting.appendleft(sending)

    def _finish(self, key: str) -> Attempt | None:
        """Return the attempt for an answered submission, or None after queueing it again."""
        sending = self._under_way.pop(key)
        future, sending.future = sending.future, None
        assert future is not None
        attempt = self._outcome(sending, future)
        sending.payloads.clear()
        future.release()
        with self._lock:
            self._names.discard(sending.task.name)
        if attempt is None:
            self._waiting.appendleft(sending)
        return attempt

    def _outcome(self, sending: _Sending, future: Future[bytes]) -> Attempt | None:
        if future.status == "finished":
            return self._answered(sending, future.result())
        if future.status == "error":
            return self._erred(sending, future.exception())
        return self._once_more(sending, "the cluster lost it")

    def _answered(self, sending: _Sending, data: object) -> Attempt | None:
        answer = answer_in(data, _CLUSTER)
        if not answer.unfit:
            return store_result(sending.task, answer)
        self._worker_pool.rule_out(answer.machine, answer.unfit, answer.hint)
        return self._once_more(sending, f"{answer.machine}: {answer.unfit}", answer.hint)

    def _erred(self, sending: _Sending, error: BaseException | None) -> Attempt | None:
        if isinstance(error, KilledWorker):
            problem = f"{error.allowed_failures + 1} workers of the cluster ended while they graded it"
            return failed_attempt(sending.task, problem, "check what ended them, such as a memory limit")
        self._worker_pool.forget(self._worker_pool.usable())  # one of them may have become unable to grade
        return self._once_more(sending, f"{_CLUSTER}: {type(error).__name__}")

    def _once_more(self, sending: _Sending, problem: str, hint: str = "") -> Attempt | None:
        if sending.tries < TRIES and self._worker_pool.usable():
            return None
        return failed_attempt(sending.task, problem, *filter(None, [hint]))

    def _on_event(self, event: tuple[float, object]) -> None:
        """Report a step, unless its submission is already finished."""
        message = event[1]
        if not isinstance(message, dict):
            return
        name, step = str(message.get(remote.NAME)), str(message.get(remote.STEP))[:200]
        with self._lock:
            if name in self._names:
                self._on_step(name, step)


class ClusterScheduler:
    """Grades on the workers of a cluster.

    At most `jobs` submissions are graded in parallel; None for as many as the workers have threads. If a worker that
    joins later is not used, `warn` is called with the reason.
    """

    def __init__(self, client: Client, jobs: int | None, warn: Callable[[str], None]) -> None:
        self._client = client
        self._jobs = jobs
        self._worker_pool = WorkerPool(client, grader.__version__, warn)

    def prepare(self, isolation: str) -> Sequence[str]:
        """Ask every worker whether it can grade; see `ClassScheduler`."""
        return self._worker_pool.inspect(isolation)

    def run(self, tasks: Sequence[Task], on_step: OnStep) -> Generator[Attempt, None, None]:
        """Yield an attempt for each task; see `ClassScheduler`."""
        if not tasks:
            return
        dispatcher = Dispatcher(
            self._client, self._worker_pool, self._jobs, terms_of(tasks[0]), on_step, f"grade-{secrets.token_hex(8)}"
        )
        try:
            yield from dispatcher.run(tasks)
        finally:
            dispatcher.close()


#: Longest wait for the connection to the scheduler, and for closing it.
CONNECT_S = 15.0
#: Closing waits for a scheduler that may be gone; all results are there by then.
_CLOSE_S = 5.0
_LOGGERS = ("distributed", "distributed.client")


@contextmanager
def connected(
    place: str, jobs: int | None, warn: Callable[[str], None], *, timeout_s: float = CONNECT_S
) -> Iterator[ClassScheduler]:
    """Connect to a cluster, and disconnect at the end; raises EnvironmentFault if no scheduler answers.

    The place is the address of the scheduler, such as `tcp://host:8786`, or a scheduler file; for `jobs` and `warn` see
    `ClusterScheduler`.
    """
    address = scheduler_address(place)
    if os.environ.get("GRADER_DEBUG") != "1":
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL)  # the grader reports errors itself
    client = _client(address, timeout_s)
    try:
        yield ClusterScheduler(client, jobs, warn)
    finally:
        client.close(timeout=_CLOSE_S)


def scheduler_address(place: str) -> str:
    """Return the scheduler's address, given as such or in a scheduler file; raises EnvironmentFault."""
    path = Path(place)
    if ":" in place and not path.is_file():
        return place
    try:
        return str(json.loads(path.read_bytes())["address"])
    except OSError as error:
        message = f"--scheduler {place}: expected an address or a scheduler file, found: {error.strerror}"
        raise EnvironmentFault(message, "an address looks like tcp://host:8786") from None
    except (ValueError, KeyError, TypeError, RecursionError):
        message = f"--scheduler {place}: expected a file that `dask scheduler --scheduler-file` wrote, found another"
        raise EnvironmentFault(message, "name the address, such as tcp://host:8786") from None


def _client(address: str, timeout_s: float) -> Client:
    if address.startswith("tls://") and Security().get_connection_args("client").get("ssl_context") is None:
        message = f"--scheduler {address}: expected certificates in Dask's configuration, found none"
        raise EnvironmentFault(message, "name them under distributed.comm.tls: ca-file, client.cert, client.key")
    try:
        return Client(address, timeout=timeout_s, set_as_default=False, name="grade-batch")
    except (OSError, TimeoutError):
        message = f"--scheduler {address}: expected a Dask scheduler, found none that answers"
        raise EnvironmentFault(message, "start it with `dask scheduler`, or check for a firewall in between") from None
    except (ValueError, TypeError) as error:
        raise EnvironmentFault(f"--scheduler {address}: expected an address, found: {error}") from None
