"""Quantities in readable form: `10 s`, `200 ms`, `20 Hz`; parsed exactly and printed back."""

import re
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import GIB, KIB, MIB, NS_PER_MS, NS_PER_S, Unit
from grader.runtime.model.wording import listed, printable


class QuantityError(ValueError):
    """A quantity cannot be read."""

    def __init__(self, expected: str, hint: str = "") -> None:
        super().__init__(expected)
        self.expected = expected
        self.hint = hint


@dataclass(frozen=True, slots=True)
class _Kind:
    """One dimension: its words for messages, and each unit as a multiple of the stored one, largest first.

    `whole` names the stored unit if fractions of it are not allowed.
    """

    noun: str
    example: str
    units: Mapping[str, int]
    spellings: Mapping[str, str]
    usual: tuple[str, ...]
    whole: str = ""


_KINDS: Mapping[str, _Kind] = {
    "s": _Kind(
        noun="a duration",
        example="10 s",
        units={"h": 3600 * NS_PER_S, "min": 60 * NS_PER_S, "s": NS_PER_S, "ms": NS_PER_MS, "us": 1000, "ns": 1},
        spellings={
            **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
            **dict.fromkeys(("m", "mins", "minute", "minutes"), "min"),
            **dict.fromkeys(("hr", "hrs", "hour", "hours"), "h"),
            **dict.fromkeys(("msec", "millis", "millisecond", "milliseconds"), "ms"),
            **dict.fromkeys(("\N{MICRO SIGN}s", "\N{GREEK SMALL LETTER MU}s", "microseconds"), "us"),
        },
        usual=("s", "ms"),
        whole="nanoseconds",
    ),
    "Hz": _Kind(
        noun="a frequency",
        example="20 Hz",
        units={"kHz": 1000, "Hz": 1},
        spellings={"hertz": "Hz", "kilohertz": "kHz"},
        usual=("Hz",),
    ),
    "B": _Kind(
        noun="a size",
        example="512 MiB",
        units={"GiB": GIB, "MiB": MIB, "KiB": KIB, "B": 1},
        spellings={
            **dict.fromkeys(("byte", "bytes"), "B"),
            **dict.fromkeys(("k", "kb", "kilobytes"), "KiB"),
            **dict.fromkeys(("m", "mb", "megabytes"), "MiB"),
            **dict.fromkeys(("g", "gb", "gigabytes"), "GiB"),
        },
        usual=("MiB", "KiB"),
        whole="bytes",
    ),
}

# Digits are limited: an exact fraction of a million digits would take minutes.
_NUMBER = r"(?:[0-9]{1,400}(?:\.[0-9]{0,400})?|\.[0-9]{1,400})"
_QUANTITY = re.compile(rf"(?P<sign>[-+\N{{MINUS SIGN}}]?)(?P<number>{_NUMBER})\s*(?P<unit>[^\W\d_]{{0,20}})")


def parse_quantity(text: str, unit: Unit) -> int | float:
    """Parse a quantity with its unit, e.g. `200 ms`; no exponent, blanks around and between them are allowed.

    Returns:
        Whole nanoseconds for `Unit("s")`, whole bytes for `Unit("B")`, a float in hertz for `Unit("Hz")`; at least 0.

    Raises:
        QuantityError: Not a number, no unit, an unknown unit, below zero, or a fraction of a nanosecond or byte.
    """
    kind = _KINDS[unit.symbol]
    found = _QUANTITY.fullmatch(text.strip())
    if found is None:
        raise QuantityError(f"{kind.noun} such as `{kind.example}`")
    if found["sign"] not in ("", "+"):
        raise QuantityError(f"{kind.noun} of at least 0")
    if not found["unit"]:
        raise missing_unit(found["number"], unit.symbol)
    if found["unit"] not in kind.units:
        raise _unknown_unit(found["number"], found["unit"], kind)
    value = Fraction(found["number"].rstrip(".")) * kind.units[found["unit"]]
    if kind.whole and value.denominator != 1:
        raise QuantityError(f"a whole number of {kind.whole}")
    try:
        return int(value) if kind.whole else float(value)
    except OverflowError:
        raise QuantityError(f"{kind.noun} that a float can hold") from None


def _unknown_unit(number: str, written: str, kind: _Kind) -> QuantityError:
    known = {name.casefold(): name for name in kind.units} | dict(kind.spellings)
    nearest = known.get(written.casefold())
    hint = f"write `{printable(number, 30)} {nearest}`" if nearest else ""
    return QuantityError(f"{kind.noun} in {listed(list(kind.units))}", hint)


def missing_unit(number: str, symbol: str) -> QuantityError:
    """Return the error for a bare number where a quantity in `symbol` is expected."""
    kind = _KINDS[symbol]
    number = printable(number, 30)
    return QuantityError(
        f"{kind.noun} with its unit, such as `{kind.example}`",
        f"write {listed([f'`{number} {name}`' for name in kind.usual])}",
    )


def format_quantity(value: int | float, unit: Unit) -> str:
    """Return nanoseconds, bytes or hertz, finite and at least 0, in the form that `parse_quantity` reads."""
    kind = _KINDS[unit.symbol]
    if not kind.whole:
        digits = format(Decimal(repr(float(value))), "f")
        return f"{digits.removesuffix('.0')} {unit.symbol}"
    if value == 0:
        return f"0 {unit.symbol}"
    name, count = next((n, int(value) // f) for n, f in kind.units.items() if int(value) % f == 0)
    return f"{count} {name}"


def quantity_pattern(unit: Unit) -> str:
    """Return a regular expression for quantities of a dimension, for use in a JSON Schema."""
    return rf"^\s*\+?([0-9]+\.?[0-9]*|\.[0-9]+)\s*({'|'.join(_KINDS[unit.symbol].units)})\s*$"


def quantity_example(unit: Unit) -> str:
    """Return an example quantity of a dimension."""
    return _KINDS[unit.symbol].example
