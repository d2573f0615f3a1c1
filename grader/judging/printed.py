"""Texts that a process wrote, read for the numbers in them and for their shape."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache

from grader.core.trace import LogRecord, OutputLine
from grader.judging.positions.labels import template_of
from grader.judging.positions.numbers import Printed, clean, printed_numbers, with_decimal_points
from grader.judging.wording import number

Output = LogRecord | OutputLine

#: Relative difference that a conversion with a short constant explains, such as 3.14159 for pi.
CONVERSION = 1e-4


@lru_cache(maxsize=4096)
def numbers_in(text: str) -> tuple[Printed, ...]:
    """Return the numbers of a text, those with decimal commas read both ways."""
    body = clean(text)
    other = with_decimal_points(body)
    return printed_numbers(body) + (printed_numbers(other) if other else ())


@lru_cache(maxsize=4096)
def shape_of(text: str) -> str:
    """Return a text with its numbers masked and without white space; equal for texts that say the same."""
    body = clean(text)
    return template_of(body, printed_numbers(body))


def shows_about(printed: Printed, value: float, *, coarsest: float, relative: float = CONVERSION) -> bool:
    """Return whether a printed number shows a value, computed with a short constant and printed finely enough.

    Args:
        printed: The number.
        value: What it should show.
        coarsest: Largest unit of the last digit that still tells something, unless the number is exact.
        relative: Largest relative difference that is let pass.
    """
    slack = relative * abs(value) + 1e-9
    if abs(printed.value - value) <= slack:
        return True
    return printed.step <= coarsest * (1 + 1e-9) and any(printed.shows(value + d) for d in (-slack, 0.0, slack))


def times(factor: float) -> str:
    """Return a factor for text; 1 is the value itself."""
    return "the value itself" if factor == 1 else f"{number(factor)} times the value"


def in_window(outputs: Sequence[Output], start_ns: int, stop_ns: int) -> list[Output]:
    """Return what was written in [start_ns, stop_ns)."""
    return [o for o in outputs if start_ns <= o.t_ns < stop_ns]


def number_in(text: str, pattern: str | None = None) -> float | None:
    """Return the number that a text tells: what the pattern finds in it, or its first number."""
    if pattern is not None:
        match = re.search(pattern, text[:2_000])
        if match is None:
            return None
        text = match[1] if match.re.groups and match[1] is not None else match[0]
    found = numbers_in(text)
    return found[0].value if found else None
