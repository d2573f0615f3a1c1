"""What becomes of submissions on a cluster: each has one result, whatever happens to workers on the way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from dask_samples import ONE, TWO, FakeClient, graded, task
from distributed import Client, KilledWorker
from distributed.scheduler import WorkerState

from grader.course.classroom.cluster.dispatcher import ClusterScheduler
from grader.course.classroom.messages import JobResult
from grader.course.classroom.store import ResultStatus, State
from grader.runtime.model.errors import HarnessError

NAMES = ("ada", "bob", "cleo", "dan")


def run(
    tmp_path: Path,
    client: FakeClient,
    jobs: int | None = None,
    names: tuple[str, ...] = NAMES,
    on_step: Callable[..., Any] = lambda name, step: None,
) -> dict[str, ResultStatus]:
    """Grade on a cluster, and return name -> status; each name comes once."""
    here = ClusterScheduler(cast("Client", client), jobs, lambda line: None)
    here.prepare("auto")
    attempts = list(here.run([task(tmp_path, name) for name in names], on_step))
    assert Counter(a.task.name for a in attempts) == Counter(names)
    return {a.task.name: a.status for a in attempts}


def test_everybody_has_a_result_once(tmp_path: Path) -> None:
    """And each key that the cluster knows a submission by is used once."""
    client = FakeClient()
    found = run(tmp_path, client)
    assert {s.state for s in found.values()} == {State.GRADED}
    assert client.sent == list(NAMES)
    assert len(set(client.keys)) == 4


@pytest.mark.parametrize(("jobs", "most"), [(None, 3), (1, 1), (7, 4)])
def test_no_more_are_under_way_than_asked(tmp_path: Path, jobs: int | None, most: int) -> None:
    """By default as many as the workers have threads."""
    client = FakeClient(answers=lambda name, only: "pending", threads={ONE: 2, TWO: 1})
    here = ClusterScheduler(cast("Client", client), jobs, lambda line: None)
    with closing(here.run([task(tmp_path, name) for name in NAMES], lambda name, step: None)) as attempts:
        client.subscribe_topic = lambda topic, handler: None  # type: ignore[method-assign]
        nthreads = client.nthreads
        looks: list[int] = []

        def look() -> dict[str, int] | None:
            looks.append(1)
            if len(looks) > 1:
                raise OSError("enough")
            return nthreads()

        client.nthreads = look  # type: ignore[method-assign]
        with pytest.raises(HarnessError):
            next(attempts)
    assert len(client.sent) == most
    assert len(client.cancelled) == most  # what is under way is given up


def test_whoever_ends_workers_fails_alone(tmp_path: Path) -> None:
    """The others have their results; a failure is no mark."""
    killed = KilledWorker("grade-1", cast("WorkerState", SimpleNamespace(address=TWO)), 3)
    found = run(tmp_path, FakeClient(answers=lambda name, only: killed if name == "bob" else graded(name)))
    assert found["bob"].problem == "4 workers of the cluster ended while they graded it"
    assert Counter(s.state for s in found.values()) == {State.GRADED: 3, State.FAILED: 1}


def test_a_worker_that_cannot_grade_is_used_no_more(tmp_path: Path) -> None:
    """What it was sent goes to another one, and so does all that follows."""
    wrong = JobResult(f"worker {TWO} on lab", unfit="isolation: found none", hint="apt-get install bubblewrap")
    allowed = []

    def answers(name: str, only: Sequence[str] | None) -> JobResult:
        allowed.append((name, only))
        return wrong if name == "bob" and only is None else graded(name)

    found = run(tmp_path, FakeClient(answers=answers), jobs=1)
    assert {s.state for s in found.values()} == {State.GRADED}
    assert allowed == [("ada", None), ("bob", None), ("bob", [ONE]), ("cleo", [ONE]), ("dan", [ONE])]


def test_where_no_worker_can_grade_any_more_the_remedy_is_problem(tmp_path: Path) -> None:
    """As a failure of the machine, never as a mark."""
    wrong = JobResult(f"worker {ONE} on lab", unfit="isolation: found none", hint="apt-get install bubblewrap")
    found = run(tmp_path, FakeClient(answers=lambda name, only: wrong, threads={ONE: 1}))
    assert {s.state for s in found.values()} == {State.FAILED}
    assert found["ada"].problem == f"worker {ONE} on lab: isolation: found none"
    assert found["ada"].hint == "apt-get install bubblewrap"


@pytest.mark.parametrize("trouble", ["cancelled", "lost", ImportError("no module")])
def test_what_the_cluster_loses_is_sent_again(tmp_path: Path, trouble: ImportError | str) -> None:
    """A few times; then it is a failure, and the others go on."""
    count: Counter[str] = Counter()

    def answers(name: str, only: None) -> JobResult | ImportError | str:
        count[name] += 1
        return trouble if name == "ada" or (name, count[name]) == ("bob", 1) else graded(name)

    found = run(tmp_path, FakeClient(answers=answers))
    assert (count["ada"], count["bob"]) == (3, 2)
    assert {n for n, s in found.items() if s.state is State.FAILED} == {"ada"}


def test_submissions_of_workers_that_are_gone_go_elsewhere(tmp_path: Path) -> None:
    """Also where they were bound to them, because others could not grade."""
    client = FakeClient(versions={TWO: "0.0.1"}, threads={ONE: 1, TWO: 1})

    def answers(name: str, only: Sequence[str]) -> JobResult | str:
        if only == [ONE] and name == "bob":
            client.threads = {TWO: 1, "tcp://10.0.0.3:1": 1}
            return "pending"
        return graded(name)

    client.answers = answers
    found = run(tmp_path, client, jobs=2, names=("ada", "bob"))
    assert {s.state for s in found.values()} == {State.GRADED}
    assert client.sent == ["ada", "bob", "bob"]
    assert len(client.cancelled) == 1


def test_a_scheduler_that_is_lost_ends_the_run(tmp_path: Path) -> None:
    """What was graded before is handed over."""
    client = FakeClient()

    def answers(name: str, only: None) -> JobResult:
        if name == "cleo":
            client.status = "connecting"
        return graded(name)

    client.answers = answers
    here = ClusterScheduler(cast("Client", client), 1, lambda line: None)
    here.prepare("auto")
    done: list[str] = []
    with pytest.raises(HarnessError, match="the scheduler no longer answers"):
        done.extend(a.task.name for a in here.run([task(tmp_path, n) for n in NAMES], lambda name, step: None))
    assert done == ["ada", "bob"]
    assert client.cancelled == []


def test_large_parcels_are_laid_down_first(tmp_path: Path) -> None:
    """And do not travel with what is to be done."""
    client = FakeClient()
    scattered: list[int] = []
    scatter = client.scatter

    def counted(data: bytes, **options: bool) -> SimpleNamespace:
        scattered.append(len(data))
        return scatter(data, **options)

    client.scatter = counted  # type: ignore[method-assign]
    one = task(tmp_path, "ada")
    (one.submission / "data.bin").write_bytes(bytes(2 << 20))
    here = ClusterScheduler(cast("Client", client), None, lambda line: None)
    assert [a.status.state for a in here.run([one], lambda name, step: None)] == [State.GRADED]
    assert [size >> 20 for size in scattered] == [2]


@pytest.mark.parametrize("trouble", [OSError("closed"), TimeoutError()])
def test_where_nothing_can_be_laid_down_it_travels(tmp_path: Path, trouble: OSError | TimeoutError) -> None:
    """The worker that was to hold it may end at that very moment."""

    def scatter(data: bytes, **options: bool) -> SimpleNamespace:
        raise trouble

    client = FakeClient()
    client.scatter = scatter  # type: ignore[method-assign]
    one = task(tmp_path, "ada")
    (one.submission / "data.bin").write_bytes(bytes(2 << 20))
    here = ClusterScheduler(cast("Client", client), None, lambda line: None)
    assert [a.status.state for a in here.run([one], lambda name, step: None)] == [State.GRADED]


def test_steps_are_heard_while_a_submission_is_under_way(tmp_path: Path) -> None:
    """And neither late nor from strangers."""
    client = FakeClient()
    heard: list[tuple[str, str]] = []

    def answers(name: str, only: None) -> JobResult:
        for said in ({"name": name, "step": "alone"}, {"name": "nobody", "step": "x"}, "nonsense"):
            assert client.handler is not None
            client.handler((0.0, said))
        return graded(name)

    client.answers = answers
    run(tmp_path, client, names=("ada",), on_step=lambda name, step: heard.append((name, step)))
    assert heard == [("ada", "alone")]
    assert client.handler is None


def test_what_cannot_be_used_is_not_sent(tmp_path: Path) -> None:
    """It is refused here, and its reason does not depend on where others are graded."""
    client = FakeClient()
    tasks = [task(tmp_path, name) for name in ("ada", "bob")]
    (tasks[0].submission / "velocity_publisher.py").unlink()
    here = ClusterScheduler(cast("Client", client), None, lambda line: None)
    found = {a.task.name: a.status.state for a in here.run(tasks, lambda name, step: None)}
    assert found == {"ada": State.REFUSED, "bob": State.GRADED}
    assert client.sent == ["bob"]
