"""Whether a program did the same on two clocks: what differs is found, and what chance and the clock explain is not."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import pytest

from grader.grading.judging.agreement import Aspect, differences, sentence
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import ClockKind, FaultKind
from grader.testing import TraceBuilder

TWIST, FLOAT = "geometry_msgs/msg/Twist", "std_msgs/msg/Float32"
#: Adds to a recording what a program does; the number is that of the run.
Program = Callable[[TraceBuilder, int], TraceBuilder]


def virtual(stop_s: float = 10.0) -> TraceBuilder:
    return TraceBuilder("a.py", stop_s=stop_s)


def wall(stop_s: float = 6.0) -> TraceBuilder:
    return TraceBuilder("a.py", stop_s=stop_s, clock=ClockKind.WALL)


def publishing(
    builder: TraceBuilder,
    value: Callable[[float, random.Random], float] | float,
    *,
    rate_hz: float = 20.0,
    start_s: float = 0.0,
    stop_s: float | None = None,
    topic: str = "/x",
    seed: int = 0,
    jitter_s: float = 0.0,
) -> TraceBuilder:
    """Add messages whose number is `value`, or what it gives for the time of the message."""
    chance = random.Random(seed)
    t_s = start_s
    while t_s < (builder.stop_s if stop_s is None else stop_s):
        at_s = t_s + chance.uniform(0, jitter_s)
        builder.message(at_s, topic, FLOAT, {"data": value(at_s, chance) if callable(value) else value})
        t_s += 1 / rate_hz
    return builder


def aspects(one: TraceBuilder, other: TraceBuilder, first_message_on: str = "") -> list[Aspect]:
    return [d.aspect for d in differences(one.trace(), other.trace(), first_message_on)]


AGREE: dict[str, Program] = {
    "a constant": lambda b, s: publishing(b, 0.5),
    "random numbers": lambda b, s: publishing(b, lambda t, chance: chance.uniform(20, 30), seed=s),
    "random decisions": lambda b, s: publishing(b, lambda t, chance: float(chance.choice((0, 100))), seed=s),
    "a counter": lambda b, s: publishing(b, lambda t, chance: round(t * 20)),
    "a sine over the time of day": lambda b, s: publishing(b, lambda t, chance: math.sin(t + 1000 * s)),
    "jitter": lambda b, s: publishing(b, 0.5, jitter_s=0.03 * s, seed=s),
    "a measured pause": lambda b, s: publishing(b, lambda t, chance: 0.05 + s * chance.uniform(0, 0.01), seed=s),
    "first messages lost": lambda b, s: publishing(b, 0.5, start_s=0.4 * s),
    "one message": lambda b, s: b.publisher("/x", FLOAT) if s else b.message(0.1, "/x", FLOAT, {"data": 1.0}),
    "a node that ends": lambda b, s: publishing(b, 0.5, stop_s=3.0 + 0.5 * s).fault(3.0 + 0.5 * s, "exited"),
    "an end near the edge": lambda b, s: b.fault(5.5, "exited") if not s else b,
    "nothing": lambda b, s: b,
}


@pytest.mark.parametrize("program", AGREE.values(), ids=AGREE)
def test_a_program_that_is_the_same_agrees(program: Program) -> None:
    """Chance, jitter, the time of day and messages before any subscription are not differences."""
    assert aspects(program(virtual(), 0), program(wall(), 1)) == []


DIFFER: dict[str, tuple[Aspect, Program]] = {
    "another rate": (Aspect.RATE, lambda b, s: publishing(b, 0.5, rate_hz=1.0 if s else 20.0)),
    "zeros": (Aspect.VALUE, lambda b, s: publishing(b, 0.0 if s else 0.5)),
    "silence": (Aspect.SILENT, lambda b, s: b if s else publishing(b, 0.5)),
    "only on the wall clock": (Aspect.SILENT, lambda b, s: publishing(b, 0.5) if s else b),
    "not random": (Aspect.CONSTANT, lambda b, s: publishing(b, 25.0 if s else lambda t, c: c.uniform(20, 30))),
    "ends early": (Aspect.RATE, lambda b, s: publishing(b, 0.5, stop_s=2.0 if s else 10.0)),
    "no logs": (Aspect.LOGS, lambda b, s: b if s else _logging(b)),
    "no subscription": (Aspect.ENDPOINT, lambda b, s: b if s else b.subscription("/odom", "nav_msgs/msg/Odometry")),
    "fails": (Aspect.END, lambda b, s: b.fault(1.0, "ValueError: x", kind=FaultKind.EXCEPTION) if s else b),
    "floods": (Aspect.LIMIT, lambda b, s: b.mark(0.5, "limit", "more than 1 MiB of output") if s else b),
    "fails in virtual time": (Aspect.END, lambda b, s: b if s else b.fault(1.0, "ValueError: x")),
}


def _logging(builder: TraceBuilder) -> TraceBuilder:
    for second in range(1, 20):
        builder.log(second / 4, "driving")
    return builder


@pytest.mark.parametrize(("aspect", "program"), DIFFER.values(), ids=DIFFER)
def test_a_program_that_is_another_differs(aspect: Aspect, program: Program) -> None:
    """The first difference is of the expected kind, and is reported in one sentence."""
    found = differences(program(virtual(), 0).trace(), program(wall(), 1).trace())
    assert aspect in [d.aspect for d in found]
    assert sentence(found[0], ClockKind.VIRTUAL).startswith("the node behaved differently on the wall clock: ")


def _controlled(builder: TraceBuilder, answer: Callable[[float], float], *, late_s: float) -> TraceBuilder:
    """A program that answers each temperature, which is held for two seconds."""
    for step, temperature in enumerate((20.0, 30.0, 22.0, 28.0)):
        for n in range(10):
            t_s = 0.5 + 2 * step + 0.2 * n
            builder.delivery(t_s, "/temperature", FLOAT, {"data": temperature})
            builder.message(t_s + late_s, "/fan", FLOAT, {"data": answer(temperature)})
    return builder


def test_answers_to_the_same_input_are_compared() -> None:
    """What a program makes of a value is not the same because it publishes as often."""
    right = lambda t: 100.0 if t > 25 else 0.0  # noqa: E731
    wrong = lambda t: 0.0 if t > 25 else 100.0  # noqa: E731
    one = _controlled(virtual(9.0), right, late_s=0.0)
    assert aspects(one, _controlled(wall(7.0), right, late_s=0.03)) == []
    found = differences(one.trace(), _controlled(wall(7.0), wrong, late_s=0.03).trace())
    assert found[0].aspect is Aspect.ANSWER
    assert (found[0].virtual, found[0].wall) in {(0.0, 100.0), (100.0, 0.0)}


def test_a_value_in_another_type_is_no_other_input() -> None:
    """Until a program's own type is known, the first value goes out as the rubric's: it shifts no answer."""
    right = lambda t: 100.0 if t > 25 else 0.0  # noqa: E731
    one = _controlled(virtual(9.0), right, late_s=0.0)
    other = _controlled(wall(7.0).delivery(0.3, "/temperature", FLOAT, {"data": 20.3}), right, late_s=0.03)
    assert aspects(one, other) == []


def test_what_comes_by_chance_has_no_rate() -> None:
    """A program that publishes where a random number crosses a limit does so more or less often."""
    one, other = virtual(), wall()
    for builder, times in ((one, (0.1, 0.2, 0.9, 1.0, 1.4, 2.0, 2.1, 3.3, 4.0, 4.2, 5.0)), (other, range(6))):
        for t_s in times:
            builder.message(float(t_s) + 0.05, "/fan", FLOAT, {"data": 100.0})
    one.message(1.2, "/fan", FLOAT, {"data": 0.0})
    other.message(1.2, "/fan", FLOAT, {"data": 0.0}).message(5.5, "/fan", FLOAT, {"data": 0.0})
    assert aspects(one, other) == []


def test_the_first_message_begins_the_window() -> None:
    """A slow start moves the window; it changes no count."""
    one = publishing(virtual(18.0), 0.5, start_s=8.0)
    other = publishing(wall(9.0), 0.5, start_s=3.0)
    assert aspects(one, other, first_message_on="/x") == []


def test_a_sentence_has_both_numbers() -> None:
    """As a reader needs them to see which clock was right."""
    one, other = publishing(virtual(), 0.5), publishing(wall(), 0.5, rate_hz=1.0)
    (found, *_) = differences(one.trace(), other.trace())
    assert sentence(found, ClockKind.VIRTUAL).endswith("/x had 20.0 Hz in virtual time and 1.0 Hz on the wall clock")
    assert sentence(found, ClockKind.WALL).endswith("/x had 20.0 Hz beside the grader's own code and 1.0 Hz without it")
    assert other.trace().stop_ns == 6 * NS_PER_S
