"""Credit in proportion: what a check measures, and the scale that turns a number into a share of the points."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from fractions import Fraction
from numbers import Real
from typing import Literal, TypeAlias, get_args

from grader.grading.model.wording import number
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import SLACK

#: The key of the evidence for the number, its limits and the share of the points.
MEASURED_KEY = "measured"
#: How several numbers become one.
Combine = Literal["worst", "mean", "median"]
#: The words for a rubric's key `combine`.
COMBINES: tuple[Combine, ...] = get_args(Combine)
#: Shares between none and all are whole thousandths: a report shows points with two decimals, and the last bits of a
#: float must not make two reports differ.
_STEPS = 1000


@dataclass(frozen=True, slots=True)
class Reading:
    """One number and when it was read, in nanoseconds since the scenario began."""

    t_ns: int
    value: float


#: What a finding may hold as measured: one number, or several, each alone or as a `Reading`.
Measured: TypeAlias = "float | Sequence[float | Reading]"


@dataclass(frozen=True, slots=True)
class Measure:
    """What a check measures, so that a rubric may give a share of the points for it: `full` and `none`."""

    name: str  # the quantity, as it stands before a number: `distance from the wall`
    unit: str = ""  # empty for a count or a ratio; a rubric writes `s` and `Hz` with the number, such as `200 ms`
    better: Literal["less", "more"] | None = "less"  # which numbers are better; None if that is up to the rubric
    required: bool = False  # whether a rubric has to give `full` and `none`, because the check has no limit of its own

    def written(self, value: float) -> str:
        """Return a number with the unit."""
        return f"{number(float(f'{value:.4g}'))} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Scale:
    """Which number earns full points and which none; numbers between earn a share in proportion."""

    full: float  # in the unit of the measure, seconds for times
    none: float  # as `full`
    combine: Combine = "worst"

    @property
    def less_is_better(self) -> bool:
        """Whether smaller numbers earn more."""
        return self.full < self.none

    def combined(self, values: Sequence[float]) -> float:
        """Return one number for several, of which none counts as worse than `none`; there is at least one."""
        # What never happened is infinite, and NaN is not a number: without the bound, one would spoil every mean.
        worse, better = (max, min) if self.less_is_better else (min, max)
        bounded = [self.none if math.isnan(value) else better(value, self.none) for value in values]
        if self.combine == "mean":
            return statistics.fmean(bounded)
        return statistics.median(bounded) if self.combine == "median" else worse(bounded)

    def share(self, value: float) -> Fraction:
        """Return the share of the points for a number: all of them only at `full` or better, none only at `none`."""
        part = (self.none - value) / (self.none - self.full)
        if part >= 1 - SLACK:
            return Fraction(1)
        if not part > SLACK:
            return Fraction(0)
        return Fraction(min(max(round(part * _STEPS), 1), _STEPS - 1), _STEPS)

    def flaw(self, measure: Measure) -> str:
        """Return what is wrong with the scale for a measure, as what was expected; empty if nothing is."""
        if self.full == self.none:
            return "a `none` that differs from `full`"
        wanted = "less" if self.less_is_better else "more"
        if measure.better not in (None, wanted):
            side = "above" if measure.better == "less" else "below"
            return f"a `none` {side} `full`, because {measure.better} is better: {measure.name}"
        return ""


def readings_of(measured: object) -> tuple[Reading, ...]:
    """Return what a finding holds as measured, one reading for each number; a number alone has the time 0.

    Raises:
        TypeError: It is neither a number nor a sequence of numbers and readings.
    """
    several = measured if isinstance(measured, (list, tuple)) else (measured,)
    return tuple(map(_reading, several))


def _reading(one: object) -> Reading:
    value = one.value if isinstance(one, Reading) else one
    if isinstance(value, bool) or not isinstance(value, Real):
        expected = "expected a number, or a list of numbers or readings, as measured"
        raise TypeError(f"Finding: {expected}, found a {type(value).__name__}")
    return one if isinstance(one, Reading) else Reading(0, float(value))
