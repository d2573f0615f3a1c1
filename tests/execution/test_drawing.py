"""What is left to the seed besides values: every case comes under any seed, and what is fixed stays as it was."""

import hashlib
import json
import statistics
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.core.scenario import (
    AnyOrder,
    Between,
    CountBetween,
    InOrder,
    NumberStream,
    Scenario,
    SomeOf,
    Span,
    TimeBetween,
    TimedMessage,
    cases,
)
from grader.core.submission import StudentFile, Submission
from grader.execution.bag import Odometry
from grader.execution.codec import to_json
from grader.execution.evidence.manifest import scenario_digest
from grader.execution.plan import Plan, PlannedNumbers, plan_scenario
from grader.rubrics.builtin import builtin_rubrics
from grader.rubrics.loader import read_rubric

MS, S = 1_000_000, 1_000_000_000
SEEDS = st.integers(0, 2**48 - 1)
EXERCISES = {id_: read_rubric(path) for id_, path in builtin_rubrics().items()}
ODOMETRY = Odometry("/odom", tuple(TimedMessage(n * 100 * MS, b"cdr%d" % n, {"n": n}) for n in range(600)))


def plan(exercise: str, scenario: Scenario, seed: int) -> Plan:
    files = {name: StudentFile(name, name) for name in scenario.processes}
    submission = Submission("ada", "./ada", Path("/staged"), "sha256:aa", files)
    return plan_scenario(exercise, scenario, submission, seed=seed, odometry=ODOMETRY, clock="virtual")


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
    (numbers,) = plan_.numbers
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
    asked = planned("two_node_communication", "controller_alone", seed).numbers[0].numbers
    numbers = [value + side * 1e-6 for value, side in asked]
    changes = [k for k, (before, now) in enumerate(pairwise(numbers), 1) if before != now]
    smooth = averages(numbers, window)
    assert any(numbers[k] > 25 >= smooth[k] for k in changes)
    assert any(numbers[k] <= 25 < smooth[k] for k in changes)


@given(SEEDS)
def test_the_sensor_hears_every_kind_of_speed(seed: int) -> None:
    """Full, none and two drawn ones, all before the observation can end."""
    plan_ = planned("two_node_communication", "sensor_alone", seed)
    (numbers,) = plan_.numbers
    values = [value for (value, _), _ in held(numbers)]
    assert {100.0, 0.0} <= set(values)
    assert any(51 <= v <= 99 for v in values)
    assert any(1 <= v <= 49 for v in values)
    assert numbers.start_ns + numbers.period_ns * len(numbers.numbers) <= plan_.duration_ns


@given(SEEDS)
def test_every_angle_comes_whatever_the_order(seed: int) -> None:
    """One to three times each, all before the observation ends."""
    plan_ = planned("joint_subscriber", "late_publisher", seed)
    (messages,) = plan_.messages
    found = [fields["data"] for fields in messages.values]
    kinds = ((0.2, 1.0), (-1.0, -0.2), (0.5, 0.5), (1.2, 3.1), (-1.5707963267948966,) * 2, (-3.1, -1.2))
    assert all(any(low <= value <= high for value in found) for low, high in kinds)
    assert 6 <= len(found) <= 18
    assert messages.start_ns >= 5 * S
    assert messages.start_ns + len(messages.values) * messages.period_ns <= plan_.duration_ns


def charges(seed: int, scenario: str) -> list[tuple[bool, str]]:
    (server,) = planned("battery_service", scenario, seed).servers
    return [(r["success"], r["message"]) for r in server.responses]


@given(SEEDS)
def test_a_client_hears_of_the_limit_within_five_questions(seed: int) -> None:
    """High charges come first, for a client may ask no more after a low one; the first low one is the limit itself."""
    found = [float(message.split()[1].rstrip("%")) for _, message in charges(seed, "client_limit")]
    place = found.index(20.0)
    assert 2 <= place <= 4
    assert all(charge > 20 for charge in found[:place])
    assert 20.5 in found[:place]
    assert all(charge < 20 for charge in found[place + 1 :])


