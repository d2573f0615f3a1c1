"""Logged positions, right and wrong, in the wordings of real people."""

from __future__ import annotations

import itertools
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracing import ODOM_TIMES, drive, driving, pose_at, position_logs
from wordings import RIGHT, WRONG, Writer, plain

from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import ClockKind, FaultKind

POSITION = known_checks()["logs_position"]("odom_subscriber.py", "/odom")
PERIOD = known_checks()["log_period"]("odom_subscriber.py", "/odom", NS_PER_S)
HALF = Fraction(1, 2)


@pytest.mark.parametrize("write", RIGHT.values(), ids=RIGHT)
def test_a_right_position_counts_however_it_is_worded(write: Writer) -> None:
    """Logged it is full credit, with its period; printed it is half."""
    logged = position_logs(write).trace()
    assert POSITION.judge(logged).credit == 1, POSITION.judge(logged).reason
    assert PERIOD.judge(logged).credit == 1, PERIOD.judge(logged).reason
    printed = POSITION.judge(position_logs(write, printed=True).trace())
    assert printed.credit == HALF, printed.reason
    assert "get_logger" in printed.hint


@pytest.mark.parametrize("write", RIGHT.values(), ids=RIGHT)
def test_a_position_of_other_times_never_counts(write: Writer) -> None:
    """The same wording with the poses of 3 s before earns nothing."""
    rec = driving()
    for k in range(13):
        texts = write(*pose_at(5.5 + k)[:2])
        for text in [texts] if isinstance(texts, str) else texts:
            rec.log(8.5 + k, text)
    assert POSITION.judge(rec.trace()).credit == 0


@pytest.mark.parametrize(("write", "cause"), WRONG.values(), ids=WRONG)
def test_a_wrong_position_earns_nothing_and_is_named(write: Writer, cause: str) -> None:
    """Each mistake is recognised for what it is, logged or printed."""
    for printed in (False, True):
        finding = POSITION.judge(position_logs(write, printed=printed).trace())
        assert finding.credit == 0
        assert finding.evidence["cause"] == cause, finding.reason


@pytest.mark.parametrize(
    ("write", "credit"),
    [
        (lambda x, y: f"x={x:.0f}, y={y:.0f}", Fraction(1, 2)),
        (lambda x, y: f"x={round(x)} y={round(y)}", Fraction(1, 2)),
        (lambda x, y: f"x={x:.1f}, y={y:.1f}", 1),
        (lambda x, y: f"x={x:.2f}, y={y:.2f}".replace(".", ","), 1),
        (lambda x, y: f"x={100 * x:.0f} cm, y={100 * y:.0f} cm", 1),
        (lambda x, y: f"x={x:.0f}, y={y:.0f} (exactly x={x:.3f}, y={y:.3f})", 1),
    ],
)
def test_whole_metres_are_half(write: Writer, credit: Fraction) -> None:
    """But for whole centimetres, a decimal comma, or decimals beside them."""
    finding = POSITION.judge(position_logs(write, [6.0 + k for k in range(12)]).trace())
    assert finding.credit == credit, finding.reason
    assert ("have no decimals" in finding.reason) == (credit != 1)


def test_an_example_of_an_inverted_sign_shows_it() -> None:
    """At first y is nearly 0: nothing is wrong to see there."""
    finding = POSITION.judge(position_logs(WRONG["sign of y"][0], [12.55 + k / 2 for k in range(12)]).trace())
    assert finding.evidence["cause"] == "sign"
    assert "inverted: at t = 13.050 s" in finding.reason


def test_swapped_positions_keep_their_period() -> None:
    """What is wrong with the values does not cost the period."""
    assert PERIOD.judge(position_logs(WRONG["swapped"][0]).trace()).credit == 1


@pytest.mark.parametrize(
    ("cause", "text"),
    [
        ("twist", "x={3:.3f}, y=0.000"),
        ("twist", "linear {3:.3f} angular {4:.3f}"),
        ("orientation", "x={6:.3f}, y={7:.3f}"),
        ("first_value", "x={8:.2f}, y={9:.2f}"),
    ],
)
def test_values_of_other_fields_are_recognised(cause: str, text: str) -> None:
    """Velocities, quaternion parts and the first message's position are named as such."""
    import math

    rec = driving()
    for k in range(15):
        heading = pose_at(6.0 + k)[2]
        values = (*pose_at(6.0 + k), None, math.sin(heading / 2), math.cos(heading / 2), *drive(5.0)[:2])
        rec.log(6.0 + k, text.format(*values))
    finding = POSITION.judge(rec.trace())
    assert (finding.credit, finding.evidence["cause"]) == (0, cause), finding.reason


