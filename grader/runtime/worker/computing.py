"""Finds processes that only compute: what they wait for a processor has delayed nothing that was recorded."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.usage import Activity, Kernel

#: A process that has only computed for so long is one that computes: any other does so for a moment, at its start for
#: instance.
COMPUTES_NS = NS_PER_S


class ComputedWork(NamedTuple):
    """What was found: the processes that compute, and how long threads have waited for a processor.

    While a process neither sleeps nor reads nor writes, nothing that others see depends on it, and how long its threads
    wait delays no message. So only what they have waited before is in `waited_ns`.
    """

    computing: Collection[int]
    waited_ns: Collection[int]


class _DoneWork(NamedTuple):
    """What a process has done, since when it has done nothing else, and how long its threads had waited by then."""

    activity: Activity
    since_ns: int
    waited_ns: Collection[int]


class ComputingProcesses:
    """Compares what processes have done from look to look.

    Args:
        kernel: Reads what processes do.
    """

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel
        self._known: dict[int, _DoneWork] = {}

    def look(self, pids: Collection[int], now_ns: int) -> ComputedWork:
        """Look at processes.

        Args:
            pids: The processes.
            now_ns: A reading of a clock that is never set.
        """
        before = self._known
        self._known = known = {pid: self._looked_at(pid, before.get(pid), now_ns) for pid in pids}
        computing = {pid for pid, one in known.items() if now_ns - one.since_ns >= COMPUTES_NS}
        return ComputedWork(computing, [waited_ns for one in known.values() for waited_ns in one.waited_ns])

    def _looked_at(self, pid: int, before: _DoneWork | None, now_ns: int) -> _DoneWork:
        activity = self._kernel.activity(pid)
        if before is not None and activity.is_known and activity == before.activity:
            return before
        return _DoneWork(activity, now_ns, self._kernel.threads_starved_ns([pid]).values())
