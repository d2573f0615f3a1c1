"""Keeps a Dask cluster busy with the submissions of a class, and settles the result of each once."""

from __future__ import annotations

import json
import logging
import os
import queue
import secrets
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from distributed import Client, Future, KilledWorker, Security

import grader
from grader.classroom.cluster import jobs as remote
from grader.classroom.cluster.sending import answer_in, errand_of, failed, files_wanted, taken_in, terms_of
from grader.classroom.cluster.worker_pool import WorkerPool, lost
from grader.classroom.local import Attempt, Hear, MakeScheduler, Task
from grader.classroom.messages import Terms, pack
from grader.core.errors import EnvironmentFault, HarnessError

#: Larger parcels are laid down on a worker instead of travelling through the scheduler with what is to be done.
SCATTERED_BYTES = 1 << 20
#: Most times that a submission is sent because of what is neither its own nor its worker's death.
TRIES = 3
_POLL_S = 0.5
_CLUSTER = "cluster"


@dataclass(slots=True)
class _Sending:
    """One submission on its way.

    Attributes:
        task: Which one.
        tries: How often it was sent.
        only: The workers it may go to; empty if any will do.
        future: What will be its answer.
        parcels: What it needs and what must not be dropped before.
    """

    task: Task
    tries: int = 0
    only: tuple[str, ...] = ()
    future: Future[bytes] | None = None
    parcels: list[object] = field(default_factory=list)


class Dispatcher:
    """Grades one batch.

    Args:
        client: Speaks to the cluster.
        worker_pool: Its workers.
        jobs: Submissions at a time; None for as many as the workers have threads.
        terms: What the class is graded with.
        hear: Hears which step of which submission begins.
        topic: A name that nobody else on the cluster uses.
    """

    def __init__(  # noqa: PLR0913  each is needed for as long as the batch runs
        self, client: Client, worker_pool: WorkerPool, jobs: int | None, terms: Terms, hear: Hear, topic: str
    ) -> None:
        self._client = client
        self._worker_pool = worker_pool
        self._jobs = jobs
        self._terms = pack(terms)
        self._hear = hear
        self._topic = topic
        self._waiting: deque[_Sending] = deque()
        self._under_way: dict[str, _Sending] = {}
        self._arrived: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._count = 0
        self._lock = threading.Lock()
        self._names: set[str] = set()

    def serve(self, tasks: Sequence[Task]) -> Generator[Attempt, None, None]:
        """Yield what comes of each task, once; raises HarnessError if the scheduler is gone."""
        self._client.subscribe_topic(self._topic, self._heard)
        self._waiting.extend(map(_Sending, tasks))
        wanted = files_wanted(tasks[0]) if tasks else ()
        while self._waiting or self._under_way:
            yield from self._send_due(wanted)
            key = self._next()
            if key is not None and key in self._under_way:
                attempt = self._settled(key)
                if attempt is not None:
                    yield from self._handed_over(attempt, wanted)

    def _handed_over(self, attempt: Attempt, wanted: Sequence[str]) -> Generator[Attempt, None, None]:
        """Yield what came of a submission when others are on their way: no worker waits for the disk here."""
        try:
            yield from self._send_due(wanted)
        except HarnessError:
            yield attempt
            raise
        yield attempt

    def close(self) -> None:
        """Give up what is under way."""
        with self._lock:
            self._names.clear()
        futures = [sending.future for sending in self._under_way.values() if sending.future is not None]
        self._under_way.clear()
        if self._client.status == "running":
            with suppress(OSError, TimeoutError, ValueError):
                self._client.unsubscribe_topic(self._topic)
                self._client.cancel(futures, force=True)

    def _next(self) -> str | None:
        """Return the key of an answer that is there, or None after a while."""
        try:
            key = self._arrived.get(timeout=_POLL_S)
        except queue.Empty:
            key = None
        if self._client.status != "running":
            raise lost()
        return key

    def _send_due(self, wanted: Sequence[str]) -> Generator[Attempt, None, None]:
        """Send what the workers have room for; yield what comes at once of submissions that cannot be sent."""
        fit = self._worker_pool.look()
        self._call_back_stranded(fit.keys())
        most = self._jobs or max(1, sum(fit.values()))
        while self._waiting and len(self._under_way) < most:
            sending = self._waiting.popleft()
            job = errand_of(sending.task, wanted)
            if isinstance(job, Attempt):
                yield job
            else:
                self._send(sending, pack(job), self._worker_pool.only(fit), near=bool(fit))

    def _send(self, sending: _Sending, job: bytes, only: tuple[str, ...], *, near: bool) -> None:
        self._count += 1
        key = f"{self._topic}-{self._count}"  # never used twice: nothing is taken for a result of something else
        sending.tries += 1
        sending.only = only
        with self._lock:
            self._names.add(sending.task.name)
        sending.parcels = [self._parcel(data, near=near) for data in (self._terms, job)]
        sending.future = self._client.submit(
            remote.grade,
            grader.__version__,
            *sending.parcels,
            self._topic,
            key=key,
            pure=False,
            workers=list(only) or None,
        )
        self._under_way[key] = sending
        sending.future.add_done_callback(lambda future: self._arrived.put(str(future.key)))

    def _parcel(self, data: bytes, *, near: bool) -> Any:
        """Return bytes as they are given to the cluster: large ones go to a worker first, if there is one."""
        if not near or len(data) <= SCATTERED_BYTES:
            return data
        try:
            return self._client.scatter(data, hash=False)
        except (OSError, TimeoutError):  # the worker that it was meant for has just ended: let it travel
            return data

    def _call_back_stranded(self, alive: Any) -> None:
        """Take back submissions all of whose workers are gone: nobody would ever take them."""
        for key, sending in list(self._under_way.items()):
            if sending.only and not set(sending.only) & set(alive) and sending.future is not None:
                del self._under_way[key]
                self._client.cancel([sending.future], force=True)
                self._waiting.appendleft(sending)

    def _settled(self, key: str) -> Attempt | None:
        """Return what came of a submission that was answered, or None if it is to be sent once more."""
        sending = self._under_way.pop(key)
        future, sending.future = sending.future, None
        assert future is not None
        attempt = self._outcome(sending, future)
        sending.parcels.clear()
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
            return taken_in(sending.task, answer)
        self._worker_pool.rule_out(answer.machine, answer.unfit, answer.hint)
        return self._once_more(sending, f"{answer.machine}: {answer.unfit}", answer.hint)

    def _erred(self, sending: _Sending, error: BaseException | None) -> Attempt | None:
        if isinstance(error, KilledWorker):
            problem = f"{error.allowed_failures + 1} workers of the cluster ended while they graded it"
            return failed(sending.task, problem, "look at what ended them, such as a limit of memory")
        self._worker_pool.forget(self._worker_pool.look())  # one of them may have become unable to grade
        return self._once_more(sending, f"{_CLUSTER}: {type(error).__name__}")

    def _once_more(self, sending: _Sending, problem: str, hint: str = "") -> Attempt | None:
        if sending.tries < TRIES and self._worker_pool.look():
            return None
        return failed(sending.task, problem, *filter(None, [hint]))

    def _heard(self, event: tuple[float, Any]) -> None:
        """Pass on a step, unless it is told late."""
        said = event[1]
        if not isinstance(said, dict):
            return
        name, step = str(said.get(remote.NAME)), str(said.get(remote.STEP))[:200]
        with self._lock:
            if name in self._names:
                self._hear(name, step)


