"""What is left to the seed besides values: every case comes under any seed, and what is fixed stays as it was."""

import hashlib
import json
import math
import re
import statistics
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracing import ODOMETRY

from grader.grading.evidence.manifest import scenario_digest
from grader.grading.rubrics.builtin import builtin_exercises
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.scenario import (
    AnyOrder,
    Between,
    CountBetween,
    InOrder,
    Scenario,
    SomeOf,
    Span,
    TimeBetween,
    cases,
)
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.plan import Plan, Surroundings, plan_scenario
from grader.runtime.recording.codec import to_json
from grader.runtime.stimuli.calls import PlannedCalls
from grader.runtime.stimuli.goals import PlannedGoal
from grader.runtime.stimuli.messages import PlannedMessages
from grader.runtime.stimuli.numbers import NumberStream, PlannedNumbers
from grader.runtime.stimuli.recorded import PlannedRecording, RecordedStream, Recording, TimedMessage
from grader.runtime.stimuli.server import PlannedServer

MS, S = 1_000_000, 1_000_000_000
SEEDS = st.integers(0, 2**48 - 1)
EXERCISES = {exercise.id: exercise for exercise in builtin_exercises()}
DRIVE = Recording("/odom", ODOMETRY, tuple(TimedMessage(n * 100 * MS, b"cdr%d" % n, {"n": n}) for n in range(600)))


def plan(exercise: str, scenario: Scenario, seed: int) -> Plan:
    files = {name: StudentFile(name, name) for name in scenario.processes}
    submission = Submission("ada", "./ada", Path("/staged"), "sha256:aa", files)
    recordings = {stimulus: DRIVE for stimulus in scenario.stimuli if isinstance(stimulus, RecordedStream)}
    return plan_scenario(exercise, scenario, submission, Surroundings(seed, "virtual", recordings))


def planned(exercise: str, scenario: str, seed: int) -> Plan:
    """Return the plan of a scenario of a built-in rubric."""
    asked = next(s for s in EXERCISES[exercise].scenarios if s.id == scenario)
    return plan(exercise, asked, seed)


def averages(numbers: Sequence[float], window: int) -> list[float]:
    """Return the moving averages of a program that keeps its last values."""
    return [statistics.fmean(numbers[max(0, end - window) : end]) for end in range(1, len(numbers) + 1)]


def held(numbers: PlannedNumbers) -> list[list[Any]]:
    """Return the numbers of a plan in order, each with how often it is published."""
    found: list[list[Any]] = []
    for number in numbers.numbers:
        if found and found[-1][0] == number:
            found[-1][1] += numbers.repeats
        else:
            found.append([number, numbers.repeats])
    return found


@given(SEEDS)
def test_the_fan_is_asked_everything_in_any_order(seed: int) -> None:
    """The limit after a lower and a higher temperature, just above it from below, and just below it from above."""
    plan_ = planned("two_node_communication", "controller_alone", seed)
    (numbers,) = plan_.of(PlannedNumbers)
    found = held(numbers)
    order = [number for number, _ in found]
    steps = set(pairwise([("low" if v < 25 else "high" if v > 25 else "limit", side) for v, side in order]))
    assert {(("low", 0), ("limit", 0)), (("low", 0), ("limit", 1)), (("high", 0), ("limit", -1))} <= steps
    assert (("high", 0), ("limit", 0)) in steps
    assert 20.5 <= order[0][0] <= 24
    assert len(order) <= 11
    assert all(times >= 8 for _, times in found)
    end_ns = numbers.start_ns + numbers.period_ns * len(numbers.numbers)
    assert 0 <= end_ns - plan_.duration_ns < numbers.period_ns  # it never falls silent


@given(SEEDS, st.integers(2, 10))
def test_an_average_is_told_from_the_last_temperature_on_both_sides(seed: int, window: int) -> None:
    """Whatever the order, it is on the wrong side of the limit at the first message of some value on either side."""
    asked = planned("two_node_communication", "controller_alone", seed).of(PlannedNumbers)[0].numbers
    numbers = [value + side * 1e-6 for value, side in asked]
    changes = [k for k, (before, now) in enumerate(pairwise(numbers), 1) if before != now]
    smooth = averages(numbers, window)
    assert any(numbers[k] > 25 >= smooth[k] for k in changes)
    assert any(numbers[k] <= 25 < smooth[k] for k in changes)


