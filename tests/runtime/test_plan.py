"""Plans: every drawn value in place, the same for the same seed, and nothing of the stimuli in what students see."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracing import ODOMETRY

from grader.runtime.host.clock import EPOCH_NS, EPOCH_SPAN_S, UPTIME_NS, UPTIME_SPAN_S
from grader.runtime.model.scenario import Between, JustAbove, JustBelow, Scenario, Span, Stimulus
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.plan import Plan, Surroundings, derive, plan_scenario
from grader.runtime.recording.codec import from_json, to_json
from grader.runtime.stimuli.numbers import NumberStream, PlannedNumbers
from grader.runtime.stimuli.recorded import PlannedRecording, RecordedStream, Recording, TimedMessage

MS = 1_000_000
SUBMISSION = Submission(
    "ada",
    "./ada",
    Path("/staged"),
    "sha256:aa",
    {"a.py": StudentFile("a.py", "src/a.py"), "b.py": StudentFile("b.py", None)},
)


def stream(*values: Any, **fields: Any) -> NumberStream:
    usual = {"topic": "/temperature", "type": "std_msgs/msg/Float32", "period_ns": 200 * MS, "hold_ns": 2000 * MS}
    return NumberStream(values=values, start_ns=500 * MS, **{**usual, **fields})


def scenario(*stimuli: Stimulus, name: str = "alone", **span: Any) -> Scenario:
    return Scenario(name, ("a.py",), Span(**{"duration_ns": 1000 * MS, **span}), stimuli)


def plan(
    *stimuli: Stimulus,
    seed: int = 1,
    name: str = "alone",
    exercise: str = "velocity_publisher",
    recording: Recording | None = None,
    **span: Any,
) -> Plan:
    """Return the plan of a scenario with some stimuli."""
    asked = scenario(*stimuli, name=name, **span)
    recordings = {} if recording is None else {s: recording for s in stimuli if isinstance(s, RecordedStream)}
    return plan_scenario(exercise, asked, SUBMISSION, Surroundings(seed, "virtual", recordings))


DRAWN = stream(Between(20.5, 24), Between(0, 10**9), Between(27.25, 30))


def test_the_same_seed_draws_the_same_values() -> None:
    """A run can be repeated."""
    assert plan(DRAWN, seed=7) == plan(DRAWN, seed=7)
    assert plan(DRAWN, seed=7).of(PlannedNumbers) != plan(DRAWN, seed=8).of(PlannedNumbers)


def test_scenarios_and_exercises_draw_for_themselves() -> None:
    """What is known of one says nothing of another."""
    drawn = {
        plan(DRAWN, name=name, exercise=exercise).of(PlannedNumbers)[0].numbers
        for name in ("alone", "together")
        for exercise in "xy"
    }
    assert len(drawn) == 4


def test_a_stimulus_more_does_not_change_those_before_it() -> None:
    """Draws are made in order."""
    assert plan(DRAWN).of(PlannedNumbers)[0] == plan(DRAWN, stream(Between(0, 1))).of(PlannedNumbers)[0]


def test_students_cannot_tell_the_stimuli_from_their_seed() -> None:
    """What seeds their processes is derived by another way, for each scenario anew, and cannot be turned back."""
    plans = [plan(DRAWN, seed=seed, name=name) for seed in (1, 2) for name in ("alone", "together")]
    assert len({p.host_seed for p in plans}) == 4
    for seed, p in zip((1, 1, 2, 2), plans, strict=True):
        assert p.host_seed != derive(seed, "stimuli", "velocity_publisher", p.scenario)
        assert len(p.host_seed) == 64
        assert int(p.host_seed, 16)


def test_each_process_has_randomness_of_its_own() -> None:
    """Two programs that draw ids, such as those of goals, draw different ones."""
    two = replace(plan(DRAWN), processes=(("one.py", "one.py"), ("two.py", "two.py")))
    assert two.seed_of("one.py") == two.host_seed
    assert len({two.seed_of(name) for name in ("one.py", "two.py", "three.py")}) == 3
    assert two.seed_of("two.py") == two.seed_of("two.py")


def test_the_date_follows_from_the_seed_alone() -> None:
    """All scenarios of a submission run on one day, and another submission on another."""
    drawn = {
        (seed, p.epoch_ns, p.uptime_ns, p.hash_seed)
        for seed in (1, 2)
        for p in (plan(DRAWN, seed=seed), plan(DRAWN, seed=seed, name="together"))
    }
    assert len(drawn) == len({epoch_ns for _, epoch_ns, _, _ in drawn}) == 2
    for _, epoch_ns, uptime_ns, hash_seed in drawn:
        assert 0 <= epoch_ns - EPOCH_NS < EPOCH_SPAN_S * 1_000_000_000
        assert 0 <= uptime_ns - UPTIME_NS < UPTIME_SPAN_S * 1_000_000_000
        assert hash_seed == 0


@given(st.integers(0, 2**32 - 1), st.integers(-50, 50), st.integers(0, 50))
def test_whole_bounds_draw_whole_numbers_inside_them(seed: int, low: int, width: int) -> None:
    """A student's whole type carries them without rounding."""
    ((value, side),) = plan(stream(Between(low, low + width)), seed=seed).of(PlannedNumbers)[0].numbers
    assert low <= value <= low + width
    assert value == int(value)
    assert side == 0


