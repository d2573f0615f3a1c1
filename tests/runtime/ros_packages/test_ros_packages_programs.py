"""Programs as students and tutorials write them, ten for each of the packages that the grader lends, on both clocks."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

from grader.grading.app.observe import ObserveRequest, observe_programs
from grader.runtime.model.quantities import NS_PER_S

pytestmark = pytest.mark.ros

PROGRAMS = Path(__file__).parent / "programs"
#: How long a program may take: it ends by itself long before, also on a busy machine.
DURATION_NS = 60 * NS_PER_S
FOLDERS = ("angles", "clouds", "filters", "images", "tf2")
FILES = sorted(path.relative_to(PROGRAMS).as_posix() for path in PROGRAMS.rglob("*.py"))
#: Those of the default run.
DEFAULT = {("images/red_ball.py", "auto"), ("tf2/awaiting.py", "auto")}
#: Those that `--long` adds; all others run every night.
LONG = {
    ("angles/yaw_of_odometry.py", "auto"),
    ("clouds/pass_through.py", "auto"),
    ("filters/near_stamps.py", "auto"),
    ("filters/without_headers.py", "wall"),
    ("tf2/own_thread.py", "auto"),
    ("tf2/waiting_in_a_callback.py", "wall"),
    *((file, "auto") for file in FILES[::5]),
} - DEFAULT
CASES = [
    pytest.param(
        file,
        clock,
        id=f"{file.removesuffix('.py')}-{clock}",
        marks=() if (file, clock) in DEFAULT else pytest.mark.long if (file, clock) in LONG else pytest.mark.nightly,
    )
    for clock in ("auto", "wall")
    for file in FILES
]


def told(text: str, word: str) -> list[str]:
    """Return what a program says of itself at its end: what it needs, logs, and how often a package warns."""
    return re.findall(rf"^# {word}: (.*)$", text, re.MULTILINE)


def test_there_are_ten_programs_for_each_package() -> None:
    """Each of them logs something."""
    assert {folder: sum(file.startswith(f"{folder}/") for file in FILES) for folder in FOLDERS} == dict.fromkeys(
        FOLDERS, 10
    )
    assert all(told((PROGRAMS / file).read_text(), "logs") for file in FILES)


@pytest.mark.breadth(1, 4)
@pytest.mark.parametrize(("file", "clock"), CASES)
def test_a_program_does_what_the_documentation_promises(file: str, clock: str) -> None:
    """It logs what it says, ends in peace, and needs no wall clock."""
    path = PROGRAMS / file
    text = path.read_text()
    for module in told(text, "needs"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed")
    summary = observe_programs(ObserveRequest((path,), DURATION_NS, clock=clock), lambda _: None)
    own = [record for record in summary.records if not record.logger.startswith("message_filters")]
    assert [record.text for record in own] == told(text, "logs"), (summary.faults, summary.lines)
    assert [fault.text for fault in summary.faults if fault.exit_code != 0] == []
    assert len(summary.records) - len(own) == int("".join(told(text, "warns")) or "0")
    if clock == "auto":
        assert summary.clock_reason == ""