@given(SEEDS)
def test_the_sensor_hears_every_kind_of_speed(seed: int) -> None:
    """Full, none and two drawn ones, all before the observation can end."""
    plan_ = planned("two_node_communication", "sensor_alone", seed)
    (numbers,) = plan_.of(PlannedNumbers)
    values = [value for (value, _), _ in held(numbers)]
    assert {100.0, 0.0} <= set(values)
    assert any(51 <= v <= 99 for v in values)
    assert any(1 <= v <= 49 for v in values)
    assert len(values) >= 4  # each differs from the one before, so that a sensor one message behind shows
    assert numbers.start_ns + numbers.period_ns * len(numbers.numbers) <= plan_.duration_ns


def angles(seed: int) -> list[float]:
    (messages,) = planned("joint_subscriber", "late_publisher", seed).of(PlannedMessages)
    return [fields["data"] for fields in messages.values]


@given(SEEDS)
def test_every_angle_comes_whatever_the_order(seed: int) -> None:
    """Once each, all before the observation ends."""
    plan_ = planned("joint_subscriber", "late_publisher", seed)
    (messages,) = plan_.of(PlannedMessages)
    found = angles(seed)
    kinds = ((0.2, 0.4), (-1.0, -0.2), (0.5, 0.5), (1.8, 3.1), (-1.5707963267948966,) * 2)
    assert all(any(low <= value <= high for value in found[:-1]) for low, high in kinds)
    assert -3.1 <= found[-1] <= -1.8
    assert 6 <= len(found) <= 12
    assert messages.start_ns >= 5 * S
    assert messages.start_ns + len(messages.values) * messages.period_ns + S <= plan_.duration_ns


#: What programs log at each angle that they receive.
ANGLE_MISTAKES: dict[str, Callable[[list[float]], list[float]]] = {
    "one behind": lambda v: [0.0, *v[:-1]],
    "two behind": lambda v: [0.0, 0.0, *v[:-2]],
    "mean of two": lambda v: averages(v, 2),
    "mean of five": lambda v: averages(v, 5),
    "first only": lambda v: [v[0]] * len(v),
    "within a quarter turn": lambda v: [max(-math.pi / 2, min(math.pi / 2, a)) for a in v],
    "without sign": lambda v: [abs(a) for a in v],
    "whole numbers": lambda v: [float(int(a)) for a in v],
    "a full turn": lambda v: [a % math.tau for a in v],
}


@pytest.mark.parametrize("logged", ANGLE_MISTAKES.values(), ids=ANGLE_MISTAKES)
@given(seed=SEEDS)
def test_every_mistake_with_angles_shows(logged: Callable[[list[float]], list[float]], seed: int) -> None:
    """To one decimal in radians: some angle is logged neither at once nor with the next, as from a queue."""
    right = angles(seed)
    wrong = logged(right)
    assert any(all(abs(late - angle) > 0.1 for late in wrong[k : k + 2]) for k, angle in enumerate(right))


def charges(seed: int, scenario: str) -> list[tuple[bool, str]]:
    (server,) = planned("battery_service", scenario, seed).of(PlannedServer)
    return [(r["success"], r["message"]) for r in server.responses]


def charge_of(answer: tuple[bool, str]) -> float:
    """Return the charge that a message tells; nan if it tells none."""
    found = re.search(r"[0-9.]+", answer[1])
    return float(found[0]) if found else math.nan


@given(SEEDS)
def test_a_client_hears_of_the_limit_within_five_questions(seed: int) -> None:
    """High charges come first, for a client may ask no more after a low one; then the limit, then one digit."""
    found = [charge_of(answer) for answer in charges(seed, "client_limit")]
    place = found.index(20.0)
    assert place == 3
    assert all(charge > 20 for charge in found[:place])
    assert {20.1, 100.0} <= set(found[:place])
    assert len(found) == place + 2
    assert found[-1] < 10


