"""Programs for `grade verify`, and what it tells of them as JSON."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from places import GRADE

PROGRAM = """
{imports}
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        {begin}

    def tick(self):
        message = Twist()
        message.linear.x = 0.2
        self.publisher.publish(message)
        {each}


rclpy.init()
rclpy.spin(VelocityPublisher())
"""


def program(*, imports: str = "", begin: str = "pass", each: str = "pass") -> str:
    """Return a velocity publisher that also does something at its start, or with each message."""
    return PROGRAM.format(imports=imports, begin=begin, each=each)


def written(folder: Path, programs: Mapping[str, str]) -> list[str]:
    """Write each program as a submission of its own, and return their paths."""
    for name, text in programs.items():
        (folder / name).mkdir()
        (folder / name / "velocity_publisher.py").write_text(text, encoding="utf-8")
    return [str(folder / name) for name in programs]


def verified(paths: Iterable[str], *options: str, before: tuple[str, ...] = (), **variables: str) -> tuple[int, Any]:
    """Return the exit code of `grade verify`, and the JSON that it prints."""
    command = [*before, GRADE, "verify", *paths, "--json", "--no-progress", *options]
    environment = {**os.environ, **variables}
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=1800, env=environment)
    assert done.stdout, done.stderr
    return done.returncode, json.loads(done.stdout)


def differences(found: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Return the first difference of each submission, by the name of its folder."""
    differing = [one for condition in found["conditions"] for one in condition["differences"]]
    return {Path(one["submission"]).name: one for one in reversed(differing)}
