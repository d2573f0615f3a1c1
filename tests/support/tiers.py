"""Which rows of a table of tests run in which tier: some by default, the rest with `--long` or `--everything`."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Collection, Iterable
from typing import Any

import pytest
from _pytest.mark import ParameterSet

LONG, NIGHTLY = pytest.mark.long, pytest.mark.nightly
#: The tier of isolation that grading chooses for who runs the tests.
USUAL_TIER = "bubblewrap-root" if os.geteuid() == 0 else "bubblewrap"


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


def tiers(*names: str, usual: str = USUAL_TIER) -> list[ParameterSet]:
    """Return tiers of isolation as parameters: one by default, each kind as long tests, other users nightly."""
    marks = {name: (NIGHTLY,) if name.endswith("-user") else (LONG,) for name in names if name != usual}
    return [pytest.param(name, marks=marks.get(name, ())) for name in names]


def spread(items: list[pytest.Item]) -> None:
    """Leave to the later tiers the rows of tables beyond those that `breadth` gives to the earlier ones.

    Those that stay are spread over the table. Rows that are marked already count for their own tier.
    """
    tables: dict[str, list[pytest.Item]] = defaultdict(list)
    for item in items:
        if item.get_closest_marker("breadth"):
            tables[item.nodeid.partition("[")[0]].append(item)
    for rows in tables.values():
        marker = rows[0].get_closest_marker("breadth")
        assert marker is not None
        for count, tier, later in zip(marker.args, ("", "long"), ("long", "nightly"), strict=True):
            there = [row for row in rows if tier_of(row) == tier]
            share = count / max(len(there), 1)
            for number, row in enumerate(there):
                if not count or (number and int(number * share) == int((number - 1) * share)):
                    row.add_marker(later)


def tier_of(item: pytest.Item) -> str:
    """Return the tier that the markers of a test leave it to; empty for the default one."""
    return next((name for name in ("nightly", "long") if item.get_closest_marker(name)), "")