def test_positions_that_lag_are_said_to_lag() -> None:
    """A node that works through a long queue logs old poses; the reason tells by how much."""
    rec = driving()
    for k in range(13):
        rec.log(8.0 + k, plain(*pose_at(6.0 + k)[:2]))
    finding = POSITION.judge(rec.trace())
    assert finding.credit == 0
    assert finding.evidence["cause"] == "stale"
    assert "2.0 s old" in finding.reason


def test_a_slow_loop_that_reads_a_short_queue_is_right() -> None:
    """A pose replaced 0.4 s ago still counts: spin_once once a second on a queue of ten."""
    rec = driving()
    for k in range(15):
        rec.log(6.0 + k, plain(*pose_at(5.6 + k)[:2]))
    assert POSITION.judge(rec.trace()).credit == 1


def test_one_log_for_every_message_is_right_in_values_and_wrong_in_period() -> None:
    """429 right positions: full credit for the values, none for the period, with the reason."""
    trace = position_logs(plain, ODOM_TIMES).trace()
    assert POSITION.judge(trace).credit == 1
    finding = PERIOD.judge(trace)
    assert finding.credit == 0
    assert "27 logs a second: one for every message" in finding.reason
    assert "throttle_duration_sec" in finding.hint


def test_a_standing_robot_costs_nothing() -> None:
    """Constant poses are not mistaken for a constant log."""
    assert POSITION.judge(position_logs(plain, standing=True).trace()).credit == 1


def test_a_single_right_log_is_wrong_in_period_only() -> None:
    """A position logged once in 16 s is the position; that it never comes again is the period's business."""
    trace = position_logs(plain, [6.0]).trace()
    assert POSITION.judge(trace).credit == 1
    assert PERIOD.judge(trace).credit == 0


def test_what_is_written_before_the_first_message_is_free() -> None:
    """Defaults and waiting lines before the data, and at the very instant at which it comes, cost nothing."""
    rec = position_logs(plain)
    for k in range(6):
        rec.log(float(k), "x=0.00 y=0.00")
        rec.log(k + 0.5, "waiting for /odom")
    assert POSITION.judge(rec.trace()).credit == 1
    assert PERIOD.judge(rec.trace()).credit == 1


def test_positions_before_the_first_message_do_not_count() -> None:
    """A node that happens to write the coming positions beforehand earns nothing."""
    rec = driving()
    for k in range(4):
        rec.log(float(k), plain(*drive(5.0 + k)[:2]))
    finding = POSITION.judge(rec.trace())
    assert finding.credit == 0
    assert finding.evidence["cause"] == "nothing"


def test_one_wrong_log_among_right_ones_is_found() -> None:
    """All logs of the template must be right; the first that is not is quoted with its time."""
    rec = position_logs(plain, [6.0 + k for k in range(9)])
    rec.log(15.0, plain(9.9, 9.9))
    finding = POSITION.judge(rec.trace())
    assert finding.credit == 0
    assert "t = 15.000 s" in finding.reason
    assert "9.90" in finding.reason


def test_other_logs_with_two_numbers_cost_nothing() -> None:
    """Velocities and counters beside right positions are other templates."""
    rec = position_logs(plain)
    for k in range(18):
        rec.log(6.0 + k, f"linear 0.35 angular {0.2 + k / 100:.2f}")
        rec.log(6.3 + k, f"message {k} of {k * 27}")
    assert POSITION.judge(rec.trace()).credit == 1


def test_lines_of_one_message_on_the_wall_clock_are_one_block() -> None:
    """Three records some microseconds apart belong together."""
    rec = driving()
    rec.clock = ClockKind.WALL
    for k in range(15):
        x, y, *_ = pose_at(6.0 + k)
        rec.log(6.0 + k, f"X: {x:.2f}").log(6.0002 + k, f"Y: {y:.2f}").log(6.0004 + k, "Z: 0.00")
    assert POSITION.judge(rec.trace()).credit == 1
    assert PERIOD.judge(rec.trace()).credit == 1


def test_nothing_logged_is_said_plainly() -> None:
    """Silence has its own reason, and no period to judge."""
    finding = POSITION.judge(driving().trace())
    assert finding.credit == 0
    assert "nothing was logged while /odom was played for 16.0 s" in finding.reason
    assert PERIOD.judge(driving().trace()).blocked_by == "logs_position"


def test_a_crash_while_waiting_blocks_the_positions() -> None:
    """What ended the node before any data came is another criterion's business."""
    rec = driving().crashed(1.0, "AttributeError: 'NoneType' object has no attribute 'pose'", 20)
    finding = POSITION.judge(rec.trace())
    assert finding.blocked_by == "waits_gracefully"
    assert finding.location is not None
    assert finding.location.line == 20


