"""What stands in for a cluster: a client whose workers answer as they are told, and tasks to send there."""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from grader import __version__
from grader.course.classroom import store as kept
from grader.course.classroom.local import Task
from grader.course.classroom.messages import Fitness, GradingJob, JobResult, pack_message, unpack_message
from grader.course.classroom.store import Conditions, ResultStatus, State
from grader.grading.model.grading_options import GradingOptions

CONDITIONS = Conditions(
    "0", (("velocity_publisher", "sha256:1"),), "", GradingOptions(exercises=("velocity_publisher",))
)
ONE, TWO = "tcp://10.0.0.1:1", "tcp://10.0.0.2:1"


def task(folder: Path, name: str = "ada", *, options: Mapping[str, Any] | None = None, **changes: Any) -> Task:
    """Return a task for a submission that lies in `folder/name` and holds one program; other options may be given."""
    place = folder / name
    place.mkdir(exist_ok=True)
    (place / "velocity_publisher.py").write_text("pass\n", encoding="utf-8")
    fields: dict[str, Any] = {
        "name": name,
        "label": name,
        "submission": place,
        "into": folder / f"{name} result",
        "conditions": replace(CONDITIONS, options=replace(CONDITIONS.options, **(options or {}))),
        "workers": 2,
        "standalone": False,
        "deadline_s": 60.0,
    }
    return Task(**{**fields, **changes})


def graded(
    name: str = "ada", machine: str = f"worker {ONE} on lab", score: float = 3.0, key: str | None = None
) -> JobResult:
    """Return an answer with a result."""
    key = CONDITIONS.key("sha256:2") if key is None else key
    status = ResultStatus(State.GRADED, key, "sha256:2", name, score=score, max_score=10.0)
    return JobResult(machine, kept.dump_status(status), ((b"report.json", b"{}"), (b"evidence/a.mcap", b"x")))


class FakeFuture:
    """An answer that is there at once, unless nobody would take the submission."""

    def __init__(self, key: str, status: str, value: Exception | bytes | None) -> None:
        self.key, self.status, self._value = key, status, value

    def add_done_callback(self, call: Callable[..., Any]) -> None:
        if self.status != "pending":
            call(self)

    def result(self) -> bytes:
        assert isinstance(self._value, bytes)
        return self._value

    def exception(self) -> Exception:
        assert isinstance(self._value, Exception)
        return self._value

    def release(self) -> None:
        """Do nothing."""


class FakeClient:
    """A cluster: `answers` is called with name and allowed workers, and returns what becomes of a submission."""

    def __init__(
        self,
        answers: Callable[..., Any] | None = None,
        threads: dict[str, int] | None = None,
        versions: Mapping[str, Any] | None = None,
        fitness: Mapping[str, Any] | None = None,
        scheduler: PackageNotFoundError | str = __version__,
    ) -> None:
        self.answers = answers or (lambda name, only: graded(name))
        self.threads = {ONE: 1, TWO: 1} if threads is None else threads
        self.versions = versions or {}
        self.fitness = fitness or {}
        self.scheduler = scheduler
        self.status = "running"
        self.sent: list[str] = []
        self.cancelled: list[FakeFuture] = []
        self.keys: list[str] = []
        self.handler: Callable[..., Any] | None = None

    def nthreads(self) -> dict[str, int] | None:
        if self.status != "running":
            raise OSError("gone")
        return self.threads

    def run_on_scheduler(self, function: Callable[..., Any], argument: str) -> str | None:
        if isinstance(self.scheduler, Exception):
            raise self.scheduler
        return self.scheduler

    def run(
        self, function: Callable[..., Any], argument: str, *, workers: Sequence[str], on_error: str
    ) -> dict[str, Any]:
        assert on_error == "return"
        if function.__name__ == "version":
            return {w: self.versions.get(w, __version__) for w in workers}
        found = {w: self.fitness.get(w, Fitness(f"worker {w} on lab")) for w in workers}
        return {w: pack_message(fit) if isinstance(fit, Fitness) else fit for w, fit in found.items()}

    def submit(
        self,
        function: Callable[..., Any],
        version: str,
        terms: bytes,
        errand: bytes | types.SimpleNamespace,
        topic: str,
        *,
        key: str,
        pure: bool,
        workers: Sequence[str] | None,
    ) -> FakeFuture:
        assert pure is False
        assert key not in self.keys
        self.keys.append(key)
        name = unpack_message(errand.data if isinstance(errand, SimpleNamespace) else errand, GradingJob).name
        self.sent.append(name)
        said = self.answers(name, workers)
        if isinstance(said, JobResult):
            return FakeFuture(key, "finished", pack_message(said))
        if isinstance(said, Exception):
            return FakeFuture(key, "error", said)
        return FakeFuture(key, said, None)

    def scatter(self, data: bytes, **options: bool) -> types.SimpleNamespace:
        assert options == {"hash": False}
        return SimpleNamespace(data=data)

    def cancel(self, futures: Sequence[FakeFuture], *, force: bool) -> None:
        self.cancelled += futures

    def subscribe_topic(self, topic: str, handler: Callable[..., Any]) -> None:
        self.handler = handler

    def unsubscribe_topic(self, topic: str) -> None:
        self.handler = None