@given(st.integers(0, 2**32 - 1))
def test_other_bounds_draw_two_decimals_inside_them(seed: int) -> None:
    """Exactly what two printed decimals show."""
    ((value, _),) = plan(stream(Between(20.5, 24)), seed=seed).of(PlannedNumbers)[0].numbers
    assert 20.5 <= value <= 24
    assert float(f"{value:.2f}") == value


def test_both_ends_of_whole_bounds_can_be_drawn() -> None:
    """The bounds are inside."""
    drawn = {plan(stream(Between(1, 3)), seed=seed).of(PlannedNumbers)[0].numbers[0][0] for seed in range(50)}
    assert drawn == {1.0, 2.0, 3.0}


def test_limits_are_left_to_the_student_s_type() -> None:
    """How far above is just above depends on it."""
    planned = plan(stream(25, JustAbove(25), JustBelow(25))).of(PlannedNumbers)[0]
    assert planned.numbers == ((25, 0), (25, 1), (25, -1))


@pytest.mark.parametrize(("hold_ms", "repeats"), [(2000, 10), (200, 1), (100, 1), (399, 1), (400, 2)])
def test_a_number_is_repeated_while_it_is_held(hold_ms: int, repeats: int) -> None:
    """At least once."""
    assert plan(stream(1, hold_ns=hold_ms * MS)).of(PlannedNumbers)[0].repeats == repeats


def test_processes_run_the_files_that_were_found() -> None:
    """By the name that was asked for; times are the scenario's."""
    planned = plan(after_first_message_on="/cmd_vel", wait_at_most_ns=5)
    assert planned.processes == (("a.py", "src/a.py"),)
    assert (planned.first_message_on, planned.wait_at_most_ns, planned.duration_ns) == ("/cmd_vel", 5, 1000 * MS)
    assert plan().first_message_on == ""


def drive(count: int = 600, period_ms: int = 33) -> Recording:
    """Return a recording of about 20 s."""
    return Recording(
        "/odom", ODOMETRY, tuple(TimedMessage(n * period_ms * MS, bytes([n % 256]), {"n": n}) for n in range(count))
    )


def test_a_recording_is_played_from_its_start_time() -> None:
    """With its own pace, no longer than asked for, and the publisher goes just after the last message."""
    asked = RecordedStream("/odom", ODOMETRY, "drive", 5000 * MS, 12_000 * MS)
    (recording,) = plan(asked, recording=drive()).of(PlannedRecording)
    times = [t for t, _, _ in recording.messages]
    assert (recording.topic, recording.type, recording.start_ns) == ("/odom", "nav_msgs/msg/Odometry", 5000 * MS)
    assert times[0] == 5000 * MS
    assert {b - a for a, b in pairwise(times)} == {33 * MS}
    assert 16_900 * MS < times[-1] <= 17_000 * MS
    assert recording.stop_ns == times[-1] + 1


def test_which_part_of_a_recording_is_played_is_drawn() -> None:
    """A position that was written into the code does not help."""
    asked = RecordedStream("/odom", ODOMETRY, "drive", 0, 5000 * MS)
    starts = {
        plan(asked, seed=seed, recording=drive()).of(PlannedRecording)[0].messages[0][2]["n"] for seed in range(20)
    }
    assert len(starts) > 5


@pytest.mark.parametrize(
    "stimuli",
    [(), (DRAWN,), (DRAWN, RecordedStream("/odom", ODOMETRY, "drive", 5, 5000 * MS), stream(25, JustAbove(25)))],
)
def test_a_plan_comes_back_as_it_was(stimuli: tuple[Stimulus, ...]) -> None:
    """Over the line to the worker, as JSON."""
    planned = plan(*stimuli, recording=drive())
    assert from_json(Plan, json.loads(json.dumps(to_json(planned)))) == planned
