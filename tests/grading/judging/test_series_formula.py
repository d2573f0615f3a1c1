"""Formulas: what they may say, what they come to, and that nothing else is ever run."""

from __future__ import annotations

import math

import pytest

from grader.grading.judging.series import FormulaError, curve


@pytest.mark.parametrize(
    ("text", "at_3"),
    [
        ("sin(0.1 * n)", math.sin(0.3)),
        ("-n + 2", -1.0),
        ("2 ** n % 5", 3.0),
        ("abs(cos(n)) / floor(2.5)", abs(math.cos(3)) / 2),
        ("sqrt(exp(n)) * pi", math.sqrt(math.exp(3)) * math.pi),
        (" t ", 0.5),
        ("10", 10.0),
    ],
)
def test_a_formula_has_a_value(text: str, at_3: float) -> None:
    """At n = 3, t = 0.5."""
    assert curve(text).at(3, 0.5) == pytest.approx(at_3)


@pytest.mark.parametrize("text", ["sqrt(-n)", "1 / (n - 3)", "10 ** (100 * n ** n)", "exp(999 * n)", "(-8) ** 0.5"])
def test_where_there_is_no_value_it_is_no_number(text: str) -> None:
    """Roots of negative numbers, divisions by zero and what is too large."""
    assert math.isnan(curve(text).at(3))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "n; t",
        "__import__('os')",
        "n.real",
        "[n]",
        "lambda: n",
        "sin",
        "sin(n, t)",
        "sin(*n)",
        "sin(x=n)",
        "open(n)",
        "'a' * n",
        "True",
        "1j",
        "n if t else 2",
        "n < 3",
        "n // 2",
        "x + 1",
        "(" * 150 + "n" + ")" * 40,
        "n" + " + n" * 100,
        "\0",
    ],
)
def test_nothing_else_is_a_formula(text: str) -> None:
    """Names, attributes, comparisons and calls of anything else are refused when read."""
    with pytest.raises(FormulaError):
        curve(text)


def test_sine_and_cosine_can_be_taken_for_each_other() -> None:
    """Other functions stay."""
    other = curve("exp(n) + sin(n)").mistaken
    assert other is not None
    assert other.at(0.7) == pytest.approx(math.exp(0.7) + math.cos(0.7))
    assert curve("exp(n)").mistaken is None


def test_a_formula_of_fields_names_them_in_order() -> None:
    """By their paths, each once; a function and pi are no fields."""
    formula = curve("sin(pose.theta / 2) * pi + ranges[0] - n + pose.theta", of_fields=True)
    assert formula.names == ("pose.theta", "ranges[0]", "n")
    assert formula.of({"pose.theta": math.pi, "ranges[0]": 2.0, "n": 1.0}) == pytest.approx(2 * math.pi + 1)


@pytest.mark.parametrize("text", ["a()", "a.b(1)", "a[b]", "a['b']", "(a + b).c", "[1].a", "a if b else c"])
def test_a_formula_of_fields_is_nothing_else(text: str) -> None:
    """No call, no index that is not a number."""
    with pytest.raises(FormulaError):
        curve(text, of_fields=True)
