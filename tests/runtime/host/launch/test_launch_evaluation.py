"""What a launch file describes: nodes with all they are started with, and what only ROS itself could do."""

from __future__ import annotations

import json
import re
import sys
import textwrap
from collections.abc import Callable, Sequence
from inspect import Parameter
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from grader.runtime.host.faults import Describer
from grader.runtime.host.launch import ros_classes, ros_modules, ros_names
from grader.runtime.host.launch.evaluation import describe
from grader.runtime.host.launch.package_names import meant_by
from grader.runtime.host.protocol import LaunchedNode, LaunchHandler, LaunchReport, LaunchStep, NotEvaluated
from grader.runtime.worker.notes import left_out_sentence, left_out_words

IMPORTS = """
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import *
from launch.actions import (DeclareLaunchArgument, ExecuteProcess, GroupAction, IncludeLaunchDescription, LogInfo,
    OpaqueFunction, SetEnvironmentVariable, SetLaunchConfiguration, TimerAction, RegisterEventHandler, EmitEvent,
    Shutdown)
from launch.conditions import IfCondition, UnlessCondition, LaunchConfigurationEquals
from launch.event_handlers import OnExecutionComplete, OnProcessExit, OnProcessIO, OnProcessStart, OnShutdown
from launch.event_handler import EventHandler
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import (Command, EnvironmentVariable, LaunchConfiguration, PathJoinSubstitution,
    LocalSubstitution, PythonExpression, TextSubstitution, ThisLaunchFileDir)
from launch_ros.actions import (ComposableNodeContainer, LifecycleNode, Node, PushRosNamespace, SetParameter, SetRemap)
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue
from launch_ros.substitutions import FindPackageShare
import os
import launch.events
from ament_index_python.packages import get_packages_with_prefixes
from ament_index_python.resources import has_resource
from launch import Condition as NoCondition
from launch_ros.events.lifecycle import ChangeState
from launch_ros.utilities import make_namespace_absolute
TALKER = dict(package="robot", executable="talker")
"""
Described = tuple[list[LaunchedNode], list[NotEvaluated]]


@pytest.fixture
def reported(tmp_path: Path) -> Callable[..., LaunchReport]:
    """Evaluate a launch file with these actions."""

    def evaluate(
        actions: str, arguments: dict[str, str] | None = None, before: str = "", prefix: str = "", **others: str
    ) -> LaunchReport:
        robot = tmp_path / "robot"
        (robot / "launch").mkdir(parents=True, exist_ok=True)
        (robot / "own.yaml").write_text("/**: {ros__parameters: {rate: 2.0}}\n")
        body = textwrap.indent(f"{before}return LaunchDescription([{actions}])", "    ")
        file = robot / "launch" / "a.launch.py"
        file.write_text(f"{IMPORTS}\ndef generate_launch_description():\n{body}\n")
        for name, text in others.items():
            (robot / "launch" / f"{name}.launch.py").write_text(f"{IMPORTS}\n{text}")
        with patch.dict(sys.modules), patch("os.system"), patch("sys.meta_path", [*sys.meta_path]):
            given = ((str(tmp_path),), str(file), {"robot": str(robot)}, arguments or {})
            return describe(*given, prefix=prefix, most_nodes=16, most_left_out=50)

    return evaluate


@pytest.fixture
def described(reported: Callable[..., LaunchReport]) -> Callable[..., Described]:
    """Evaluate a launch file with these actions; return its nodes, and what was left out."""

    def evaluate(*given: Any, **others: str) -> Described:
        found = reported(*given, **others)
        return list(found.nodes), list(found.left_out)

    return evaluate


def ros(nodes: list[LaunchedNode]) -> list[Sequence[str]]:
    return [node.ros_arguments for node in nodes]


def test_a_node_has_everything_it_is_started_with(described: Callable[..., Described]) -> None:
    """Names, remappings, arguments, and the place where it was written."""
    nodes, left_out = described(
        "Node(**TALKER, name='a', namespace='b', remappings=[('x', '/y')], arguments=['go'], "
        "ros_arguments=['--log-level', 'debug'], output='screen', emulate_tty=True)"
    )
    assert left_out == []
    (node,) = nodes
    rules = ["-r", "__node:=a", "-r", "__ns:=/b", "-r", "x:=/y"]
    assert node.ros_arguments == [*rules, "--log-level", "debug"]
    assert (node.package, node.executable, node.arguments) == ("robot", "talker", ["go"])
    assert node.file == "robot/launch/a.launch.py"
    assert node.line == IMPORTS.count("\n") + 3


PARAMETERS = {
    "{'a': 1, 'b': 2.0, 'c': 'x', 'd': True}": '{"a": 1, "b": 2.0, "c": "x", "d": true}',
    "{'pid': {'kp': 1.5, 'on': [1, 2.5]}, 'w': ['a', 'b']}": '{"pid.kp": 1.5, "pid.on": [1.0, 2.5], "w": ["a", "b"]}',
    "{'n': LaunchConfiguration('n')}": '{"n": 5}',
    "{'n': ParameterValue(LaunchConfiguration('n'), value_type=str)}": '{"n": "5"}',
    "{'n': ParameterValue(LaunchConfiguration('n'), value_type=float)}": '{"n": 5.0}',
    "{'n': '5'}": '{"n": "5"}',
    "{'n': PythonExpression(['2 * ', LaunchConfiguration('n')])}": '{"n": 10}',
    "{'n': [LaunchConfiguration('n'), '.5']}": '{"n": 5.5}',
}


