"""What a program sees of modules that it has not imported: the same as in plain Python, in a fork of the starter."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from places import ROOT

pytest.importorskip("rclpy")

#: What a program imports, each in a process of its own.
PROGRAMS = (
    "import rclpy",
    "import rclpy.qos",
    "from rclpy.node import Node",
    "import rclpy, rclpy.action",
    "import rclpy.lifecycle",
    "import rclpy\nfrom rclpy.executors import MultiThreadedExecutor\nfrom geometry_msgs.msg import Twist",
    "from std_msgs.msg import String",
    "import numpy",
    "import asyncio",
    "import concurrent, xml, urllib, logging",
    "import concurrent.futures",
    "import importlib, rclpy\nimportlib.import_module('rclpy.time')",
)
#: Prints the modules that are attributes of their packages.
SHOWN = """
import sys
print(*sorted(name for name in sys.modules if "." in name and not name.startswith("_grader_host")
    and hasattr(sys.modules.get(name.rpartition(".")[0]), name.rpartition(".")[2])))
"""
#: Prepares a process as the starter does, and runs each program in a fork.
STARTER = """
import importlib.util, json, os, sys
spec = importlib.util.spec_from_file_location("_launcher", sys.argv[1])
launcher = importlib.util.module_from_spec(spec)
spec.loader.exec_module(launcher)
program = launcher.load_package()
host = program.Host("wall")
host.install_ros()
program.warm_up()
from _grader_host.unseen import IMPORTS
IMPORTS.hide()
for text in json.load(sys.stdin):
    if not os.fork():
        exec(text, {"__name__": "__main__"})
        sys.stdout.flush()
        os._exit(0)
    os.wait()
"""
#: Newer releases warn of a fork beside threads.
PYTHON = (sys.executable, "-s", "-W", "ignore::DeprecationWarning", "-c")
#: Packages of which the starter itself needs parts, before anything is noted.
OF_STARTER = ("collections", "importlib", "json", "typing")


def shown(line: str) -> set[str]:
    return {name for name in line.split() if name.partition(".")[0] not in OF_STARTER}


@pytest.mark.slow
def test_a_program_sees_the_modules_that_it_sees_in_plain_python() -> None:
    """Not `rclpy.node` after `import rclpy`, and all that each import brings with it."""
    launcher = ROOT / "grader" / "runtime" / "host" / "launcher.py"
    done = subprocess.run(
        [*PYTHON, STARTER, str(launcher)],
        input=json.dumps([program + SHOWN for program in PROGRAMS]),
        check=True,
        capture_output=True,
        text=True,
    )
    assert done.stderr == ""
    for program, line in zip(PROGRAMS, done.stdout.splitlines(), strict=True):
        plain = subprocess.run([*PYTHON, program + SHOWN], check=True, capture_output=True, text=True)
        assert (program, shown(line)) == (program, shown(plain.stdout))
    assert "rclpy.node" not in shown(done.stdout.splitlines()[0])