@pytest.mark.parametrize("scenario", ["client_refused", "client_puzzled"])
@given(seed=SEEDS)
def test_a_useless_answer_comes_between_good_ones_and_two_low_ones(scenario: str, seed: int) -> None:
    """After a good one, for without it nothing is known of how the client goes on."""
    found = charges(seed, scenario)
    useless = [k for k, answer in enumerate(found) if not answer[0] or math.isnan(charge_of(answer))]
    assert charge_of(found[0]) > 20
    assert useless
    assert set(useless) <= {1, 2}
    assert len(found) == 4  # the last one is repeated
    assert charge_of(found[-1]) < 10
    refused = [charge_of(found[k]) > 20 for k in useless if not found[k][0]]
    assert refused == [scenario == "client_refused"]
    assert scenario == "client_refused" or len(useless) == 2


@given(SEEDS)
def test_a_server_goes_away_after_a_good_answer_and_some_time_after_a_refusal(seed: int) -> None:
    """So that what is written after any answer is told from a start."""
    (server,) = planned("battery_service", "client_deserted", seed).of(PlannedServer)
    answers = [server.responses[min(k, len(server.responses) - 1)] for k in range(server.answers)]
    told = [r["success"] and charge_of((True, r["message"])) > 20 for r in answers]
    assert told[:3] == [True, False, True]
    assert told[-1]  # an old charge is there to be taken
    assert 3 <= server.answers <= 4


Decide = Callable[[list[tuple[bool, str]]], str]


def by(charge: Callable[[list[tuple[bool, str]]], float], limit: float = 20.0) -> Decide:
    """Return how a client decides that takes a charge from all answers so far; nan is no charge."""

    def decide(heard: list[tuple[bool, str]]) -> str:
        value = charge(heard)
        return "unknown" if math.isnan(value) else "go" if value > limit else "abort"

    return decide


def last_charge(heard: list[tuple[bool, str]]) -> float:
    return charge_of(heard[-1]) if heard[-1][0] else math.nan


def known(heard: list[tuple[bool, str]]) -> list[float]:
    """Return the charges that were told so far."""
    return [c for k in range(1, len(heard) + 1) if not math.isnan(c := last_charge(heard[:k]))]


def if_known(value: Callable[[list[tuple[bool, str]]], float]) -> Decide:
    return by(lambda heard: math.nan if math.isnan(last_charge(heard)) else value(heard))


def as_text(heard: list[tuple[bool, str]]) -> str:
    charge = last_charge(heard)
    return "unknown" if math.isnan(charge) else "go" if str(charge) > "20.0" else "abort"


CLIENT_MISTAKES: dict[str, Decide] = {
    "limit of 10": by(last_charge, 10.0),
    "limit of 19": by(last_charge, 19.0),
    "the limit itself starts": by(last_charge, math.nextafter(20.0, 0.0)),
    "limit of 21": by(last_charge, 21.0),
    "limit of 50": by(last_charge, 50.0),
    "whole numbers": if_known(lambda heard: float(int(last_charge(heard)))),
    "rounded": if_known(lambda heard: float(round(last_charge(heard)))),
    "compares texts": as_text,
    "first two digits": if_known(lambda heard: float(str(last_charge(heard)).replace(".", "")[:2])),
    "one behind": if_known(lambda heard: [0.0, *known(heard)][-2]),
    "one behind, the first is right": if_known(lambda heard: known(heard)[-2:][0]),
    "first answer": if_known(lambda heard: known(heard)[0]),
    "mean of two": if_known(lambda heard: statistics.fmean(known(heard)[-2:])),
    "mean of all": if_known(lambda heard: statistics.fmean(known(heard))),
    "highest so far": if_known(lambda heard: max(known(heard))),
    "always": lambda heard: "go",
    "never": lambda heard: "abort",
    "old charge": by(lambda heard: known(heard)[-1]),
    "success ignored": by(lambda heard: charge_of(heard[-1])),
    "a refusal is a low charge only": by(lambda heard: charge_of(heard[-1]) if charge_of(heard[-1]) > 50 else math.nan),
    "a refusal without a number is half": by(
        lambda heard: 50.0 if not heard[-1][0] and math.isnan(charge_of(heard[-1])) else last_charge(heard)
    ),
    "no number is full": by(lambda heard: 100.0 if math.isnan(charge_of(heard[-1])) else last_charge(heard)),
}