@pytest.mark.parametrize(("given", "expected"), PARAMETERS.items(), ids=PARAMETERS)
def test_parameters_keep_their_types(described: Callable[..., Described], given: str, expected: str) -> None:
    """A text stays a text, and the text of a substitution is read as YAML, as launch_ros does."""
    nodes, _ = described(f"DeclareLaunchArgument('n', default_value='5'), Node(**TALKER, parameters=[{given}])")
    assert nodes[0].parameter_files == [[expected, f'"/**": {{ros__parameters: {expected}}}\n']]


def test_parameter_files_and_values_keep_their_order(described: Callable[..., Described]) -> None:
    """Values of a named node are for that node alone, so that they win over a file's."""
    share = "get_package_share_directory('robot')"
    nodes, left_out = described(
        f"Node(**TALKER, name='a', namespace='/n', parameters=[{share} + '/own.yaml', {{'rate': 3.0}}]), "
        "Node(**TALKER, parameters=[ParameterFile(PathJoinSubstitution([FindPackageShare('robot'), 'no.yaml']))])"
    )
    assert nodes[0].parameter_files == [
        ["own.yaml", "/**: {ros__parameters: {rate: 2.0}}\n"],
        ['{"rate": 3.0}', '"/n/a": {ros__parameters: {"rate": 3.0}}\n'],
    ]
    assert nodes[1].parameter_files == []
    assert [left_out_words(one) for one in left_out] == ["the parameter file no.yaml"]


def test_groups_have_a_scope(described: Callable[..., Described]) -> None:
    """Namespaces add up inside, and nothing of it is left outside; remappings and parameters likewise."""
    nodes, _ = described(
        "GroupAction([PushRosNamespace('a'), SetParameter('x', 1), SetRemap('p', 'q'), "
        "  GroupAction([PushRosNamespace('b'), Node(**TALKER, namespace='c'), Node(**TALKER, namespace='/d')]),"
        "  Node(**TALKER)]), Node(**TALKER)"
    )
    more = ["-r", "p:=q", "-p", "x:=1"]
    names = ["/a/b/c", "/d", "/a"]
    assert ros(nodes) == [*(["-r", f"__ns:={name}", *more] for name in names), []]


def test_a_pushed_namespace_is_a_launch_configuration(described: Callable[..., Described]) -> None:
    """As in launch_ros, where launch files read it, inside of its group only."""
    name = "LaunchConfiguration('ros_namespace', default='none')"
    nodes, _ = described(
        f"GroupAction([PushRosNamespace('a'), PushRosNamespace('b'), Node(**TALKER, name={name}),"
        f"  GroupAction([PushRosNamespace('/c'), Node(**TALKER, name={name})])]), Node(**TALKER, name={name})"
    )
    names = [word.removeprefix("__node:=") for words in ros(nodes) for word in words if word.startswith("__node:=")]
    assert names == ["/a/b", "/c", "none"]


@pytest.mark.parametrize(("arguments", "started"), [({}, ["yes"]), ({"go": "false"}, ["no"]), ({"go": "1"}, ["yes"])])
def test_conditions_choose(described: Callable[..., Described], arguments: dict[str, str], started: list[str]) -> None:
    """By an argument, whose default counts if it is not given."""
    go = "LaunchConfiguration('go')"
    nodes, _ = described(
        f"DeclareLaunchArgument('go', default_value='true'), Node(**TALKER, name='yes', condition=IfCondition({go})),"
        f"Node(**TALKER, name='no', condition=UnlessCondition({go}))",
        arguments,
    )
    assert [rules[1] for rules in ros(nodes)] == [f"__node:={name}" for name in started]


def test_included_files_get_arguments(reported: Callable[..., LaunchReport]) -> None:
    """Beside the file, or found by the package; a function's actions and later ones are described too."""
    part = "def generate_launch_description():\n    return LaunchDescription([DeclareLaunchArgument('name'), "
    part += "Node(**TALKER, name=LaunchConfiguration('name'))])\n"
    found = reported(
        "IncludeLaunchDescription(PythonLaunchDescriptionSource([ThisLaunchFileDir(), '/part.launch.py']), "
        "  launch_arguments={'name': 'one'}.items()), "
        "TimerAction(period=2.0, actions=[OpaqueFunction(function=lambda context: [Node(**TALKER, "
        "  name=LaunchConfiguration('name').perform(context) + '_more')])]),"
        "ExecuteProcess(cmd=['ros2', 'run', 'robot', 'talker', 'hi', '--ros-args', '-r', 'a:=b'])",
        part=part,
    )
    nodes = list(found.nodes)
    assert [rules[1] for rules in ros(nodes)] == ["__node:=one", "__node:=one_more", "a:=b"]
    assert found.steps == [LaunchStep("start", 0), LaunchStep("start", 1, 2.0), LaunchStep("start", 2)]
    assert nodes[2].arguments == ["hi"]


