"""Names what is logged in place of a converted number: another factor, another sign, too few digits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from grader.grading.judging.logs.matching import CONVERSION, shows_about
from grader.grading.judging.texts import Printed
from grader.grading.model.wording import number
from grader.runtime.model.dataclass import dataclass

#: Factors that have a name, as text shows them.
_NAMED_FACTORS = {
    "1": "the value itself",
    f"{number(180 / math.pi)}": "the value in degrees",
    f"{number(math.pi / 180)}": "the value in radians",
}


def times(factor: float) -> str:
    """Return a factor for text; a factor of 1, and those between radians and degrees, by what they give."""
    return _NAMED_FACTORS.get(number(factor)) or f"{number(factor)} times the value"


_DEGREES = 180 / math.pi
#: Minimum share of messages whose numbers a factor must explain for it to be reported.
_SURE = 0.8
#: Values smaller than this share of the largest are not used to find a factor.
_SMALL = 0.05
_FEWEST = 3
#: Factors that appear in place of the one from radians to degrees.
_FOR_DEGREES: tuple[tuple[float, str], ...] = (
    (200 / math.pi, "gradians, of which a full turn has 400: degrees are radians times 180 / pi"),
    (1 / _DEGREES, "the inverse conversion: degrees are radians times 180 / pi"),
    (60.0, "the conversion with 3 for pi: use math.pi or math.degrees"),
    (180.0 * math.pi, "multiplied by pi and not divided: degrees are radians times 180 / pi"),
    (_DEGREES**2, "converted twice: degrees are radians times 180 / pi"),
    (180.0, "not divided by pi: degrees are radians times 180 / pi"),
    (1 / math.pi, "not multiplied by 180: degrees are radians times 180 / pi"),
    (360 / math.pi, "twice as much: degrees are radians times 180 / pi"),
    (90 / math.pi, "half as much: degrees are radians times 180 / pi"),
)


@dataclass(frozen=True, slots=True)
class LoggedNumbers:
    """The value in a message, and the numbers logged for it."""

    value: float
    numbers: tuple[Printed, ...]


def wrong_conversion(logged: Sequence[LoggedNumbers], factor: float, others: Sequence[float]) -> tuple[str, str]:
    """Return a clause about what is logged instead of `factor` times a value, and a hint; both empty if unclear."""
    largest = max((abs(h.value) for h in logged), default=0.0)
    telling = [h for h in logged if h.numbers and abs(h.value) > _SMALL * largest]
    if len(telling) < _FEWEST:
        return "", ""
    left = [LoggedNumbers(h.value, tuple(n for n in h.numbers if not _explained(n, h, others))) for h in telling]
    if _share(left, lambda h, n: n.step >= 1 and n.shows(factor * h.value)) >= _SURE:
        return "it is logged as a whole number", "keep some decimals, as in f'{angle:.3f}'"
    lost = [h for h in left if factor * h.value < 0]
    if len(lost) >= _FEWEST and _share(lost, lambda h, n: _shows_value(n, -factor * h.value)) >= _SURE:
        every = _share(left, lambda h, n: _shows_value(n, -factor * h.value)) >= _SURE
        return ("its sign is inverted", "keep the sign") if every else ("its sign is lost", "keep the sign")
    return _factor(left, factor)


def _factor(left: Sequence[LoggedNumbers], factor: float) -> tuple[str, str]:
    first = max(left, key=lambda h: abs(h.value))
    for candidate in (n.value / first.value for n in first.numbers if math.isfinite(n.value) and n.value != 0):
        known = _known(candidate, factor)
        exact = known[0] if known else candidate
        # the value itself may stand beside a wrong conversion of it
        itself = math.isclose(exact, 1, rel_tol=0.01)
        if _scaled(left, exact) >= _SURE and not (
            itself and any(not _explained(n, h, (1,)) for h in left for n in h.numbers)
        ):
            text = f"instead there is {times(1 if itself else exact)}"
            return (f"{text}, {known[1]}" if known else text), ""
    return "", ""


def _scaled(left: Sequence[LoggedNumbers], factor: float) -> float:
    return _share(left, lambda h, n: _shows_value(n, factor * h.value, 0.01))


def _known(candidate: float, factor: float) -> tuple[float, str] | None:
    if not math.isclose(factor, _DEGREES, rel_tol=1e-3):
        return None
    return next(((f, text) for f, text in _FOR_DEGREES if math.isclose(candidate, f, rel_tol=0.01)), None)


def _shows_value(printed: Printed, value: float, relative: float = CONVERSION) -> bool:
    return shows_about(printed, value, coarsest=abs(value) / 3, relative=relative)


def _explained(printed: Printed, logged: LoggedNumbers, factors: Sequence[float]) -> bool:
    return any(_shows_value(printed, f * logged.value) for f in factors)


def _share(logged: Sequence[LoggedNumbers], fits: Callable[[LoggedNumbers, Printed], bool]) -> float:
    return sum(any(fits(h, n) for n in h.numbers) for h in logged) / len(logged)
