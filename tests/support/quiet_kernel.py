"""A kernel that tells what a test says of processes, for what watches them: each is alone, and uses nothing."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from grader.runtime.usage import Activity, Usage


class QuietKernel:
    """Stands in for `grader.runtime.usage`.

    Attributes:
        told: What processes use, by their pids; the others use nothing.
        starved_ns: How long each thread of any process has waited for a processor.
        busiest_ns: The processor time of the busiest thread of any process; None if there is only one.
        activities: What processes have done, by their pids; the others have done nothing.
    """

    def __init__(self) -> None:
        self.told: dict[int, Usage] = {}
        self.starved_ns: dict[str, int] = {}
        self.busiest_ns: int | None = None
        self.activities: dict[int, Activity] = {}

    def scratch_names(self, pids: Iterable[int]) -> int:
        """Return that no files were made."""
        del pids
        return 0

    def usage(self, pids: Iterable[int]) -> Usage:
        """Return what the first of some processes uses of which anything is told."""
        return next((self.told[pid] for pid in pids if pid in self.told), Usage())

    def families(self, roots: Collection[int]) -> dict[int, set[int]]:
        """Return each process without children."""
        return {root: {root} for root in roots}

    def last_pid(self) -> str:
        """Return nothing, so that children are looked for each time."""
        return ""

    def innermost(self, root: int) -> int:
        """Return the process itself."""
        return root

    def threads_starved_ns(self, pids: Iterable[int]) -> dict[str, int]:
        """Return how long threads have waited."""
        del pids
        return dict(self.starved_ns)

    def busiest_thread_ns(self, pids: Iterable[int]) -> int:
        """Return the processor time of the busiest thread."""
        return self.usage(pids).processor_ns if self.busiest_ns is None else self.busiest_ns

    def thread_starved_ns(self, pid: int, thread: int | str) -> int:
        """Return that a thread of this process has never waited."""
        del pid, thread
        return 0

    def activity(self, pid: int) -> Activity:
        """Return what a process has done."""
        return self.activities.get(pid, Activity())