LEFT_OUT = {
    "ExecuteProcess(cmd=['rm', '-rf', '/'])": 'the command "rm -rf /"',
    "RegisterEventHandler(OnProcessExit(on_exit=lambda event, context: []))": "the event handler OnProcessExit",
    "RegisterEventHandler(OnProcessExit(target_action=lambda action: True, on_exit=[]))": "the event handler "
    "OnProcessExit",
    "RegisterEventHandler(OnProcessIO(on_stdout=lambda event: None))": "the event handler OnProcessIO",
    "RegisterEventHandler(OnExecutionComplete(on_completion=[]))": "the event handler OnExecutionComplete",
    "RegisterEventHandler(OnProcessExit(target_action=LogInfo(msg='a'), on_exit=[]))": "the event handler "
    "OnProcessExit",
    "RegisterEventHandler(EventHandler(matcher=print))": "the action RegisterEventHandler",
    "RegisterEventHandler(OnShutdown(on_shutdown=[OpaqueFunction(function=print)]))": "the action OpaqueFunction",
    "Node(**TALKER, on_exit=lambda event, context: None)": "the event handler OnProcessExit",
    "Node(**TALKER, respawn=NoCondition(predicate=len))": "respawn= of a node",
    "ComposableNodeContainer(name='c', namespace='', executable='e')": "the action ComposableNodeContainer",
    "Node(**TALKER, parameters=[{'urdf': Command(['xacro ', 'a.urdf'])}])": 'the substitution Command("xacro a.urdf")',
    "SetEnvironmentVariable('PATH', '/x')": "the environment variable PATH",
    "Node(**TALKER, prefix='gdb')": "prefix= of a node",
    "IncludeLaunchDescription('more.launch.toml')": "the launch file more.launch.toml",
    "LogInfo(msg=FindPackageShare('gazebo_ros'))": "what needs the package gazebo_ros",
    "LogInfo(msg=Node(**TALKER).node_name)": "what needs Node.node_name",
    "EmitEvent(event=ChangeState(lifecycle_node_matcher=launch.events.matches_action(Node(**TALKER)), "
    "transition_id=1))": "the action EmitEvent",
    "Node(**TALKER, name=make_namespace_absolute('a'))": "what needs launch_ros.utilities.make_namespace_absolute",
    "Node(**TALKER, condition=NoCondition(predicate=len))": "what needs launch.Condition",
    "LogInfo(msg='', condition=IfCondition('maybe' in get_packages_with_prefixes() and '1' or '1'))": "what needs "
    "the package maybe",
    "LogInfo(msg=str(has_resource('packages', 'image_view')))": "what needs the package image_view",
    "LogInfo(msg=str(os.system('mkdir here')))": 'the command "mkdir here"',
}


START, STOP = LaunchStep("start", 1), LaunchStep("shutdown")
REGISTER = LaunchStep("register", 0)
#: By what is done with the node `a`, the number 0: its event handler, with what that does.
HANDLED = {
    "RegisterEventHandler(OnProcessStart(target_action=a, on_start=[Node(**TALKER)]))": ("start", 0, False, [START]),
    "RegisterEventHandler(OnProcessExit(target_action=a, on_exit=Node(**TALKER)))": ("exit", 0, False, [START]),
    "RegisterEventHandler(OnProcessExit(on_exit=[EmitEvent(event=launch.events.Shutdown(reason='x'))]))": (
        *("exit", -1, False),
        [STOP],
    ),
    "RegisterEventHandler(OnExecutionComplete(target_action=a, on_completion=[Shutdown()], handle_once=True))": (
        *("complete", 0, True),
        [STOP],
    ),
    "RegisterEventHandler(OnShutdown(on_shutdown=[LogInfo(msg=LocalSubstitution('event.reason'))]))": (
        *("shutdown", -1, False),
        [],
    ),
    "RegisterEventHandler(OnProcessExit(target_action=a, on_exit=[LogInfo(msg='over'), TimerAction(period=2.5, "
    "actions=[ExecuteProcess(cmd=['ros2', 'run', 'robot', 'talker']), Shutdown()])]))": (
        *("exit", 0, False),
        [START._replace(delay_s=2.5), STOP._replace(delay_s=2.5)],
    ),
}


@pytest.mark.parametrize(("action", "handler"), HANDLED.items(), ids=HANDLED)
def test_event_handlers_are_described(
    reported: Callable[..., LaunchReport], action: str, handler: tuple[Any, ...]
) -> None:
    """With what they do, wherever they are registered: before the node, or after it."""
    for actions in (f"a, {action}", f"{action}, a"):
        found = reported(actions, before="a = Node(**TALKER, name='a')\n")
        assert found.left_out == []
        assert [*found.handlers] == [LaunchHandler(*handler)]
        assert sorted(found.steps) == [REGISTER, LaunchStep("start", 0)]


def test_what_a_node_does_at_its_end_is_described(reported: Callable[..., LaunchReport]) -> None:
    """Whether it is started again, how much later, how often; and what its own `on_exit` does."""
    found = reported(
        "DeclareLaunchArgument('again', default_value='true'), "
        "Node(**TALKER, respawn=True, respawn_delay=2.0), Node(**TALKER, respawn=LaunchConfiguration('again'), "
        "respawn_max_retries=3), Node(**TALKER, respawn_delay=1.0), Node(**TALKER, on_exit=Shutdown())"
    )
    assert found.left_out == []
    assert [node[-3:] for node in found.nodes] == [(True, 2.0, -1), (True, 0.0, 3), (False, 0.0, -1), (False, 0.0, -1)]
    assert [*found.handlers] == [LaunchHandler("exit", 3, False, [STOP])]
    assert [*found.steps] == [*(LaunchStep("start", number) for number in range(4)), REGISTER]


