"""The beginning of a recording is judged by the rubric's own checks, on two clocks, and only what it shows counts."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import pytest

from grader.grading.judging.agreement import Aspect
from grader.grading.judging.beginnings import LENGTHS_NS, BeginningJudge, Comparison
from grader.grading.judging.checks.fields import FieldEqual, FieldFunction, RandomInRange
from grader.grading.judging.checks.logs import UsesLogger
from grader.grading.judging.checks.programs import CleanShutdown
from grader.grading.judging.checks.rate import TopicRate
from grader.grading.judging.checks.services import ServiceResponse
from grader.grading.judging.values import FieldRule
from grader.grading.model.exercise import Check, Criterion, Exercise, Finding, of_beginning
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, ClockKind, Endpoint, GraphSnapshot, Request, Response, Trace
from grader.testing import TraceBuilder

S = 1_000_000_000
FLOAT, TRIGGER = "std_msgs/msg/Float64", "std_srvs/srv/Trigger"
FILE = "a.py"
SERVICE = "/battery"
#: Adds to a recording what a program does.
Program = Callable[[TraceBuilder], TraceBuilder]


def judge_of(*checks: Check) -> BeginningJudge:
    """Return what judges a scenario with one criterion for each check."""
    criteria = tuple(Criterion(f"c{n}", f"Criterion {n}", Fraction(4), "alone", c) for n, c in enumerate(checks))
    scenario = Scenario("alone", (FILE,), Span(20 * S))
    exercise = Exercise("e", "1", "E", True, (FILE,), (scenario,), criteria, "sha256:0")
    submission = Submission("s", "s", Path("s"), "sha256:1", {FILE: StudentFile(FILE, FILE)})
    return BeginningJudge(exercise, "alone", submission, {})


def recorded(program: Program, clock: ClockKind = ClockKind.VIRTUAL, stop_s: float = 20.0) -> AssessedTrace:
    return replace(program(TraceBuilder(FILE, stop_s=stop_s, clock=clock)).trace(), scenario="alone")


def on_wall(program: Program, stop_s: float = 5.0) -> AssessedTrace:
    return recorded(program, ClockKind.WALL, stop_s)


def compared(check: Check, virtual: Program, wall: Program, stop_s: float = 5.0) -> Comparison:
    return judge_of(check).compare(recorded(virtual), on_wall(wall, stop_s), (0, 0))


def swinging(amplitude: float = 1.0, *, lost: int = 0, jitter_s: float = 0.0, rate_hz: float = 10.0) -> Program:
    """A program that publishes a sine of the number of its messages, of which the first may be lost."""

    def program(builder: TraceBuilder) -> TraceBuilder:
        for n in range(lost, round((builder.stop_s - 0.1) * rate_hz)):
            late_s = jitter_s * math.sin(n * n)
            builder.message(0.1 + n / rate_hz + late_s, "/joint", FLOAT, {"data": amplitude * math.sin(0.1 * n)})
        return builder

    return program


def serving(text: str = "Battery: {}% remaining", *, step: float = -0.5, answers_s: float = 0.004) -> Program:
    """A program that answers each of ten requests a second with a charge."""

    def program(builder: TraceBuilder) -> TraceBuilder:
        for n in range(round((builder.stop_s - 1) * 10)):
            t_ns = S + n * S // 10
            builder.add(Request(t_ns, SERVICE, TRIGGER, n + 1, "grader", 1, {}))
            value = {"success": True, "message": text.format(84.5 + n * step)}
            answered_ns = t_ns + round(answers_s * S)
            builder.add(Response(answered_ns, SERVICE, TRIGGER, n + 1, "student", 1, value))
        return builder

    return program


CHANCE = [random.Random(n).random() for n in range(1000)]
SINE = FieldFunction("/joint", "sin(0.1 * n)", tolerance=1e-5)
SEQUENCE = known_checks()["service_sequence"](SERVICE, 84.5, -0.5)
TEXT = ServiceResponse(SERVICE, {"message": FieldRule(pattern=r"Battery: .*% remaining"), "success": True})
RATE = TopicRate("/joint", 10.0, 0.5)


@pytest.mark.parametrize(
    ("check", "right", "wrong"),
    [
        pytest.param(SINE, swinging(), swinging(2.0), id="values that vary"),
        pytest.param(SEQUENCE, serving(), serving(step=-1.0), id="numbers in responses"),
        pytest.param(TEXT, serving(), serving("Battery: {}% left"), id="texts of responses"),
        pytest.param(RATE, swinging(), swinging(rate_hz=9.0), id="a rate within 30 %"),
        pytest.param(
            RandomInRange("/joint", 0, 1),
            lambda b: b.messages("/joint", FLOAT, lambda n: {"data": CHANCE[n]}, rate_hz=10),
            lambda b: b.messages("/joint", FLOAT, lambda n: {"data": 2 * CHANCE[n]}, rate_hz=10),
            id="random values",
        ),
    ],
)
def test_what_a_check_judges_wrong_on_the_other_clock_is_found(check: Check, right: Program, wrong: Program) -> None:
    """And only that: the same program is right on both."""
    (found,) = compared(check, right, wrong).lost
    assert (found.aspect, found.name, found.virtual, found.wall) == (Aspect.CRITERION, "Criterion 0", "met", "not met")
    assert compared(check, right, right) == Comparison()
    assert compared(check, wrong, wrong) == Comparison()
    assert compared(check, wrong, right) == Comparison()


@pytest.mark.parametrize(
    ("check", "virtual", "wall"),
    [
        pytest.param(SINE, swinging(), swinging(lost=3), id="the first messages are lost"),
        pytest.param(SINE, swinging(), swinging(jitter_s=0.02), id="jitter"),
        pytest.param(RATE, swinging(), swinging(jitter_s=0.03), id="jitter of a rate"),
        pytest.param(SEQUENCE, serving(), serving(answers_s=0.03), id="late answers"),
        pytest.param(
            FieldEqual("/joint", {"data": 1.0}),
            lambda b: b.messages("/joint", FLOAT, lambda n: {"data": float(n == 0)}, rate_hz=1, stop_s=1),
            lambda b: b,
            id="the only right message is the first one",
        ),
    ],
)
def test_what_a_real_clock_does_is_no_difference(check: Check, virtual: Program, wall: Program) -> None:
    """Messages are late, and those before discovery are lost."""
    assert compared(check, virtual, wall) == Comparison()


@pytest.mark.breadth(4, 20)
@pytest.mark.parametrize("tenths", range(40, 60))
def test_a_recording_may_end_anywhere(tenths: int) -> None:
    """Also between a request and its response."""
    for delay_s in (0.0, 0.02, 0.045):
        assert compared(SEQUENCE, serving(), serving(answers_s=delay_s), tenths / 10 + 0.01) == Comparison()
    assert compared(SEQUENCE, serving(), serving(step=-1.0), tenths / 10 + 0.01).lost


def test_partly_met_is_less_than_met() -> None:
    """A rate that earns half of the points on the wall clock is a difference."""
    check = TopicRate("/joint", 10.0, 0.5, partly_tolerance=1.5)
    (found,) = compared(check, swinging(), swinging(rate_hz=9.0)).lost
    assert (found.virtual, found.wall) == ("met", "partly met")


def test_what_the_first_recording_does_not_show_early_enough_is_not_compared() -> None:
    """A criterion that is met in the end and not in the beginning says nothing about the other clock."""

    def late(builder: TraceBuilder) -> TraceBuilder:
        return builder.log(12.0, "hello") if builder.stop_s > 12 else builder

    assert compared(UsesLogger(FILE), late, lambda b: b) == Comparison()


def test_a_check_says_that_a_beginning_shows_nothing() -> None:
    """One of the shutdown never sees it; one of many answers is content with few."""
    assert of_beginning(CleanShutdown(FILE)) is None
    assert of_beginning(replace(SEQUENCE, at_least=172)) == replace(SEQUENCE, at_least=3)
    assert of_beginning(UsesLogger(FILE)) == UsesLogger(FILE)
    many = replace(SEQUENCE, at_least=150)
    assert compared(many, serving(), serving(step=-1.0)).lost
    assert compared(many, serving(), serving()) == Comparison()


@dataclass(frozen=True)
class Own:
    """A check of a rubric's own, which says by `of_beginning` what judges a beginning, or fails to."""

    says: Check | None = None
    fails: bool = False

    def judge(self, trace: Trace) -> Finding:
        return Finding(Fraction(trace.clock is ClockKind.VIRTUAL), "found")

    def of_beginning(self) -> Check | None:
        if self.fails:
            raise ValueError
        return self.says


