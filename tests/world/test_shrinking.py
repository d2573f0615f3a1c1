"""A run that fails is shrunk to the draws that it needs, and it is said where it parts from one that passes."""

import re
from collections.abc import Callable

import pytest

from grader.runtime.model.step_event import ProgramStep, StepEvent
from grader.world.faults import RunDraws, injected, names_of, subset
from grader.world.races import MOST_RUNS, Rerun, Shrunk, explained, shrink, told_of_race

SENT = StepEvent("/pilot", "sends", "topic /goal", ("/base",))
READ = StepEvent("/base", "reads", "topic /goal", ("/pilot",))
TIMER = StepEvent("/base", "timer")
MOVED = StepEvent("/base", "sends", "topic /speed")
LOST = StepEvent("/base", "loses", "topic /goal", ("/pilot",))
LATE = StepEvent("/base", "late", "0.2 topic /goal", ("/pilot",))


def step(*events: StepEvent, name: str = "", deviates: bool = False) -> ProgramStep:
    """Return a step at one second."""
    return ProgramStep(10**9, "program.py", name, deviates, events)


def search(fails: Callable[[set[str]], bool], names: str, faults: str = "", other: str = "") -> tuple[Shrunk, int]:
    """Shrink a run in which some steps and faults were drawn, and return what was found, and after how many runs."""
    steps = [step(SENT, name=name, deviates=True) for name in names]
    searching = shrink(Rerun(RunDraws(tuple(faults)), True, steps), [7])
    runs = 0
    try:
        drawn = next(searching)
        while True:
            runs += 1
            if drawn.seed == 7 and drawn.steps is None:
                deviating = [step(SENT, name=name, deviates=True) for name in other]
                drawn = searching.send(Rerun(RunDraws((), None, 7), fails({*other}), deviating))
            else:
                used = {*(drawn.faults or ()), *(drawn.steps or ())}
                drawn = searching.send(Rerun(drawn, fails(used), steps))
    except StopIteration as end:
        return end.value, runs


@pytest.mark.parametrize("needed", ["a", "m", "z", "az", "bcq"])
def test_the_steps_that_a_failure_needs_are_left(needed: str) -> None:
    """Of 26, in far fewer runs than there are steps for one of them."""
    found, runs = search(lambda used: used >= {*needed}, "abcdefghijklmnopqrstuvwxyz")
    assert found.failing.drawn == RunDraws((), tuple(needed))
    assert found.runs == runs <= (8 if len(needed) == 1 else MOST_RUNS)
    assert found.passing is not None
    assert not found.passing.failed


@pytest.mark.parametrize("needed", ["1", "4", "13", "1a"])
def test_the_faults_that_a_failure_needs_are_left(needed: str) -> None:
    """Whether the order counts as well or not."""
    found, _ = search(lambda used: used >= {*needed}, "abc", "1234")
    assert {*(found.failing.drawn.faults or ()), *(found.failing.drawn.steps or ())} == {*needed}


def test_what_fails_without_any_draw_is_compared_with_a_seed_that_passes() -> None:
    """With the fewest draws that make it pass."""
    found, _ = search(lambda used: "x" not in used, "abc", other="wxyz")
    assert found.failing.drawn == RunDraws((), ())
    assert found.passing is not None
    assert found.passing.drawn == RunDraws((), ("x",), 7)


def test_what_always_fails_is_no_race() -> None:
    """All that is tried fails."""
    found, _ = search(lambda _: True, "abc", other="wxyz")
    assert found.passing is None
    assert told_of_race(found.failing, found) == [
        "no race was found: it fails without any draw, in the order in which the programs were started, and with other "
        "seeds"
    ]


@pytest.mark.parametrize(
    ("failing", "passing", "sentence"),
    [
        (
            [TIMER, MOVED, SENT, READ],
            [SENT, READ, TIMER, MOVED],
            "at t = 1.000 s /base published /speed before /pilot published /goal to /base; in the nearest run that "
            "passes it was the other way round",
        ),
        ([SENT], [SENT, READ], "/base read /goal of /pilot at t = 1.000 s only in the nearest run that passes"),
        (
            [SENT, LOST, TIMER, MOVED],
            [SENT, READ, TIMER, MOVED],
            "a message of /pilot on /goal to /base was lost, and at t = 1.000 s /base published /speed; in the nearest "
            "run that passes, /base read /goal of /pilot first",
        ),
        (
            [SENT, LATE, TIMER, READ],
            [SENT, READ],
            "a message of /pilot on /goal to /base was 0.2 s late, and at t = 1.000 s /base ran its timer before /base "
            "read /goal of /pilot; in the nearest run that passes, /base read /goal of /pilot first",
        ),
        ([SENT], [SENT], ""),
    ],
)
def test_where_two_runs_part_is_said_in_one_sentence(
    failing: list[StepEvent], passing: list[StepEvent], sentence: str
) -> None:
    """It names both nodes, and what came first."""
    assert explained([step(*failing)], [step(*passing)]) == sentence


def test_each_seed_turns_a_part_of_the_faults_on() -> None:
    """Each about as often as not, and the same ones each time."""
    names = names_of({"/scan": (0, 1)}, {"scan": 0.1}, [*injected(0, {"/odom": {"delay": (0, 1)}})])
    assert names == ("delay /scan", "lose /scan", "delay /odom")
    drawn = [subset(seed, names) for seed in range(200)]
    assert len({*drawn}) == 8
    assert all(60 < sum(name in some for some in drawn) < 140 for name in names)
    assert drawn == [subset(seed, names) for seed in range(200)]


@pytest.mark.parametrize(
    ("between", "text"),
    [
        ({"/odom": {"pause": (0, 1)}}, "between: /odom: expected delay or lose for a topic, found 'pause'"),
        (
            {"base.py": {"lose": 0.1}},
            "between: base.py: expected pause or kill for a program; a topic begins with /, found 'lose'",
        ),
        ({"/odom": {"lose": 2}}, "between: /odom: lose: expected a share from 0 to 1, found 2"),
        ({"/odom": {"delay": 1}}, "between: /odom: delay: expected the least and the most seconds, found 1"),
        (
            {"base.py": {"kill": (2, 1)}},
            "between: base.py: kill: expected the least and the most seconds, found (2, 1)",
        ),
        ({"base.py": 3}, "between: base.py: expected pause or kill by name, found 3"),
    ],
)
def test_a_fault_that_cannot_be_is_refused(between: dict[str, object], text: str) -> None:
    """With its place, and what is expected there."""
    with pytest.raises(ValueError, match=f"^{re.escape(text)}$"):
        [*injected(0, between)]  # type: ignore[arg-type]