class ClusterScheduler:
    """Grades on the workers of a cluster.

    Args:
        client: Speaks to the scheduler of the cluster; stays open.
        jobs: Submissions at a time; None for as many as the workers have threads.
        warn: Hears why a worker that joined later is not used.
    """

    def __init__(self, client: Client, jobs: int | None, warn: Callable[[str], None]) -> None:
        self._client = client
        self._jobs = jobs
        self._worker_pool = WorkerPool(client, grader.__version__, warn)

    def prepare(self, isolation: str) -> Sequence[str]:
        """Ask every worker whether it can grade; see `Scheduler`."""
        return self._worker_pool.inspect(isolation)

    def run(self, tasks: Sequence[Task], hear: Hear) -> Generator[Attempt, None, None]:
        """Yield what comes of each task; see `Scheduler`."""
        if not tasks:
            return
        dispatcher = Dispatcher(
            self._client, self._worker_pool, self._jobs, terms_of(tasks[0]), hear, f"grade-{secrets.token_hex(8)}"
        )
        try:
            yield from dispatcher.serve(tasks)
        finally:
            dispatcher.close()


#: Longest wait for a scheduler to answer, and for it to say goodbye.
CONNECT_S = 15.0
_GOODBYE_S = 5.0
_LOGGERS = ("distributed", "distributed.client")


@contextmanager
def connected(
    place: str, jobs: int | None, warn: Callable[[str], None], *, patience_s: float = CONNECT_S
) -> Iterator[MakeScheduler]:
    """Connect to a cluster, and let go of it afterwards.

    Args:
        place: Address of the scheduler, such as `tcp://host:8786`, or a scheduler file.
        jobs: Submissions at a time; None for as many as the cluster has threads.
        warn: Hears why a worker that joined later is not used.
        patience_s: Longest wait for an answer.

    Raises:
        EnvironmentFault: There is no scheduler.
    """
    address = address_of(place)
    if os.environ.get("GRADER_DEBUG") != "1":
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL)  # what an instructor must know, we say ourselves
    client = _client(address, patience_s)
    try:
        yield lambda _: ClusterScheduler(client, jobs, warn)
    finally:
        client.close(timeout=_GOODBYE_S)


def address_of(place: str) -> str:
    """Return the address of a scheduler that was named by it or by its file; raises EnvironmentFault."""
    path = Path(place)
    if ":" in place and not path.is_file():
        return place
    try:
        said = json.loads(path.read_bytes())
        return str(said["address"])
    except OSError as error:
        message = f"--scheduler {place}: expected an address or a scheduler file, found: {error.strerror}"
        raise EnvironmentFault(message, "an address looks like tcp://host:8786") from None
    except (ValueError, KeyError, TypeError, RecursionError):
        message = f"--scheduler {place}: expected a file that `dask scheduler --scheduler-file` wrote, found another"
        raise EnvironmentFault(message, "name the address, such as tcp://host:8786") from None


def _client(address: str, patience_s: float) -> Client:
    if address.startswith("tls://") and Security().get_connection_args("client").get("ssl_context") is None:
        message = f"--scheduler {address}: expected certificates in Dask's configuration, found none"
        raise EnvironmentFault(message, "name them under distributed.comm.tls: ca-file, client.cert, client.key")
    try:
        return Client(address, timeout=patience_s, set_as_default=False, name="grade-batch")
    except (OSError, TimeoutError):
        message = f"--scheduler {address}: expected a Dask scheduler, found none that answers"
        raise EnvironmentFault(
            message, "start it with `dask scheduler`, or look whether a firewall is between"
        ) from None
    except (ValueError, TypeError) as error:
        raise EnvironmentFault(f"--scheduler {address}: expected an address, found: {error}") from None
