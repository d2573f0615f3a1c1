"""The reference solutions and the test submissions repeat, event by event, under conditions that must not matter."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from places import ROOT
from sample_folders import expected, folder_of
from verifying import differences, verified

pytestmark = pytest.mark.ros

#: Submissions that do differ, for reasons that the page about recordings that repeat names: what Python prints about a
#: mistake shows addresses of objects, or a server is asked more often than its queue can hold.
DIFFERING = {"broken/service_callback_first", "wrong/battery_sleeps"}
#: The conditions that a share of the submissions is recorded under in each run, and all of them with `--everything`.
SHARED_OUT = ("order", "executed", "load", "processors", "bubblewrap-flat")
#: How many submissions a run that is not complete takes, and how many one command records in a complete one.
TAKEN, AT_ONCE = 60, 30


def submissions() -> list[str]:
    """Return the submissions that have a file of an exercise, sorted, so that those of a kind are neighbours."""
    files = {path.name for path in (ROOT / "reference_solutions").rglob("*.py")}
    return [name for name in sorted(expected()) if any(p.name in files for p in folder_of(name).rglob("*.py"))]


def cases() -> list[Any]:
    """Return names and condition of each command: a few programs of each kind, or with `--everything` all."""
    names = submissions()
    taken = names[:: len(names) // TAKEN][:TAKEN]
    each = len(SHARED_OUT)
    few = [pytest.param(taken[n::each], one, id=f"{one}-some") for n, one in enumerate(SHARED_OUT)]
    parts = [names[n : n + AT_ONCE] for n in range(0, len(names), AT_ONCE)]
    return few + [
        pytest.param(part, one, id=f"{one}-{n}", marks=pytest.mark.nightly)
        for one in SHARED_OUT
        for n, part in enumerate(parts)
    ]


@pytest.mark.nightly
@pytest.mark.parametrize(("names", "condition"), cases())
def test_submissions_repeat(names: list[str], condition: str) -> None:
    """Those that are recorded in virtual time."""
    _, found = verified([str(folder_of(name)) for name in names], "--condition", condition)
    (tried,) = found["conditions"]
    if tried["state"] == "not_tried":
        pytest.skip(tried["why"])
    shown = {name for name in names if Path(name).name in differences(found)}
    assert shown <= DIFFERING, [differences(found)[Path(name).name] for name in shown - DIFFERING]
    assert found["problems"] == []
    assert tried["state"] != "failed", tried["why"]
    assert tried["compared"] > 0


@pytest.mark.nightly
@pytest.mark.parametrize(
    "options",
    [
        pytest.param(["--condition", "load", "--condition", "together"], id="some"),
        pytest.param([], id="all", marks=pytest.mark.nightly),
    ],
)
def test_the_reference_solutions_repeat(options: list[str]) -> None:
    """All of them are recorded in virtual time."""
    code, found = verified([str(ROOT / "reference_solutions")], *options)
    assert (code, differences(found), found["not_comparable"]) == (0, {}, [])
