"""`pytest --cov` counts the lines of the programs that a test runs, as plain Python would."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from coverage import CoverageData

pytestmark = pytest.mark.ros

#: Ends by itself, uses a thread, an executor with threads and an exit handler, and does not run all of its lines.
COUNTS = """\
import atexit
import sys
import threading

import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int32


class Counts(Node):
    def __init__(self):
        super().__init__("counts")
        self.count = 0
        self.out = self.create_publisher(Int32, "/count", 10)
        self.create_timer(0.05, self.on_timer)

    def on_timer(self):
        self.count += 1
        if self.count > 100:
            self.get_logger().info("never")
        self.out.publish(Int32(data=self.count))


def beside():
    found.append(1)


def never():
    return 1


def last():
    print("ended")


found = []
atexit.register(last)
thread = threading.Thread(target=beside)
thread.start()
thread.join()
rclpy.init()
executor = MultiThreadedExecutor()
node = Counts()
executor.add_node(node)
try:
    while node.count < 3:
        executor.spin_once()
finally:
    node.destroy_node()
"""

#: Runs until it is told to stop, which it is at the end of a test.
SPINS = """\
import gc

import rclpy
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import String

import colorsys

rclpy.init()
node = rclpy.create_node("spins")


def on_text(message):
    if message.data == "b":
        node.get_logger().info("never")
    out.publish(String(data=colorsys.answer(gc)))


out = node.create_publisher(String, "/out", 10)
node.create_subscription(String, "/in", on_text, 10)
try:
    rclpy.spin(node)
except (KeyboardInterrupt, ExternalShutdownException):
    node.destroy_node()
"""

#: Has the name of a module of Python, so that Python is executed for the program beside it.
HIDES = """\
def answer(gc):
    return str(gc.get_freeze_count())


def other():
    return "y"
"""

#: Writes nothing about its lines, as under plain Python.
KILLED = """\
import rclpy

rclpy.init()
rclpy.spin(rclpy.create_node("killed"))
"""

TESTS = """\
import pytest
from std_msgs.msg import String


def test_counts(ros):
    counts = ros.run("counts.py")
    ros.wait_until(lambda: not counts.running, 20.0)
    assert counts.output.startswith("ended")


@pytest.mark.filterwarnings("ignore:colorsys.py has the name of a module")
def test_spins(ros):
    ros.run("hiding/spins.py")
    ros.publish("/in", String(data="a"), rate=5.0)
    ros.wait_until(lambda: ros.messages("/out"), 20.0)
    assert ros.messages("/out")[-1].data == "0"  # a fork has objects that its parent has frozen


def test_killed(ros):
    ros.run("killed.py").kill()
"""


def lines_of(data: CoverageData, folder: Path) -> dict[str, list[int]]:
    """Return the lines that have run, of each file that a test or its set-up wrote."""
    files = {Path(file): sorted(data.lines(file) or ()) for file in data.measured_files()}
    return {str(file.relative_to(folder)): lines for file, lines in files.items() if file.name != "test_it.py"}


def run(pytester: pytest.Pytester, *arguments: str) -> dict[str, list[int]]:
    """Run the tests with coverage, and return the lines that have run."""
    found = pytester.runpytest_subprocess("-p", "grader.pytest_plugin", "-W", "error", *arguments)
    assert found.ret == 0
    data = CoverageData(str(pytester.path / ".coverage"))
    data.read()
    assert not [*pytester.path.glob(".coverage.*")]  # all were put together
    return lines_of(data, pytester.path)


def test_lines_of_a_program_are_those_of_plain_python_on_both_clocks(pytester: pytest.Pytester) -> None:
    """A forked program, one that is executed because its file hides a module of Python, and one that is killed."""
    pytester.makepyfile(test_it=TESTS, counts=COUNTS, killed=KILLED)
    folder = pytester.mkdir("hiding")
    (folder / "spins.py").write_text(SPINS, encoding="utf-8")
    (folder / "colorsys.py").write_text(HIDES, encoding="utf-8")
    virtual = run(pytester, "--cov=.", "--cov-report=")
    wall = run(pytester, "--cov=.", "--cov-report=", "--ros-clock=wall")
    plain = CoverageData(str(pytester.path / "plain"))
    (pytester.path / "plain.ini").write_text("[run]\nsource = .\ndata_file = plain\n", encoding="utf-8")
    environment = {**os.environ, "COVERAGE_PROCESS_START": "plain.ini"}
    subprocess.run([sys.executable, "counts.py"], check=True, cwd=pytester.path, env=environment)
    plain.read()
    expected = lines_of(plain, pytester.path)["counts.py"]
    everything = range(1, 1 + SPINS.count("\n"))
    never = SPINS[: SPINS.index("node.get_logger")].count("\n") + 1
    empty = [number for number, line in enumerate(SPINS.splitlines(), 1) if not line]
    assert virtual["counts.py"] == expected
    assert virtual["hiding/spins.py"] == sorted({*everything} - {never, *empty})
    assert virtual["hiding/colorsys.py"] == [1, 2, 5]
    assert wall == virtual


def test_nodes_of_a_launch_file_and_of_a_package_count(pytester: pytest.Pytester) -> None:
    """Coverage's own recipe, which names the package and measures processes; in processes of pytest-xdist as well."""
    for name, text in PACKAGE.items():
        path = pytester.path / "patrol" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    (pytester.path / ".coveragerc").write_text("[run]\npatch = subprocess\n", encoding="utf-8")
    pytester.makepyfile(test_it=OF_LAUNCH)
    options = "--cov=patrol", "--cov-branch", "--cov-report="
    virtual = run(pytester, *options, "-n1")
    assert run(pytester, *options, "--ros-clock=wall") == virtual
    assert virtual["patrol/patrol/talker.py"] == [1, 2, 5, 7, 8, 9, 10, 11]
    assert virtual["patrol/patrol/listener.py"] == [1, 2, 5, 7, 8, 9, 10]


PACKAGE = {
    "package.xml": "<package format='3'><name>patrol</name></package>",
    "setup.py": """\
from setuptools import setup
scripts = ["talker = patrol.talker:main", "listener = patrol.listener:main"]
setup(name="patrol", packages=["patrol"], entry_points={"console_scripts": scripts})
""",
    "patrol/__init__.py": "",
    "patrol/talker.py": """\
import rclpy
from std_msgs.msg import String


def main():
    # the clock ticks once
    rclpy.init()
    node = rclpy.create_node("talker")
    out = node.create_publisher(String, "/chatter", 10)
    node.create_timer(0.5, lambda: out.publish(String(data="a")))
    rclpy.spin(node)
""",
    "patrol/listener.py": """\
import rclpy
from std_msgs.msg import String


def main():
    # it hears it
    rclpy.init()
    node = rclpy.create_node("listener")
    node.create_subscription(String, "/chatter", lambda text: text.data == "a" or node.get_logger().info("b"), 10)
    rclpy.spin(node)
""",
    "launch/both.launch.py": """\
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription([Node(package="patrol", executable=name) for name in ("talker", "listener")])
""",
}

OF_LAUNCH = """\
def test_both(ros):
    ros.launch("patrol/launch/both.launch.py")
    ros.wait_until(lambda: ros.messages("/chatter"), 20.0)
    ros.settle()
"""
