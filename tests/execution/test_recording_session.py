"""The studio: which traces are final when, and what is recorded again on the wall clock."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from grader.core.trace import ClockKind, Trace
from grader.execution.plan import Plan
from grader.execution.real_time_budget import RealTimeBudget
from grader.execution.recording_session import AUTO, VIRTUAL, WALL, RecordingSession
from grader.execution.supervisor import Job


class Recorder:
    """Records nothing; says of the scenarios named that virtual time does them no justice."""

    def __init__(self, *unfit: str, broken: tuple[str, ...] = ()) -> None:
        self.unfit, self.broken = unfit, broken
        self.recorded: list[tuple[str, str]] = []

    def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[Trace]:
        for job in jobs:
            scenario, clock = job.plan.scenario, ClockKind(job.plan.clock)
            self.recorded.append((scenario, clock.value))
            reason = "it is busy" if scenario in self.unfit and clock is ClockKind.VIRTUAL else ""
            problem = "lost" if scenario in self.broken else ""
            yield Trace(scenario, clock, 1, (), clock_reason=reason, harness_problem=problem)

    def record(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> list[Trace]:
        return list(self.each(jobs, progress))


def job(scenario: str) -> Job:
    plan = Plan(scenario, (), "/", "00", 1, "", 1, (), (), VIRTUAL)
    return Job(scenario, plan)


def session_of(recorder: Recorder) -> RecordingSession:
    """Return a session that has a recorder and a folder, and nothing else."""
    make: Any = RecordingSession
    session: RecordingSession = make(*(None,) * (len(RecordingSession.__slots__) - 2), recorder, Path("nowhere"))
    return session


def recorded(recorder: Recorder, clock: str, *scenarios: str) -> tuple[list[tuple[str, Trace]], dict[str, Trace]]:
    """Return what was heard, in order, and the traces at the end."""
    heard: list[tuple[str, Trace]] = []
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
        def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[Trace]:
            plans.extend(job.plan.stop_when_unfit for job in jobs)
            return super().each(jobs, progress)

    recorded(Listening(), AUTO, "a")
    recorded(Listening(), VIRTUAL, "a")
    assert plans == [True, False]


def test_all_recordings_of_a_submission_share_one_budget() -> None:
    """Also what is recorded again; the next submission has its own."""
    budgets: list[Any] = []

    class Listening(Recorder):
        def each(self, jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[Trace]:
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
