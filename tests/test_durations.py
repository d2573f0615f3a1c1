"""The tool that says what tests cost, and the shards that it makes of their files."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from durations import KEPT, Cost, costs, files_of_tests, shards, table

#: A test that starts a process which computes, and one that does nothing.
TESTS = """
import subprocess, sys
import pytest

@pytest.mark.slow
def test_computes():
    code = "import time\\nwhile time.process_time() < 0.3: pass"
    subprocess.run([sys.executable, "-c", code], check=True)

def test_nothing():
    pass
"""


def test_each_file_is_in_one_shard() -> None:
    """Also one that nothing is known of."""
    files = [*files_of_tests(), "tests/test_new.py"]
    found = shards(files, json.loads(KEPT.read_text(encoding="utf-8")), 3)
    assert sorted(file for shard in found for file in shard) == sorted(files)


def test_shards_cost_about_the_same() -> None:
    """As far as the dearest file allows."""
    assert shards("abcdef", {"a": 7, "b": 1, "c": 2, "d": 2, "e": 1, "f": 1}, 2) == [["a"], ["c", "d", "b", "e", "f"]]


def test_what_is_kept_is_known() -> None:
    """A file that has gone costs nothing."""
    assert set(json.loads(KEPT.read_text(encoding="utf-8"))) <= set(files_of_tests())


def test_costs_are_those_of_all_processes_of_a_test(tmp_path: Path) -> None:
    """Read from the results of pytest, as the suite's own fixtures write them."""
    source = Path(__file__).parent / "conftest.py"
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "conftest.py").write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "tests" / "test_some.py").write_text(TESTS, encoding="utf-8")
    options = [
        "-c",
        str(source.parents[1] / "pyproject.toml"),
        "--rootdir",
        str(tmp_path),
        f"--junitxml={tmp_path}/r.xml",
    ]
    subprocess.run([sys.executable, "-m", "pytest", "-q", *options, str(tmp_path / "tests")], check=True)
    some = {cost.name: cost for cost in costs([tmp_path / "r.xml"])}
    assert some["test_computes"].processor_s >= 0.3
    assert some["test_computes"].file == "tests/test_some.py"
    assert "slow" in some["test_computes"].markers
    assert "fast" in some["test_nothing"].markers


def test_a_dear_test_is_listed() -> None:
    """Beside the sums of its folder, its markers and its file."""
    tests = [Cost("tests/a/test_b.py", "test_c", ("ros", "slow"), 12.0, 30.0), Cost("tests/test_d.py", "e", (), 1, 1)]
    assert table(tests).splitlines() == [
        "     13.0      31.0      2  all",
        "",
        "folder",
        "     12.0      30.0      1  a",
        "      1.0       1.0      1  .",
        "",
        "marker",
        "     12.0      30.0      1  ros",
        "     12.0      30.0      1  slow",
        "",
        "file",
        "     12.0      30.0      1  tests/a/test_b.py",
        "      1.0       1.0      1  tests/test_d.py",
        "",
        "above 10 s of a processor",
        "     12.0      30.0      1  tests/a/test_b.py::test_c",
    ]
