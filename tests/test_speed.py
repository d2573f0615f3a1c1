"""The benchmark of speed: that it counts virtual seconds, measures a small run, and warns of what has grown."""

import json
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT

BENCHMARKS = ROOT / "benchmarks"


@pytest.mark.parametrize(
    ("now", "before", "grown"),
    [
        ({"plain_starts": 2.4}, {"plain_starts": 2.0}, []),
        ({"plain_starts": 2.5}, {"plain_starts": 2.0}, ["plain_starts of a small run: 2.5, and 2 before"]),
        ({"instructions": None}, {"instructions": 5}, []),
        ({"instructions": 5}, {"instructions": None}, []),
        ({"instructions": 5}, {}, []),
    ],
)
def test_only_growth_by_more_than_a_fifth_is_warned_of(
    monkeypatch: pytest.MonkeyPatch,
    now: dict[str, float | None],
    before: dict[str, float | None],
    grown: list[str],
) -> None:
    """What cannot be counted, here or before, is not compared."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    assert runpy.run_path(str(BENCHMARKS / "speed.py"))["warnings"](now, before) == grown


@pytest.mark.nightly
@pytest.mark.ros
@pytest.mark.skipif(shutil.which("perf") is None, reason="perf is not installed")
def test_virtual_seconds_are_those_of_all_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rubrics observe the five scenarios for 26 s, 28 s, and between 11 s and 24 s."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    speed = runpy.run_path(str(BENCHMARKS / "speed.py"))
    assert 26 + 28 + 11 + 19 + 20 - 5 < speed["observed_s"](speed["GRADE"]) < 26 + 28 + 15 + 21 + 24 + 5


@pytest.mark.long
@pytest.mark.ros
@pytest.mark.skipif(shutil.which("perf") is None, reason="perf is not installed")
def test_a_small_run_is_measured_and_kept(tmp_path: Path) -> None:
    """In starts of a node: more than one, because grading starts several processes."""
    before, kept = tmp_path / "before.json", tmp_path / "kept.json"
    before.write_text('{"plain_starts": 0.5}')
    options = ["--runs", "1", "--keep", str(kept), "--warn", str(before)]
    command = [sys.executable, str(BENCHMARKS / "speed.py"), *options]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = json.loads(kept.read_text())
    assert set(found) == set(json.loads((BENCHMARKS / "small_run.json").read_text()))
    assert found["plain_starts"] > 1
    assert "::warning title=Grading got slower::plain_starts of a small run: " in done.stdout
