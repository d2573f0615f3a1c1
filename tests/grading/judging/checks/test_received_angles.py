"""Angles received in radians, logged in radians and in degrees: rightly in many ways, and wrongly."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import pytest
from tracing import FLOAT64, Recording

from grader.grading.judging.checks.received import LogsValues
from grader.grading.judging.findings import FAULT_KEY
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.trace import ClockKind

DEGREES = 180 / math.pi
CHECK = LogsValues("simple_subscriber.py", "/joint_commands", unit_factors=(1.0, DEGREES))
ANGLES = [0.0, -0.0, 1.0, -1.0, 3.0417, *(round(1.1 * math.sin(0.37 * k + 0.2), 4) for k in range(35))]


def hearing(
    write: Callable[[float], str] | None = None,
    printed: bool = False,
    late_s: float = 0.0,
    when: Callable[[int], bool] = lambda k: True,
    angles: list[float] = ANGLES,
    clock: ClockKind = ClockKind.VIRTUAL,
) -> Recording:
    rec = Recording(6.0, clock, "simple_subscriber.py").log(0.0, "Joint Command Subscriber started")
    rec.endpoint("subscription", "/joint_commands", FLOAT64, "/joint_command_subscriber")
    for k, angle in enumerate(angles):
        rec.deliver(1.0 + 0.1 * k, "/joint_commands", {"data": angle}, FLOAT64)
        text = write(angle) if write is not None and when(k) else ""
        for part in filter(None, text.split("|")):
            at = 1.0 + 0.1 * k + late_s
            rec.line(at, part) if printed else rec.log(at, part)
    return rec


def chapter(angle: float) -> str:
    return f"got {angle:.3f} rad ({angle * 180 / 3.14159:.1f}°)"


RIGHT: dict[str, Callable[[float], str]] = {
    "chapter": chapter,
    "math.degrees": lambda a: f"{a} rad = {math.degrees(a)} deg",
    "short pi, all digits": lambda a: f"{a} rad = {a * 180 / 3.1416} deg",
    "two records": lambda a: f"radians: {a:.4f}|degrees: {math.degrees(a):.2f}",
    "two lines": lambda a: f"rad={a:.2f}\ndeg={math.degrees(a):.1f}",
    "degrees first": lambda a: f"{math.degrees(a):.2f}° ({a:.2f})",
    "whole degrees": lambda a: f"{a:.2f} rad, {round(math.degrees(a))} deg",
    "cut off": lambda a: f"{math.trunc(a * 100) / 100} rad, {int(math.degrees(a))} deg",
    "short": lambda a: f"{a:g} {math.degrees(a):.4g}",
    "scientific": lambda a: f"{a:.3e} rad {math.degrees(a):.3e} deg",
    "signed": lambda a: f"{a:+.3f} / {math.degrees(a):+.1f}",
    "decimal comma": lambda a: f"{a:.3f} rad ({math.degrees(a):.1f} Grad)".replace(".", ","),
    "with a count": lambda a: f"message 17: {a:.3f} rad, {math.degrees(a):.1f}°",
    "as a dictionary": lambda a: str({"rad": a, "deg": math.degrees(a)}),
    "dots": lambda a: f"rad...{a:.3f} deg...{math.degrees(a):.1f}",
    "filled with dots": lambda a: f"{a:.>10.3f} rad {math.degrees(a):.>10.1f} deg",
    "dashes": lambda a: f"rad-{a:.3f} deg-{math.degrees(a):.1f}",
    "wrapped beside": lambda a: f"{a:.3f} rad = {math.degrees(a):.1f} deg = {math.degrees(a) % 360:.1f} deg",
}


@pytest.mark.parametrize("write", RIGHT.values(), ids=RIGHT)
def test_right_conversions_are_met_however_they_are_written(write: Callable[[float], str]) -> None:
    """To the precision printed, in one record or in two."""
    finding = CHECK.judge(hearing(write).trace())
    assert finding.credit == 1, finding.reason
    assert "40 of 40 messages" in finding.reason


def test_a_queue_that_is_emptied_later_leaves_nothing_out() -> None:
    """Up to a second late, with every number there."""
    assert CHECK.judge(hearing(RIGHT["math.degrees"], late_s=0.35).trace()).credit == 1
    assert CHECK.judge(hearing(RIGHT["math.degrees"], late_s=1.2).trace()).credit == 0


def test_the_wall_clock_may_be_a_little_off() -> None:
    """A log may be stamped before its message."""
    assert CHECK.judge(hearing(chapter, late_s=-0.01, clock=ClockKind.WALL).trace()).credit == 1


WRONG: dict[str, tuple[Callable[[float], str], str]] = {
    "only radians": (lambda a: f"angle {a:.3f} rad", "the value in degrees is missing, only the value itself"),
    "only degrees": (lambda a: f"angle {math.degrees(a):.3f}", "the value itself is missing"),
    "gradians": (lambda a: f"{a:.3f} rad ({a * 200 / math.pi:.1f})", "gradians"),
    "inverted": (lambda a: f"{a:.3f} rad ({math.radians(a):.4f})", "inverse"),
    "pi is 3": (lambda a: f"{a:.3f} rad ({a * 180 / 3:.2f})", "3 for pi"),
    "not divided": (lambda a: f"{a:.3f} rad ({a * 180:.1f})", "not divided by pi"),
    "ten times": (lambda a: f"{a:.3f} rad ({math.degrees(a) * 10:.1f})", "instead there is 572.9"),
    "whole radians": (lambda a: f"{int(a)} rad ({math.degrees(a):.1f})", "whole number"),
    "absolute": (lambda a: f"{abs(a):.3f} rad ({abs(math.degrees(a)):.1f})", "sign is lost"),
    "negative, glued": (lambda a: f"rad{-a:.3f} deg{-math.degrees(a):.1f}", "its sign is inverted"),
    "absolute, after dashes": (lambda a: f"rad-{abs(a):.3f} deg-{abs(math.degrees(a)):.1f}", "expected"),
    "negative": (lambda a: f"{-a:.3f} rad ({-math.degrees(a):.1f})", "its sign is inverted"),
    "wrapped": (lambda a: f"{a:.3f} rad ({math.degrees(a) % 360:.1f})", "expected -1 and -57.2958"),
    "constant": (lambda a: "got 0.5 rad (28.6)", "expected"),
    "no number": (lambda a: "got a message", "expected"),
    "nan": (lambda a: f"{a} rad ({math.nan})", "expected"),
}


@pytest.mark.parametrize(("write", "said"), WRONG.values(), ids=WRONG)
def test_wrong_conversions_are_named(write: Callable[[float], str], said: str) -> None:
    """With what was expected and what was found for the first message."""
    finding = CHECK.judge(hearing(write).trace())
    assert finding.credit == 0
    assert said in finding.reason
    assert "expected" in finding.reason


def test_one_message_behind_is_named() -> None:
    """In both units or in one; the last number is missing, and every log has the one before."""
    angles = [*ANGLES[2:], -2.5]
    before = dict(zip(angles, [0.0, *angles], strict=False))
    both = CHECK.judge(hearing(lambda a: chapter(before[a]), angles=angles).trace())
    assert both.credit == 0
    assert "each log has the number of the previous message" in both.reason
    assert "store the number before you log it" in both.hint
    mixed = hearing(lambda a: f"{a:.3f} rad ({math.degrees(before[a]):.1f} deg)", angles=angles)
    assert CHECK.judge(mixed.trace()).credit == 0


@pytest.mark.parametrize(
    ("write", "credit"),
    [
        (lambda a: f"{math.degrees(a):.2f} rad ({a:.3f} deg)", 0),
        (lambda a: f"{math.degrees(a):.2f} Radians|{a:.3f}°", 0),
        (lambda a: f"{math.degrees(a):.3f} rad = {a:.1f} deg", 0),
        (lambda a: f"{a:.3f} rad ({math.degrees(a):.2f} deg)", 1),
        (lambda a: f"rad {a:.3f} deg {math.degrees(a):.2f}", 1),
        (lambda a: f"deg {math.degrees(a):.2f} rad {a:.3f}", 1),
        (lambda a: f"{a:.3f} {math.degrees(a):.2f}", 1),
        (lambda a: f"{math.degrees(a):.2f} deg = {a:.3f} rad; {math.degrees(a):.0f} rad is wrong", 1),
    ],
)
def test_units_that_are_swapped_are_no_conversion(write: Callable[[float], str], credit: int) -> None:
    """Only where each number is followed by the other's unit; no unit is asked for."""
    units = {"rad": 1.0, "deg": DEGREES, "\u00b0": DEGREES}
    check = LogsValues("simple_subscriber.py", "/joint_commands", unit_factors=(DEGREES,), units=units)
    finding = check.judge(hearing(write, angles=ANGLES[2:]).trace())
    assert finding.credit == credit, finding.reason
    assert credit == 1 or "are swapped at every message" in finding.reason


