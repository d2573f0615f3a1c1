"""What a program prints of its exceptions and stacks is what it prints without the grader."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from tiers import NIGHTLY, but, more

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import Trace
from grader.runtime.plan import Plan

pytest.importorskip("rclpy")

from hostile import planned
from sandboxes import DOMAIN
from side_by_side import rows_of

pytestmark = pytest.mark.ros

BEGIN = """
import asyncio, logging, sys, threading, time, traceback
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

rclpy.init()
node = Node("n")
"""
#: Each ends at once, and writes what Python says to the standard error stream.
PROGRAMS = {
    "a wrong class": "node.create_publisher(str, '/words', 10)",
    "a wrong message": "node.create_publisher(String, '/words', 10).publish('hello')",
    "no callback": "node.create_subscription(String, '/words', 10)",
    "a second node of a context that is shut down": "rclpy.shutdown()\nNode('m')",
    "a pause without a number": "time.sleep('1')",
    "a pause below zero": "time.sleep(-1)",
    "a pause of no number": "time.sleep(float('nan'))",
    "an endless pause": "time.sleep(float('inf'))",
    "too long a pause": "time.sleep(10**12)",
    "a spin": "node.create_timer(0.1, lambda: 1 / 0)\nrclpy.spin(node)",
    "a wrong domain": "rclpy.init(context=rclpy.Context(), domain_id='1')",
    "a thread": "thread = threading.Thread(target=lambda: time.sleep('1'))\nthread.start()\nthread.join()",
    "a timer of Python": "threading.Timer(0.1, lambda: node.create_publisher(str, '/words', 10)).start()",
    "a chain": "try:\n    node.create_publisher(str, '/words', 10)\nexcept Exception:\n    time.sleep(None)",
    "a cause": "try:\n    time.sleep(None)\nexcept Exception as error:\n    raise ValueError('no') from error",
    "a group": (
        "try:\n    time.sleep(None)\n"
        "except Exception as error:\n    raise ExceptionGroup('several', [error, ValueError()])"
    ),
    "an exception that cannot be changed": (
        "import dataclasses\n@dataclasses.dataclass(frozen=True)\nclass Bad(Exception):\n    code: int\nraise Bad(3)"
    ),
    "one in a thread": (
        "import dataclasses\n@dataclasses.dataclass(frozen=True)\nclass Bad(Exception):\n    code: int\n"
        "def work():\n    raise Bad(3)\nthread = threading.Thread(target=work)\nthread.start()\nthread.join()"
    ),
    "print_exc": "try:\n    node.create_publisher(str, '/words', 10)\nexcept Exception:\n    traceback.print_exc()",
    "print_exc, the last two": "try:\n    time.sleep(None)\nexcept Exception:\n    traceback.print_exc(-2)",
    "logging": "try:\n    time.sleep(None)\nexcept Exception:\n    logging.exception('failed')",
    "print_stack": "node.create_timer(0.1, lambda: (traceback.print_stack(), sys.exit()))\nrclpy.spin(node)",
    "the stack of a walk": (
        "def work():\n    print(traceback.StackSummary.extract(traceback.walk_stack(None)), file=sys.stderr)\nwork()"
    ),
    "a task": (
        "async def fail():\n    time.sleep(None)\n"
        "async def main():\n    asyncio.create_task(fail())\n    await asyncio.sleep(0.1)\n"
        "asyncio.run(main())"
    ),
}


def normalised(printed: str) -> list[str]:
    """Return the lines that were printed, without empty ones, which are not recorded, and the addresses of objects."""
    return [re.sub(r"0x[0-9a-f]+", "0x", line) for line in printed.splitlines() if line.strip()]


def plan(folder: Path, name: str, clock: str) -> Plan:
    return planned(folder, text(name), clock=clock, duration_ns=2 * NS_PER_S)


def text(name: str) -> str:
    return BEGIN + PROGRAMS[name] + "\n"


#: By default: from a callback, from a thread beside it, and one that the grader cannot add to.
DEFAULT = [("a spin", "virtual"), ("a timer of Python", "virtual"), ("an exception that cannot be changed", "virtual")]


@pytest.mark.breadth(3, 6)
@rows_of(plan)
@pytest.mark.parametrize(
    ("name", "clock"),
    [
        *but(DEFAULT, [(name, "virtual") for name in PROGRAMS]),
        *more([("a spin", "wall"), ("one in a thread", "wall")]),
        *more([(name, "wall") for name in PROGRAMS if name not in ("a spin", "one in a thread")], NIGHTLY),
    ],
)
def test_a_traceback_is_that_of_plain_python(trace: Trace, tmp_path: Path, name: str, clock: str) -> None:
    """Line by line, without frames of the grader."""
    plain = tmp_path / "a.py"
    plain.write_text(text(name), encoding="utf-8")
    environment = {
        **os.environ,
        "ROS_DOMAIN_ID": DOMAIN,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    done = subprocess.run(
        [sys.executable, str(plain)], check=False, capture_output=True, encoding="utf-8", env=environment
    )
    expected = done.stderr.replace(f"{plain.parent}/", "")
    found = "".join(f"{line.text}\n" for line in trace.lines() if line.stream == "stderr")
    assert expected
    assert normalised(found) == normalised(expected)
