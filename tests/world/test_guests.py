"""Nodes of other people, tested with `ros`: only where their repositories are at hand (`guests/README.md`)."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

GUESTS = Path(__file__).with_name("guests")
#: The file of tests, the folder that it lies in, below the folder of all repositories, and how many tests pass.
PACKAGES = {
    "examples": ("examples/rclpy", 27),
    "demo_nodes_py": ("demos/demo_nodes_py/test", 10),
    "examples_tf2_py": ("geometry2/examples_tf2_py/test", 3),
    "ball_tracker": ("ball_tracker/test", 3),
    "turtlebot3_example": ("turtlebot3/turtlebot3_example/test", 3),
    "diagnostic_common_diagnostics": ("diagnostics/diagnostic_common_diagnostics/test", 3),
    "bme_ros2_tutorials_py": ("Week-1-2-Introduction-to-ROS2/bme_ros2_tutorials_py/test", 3),
    "osr_control": ("osr-rover-code/ROS/osr_control/test", 3),
}

pytestmark = [pytest.mark.ros, pytest.mark.nightly]


@pytest.mark.parametrize("name", PACKAGES)
def test_their_nodes_can_be_tested(tmp_path: Path, name: str) -> None:
    """The tests of a package pass, in one process and without a build."""
    folder = os.environ.get("GUESTS")
    if folder is None:
        pytest.skip("GUESTS names no folder with the repositories of tests/world/guests/README.md")
    place, passed = PACKAGES[name]
    top = Path(folder, place.partition("/")[0])
    copy = shutil.copytree(top, tmp_path / top.name, ignore=shutil.ignore_patterns(".git"))
    test = copy.parent / place / "test_guest.py"
    test.parent.mkdir(exist_ok=True)
    shutil.copy(GUESTS / f"{name}.py", test)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", test.name]
    done = subprocess.run(command, cwd=test.parent, capture_output=True, text=True, check=False)
    assert f"{passed} passed" in done.stdout, done.stdout + done.stderr
    assert done.returncode == 0
