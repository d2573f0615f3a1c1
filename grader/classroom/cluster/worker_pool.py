"""Tracks the workers of a cluster: which ones can grade, why others cannot, and how many threads they have."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from distributed import Client

from grader.classroom.cluster import jobs
from grader.classroom.messages import Fitness, unpack
from grader.core.errors import EnvironmentFault, HarnessError

PACKAGE = "rclpy-grader"


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
            return ("cluster: there is no worker yet, grading begins when one joins",)
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
            found = str(self._client.run_on_scheduler(importlib.metadata.version, PACKAGE))
        except importlib.metadata.PackageNotFoundError:
            found = ""
        if found != self._version:
            problem = jobs.other_version(self._version, found)
            raise EnvironmentFault(f"scheduler of the cluster: {problem}", jobs.remedy(self._version))

    def _ask(self, addresses: Collection[str]) -> None:
        """Ask workers for their version, which works without the grader; then inspect those with the right one."""
        right = []
        for address, found in self._run(importlib.metadata.version, PACKAGE, addresses).items():
            if found == self._version:
                right.append(address)
            elif isinstance(found, (str, importlib.metadata.PackageNotFoundError)):
                problem = jobs.other_version(self._version, found if isinstance(found, str) else "")
                self._known[address] = Fitness(f"worker {address}", problem, jobs.remedy(self._version))
        for address, reply in self._run(jobs.inspect, self._isolation, right).items():
            if isinstance(reply, bytes):
                self._known[address] = unpack(reply, Fitness)
            elif not isinstance(reply, OSError):  # the worker has left in the meantime
                self._known[address] = Fitness(f"worker {address}", f"the grader failed: {type(reply).__name__}")

    def _run(self, function: Callable[..., object], argument: str, addresses: Collection[str]) -> dict[str, Any]:
        if not addresses:
            return {}
        try:
            return dict(self._client.run(function, argument, workers=list(addresses), on_error="return"))
        except (OSError, TimeoutError):
            raise scheduler_lost() from None


def scheduler_lost() -> HarnessError:
    """Build the error for a scheduler that no longer answers."""
    return HarnessError(
        "cluster: expected the scheduler to answer, found it gone",
        "what was graded is kept; when the scheduler is back, the same command goes on where it was",
    )


def _problem(fitness: Fitness) -> str:
    return f"{fitness.machine}: {fitness.unfit}"
