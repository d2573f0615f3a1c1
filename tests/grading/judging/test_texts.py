"""Reading numbers and their precision out of text."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.grading.judging.texts import (
    clean,
    printed_numbers,
    readings,
    template_of,
    with_dashes,
    with_decimal_points,
    with_numbers_apart,
)


def values(text: str) -> list[float]:
    return [n.value for n in printed_numbers(clean(text))]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("12", [12]),
        ("-3.5", [-3.5]),
        ("+0.5", [0.5]),
        (".5 1.", [0.5, 1]),
        ("1.25e-03", [0.00125]),
        ("1.2,3.4", [1.2, 3.4]),
        ("(1.2,-3.4)", [1.2, -3.4]),
        ("1.2-3.4", [1.2, 3.4]),
        ("\u22121.5", [-1.5]),
        ("x1.2 y-3.4", [1.2, -3.4]),
        ("1.2m 3.4m", [1.2, 3.4]),
        ("120cm 1500 mm", [1.2, 1.5]),
        ("odom1 base_link0 float64 robot_2", []),
        ("x1=2.5", [2.5]),
        ("x1 y2", [1, 2]),
        ("0x7f12ab34", []),
        ("\x1b[32m1.5\x1b[0m", [1.5]),
        ("\uff11\uff12\uff0e\uff15", [12.5]),
        ("2024-05-01", [2024, 5, 1]),
        ("speed...5 speed…0.5 speed....25", [5, 0.5, 25]),
        ("x........1.50 y.......-1.50", [1.5, -1.5]),
        ("0.5..0.7 [0..10] 10.-20. v1.2.3", [0.5, 0.7, 0, 10, 10, 20, 1.2, 0.3]),
        ("(1.5-2.5j) (-1e-05+3j) 1-2 jobs", [1.5, -2.5, -0.00001, 3, 1, 2]),
        ("5 dm 0.005km 5 km/h 120 centimetres 15 Zentimeter 150 milímetros", [0.5, 5, 5, 1.2, 0.15, 0.15]),
        ("info nano infinite", []),
        ("1e3m 0e9 1e-999", [1000, 0, 0]),
        ("", []),
        ("\x00\ud800 7", [7]),
    ],
)
def test_numbers_in_text(text: str, found: list[float]) -> None:
    """Numbers are read in every common notation; digits of names, addresses and colours are ignored."""
    assert values(text) == pytest.approx(found)


def test_printed_nan_and_inf_are_numbers_that_show_nothing() -> None:
    """A printed nan or inf keeps its place among the numbers and matches no value."""
    numbers = printed_numbers("x=nan y=-inf")
    assert [str(n.value) for n in numbers] == ["nan", "-inf"]
    assert not any(n.shows(v) for n in numbers for v in (0.0, math.nan, math.inf))


@given(
    st.floats(-50, 50, allow_nan=False),
    st.sampled_from(["{:.2f}", "{:.0f}", "{:+.4f}", "{: .3f}", "{:.3e}", "{:8.2f}", "{}", "{:g}", "{:.6}"]),
    st.sampled_from(["{}", "x={} m", "({})", "pos:{}m", "<<{}>>", "位置{}\uff0c", "[{};", "a {} b", "n° {}"]),
)
def test_a_printed_number_shows_the_value_it_was_printed_from(value: float, style: str, around: str) -> None:
    """Whatever the style and the text around it, the one number found shows the value."""
    numbers = printed_numbers(clean(around.format(style.format(value))))
    assert len(numbers) == 1
    assert numbers[0].shows(value)


@given(st.floats(-50, 50, allow_nan=False), st.integers(1, 5))
def test_a_number_shows_nothing_further_than_a_unit_of_its_last_digit(value: float, digits: int) -> None:
    """Two units of the last digit away is another number."""
    (number,) = printed_numbers(f"{value:.{digits}f}")
    assert not number.shows(value + 2.1 * 10**-digits)
    assert not number.shows(value - 2.1 * 10**-digits)


@given(st.floats(-50, 50, allow_nan=False), st.integers(0, 4))
def test_a_cut_off_number_shows_its_value(value: float, digits: int) -> None:
    """Cutting digits off is as good as rounding."""
    cut = math.trunc(value * 10**digits) / 10**digits
    (number,) = printed_numbers(f"{cut:.{digits}f}")
    assert number.shows(value)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("fan37 fan_speed_4 x-5", [37, 4, -5]),
        ("Größe12 x-.5", [12, -0.5]),
        ("robot1 at 1.5e-3 and 0x7f12", [1, 0.0015]),
        ("x=-1.5 is - 2", None),
        ("", None),
    ],
)
def test_numbers_are_read_apart_from_words(text: str, found: list[float] | None) -> None:
    """A space that is missing before a number gives a reading of its own."""
    apart = with_numbers_apart(clean(text))
    assert (apart and values(apart)) == (found and pytest.approx(found))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("x-1.72 y--0.89", [1.72, -0.89]),
        ("fan-37 x-.5 z=-2", [37, 0.5, -2]),
        ("1.5e-3 x=-1.5 is - 2", None),
        ("", None),
    ],
)
def test_dashes_are_no_signs_after_words(text: str, found: list[float] | None) -> None:
    """A dash between a word and its number gives a reading of its own."""
    dashed = with_dashes(clean(text))
    assert (dashed and values(dashed)) == (found and pytest.approx(found))


@given(st.text(max_size=40))
def test_every_text_has_as_many_readings(text: str) -> None:
    """The first reading is the text; the others differ from it or are None."""
    first, *others = readings(text)
    assert (first, len(others)) == (text, 3)
    assert text not in others


@given(st.floats(-50, 50, allow_nan=False), st.floats(-50, 50, allow_nan=False))
def test_decimal_commas_are_read(a: float, b: float) -> None:
    """`1,25; -3,50` gives the same numbers as `1.25; -3.50`."""
    pointed = f"{a:.2f}; {b:.2f}"
    read = with_decimal_points(pointed.replace(".", ","))
    assert read is not None
    assert values(read) == values(pointed)


@given(st.text(max_size=300))
def test_any_text_is_read_without_an_error(text: str) -> None:
    """Hostile text is read and masked without an exception."""
    body = clean(text)
    numbers = printed_numbers(body)
    template_of(body, numbers)


def test_endless_text_is_read_up_to_a_limit() -> None:
    """A million digits and a million numbers end in little work."""
    assert len(printed_numbers(clean("1 " * 1_000_000))) <= 160
    assert len(printed_numbers(clean("9" * 1_000_000))) == 1
    assert printed_numbers(clean("9" * 1_000_000))[0].value == math.inf


def test_texts_that_differ_in_numbers_only_share_a_template() -> None:
    """Signs, widths and digits do not matter, words do."""

    def template(text: str) -> str:
        return template_of(text, printed_numbers(text))

    assert template("x= 1.20 y=-3.4") == template("x=-11.2 y=  0.25")
    assert template("x=1") != template("y=1")
