"""Numbers in text, with the precision to which they were printed."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

#: Longest text that is read; a printed odometry message has about 3,000 characters.
LONGEST_TEXT = 8_000
#: Most numbers that are read from one text.
MOST_NUMBERS = 160
#: Difference that printing does not explain but single precision does.
SLACK_M = 2e-6

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
#: What stands before most numbers, and ends no name; so nothing more has to be looked at.
_NO_NAME = frozenset(" =:,([")
_UNIT_AFTER = re.compile(r"\s?(cm|mm)(?![A-Za-z0-9])")
_PER_METRE = {"cm": 0.01, "mm": 0.001}


@dataclass(frozen=True, slots=True)
class Printed:
    """A number as it was printed.

    Attributes:
        value: The number; not finite for a printed nan or inf.
        step: Size of one unit of its last digit.
        start: Where it begins in the text.
        stop: Where it ends, exclusive.
    """

    value: float
    step: float
    start: int
    stop: int

    def shows(self, value: float) -> bool:
        """Return whether printing `value` gives this: rounded, cut off or rounded down to its last digit."""
        excess = value - self.value
        below = self.step if value <= 0 and self.value <= 0 else self.step / 2
        return -below - SLACK_M <= excess <= self.step + SLACK_M


def clean(text: str) -> str:
    """Return a text with one form of minus sign and digit, and without terminal colours."""
    text = text[:LONGEST_TEXT]
    if "\x1b" in text:
        text = _ANSI.sub("", text)
    return text if text.isascii() else unicodedata.normalize("NFKC", text.translate(_MINUS)).translate(_MINUS)


def with_decimal_points(text: str) -> str | None:
    """Return the text with `1,25` read as `1.25`, or None if nothing in it can be read so."""
    if "," not in text:
        return None
    changed = _DECIMAL_COMMA.sub(r"\1.\2", text)
    return changed if changed != text else None


def printed_numbers(text: str) -> tuple[Printed, ...]:
    """Return the numbers of a cleaned text in order; digits that belong to a name such as `odom1` are none."""
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
    # 0e9 is no way of saying "any number"
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
        return False  # names do not hold decimal fractions
    label = before[0].lower() in ("x", "y", "z")
    return not label or re.match(r"\s*[:=]", text[match.end() : match.end() + 4]) is not None
