"""The programs in `tests/programs/` say and send the same, and end alike, on both clocks.

Each uses names of rclpy that no other test program does (`benchmarks/untouched.py`), beside `partner.py`. What they do
in virtual time is in `tests/programs/told.json`; `UPDATE_GOLDEN=1` with `--long` writes it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from places import TESTS
from side_by_side import rows_of

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.plan import Plan
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import planned, recorded
from told import Told, differences, told

pytestmark = pytest.mark.ros

PROGRAMS = TESTS / "programs"
PARTNER = PROGRAMS / "partner.py"
GOLDEN = PROGRAMS / "told.json"
NAMES = sorted(path.stem for path in PROGRAMS.glob("*.py") if path != PARTNER)
#: One in so many runs by default, and those for which a host has to do something of its own.
SHARE = 31
ALWAYS = ("clock_of_the_node_jumps", "graph_counts", "graph_of_actions", "lifecycle_fails")


def marks(number: int, name: str) -> list[Any]:
    """Return the marks of a program's test in virtual time."""
    return [pytest.mark.long] if number % SHARE and name not in ALWAYS else []


def plan(folder: Path, name: str, clock: str = "virtual") -> Plan:
    texts = [path.read_text(encoding="utf-8") for path in (PROGRAMS / f"{name}.py", PARTNER)]
    return planned(folder, *texts, clock=clock, duration_ns=5 * NS_PER_S)


def told_on(clock: str, trace: AssessedTrace) -> Told:
    """Return what a program did beside its partner on a clock."""
    assert (trace.harness_problem, trace.clock.value) == ("", clock)
    assert trace.clock_reason == "" or clock == "wall"
    return told(trace)


@pytest.mark.breadth(8, 14)
@rows_of(plan)
@pytest.mark.parametrize("name", [pytest.param(name, marks=marks(n, name)) for n, name in enumerate(NAMES)])
def test_what_a_program_does_in_virtual_time(trace: AssessedTrace, name: str) -> None:
    """As it is written down; and virtual time suits it."""
    found = told_on("virtual", trace)
    known: dict[str, Any] = json.loads(GOLDEN.read_text(encoding="utf-8")) if GOLDEN.exists() else {}
    if "UPDATE_GOLDEN" in os.environ:
        text = json.dumps(dict(sorted({**known, name: found}.items())), indent=1, ensure_ascii=False)
        GOLDEN.write_text(text + "\n", encoding="utf-8")
        return
    assert found == known[name]


@pytest.mark.nightly
@pytest.mark.parametrize("name", NAMES)
def test_what_a_program_does_on_the_wall_clock(session: RecordingSession, tmp_path: Path, name: str) -> None:
    """The same, as far as it comes, in one of three recordings: a busy machine can make clocks differ, never agree."""
    known = json.loads(GOLDEN.read_text(encoding="utf-8"))
    found: list[str] = []
    for number in range(3):
        one = recorded(session, plan(tmp_path / str(number), name, "wall"))
        found = differences(known[name], told_on("wall", one))
        if not found:
            return
    assert found == []


def test_what_is_known_belongs_to_a_program() -> None:
    """No more and no fewer than there are programs."""
    assert sorted(json.loads(GOLDEN.read_text(encoding="utf-8"))) == NAMES
