"""The guard: which limit ends a process, what is said of it, and when the machine is to blame."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest
from quiet_kernel import QuietKernel

from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB, NS_PER_S
from grader.runtime.model.trace import AssessedTrace, ClockKind
from grader.runtime.usage import Activity, Usage
from grader.runtime.worker import resource_monitor as module
from grader.runtime.worker.resource_monitor import Budget, ResourceMonitor
from grader.runtime.worker.socket_memory import SocketMemory
from grader.runtime.worker.student_process import NodeProcess

TRACE = AssessedTrace("alone", ClockKind.VIRTUAL, 5, ())


class Watched:
    """Stands in for a student's process that never runs."""

    def __init__(self, pid: int = 4_000_000) -> None:
        self.process = SimpleNamespace(pid=pid)
        self.roots = (pid,)
        self.ended = False
        self.stopped = ""
        self.most_bytes = self.most_threads = self.used_ns = 0
        self.held = threading.Event()

    def stop(self, why: str, family: Sequence[int] = ()) -> None:
        self.stopped = why
        self.held.set()


def processes(*students: Watched) -> list[NodeProcess]:
    return cast("list[NodeProcess]", list(students))


class QuietSockets(SocketMemory):
    """Knows of no connections, whatever else this machine does."""

    def may_be_much(self) -> tuple[bool, bool]:
        return False, False


def guarding(
    kernel: QuietKernel, *students: Watched, limits: Limits | None = None, budget: Budget | None = None
) -> ResourceMonitor:
    """Return a monitor that knows nothing of the machine but what a kernel tells."""
    sockets = QuietSockets(shared=False)
    return ResourceMonitor(processes(*students), limits or Limits(), budget, sockets=sockets, kernel=kernel)


def watch(kernel: QuietKernel, student: Watched, limits: Limits, budget: Budget | None = None) -> ResourceMonitor:
    """Look again and again until a limit is reached."""
    guard = guarding(kernel, student, limits=limits, budget=budget)
    while not student.stopped:
        guard.poll()
    return guard


