"""The session: which traces are final when, and what is recorded again on the wall clock."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from grader.runtime.model.trace import AssessedTrace, ClockKind, Message
from grader.runtime.plan import Plan
from grader.runtime.session import AUTO, VIRTUAL, WALL, RecordingSession
from grader.runtime.supervisor.next_recording import CHARGED_NOTE, DRIFTS, UNCLEAR
from grader.runtime.supervisor.real_time_budget import RealTimeBudget
from grader.runtime.supervisor.supervisor import Job


class Recorder:
    """Records nothing; says of the scenarios named that virtual time does them no justice."""

    def __init__(self, *unfit: str, broken: tuple[str, ...] = ()) -> None:
        self.unfit, self.broken = unfit, broken
        self.recorded: list[tuple[str, str]] = []

    def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[AssessedTrace]:
        for job in jobs:
            scenario, clock = job.plan.scenario, ClockKind(job.plan.clock)
            self.recorded.append((scenario, clock.value))
            reason = "it is busy" if scenario in self.unfit and clock is ClockKind.VIRTUAL else ""
            problem = "lost" if scenario in self.broken else ""
            yield AssessedTrace(scenario, clock, 1, (), clock_reason=reason, harness_problem=problem)

    def record(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> list[AssessedTrace]:
        return list(self.each(jobs, progress))


def job(scenario: str) -> Job:
    plan = Plan(scenario, (), "/", "00", 1, "", 1, VIRTUAL)
    return Job(scenario, plan)


def session_of(recorder: Recorder) -> RecordingSession:
    """Return a session that has a recorder and a folder, and nothing else."""
    make: Any = RecordingSession
    session: RecordingSession = make(*(None,) * (len(RecordingSession.__slots__) - 2), recorder, Path("nowhere"))
    object.__setattr__(session, "ros", SimpleNamespace(distro="jazzy"))
    return session


def recorded(
    recorder: Recorder, clock: str, *scenarios: str
) -> tuple[list[tuple[str, AssessedTrace]], dict[str, AssessedTrace]]:
    """Return what was heard, in order, and the traces at the end."""
    heard: list[tuple[str, AssessedTrace]] = []
    session = session_of(recorder)
    jobs = {name: job(name) for name in scenarios}
    traces = session.record(jobs, clock, lambda step: None, lambda key, trace: heard.append((key, trace)))
    return heard, traces


def test_what_is_final_is_heard_at_once_and_what_is_not_at_the_end() -> None:
    """A recording that will be replaced is heard once, as the one that replaces it."""
    heard, traces = recorded(Recorder("a"), AUTO, "a", "b", "c")
    assert [key for key, _ in heard] == ["b", "c", "a"]
    assert dict(heard) == traces
    assert traces["a"].clock is ClockKind.WALL
    assert traces["a"].clock_reason == "it is busy"


@pytest.mark.parametrize("clock", [VIRTUAL, WALL])
def test_a_clock_that_was_chosen_is_kept(clock: str) -> None:
    """Only `auto` records anything twice."""
    recorder = Recorder("a")
    heard, _ = recorded(recorder, clock, "a", "b")
    assert [key for key, _ in heard] == ["a", "b"]
    assert len(recorder.recorded) == 2


def test_a_fault_of_ours_is_not_tried_on_the_other_clock() -> None:
    """The wall clock would not fix it."""
    recorder = Recorder("a", broken=("a",))
    recorded(recorder, AUTO, "a")
    assert recorder.recorded == [("a", "virtual")]


def test_the_first_look_may_end_early_only_if_there_is_a_second() -> None:
    """A plan says so to its worker."""
    plans: list[bool] = []

    class Listening(Recorder):
        def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[AssessedTrace]:
            plans.extend(job.plan.stop_when_unfit for job in jobs)
            return super().each(jobs, progress)

    recorded(Listening(), AUTO, "a")
    recorded(Listening(), VIRTUAL, "a")
    assert plans == [True, False]


def test_all_recordings_of_a_submission_share_one_budget() -> None:
    """Also what is recorded again; the next submission has its own."""
    budgets: list[Any] = []

    class Listening(Recorder):
        def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[AssessedTrace]:
            budgets.extend(job.budget for job in jobs)
            yield from super().each(jobs, progress)

    session = session_of(Listening("a"))
    for budget_s in (20, 30):
        jobs = {name: job(name) for name in "ab"}
        session.record(jobs, AUTO, lambda step: None, budget=RealTimeBudget(budget_s, spent_s=5))
    first, second = budgets[:3], budgets[3:]
    assert [len(set(map(id, part))) for part in (first, second)] == [1, 1]
    assert [part[0].words.partition("more than ")[2] for part in (first, second)] == [
        "20 s of real time",
        "30 s of real time",
    ]


class PacedRecorder:
    """Records one node that has work before its pauses: its rate depends on what is counted, and on the machine."""

    def __init__(
        self, *, charged_ms: int | Sequence[int], wall_ms: int = 60, busy: str = "", sure_ms: int = 50
    ) -> None:
        self.charged_ms = iter([charged_ms] if isinstance(charged_ms, int) else charged_ms)
        self.wall_ms, self.sure_ms, self.busy = wall_ms, sure_ms, busy
        self.recorded: list[str] = []

    def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[AssessedTrace]:
        for job in jobs:
            clock = ClockKind(job.plan.clock)
            charged = job.plan.charged
            self.recorded.append(f"charged {charged:.0%}" if 0 < charged < 1 else "charged" if charged else clock.value)
            wall = clock is ClockKind.WALL
            period_ms = self.wall_ms if wall else 50
            if charged:
                period_ms = next(self.charged_ms) if charged == 1 else self.sure_ms
            messages = tuple(Message(t * 10**6, "/x", "T", {}, b"") for t in range(0, 3000, period_ms))
            yield AssessedTrace(
                job.plan.scenario,
                clock,
                3 * 10**9,
                messages,
                harness_problem="too busy" if wall and self.busy == "held up" else "",
                most_starved_ns=10**9 if wall and self.busy == "starved" else 0,
                may_drift=not wall,
            )

    def record(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> list[AssessedTrace]:
        return list(self.each(jobs, progress))


def decided(recorder: PacedRecorder, clock: str = AUTO) -> AssessedTrace:
    """Return the trace of the node, which has to be heard of once."""
    heard: list[str] = []
    make: Any = RecordingSession
    session: RecordingSession = make(*(None,) * (len(RecordingSession.__slots__) - 2), recorder, Path("nowhere"))
    object.__setattr__(session, "ros", SimpleNamespace(distro="jazzy"))
    traces = session.record({"a": job("a")}, clock, lambda step: None, lambda key, _: heard.append(key))
    assert heard == ["a"]
    return traces["a"]


def test_a_node_that_its_work_does_not_slow_down_stays_in_virtual_time() -> None:
    """The first recording is kept, not the one that counts the work."""
    recorder = PacedRecorder(charged_ms=50)
    trace = decided(recorder)
    assert recorder.recorded == ["virtual", "charged"]
    assert (trace.clock, trace.clock_reason, len(trace.messages("/x"))) == (ClockKind.VIRTUAL, "", 60)


def test_the_wall_clock_decides_where_work_slows_a_node_down() -> None:
    recorder = PacedRecorder(charged_ms=70, wall_ms=75)
    trace = decided(recorder)
    assert recorder.recorded == ["virtual", "charged", "wall"]
    assert (trace.clock, trace.clock_reason, len(trace.messages("/x"))) == (ClockKind.WALL, DRIFTS, 40)


@pytest.mark.parametrize("busy", ["held up", "starved"])
def test_on_a_busy_machine_the_measured_work_decides(busy: str) -> None:
    """With a note, because this clock is not the one that decides elsewhere."""
    recorder = PacedRecorder(charged_ms=60, sure_ms=56, wall_ms=150, busy=busy)
    trace = decided(recorder)
    assert (trace.clock, len(trace.messages("/x")), trace.harness_problem) == (ClockKind.VIRTUAL, 50, "")
    assert trace.notes == (CHARGED_NOTE,)
    assert recorder.recorded == ["virtual", "charged", "wall", "charged 50%"]


def test_a_busy_machine_makes_no_node_slow() -> None:
    """Work takes longer there: of several recordings the fastest is right."""
    recorder = PacedRecorder(charged_ms=[56, 54, 50], wall_ms=150, busy="held up")
    trace = decided(recorder)
    assert (len(trace.messages("/x")), trace.notes) == (60, (CHARGED_NOTE,))
    assert recorder.recorded == ["virtual", "charged", "wall", "charged 50%", "charged", "charged"]


def test_a_pace_that_a_busy_machine_leaves_unclear_names_what_an_idle_one_may_need_less() -> None:
    """The fastest recording is judged, with the time that it is slower than with half of the work."""
    trace = decided(PacedRecorder(charged_ms=[56, 54, 55], wall_ms=150, busy="starved"))
    assert (trace.harness_problem, trace.notes, len(trace.messages("/x"))) == ("", (CHARGED_NOTE,), 56)
    # 54 ms are 7 % more than 50 ms; the last message comes 0.2 s later
    assert trace.most_starved_ns == 200 * 10**6


def test_a_failure_of_the_machine_makes_no_node_surely_slow() -> None:
    """What was not recorded with less work says nothing about the pace."""

    class Failing(PacedRecorder):
        def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[AssessedTrace]:
            for job, trace in zip(jobs, super().each(jobs, progress), strict=True):
                failed = 0 < job.plan.charged < 1
                yield replace(trace, observations=(), harness_problem="no worker") if failed else trace

    trace = decided(Failing(charged_ms=[60, 60, 60], sure_ms=56, wall_ms=150, busy="starved"))
    assert (trace.harness_problem, trace.notes) == (UNCLEAR, ())


def test_a_clock_that_was_asked_for_is_not_doubted() -> None:
    recorder = PacedRecorder(charged_ms=70)
    assert decided(recorder, VIRTUAL).clock is ClockKind.VIRTUAL
    assert recorder.recorded == ["virtual"]
