"""Tells drawn numbers from computed ones: constants, cycles, ramps, sawtooths and smooth curves."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

#: Fewer values than this say nothing but whether they differ.
FEW = 10
#: A pattern that chance gives more often than exp(-14), about one in a million, is no evidence.
_EVIDENCE = 14.0
#: Fewest steps for the patterns that a short random series may show by chance.
_ENOUGH = 16
#: Share of the variance of the steps that the two steps before leave unexplained in a smooth curve, at most.
_REST = 0.05
#: The same for few steps, where a fit comes out well by chance.
_REST_OF_FEW = 0.001
_MANY = 40


def pattern_of(values: Sequence[float]) -> str | None:
    """Return how the values follow from each other, as a phrase; None if they may have been drawn.

    Every generator passes: uniform, whole or rounded numbers, a clipped normal distribution, a choice of a few values,
    a random walk. Fewer than `FEW` values are only asked whether they differ.

    Args:
        values: Finite numbers in order of publishing.
    """
    if len(values) > 1 and len(set(values)) == 1:
        return "constant"
    if len(values) < FEW:
        return None
    period = _cycle(values)
    return _shape(values) if period is None else f"the same {period} values over and over"


def _shape(values: Sequence[float]) -> str | None:
    steps = [b - a for a, b in pairwise(values)]
    if _one_way(steps):
        return "a ramp: it only rises" if values[-1] > values[0] else "a ramp: it only falls"
    if _sawtooth(values, steps):
        return "a sawtooth"
    if _few_turns(steps) or _predictable(steps):
        return "a smooth curve"
    return None


def _cycle(values: Sequence[float]) -> int | None:
    """Return the period of a repeating series, if chance does not explain it."""
    shares = Counter(values)
    log_chance = -math.log(sum((n / len(values)) ** 2 for n in shares.values()))
    for period in range(2, len(values) // 2 + 1):
        compared = len(values) - period
        if compared * log_chance < _EVIDENCE:
            return None
        if all(math.isclose(a, b, abs_tol=1e-6) for a, b in zip(values, values[period:], strict=False)):
            return period
    return None


def _one_way(steps: Sequence[float]) -> bool:
    rising, falling = all(s >= 0 for s in steps), all(s <= 0 for s in steps)
    moving = sum(s != 0 for s in steps)
    even = all(math.isclose(s, steps[0], rel_tol=1e-3, abs_tol=1e-6) for s in steps)
    return (rising or falling) and (moving >= _ENOUGH or (even and moving > FEW))


def _sawtooth(values: Sequence[float], steps: Sequence[float]) -> bool:
    """Return whether there is one small step and one jump back, the jump exactly where the step would go too far."""
    kinds = Counter(round(s, 4) for s in steps).most_common(2)
    if len(steps) < _ENOUGH or len(kinds) < 2 or sum(n for _, n in kinds) < len(steps) - 1:
        return False
    usual, jump = kinds[0][0], kinds[1][0]
    if usual * jump >= 0 or math.isclose(usual, -jump, rel_tol=0.05):
        return False
    before_usual = [v for v, s in zip(values, steps, strict=False) if s * usual > 0]
    before_jump = [v for v, s in zip(values, steps, strict=False) if s * jump > 0]
    if usual > 0:
        return max(before_usual) < min(before_jump) + 1e-6
    return min(before_usual) > max(before_jump) - 1e-6


def _few_turns(steps: Sequence[float]) -> bool:
    """Return whether the series turns round far more seldom than independent steps would: by five deviations."""
    signs = [s > 0 for s in steps if s != 0]
    turns = sum(a != b for a, b in pairwise(signs))
    pairs = len(signs) - 1
    return pairs >= _ENOUGH and turns < pairs / 2 - 2.5 * math.sqrt(pairs)


def _predictable(steps: Sequence[float]) -> bool:
    """Return whether each step is a fixed combination of the two before it, as in any sampled sine."""
    if len(steps) < _ENOUGH:
        return False
    mean = sum(steps) / len(steps)
    d = [s - mean for s in steps]
    rows = list(zip(d[2:], d[1:], d, strict=False))
    total = sum(y * y for y, _, _ in rows)
    aa, bb = sum(a * a for _, a, _ in rows), sum(b * b for _, _, b in rows)
    ab = sum(a * b for _, a, b in rows)
    ya, yb = sum(y * a for y, a, _ in rows), sum(y * b for y, _, b in rows)
    det = aa * bb - ab * ab
    if total <= 0.0 or det <= 1e-9 * aa * bb:
        return False
    p, q = (ya * bb - yb * ab) / det, (yb * aa - ya * ab) / det
    rest = sum((y - p * a - q * b) ** 2 for y, a, b in rows)
    return rest <= (_REST if len(steps) >= _MANY else _REST_OF_FEW) * total
