"""Decides whether what was written shows a number, a text or a list, and not only by chance."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from functools import lru_cache

from grader.grading.judging.logs.outputs import Output, numbers_in
from grader.grading.judging.texts import Printed, clean, printed_numbers, readings
from grader.grading.judging.values import as_number
from grader.grading.model.wording import quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import counted
from grader.runtime.model.trace import LogRecord

#: Relative difference that a short conversion constant explains, such as 3.14159 for pi.
CONVERSION = 1e-4
#: How many units of its last digit the range is wide whose values a printed number shows: it may have been rounded or
#: cut, which is one unit on each side. The third is a margin for a short constant in a conversion.
AS_SENT, CONVERTED = 2, 3


def chance(step: float, scale: float, units: int = AS_SENT) -> float:
    """Return how likely a printed number shows a value by chance, between 0 and 1.

    Args:
        step: Unit of the number's last digit.
        scale: Size of the range of such values; 0 if there is only one.
        units: How many units of the last digit the range is wide whose values the number shows: two if it was rounded
            or cut, three if it may have been converted, too.
    """
    return min(1.0, units * step / scale) if scale else 1.0


def shows_about(printed: Printed, value: float, *, coarsest: float, relative: float = CONVERSION) -> bool:
    """Return whether a printed number shows a value precisely enough, allowing for a short conversion constant.

    Args:
        printed: The number.
        value: The value it may show.
        coarsest: Largest unit of the last digit that is precise enough, unless the number is exact.
        relative: Largest relative difference accepted.
    """
    slack = relative * abs(value) + 1e-9
    if abs(printed.value - value) <= slack:
        return True
    return printed.step <= coarsest * (1 + 1e-9) and any(printed.shows(value + d) for d in (-slack, 0.0, slack))


def says(text: str, value: object) -> bool:
    """Return whether a text shows a value: word for word, or as numbers next to each other and few others."""
    if isinstance(value, str):
        return re.search(rf"(?<!\w){re.escape(value)}(?!\w)", text) is not None
    wanted = [as_number(one) for one in (value if isinstance(value, (list, tuple)) else [value])]
    found = numbers_in(text)
    if None in wanted or len(found) > len(wanted) + FEW:
        return False
    return any(
        all(n.shows(w) for n, w in zip(found[k:], wanted, strict=False) if w is not None)
        for k in range(len(found) - len(wanted) + 1)
    )


#: Minimum share of texts in which a position in the text must be right; the others may be different logs of similar
#: wording.
_USUALLY = 0.45
#: The same for a position that has shown only one value, as in a separate sentence for "off".
_NEARLY_ALWAYS = 0.75
#: Up to this many numbers in one text, besides those expected, are not suspicious: a time, a count, a position.
FEW = 6
#: The same if the position has followed several values.
_FEW_FOLLOWING = 12
#: Maximum expected number of positions in a text that are right by chance. It only matters for texts with many numbers:
#: no recorded test submission is judged otherwise with 0.01 or with 5, but three right ones need more than 0.
_LUCK = 0.15
_DIGITS = re.compile(r"[0-9]+")
_REPEATED = re.compile(r"(.)\1+")
_Key = tuple[str, int, str, frozenset[str], str]
_Place = tuple[_Key, int]


@dataclass(frozen=True, slots=True)
class Sought:
    """A value that must be logged in [start_ns, stop_ns), and the test for it.

    Attributes:
        start_ns: Earliest time of its log.
        stop_ns: Latest time of its log, exclusive.
        value: The value.
        scale: Size of the range of such values, in their unit.
        shows: Whether a printed number shows the value.
    """

    start_ns: int
    stop_ns: int
    value: float
    scale: float
    shows: Callable[[Printed], bool]


@dataclass(slots=True)
class _Record:
    """Results of one position in texts of one shape."""

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
    """Return the indices in `sought`, ordered by time, of values that are logged, not only among many other numbers."""
    found = (_followed(_places(outputs, sought, reading), sought) for reading in _ways(outputs))
    return max(found, key=len, default=frozenset())


def _followed(places: Mapping[_Place, _Record], sought: Sequence[Sought]) -> frozenset[int]:
    # each number is indexed from the start and from the end, and counted once
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
    """Return the indices in `sought` of values that occur anywhere in the output of their time."""
    return max((_standing(outputs, sought, reading) for reading in _ways(outputs)), key=len, default=frozenset())


def _standing(outputs: Sequence[Output], sought: Sequence[Sought], reading: int) -> frozenset[int]:
    found: set[int] = set()
    for output, active in _active(outputs, sought):
        _, numbers = _shaped(output.text, reading)
        found.update(k for k in active if k not in found and any(sought[k].shows(n) for n in numbers))
    return frozenset(found)


def _ways(outputs: Sequence[Output]) -> list[int]:
    """Return which of the `readings` some text has."""
    texts = (readings(clean(o.text)) for o in outputs)
    return [reading for reading, bodies in enumerate(zip(*texts, strict=True)) if any(b is not None for b in bodies)]


def other_numbers(outputs: Sequence[Output], one: Sought) -> str:
    """Return a clause about the other numbers in the texts that show a value."""
    texts = [o.text for o, _ in _active(outputs, [one])]
    count = sum(len(printed_numbers(clean(text))) for text in texts)
    longest = max(texts, key=len, default="")
    return f"among {counted(count, 'number')} written meanwhile, as in {quote(longest, 60)!r}"


def _knows(place: _Record, tried: int, beside: int, *, several: bool) -> bool:
    """Return whether a position is right too often for chance."""
    values = len(place.chances)
    if place.share < (_NEARLY_ALWAYS if values == 1 and several else _USUALLY):
        return False
    among = beside if values == 1 else tried
    if among <= (FEW if values == 1 else _FEW_FOLLOWING):
        return True
    luck = float(among)
    for chance in place.chances.values():
        luck *= chance
    return luck <= _LUCK


def _places(outputs: Sequence[Output], sought: Sequence[Sought], reading: int) -> dict[_Place, _Record]:
    places: dict[_Place, _Record] = {}
    for output, active in _active(outputs, sought):
        where = (output.file, output.line) if isinstance(output, LogRecord) else ("", 0)
        shape, numbers = _shaped(output.text, reading)
        for index, printed in enumerate(numbers):
            shown = [k for k in active if sought[k].shows(printed)]
            near = any(abs(printed.value) <= 1.1 * sought[k].scale for k in active)
            chances = {sought[k].value: _chance(printed, sought[k]) for k in shown}
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
    return chance(number.step, one.scale, CONVERTED)


def _active(outputs: Sequence[Output], sought: Sequence[Sought]) -> Iterator[tuple[Output, list[int]]]:
    """Yield the outputs written while some value is sought, with the indices of those values."""
    starts = [s.start_ns for s in sought]
    longest = max((s.stop_ns - s.start_ns for s in sought), default=0)
    for output in outputs:
        first = bisect_right(starts, output.t_ns - longest - 1)
        active = [k for k in range(first, bisect_right(starts, output.t_ns)) if output.t_ns < sought[k].stop_ns]
        if active:
            yield output, active


@lru_cache(maxsize=4096)
def _shaped(text: str, reading: int) -> tuple[tuple[str, frozenset[str], str], tuple[Printed, ...]]:
    """Return a reading of a text, or the plainest if it does not have it: its shape and its numbers."""
    plain = clean(text)
    body = readings(plain)[reading] or plain
    numbers = printed_numbers(body)
    return _wording(body, numbers), numbers


def _wording(text: str, numbers: Sequence[Printed]) -> tuple[str, frozenset[str], str]:
    """Return the text around the numbers as a shape; lists and bars of any length have the same one."""
    starts = [0, *(n.stop for n in numbers)]
    stops = [*(n.start for n in numbers), len(text)]
    bare = ("".join(text[a:b].split()) for a, b in zip(starts, stops, strict=True))
    parts = [_REPEATED.sub(r"\1", _DIGITS.sub("0", part)) for part in bare]
    return parts[0], frozenset(parts[1:-1]), parts[-1]