def test_handlers_are_described_as_of_when_they_are_called(reported: Callable[..., LaunchReport]) -> None:
    """The group around one has ended by then, with its namespace; handlers and nodes in them know of each other."""
    found = reported(
        "GroupAction([PushRosNamespace('in'), a, RegisterEventHandler(OnProcessExit(target_action=a, on_exit=[b, "
        "RegisterEventHandler(OnProcessExit(target_action=b, on_exit=[a]))]))])",
        before="a, b = Node(**TALKER, name='a'), Node(**TALKER, name='b')\n",
    )
    assert ros(list(found.nodes)) == [["-r", "__node:=a", "-r", "__ns:=/in"], ["-r", "__node:=b"]]
    first, second = found.handlers
    assert [*first.steps] == [START, LaunchStep("register", 1)]
    assert second == LaunchHandler("exit", 1, False, [LaunchStep("start", 0)])


def test_what_launch_refuses_of_event_handlers(described: Callable[..., Described]) -> None:
    """With the errors that launch raises."""
    refused = {
        "RegisterEventHandler(OnProcessExit(target_action='a', on_exit=[]))": TypeError,
        "RegisterEventHandler(OnProcessExit(on_exit=['a']))": TypeError,
        "EmitEvent(event='shutdown')": RuntimeError,
        "*[Node(**TALKER)] * 2": RuntimeError,  # the same action twice
    }
    for actions, kind in refused.items():
        with pytest.raises(kind):
            described(actions)


@pytest.mark.parametrize(("action", "what"), LEFT_OUT.items(), ids=LEFT_OUT)
def test_what_only_ros_can_do_is_named(described: Callable[..., Described], action: str, what: str) -> None:
    """With its line; everything else of the file is described all the same."""
    nodes, left_out = described(f"{action}, Node(**TALKER, name='after')")
    assert "__node:=after" in nodes[-1].ros_arguments
    line = IMPORTS.count("\n") + 3
    ((place, words),) = [((one.file, one.line), left_out_words(one)) for one in left_out]
    assert (place, words) == (("robot/launch/a.launch.py", line), what)


INCLUDES_ITSELF = "IncludeLaunchDescription(PythonLaunchDescriptionSource([ThisLaunchFileDir(), '/a.launch.py']))"
WRONG = {
    "Node(**TALKER, nam='a')": "TypeError",
    "Node(package='robot')": "TypeError",
    "LaunchConfiguration('x')": "TypeError",
    "Node(**TALKER, name=LaunchConfiguration('x'))": "SubstitutionFailure",
    "DeclareLaunchArgument('x')": "RuntimeError",
    "DeclareLaunchArgument('x', default_value=5)": "TypeError",
    "DeclareLaunchArgument('x', default_value='5', choices=['6'])": "RuntimeError",
    "Node(**TALKER, condition=IfCondition('maybe'))": "ValueError",
    "LogInfo(msg=get_package_share_directory('robots'))": "PackageNotFoundError",
    "Node(**TALKER, parameters=[{'a': object()}])": "TypeError",
    INCLUDES_ITSELF: "RecursionError",
}


@pytest.mark.parametrize(("action", "error"), WRONG.items(), ids=WRONG)
def test_a_mistake_raises_what_ros_raises(described: Callable[..., Described], action: str, error: str) -> None:
    """The student's own mistake becomes a fault of the launch file, as a node's exception does."""
    with pytest.raises(Exception, match=r"\S") as raised:
        described(action)
    assert type(raised.value).__name__ == error


@pytest.mark.parametrize(
    ("imported", "actions"),
    [
        ("", "LogInfo(msg=FindPackageShare(package='robot').find('robot')), Node(**TALKER)"),
        ("", "LogInfo(msg=FindPackageShare('x').find('robot')), Node(**TALKER)"),
        ("from launch import logging", "LogInfo(msg=str(logging.get_logger('x').name)), Node(**TALKER)"),
        ("import launch.logging", "Node(**TALKER)"),
        (
            "from launch.substitutions.path_join_substitution import PathJoinSubstitution",
            "LogInfo(msg=PathJoinSubstitution(['a', 'b'])), Node(**TALKER)",
        ),
        ("from launch_ros.actions.node import Node", "Node(**TALKER)"),
        ("from launch.launch_description import LaunchDescription", "Node(**TALKER)"),
        ("from launch.utilities import perform_substitutions", "Node(**TALKER)"),
        ("from robot.words import NAME", "Node(**TALKER, name=NAME)"),
    ],
)
def test_what_launch_files_import_is_there(
    described: Callable[..., Described], tmp_path: Path, imported: str, actions: str
) -> None:
    """Classes of launch from whichever module, its logger, and modules of the packages."""
    (tmp_path / "robot" / "robot").mkdir(parents=True)
    (tmp_path / "robot" / "robot" / "words.py").write_text("NAME = 'own'\n")
    with patch.object(sys, "path", [*sys.path]):
        nodes, left_out = described(actions, before=f"{imported or 'pass'}\n")
    assert ([node.executable for node in nodes], left_out) == (["talker"], [])


