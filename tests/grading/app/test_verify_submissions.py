"""The reference solutions and the test submissions repeat, event by event, whatever must not matter is changed."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from places import GRADE, ROOT
from sample_folders import expected, folder_of
from sandboxes import USER, unreachable, user_start
from verifying import differences, verified

from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest
from grader.grading.evidence.store import open_evidence, run_of
from grader.grading.judging.repetition import first_difference
from grader.runtime.model.checkup import NO_SANDBOX, TIERS
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.ros_installation import RosInstallation

pytestmark = [pytest.mark.ros, pytest.mark.nightly]

#: Submissions that do differ, for reasons that the page about recordings that repeat names: what Python prints about a
#: mistake shows addresses of objects, or a server is asked more often than its queue can hold.
DIFFERING = {"broken/service_callback_first", "wrong/battery_sleeps"}
#: How many submissions one command records.
AT_ONCE = 30
SOLUTIONS = ROOT / "reference_solutions"


def submissions() -> list[str]:
    """Return the submissions that have a file of an exercise, sorted, so that those of a kind are neighbours."""
    files = {path.name for path in SOLUTIONS.rglob("*.py")}
    return [name for name in sorted(expected()) if any(p.name in files for p in folder_of(name).rglob("*.py"))]


def cases() -> list[Any]:
    """Return the names of each command."""
    names = submissions()
    return [pytest.param(names[n : n + AT_ONCE], id=str(n)) for n in range(0, len(names), AT_ONCE)]


@pytest.mark.parametrize("names", cases())
def test_submissions_repeat(names: list[str]) -> None:
    """Those that are recorded in virtual time."""
    _, found = verified([str(folder_of(name)) for name in names])
    shown = {name for name in names if Path(name).name in differences(found)}
    assert shown <= DIFFERING, [differences(found)[Path(name).name] for name in shown - DIFFERING]
    assert found["problems"] == []
    for tried in found["conditions"]:
        assert tried["state"] != "failed", tried["why"]
        assert tried["compared"] > 0


def test_the_reference_solutions_repeat() -> None:
    """All of them are recorded in virtual time."""
    code, found = verified([str(SOLUTIONS)])
    assert (code, differences(found), found["not_comparable"]) == (0, {}, [])


# --- sandboxes and users ----------------------------------------------------------------------------------------------


def recorded(kept: Path, *options: str, before: tuple[str, ...] = (), **variables: str) -> Mapping[Any, AssessedTrace]:
    """Return recordings of the reference solutions, with their graph; skip where the sandbox is not there."""
    words = [GRADE, str(SOLUTIONS), "--seed", "1", "--no-progress", "-o", f"evidence={kept}", *options]
    environment = {**os.environ, **variables}
    done = subprocess.run([*before, *words], capture_output=True, text=True, check=False, env=environment)
    if done.returncode == 2 and "isolation" in done.stderr:
        pytest.skip(done.stderr.splitlines()[0])
    exercises = read_exercises(GradeRequest(str(SOLUTIONS), every=True), [])
    return run_of(open_evidence(kept), exercises, verify=True).traces


def differing(first: Mapping[Any, AssessedTrace], other: Mapping[Any, AssessedTrace]) -> dict[Any, object]:
    """Return the first difference of each scenario that has one."""
    assert first.keys() == other.keys()
    found = {key: first_difference(trace, other[key], {}) for key, trace in first.items()}
    return {key: one for key, one in found.items() if one is not None}


@pytest.mark.sandbox
@pytest.mark.parametrize("tier", [name for name in TIERS if name != NO_SANDBOX])
def test_the_same_happens_in_each_sandbox(tier: str, tmp_path: Path) -> None:
    """As without one."""
    other = recorded(tmp_path / "other", "--isolation", tier)
    assert differing(recorded(tmp_path / "none", "--isolation", NO_SANDBOX), other) == {}


@pytest.mark.sandbox
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_the_same_happens_for_another_user(open_folder: Path, ros: RosInstallation) -> None:
    """Who has another sandbox than root."""
    before = user_start(ros)
    if why := unreachable(before, ros):
        pytest.skip(why)
    home = open_folder / "home"
    home.mkdir()
    os.chown(home, USER, USER)
    own = {"HOME": str(home), "XDG_CACHE_HOME": str(home), "TMPDIR": str(home)}
    other = recorded(home / "kept", before=before, **own)
    assert differing(recorded(open_folder / "root"), other) == {}