def test_a_check_of_a_rubrics_own_declares_what_judges_a_beginning() -> None:
    """It may declare nothing, itself, another one, or make a mistake."""
    assert compared(Own(), swinging(), swinging()) == Comparison()
    assert compared(Own(fails=True), swinging(), swinging()) == Comparison()
    assert compared(Own(says=Own()), swinging(), swinging()).lost


def test_a_busy_machine_leaves_it_open() -> None:
    """Nodes that waited long for a processor may have been slow for that."""
    slow = replace(on_wall(swinging(rate_hz=9.0)), most_starved_ns=S)
    assert judge_of(RATE).compare(recorded(swinging()), slow, (0, 0)) == Comparison(unsure=True)
    right = replace(on_wall(swinging()), most_starved_ns=S, harness_problem="the machine was too busy")
    assert judge_of(RATE).compare(recorded(swinging()), right, (0, 0)) == Comparison()


@pytest.mark.parametrize(
    ("appears_s", "most_s", "all_s", "unsure"),
    [
        pytest.param(0.0, 0.0, 0.0, False, id="it does nothing"),
        pytest.param(0.0, 1.0, 1.0, False, id="four fifths of the time were its own"),
        pytest.param(0.0, 4.5, 4.5, True, id="a tenth of the time was its own"),
        pytest.param(4.2, 0.0, 0.0, False, id="it comes late"),
        pytest.param(4.2, 0.5, 1.0, False, id="it may have come a second earlier"),
        pytest.param(4.2, 0.5, 3.9, True, id="it may have come four seconds earlier"),
    ],
)
def test_programs_that_had_no_time_on_a_busy_machine_lose_nothing(
    appears_s: float, most_s: float, all_s: float, unsure: bool
) -> None:
    """Where a program was in the graph late or waited most of the time, it is not known what it would have done."""

    def appearing(at_s: float) -> GraphSnapshot:
        end = Endpoint("publisher", "/joint", FLOAT, "/a", 0, "reliable", "volatile")
        return GraphSnapshot(round(at_s * S), ("/a",), (end,))

    virtual = recorded(lambda b: b.log(1.0, "hello").add(appearing(0.0)))
    silent = on_wall(lambda b: b.add(appearing(appears_s)))
    busy = replace(silent, most_starved_ns=round(most_s * S), all_starved_ns=round(all_s * S))
    found = judge_of(UsesLogger(FILE)).compare(virtual, busy, (0, 0))
    assert (bool(found.lost), found.unsure) == (not unsure, unsure)


def test_a_check_is_as_short_as_its_criteria_allow() -> None:
    """A rate needs the shortest, a value that comes late a longer one, and nothing makes it endless."""
    first, *_, last = LENGTHS_NS
    assert judge_of(RATE).length_ns(recorded(swinging()), 0) == first
    assert judge_of().length_ns(recorded(swinging()), 0) == first

    def logs(at_s: float) -> AssessedTrace:
        return recorded(lambda b: b.log(at_s, "hello"))

    assert judge_of(UsesLogger(FILE)).length_ns(logs(4.5), 0) == LENGTHS_NS[1]
    assert judge_of(UsesLogger(FILE)).length_ns(logs(15.0), 0) == last


def test_both_recordings_count_from_their_first_message() -> None:
    """A program that is slow to start is judged for what it does afterwards."""

    def late(builder: TraceBuilder) -> TraceBuilder:
        return builder.messages("/joint", FLOAT, {"data": 1.0}, rate_hz=10, start_s=3.0)

    judge = judge_of(RATE)
    assert judge.compare(recorded(swinging()), on_wall(late, 8.0), (S // 10, 3 * S)) == Comparison()
