"""Rounds scores to whole points so that the rows still add up."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import floor


def whole_points(scores: Sequence[Fraction], max_scores: Sequence[Fraction]) -> list[tuple[int, int]]:
    """Return whole-number score and maximum of each row, by the largest remainder method.

    The totals are the exact ones rounded half up, and the rows add up to them. No row earns more than its maximum, and
    only a score without any loss becomes the full one.
    """
    tops = largest_remainder(max_scores, _rounded(sum(max_scores, Fraction(0))), [floor(m) + 1 for m in max_scores])
    exact = sum(scores, Fraction(0))
    total = min(_rounded(exact), sum(tops))
    if exact < sum(max_scores):
        total = min(total, max(sum(tops) - 1, 0))
    earned = largest_remainder(scores, total, tops)
    return list(zip(earned, tops, strict=True))


def largest_remainder(shares: Sequence[Fraction], total: int, most: Sequence[int]) -> list[int]:
    """Return whole numbers close to `shares` that add up to `total`.

    Each share is rounded down, and the missing points go to the largest remainders, the first of equal ones first. If
    the rounded shares exceed the total, the smallest remainders lose points.

    Args:
        shares: Exact values, at least 0.
        total: At most the sum of `most`.
        most: Maximum of each row.
    """
    found = [min(floor(share), top) for share, top in zip(shares, most, strict=True)]
    by_remainder = sorted(range(len(found)), key=lambda row: (found[row] - shares[row], row))
    while sum(found) < total:
        row = next(row for row in by_remainder if found[row] < most[row])
        found[row] += 1
        by_remainder.remove(row)
        by_remainder.append(row)
    for row in reversed(by_remainder):
        if sum(found) > total and found[row] > 0:
            found[row] -= 1
    return found


def _rounded(value: Fraction) -> int:
    return floor(value + Fraction(1, 2))
