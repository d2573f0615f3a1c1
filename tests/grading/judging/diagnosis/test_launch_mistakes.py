"""Misspelt and misplaced names in launch files, each with the line to write instead."""

from __future__ import annotations

import pytest

from grader.grading.judging.diagnosis import RULES, hint_for
from grader.grading.judging.diagnosis.launch_mistakes import NAMES, TAKES
from grader.runtime.host import launch_names
from grader.runtime.model.trace import ClockKind, Fault, FaultKind, Trace

FILE = "robot.launch.py"
#: A line of a launch file, its error, the hint, and the rule that gives it.
SLIPS = [
    (
        "from launch.substitutions import LaunchConfigurtion",
        "ImportError: cannot import name 'LaunchConfigurtion' from 'launch.substitutions' (unknown location)",
        "from launch.substitutions import LaunchConfiguration, not LaunchConfigurtion",
        "launch_import",
    ),
    (
        "from launch import Node",
        "ImportError: cannot import name 'Node' from 'launch' (unknown location)",
        "Node is in another module: from launch_ros.actions import Node",
        "launch_import",
    ),
    (
        "from launch import DeclareLaunchArgumnt",
        "ImportError: cannot import name 'DeclareLaunchArgumnt' from 'launch' (unknown location)",
        "there is no DeclareLaunchArgumnt: from launch.actions import DeclareLaunchArgument",
        "launch_import",
    ),
    (
        "from ament_index_python.packages import get_package_share_dir",
        "ImportError: cannot import name 'get_package_share_dir' from 'ament_index_python.packages' (unknown location)",
        "from ament_index_python.packages import get_package_share_directory, not get_package_share_dir",
        "launch_import",
    ),
    (
        "import launch",
        "AttributeError: module 'launch' has no attribute 'LaunchDescripton'",
        "launch.LaunchDescripton should be launch.LaunchDescription",
        "launch_attribute",
    ),
    (
        "import launch_ros",
        "AttributeError: module 'launch_ros' has no attribute 'action'",
        "launch_ros.action should be launch_ros.actions",
        "launch_attribute",
    ),
    (
        "import launch",
        "AttributeError: module 'launch' has no attribute 'TimerAction'",
        "TimerAction is in another module: from launch.actions import TimerAction",
        "launch_attribute",
    ),
    (
        "import launch.condition",
        "ModuleNotFoundError: No module named 'launch.conditon'",
        "the module is called launch.conditions, not launch.conditon",
        "launch_module",
    ),
    (
        "x = LaunchDescription()",
        "NameError: name 'LaunchDescription' is not defined",
        "the import is missing: from launch import LaunchDescription",
        "launch_name",
    ),
    (
        "x = Node(package='a', executable='b')",
        "NameError: name 'Node' is not defined",
        "the import is missing: from launch_ros.actions import Node",
        "launch_name",
    ),
    (
        "from launch.actions import GroupAction\nx = GroupActon()",
        "NameError: name 'GroupActon' is not defined",
        "GroupActon should be GroupAction",
        "launch_name",
    ),
    (
        "x = Node(package='a', executible='b')",
        "TypeError: Node.__init__() missing a required argument: 'executable'",
        "write executable=, not executible=",
        "launch_argument",
    ),
    (
        "x = Node(package='a')",
        "TypeError: Node.__init__() missing a required argument: 'executable'",
        "give Node its executable: Node(executable=...)",
        "launch_argument",
    ),
    (
        "x = DeclareLaunchArgument('a', defualt_value='b')",
        "TypeError: DeclareLaunchArgument.__init__() got an unexpected keyword argument 'defualt_value'",
        "write default_value=, not defualt_value=",
        "launch_argument",
    ),
]


@pytest.mark.parametrize(("code", "text", "hint", "cause"), SLIPS, ids=[text for _, text, _, _ in SLIPS])
def test_a_misspelt_name_is_told_with_the_right_one(code: str, text: str, hint: str, cause: str) -> None:
    """As a Python error writes it."""
    fault = Fault(0, FILE, FaultKind.EXCEPTION, text, FILE, 1)
    trace = Trace("alone", ClockKind.VIRTUAL, 1, (fault,))
    assert hint_for(fault, trace, f"{code}\n") == hint
    (rule,) = (rule for rule in RULES if rule.id == cause)
    assert fault.said(rule.text)


def test_nothing_is_said_of_a_node_that_has_its_own_names() -> None:
    """Names of the launch packages mean nothing there."""
    fault = Fault(0, "node.py", FaultKind.EXCEPTION, "NameError: name 'Node' is not defined", "node.py", 1)
    trace = Trace("alone", ClockKind.VIRTUAL, 1, (fault,))
    assert hint_for(fault, trace, "x = Node('a')\n") == "the import is missing: from rclpy.node import Node"


def test_ros_has_every_name_that_is_advised() -> None:
    """The list for hints is a part of that by which launch files are evaluated."""
    for module, names in NAMES.items():
        assert all(launch_names.has(module, name) for name in names.split()), module
    for name, parameters in TAKES.items():
        module = next(module for module, names in NAMES.items() if name in names.split())
        signature = launch_names.signature(launch_names.key_of(module, name))
        assert signature is not None
        assert {*signature.parameters} == {*parameters.split()}, name
