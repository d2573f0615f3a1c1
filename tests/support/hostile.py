"""Programs that do harm, recorded for real: what tests of limits and of the trusted side share."""

from __future__ import annotations

import shutil
import tempfile
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader.runtime.model.limits import Limits
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.plan import Plan
from grader.runtime.session import RecordingSession
from grader.runtime.supervisor.supervisor import Job

MS = 1_000_000

#: How often something is recorded that a busy machine keeps from being recorded; each try is three on the wall clock.
BUSY_TRIES = 5
#: The beginning of every program: a right velocity publisher, which does its harm beside its work.
PUBLISHER = """
import os, socket, sys, threading, time
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Publisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.timer = self.create_timer(0.05, self.tick)
        self.count = 0
        self.harm()

    def tick(self):
        message = Twist()
        message.linear.x = 0.5
        message.angular.z = 0.1
        self.publisher.publish(message)
        self.count += 1
        self.later()

    def harm(self):
        pass

    def later(self):
        pass


def main(kind=Publisher):
    rclpy.init()
    rclpy.spin(kind())
"""

#: What a program needs to speak on its line in the place of its host.
HOST_LINE = """
def line():
    import stat
    for name in os.listdir("/proc/self/fd"):
        try:
            if stat.S_ISSOCK(os.fstat(int(name)).st_mode):
                found = socket.socket(fileno=os.dup(int(name)))
                if found.family == socket.AF_UNIX:
                    return found
        except OSError:
            pass
"""


def hostile(harm: str = "", later: str = "", before: str = "") -> str:
    """Return a right publisher that does harm when it is made, at every tick, or before everything else."""
    return "\n".join(
        (
            textwrap.dedent(before),
            PUBLISHER,
            "class Hostile(Publisher):",
            "    def harm(self):",
            textwrap.indent(textwrap.dedent(harm) or "pass", " " * 8),
            "    def later(self):",
            textwrap.indent(textwrap.dedent(later) or "pass", " " * 8),
            "main(Hostile)",
        )
    )


def staging(session: RecordingSession) -> RecordingSession:
    """Have a session copy what is recorded into its own folder, because workers see no other."""
    each = session.recorder.each

    def each_staged(jobs: Sequence[Job], progress: Callable[[str], None]) -> Iterator[AssessedTrace]:
        root = Path(tempfile.mkdtemp(dir=session.folder))
        for number, job in enumerate(jobs):
            shutil.copytree(job.plan.root, root / str(number))
        root.chmod(0o755)
        yield from each(
            [replace(j, plan=replace(j.plan, root=str(root / str(n)))) for n, j in enumerate(jobs)], progress
        )

    session.recorder.each = each_staged  # type: ignore[method-assign]
    return session


def planned(folder: Path, *programs: str, limits: Limits | None = None, **fields: Any) -> Plan:
    """Return the plan to record programs together for ten seconds, on the virtual clock unless another is named."""
    folder.mkdir(exist_ok=True)
    folder.chmod(0o755)
    names = [f"{letter}.py" for letter, _ in zip("abc", programs, strict=False)]
    for name, program in zip(names, programs, strict=True):
        (folder / name).write_text(program, encoding="utf-8")
        (folder / name).chmod(0o644)
    usual: dict[str, Any] = {
        "scenario": "alone",
        "processes": tuple((name, name) for name in names),
        "root": str(folder),
        "host_seed": "ab" * 32,
        "duration_ns": 10_000 * MS,
        "first_message_on": "",
        "wait_at_most_ns": 60_000 * MS,
        "clock": "virtual",
        "limits": limits or Limits(),
    }
    return Plan(**{**usual, **fields})


def record(session: RecordingSession, folder: Path, *programs: str, **fields: Any) -> AssessedTrace:
    """Record programs together, as `planned` and `recorded` say."""
    return recorded(session, planned(folder, *programs, **fields))


def recorded(session: RecordingSession, plan: Plan) -> AssessedTrace:
    """Record a plan; on the wall clock again while other tests keep the machine busy."""
    for _ in range(BUSY_TRIES):
        trace = session.recorder.record([Job("hostile", plan)], lambda step: None)[0]
        if not trace.harness_problem.startswith("the machine was too busy"):
            break
    return trace


def printed(trace: AssessedTrace) -> list[str]:
    """Return the lines that programs wrote to standard output."""
    return [line.text for line in trace.lines() if line.stream == "stdout"]
