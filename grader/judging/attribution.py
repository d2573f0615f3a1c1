"""Which values a process logged knowingly: a number at a fixed place of its texts follows them.

A text that holds every number holds the right one too. So a value counts only where the number stands at a place that
is right most of the time, and where so few places were tried that chance does not explain it.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

from grader.core.trace import LogRecord
from grader.judging.positions.numbers import Printed, clean, printed_numbers, with_decimal_points
from grader.judging.printed import Output
from grader.judging.wording import counted, quote

#: Share of its texts in which a place must be right; the others may hold something else that is written alike.
_USUALLY = 0.45
#: The same for a place that has shown one value only, as in a sentence of its own for "off".
_NEARLY_ALWAYS = 0.75
#: So few numbers may stand beside each other without being suspected.
_FEW = 6
#: The same where the place has followed several values.
_FEW_FOLLOWING = 12
#: Largest number of places that chance may be expected to make right.
_LUCK = 0.15
#: A printed number shows values over at most so many units of its last digit.
_UNITS_SHOWN = 3
_DIGITS = re.compile(r"[0-9]+")
_REPEATED = re.compile(r"(.)\1+")

_Key = tuple[str, int, str, frozenset[str], str]
_Place = tuple[_Key, int]


@dataclass(frozen=True, slots=True)
class Sought:
    """A value that is to be logged in [start_ns, stop_ns), and what shows it.

    Attributes:
        start_ns: From when on its log counts.
        stop_ns: Until when, exclusive.
        value: The value.
        scale: Size of what the values range over, in their unit.
        shows: Whether a printed number shows the value.
    """

    start_ns: int
    stop_ns: int
    value: float
    scale: float
    shows: Callable[[Printed], bool]


@dataclass(slots=True)
class _Record:
    """What one place of one kind of text showed."""

    texts: int = 0
    right: int = 0
    near: bool = False
    active: set[int] = field(default_factory=set)
    shown: set[int] = field(default_factory=set)
    chances: dict[float, float] = field(default_factory=dict)

    @property
    def share(self) -> float:
        return self.right / self.texts


def followed(outputs: Sequence[Output], sought: Sequence[Sought]) -> frozenset[int]:
    """Return the places in `sought` of the values that are logged, and not only among many other numbers.

    Args:
        outputs: What was written.
        sought: The values, in the order of their times.
    """
    places = _places(outputs, sought)
    # each number is counted from the start and from the end, and tried once
    tried = [p for (_, index), p in places.items() if p.near and index >= 0]
    beside = [0] * len(sought)
    for place in tried:
        if place.texts < 2 or place.share >= _USUALLY:
            for here in place.active:
                beside[here] += 1
    several = len({s.value for s in sought}) > 1
    found: set[int] = set()
    for place in places.values():
        if place.shown - found and _knows(place, len(tried), max(beside[k] for k in place.active), several=several):
            found |= place.shown
    return frozenset(found)


def standing(outputs: Sequence[Output], sought: Sequence[Sought]) -> frozenset[int]:
    """Return the places in `sought` of the values that stand anywhere in the texts of their time."""
    found: set[int] = set()
    for output, active in _active(outputs, sought):
        numbers = [n for _, ns in _readings(output.text) for n in ns]
        found.update(k for k in active if k not in found and any(sought[k].shows(n) for n in numbers))
    return frozenset(found)


def crowd(outputs: Sequence[Output], one: Sought) -> str:
    """Return among what a value stands in the texts of its time, as a clause."""
    texts = [o.text for o, _ in _active(outputs, [one])]
    count = sum(len(_readings(text)[0][1]) for text in texts)
    longest = max(texts, key=len, default="")
    return f"among {counted(count, 'number')} written in its time, as in {quote(longest, 60)!r}"


def _knows(place: _Record, tried: int, beside: int, *, several: bool) -> bool:
    """Return whether a place is right too often for chance."""
    values = len(place.chances)
    if place.share < (_NEARLY_ALWAYS if values == 1 and several else _USUALLY):
        return False
    among = beside if values == 1 else tried
    if among <= (_FEW if values == 1 else _FEW_FOLLOWING):
        return True
    luck = float(among)
    for chance in place.chances.values():
        luck *= chance
    return luck <= _LUCK


def _places(outputs: Sequence[Output], sought: Sequence[Sought]) -> dict[_Place, _Record]:
    places: dict[_Place, _Record] = {}
    for output, active in _active(outputs, sought):
        where = (output.file, output.line) if isinstance(output, LogRecord) else ("", 0)
        for shape, numbers in _readings(output.text):
            for index, number in enumerate(numbers):
                shown = [k for k in active if sought[k].shows(number)]
                near = any(abs(number.value) <= 1.1 * sought[k].scale for k in active)
                chances = {sought[k].value: _chance(number, sought[k]) for k in shown}
                for place in (index, index - len(numbers)):
                    record = places.setdefault(((*where, *shape), place), _Record())
                    record.texts += 1
                    record.right += bool(shown)
                    record.near |= near
                    record.active.update(active)
                    record.shown.update(shown)
                    record.chances |= chances
    return places


def _chance(number: Printed, one: Sought) -> float:
    return min(1.0, _UNITS_SHOWN * number.step / one.scale) if one.scale else 1.0


def _active(outputs: Sequence[Output], sought: Sequence[Sought]) -> Iterator[tuple[Output, list[int]]]:
    """Yield the outputs at a time at which some value is sought, with the places of those values."""
    starts = [s.start_ns for s in sought]
    longest = max((s.stop_ns - s.start_ns for s in sought), default=0)
    for output in outputs:
        first = bisect_right(starts, output.t_ns - longest - 1)
        active = [k for k in range(first, bisect_right(starts, output.t_ns)) if output.t_ns < sought[k].stop_ns]
        if active:
            yield output, active


@lru_cache(maxsize=4096)
def _readings(text: str) -> tuple[tuple[tuple[str, frozenset[str], str], tuple[Printed, ...]], ...]:
    """Return the numbers of a text with its shape; a second time with decimal commas, if there may be some."""
    body = clean(text)
    other = with_decimal_points(body)
    return tuple((_shape(b, ns), ns) for b in (body, other) if b is not None for ns in (printed_numbers(b),))


def _shape(text: str, numbers: Sequence[Printed]) -> tuple[str, frozenset[str], str]:
    """Return what stands before, between and after the numbers; lists of any length and bars have one shape."""
    starts = [0, *(n.stop for n in numbers)]
    stops = [*(n.start for n in numbers), len(text)]
    parts = [
        _REPEATED.sub(r"\1", _DIGITS.sub("0", "".join(text[a:b].split()))) for a, b in zip(starts, stops, strict=True)
    ]
    return parts[0], frozenset(parts[1:-1]), parts[-1]
