"""The tool that runs tests many times: it counts failures for each test, and says whether there were any."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

REPEAT = Path(__file__).with_name("repeat.py")
#: Fails in each second run, with a clean-up that fails too.
TESTS = """
import pytest

@pytest.fixture
def runs(request):
    path = request.path.with_name("runs")
    with path.open("a") as file:
        file.write("x")
    runs = path.stat().st_size
    yield runs
    assert runs % 2

def test_second(runs):
    assert runs % 2, f"run {runs}"

def test_skipped():
    pytest.skip("never")

@pytest.mark.parametrize("text", ["::", "a b"])
def test_fine(text):
    pass
"""


def repeat(*arguments: Path | str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, REPEAT, *arguments, "-p", "no:cacheprovider"]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.nightly
def test_failures_are_counted_for_each_test(tmp_path: Path) -> None:
    """With and without load, once for each run; the first failure is shown."""
    (tmp_path / "test_odd.py").write_text(TESTS, encoding="utf-8")
    done = repeat("--times", "3", "--busy", "1", tmp_path / "test_odd.py")
    rows = {line.rpartition("test_odd.py")[2].split()[0]: line.split()[-6:] for line in done.stdout.splitlines()[1:4]}
    assert rows == {
        "(4)": ["2", "1", "2", "1", "0", "1"],
        "::test_second": ["2", "1", "0", "1", "0", "0"],
        "::test_skipped": ["2", "0", "2", "1", "0", "1"],
    }
    assert ("run 2" in done.stdout, done.returncode) == (True, 1)
    assert [line.partition(":")[0] for line in done.stderr.splitlines()] == [
        "run 1 of 3",
        "run 2 of 3",
        "run 3 of 3, busy",
    ]
    passed = repeat("--times", "1", "--busy", "0", tmp_path / "test_odd.py", "-k", "fine")
    assert (passed.returncode, len(passed.stdout.splitlines())) == (0, 2)


def test_what_pytest_cannot_run_is_no_result(tmp_path: Path) -> None:
    """It is shown, with an exit code of its own."""
    done = repeat("--times", "2", "--busy", "0", tmp_path / "nothing.py")
    assert (done.returncode, "file or directory not found" in done.stdout) == (2, True)