@pytest.mark.parametrize(
    "package", ["xacro", "nav2_common.launch", "controller_manager.launch_utils", "ros_gz_bridge.actions"]
)
def test_what_a_package_that_is_not_here_makes_is_left_out_where_it_is_used(
    described: Callable[..., Described], package: str
) -> None:
    """The other nodes start."""
    nodes, left_out = described(
        "Node(package='robot', executable='publisher', parameters=[{'robot_description': made.toxml()}]), "
        "Node(**TALKER, parameters=[{'a': 1}]), absent.Thing(a=1)",
        before=f"import {package} as absent\nmade = absent.process_file('a.xacro', mappings={{'a': 'b'}})\n",
    )
    assert [node.executable for node in nodes] == ["talker"]
    (one,) = left_out
    assert (left_out_words(one), one.times) == (f"what needs the package {package.partition('.')[0]}", 2)


@pytest.mark.parametrize(
    ("package", "near"),
    [("robto", "robot"), ("robots", "robot"), ("robot", ""), ("my_robot", ""), ("robot2", ""), ("turtlesim", "")],
)
def test_a_misspelt_package_is_told(described: Callable[..., Described], package: str, near: str) -> None:
    """A name with a part or a number more may be that of another package."""
    nodes, _ = described(f"Node(package='{package}', executable='talker')")
    assert [node.near for node in nodes] == [near]


@pytest.mark.parametrize(
    ("package", "meant"),
    [("orion5_description", ""), ("robto_description", "robot_description"), ("robot_descripton", "robot_description")],
)
def test_a_part_that_two_packages_share_makes_them_no_more_alike(package: str, meant: str) -> None:
    """Only what differs counts."""
    assert meant_by(package, ["robot_description", "robot"]) == meant


#: Lines of a launch file that end its evaluation, and what is left out then.
ENDINGS = {
    "if launch_ros.utilities.is_root_namespace('/'): pass": "what needs launch_ros.utilities.is_root_namespace",
    "for one in launch.logging.get_output_loggers('a', 'b'): pass": "what needs launch.logging.get_output_loggers",
    "open(Node.UNSPECIFIED_NODE_NAME)": "what needs Node.UNSPECIFIED_NODE_NAME",
    "content, prefix = get_resource('packages', 'robot')": "what needs ament_index_python.resources.get_resource",
    "get_package_share_directory('gazebo_ros')": "what needs the package gazebo_ros",
    "subprocess.run(['xacro-of-ros', 'a.urdf'])": 'the command "xacro-of-ros a.urdf"',
    "try:\n    subprocess.run(['xacro-of-ros'])\nexcept ValueError: pass": 'the command "xacro-of-ros"',
    "try: Node.UNSPECIFIED_NODE_NAME + 'a'\nexcept Exception: pass": "what needs Node.UNSPECIFIED_NODE_NAME",
}


@pytest.mark.parametrize(("line", "what"), ENDINGS.items(), ids=ENDINGS)
def test_what_a_launch_file_cannot_go_on_without_is_named(
    described: Callable[..., Described], line: str, what: str
) -> None:
    """With its line, and not as a mistake; no `except` for exceptions hides it."""
    imported = "import subprocess, launch, launch_ros\nfrom ament_index_python.resources import get_resource\n"
    with patch.dict("os.environ", PATH="/nowhere"), patch("subprocess._USE_VFORK", new=False, create=True):
        nodes, left_out = described("Node(**TALKER)", before=f"{imported}{line}\n")
    assert nodes == []
    ((file, words),) = [(one.file, left_out_words(one)) for one in left_out]
    assert (file, words) == ("robot/launch/a.launch.py", what)
    assert left_out[0].line >= IMPORTS.count("\n") + 5


#: What neither ROS nor the grader has: imports, actions and the exception.
NOWHERE = [
    ("from launch.substitutions import LaunchConfigurtion", "Node(**TALKER)", "ImportError"),
    ("from launch.actions import EmitEvnt", "EmitEvnt(event=1)", "ImportError"),
    ("from launch.event_handlers import OnProcesExit", "Node(**TALKER)", "ImportError"),
    ("from launch.action import DeclareLaunchArgument", "Node(**TALKER)", "ImportError"),
    ("from launch_ros.action import Node", "Node(**TALKER)", "ModuleNotFoundError"),
    ("from launch.substitution import LaunchConfiguration", "Node(**TALKER)", "ImportError"),
    ("from ament_index_python.packages import get_package_share_dir", "Node(**TALKER)", "ImportError"),
    ("from ament_index_python.resource import has_resource", "Node(**TALKER)", "ModuleNotFoundError"),
    ("import launch.event_handlrs", "Node(**TALKER)", "ModuleNotFoundError"),
    ("import launch", "launch.actions.Nod(**TALKER)", "AttributeError"),
    ("import launch_ros", "launch_ros.actions.LifecycelNode(**TALKER)", "AttributeError"),
    ("import launch", "launch.events.match_action(1)", "AttributeError"),
    ("import launch", "LogInfo(msg=Node(**TALKER).nodename)", "AttributeError"),
    ("import launch", "EmitEvent(evnt=1)", "TypeError"),
    ("import launch", "RegisterEventHandler(OnProcessExit(target_acton=None, on_exit=[]))", "TypeError"),
    ("import launch", "DeclareLaunchArgument('a', defualt_value='1', default_value='2')", "TypeError"),
    ("import launch", "ExecuteProcess(cmd=['true'], outptu='screen')", "TypeError"),
    ("import launch", "GroupAction([], scopd=True)", "TypeError"),
    ("import launch", "SetRemap(source='a', dst='b')", "TypeError"),
    ("import launch", "LogInfo(message='a')", "TypeError"),
]


