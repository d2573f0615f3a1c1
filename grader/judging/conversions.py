"""Which wrong conversion explains the numbers that were logged instead of the right ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from grader.judging.positions.numbers import Printed
from grader.judging.printed import CONVERSION, shows_about
from grader.judging.wording import number

_DEGREES = 180 / math.pi
#: Share of the messages whose numbers a factor must explain for it to be named.
_SURE = 0.8
#: Values smaller than this share of the largest say nothing about a factor.
_SMALL = 0.05
_FEWEST = 3
#: Factors that stand where that from radians to degrees belongs.
_FOR_DEGREES: tuple[tuple[float, str], ...] = (
    (200 / math.pi, "gradians, of which a full turn has 400: degrees are radians times 180 / pi"),
    (1 / _DEGREES, "the inverse conversion: degrees are radians times 180 / pi"),
    (60.0, "the conversion with 3 for pi: use math.pi or math.degrees"),
    (180.0, "not divided by pi: degrees are radians times 180 / pi"),
    (1 / math.pi, "not multiplied by 180: degrees are radians times 180 / pi"),
    (360 / math.pi, "twice as much: degrees are radians times 180 / pi"),
    (90 / math.pi, "half as much: degrees are radians times 180 / pi"),
)


@dataclass(frozen=True, slots=True)
class Heard:
    """What was logged for one message.

    Attributes:
        value: What the message holds.
        numbers: The numbers that were written for it.
    """

    value: float
    numbers: tuple[Printed, ...]


def wrong_conversion(heard: Sequence[Heard], factor: float, others: Sequence[float]) -> tuple[str, str]:
    """Return what stands where a converted value belongs, as a clause, and a hint; both empty if that is not plain.

    Args:
        heard: One entry for each message with a log.
        factor: What the value should have been multiplied by.
        others: Factors that are rightly there, whose numbers are no candidates.
    """
    largest = max((abs(h.value) for h in heard), default=0.0)
    telling = [h for h in heard if h.numbers and abs(h.value) > _SMALL * largest]
    if len(telling) < _FEWEST:
        return "", ""
    left = [Heard(h.value, tuple(n for n in h.numbers if not _explained(n, h, others))) for h in telling]
    if _share(left, lambda h, n: n.step >= 1 and n.shows(factor * h.value)) >= _SURE:
        return "it is logged as a whole number", "keep some decimals, as in f'{angle:.3f}'"
    lost = [h for h in left if factor * h.value < 0]
    if len(lost) >= _FEWEST and _share(lost, lambda h, n: _is(n, -factor * h.value)) >= _SURE:
        every = _share(left, lambda h, n: _is(n, -factor * h.value)) >= _SURE
        return ("it has the other sign", "keep the sign") if every else ("its sign is lost", "keep the sign")
    return _factor(left, factor)


def _factor(left: Sequence[Heard], factor: float) -> tuple[str, str]:
    first = max(left, key=lambda h: abs(h.value))
    for candidate in (n.value / first.value for n in first.numbers if math.isfinite(n.value) and n.value != 0):
        known = _known(candidate, factor)
        exact = known[0] if known else candidate
        if _scaled(left, exact) >= _SURE:
            said = f"instead there is {number(exact)} times the value"
            return (f"{said}, {known[1]}" if known else said), ""
    return "", ""


def _scaled(left: Sequence[Heard], factor: float) -> float:
    return _share(left, lambda h, n: _is(n, factor * h.value, 0.01))


def _known(candidate: float, factor: float) -> tuple[float, str] | None:
    if not math.isclose(factor, _DEGREES, rel_tol=1e-3):
        return None
    return next(((f, said) for f, said in _FOR_DEGREES if math.isclose(candidate, f, rel_tol=0.02)), None)


def _is(printed: Printed, value: float, relative: float = CONVERSION) -> bool:
    return shows_about(printed, value, coarsest=abs(value) / 3, relative=relative)


def _explained(printed: Printed, heard: Heard, factors: Sequence[float]) -> bool:
    return any(_is(printed, f * heard.value) for f in factors)


def _share(heard: Sequence[Heard], fits: Callable[[Heard, Printed], bool]) -> float:
    return sum(any(fits(h, n) for n in h.numbers) for h in heard) / len(heard)