def test_a_crash_at_the_first_message_is_the_reason() -> None:
    """An exception in the callback is named with its line."""
    rec = driving().crashed(5.0, "AttributeError: 'Odometry' object has no attribute 'position'", 20)
    finding = POSITION.judge(rec.trace())
    assert finding.blocked_by is None
    assert finding.reason.startswith("odom_subscriber.py:20: AttributeError")


@pytest.mark.parametrize(
    "text", ["\x1b]0;x\x07", "x=" + "9" * 5000, "[red]x=1[/red]", "\u202ex=1 y=2", "\ud800 1 2", "1e999 1e-999"]
)
def test_hostile_texts_are_judged(text: str) -> None:
    """No text can raise, and none earns."""
    rec = driving()
    for k in range(10):
        rec.log(6.0 + k, text)
    assert POSITION.judge(rec.trace()).credit == 0
    assert PERIOD.judge(rec.trace()).credit in (0, 1)


@given(st.sampled_from(sorted(RIGHT)), st.integers(0, 999), st.floats(0.9, 1.1))
def test_right_positions_are_right_at_any_times(name: str, offset_ms: int, period: float) -> None:
    """Neither the phase of the timer nor a period of 1 s ± 10 % changes anything."""
    times = list(itertools.takewhile(lambda t: t < 24, (5.04 + offset_ms / 1000 + k * period for k in range(30))))
    trace = position_logs(RIGHT[name], times).trace()
    assert POSITION.judge(trace).credit == 1
    assert PERIOD.judge(trace).credit == 1


@given(st.sampled_from(sorted(RIGHT)), st.floats(-40, 40), st.floats(-40, 40))
def test_positions_of_another_place_never_count(name: str, dx: float, dy: float) -> None:
    """A fixed offset of more than the precision earns nothing in any wording."""
    if max(abs(dx), abs(dy)) < 2.5:
        dx += 5.0
    trace = position_logs(lambda x, y: RIGHT[name](x + dx, y + dy)).trace()
    assert POSITION.judge(trace).credit == 0


def test_an_exit_in_the_middle_is_the_reason_for_a_broken_period() -> None:
    """If logs stop because the process ended, the reason mentions it."""
    rec = position_logs(plain, [6.0 + k for k in range(5)]).exited(10.5)
    finding = PERIOD.judge(rec.trace())
    assert finding.credit == 0
    assert "exited after 10.5 s with code 0" in finding.reason
    assert finding.evidence["fault"]["kind"] == FaultKind.EXITED.value


def _word(n: int) -> str:
    return "".join("abcdefgh"[n // 8**place % 8] + "xyz"[place % 3] for place in range(4))


def _never_the_same(numbers: str) -> Writer:
    words = (_word(n) for n in itertools.count())
    return lambda _x, _y: f"{next(words)}: {numbers}"


GUESSES = {
    "whole metres": _never_the_same(" ".join(str(n) for n in range(-3, 4)) + " / -3 -2 -1 0 1 2 3"),
    "labelled": _never_the_same(" ".join(f"x={x} y={y}" for x in range(-3, 3) for y in range(-2, 3))),
    "tenths": _never_the_same(" ".join(f"{n / 4:.1f}" for n in range(-10, 10))),
}


@pytest.mark.parametrize("write", GUESSES.values(), ids=GUESSES)
def test_many_numbers_in_texts_that_are_never_the_same_show_no_position(write: Writer) -> None:
    """Some pair of them is right at each instant, and always another one."""
    finding = POSITION.judge(position_logs(write).trace())
    assert finding.credit == 0
    assert finding.evidence["cause"] in ("chance", "wrong")


def test_a_growing_list_of_positions_shows_the_newest() -> None:
    """Each of its texts is a template of its own, and few positions are that fine by chance."""
    path: list[tuple[float, float]] = []

    def write(x: float, y: float) -> str:
        path.append((round(x, 2), round(y, 2)))
        return f"x, y so far, the newest first: {path[::-1][:6]}"

    assert POSITION.judge(position_logs(write).trace()).credit == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x={y:.3f} y={x:.3f}", "x and y are swapped"),
        ("x={x:.3f} y=0.000", "the second value fits z of the position, not y"),
    ],
)
def test_wrong_positions_are_shown_beside_the_right_ones(text: str, said: str) -> None:
    """The first log that is settled, with its time, and where the robot was."""
    times = [6.0 + k for k in range(14)]
    finding = POSITION.judge(position_logs(lambda x, y: text.format(x=x, y=y), times).trace())
    assert finding.reason.startswith(f"odom_subscriber.py: {said}: at t = 6.000 s the log says 'x=")
    assert finding.reason.endswith(") m")
