"""Finds numbers in logged texts, with the precision to which they were printed."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from functools import lru_cache

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
    # No sign: the one between the two numbers of a range; a complex number has no such range.
    r"|(?:(?:(?<![0-9])(?<![0-9]\.)|(?=[+-][0-9.e+-]{1,40}j))(?P<sign>[+-]))?"
    # No decimal point: the last one of `speed...5`.
    r"(?:(?P<whole>[0-9]+)(?:\.(?P<part>[0-9]*))?|(?<!\.)\.(?P<only>[0-9]+))"
    r"(?:[eE](?P<power>[+-]?[0-9]{1,3})(?![0-9]))?"
    r"|(?<![A-Za-z0-9_])[+-]?(?P<odd>nan|inf|infinity)(?![A-Za-z0-9_])",
    re.IGNORECASE,
)
_DECIMAL_COMMA = re.compile(r"(?<![0-9,])(?<![0-9]\.)([0-9]+),([0-9]+)(?![0-9]*[.,][0-9])")
#: The end of a word, which is not the power of a number.
_WORD_END = r"(?<![0-9.])([A-Za-z_À-ɏ])"
_JOINED = re.compile(rf"{_WORD_END}(?=[0-9])")
_DASHED = re.compile(rf"{_WORD_END}-(?=-?[0-9.])")
_NAME_BEFORE = re.compile(r"[A-Za-z_À-ɏ]+$")
#: Characters before most numbers that cannot end a name, so the text before them needs no further check.
_NO_NAME = frozenset(" =:,([")
_UNIT_AFTER = re.compile(
    r"\s?(?:(?P<short>[kdcm])m|(?P<long>kil[oó]|d[eé][cz][ií]|[cz]ent[ií]|mill?[ií])m[eèé]t[a-z]*)(?![A-Za-z0-9]|/h)",
    re.IGNORECASE,
)
#: By the first letter of the prefix; German writes Zentimeter.
_METRES = {"k": 1000.0, "d": 0.1, "c": 0.01, "z": 0.01, "m": 0.001}


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
    return _changed(_DECIMAL_COMMA, r"\1.\2", text)


def with_numbers_apart(text: str) -> str | None:
    """Return the text with `fan37` read as `fan 37`, or None if it has no such number."""
    return _changed(_JOINED, r"\1 ", text)


def with_dashes(text: str) -> str | None:
    """Return the text with `x-1.5` read as `x 1.5` and `x--1.5` as `x -1.5`, or None if it has no such number."""
    return _changed(_DASHED, r"\1 ", text)


def _changed(pattern: re.Pattern[str], replacement: str, text: str) -> str | None:
    changed = pattern.sub(replacement, text)
    return changed if changed != text else None


@lru_cache(maxsize=4096)
def readings(text: str) -> tuple[str | None, ...]:
    """Return a cleaned text in every way in which it may be meant, the plainest first.

    There are as many for each text, in the same order; None where one does not differ from the plainest. Read all texts
    of a program in the same way: with two ways at once, `x-1.5` would be right for 1.5 and for -1.5.
    """
    return text, with_decimal_points(text), with_numbers_apart(text), with_dashes(text)


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
        scale = _METRES[(unit["short"] or unit["long"])[0].lower()]
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
