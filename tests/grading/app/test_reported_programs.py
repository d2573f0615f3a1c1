"""Programs that were once judged or explained wrongly: the same verdict and hint on both clocks and one processor."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest
from decided import grade_until_decided
from places import GRADE, REPORTED, ROOT
from tiers import each, more

from grader.grading.app.observe import ObserveRequest, observe_programs
from grader.grading.app.request import GradeRequest
from grader.grading.model.exercise import Outcome
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import ClockKind

pytestmark = pytest.mark.ros

#: Program -> the name under which it is handed in, and the line and hint of what is to be fixed first.
HINTS = {
    "stale_odometry.py": (
        "odom_subscriber.py",
        "time.sleep(1.0)",
        "time.sleep(1.0) in the callback makes messages wait in the queue: remove it",
    ),
    "stale_odometry_spin_once.py": (
        "odom_subscriber.py",
        "time.sleep(1.0)",
        "rclpy.spin_once(node, timeout_sec=0.1) takes one message, and time.sleep(1.0) makes others wait: "
        "spin continuously and log from a timer",
    ),
    "spin_once_blocks.py": (
        "velocity_publisher.py",
        "rclpy.spin_once(node)",
        "rclpy.spin_once(node) without timeout_sec waits until a message or a timer wakes the node: "
        "let create_timer(0.05, ...) publish, and call spin",
    ),
    "asyncio_sleep.py": (
        "velocity_publisher.py",
        "await asyncio.sleep(0.01)",
        "asyncio.sleep(0.01) works in asyncio's own loop only, and rclpy.spin runs callbacks without it: "
        "remove it, a timer sets the pace",
    ),
}


@pytest.mark.breadth(1, 3)
@pytest.mark.parametrize("clock", ["auto", *more(["wall"])])
@pytest.mark.parametrize("name", each(HINTS, 2))
def test_the_hint_names_the_cause(name: str, clock: str, tmp_path: Path) -> None:
    """With the line of the file."""
    wanted, code, hint = HINTS[name]
    shutil.copy(REPORTED / name, tmp_path / wanted)
    report = grade_until_decided(GradeRequest(str(tmp_path), clock=clock))
    lost = [v for e in report.exercises for v in e.verdicts if v.outcome is Outcome.NOT_MET and v.location is not None]
    assert hint in [v.hint for v in lost]
    first = next(v for v in lost if v.hint == hint)
    assert first.location is not None
    assert code in (tmp_path / wanted).read_text().splitlines()[first.location.line - 1]


@pytest.mark.nightly
def test_one_processor_is_as_good_as_several(tmp_path: Path) -> None:
    """A client that calls a service in a callback, with threads of an executor of its own: the whole report."""
    shutil.copy(REPORTED / "one_cpu/battery_service_client.py", tmp_path)
    shutil.copy(ROOT / "reference_solutions" / "battery_service_server.py", tmp_path)
    reports = []
    for few in (False, True):
        before = ("taskset", "-c", str(min(os.sched_getaffinity(0)))) if few else ()
        command = [*before, GRADE, str(tmp_path), "--all", "--seed", "1", "--json"]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
        assert done.stdout, done.stderr
        report = json.loads(done.stdout)
        assert report.pop("duration_s") > 0
        reports.append(report)
    assert reports[0] == reports[1]
    assert (reports[0]["score"], reports[0]["max_score"]) == (40, 40)


@pytest.mark.parametrize("clock", ["auto", *more(["wall"])])
def test_a_service_in_a_timer_is_answered(clock: str) -> None:
    """Once a second, by other threads of the same executor."""
    summary = observe_programs(
        ObserveRequest((REPORTED / "one_cpu/service_in_timer.py",), 6 * NS_PER_S, clock=clock), lambda _: None
    )
    texts = [record.text for record in summary.records]
    assert set(texts) == {"answer True"}
    assert len(texts) >= 3
    assert clock == "wall" or len(texts) == 5


@pytest.mark.parametrize("clock", ["auto", *more(["wall"])])
def test_there_is_a_user(clock: str) -> None:
    """By the variable, and by the user of the process."""
    summary = observe_programs(ObserveRequest((REPORTED / "user_name.py",), 5 * NS_PER_S, clock=clock), lambda _: None)
    assert [line.text for line in summary.lines] == ["student student"]
    assert [fault.exit_code for fault in summary.faults] == [0]


@pytest.mark.nightly
@pytest.mark.parametrize("clock", ["auto", *more(["wall"])])
def test_an_executor_that_virtual_time_cannot_hold_runs_on_the_wall_clock(clock: str) -> None:
    """At once, with the line that makes it as the reason."""
    summary = observe_programs(
        ObserveRequest((REPORTED / "events_executor.py",), 3 * NS_PER_S, clock=clock), lambda _: None
    )
    assert summary.clock is ClockKind.WALL
    assert clock == "wall" or "events_executor.py:22 makes an EventsExecutor" in summary.clock_reason
    assert summary.nodes == ("/counter",)
    assert summary.faults == ()
