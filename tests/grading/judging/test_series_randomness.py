"""Drawn numbers pass whatever draws them; computed ones do not."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable, Iterator

import pytest

from grader.grading.judging.series import pattern_of


def _walk(rng: random.Random, step: Callable[[], float]) -> Iterator[float]:
    value = 25.0
    while True:
        yield value
        value = min(30.0, max(20.0, value + step()))


GENERATORS: dict[str, Callable[[random.Random], Iterator[float]]] = {
    "uniform": lambda r: (r.uniform(20, 30) for _ in itertools.count()),
    "randint": lambda r: (float(r.randint(20, 30)) for _ in itertools.count()),
    "rounded": lambda r: (round(r.uniform(20, 30), 1) for _ in itertools.count()),
    "clipped normal": lambda r: (min(30.0, max(20.0, r.gauss(25, 3))) for _ in itertools.count()),
    "mostly clipped normal": lambda r: (min(30.0, max(20.0, r.gauss(25, 15))) for _ in itertools.count()),
    "choice of three": lambda r: (r.choice([22.0, 25.0, 28.0]) for _ in itertools.count()),
    "choice of four": lambda r: (r.choice([21.5, 24.0, 26.0, 29.5]) for _ in itertools.count()),
    "triangular": lambda r: (r.triangular(20, 30) for _ in itertools.count()),
    "random()": lambda r: (20 + 10 * r.random() for _ in itertools.count()),
    "walk": lambda r: _walk(r, lambda: r.uniform(-0.5, 0.5)),
    "walk, fixed step": lambda r: _walk(r, lambda: r.choice([-0.5, 0.5])),
    "walk, normal": lambda r: _walk(r, lambda: r.gauss(0, 0.2)),
    "walk, rounded": lambda r: (round(v, 1) for v in _walk(r, lambda: r.uniform(-0.3, 0.3))),
    "noisy sine": lambda r: (25 + 3 * math.sin(k / 5) + r.uniform(-1.5, 1.5) for k in itertools.count()),
}

COMPUTED: dict[str, tuple[Callable[[int], float], str]] = {
    "constant": (lambda k: 25.0, "constant"),
    "two in turn": (lambda k: 20.0 + 10 * (k % 2), "the same 2 values"),
    "list": (lambda k: [21.0, 27.5, 24.0, 29.0, 22.5][k % 5], "the same 5 values"),
    "counter": (lambda k: 20.0 + k % 11, "the same 11 values"),
    "twenty values": (lambda k: 20 + (k * 7 % 20) / 2, "the same 20 values"),
    "ramp": (lambda k: 20 + 0.1 * k, "only rises"),
    "falling": (lambda k: 30 - 0.1 * k, "only falls"),
    "bent ramp": (lambda k: 20 + math.sqrt(k), "only rises"),
    "slow sawtooth": (lambda k: 20 + (0.37 * k) % 10, "sawtooth"),
    "fast sawtooth": (lambda k: 20 + (3.7001 * k) % 10, "sawtooth"),
    "triangle": (lambda k: 20 + abs((0.41 * k) % 20 - 10), "smooth"),
    "sine of time": (lambda k: 25 + 5 * math.sin(0.2 * k), "smooth"),
    "fast sine": (lambda k: 25 + 5 * math.sin(k), "smooth"),
    "rounded sine": (lambda k: round(25 + 5 * math.sin(k / 3), 1), "smooth"),
    "slow sine": (lambda k: 25 + 5 * math.sin(k / 30), "smooth"),
    "slow rounded sine": (lambda k: round(25 + 5 * math.sin(k / 15), 1), "smooth"),
    "wave that repeats": (lambda k: 25 + 5 * math.sin(2 * math.pi * k / 20), "the same 20 values"),
}


@pytest.mark.breadth(8, 20)
@pytest.mark.parametrize("name", GENERATORS)
@pytest.mark.parametrize("count", [10, 12, 20, 60, 120])
def test_every_generator_passes(name: str, count: int) -> None:
    """500 series of each kind and length; a false alarm would cost a correct student six points."""
    alarms = 0
    for seed in range(500):
        values = list(itertools.islice(GENERATORS[name](random.Random(f"{name}{seed}")), count))
        alarms += len(set(values)) > 1 and pattern_of(values) is not None
    assert alarms <= (3 if count <= 12 and name.startswith("walk, fixed") else 0)


@pytest.mark.parametrize(("rule", "named"), COMPUTED.values(), ids=COMPUTED)
def test_every_rule_is_recognised(rule: Callable[[int], float], named: str) -> None:
    """12 s at 5 Hz are enough to see through it."""
    found = pattern_of([rule(k) for k in range(60)])
    assert found is not None
    assert named in found


def test_a_few_values_are_only_asked_whether_they_differ() -> None:
    """Three values are too few for a judgement."""
    assert pattern_of([]) is None
    assert pattern_of([25.0]) is None
    assert pattern_of([25.0, 25.0]) == "constant"
    assert pattern_of([21.0, 22.0, 23.0]) is None