def test_messages_that_are_left_out_are_counted() -> None:
    """Every tenth is not each; a share is enough if the rubric allows it."""
    rec = hearing(chapter, when=lambda k: k % 2 == 0)
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 0
    assert "20 of 40 messages of /joint_commands are not logged correctly" in finding.reason
    assert "once for each message" in CHECK.judge(hearing(chapter, when=lambda k: k % 10 == 0).trace()).hint
    half = LogsValues("simple_subscriber.py", "/joint_commands", unit_factors=(1.0, DEGREES), share=0.5)
    assert half.judge(rec.trace()).credit == 1


def test_printing_is_half() -> None:
    """Also where some are logged and the rest is printed."""
    finding = CHECK.judge(hearing(chapter, printed=True).trace())
    assert finding.credit == Fraction(1, 2)
    assert "self.get_logger().info" in finding.hint
    mixed = hearing(chapter, when=lambda k: k < 20)
    for k, angle in enumerate(ANGLES[20:], 20):
        mixed.line(1.0 + 0.1 * k, chapter(angle))
    assert CHECK.judge(mixed.trace()).credit == Fraction(1, 2)
    assert CHECK.judge(hearing(WRONG["gradians"][0], printed=True).trace()).credit == 0


def test_a_crash_is_the_reason_and_nothing_sent_is_ours() -> None:
    """Before the first message or between two."""
    early = Recording(6.0, process="simple_subscriber.py").crashed(0.0)
    assert FAULT_KEY in CHECK.judge(early.trace()).evidence
    later = hearing(chapter, when=lambda k: k < 20).crashed(3.05)
    finding = CHECK.judge(later.trace())
    assert (finding.credit, FAULT_KEY in finding.evidence) == (0, True)
    deaf = Recording(6.0).endpoint("subscription", "/joint_commands", FLOAT64)
    with pytest.raises(HarnessError):
        CHECK.judge(deaf.trace())


def test_no_subscription_is_explained() -> None:
    """The nearest one is named."""
    rec = Recording(6.0).endpoint("subscription", "/joint_command", FLOAT64)
    assert "/joint_command" in CHECK.judge(rec.trace()).reason
    assert CHECK.judge(Recording().trace()).credit == 0


def test_plain_values_are_asked_by_default() -> None:
    """Without factors, the value itself."""
    check = LogsValues("simple_subscriber.py", "/joint_commands")
    assert check.judge(hearing(WRONG["only radians"][0]).trace()).credit == 1
    assert check.judge(hearing(WRONG["only degrees"][0]).trace()).credit == 0


def test_messages_without_a_log_are_said_to_have_none() -> None:
    """Every other message is logged, rightly: no factor explains what is missing."""
    finding = CHECK.judge(hearing(chapter, when=lambda k: k % 2 == 0).trace())
    assert finding.credit == 0
    assert finding.reason.endswith("found no log; nothing is logged for 20 of the messages"), finding.reason
    assert "instead" not in finding.reason
