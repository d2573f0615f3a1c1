"""A file beside a program that has the name of a module hides it from whatever imports it, rclpy included."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hostile import record
from tiers import but

from grader.runtime.model.trace import Trace
from grader.runtime.session import RecordingSession

pytestmark = pytest.mark.ros

S = 1_000_000_000
#: A program that imports none of the modules itself.
PROGRAM = """
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node
rclpy.init()
node = Node("driver")
out = node.create_publisher(Twist, "/cmd_vel", 10)
print("made", flush=True)
"""
#: What students call their experiments; rclpy imports all but the last two, some of them through other packages.
NAMES = ["random", "copy", "queue", "logging", "tempfile", "hashlib", "pickle", "inspect", "yaml", "calendar", "turtle"]


def outcome(trace: Trace) -> tuple[bool, str, str]:
    """Return whether the program came to its end, and the error that ended it, with its file."""
    fault = trace.faults()[0]
    text = re.sub(r"\(/[^)]*/", "(", fault.text)  # a bare process names the folder of a file
    # From Python 3.13 on, only an interpreter that was started for a file knows that it hides another, and says so.
    text = re.sub(r"partially initialized | from '\w+\.py'| \((most likely due|consider renaming) .*\)", "", text)
    return "made" in [line.text for line in trace.lines()], text, fault.file


@pytest.mark.breadth(1, 2)
@pytest.mark.parametrize("name", but(["random"], NAMES))
def test_a_hidden_module_fails_where_it_fails_for_python3(
    one_worker: RecordingSession, tmp_path: Path, name: str
) -> None:
    """An experiment uses the module of its own name, which it finds in itself."""
    tmp_path.chmod(0o755)
    folder = tmp_path / "s"
    folder.mkdir()
    (folder / f"{name}.py").write_text(f"import {name}\nprint({name}.no_such_function())\n", encoding="utf-8")
    virtual = record(one_worker, folder, PROGRAM, duration_ns=S)
    bare = record(one_worker, folder, PROGRAM, duration_ns=60 * S, clock="wall", bare=True)  # it ends by itself
    assert outcome(virtual) == outcome(bare)
    assert outcome(virtual)[0] == (name in ("calendar", "turtle"))