@pytest.mark.parametrize("scenario", ["client_refused", "client_puzzled"])
@given(seed=SEEDS)
def test_a_useless_answer_comes_between_good_ones_and_a_low_one(scenario: str, seed: int) -> None:
    """After a good one, for without it nothing is known of how the client goes on."""
    found = charges(seed, scenario)
    useless = [k for k, (success, message) in enumerate(found) if not success or message == "no reading"]
    assert len(useless) == 1
    assert 1 <= useless[0] < len(found) - 1 <= 4
    assert float(found[-1][1].split()[1].rstrip("%")) < 20


@given(SEEDS)
def test_every_built_in_plan_fits_its_observation(seed: int) -> None:
    """Nothing that is judged is cut off."""
    for id_, exercise in EXERCISES.items():
        for scenario in exercise.scenarios:
            plan_ = plan(id_, scenario, seed)
            for calls in plan_.calls:
                count = len(calls.requests) // calls.clients
                assert calls.start_ns + (count - 1) * calls.period_ns < plan_.duration_ns
            for recording in plan_.recordings:
                assert recording.stop_ns < plan_.duration_ns
            assert all(t_ns < plan_.duration_ns for _, t_ns in plan_.starts_ns)


def test_no_length_is_known_beforehand() -> None:
    """Of observations, and of what comes in them."""
    rate = {planned("velocity_publisher", "alone", seed).duration_ns for seed in range(20)}
    assert len(rate) > 15
    assert all(11 * S <= duration_ns <= 15 * S for duration_ns in rate)
    orders = {tuple(planned("two_node_communication", "controller_alone", n).numbers[0].numbers) for n in range(50)}
    shapes = {tuple((round(v) // 26, side) for v, side in order) for order in orders}
    assert len(shapes) == 50
    asked = {len(planned("battery_service", "server_asked", seed).calls[0].requests) for seed in range(50)}
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
    found = [v for v, _ in plan("x", Scenario("a", ("a.py",), Span(S), (stream,)), seed).numbers[0].numbers]
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
    counts = {len(plan("x", Scenario("a", ("a.py",), Span(3 * S), (stream,)), n).numbers[0].numbers) for n in range(9)}
    assert counts == {0, 30}  # the last one goes on until the end


#: Of the stimuli below under the seeds 1, 2 and 2**40, and of the scenarios, before anything but values was drawn.
PLANS = "3ac854dab60afe2f06a2fb9989cb6f2ff519fd76e02eb02808c50580a53df2a8"
SCENARIOS = (
    "sha256:43b8366a61c002df04cbc1f9ffb671fe2ae5382acfe900e179909a23ee208c53",
    "sha256:f54f29f67d0f9cdb53d88eba45edb65466d2a84b217cab75298ef6e0fa0469ed",
)


def test_what_leaves_nothing_open_is_planned_as_ever() -> None:
    """Byte for byte: evidence stays comparable, and a seed that somebody noted still gives the same run."""
    exercise = read_rubric(Path(__file__).with_name("fixed_course.yaml"))
    kept = ("numbers", "recordings", "messages", "servers", "calls", "goals", "duration_ns", "starts_ns", "host_seed")
    plans = [to_json(plan("fixed", s, seed)) for s in exercise.scenarios for seed in (1, 2, 2**40)]
    text = json.dumps([{name: data[name] for name in kept} for data in plans])
    assert hashlib.sha256(text.encode()).hexdigest() == PLANS
    assert tuple(map(scenario_digest, exercise.scenarios)) == SCENARIOS


@given(SEEDS)
def test_one_stimulus_more_changes_nothing_before_it(seed: int) -> None:
    """Orders, counts and times are drawn for each by itself."""
    open_ = (AnyOrder((1.0, 2.0, Between(3, 9))), SomeOf((4.0,), CountBetween(0, 5)))
    one = NumberStream("/a", "t", open_, 100 * MS, TimeBetween(S, 2 * S), TimeBetween(0, S))
    alone = plan("x", Scenario("a", ("a.py",), Span(30 * S), (one,)), seed).numbers
    assert plan("x", Scenario("a", ("a.py",), Span(30 * S), (one, one)), seed).numbers[:1] == alone
