"""Which numbers of a text are an x and a y, by their labels."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.api.unstable import clean, printed_numbers
from grader.grading.rubrics.exercise_checks import known_checks

OWN = sys.modules[known_checks()["logs_position"].__module__]


def candidates(text: str) -> Sequence[tuple[int, int]]:
    found: Sequence[tuple[int, int]] = OWN.candidate_pairs(text, printed_numbers(text))
    return found


@pytest.mark.parametrize(
    ("text", "pairs"),
    [
        ("x=1 y=2", [(0, 1)]),
        ("y=1 x=2", [(1, 0)]),
        ("(x, y) = (1, 2)", [(0, 1)]),
        ("(y, x) = (1, 2)", [(1, 0)]),
        ("1 x, 2 y, 3 z", [(0, 1)]),
        ("1 2", [(0, 1)]),
        ("a 1 b 2 c 3", [(0, 1), (0, 2), (1, 2)]),
        ("x=1", []),
        ("x: 1 y: 2 z: 3 x: 4 y: 5", [(0, 1), (3, 4)]),
    ],
)
def test_pairs_that_can_be_x_and_y(text: str, pairs: list[tuple[int, int]]) -> None:
    """Labels before, after or in a list decide; without labels x comes first."""
    assert set(pairs) <= set(candidates(text))
    assert not pairs or (pairs[0][1], pairs[0][0]) not in candidates(text)


@given(st.text(max_size=300))
def test_any_text_is_paired_without_an_error(text: str) -> None:
    """Hostile text has pairs, or none."""
    candidates(clean(text))
