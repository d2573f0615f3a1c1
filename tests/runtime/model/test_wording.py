"""Foreign text becomes one short printable line."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.runtime.model.wording import listed, printable, unused_name


@given(st.text(st.characters(exclude_categories=())), st.integers(min_value=3, max_value=100))
def test_shown_text_is_one_short_printable_line(text: str, limit: int) -> None:
    """For any input, including lone surrogates, the result is printable, encodable and no longer than asked."""
    line = printable(text, limit)
    assert line.isprintable()
    assert len(line) <= limit
    assert line.encode("utf-8").decode("utf-8") == line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("fan_controller.py", "fan_controller.py"),
        ("température.py", "température.py"),
        ("a\nb\x1b[31m", "a\\nb\\x1b[31m"),
        ("\udcff\u202e", "\\udcff\\u202e"),
        ("0123456789" * 3, "0123456789…123456789"),
    ],
)
def test_what_is_shown(text: str, line: str) -> None:
    """Letters of any language stay; control characters and surrogates are spelt out; long text loses its middle."""
    assert printable(text, 20) == line


@pytest.mark.parametrize(("names", "phrase"), [(["a"], "a"), (["a", "b"], "a or b"), (["a", "b", "c"], "a, b or c")])
def test_a_list_reads_as_a_phrase(names: list[str], phrase: str) -> None:
    """Names are joined as people write them."""
    assert listed(names) == phrase


def test_a_name_gets_a_number_only_where_it_is_used() -> None:
    assert unused_name("a.py", set()) == "a.py"
    assert unused_name("a.py", {"b.py", "a.py (2)"}) == "a.py"
    assert unused_name("a.py", {"a.py"}) == "a.py (2)"
    assert unused_name("a.py", {"a.py", "a.py (2)", "a.py (4)"}) == "a.py (3)"
