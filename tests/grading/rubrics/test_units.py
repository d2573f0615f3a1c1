"""Quantities with units are read exactly and printed back."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.grading.rubrics.units import QuantityError, format_quantity, parse_quantity, quantity_pattern
from grader.runtime.model.quantities import Unit

SECONDS = Unit("s")
HERTZ = Unit("Hz")


@pytest.mark.parametrize(
    ("text", "ns"),
    [
        ("10 s", 10_000_000_000),
        ("200 ms", 200_000_000),
        ("2 min", 120_000_000_000),
        ("1 h", 3_600_000_000_000),
        ("7 us", 7_000),
        ("3ns", 3),
        ("0.1 s", 100_000_000),
        (".5s", 500_000_000),
        (" +1.000000001 s ", 1_000_000_001),
        ("0 s", 0),
    ],
)
def test_a_duration_is_whole_nanoseconds(text: str, ns: int) -> None:
    """Durations in every unit become exact integers."""
    got = parse_quantity(text, SECONDS)
    assert got == ns
    assert isinstance(got, int)


@pytest.mark.parametrize(("text", "hz"), [("20 Hz", 20.0), ("0.5 kHz", 500.0), ("0.25Hz", 0.25)])
def test_a_frequency_is_hertz(text: str, hz: float) -> None:
    """Frequencies become floats in hertz."""
    got = parse_quantity(text, HERTZ)
    assert got == hz
    assert isinstance(got, float)


@pytest.mark.parametrize(
    ("text", "unit", "expected", "hint"),
    [
        ("10", SECONDS, "a duration with its unit, such as `10 s`", "write `10 s` or `10 ms`"),
        ("20", HERTZ, "a frequency with its unit, such as `20 Hz`", "write `20 Hz`"),
        ("10 sec", SECONDS, "a duration in h, min, s, ms, us or ns", "write `10 s`"),
        ("5 \N{MICRO SIGN}s", SECONDS, "a duration in h, min, s, ms, us or ns", "write `5 us`"),
        ("5 hz", HERTZ, "a frequency in kHz or Hz", "write `5 Hz`"),
        ("5 Hz", SECONDS, "a duration in h, min, s, ms, us or ns", ""),
        ("-1 s", SECONDS, "a duration of at least 0", ""),
        ("0.5 ns", SECONDS, "a whole number of nanoseconds", ""),
        ("soon", SECONDS, "a duration such as `10 s`", ""),
        ("", SECONDS, "a duration such as `10 s`", ""),
        ("1e9 s", SECONDS, "a duration such as `10 s`", ""),
        ("nan Hz", HERTZ, "a frequency such as `20 Hz`", ""),
        ("1 s 2", SECONDS, "a duration such as `10 s`", ""),
        ("9" * 400 + " kHz", HERTZ, "a frequency that a float can hold", ""),
        ("9" * 100_000 + " s", SECONDS, "a duration such as `10 s`", ""),
    ],
)
def test_what_is_no_quantity_says_what_should_stand_there(text: str, unit: Unit, expected: str, hint: str) -> None:
    """Missing units, unknown units and anything else are refused with the remedy where one is likely."""
    with pytest.raises(QuantityError) as caught:
        parse_quantity(text, unit)
    assert (caught.value.expected, caught.value.hint) == (expected, hint)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (10_000_000_000, SECONDS, "10 s"),
        (200_000_000, SECONDS, "200 ms"),
        (120_000_000_000, SECONDS, "2 min"),
        (90_000_000_000, SECONDS, "90 s"),
        (0, SECONDS, "0 s"),
        (20.0, HERTZ, "20 Hz"),
        (0.25, HERTZ, "0.25 Hz"),
        (1e-9, HERTZ, "0.000000001 Hz"),
    ],
)
def test_a_quantity_prints_in_its_largest_whole_unit(value: float, unit: Unit, text: str) -> None:
    """Durations print without fractions, frequencies without exponents."""
    assert format_quantity(value, unit) == text


@given(st.integers(min_value=0, max_value=10**20))
def test_a_printed_duration_reads_back(t_ns: int) -> None:
    """No nanosecond is lost between printing and reading."""
    assert parse_quantity(format_quantity(t_ns, SECONDS), SECONDS) == t_ns


@given(st.floats(min_value=0, max_value=1e300))
def test_a_printed_frequency_reads_back(hz: float) -> None:
    """No bit of a frequency is lost between printing and reading."""
    assert parse_quantity(format_quantity(hz, HERTZ), HERTZ) == hz


def is_readable(text: str, unit: Unit) -> bool:
    try:
        return parse_quantity(text, unit) >= 0
    except QuantityError as error:
        return not error.expected


@given(st.text(max_size=20))
def test_any_text_is_read_or_refused(text: str) -> None:
    """Whatever is written, the answer is a quantity or a QuantityError."""
    assert is_readable(text, SECONDS) in (True, False)
    assert is_readable(text, HERTZ) in (True, False)


@pytest.mark.parametrize("text", ["10 s", "0.5 s", ".5ms", "+1 min", "3 h", "10", "10 sec", "-1 s", "s", "5 Hz"])
def test_the_editors_pattern_agrees_with_the_reader(text: str) -> None:
    """An editor marks what the reader would refuse, and nothing else."""
    assert (re.search(quantity_pattern(SECONDS), text) is not None) == is_readable(text, SECONDS)
