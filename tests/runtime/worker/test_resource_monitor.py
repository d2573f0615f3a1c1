"""The guard: which limit ends a process, what is said of it, and when the machine is to blame."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from types import SimpleNamespace
from typing import cast

import pytest

from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB, NS_PER_S
from grader.runtime.model.trace import ClockKind, Trace
from grader.runtime.usage import Usage
from grader.runtime.worker import resource_monitor as module
from grader.runtime.worker.resource_monitor import Budget, ResourceMonitor
from grader.runtime.worker.student_process import NodeProcess

TRACE = Trace("alone", ClockKind.VIRTUAL, 5, ())


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


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> dict[int, Usage]:
    """What the system says of processes; the worker itself uses nothing unless a test says so."""
    told: dict[int, Usage] = {}
    monkeypatch.setattr(module, "LOOK_S", 0.001)
    monkeypatch.setattr(module, "families", lambda pids: {pid: {pid} for pid in pids})
    monkeypatch.setattr(module, "usage", lambda pids: next((told[pid] for pid in pids if pid in told), Usage()))
    return told


def processes(*students: Watched) -> list[NodeProcess]:
    return cast("list[NodeProcess]", list(students))


def watch(student: Watched, **limits: int) -> ResourceMonitor:
    """Watch until a limit is reached."""
    with ResourceMonitor(processes(student), Limits(**limits)) as guard:
        student.held.wait(30)
    return guard


@pytest.mark.parametrize(
    ("used", "limits", "said"),
    [
        (Usage(memory_bytes=201 * MIB), {"memory_bytes": 200 * MIB}, "stopped at 200 MiB of memory"),
        (Usage(processor_ns=7 * NS_PER_S), {"processor_ns": 6 * NS_PER_S}, "stopped at 6 s of processor time"),
        (Usage(threads=300), {"processes": 200}, "stopped at 200 processes and threads"),
        (Usage(halted=True), {}, "stopped: a signal had halted it for good"),
        (Usage(), {"wall_ns": NS_PER_S // 2}, "stopped after 0.5 s of real time"),
    ],
)
def test_each_limit_is_told_in_words(machine: dict[int, Usage], used: Usage, limits: dict[str, int], said: str) -> None:
    """With the number that the rubric has."""
    student = Watched()
    machine[student.process.pid] = used
    watch(student, **limits)
    assert student.stopped == said


def test_within_its_limits_nobody_is_ended(machine: dict[int, Usage]) -> None:
    """Exactly the limit is not beyond it; what was used is kept for others to see."""
    student = Watched()
    machine[student.process.pid] = Usage(200 * MIB, 6 * NS_PER_S, 20)
    with ResourceMonitor(processes(student), Limits(memory_bytes=200 * MIB, processor_ns=6 * NS_PER_S)):
        while not student.most_threads:
            os.sched_yield()
    assert not student.stopped
    assert (student.most_bytes, student.most_threads) == (200 * MIB, 20)


def test_messages_that_fill_the_worker_end_the_nodes(machine: dict[int, Usage]) -> None:
    """The grader's own memory is not the student's to fill."""
    students = [Watched(4_000_000), Watched(4_000_001)]
    with ResourceMonitor(processes(*students), Limits()):
        machine[os.getpid()] = Usage(memory_bytes=module.UNREAD_BYTES + MIB)
        for student in students:
            student.held.wait(30)
    assert {s.stopped for s in students} == {"stopped at 224 MiB of messages in transit at once"}


@pytest.mark.parametrize(
    ("waited_ns", "used_ns", "undecided"),
    [(0, 0, False), (3600 * NS_PER_S, 0, True), (3600 * NS_PER_S, 100 * NS_PER_S, False)],
    ids=["waited for nobody", "waited for others", "had the processors themselves"],
)
def test_a_machine_that_gave_no_time_decides_nothing(
    machine: dict[int, Usage], monkeypatch: pytest.MonkeyPatch, waited_ns: int, used_ns: int, undecided: bool
) -> None:
    """Out of time because others had the processors: a problem of the machine's, never a mark."""
    student = Watched()
    machine[student.process.pid] = Usage(processor_ns=used_ns)
    monkeypatch.setattr(module, "threads_starved_ns", lambda pids: {"1": waited_ns})
    guard = watch(student, wall_ns=NS_PER_S // 20)
    assert student.stopped == "stopped after 0.05 s of real time"
    assert bool(guard.reviewed(TRACE).harness_problem) is undecided


def test_a_budget_that_is_used_up_ends_the_nodes(machine: dict[int, Usage]) -> None:
    """Before their own real time is over, and with the words of the budget."""
    student = Watched()
    with ResourceMonitor(processes(student), Limits(), Budget(NS_PER_S // 100, "stopped: enough")) as guard:
        student.held.wait(30)
    assert (student.stopped, guard.reviewed(TRACE)) == ("stopped: enough", TRACE)


def test_the_workers_own_processor_time_is_limited(machine: dict[int, Usage], monkeypatch: pytest.MonkeyPatch) -> None:
    """It goes to what the nodes send."""
    student = Watched()
    with ResourceMonitor(processes(student), Limits(processor_ns=NS_PER_S)):
        monkeypatch.setattr(time, "process_time_ns", lambda: 10_000 * NS_PER_S)
        student.held.wait(30)
    assert student.stopped == "stopped at 1 s of processor time to receive what was sent"


def test_the_guard_ends_with_its_block(machine: dict[int, Usage]) -> None:
    """No thread stays."""
    before = threading.active_count()
    with ResourceMonitor(processes(Watched()), Limits()):
        assert threading.active_count() == before + 1
    assert threading.active_count() == before


def test_looks_are_rare_while_nothing_grows(machine: dict[int, Usage], monkeypatch: pytest.MonkeyPatch) -> None:
    """They cost processor time; memory that begins to grow is looked at often again."""
    intervals = []
    student = Watched()
    used = iter([*[100] * 5, 130, 160, *[160] * 4])

    class Over:
        def wait(self, interval_s: float) -> bool:
            intervals.append(round(interval_s / module.LOOK_S))
            mib = next(used, None)
            machine[student.process.pid] = Usage(memory_bytes=(mib or 0) * MIB)
            return mib is None

    guard = ResourceMonitor(processes(student), Limits())
    monkeypatch.setattr(guard, "_over", Over())
    monkeypatch.setattr(guard._sockets, "may_be_much", lambda: (False, False))
    guard._watch()
    assert intervals == [1, 1, 2, 4, 4, 4, 1, 1, 2, 4, 4, 4]


def test_children_are_looked_for_only_if_something_was_started(
    machine: dict[int, Usage], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Searching all processes of a machine takes long; where the kernel does not tell, each time is needed."""
    searched = []
    last = iter(["7", "7", "7", "8", "8", "", "", "9", *["9"] * 100_000])
    ended = threading.Event()

    def families(pids: Sequence[int]) -> dict[int, set[int]]:
        searched.append(1)
        return {pid: {pid} for pid in pids}

    def last_pid() -> str:
        asked = next(last)
        if asked == "9":
            ended.set()
        return asked

    monkeypatch.setattr(module, "families", families)
    monkeypatch.setattr(module, "last_pid", last_pid)
    with ResourceMonitor(processes(Watched()), Limits()):
        assert ended.wait(60)
    assert len(searched) in (4, 5)  # 7, 8, twice nothing, and 9 unless the monitor ended first
