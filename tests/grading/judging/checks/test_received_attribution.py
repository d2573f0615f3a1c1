"""Logged numbers among other numbers: any fixed way of writing shows a value, a list of all numbers shows none."""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Callable, Iterable
from fractions import Fraction

import pytest
from tracing import FLOAT32, FLOAT64, Recording, held_at, scripted

from grader.grading.judging.checks.received import LogsReceived, LogsValues

SPEEDS = (100.0, 0.0, 63.271, 17.448, 100.0)
SPEED = LogsReceived("temperature_sensor.py", "/fan_speed")
ANGLES = [0.731, -0.412, 0.5, 2.817, -math.pi / 2, -1.934] * 2
ANGLE = LogsValues("simple_subscriber.py", "/joint_commands", unit_factors=(1.0, 180 / math.pi))

Write = Callable[[int, float], Iterable[str]]


def speeds(write: Write, printed: bool = False) -> Recording:
    """A sensor that writes texts at each of 50 messages; its number and its value are known to the writer."""
    rec = scripted(SPEEDS, "/fan_speed", 12.2)
    rec.process = "temperature_sensor.py"
    rec.endpoint("subscription", "/fan_speed", FLOAT32, "/temperature_sensor")
    for k in range(50):
        t = 0.5 + 0.2 * k
        for text in write(k, held_at(t, SPEEDS) or 0.0):
            (rec.line if printed else rec.log)(t, text)
    return rec


def angles(write: Write) -> Recording:
    """A subscriber that writes texts at each of 12 angles."""
    rec = Recording(12.0, process="simple_subscriber.py").endpoint("subscription", "/joint_commands", FLOAT64)
    for k, angle in enumerate(ANGLES):
        rec.deliver(5.0 + 0.5 * k, "/joint_commands", {"data": angle}, FLOAT64)
        for text in write(k, angle):
            rec.log(5.0 + 0.5 * k, text)
    return rec


def history(length: int | None) -> Write:
    seen: deque[float] = deque(maxlen=length)

    def write(_k: int, value: float) -> list[str]:
        seen.append(round(value, 1))
        return [f"so far: {list(seen)}"]

    return write


def newest_first(_k: int, value: float, seen: deque[float] = deque(maxlen=8)) -> list[str]:  # noqa: B006
    seen.appendleft(value)
    return ["speeds " + " ".join(f"{v:.1f}" for v in seen)]


def words(_k: int, value: float) -> list[str]:
    if value in (0, 100):
        return ["the fan stands still (0 %)" if value == 0 else "full power: 100 percent"]
    return [f"fast, {value:.1f} %" if value > 50 else f"slowly, at {value:.1f} %"]


TEMPERATURES = random.Random(3)

RIGHT: dict[str, Write] = {
    "a row of a table": lambda k, v: [f"{k},{1764000000 + k},{20 + k % 10},{v:.2f},0,1,2,3,4,5,6,7,8,9,10"],
    "many fields": lambda k, v: [f"n={k} t={0.2 * k:.1f} s fan={v:.1f} % limits 0..100 of {list(range(30))}"],
    "a history": history(None),
    "the last ten": history(10),
    "the newest first": newest_first,
    "a word for each range": words,
    "a bar": lambda _k, v: ["fan |" + "#" * int(v / 5) + " " * (20 - int(v / 5)) + f"| {v:.0f} %"],
    "a number in a name": lambda k, v: [f"reading{k}: {v}"],
    "a date": lambda k, v: [f"2026-11-22 12:{30 + k // 30}:{2 * k % 60:02d}.{k}00 fan {v:.1f}"],
    "in three lines": lambda k, v: [f"message {k}\n  speed: {v}\n  share: {v / 100}"],
    "two records": lambda k, v: [f"message {k} came", f"its speed is {v}"],
    "the same call for both": lambda _k, v: [f"{TEMPERATURES.uniform(20, 30):.1f}", f"{v:.1f}"],
    "only when it changes": lambda k, v: [f"fan {v:.0f}"] if k % 10 == 0 else [f"it is {20 + k % 7} degrees"],
    "no space before it": lambda _k, v: [f"the fan speed is{v:.0f}"],
    "an underscore before it": lambda _k, v: [f"fan_speed_{v:.0f}"],
    "a dash before it": lambda _k, v: [f"fan-{v:.1f}"],
    "dots before it": lambda _k, v: [f"fan speed...{v:.0f}"],
    "beside other names": lambda k, v: [f"fan1 of robot2 on port3 runs at speed{v:.0f}, message{k}"],
    "from and to": lambda k, v: [f"fan {SPEEDS[max(0, k // 10 - 1)]:.0f} -> {v:.0f}"],
}
WRONG: dict[str, Write] = {
    "all numbers": lambda _k, _v: ["fan speed: " + " ".join(map(str, range(101)))],
    "a record for each number": lambda _k, _v: [f"fan speed: {n}" for n in range(101)],
    "shuffled": lambda k, _v: ["fan: " + " ".join(map(str, random.Random(k).sample(range(101), 101)))],
    "each with a word of its own": lambda _k, _v: [f"fan {letters(n)}: {n}" for n in range(101)],
    "never the same words": lambda k, _v: [f"{letters(k)}: " + " ".join(map(str, range(101)))],
    "never the same record": lambda k, _v: [f"{letters(101 * k + n)}: {n}" for n in range(101)],
    "ten a message": lambda k, _v: [f"{letters(k)}: 0 100 " + " ".join(str(n) for n in range(k % 10, 101, 10))],
    "all numbers, each after a word": lambda _k, _v: [" ".join(f"fan{n}" for n in range(101))],
    "a record for each, after a word": lambda _k, _v: [f"fan{n}" for n in range(101)],
    "counting": lambda k, _v: [f"fan speed: {(7 * k + n) % 101}" for n in range(7)],
}