@pytest.mark.parametrize(
    ("used", "limits", "said"),
    [
        (Usage(memory_bytes=201 * MIB), {"memory_bytes": 200 * MIB}, "stopped at 200 MiB of memory"),
        (Usage(processor_ns=7 * NS_PER_S), {"processor_ns": 6 * NS_PER_S}, "stopped at 6 s of processor time"),
        (Usage(threads=300), {"processes": 200}, "stopped at 200 processes and threads"),
        (Usage(halted=True), {}, "stopped: a signal had halted it for good"),
        (Usage(), {"wall_ns": NS_PER_S // 50}, "stopped after 0.02 s of real time"),
    ],
)
def test_each_limit_is_told_in_words(used: Usage, limits: dict[str, int], said: str) -> None:
    """With the number that the rubric has."""
    kernel, student = QuietKernel(), Watched()
    kernel.told[student.process.pid] = used
    watch(kernel, student, Limits(**limits))
    assert student.stopped == said


def test_within_its_limits_nobody_is_ended() -> None:
    """Exactly the limit is not beyond it; what was used is kept for others to see."""
    kernel, student = QuietKernel(), Watched()
    kernel.told[student.process.pid] = Usage(200 * MIB, 6 * NS_PER_S, 20)
    limits = Limits(memory_bytes=200 * MIB, processor_ns=6 * NS_PER_S)
    guarding(kernel, student, limits=limits).poll()
    assert not student.stopped
    assert (student.most_bytes, student.most_threads) == (200 * MIB, 20)


def test_messages_that_fill_the_worker_end_the_nodes() -> None:
    """The grader's own memory is not the student's to fill."""
    kernel, students = QuietKernel(), [Watched(4_000_000), Watched(4_000_001)]
    guard = guarding(kernel, *students)
    kernel.told[os.getpid()] = Usage(memory_bytes=module.UNREAD_BYTES + MIB)
    guard.poll()
    assert {s.stopped for s in students} == {"stopped at 224 MiB of messages in transit at once"}


@pytest.mark.parametrize(
    ("waited_ns", "used_ns", "undecided"),
    [(0, 0, False), (3600 * NS_PER_S, 0, True), (3600 * NS_PER_S, 100 * NS_PER_S, False)],
    ids=["waited for nobody", "waited for others", "had the processors themselves"],
)
def test_a_machine_that_gave_no_time_decides_nothing(waited_ns: int, used_ns: int, undecided: bool) -> None:
    """Out of time because others had the processors: a problem of the machine's, never a mark."""
    kernel, student = QuietKernel(), Watched()
    kernel.told[student.process.pid] = Usage(processor_ns=used_ns)
    kernel.starved_ns = {"1": waited_ns}
    guard = watch(kernel, student, Limits(wall_ns=NS_PER_S // 20))
    assert student.stopped == "stopped after 0.05 s of real time"
    assert bool(guard.reviewed(TRACE).harness_problem) is undecided


@pytest.mark.parametrize(
    ("main_s", "others_s", "suspected", "fills"),
    [
        (50, 1, False, False),
        (1, 45, False, False),
        (200, 150, False, False),
        (150, 200, True, False),
        (1, 600, True, True),
    ],
    ids=["computes", "threads of the middleware", "hardly any", "children", "many children"],
)
def test_a_node_whose_children_compute_is_a_suspect(main_s: int, others_s: int, suspected: bool, fills: bool) -> None:
    """Perhaps it waits for them; where they fill the machine, it has waited for nobody else."""
    kernel, student = QuietKernel(), Watched()
    processors = len(os.sched_getaffinity(0))
    kernel.told[student.process.pid] = Usage(processor_ns=(main_s + others_s) * processors * NS_PER_S)
    kernel.busiest_ns = main_s * processors * NS_PER_S
    guard = guarding(kernel, student, limits=Limits(processor_ns=10**9 * NS_PER_S))
    guard._started_ns -= 1000 * NS_PER_S
    kernel.starved_ns = {"1": 50 * NS_PER_S}
    guard.poll()
    found = guard.reviewed(replace(TRACE, clock=ClockKind.WALL))
    assert (found.suspected, guard.fills_machine) == (suspected, fills)
    assert found.most_starved_ns == (0 if fills else 50 * NS_PER_S)


class FamilyKernel(QuietKernel):
    """Knows a node and its child, and what each of them does."""

    node, child = 4_000_000, 4_000_001

    def __init__(self) -> None:
        super().__init__()
        self.waited_ns = {self.node: 0, self.child: 0}
        self.busiest = {self.node: 0, self.child: 0}

    def families(self, roots: Collection[int]) -> dict[int, set[int]]:
        return {root: {self.node, self.child} for root in roots}

    def threads_starved_ns(self, pids: Iterable[int]) -> dict[str, int]:
        return {str(pid): self.waited_ns.get(pid, 0) for pid in pids}

    def busiest_thread_ns(self, pids: Iterable[int]) -> int:
        return max(self.busiest[pid] for pid in pids)


@pytest.mark.parametrize(
    ("exchanges", "waited_s", "suspected"),
    [(0, 10, True), (1, 95, False)],
    ids=["that only computes", "that tells it what it has computed"],
)
def test_a_node_waits_for_a_processor_not_for_its_child(
    monkeypatch: pytest.MonkeyPatch, exchanges: int, waited_s: int, suspected: bool
) -> None:
    """On a busy machine a child that computes without end has waited most, and delays nothing that the node sends."""
    kernel, now_ns, processors = FamilyKernel(), [0], len(os.sched_getaffinity(0))
    monkeypatch.setattr(time, "monotonic_ns", lambda: now_ns[0])
    student = Watched(kernel.node)
    guard = guarding(kernel, student)
    for second in range(1, 101):
        now_ns[0] = second * NS_PER_S
        kernel.told[kernel.node] = Usage(processor_ns=second * processors * NS_PER_S // 10)
        kernel.busiest = {kernel.node: 0, kernel.child: second * processors * NS_PER_S // 10}
        kernel.waited_ns = {kernel.node: second * NS_PER_S // 10, kernel.child: second * NS_PER_S * 95 // 100}
        kernel.activities[kernel.child] = Activity(runs=True, slept=0, exchanged=second * exchanges)
        guard.poll(module.SEARCH_EVERY)
    found = guard.reviewed(replace(TRACE, clock=ClockKind.WALL))
    assert (found.most_starved_ns, found.suspected) == (waited_s * NS_PER_S, suspected)


def test_a_budget_that_is_used_up_ends_the_nodes() -> None:
    """Before their own real time is over, and with the words of the budget."""
    student = Watched()
    guard = watch(QuietKernel(), student, Limits(), Budget(NS_PER_S // 100, "stopped: enough"))
    assert (student.stopped, guard.reviewed(TRACE)) == ("stopped: enough", TRACE)


def test_the_workers_own_processor_time_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """It goes to what the nodes send."""
    student = Watched()
    guard = guarding(QuietKernel(), student, limits=Limits(processor_ns=NS_PER_S))
    monkeypatch.setattr(time, "process_time_ns", lambda: 10_000 * NS_PER_S)
    guard.poll()
    assert student.stopped == "stopped at 1 s of processor time to receive what was sent"


def test_the_guard_ends_with_its_block() -> None:
    """It looks in a thread of its own, which does not stay."""
    before = threading.active_count()
    kernel, student = QuietKernel(), Watched()
    kernel.told[student.process.pid] = Usage(halted=True)
    with guarding(kernel, student):
        assert threading.active_count() == before + 1
        assert student.held.wait(30)
    assert threading.active_count() == before


def test_looks_are_rare_while_nothing_grows() -> None:
    """They cost processor time; memory that begins to grow is looked at often again."""
    kernel, student, intervals = QuietKernel(), Watched(), [1]
    guard = guarding(kernel, student)
    for mib in (*[100] * 5, 130, 160, *[160] * 4):
        kernel.told[student.process.pid] = Usage(memory_bytes=mib * MIB)
        intervals.append(guard.poll(intervals[-1]))
    assert intervals == [1, 1, 2, 4, 4, 4, 1, 1, 2, 4, 4, 4]


class StartingKernel(QuietKernel):
    """Says in turn which pid it gave last, and counts searches for children."""

    def __init__(self, *last: str) -> None:
        super().__init__()
        self.last = [*last]
        self.searched = 0

    def last_pid(self) -> str:
        return self.last.pop(0)

    def families(self, roots: Collection[int]) -> dict[int, set[int]]:
        self.searched += 1
        return super().families(roots)


def test_children_are_looked_for_only_if_something_was_started() -> None:
    """Searching all processes of a machine takes long; where the kernel does not tell, each time is needed."""
    kernel = StartingKernel("7", "7", "7", "8", "8", "", "", "9")
    guard = guarding(kernel, Watched())
    for _ in range(7 * module.SEARCH_EVERY):
        guard.poll()
    assert kernel.last == ["9"]
    assert kernel.searched == 4  # 7, 8, and twice nothing
    guard.poll()
    assert kernel.searched == 5
