"""A rubric with a check of its own, for tests: what an author writes."""

from pathlib import Path

CHECKS_FILE = '''\
"""Checks on pumps."""

from __future__ import annotations

from dataclasses import dataclass

from grader.grading.model.exercise import Finding
from grader.runtime.model.quantities import DurationNs
from grader.runtime.model.trace import Trace
from grader.testing import met, not_met


@dataclass(frozen=True, slots=True)
class StartsEarly:
    """The first message on a topic comes within a time.

    Attributes:
        topic: Topic name.
        within: Longest time to wait.
    """

    topic: str
    within: DurationNs

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if it does."""
        first = next(iter(trace.messages(self.topic)), None)
        if first is None:
            raise LookupError("nobody thought of silence")
        if first.t_ns > self.within:
            return not_met(f"{self.topic}: the first message came too late", {"first_s": first.t_ns / 1e9})
        return met(f"{self.topic}: the first message came early enough")


CHECKS = {"starts_early": StartsEarly}
'''

RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: pump, number: "7", title: A pump}
files: [pump.py]
checks: [pump_checks.py]
scenarios:
  - id: alone
    processes: [pump.py]
    observe: {duration: 2 s}
criteria:
  - id: early
    title: Starts early
    points: 10
    scenario: alone
    check:
      starts_early: {topic: /flow, within: 500 ms}
    hint: start at once
"""

PUMP = """\
import rclpy
from std_msgs.msg import Float32

rclpy.init()
node = rclpy.create_node("pump")
publisher = node.create_publisher(Float32, "flow", 10)
node.create_timer(PERIOD, lambda: publisher.publish(Float32(data=1.5)))
rclpy.spin(node)
"""


def write_rubric(folder: Path, rubric: str = RUBRIC, checks: str = CHECKS_FILE) -> Path:
    """Write the rubric and the file of checks beside it."""
    (folder / "pump_checks.py").write_text(checks, encoding="utf-8")
    (folder / "pump.yaml").write_text(rubric, encoding="utf-8")
    return folder / "pump.yaml"
