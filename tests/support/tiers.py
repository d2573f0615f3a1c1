"""Which rows of a table of tests run in which tier: some by default, the rest with `--long` or `--everything`."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest
from _pytest.mark import ParameterSet

LONG, NIGHTLY = pytest.mark.long, pytest.mark.nightly


def more(values: Iterable[Any], mark: pytest.MarkDecorator = LONG) -> list[ParameterSet]:
    """Return values as parameters that the default tier leaves out."""
    return [_row(value, mark) for value in values]


def each(values: Collection[Any], step: int, mark: pytest.MarkDecorator = LONG) -> list[ParameterSet]:
    """Return values as parameters, of which the default tier takes the first and each `step`-th after it."""
    return [_row(value) if number % step == 0 else _row(value, mark) for number, value in enumerate(values)]


def but(kept: Collection[Any], values: Iterable[Any], mark: pytest.MarkDecorator = LONG) -> list[ParameterSet]:
    """Return values as parameters, of which the default tier takes those in `kept`; each of these must be there."""
    rows = list(values)
    assert all(value in rows for value in kept), kept
    return [_row(value) if value in kept else _row(value, mark) for value in rows]


def _row(value: Any, *marks: pytest.MarkDecorator) -> ParameterSet:
    values = value if isinstance(value, tuple) else (value,)
    return pytest.param(*values, marks=marks)
