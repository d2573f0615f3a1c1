"""Escaping: nothing that a student wrote can steer a terminal."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.grading.reporting.escape import ELLIPSIS, LIMIT, encoded, shown, valid_unicode

ANYTHING = st.text(alphabet=st.characters(), max_size=200)  # surrogates included


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain, 25 °C ± 1", "plain, 25 °C ± 1"),
        ("two\nlines\r", "two\\nlines\\r"),
        ("\x1b[31mred", "\\x1b[31mred"),
        ("\x9b31m", "\\x9b31m"),
        ("\u202efdp.exe", "\\u202efdp.exe"),
        ("\ud800", "\\ud800"),
        ("\U000e0041", "\\U000e0041"),
        ("a\u00a0b\tc\u3000d", "a b c d"),
        ("温度 été", "温度 été"),
        ("a" + "\u0301" * 6, "a" + "\u0301" * 3 + "\\u0301" * 3),
        ("\u2028", "\\u2028"),
        ("[bold]x[/]", "[bold]x[/]"),
    ],
)
def test_what_is_shown(text: str, expected: str) -> None:
    """Controls are named, letters of every language stay, spaces are plain."""
    assert shown(text) == expected


@given(ANYTHING)
def test_shown_text_is_one_line_of_printable_characters(text: str) -> None:
    """Whatever comes in, nothing that a terminal obeys comes out, and it can be encoded."""
    out = shown(text)
    out.encode("utf-8")
    assert len(out.splitlines()) <= 1
    assert not [c for c in out if unicodedata.category(c) in {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}]


@given(ANYTHING)
def test_showing_twice_changes_nothing(text: str) -> None:
    """A text that passed one room unharmed passes the next."""
    assert shown(shown(text)) == shown(text)


@given(ANYTHING, st.integers(min_value=1, max_value=60))
def test_a_text_is_cut_only_if_it_is_too_long(text: str, limit: int) -> None:
    """Nothing is lost below the limit, and a cut is visible."""
    whole, cut = shown(text, limit=10_000), shown(text, limit=limit)
    assert len(cut) <= limit
    if len(whole) <= limit:
        assert cut == whole
    else:
        assert cut.endswith(ELLIPSIS)
        assert whole.startswith(cut[: -len(ELLIPSIS)])


def test_a_huge_text_is_cut() -> None:
    """A line of megabytes costs no more than a long one."""
    assert len(shown("x" * 10_000_000)) == LIMIT


@given(ANYTHING)
def test_valid_unicode_replaces_surrogates_only(text: str) -> None:
    """The length stays, and only what cannot be encoded changes."""
    out = valid_unicode(text)
    out.encode("utf-8")
    assert len(out) == len(text)
    assert all(a == b or ("\ud800" <= a <= "\udfff" and b == "\ufffd") for a, b in zip(text, out, strict=True))


def test_a_poor_encoding_gets_plain_signs() -> None:
    """On an ASCII terminal the numbers and arrows can still be read."""
    assert encoded("20 ± 1 Hz ──/t──▶ 25 °C é", "ascii") == b"20 +/- 1 Hz --/t--> 25 deg C ?"
    assert encoded("20 ± 1", "utf-8") == "20 ± 1".encode()