@pytest.mark.parametrize(("imported", "action", "error"), NOWHERE, ids=lambda one: one[:60])
def test_what_ros_does_not_have_is_the_mistake_of_the_launch_file(
    described: Callable[..., Described], tmp_path: Path, imported: str, action: str, error: str
) -> None:
    """Names of modules, classes, functions, attributes and arguments, in what is evaluated and in what is not."""
    with pytest.raises(Exception, match=r"\S") as raised:
        described(action, before=f"{imported}\n")
    assert type(raised.value).__name__ == error
    assert Describer(str(tmp_path)).exception(raised.value).code == "exception"


def test_a_name_of_a_release_whose_names_are_not_known_is_left_out(described: Callable[..., Described]) -> None:
    """It may exist there."""
    with patch.dict("os.environ", ROS_DISTRO="kilted"):
        nodes, left_out = described("launch.actions.Newer(), Node(**TALKER)", before="import launch.newer\n")
    assert [node.executable for node in nodes] == ["talker"]
    assert [left_out_words(one) for one in left_out] == ["the action Newer"]


def test_all_names_of_ros_can_be_imported(described: Callable[..., Described]) -> None:
    """Each from its module: what is not evaluated is there, too."""
    lines = [f"from {module} import {', '.join(names.split())}" for module, names in ros_modules.MODULES.items()]
    nodes, left_out = described("", before="\n".join(lines) + "\n")
    assert (nodes, left_out) == ([], [])


GATHERED = (Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD)


@pytest.mark.breadth(30, 100)
@pytest.mark.parametrize("key", ros_classes.CLASSES)
def test_a_class_takes_what_that_of_ros_takes(described: Callable[..., Described], key: str) -> None:
    """All required arguments by name; without one, or with another one, it raises what ROS does."""
    signature = ros_names.signature(key)
    package, _, name = key.rpartition(".")
    modules = [one for one, names in ros_modules.MODULES.items() if name in names.split() and one.startswith(package)]
    if signature is None or name.endswith(("Error", "Failure")):
        return
    needed = [
        one.name for one in signature.parameters.values() if one.default is one.empty and one.kind not in GATHERED
    ]
    imported = f"from {modules[0]} import {name} as Kind\n"
    if not any(one.kind in GATHERED for one in signature.parameters.values()):
        with pytest.raises(TypeError, match="unexpected keyword argument 'nowhere'"):
            described(f"Kind({''.join(f'{one}=1, ' for one in needed)}nowhere=1)", before=imported)
    if needed:
        with pytest.raises(TypeError, match="missing"):
            described("Kind()", before=imported)
    every = [one.name for one in signature.parameters.values() if one.kind not in GATHERED]
    # 1 is no name, no path and no condition, and no action.
    with pytest.raises(Exception, match=r"\S") as raised:
        described(f"Kind({''.join(f'{one}=1, ' for one in every)}), 5", before=imported)
    assert not re.search("unexpected keyword|positional argument", str(raised.value))


def test_arguments_may_be_given_by_their_names(described: Callable[..., Described]) -> None:
    """In whatever order."""
    nodes, left_out = described(
        "SetLaunchConfiguration(value='one', name='n'), SetRemap(dst='q', src='p'), PushRosNamespace(namespace='a'),"
        "Node(**TALKER, name=LaunchConfiguration(variable_name='n'), namespace=Kind(else_value='b', condition='0'))",
        before="from launch.substitutions import IfElseSubstitution as Kind\n",
    )
    assert (ros(nodes), left_out) == ([["-r", "__node:=one", "-r", "__ns:=/a/b", "-r", "p:=q"]], [])


def test_own_actions_and_contexts_are_like_those_of_ros(described: Callable[..., Described]) -> None:
    """A launch file may derive from what launch has."""
    own = "class Own(Node):\n    def execute(self, context):\n        return super().execute(context)\n"
    own += "class Two(launch.Action):\n    def execute(self, context):\n        return [Own(**TALKER)]\n"
    own += "said = LaunchConfiguration('x', default='y').perform(launch.LaunchContext())\n"
    nodes, left_out = described("Two(), Own(**TALKER, name=said)", before=f"import launch\n{own}")
    assert (ros(nodes), left_out) == ([[], ["-r", "__node:=y"]], [])


@pytest.mark.parametrize(
    ("arguments", "namespace", "target"),
    [
        ("name='a'", None, "/**"),
        ("", None, "/**"),
        ("namespace='n'", "/n", "/**"),
        ("name='a', namespace='n'", "/n", "/n/a"),
        ("name='a', namespace=''", "/", "/a"),
        ("name='a', namespace='/'", "/", "/a"),
    ],
)
def test_parameters_are_for_the_node_that_launch_ros_means(
    described: Callable[..., Described], arguments: str, namespace: str | None, target: str
) -> None:
    """Without a namespace in the launch file, the class of the node may set one."""
    nodes, _ = described(f"Node(**TALKER, parameters=[{{'x': 1}}], {arguments})")
    assert nodes[0].parameter_files[0][1].startswith(json.dumps(target))
    assert [one for one in ros(nodes)[0] if "__ns" in one] == ([] if namespace is None else [f"__ns:={namespace}"])


