"""Scales: which share of the points a number earns, how several become one, and which scales make no sense."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.grading.model.exercise import Finding
from grader.grading.model.measures import COMBINES, Combine, Measure, Reading, Scale, readings_of

NUMBERS = st.floats(-1e6, 1e6)


@pytest.mark.parametrize(
    ("scale", "shares"),
    [
        (Scale(0.05, 0.5), {0.0: 1, 0.05: 1, 0.275: Fraction(1, 2), 0.5: 0, 9.0: 0, math.inf: 0, math.nan: 0}),
        (Scale(10, 2), {11.0: 1, 10.0: 1, 4.0: Fraction(1, 4), 2.0: 0, -1.0: 0, -math.inf: 0}),
        (Scale(0, 1), {1e-5: Fraction(999, 1000), 0.99999: Fraction(1, 1000)}),
    ],
)
def test_a_number_earns_a_share(scale: Scale, shares: dict[float, Fraction]) -> None:
    """All at `full` and better, none at `none` and worse, and neither just before."""
    assert {value: scale.share(value) for value in shares} == shares


@given(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
def test_a_better_number_never_earns_less(full: float, none: float, one: float, other: float) -> None:
    """Whichever side is better, and a share is always one."""
    if full == none:
        return
    scale = Scale(full, none)
    better, worse = sorted((one, other), reverse=not scale.less_is_better)
    assert 0 <= scale.share(worse) <= scale.share(better) <= 1


@pytest.mark.parametrize(("combine", "less", "more"), [("worst", 1.0, 0.1), ("mean", 0.5, 0.5), ("median", 0.4, 0.4)])
def test_several_numbers_become_one(combine: Combine, less: float, more: float) -> None:
    """The worst is the largest where less is better."""
    values = [0.1, 0.4, 1.0]
    assert Scale(0, 2, combine).combined(values) == pytest.approx(less)
    assert Scale(2, 0, combine).combined(values) == pytest.approx(more)


@pytest.mark.parametrize("combine", COMBINES)
@pytest.mark.parametrize("never", [math.inf, math.nan, 1e300])
def test_no_number_counts_as_worse_than_none(combine: Combine, never: float) -> None:
    """One goal that was not reached leaves a mean of the others."""
    scale = Scale(1.0, 4.0, combine)
    assert scale.combined([never]) == 4.0
    assert scale.combined([1.0, 1.0, never]) == {"worst": 4.0, "mean": 2.0, "median": 1.0}[combine]


@pytest.mark.parametrize(
    ("better", "full", "none", "expected"),
    [
        ("less", 1, 2, ""),
        ("less", 2, 1, "a `none` above `full`, because less is better: speed"),
        ("more", 2, 1, ""),
        ("more", 1, 2, "a `none` below `full`, because more is better: speed"),
        (None, 2, 1, ""),
        (None, 1, 2, ""),
        (None, 1, 1, "a `none` that differs from `full`"),
    ],
)
def test_limits_on_the_wrong_side_are_told(better: str | None, full: float, none: float, expected: str) -> None:
    """Or equal ones."""
    assert Scale(full, none).flaw(Measure("speed", "m/s", better)) == expected  # type: ignore[arg-type]


@pytest.mark.parametrize("wrong", ["1", True, None, [1, "2"], {"a": 1}, [[1]]])
def test_what_is_no_number_is_refused_where_the_finding_is_made(wrong: object) -> None:
    """So that the traceback shows the line of the check."""
    with pytest.raises(TypeError, match="expected a number, or a list of numbers or readings, as measured, found a"):
        Finding(Fraction(1), "", measured=wrong)  # type: ignore[arg-type]


def test_a_finding_holds_numbers_in_any_form() -> None:
    """One, several, or several with their times."""
    assert readings_of(3) == (Reading(0, 3.0),)
    assert readings_of([1, Reading(5, 2.0)]) == (Reading(0, 1.0), Reading(5, 2.0))
    assert Finding(Fraction(1), "").readings == ()
    assert Measure("speed", "m/s").written(0.123456) == "0.1235 m/s"
    assert Measure("collisions").written(3) == "3"
