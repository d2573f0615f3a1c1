"""Whole points: totals are the exact ones rounded, and rows add up to them."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from grader.grading.reporting.wording import whole_points

POINTS = st.fractions(min_value=Fraction(1, 8), max_value=20, max_denominator=8)
ROWS = st.lists(st.tuples(POINTS, st.fractions(min_value=0, max_value=1, max_denominator=6)), max_size=20)
WHOLE = st.lists(
    st.tuples(st.integers(1, 20).map(Fraction), st.fractions(min_value=0, max_value=1, max_denominator=6)), max_size=20
)


def rounded(rows: Sequence[tuple[Fraction, Fraction]]) -> list[tuple[int, int]]:
    return whole_points([top * share for top, share in rows], [top for top, _ in rows])


def test_the_largest_remainders_get_what_is_missing() -> None:
    """2.5 + 2.5 + 0.3 is 5.3: five points, the first of equal halves gets the one that is missing."""
    scores = [Fraction(5, 2), Fraction(5, 2), Fraction(3, 10)]
    assert whole_points(scores, [Fraction(5)] * 3) == [(3, 5), (2, 5), (0, 5)]


def test_only_a_score_without_loss_is_shown_as_full() -> None:
    """99.6 of 100 is no 100."""
    scores = [Fraction(50), Fraction(496, 10)]
    assert whole_points(scores, [Fraction(50)] * 2) == [(50, 50), (49, 50)]


def test_half_a_point_is_rounded_up() -> None:
    """87.5 is shown as 88."""
    assert sum(score for score, _ in whole_points([Fraction(175, 2), Fraction(0)], [Fraction(90), Fraction(10)])) == 88


@given(ROWS)
def test_no_row_earns_more_than_its_maximum(rows: Sequence[tuple[Fraction, Fraction]]) -> None:
    """Not even where maxima are fractions."""
    assert all(0 <= score <= top for score, top in rounded(rows))


@given(WHOLE)
def test_whole_maxima_stay_and_rows_are_off_by_less_than_one(rows: Sequence[tuple[Fraction, Fraction]]) -> None:
    """Rounding moves no row by a whole point, and the total by a half at most, unless it would look full."""
    found = rounded(rows)
    exact = sum((top * share for top, share in rows), Fraction(0))
    most = sum((top for top, _ in rows), Fraction(0))
    assert [top for _, top in found] == [top for top, _ in rows]
    assert all(
        abs(score - top * share) < 1 or exact > most - 1 for (score, _), (top, share) in zip(found, rows, strict=True)
    )
    total = sum(score for score, _ in found)
    assert abs(total - exact) <= Fraction(1, 2) or (exact > most - Fraction(1, 2) and total == most - 1)


@given(ROWS)
def test_full_marks_are_full_and_others_are_not(rows: Sequence[tuple[Fraction, Fraction]]) -> None:
    """The extremes are exact."""
    found = rounded(rows)
    full = all(share == 1 for _, share in rows)
    assert (sum(score for score, _ in found) == sum(top for _, top in found)) == (full or sum(t for _, t in found) == 0)
