"""What a program logs is known by its place and level, however it makes its logs look, on each clock."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import LogRecord, Trace
from grader.runtime.plan import Plan

pytest.importorskip("rclpy")

from hostile import planned
from side_by_side import rows_of
from tiers import NIGHTLY, but, more

pytestmark = pytest.mark.ros

CLOCKS: dict[str, dict[str, Any]] = {"virtual": {}, "wall": {"clock": "wall"}, "bare": {"clock": "wall", "bare": True}}
LOOKS = {
    "a format": "os.environ['RCUTILS_CONSOLE_OUTPUT_FORMAT'] = '{severity}: {message}'",
    "colours": "os.environ['RCUTILS_COLORIZED_OUTPUT'] = '1'",
    "the other stream": "os.environ['RCUTILS_LOGGING_USE_STDOUT'] = '1'",
    "all of them": "os.environ.update(RCUTILS_CONSOLE_OUTPUT_FORMAT='{message}', RCUTILS_COLORIZED_OUTPUT='1')",
}
#: The variables are set before ROS is imported, or afterwards.
TALKER = """
import os
{before}
import rclpy
{after}
rclpy.init()
node = rclpy.create_node("talker")
node.create_timer(0.5, lambda: node.get_logger().warning("half a second"))
rclpy.spin(node)
"""


#: Each look, each place and each clock is tried by default.
DEFAULT = [
    ("before", "all of them", "virtual"),
    ("after", "the other stream", "virtual"),
    ("before", "a format", "wall"),
    ("after", "colours", "bare"),
]
VIRTUAL = list(itertools.product(["before", "after"], LOOKS, ["virtual"]))
REAL = [row for row in itertools.product(["before", "after"], LOOKS, ["wall", "bare"]) if row not in DEFAULT]


def plan(folder: Path, place: str, look: str, clock: str) -> Plan:
    program = TALKER.format(**{"before": "", "after": "", place: LOOKS[look]})
    return planned(folder, program, duration_ns=2 * NS_PER_S, **CLOCKS[clock])


@pytest.mark.breadth(1, 2)
@rows_of(plan)
@pytest.mark.parametrize(("place", "look", "clock"), [*but(DEFAULT, [*VIRTUAL, *DEFAULT[2:]]), *more(REAL, NIGHTLY)])
def test_a_log_is_a_log_whatever_it_looks_like(trace: Trace, place: str, look: str, clock: str) -> None:
    """No line of it counts as printed."""
    logs = [each for each in trace.observations if isinstance(each, LogRecord)]
    assert {(each.severity, each.logger, each.text) for each in logs} == {("WARN", "talker", "half a second")}
    assert trace.lines() == ()