def test_nodes_that_are_too_many_make_one_note(described: Callable[..., Described]) -> None:
    """With their number."""
    nodes, left_out = described("*[Node(**TALKER) for _ in range(18)], Node(**TALKER), LogInfo(msg='')")
    assert len(nodes) == 16
    (one,) = left_out
    assert left_out_sentence(one) == "3 nodes beyond the first 16 were left out: no more are started"


def test_a_share_folder_is_as_installed_and_writable(
    described: Callable[..., Described], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With what setup.py installs under another path and what a launch file writes; places are the submission's."""
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "built"))
    flat = tmp_path / "built" / "share" / "robot" / "flat.urdf"
    flat.parent.mkdir(parents=True)
    flat.write_text("<robot/>")
    (tmp_path / "robot" / "maps").mkdir(parents=True)
    (tmp_path / "robot" / "maps" / "a.yaml").write_text("old")
    share = "get_package_share_directory('robot')"
    before = f"from pathlib import Path\nshare = {share}\ntext = Path(share, 'flat.urdf').read_text()\n"
    before += "Path(share, 'maps/a.yaml').write_text(text)\nPath(share, 'new.txt').write_text('')\n"
    include = (
        "IncludeLaunchDescription(PythonLaunchDescriptionSource([FindPackageShare('robot'), '/launch/b.launch.py']))"
    )
    nodes, left_out = described(
        f"Node(**TALKER, arguments=[Path(share, 'maps/a.yaml').read_text()]), {include}",
        before=before,
        prefix=str(tmp_path / "laid"),
        b="def generate_launch_description():\n    return LaunchDescription([Node(**TALKER)])\n",
    )
    assert left_out == []
    assert nodes[0].arguments == ["<robot/>"]
    assert (nodes[1].file, nodes[1].line) == ("robot/launch/b.launch.py", IMPORTS.count("\n") + 3)
    assert (tmp_path / "robot" / "maps" / "a.yaml").read_text() == "old"


def test_a_submission_that_cannot_be_written_to_is_no_mistake(described: Callable[..., Described]) -> None:
    """Elsewhere the launch file could write there."""
    refused = "raise OSError(30, 'Read-only file system', __file__)\n"
    _, left_out = described("Node(**TALKER)", before=refused)
    assert [left_out_words(one) for one in left_out] == ["writing the file a.launch.py"]
    with pytest.raises(OSError, match="Read-only"):
        described("Node(**TALKER)", before=refused.replace("__file__", "'/etc/passwd'"))


