"""Which workers of a cluster are used: those with the same grader and a sandbox, and each other one is named."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError
from typing import cast

import pytest
from dask_samples import ONE, TWO, FakeClient
from distributed import Client

from grader import __version__
from grader.course.classroom.cluster.dispatcher import WorkerPool
from grader.course.classroom.messages import Fitness
from grader.runtime.model.errors import EnvironmentFault, HarnessError

NO_SANDBOX = Fitness(f"worker {TWO} on lab", "isolation: expected a sandbox, found none", "apt-get install bubblewrap")


def worker_pool(client: FakeClient) -> tuple[WorkerPool, list[str]]:
    """Return the workers, and what is said of those that join later."""
    said: list[str] = []
    return WorkerPool(cast("Client", client), __version__, said.append), said


@pytest.mark.parametrize(
    ("found", "words"), [("0.0.1", "0.0.1"), (PackageNotFoundError("rclpy-grader"), "none")], ids=["other", "none"]
)
def test_another_version_is_refused_by_name(found: PackageNotFoundError | str, words: str) -> None:
    """The worker is named with both versions, and submissions go to the others."""
    workers, _ = worker_pool(FakeClient(versions={TWO: found}))
    warnings = workers.inspect("auto")
    assert warnings == (f"worker {TWO}: expected rclpy-grader {__version__}, found {words}; it is not used",)
    assert (dict(workers.usable()), workers.only(workers.usable())) == ({ONE: 1}, (ONE,))


def test_a_worker_without_a_sandbox_is_named_with_its_remedy() -> None:
    """It is not used; where there is no other, nothing begins."""
    workers, _ = worker_pool(FakeClient(fitness={TWO: NO_SANDBOX}))
    assert workers.inspect("auto") == (f"{NO_SANDBOX.machine}: {NO_SANDBOX.unfit}; it is not used",)
    workers, _ = worker_pool(FakeClient(threads={TWO: 4}, fitness={TWO: NO_SANDBOX}))
    with pytest.raises(EnvironmentFault, match="expected a worker that can grade, found none among 1") as error:
        workers.inspect("auto")
    assert (TWO in error.value.message, error.value.hint) == (True, "apt-get install bubblewrap")


def test_all_workers_are_used_where_all_can_grade() -> None:
    """Then nothing says where a submission must go, so that whoever joins takes part."""
    workers, _ = worker_pool(FakeClient())
    assert workers.inspect("auto") == ()
    assert workers.only(workers.usable()) == ()


def test_what_a_sandbox_leaves_open_is_problem() -> None:
    """Once for each worker."""
    remark = Fitness(f"worker {ONE} on lab", remarks=("sandbox landlock: NOT contained: net_egress",))
    workers, _ = worker_pool(FakeClient(fitness={ONE: remark}))
    assert workers.inspect("auto") == (f"worker {ONE} on lab: sandbox landlock: NOT contained: net_egress",)


def test_whoever_joins_later_is_asked_too() -> None:
    """One that cannot grade is named and not used."""
    client = FakeClient(threads={ONE: 1}, fitness={TWO: NO_SANDBOX})
    workers, said = worker_pool(client)
    workers.inspect("auto")
    client.threads = {ONE: 1, TWO: 1}
    assert dict(workers.usable()) == {ONE: 1}
    assert dict(workers.usable()) == {ONE: 1}
    assert said == [f"{NO_SANDBOX.machine}: {NO_SANDBOX.unfit}; it is not used"]


def test_a_cluster_may_be_empty_at_first() -> None:
    """Grading begins when a worker joins."""
    workers, _ = worker_pool(FakeClient(threads={}))
    assert workers.inspect("auto") == ("cluster: no worker yet; grading starts when one joins",)


@pytest.mark.parametrize("found", ["0.0.9", PackageNotFoundError("rclpy-grader")])
def test_the_scheduler_needs_the_grader_as_well(found: PackageNotFoundError | str) -> None:
    """It reads what it hands on; without the package nothing would arrive."""
    workers, _ = worker_pool(FakeClient(scheduler=found))
    with pytest.raises(EnvironmentFault, match="scheduler of the cluster: expected rclpy-grader") as error:
        workers.inspect("auto")
    assert error.value.hint == f"install rclpy-grader {__version__} with its extra dask there"


def test_a_worker_that_leaves_while_it_is_asked_is_no_problem() -> None:
    """Nothing is known of it, and it is asked again should it come back."""
    workers, _ = worker_pool(FakeClient(versions={TWO: OSError("gone")}, fitness={ONE: OSError("gone")}))
    assert workers.inspect("auto") == ()
    assert set(workers.usable()) == {ONE, TWO}


def test_a_scheduler_that_is_gone_is_problem() -> None:
    """With what to do."""
    client = FakeClient()
    client.status = "connecting"
    with pytest.raises(HarnessError, match="the scheduler no longer answers") as error:
        worker_pool(client)[0].usable()
    assert "run the same command again when" in error.value.hint