def missions(decide: Decide, seed: int, scenario: str, *, ends: bool) -> list[str]:
    """Return what a client decides at five questions, or up to the first low charge."""
    answers = charges(seed, scenario)
    heard = [answers[min(k, len(answers) - 1)] for k in range(5)]
    found = [decide(heard[: k + 1]) for k in range(5)]
    return found[: found.index("abort") + 1] if ends and "abort" in found else found


@pytest.mark.breadth(12, 40)
@pytest.mark.parametrize("ends", [False, True], ids=["goes on asking", "ends at the first low charge"])
@pytest.mark.parametrize("mistaken", CLIENT_MISTAKES.values(), ids=CLIENT_MISTAKES)
@given(seed=SEEDS)
def test_every_mistake_with_charges_shows(mistaken: Decide, ends: bool, seed: int) -> None:
    """In one of the scenarios, whatever the seed."""
    scenarios = ("client_limit", "client_refused", "client_puzzled")
    right = [missions(by(last_charge), seed, scenario, ends=ends) for scenario in scenarios]
    assert [missions(mistaken, seed, scenario, ends=ends) for scenario in scenarios] != right


@given(SEEDS)
def test_every_built_in_plan_fits_its_observation(seed: int) -> None:
    """Nothing that is judged is cut off."""
    for id_, exercise in EXERCISES.items():
        for scenario in exercise.scenarios:
            plan_ = plan(id_, scenario, seed)
            for calls in plan_.of(PlannedCalls):
                count = len(calls.requests) // calls.clients
                assert calls.start_ns + (count - 1) * calls.period_ns < plan_.duration_ns
            for recording in plan_.of(PlannedRecording):
                assert recording.stop_ns < plan_.duration_ns
            assert all(t_ns < plan_.duration_ns for _, t_ns in plan_.starts_ns)


