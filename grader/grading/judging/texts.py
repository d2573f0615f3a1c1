"""Finds numbers in logged texts, with the precision to which they were printed."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

from grader.runtime.model.dataclass import dataclass

#: Longest text that is read, in characters; the repr of a message with two covariances has about 3,000.
LONGEST_TEXT = 8_000
#: Maximum number of numbers read from one text.
MOST_NUMBERS = 160
#: Difference that single precision explains for numbers up to some tens, but printing does not.
_SLACK = 2e-6
_ANSI = re.compile(r"\x1b\[[0-9;?]*[ -/]*[@-~]")
_MINUS = dict.fromkeys((0x2212, 0x2010, 0x2011, 0x2012, 0x2013, 0xFE63, 0xFF0D), "-")
_NUMBER = re.compile(
    r"(?P<hex>0[xX][0-9a-fA-F]+)"
    r"|(?:(?<![0-9.])(?P<sign>[+-]))?"
    r"(?:(?P<whole>[0-9]+)(?:\.(?P<part>[0-9]*))?|\.(?P<only>[0-9]+))(?:[eE](?P<power>[+-]?[0-9]{1,3})(?![0-9]))?"
    r"|(?<![A-Za-z0-9_])[+-]?(?P<odd>nan|inf|infinity)(?![A-Za-z0-9_])",
    re.IGNORECASE,
)
_DECIMAL_COMMA = re.compile(r"(?<![0-9.,])([0-9]+),([0-9]+)(?![0-9]*[.,][0-9])")
_NAME_BEFORE = re.compile(r"[A-Za-z_À-ɏ]+$")
#: Characters before most numbers that cannot end a name, so the text before them needs no further check.
_NO_NAME = frozenset(" =:,([")
_UNIT_AFTER = re.compile(r"\s?(cm|mm)(?![A-Za-z0-9])")
_PER_METRE = {"cm": 0.01, "mm": 0.001}


@dataclass(frozen=True, slots=True)
class Printed:
    """A printed number.

    Attributes:
        value: The number; not finite for a printed nan or inf.
        step: Value of one unit of its last digit.
    """

    value: float
    step: float
    start: int
    stop: int

    def shows(self, value: float) -> bool:
        """Return whether `value` prints as this number: rounded, truncated or rounded down to its last digit."""
        excess = value - self.value
        below = self.step if value <= 0 and self.value <= 0 else self.step / 2
        return -below - _SLACK <= excess <= self.step + _SLACK


def clean(text: str) -> str:
    """Return a text with one kind of minus sign and digits, and without terminal colours."""
    text = text[:LONGEST_TEXT]
    if "\x1b" in text:
        text = _ANSI.sub("", text)
    return text if text.isascii() else unicodedata.normalize("NFKC", text.translate(_MINUS)).translate(_MINUS)


def with_decimal_points(text: str) -> str | None:
    """Return the text with `1,25` read as `1.25`, or None if it has no such number."""
    if "," not in text:
        return None
    changed = _DECIMAL_COMMA.sub(r"\1.\2", text)
    return changed if changed != text else None


def printed_numbers(text: str) -> tuple[Printed, ...]:
    """Return the numbers of a cleaned text in order; digits in a name such as `robot1` are not numbers."""
    found: list[Printed] = []
    for match in _NUMBER.finditer(text):
        number = _read(text, match)
        if number is not None:
            found.append(number)
        if len(found) == MOST_NUMBERS:
            break
    return tuple(found)


def _read(text: str, match: re.Match[str]) -> Printed | None:
    hexadecimal, sign, _, part, only, power, odd = match.groups()
    if hexadecimal:
        return None
    if odd:
        return Printed(float(match[0]), 0.0, match.start(), match.end())
    if not sign and _belongs_to_name(text, match):
        return None
    decimals = len(part or only or "")
    # 0e9 must not match every number
    step = 10.0 ** min(0, int(power or 0) - decimals)
    scale = 1.0
    unit = _UNIT_AFTER.match(text, match.end())
    if unit:
        scale = _PER_METRE[unit[1]]
    return Printed(float(match[0]) * scale, step * scale, match.start(), match.end())


def _belongs_to_name(text: str, match: re.Match[str]) -> bool:
    if text[match.start() - 1 : match.start()] in _NO_NAME:
        return False
    before = _NAME_BEFORE.search(text, max(0, match.start() - 40), match.start())
    if before is None:
        return False
    if "." in match[0].rstrip("."):
        return False  # names contain no decimal fractions
    label = before[0].lower() in ("x", "y", "z")
    return not label or re.match(r"\s*[:=]", text[match.end() : match.end() + 4]) is not None


def segments(text: str, numbers: Sequence[Printed]) -> list[str]:
    """Return the text before, between and after its numbers: one segment more than there are numbers."""
    starts = [0] + [n.stop for n in numbers]
    stops = [n.start for n in numbers] + [len(text)]
    return [text[a:b] for a, b in zip(starts, stops, strict=True)]


def template_of(text: str, numbers: Sequence[Printed]) -> str:
    """Return the text with every number replaced by `#` and without white space."""
    return "#".join("".join(part.split()) for part in segments(text, numbers))
