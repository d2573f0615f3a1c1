"""What is recorded next of a scenario: the table, a row a test."""

from __future__ import annotations

from dataclasses import replace

import pytest

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import AssessedTrace, ClockKind, Message
from grader.runtime.supervisor.next_recording import (
    AUTO,
    CHARGED_NOTE,
    COUNTED,
    DRIFTS,
    SURELY_COUNTED,
    UNCLEAR,
    VIRTUAL,
    WALL,
    NextRecording,
    next_recording,
)

FIRST, ON_WALL = NextRecording(may_stop=True), NextRecording(WALL)


def recorded(clock: ClockKind = ClockKind.VIRTUAL, period_ms: int = 50) -> AssessedTrace:
    messages = tuple(Message(t * 10**6, "/x", "T", {}, b"") for t in range(0, 3000, period_ms))
    return AssessedTrace("alone", clock, 3 * NS_PER_S, messages)


GOOD = recorded()
UNFIT = replace(GOOD, clock_reason="it waits")
OUR_FAULT = replace(UNFIT, harness_problem="lost")
#: The host failed, so that virtual time is unsuitable: on the wall clock little of it runs.
HOST_FAILED = replace(UNFIT, harness_problem="it waits")
DOUBTFUL = replace(GOOD, may_drift=True)
AS_FAST, SLOWER = recorded(), recorded(period_ms=60)
IDLE = recorded(ClockKind.WALL, 75)
BUSY = replace(IDLE, most_starved_ns=NS_PER_S)
FAILED = replace(GOOD, observations=(), harness_problem="no worker")
PLAIN, COUNT, SURE, REAL = (FIRST, DOUBTFUL), (COUNTED, SLOWER), (SURELY_COUNTED, SLOWER), (ON_WALL, BUSY)
SLOWEST, SILENT = recorded(period_ms=75), replace(GOOD, observations=())
#: What a recording with one period is slower than one with another.
FROM_50_TO_60, FROM_60_TO_75 = 1 - 50 / 60, 1 - 60 / 75
UNCLEAR_WALL = replace(BUSY, clock_reason=DRIFTS, harness_problem=UNCLEAR)


def noted(trace: AssessedTrace, slower: float = 0) -> AssessedTrace:
    """Return a recording with the time of the work as it is judged, and what share an idle machine may need less."""
    waited_ns = round(slower * trace.stop_ns)
    return replace(trace, notes=(CHARGED_NOTE,), most_starved_ns=waited_ns, all_starved_ns=waited_ns)


@pytest.mark.parametrize(
    ("made", "wanted"),
    [
        ([], FIRST),
        ([(FIRST, GOOD)], GOOD),
        ([(FIRST, OUR_FAULT)], OUR_FAULT),
        ([(FIRST, UNFIT)], ON_WALL),
        ([(FIRST, HOST_FAILED)], ON_WALL),
        ([(FIRST, UNFIT), (ON_WALL, IDLE)], replace(IDLE, clock_reason="it waits")),
        ([(FIRST, UNFIT), (ON_WALL, BUSY)], replace(BUSY, clock_reason="it waits")),
        ([PLAIN], COUNTED),
        ([PLAIN, (COUNTED, AS_FAST)], DOUBTFUL),
        ([PLAIN, COUNT], ON_WALL),
        ([PLAIN, COUNT, (ON_WALL, IDLE)], replace(IDLE, clock_reason=DRIFTS)),
        ([PLAIN, COUNT, REAL], SURELY_COUNTED),
        ([PLAIN, COUNT, REAL, SURE], noted(SLOWER)),
        ([PLAIN, (COUNTED, SLOWEST), REAL, SURE], noted(SLOWEST, FROM_60_TO_75)),
        ([PLAIN, COUNT, REAL, (SURELY_COUNTED, AS_FAST)], COUNTED),
        ([PLAIN, COUNT, REAL, (SURELY_COUNTED, FAILED)], COUNTED),
        ([PLAIN, COUNT, REAL, (SURELY_COUNTED, AS_FAST), (COUNTED, AS_FAST)], noted(AS_FAST)),
        ([PLAIN, COUNT, REAL, (SURELY_COUNTED, AS_FAST), (COUNTED, FAILED)], replace(BUSY, clock_reason=DRIFTS)),
        ([PLAIN, COUNT, REAL, (SURELY_COUNTED, AS_FAST), COUNT, COUNT], noted(SLOWER, FROM_50_TO_60)),
        (
            [PLAIN, COUNT, REAL, (SURELY_COUNTED, AS_FAST), (COUNTED, SLOWEST), (COUNTED, SLOWEST)],
            noted(SLOWER, FROM_50_TO_60),
        ),
        ([PLAIN, COUNT, REAL, (SURELY_COUNTED, FAILED), COUNT, COUNT], UNCLEAR_WALL),
        ([PLAIN, (COUNTED, SILENT), REAL, SURE], UNCLEAR_WALL),
        # virtual time does not suit the nodes, and their work may slow them down as well
        ([(FIRST, replace(UNFIT, may_drift=True)), REAL], COUNTED),
    ],
)
def test_what_was_recorded_says_what_is_next(
    made: list[tuple[NextRecording, AssessedTrace]], wanted: NextRecording | AssessedTrace
) -> None:
    """In the order in which a scenario goes through the table."""
    assert next_recording(made, AUTO) == wanted


@pytest.mark.parametrize("clock", [VIRTUAL, WALL])
def test_a_clock_that_was_asked_for_is_recorded_once(clock: str) -> None:
    """Whatever the recording says of it."""
    first = next_recording([], clock)
    assert first == NextRecording(clock)
    assert next_recording([(first, UNFIT)], clock) == UNFIT


@pytest.mark.parametrize(("made", "reason"), [([(FIRST, UNFIT)], "it waits"), ([PLAIN, COUNT], DRIFTS)])
def test_without_the_wall_clock_its_reason_is_told(
    made: list[tuple[NextRecording, AssessedTrace]], reason: str
) -> None:
    """With what was recorded in virtual time."""
    assert next_recording(made, AUTO, on_wall=False) == replace(made[0][1], clock_reason=reason)
