"""The controller alone: thresholds, and every honest way of answering."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from nodes import HONEST_FANS, WRONG_FANS, Rule, each_speed, on_change, right_speed, timed
from tracing import FAN_VALUES, FLOAT32, Recording, held_at, scripted

from grader.grading.model.exercise import Finding
from grader.grading.rubrics.builtin import builtin_exercises
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.plan import Surroundings, plan_scenario
from grader.runtime.stimuli.numbers import PlannedNumbers

ON = known_checks()["threshold_response"]("/temperature", "/fan_speed", 25, 100, 0, "above", unit="°C")
OFF = known_checks()["threshold_response"]("/temperature", "/fan_speed", 25, 100, 0, "at_or_below", unit="°C")


def both(rec: Recording) -> tuple[Finding, Finding]:
    trace = rec.trace()
    return ON.judge(trace), OFF.judge(trace)


def earned(rec: Recording) -> tuple[int, int]:
    return tuple(int(f.credit) for f in both(rec))  # type: ignore[return-value]


@pytest.mark.parametrize("rec", HONEST_FANS.values(), ids=HONEST_FANS)
def test_every_honest_way_of_answering_is_met(rec: Recording) -> None:
    """Each temperature, on change, on timers up to a second, and a timer that still has the old one at that instant."""
    for finding in both(rec):
        assert finding.credit == 1, finding.reason


@pytest.mark.parametrize("name", WRONG_FANS)
@pytest.mark.parametrize("way", [each_speed, on_change, lambda r: timed(r, 0.5), lambda r: timed(r, 1.0, lag=0.001)])
def test_every_wrong_rule_loses_the_side_it_gets_wrong(name: str, way: Callable[[Rule], Recording]) -> None:
    """Whatever the way of answering."""
    rule, expected = WRONG_FANS[name]
    assert earned(way(rule)) == expected


def low_and_high(at_change_only: bool, last: float) -> Recording:
    """Publishes 0 and 100 at each temperature, or at each new one, whatever it is."""
    rec = scripted()
    for k in range(80):
        if k % 10 == 0 or not at_change_only:
            rec.number(0.5 + 0.2 * k, "/fan_speed", 100.0 - last).number(0.5 + 0.2 * k, "/fan_speed", last)
    return rec


@pytest.mark.parametrize("last", [0.0, 100.0])
@pytest.mark.parametrize("at_change_only", [True, False])
def test_two_answers_at_one_instant_are_wrong_on_both_sides(at_change_only: bool, last: float) -> None:
    """The last one is not right by luck; the reason names both."""
    for finding in both(low_and_high(at_change_only, last)):
        assert finding.credit == 0
        assert "0 and 100 are published at the same time" in finding.reason
        assert finding.hint == "publish one answer to each number on /temperature"


def test_answers_that_alternate_are_wrong_on_both_sides() -> None:
    """However close they come to each new temperature."""
    rec = scripted()
    for k in range(8):
        for n in range(4):
            rec.number(0.5 + 2 * k + 0.05 * n, "/fan_speed", 100.0 * (n % 2))
    assert earned(rec) == (0, 0)


def test_the_first_violation_is_named_with_its_temperature() -> None:
    """>= at exactly 25 has its own hint."""
    finding = both(each_speed(WRONG_FANS[">= at 25"][0]))[1]
    assert finding.reason == "t = 2.500 s, /fan_speed: 100 for 25 °C on /temperature, expected 0"
    assert finding.hint == "25 °C itself is not above 25 °C: compare with > and not with >="


@pytest.mark.parametrize(
    ("name", "side", "said"),
    [
        ("inverted", 0, "wrong way round"),
        ("inverted", 1, "wrong way round"),
        ("always on", 1, "100 is the only answer ever given"),
        ("always off", 0, "0 is the only answer ever given"),
    ],
)
def test_wrong_logic_is_recognised(name: str, side: int, said: str) -> None:
    """The reason names inverted and constant answers."""
    assert said in both(each_speed(WRONG_FANS[name][0]))[side].reason


def test_rounding_is_recognised() -> None:
    """Only the temperature just above 25 is wrong: it is cut off."""
    assert "without rounding" in both(each_speed(WRONG_FANS["whole numbers"][0]))[0].hint


def test_an_unsaid_first_state_must_be_said() -> None:
    """Before any message the state is unknown; the first temperature at or below must be answered."""
    on, off = both(on_change(right_speed, 0.0))
    assert on.credit == 1
    assert off.credit == 0
    assert "no answer for 21.7 °C" in off.reason


def test_a_controller_that_stops_answering_loses() -> None:
    """Stuck after 5 s: its last answer does not count for later temperatures."""
    rec = each_speed(right_speed)
    rec.items = [o for o in rec.items if type(o).__name__ != "Message" or o.t_ns < 5_000_000_000]
    assert earned(rec) == (0, 0)
    assert "no answer" in both(rec)[0].reason


def test_a_controller_that_died_carries_no_state() -> None:
    """An exit is the reason, also for one that publishes on change."""
    rec = on_change(right_speed)
    rec.items = [o for o in rec.items if type(o).__name__ != "Message" or o.t_ns < 5_000_000_000]
    on, off = both(rec.crashed(5.0, "ZeroDivisionError: division by zero", 17))
    assert (on.credit, off.credit) == (0, 0)
    assert "fan_controller.py:17: ZeroDivisionError" in on.reason


def test_whole_number_types_are_tried_at_their_own_steps() -> None:
    """25 and 26 as integers."""
    values = (22, 25, 26, 29, 24, 28, 25, 21)
    assert earned(each_speed(right_speed, values)) == (1, 1)
    assert earned(each_speed(lambda v: 100.0 if v > 26 else 0.0, values)) == (0, 1)


@pytest.mark.parametrize(
    ("rec", "said"),
    [
        (scripted().endpoint("subscription", "/temperature", node="/fan"), "/fan subscribes to /temperature"),
        (scripted().endpoint("subscription", "/temp", node="/fan"), "nothing subscribes to /temperature"),
        (
            scripted().endpoint("subscription", "/temperature", durability="transient_local"),
            "transient_local durability, which a volatile publisher does not offer",
        ),
        (scripted().number(1.0, "/fan", 100.0), "/fan_speed: no message"),
        (scripted().number(1.0, "/fanspeed", 100.0), "/fanspeed has 1 message"),
        (scripted().crashed(0.5, "AttributeError: no", 30), "fan_controller.py:30: AttributeError: no"),
        (scripted().message(1.0, "/fan_speed", {"data": "100"}, "std_msgs/msg/String"), "carries no number"),
        (scripted().message(1.0, "/fan_speed", {"data": True}, "std_msgs/msg/Bool"), "carries no number"),
    ],
)
def test_no_answer_at_all_is_explained(rec: Recording, said: str) -> None:
    """Whether it subscribed, what it published instead, how it ended; reported once, and the other side is blocked."""
    for finding in both(rec):
        assert finding.credit == 0
        assert finding.blocked_by == "threshold_response"
        assert said in finding.reason


def test_temperatures_sent_before_it_listened_are_not_asked_for() -> None:
    """A controller that takes 3 s to start answers from then on."""
    rec = scripted().endpoint("subscription", "/temperature", t_s=3.0)
    for k in range(80):
        t = 0.5 + 0.2 * k
        if t >= 3.0:
            rec.number(t, "/fan_speed", right_speed(FAN_VALUES[k // 10]))
    assert earned(rec) == (1, 1)


def test_a_recording_without_the_question_cannot_be_judged() -> None:
    """Nothing above 25 was ever sent."""
    rec = scripted((21.0, 22.0)).number(1.0, "/fan_speed", 0.0)
    with pytest.raises(HarnessError):
        ON.judge(rec.trace())
    with pytest.raises(HarnessError):
        ON.judge(Recording().number(1.0, "/fan_speed", 0.0, FLOAT32).trace())


@given(st.floats(0.0, 0.19))
def test_a_short_delay_changes_nothing(delay: float) -> None:
    """An answer within its own period is an answer."""
    assert earned(each_speed(right_speed, delay=delay)) == (1, 1)


@given(st.floats(0.1, 1.0), st.floats(0.0, 1.0))
def test_any_timer_up_to_a_second_is_met(period: float, phase: float) -> None:
    """Whatever its period and phase."""
    assert earned(timed(right_speed, period, phase, lag=0.001)) == (1, 1)
    assert earned(timed(lambda v: 100.0 - right_speed(v), period, phase, lag=0.001)) == (0, 0)


@pytest.mark.parametrize("lag", [0.6, 1.0, 3.0, 6.2])
def test_answers_that_come_late_are_called_late(lag: float) -> None:
    """They are wrong, but not because of the threshold, so the reason does not mention it."""
    rec = scripted()
    for k in range(80):
        value = held_at(0.5 + 0.2 * k - lag)
        rec.number(0.5 + 0.2 * k, "/fan_speed", right_speed(value if value is not None else FAN_VALUES[0]))
    for finding in both(rec):
        assert finding.credit == 0
        assert f"match what was published {lag} s earlier" in finding.reason
        assert finding.hint == "answer the newest message on /temperature"


@pytest.mark.parametrize("rule", [lambda v: 100.0 if v >= 25 else 0.0, lambda v: 100.0 if v > 26 else 0.0])
def test_a_wrong_limit_is_not_called_late(rule: Rule) -> None:
    """No lag makes those answers right."""
    assert not any("before" in finding.reason for finding in both(each_speed(rule)))


def test_wrong_answers_away_from_the_threshold_do_not_blame_the_comparison() -> None:
    """The hint names the whole rule where 23 °C is answered wrongly; > for >= is not the matter."""
    off = both(each_speed(lambda v: 100.0 if v > 22 else 0.0))[1]
    assert off.credit == 0
    assert off.hint == "publish 100 above 25 °C and 0 at or below it"


def behind(start_s: float, pace_s: float) -> Recording:
    """Answers with the value that it had one input before, or at its own pace."""
    rec = scripted(FAN_VALUES)
    sent = [(0.5 + 0.2 * k, FAN_VALUES[k // 10]) for k in range(10 * len(FAN_VALUES))]
    for k, (t, _) in enumerate(sent):
        rec.number(t if not pace_s else start_s + pace_s * k, "/fan_speed", right_speed(sent[max(0, k - 1)][1]))
    return rec


def test_who_answers_with_each_value_has_to_answer_that_value() -> None:
    """The one before is wrong for as long as it takes the next to come, however soon that is."""
    on, off = both(behind(0.5, 0.0))
    assert (on.credit, off.credit) == (0, 0)
    assert "0 for 25.001" in on.reason


def test_a_timer_may_be_one_value_late() -> None:
    """It does not answer in the instant in which a value comes."""
    on, off = both(behind(0.6, 0.2))
    assert (on.credit, off.credit) == (1, 1)


@given(st.integers(0, 2**32 - 1))
def test_a_text_is_on_the_wrong_side_of_the_limit_with_every_seed(seed: int) -> None:
    """Whoever compares texts, however they are formatted, is wrong about one of the temperatures."""
    file = "fan_controller.py"
    submission = Submission("ada", "./ada", Path("/staged"), "sha256:aa", {file: StudentFile(file, file)})
    (exercise,) = (e for e in builtin_exercises() if e.number == "3")
    (asked,) = (s for s in exercise.scenarios if s.id == "controller_alone")
    planned = plan_scenario(exercise.id, asked, submission, Surroundings(seed, "virtual"))
    values = [value for value, _ in planned.of(PlannedNumbers)[0].numbers]
    for text in (str, "{:.0f}".format, "{:.1f}".format, "{:.2f}".format):
        for limit in ("25", "25.0", "25.00"):
            assert any((text(value) > limit) != (value > 25) for value in values if value != 25)