def test_no_length_is_known_beforehand() -> None:
    """Of observations, and of what comes in them."""
    rate = {planned("velocity_publisher", "alone", seed).duration_ns for seed in range(20)}
    assert len(rate) > 15
    assert all(11 * S <= duration_ns <= 15 * S for duration_ns in rate)
    orders = {
        tuple(planned("two_node_communication", "controller_alone", n).of(PlannedNumbers)[0].numbers) for n in range(50)
    }
    shapes = {tuple((round(v) // 26, side) for v, side in order) for order in orders}
    assert len(shapes) == 50
    asked = {len(planned("battery_service", "server_asked", seed).of(PlannedCalls)[0].requests) for seed in range(50)}
    assert asked == {3 * calls for calls in range(16, 25)}


ITEMS = st.recursive(
    st.integers(0, 9).map(float),
    lambda inner: st.one_of(
        st.lists(st.integers(0, 9).map(float), min_size=1, max_size=3).map(lambda items: InOrder(tuple(items))),
        st.builds(
            SomeOf,
            st.lists(st.integers(0, 9).map(float), min_size=1, max_size=3).map(tuple),
            st.integers(0, 3) | st.just(CountBetween(0, 4)),
        ),
        st.lists(inner, min_size=1, max_size=4).map(lambda items: AnyOrder(tuple(items))),
    ),
    max_leaves=8,
)


def fixed(items: Sequence[Any]) -> Iterator[Any]:
    """Return the cases that have to come, however they are ordered."""
    for item in items:
        if isinstance(item, (AnyOrder, InOrder)):
            yield from fixed(item.items)
        elif not isinstance(item, SomeOf):
            yield item


@given(st.lists(ITEMS, min_size=1, max_size=4).map(tuple), SEEDS)
def test_every_required_case_comes_under_any_seed(items: tuple[Any, ...], seed: int) -> None:
    """And no more than may."""
    stream = NumberStream("/a", "std_msgs/msg/Float32", items, 100 * MS, 100 * MS, 0)
    found = [v for v, _ in plan("x", Scenario("a", ("a.py",), Span(S), (stream,)), seed).of(PlannedNumbers)[0].numbers]
    assert not Counter(fixed(items)) - Counter(found)
    low, high = cases(items)
    assert low <= len(found) <= high


@given(SEEDS, st.integers(0, 10**10), st.integers(1, 10**10))
def test_a_drawn_time_lies_between_its_ends(seed: int, low_ns: int, more_ns: int) -> None:
    """Both of which are inside."""
    span = Span(TimeBetween(low_ns, low_ns + more_ns))
    assert low_ns <= plan("x", Scenario("a", ("a.py",), span), seed).duration_ns <= low_ns + more_ns


def test_a_stream_without_numbers_is_one() -> None:
    """Where the seed draws none of those that may come."""
    stream = NumberStream("/a", "t", (SomeOf((1.0,), CountBetween(0, 1)),), 100 * MS, TimeBetween(S, 2 * S), 0)
    counts = {
        len(plan("x", Scenario("a", ("a.py",), Span(3 * S), (stream,)), n).of(PlannedNumbers)[0].numbers)
        for n in range(9)
    }
    assert counts == {0, 30}  # the last one goes on until the end


#: Of the stimuli below under the seeds 1, 2 and 2**40, and of the scenarios, before anything but values was drawn.
PLANS = "3ac854dab60afe2f06a2fb9989cb6f2ff519fd76e02eb02808c50580a53df2a8"
SCENARIOS = (
    "sha256:3f6c775e3fbfd49795049dbb969aba4d8b5d9652004ef0e4736e2f22a2752c78",
    "sha256:f54f29f67d0f9cdb53d88eba45edb65466d2a84b217cab75298ef6e0fa0469ed",
)


#: Plans had one list for each of these kinds.
LISTS = {
    "numbers": PlannedNumbers,
    "recordings": PlannedRecording,
    "messages": PlannedMessages,
    "servers": PlannedServer,
    "calls": PlannedCalls,
    "goals": PlannedGoal,
}


def _of_old(made: Plan) -> dict[str, Any]:
    """Return the drawn parts of a plan as they were written when the digest was made."""
    data = to_json(made)
    lists: dict[str, list[Any]] = {name: [] for name in LISTS}
    for planned, written in zip(made.stimuli, data["stimuli"], strict=True):
        assert written.pop("is") == type(planned).__name__
        assert written.pop("field", "") == ""  # which is younger
        lists[next(name for name, kind in LISTS.items() if isinstance(planned, kind))].append(written)
    return {**lists, **{name: data[name] for name in ("duration_ns", "starts_ns", "host_seed")}}


def test_what_leaves_nothing_open_is_planned_as_ever() -> None:
    """Byte for byte: evidence stays comparable, and a seed that somebody noted still gives the same run."""
    exercise = read_rubric(Path(__file__).with_name("fixed_course.yaml"))
    plans = [_of_old(plan("fixed", s, seed)) for s in exercise.scenarios for seed in (1, 2, 2**40)]
    text = json.dumps(plans)
    assert hashlib.sha256(text.encode()).hexdigest() == PLANS
    assert tuple(map(scenario_digest, exercise.scenarios)) == SCENARIOS


@given(SEEDS)
def test_one_stimulus_more_changes_nothing_before_it(seed: int) -> None:
    """Orders, counts and times are drawn for each by itself."""
    open_ = (AnyOrder((1.0, 2.0, Between(3, 9))), SomeOf((4.0,), CountBetween(0, 5)))
    one = NumberStream("/a", "t", open_, 100 * MS, TimeBetween(S, 2 * S), TimeBetween(0, S))
    alone = plan("x", Scenario("a", ("a.py",), Span(30 * S), (one,)), seed).of(PlannedNumbers)
    assert plan("x", Scenario("a", ("a.py",), Span(30 * S), (one, one)), seed).of(PlannedNumbers)[:1] == alone
