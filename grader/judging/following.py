"""What a series follows instead of the formula it should: another count, factor, pace or function."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from grader.core.quantities import within
from grader.judging.formula import Curve
from grader.judging.wording import counted, number

#: Share of the values that another formula must give for it to be named as what they follow.
_SURE = 0.97
#: Fewer values than this follow something by chance.
_FEWEST = 5
#: Counters are tried to begin at most this far from 0.
_FURTHEST_START = 20
_DEGREES = 180 / math.pi
#: By what a counter may have been multiplied or divided by mistake.
_PACES = (10.0, 2.0, 5.0, 100.0, 20.0, 4.0, 3.0, 50.0, 1.1, 1.5)
_REPEATS = (2, 3, 5, 10)
_MOST_DECIMALS = 5
_COUNT_HINT = "count the messages: n grows by 1 with each"
_FIRST_HINT = "publish first and count afterwards: the first message is n = 0"
_PACE_HINT = "compare the factor of n with the one asked for"
_RADIAN_HINT = "sine and cosine take radians here: convert nothing"


@dataclass(frozen=True, slots=True)
class Sample:
    """One message: its number from 0, its time since the first one, and what its field holds."""

    n: int
    t_s: float
    value: float


@dataclass(frozen=True, slots=True)
class Instead:
    """What the values follow, as a clause, and what to do about it; both may be empty.

    Attributes:
        said: The clause.
        hint: What to do.
        start: The number that the count starts at, if that is all that differs.
    """

    said: str = ""
    hint: str = ""
    start: int | None = None


_Wanted = Callable[[Sample], float]


def followed_instead(wanted: Curve, samples: Sequence[Sample], tolerance: float) -> Instead:
    """Return what a series that differs from a formula follows, if that is plain.

    Args:
        wanted: The formula.
        samples: The series, in order.
        tolerance: Largest difference.
    """
    if len(samples) < _FEWEST:
        return Instead()
    if not all(math.isfinite(s.value) for s in samples):
        return Instead()
    if len({s.value for s in samples}) == 1:
        return Instead(f"it is {number(samples[0].value)} in every message", _COUNT_HINT)
    scaled = _scaled(wanted, samples, tolerance)
    if scaled is not None:
        return scaled
    ways = (way for way, other in _ways(wanted) if _follow(samples, other, tolerance))
    return next(ways, Instead())


def _follow(samples: Sequence[Sample], other: _Wanted, tolerance: float) -> bool:
    fitting = sum(within(s.value, other(s), max(tolerance, 1e-6)) for s in samples)
    return fitting >= _SURE * len(samples)


def _at(wanted: Curve, sample: Sample, *, start: int = 0, pace: float = 1.0, repeats: int = 1) -> float:
    return wanted.at(pace * (sample.n // repeats + start), pace * sample.t_s)


def _rounded(wanted: Curve, sample: Sample, *, decimals: int) -> float:
    value = wanted.at(sample.n, sample.t_s)
    return round(value, decimals) if math.isfinite(value) else value


def _ways(wanted: Curve) -> Iterator[tuple[Instead, _Wanted]]:
    """Yield what students do instead, the commonest first."""
    for start in (s for near in range(1, _FURTHEST_START + 1) for s in (near, -near)):
        said = f"the values are right for a count that starts at {start}"
        yield Instead(said, _FIRST_HINT if start == 1 else "", start), partial(_at, wanted, start=start)
    for degrees in (_DEGREES, 1 / _DEGREES):
        said = "the angle is converted between degrees and radians before the formula"
        yield Instead(said, _RADIAN_HINT), partial(_at, wanted, pace=degrees)
    for factor in _PACES:
        fast, slow = (f"the values go through {wanted.text} {number(factor)} times too {w}" for w in ("fast", "slowly"))
        yield Instead(fast, _PACE_HINT), partial(_at, wanted, pace=factor)
        yield Instead(slow, _PACE_HINT), partial(_at, wanted, pace=1 / factor)
    for repeats in _REPEATS:
        yield Instead(f"each value comes {repeats} times", _COUNT_HINT), partial(_at, wanted, repeats=repeats)
    if wanted.mistaken is not None:
        hint = "sine and cosine are taken for each other"
        yield Instead(f"the values follow {wanted.mistaken.text}", hint), partial(_at, wanted.mistaken)
    for decimals in range(_MOST_DECIMALS + 1):
        said = f"the values are rounded to {counted(decimals, 'decimal')}"
        yield Instead(said, "publish the value as it is"), partial(_rounded, wanted, decimals=decimals)


def _scaled(wanted: Curve, samples: Sequence[Sample], tolerance: float) -> Instead | None:
    pairs = [(s.value, wanted.at(s.n, s.t_s)) for s in samples]
    ratios = [got / want for got, want in pairs if abs(want) > 1e-3 and math.isfinite(got)]
    factor = statistics.median(ratios) if ratios else 1.0
    if math.isclose(factor, 1.0, rel_tol=1e-6) or abs(factor) < 1e-9:
        return None
    unscaled = [replace(s, value=s.value / factor) for s in samples]
    if not _follow(unscaled, partial(_at, wanted), tolerance):
        return None
    said = f"each value is {number(factor)} times the one expected"
    if math.isclose(factor, -1.0, rel_tol=1e-6):
        return Instead(said, "the sign is the wrong way round")
    if any(math.isclose(factor, f, rel_tol=1e-3) for f in (_DEGREES, 1 / _DEGREES)):
        return Instead(said, "that is the factor between degrees and radians: publish the value unconverted")
    return Instead(said)