#: What a launch file may do wrong, each in the list of its actions; `ros2 launch` refuses all of it.
MISTAKES = (
    "Node(package='robot')",
    "Node(package=5, executable='x')",
    "Node(package='robot', executable=None)",
    "Node(**TALKER, parameters={'a': 1})",
    "Node(**TALKER, parameters=5)",
    "Node(**TALKER, parameters='x')",
    "Node(**TALKER, parameters=[5])",
    "Node(**TALKER, parameters=[{5: 1}])",
    "Node(**TALKER, parameters=[{'a': object()}])",
    "Node(**TALKER, parameters=[{'a': [1, 'x', object()]}])",
    "Node(**TALKER, remappings=[('a')])",
    "Node(**TALKER, remappings={'a':'b'})",
    "Node(**TALKER, remappings=[('a',5)])",
    "Node(**TALKER, remappings=('a','b'))",
    "Node(**TALKER, arguments=[5])",
    "Node(**TALKER, arguments=5)",
    "Node(**TALKER, name=5)",
    "Node(**TALKER, namespace=5)",
    "Node(**TALKER, ros_arguments=[None])",
    "Node(**TALKER, condition=5)",
    "Node(**TALKER, condition='true')",
    "Node(**TALKER, condition=IfCondition(5))",
    "Node(**TALKER, condition=IfCondition('maybe'))",
    "DeclareLaunchArgument(5, default_value='x')",
    "DeclareLaunchArgument('a', default_value=5)",
    "DeclareLaunchArgument('a', default_value=[5])",
    "DeclareLaunchArgument('a', default_value='x', choices=5)",
    "DeclareLaunchArgument(['a'], default_value='x')",
    "DeclareLaunchArgument('a')",
    "SetLaunchConfiguration('a', 5)",
    "SetLaunchConfiguration('a')",
    "GroupAction(Node(**TALKER))",
    "GroupAction(5)",
    "GroupAction([5])",
    "GroupAction([], launch_configurations=5)",
    "TimerAction(period='x', actions=[])",
    "TimerAction(period=None, actions=[])",
    "TimerAction(period=1.0, actions=Node(**TALKER))",
    "TimerAction(period=1.0)",
    "OpaqueFunction(function=5)",
    "OpaqueFunction(function=lambda c: 5)",
    "OpaqueFunction(function=lambda c: [5])",
    "OpaqueFunction(function=lambda: [])",
    "OpaqueFunction(function=lambda c: 1/0)",
    "OpaqueFunction(function=lambda c: Node(**TALKER))",
    "OpaqueFunction(function=lambda c, x: [], args=5)",
    "IncludeLaunchDescription('x.py')",
    "IncludeLaunchDescription(5)",
    "IncludeLaunchDescription(PythonLaunchDescriptionSource(5))",
    "IncludeLaunchDescription(PythonLaunchDescriptionSource('/nope.launch.py'))",
    "IncludeLaunchDescription(PythonLaunchDescriptionSource(FindPackageShare('robot').perform(5)))",
    "IncludeLaunchDescription(FindPackageShare('robot'), launch_arguments={'a':'b'})",
    "IncludeLaunchDescription(FindPackageShare('robot'), launch_arguments=5)",
    "IncludeLaunchDescription(FindPackageShare('robot'), launch_arguments=[('a',5)])",
    "ExecuteProcess(cmd=5)",
    "ExecuteProcess(cmd=[5])",
    "ExecuteProcess()",
    "SetEnvironmentVariable('A', 5)",
    "SetEnvironmentVariable(5, 'A')",
    "SetRemap('a')",
    "SetRemap(5, 'b')",
    "PushRosNamespace(5)",
    "PushRosNamespace()",
    "LogInfo(msg=5)",
    "LogInfo()",
    "LogInfo(5)",
    "5",
    "'text'",
    "None",
    "Node",
    "LaunchDescription(5)",
    "LaunchDescription(Node(**TALKER))",
    "[Node(**TALKER)]",
    "Node(**TALKER, name=LaunchConfiguration('nope'))",
    "Node(**TALKER, name=LaunchConfiguration(5))",
    "Node(**TALKER, name=EnvironmentVariable(5))",
    "Node(**TALKER, name=PathJoinSubstitution(5))",
    "Node(**TALKER, name=PathJoinSubstitution([5]))",
    "Node(**TALKER, name=PythonExpression(5))",
    "Node(**TALKER, name=PythonExpression(['1/0']))",
    "Node(**TALKER, name=PythonExpression(['nope']))",
    "Node(**TALKER, name=PythonExpression(['1 +']))",
    "Node(**TALKER, name=TextSubstitution(text=5))",
    "Node(**TALKER, name=FindPackageShare(5))",
    "Node(**TALKER, name=FindPackageShare('robt'))",
    "Node(**TALKER, name=FindPackageShare())",
    "Node(**TALKER, name=get_package_share_directory(5))",
    "Node(**TALKER, name=get_package_share_directory(None))",
    "Node(**TALKER, name=get_package_share_directory(['robot']))",
    "Node(**TALKER, parameters=[ParameterFile(5)])",
    "Node(**TALKER, parameters=[{'a': ParameterValue('x', value_type=int)}])",
    "Node(**TALKER, parameters=[{'a': ParameterValue(LaunchConfiguration('nope'))}])",
    "Node(**TALKER, parameters=[{'a': {'b': None}}])",
    "Node(**TALKER, parameters=[{'a': {1,2}}])",
    "Node(**TALKER, parameters=[None])",
    "LifecycleNode(**TALKER)",
    "IfCondition('true')",
    "LaunchConfiguration('x')",
    "Node(**TALKER, condition=IfCondition())",
    "Node(**TALKER, condition=LaunchConfigurationEquals(0))",
    "Node(**TALKER, condition=LaunchConfigurationEquals('a', 5))",
    "Node(**TALKER, condition=UnlessCondition(PythonExpression([5])))",
)


@pytest.mark.breadth(25, 80)
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_of_a_launch_file_is_its_own(
    described: Callable[..., Described], tmp_path: Path, mistake: str
) -> None:
    """Whichever line of the evaluator raises, no mistake is taken for one of the grader's code."""
    with pytest.raises(BaseException) as raised:  # noqa: PT011  whatever ros2 launch would raise
        described(mistake)
    assert Describer(str(tmp_path)).exception(raised.value).code == "exception"


@pytest.mark.parametrize("argument", ["parameters", "name", "remappings", "arguments"])
@pytest.mark.parametrize("made", ["NoCondition(predicate=len)", "xacro.load()"])
def test_a_node_with_an_argument_that_is_left_out_is_left_out(
    described: Callable[..., Described], argument: str, made: str
) -> None:
    """What it would be is not known."""
    nodes, left_out = described(f"Node(**TALKER, {argument}={made})", before="import xacro\n")
    assert nodes == []
    assert len(left_out) == 1


@pytest.mark.parametrize(
    ("told", "said"),
    [
        (
            {"code": "package", "name": "turtlesim"},
            "what needs the package turtlesim was left out: the submission has no ",
        ),
        ({"code": "parameter_file", "name": "a.yaml"}, "the parameter file a.yaml was left out: it is not there"),
        ({"code": "action", "name": "EmitEvent"}, "the action EmitEvent is not supported and was left out"),
        ({"code": "of the student's"}, "something is not supported and was left out"),
        (
            {"code": "command", "text": "ros2 node list", "ends": True},
            'the command "ros2 node list" is not supported and was left out; the launch file was evaluated no further',
        ),
    ],
)
def test_what_is_left_out_has_its_reason(told: dict[str, Any], said: str) -> None:
    """As a sentence for notes."""
    assert left_out_sentence(NotEvaluated.checked(told)).startswith(said)


def test_what_ends_the_evaluation_says_so(described: Callable[..., Described]) -> None:
    """Nothing that follows is started, which is no news where a single action is left out."""
    nodes, left_out = described("ExecuteProcess(cmd=['rm', 'x']), Node(**TALKER)")
    assert (len(nodes), [one.ends for one in left_out]) == (1, [False])
    nodes, left_out = described("Node(**TALKER, name=get_package_share_directory('turtlesim')), Node(**TALKER)")
    assert (nodes, [one.ends for one in left_out]) == ([], [True])