def letters(n: int) -> str:
    """A word of its own for each number, no letter of which comes twice in a row."""
    return "".join("abcdef"[n // 6**place % 6] + "xyz"[place % 3] for place in range(5))


@pytest.mark.parametrize("write", RIGHT.values(), ids=RIGHT)
def test_any_fixed_way_of_writing_shows_the_speed(write: Write) -> None:
    """The number of other numbers does not matter; printing gives half the points."""
    finding = SPEED.judge(speeds(write).trace())
    assert finding.credit == 1, finding.reason
    assert SPEED.judge(speeds(write, printed=True).trace()).credit == Fraction(1, 2)


@pytest.mark.breadth(2, 10)
@pytest.mark.parametrize("write", WRONG.values(), ids=WRONG)
def test_numbers_that_are_written_whatever_comes_show_no_speed(write: Write) -> None:
    """The reason counts the other numbers, and the hint tells what to do; printing does not help."""
    finding = SPEED.judge(speeds(write).trace())
    assert finding.credit == 0
    assert "values of /fan_speed are lost among other numbers" in finding.reason
    assert "numbers written meanwhile" in finding.reason
    assert finding.hint.startswith("log the number received on /fan_speed")
    assert SPEED.judge(speeds(write, printed=True).trace()).credit == 0


RIGHT_ANGLES: dict[str, Write] = {
    "many fields": lambda k, a: [f"{k} {a:.3f} rad {math.degrees(a):.1f} deg of {list(range(-180, 181, 10))}"],
    "a history": lambda k, _a: [
        f"rad {[round(b, 2) for b in ANGLES[: k + 1]]}",
        f"deg {[round(math.degrees(b), 1) for b in ANGLES[: k + 1]]}",
    ],
    "the same call for both": lambda _k, a: [f"{a:.3f}", f"{math.degrees(a):.1f}"],
    "a word for the side": lambda _k, a: [f"{'left' if a > 0 else 'right'} {a:.2f} rad = {math.degrees(a):.0f} deg"],
    "turns and gradians too": lambda _k, a: [
        f"{a / math.tau:.3f} {a:.3f} {math.degrees(a):.1f} {a * 200 / math.pi:.1f}"
    ],
}


@pytest.mark.parametrize("write", RIGHT_ANGLES.values(), ids=RIGHT_ANGLES)
def test_any_fixed_way_of_writing_shows_the_angle(write: Write) -> None:
    """In radians and in degrees."""
    finding = ANGLE.judge(angles(write).trace())
    assert finding.credit == 1, finding.reason


def tenths(low: int, high: int) -> str:
    return " ".join(f"{n / 10:.1f}" for n in range(low, high))


WRONG_ANGLES: dict[str, Write] = {
    "all numbers": lambda _k, _a: (
        [f"rad {tenths(-32, 33)}"] + [f"deg {' '.join(map(str, range(low, low + 90)))}" for low in (-180, -90, 0, 90)]
    ),
    "a record for each": lambda _k, _a: [f"angle {n}" for n in (*tenths(-32, 33).split(), *range(-180, 181))],
    "never the same words": lambda k, _a: (
        [f"{letters(k)} {tenths(-32, 33)}"]
        + [f"{letters(k)} deg {' '.join(map(str, range(low, low + 90)))}" for low in (-180, -90, 0, 90)]
    ),
}


@pytest.mark.parametrize("write", WRONG_ANGLES.values(), ids=WRONG_ANGLES)
def test_numbers_that_are_written_whatever_comes_show_no_angle(write: Write) -> None:
    """In as many records as it takes."""
    finding = ANGLE.judge(angles(write).trace())
    assert finding.credit == 0
    assert "12 of 12 messages of /joint_commands are lost among other numbers" in finding.reason
