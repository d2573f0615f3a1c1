"""The scheduler that grades a class on a Dask cluster: sends submissions, and takes in what comes back."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Generator, Sequence

from distributed import Client

import grader
from grader.batch.cluster.desk import Desk
from grader.batch.cluster.fleet import Fleet
from grader.batch.cluster.sending import terms_of
from grader.batch.tasks import Attempt, Hear, Task


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
        self._fleet = Fleet(client, grader.__version__, warn)

    def prepare(self, isolation: str) -> Sequence[str]:
        """Ask every worker whether it can grade; see `Scheduler`."""
        return self._fleet.inspect(isolation)

    def run(self, tasks: Sequence[Task], hear: Hear) -> Generator[Attempt, None, None]:
        """Yield what comes of each task; see `Scheduler`."""
        if not tasks:
            return
        desk = Desk(self._client, self._fleet, self._jobs, terms_of(tasks[0]), hear, f"grade-{secrets.token_hex(8)}")
        try:
            yield from desk.serve(tasks)
        finally:
            desk.close()
