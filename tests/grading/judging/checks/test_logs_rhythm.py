"""One log for every tenth message: right in many ways, and missed by too many, too few, printed and none."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import pytest
from tracing import FLOAT64, Recording

from grader.grading.judging.checks.logs import LogsEvery
from grader.grading.judging.findings import FAULT_KEY
from grader.runtime.model.trace import ClockKind

CHECK = LogsEvery("simple_publisher.py", "/joint_commands", 10)
Writes = Callable[[int, float], str]


def written(
    write: Writes,
    when: Callable[[int], bool] = lambda n: n % 10 == 0,
    count: int = 100,
    severity: str = "INFO",
    printed: bool = False,
    clock: ClockKind = ClockKind.VIRTUAL,
    early_s: float = 0.0,
) -> Recording:
    """A publisher that started with a log, and writes at some of its messages; empty texts are not written."""
    rec = Recording(10.1, clock, "simple_publisher.py").log(0.0, "joint publisher is up")
    for n in range(count):
        value = math.sin(0.1 * n)
        rec.number(0.1 + 0.1 * n, "/joint_commands", value, FLOAT64)
        text = write(n, value) if when(n) else ""
        for part in filter(None, text.split("|")):
            at = 0.1 + 0.1 * n - early_s
            rec.line(at, part) if printed else rec.log(at, part, severity)
    return rec


def chapter(n: int, value: float) -> str:
    return f"sent {value:.3f} rad"


RIGHT = {
    "chapter": written(chapter),
    "tenth, twentieth": written(chapter, lambda n: n % 10 == 9),
    "not the first": written(chapter, lambda n: n > 0 and n % 10 == 0),
    "count only": written(lambda n, v: f"{n} messages published"),
    "no number": written(lambda n, v: "ten more messages"),
    "two records": written(lambda n, v: f"message {n}|angle {v:.2f}"),
    "two lines": written(lambda n, v: f"message {n}\nangle = {v}"),
    "with the direction": written(lambda n, v: f"{'rising' if math.cos(n / 10) > 0 else 'falling'}: {v:.4f}"),
    "as a warning": written(chapter, severity="WARN"),
    "decimal comma": written(lambda n, v: f"Winkel {v:.3f}".replace(".", ",")),
    "degrees": written(lambda n, v: f"{math.degrees(v):.1f} deg"),
    "a gap of eleven": written(chapter, lambda n: n in (0, 10, 20, 31, 40, 50, 60, 70, 80, 90)),
    "ends before the next": written(chapter, count=99),
    "wall clock, before publishing": written(chapter, clock=ClockKind.WALL, early_s=0.004),
    "two rare others": written(chapter).log(3.35, "parameters read").log(7.77, "still 12 alive"),
    "crashed later": written(chapter, count=50).crashed(5.1),
}


@pytest.mark.parametrize("rec", RIGHT.values(), ids=RIGHT)
def test_one_log_for_ten_messages_is_met(rec: Recording) -> None:
    """With any wording, and starting at any message."""
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 1, finding.reason


def test_the_reason_holds_count_and_text() -> None:
    """As the student wrote it."""
    reason = CHECK.judge(RIGHT["chapter"].trace()).reason
    assert reason.startswith("simple_publisher.py: logged 10 times, one for 10 messages on /joint_commands: sent")


WRONG = {
    "every message": (written(chapter, lambda n: True), "for 100 of 100 messages"),
    "every message, and others": (
        written(chapter, lambda n: True).log(3.0, "go to the kitchen").log(4.0, "0.5 rad").log(5.0, "0.6 rad"),
        "for 100 of 100 messages",
    ),
    "every second": (written(chapter, lambda n: n % 2 == 0), "for 50 of 100 messages"),
    "every fifth": (written(chapter, lambda n: n % 5 == 0), "one for 5 messages"),
    "every ninth": (written(chapter, lambda n: n % 9 == 0), "one for 9 messages"),
    "every eleventh": (written(chapter, lambda n: n % 11 == 0), "one for 11 messages"),
    "every hundredth": (written(chapter, lambda n: n % 100 == 0), "only with message 1"),
    "nothing": (written(lambda n, v: ""), "nothing is logged"),
    "stops halfway": (written(chapter, lambda n: n % 10 == 0 and n < 50), "none after message 41"),
    "begins late": (written(chapter, lambda n: n % 10 == 0 and n > 40), "none before message 51"),
    "one missing": (written(chapter, lambda n: n % 10 == 0 and n != 50), "one for 11.25 messages"),
    "each and every tenth": (
        written(lambda n, v: f"sent{'|angle ' + str(v) if n % 10 == 0 else ''}", lambda n: True),
        "for 100 of 100 messages",
    ),
    "logged after the end": (written(lambda n, v: "").log(12.0, "Publishing 0.1"), "nothing is logged"),
}


@pytest.mark.parametrize(("rec", "said"), WRONG.values(), ids=WRONG)
def test_another_rhythm_is_not(rec: Recording, said: str) -> None:
    """The reason names it, and the expected value."""
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 0
    assert said in finding.reason
    assert "one log for every 10 messages" in finding.reason
    assert finding.hint


def test_printing_in_the_rhythm_is_half() -> None:
    """The hint tells how to log; printing at another rate earns nothing."""
    finding = CHECK.judge(written(chapter, printed=True).trace())
    assert finding.credit == Fraction(1, 2)
    assert "self.get_logger().info" in finding.hint
    assert CHECK.judge(written(chapter, lambda n: True, printed=True).trace()).credit == 0
    assert CHECK.judge(written(chapter, lambda n: n % 7 == 0, printed=True).trace()).credit == 0


def test_a_crash_before_it_could_be_seen_is_the_reason() -> None:
    """Without a crash, the rate is."""
    crashed = CHECK.judge(written(chapter, count=15).crashed(1.6).trace())
    assert crashed.credit == 0
    assert FAULT_KEY in crashed.evidence
    assert CHECK.judge(written(chapter, count=15).trace()).blocked_by == "topic_rate"
    assert CHECK.judge(Recording().trace()).blocked_by == "publishes"


def test_every_second_message_can_be_asked_for() -> None:
    """Small distances leave no room for a gap that is off by one."""
    check = LogsEvery("simple_publisher.py", "/joint_commands", 2)
    assert check.judge(written(chapter, lambda n: n % 2 == 1).trace()).credit == 1
    assert check.judge(written(chapter, lambda n: True).trace()).credit == 0
    assert check.judge(written(chapter, lambda n: n % 3 == 0).trace()).credit == 0
