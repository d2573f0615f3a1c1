"""What a launch file describes: nodes with all they are started with, and what only ROS itself could do."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from grader.runtime.host.faults import Describer
from grader.runtime.host.launch_files import describe
from grader.runtime.worker.notes import left_out_sentence, left_out_words

IMPORTS = """
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import *
from launch.actions import (DeclareLaunchArgument, ExecuteProcess, GroupAction, IncludeLaunchDescription, LogInfo,
    OpaqueFunction, SetEnvironmentVariable, SetLaunchConfiguration, TimerAction, RegisterEventHandler, EmitEvent)
from launch.conditions import IfCondition, UnlessCondition, LaunchConfigurationEquals
from launch.event_handlers import OnProcessExit
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import (Command, EnvironmentVariable, LaunchConfiguration, PathJoinSubstitution,
    PythonExpression, TextSubstitution, ThisLaunchFileDir)
from launch_ros.actions import (ComposableNodeContainer, LifecycleNode, Node, PushRosNamespace, SetParameter, SetRemap)
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue
from launch_ros.substitutions import FindPackageShare
TALKER = dict(package="robot", executable="talker")
"""
Described = tuple[list[dict[str, Any]], list[dict[str, Any]]]


@pytest.fixture
def described(tmp_path: Path) -> Callable[..., Described]:
    """Evaluate a launch file with these actions."""

    def evaluate(actions: str, arguments: dict[str, str] | None = None, before: str = "", **others: str) -> Described:
        robot = tmp_path / "robot"
        (robot / "launch").mkdir(parents=True, exist_ok=True)
        (robot / "own.yaml").write_text("/**: {ros__parameters: {rate: 2.0}}\n")
        body = textwrap.indent(f"{before}return LaunchDescription([{actions}])", "    ")
        file = robot / "launch" / "a.launch.py"
        file.write_text(f"{IMPORTS}\ndef generate_launch_description():\n{body}\n")
        for name, text in others.items():
            (robot / "launch" / f"{name}.launch.py").write_text(f"{IMPORTS}\n{text}")
        with patch.dict(sys.modules):
            given = ((str(tmp_path),), str(file), {"robot": str(robot)}, arguments or {})
            return describe(*given, most_nodes=16, most_left_out=50)

    return evaluate


def ros(nodes: list[dict[str, Any]]) -> list[list[str]]:
    return [node["ros_arguments"] for node in nodes]


def test_a_node_has_everything_it_is_started_with(described: Callable[..., Described]) -> None:
    """Names, remappings, arguments, and the place where it was written."""
    nodes, left_out = described(
        "Node(**TALKER, name='a', namespace='b', remappings=[('x', '/y')], arguments=['go'], "
        "ros_arguments=['--log-level', 'debug'], output='screen', emulate_tty=True)"
    )
    assert left_out == []
    (node,) = nodes
    rules = ["-r", "__node:=a", "-r", "__ns:=/b", "-r", "x:=/y"]
    assert node["ros_arguments"] == [*rules, "--log-level", "debug"]
    assert (node["package"], node["executable"], node["arguments"]) == ("robot", "talker", ["go"])
    assert (node["file"], node["delay_s"]) == ("robot/launch/a.launch.py", 0.0)
    assert node["line"] == IMPORTS.count("\n") + 3


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
    assert nodes[0]["parameter_files"] == [[expected, f'"/**": {{ros__parameters: {expected}}}\n']]


def test_parameter_files_and_values_keep_their_order(described: Callable[..., Described]) -> None:
    """Values of a named node are for that node alone, so that they win over a file's."""
    share = "get_package_share_directory('robot')"
    nodes, left_out = described(
        f"Node(**TALKER, name='a', namespace='/n', parameters=[{share} + '/own.yaml', {{'rate': 3.0}}]), "
        "Node(**TALKER, parameters=[ParameterFile(PathJoinSubstitution([FindPackageShare('robot'), 'no.yaml']))])"
    )
    assert nodes[0]["parameter_files"] == [
        ["own.yaml", "/**: {ros__parameters: {rate: 2.0}}\n"],
        ['{"rate": 3.0}', '"/n/a": {ros__parameters: {"rate": 3.0}}\n'],
    ]
    assert nodes[1]["parameter_files"] == []
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


def test_included_files_get_arguments(described: Callable[..., Described]) -> None:
    """Beside the file, or found by the package; a function's actions and later ones are described too."""
    part = "def generate_launch_description():\n    return LaunchDescription([DeclareLaunchArgument('name'), "
    part += "Node(**TALKER, name=LaunchConfiguration('name'))])\n"
    nodes, _ = described(
        "IncludeLaunchDescription(PythonLaunchDescriptionSource([ThisLaunchFileDir(), '/part.launch.py']), "
        "  launch_arguments={'name': 'one'}.items()), "
        "TimerAction(period=2.0, actions=[OpaqueFunction(function=lambda context: [Node(**TALKER, "
        "  name=LaunchConfiguration('name').perform(context) + '_more')])]),"
        "ExecuteProcess(cmd=['ros2', 'run', 'robot', 'talker', 'hi', '--ros-args', '-r', 'a:=b'])",
        part=part,
    )
    assert [rules[1] for rules in ros(nodes)] == ["__node:=one", "__node:=one_more", "a:=b"]
    assert [node["delay_s"] for node in nodes] == [0.0, 2.0, 0.0]
    assert nodes[2]["arguments"] == ["hi"]


LEFT_OUT = {
    "ExecuteProcess(cmd=['rm', '-rf', '/'])": 'the command "rm -rf /"',
    "RegisterEventHandler(OnProcessExit(target_action=None, on_exit=[]))": "the action RegisterEventHandler",
    "ComposableNodeContainer(name='c', namespace='')": "the action ComposableNodeContainer",
    "Node(**TALKER, parameters=[{'urdf': Command(['xacro ', 'a.urdf'])}])": 'the substitution Command("xacro a.urdf")',
    "SetEnvironmentVariable('PATH', '/x')": "the environment variable PATH",
    "Node(**TALKER, prefix='gdb')": "prefix= of a node",
    "IncludeLaunchDescription('more.launch.xml')": "the launch file more.launch.xml",
    "LogInfo(msg=FindPackageShare('gazebo_ros'))": "what needs the package gazebo_ros",
}


@pytest.mark.parametrize(("action", "what"), LEFT_OUT.items(), ids=LEFT_OUT)
def test_what_only_ros_can_do_is_named(described: Callable[..., Described], action: str, what: str) -> None:
    """With its line; everything else of the file is described all the same."""
    nodes, left_out = described(f"{action}, Node(**TALKER, name='after')")
    assert "__node:=after" in nodes[-1]["ros_arguments"]
    line = IMPORTS.count("\n") + 3
    ((place, words),) = [((one["file"], one["line"]), left_out_words(one)) for one in left_out]
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
    assert ([node["executable"] for node in nodes], left_out) == (["talker"], [])


@pytest.mark.parametrize("package", ["xacro", "nav2_common.launch", "moveit_configs_utils"])
def test_what_a_package_that_is_not_here_makes_is_left_out_where_it_is_used(
    described: Callable[..., Described], package: str
) -> None:
    """The other nodes start."""
    nodes, left_out = described(
        "Node(package='robot', executable='publisher', parameters=[{'robot_description': made.toxml()}]), "
        "Node(**TALKER, parameters=[{'a': 1}]), absent.Thing(a=1)",
        before=f"import {package} as absent\nmade = absent.process_file('a.xacro', mappings={{'a': 'b'}})\n",
    )
    assert [node["executable"] for node in nodes] == ["talker"]
    assert [left_out_words(one) for one in left_out] == [
        f"what needs the package {package.split('.', maxsplit=1)[0]}"
    ] * 2


@pytest.mark.parametrize(
    ("package", "near"),
    [("robto", "robot"), ("robots", "robot"), ("robot", ""), ("my_robot", ""), ("robot2", ""), ("turtlesim", "")],
)
def test_a_misspelt_package_is_told(described: Callable[..., Described], package: str, near: str) -> None:
    """A name with a part or a number more may be that of another package."""
    nodes, _ = described(f"Node(package='{package}', executable='talker')")
    assert [node["near"] for node in nodes] == [near]


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


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_of_a_launch_file_is_its_own(
    described: Callable[..., Described], tmp_path: Path, mistake: str
) -> None:
    """Whichever line of the evaluator raises, no mistake is taken for one of the grader's code."""
    with pytest.raises(BaseException) as raised:  # noqa: PT011  whatever ros2 launch would raise
        described(mistake)
    assert Describer(str(tmp_path)).exception(raised.value)["code"] == "exception"


@pytest.mark.parametrize("argument", ["parameters", "name", "remappings", "arguments"])
@pytest.mark.parametrize("made", ["OnProcessExit(5)", "xacro.load()"])
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
    ],
)
def test_what_is_left_out_has_its_reason(told: dict[str, str], said: str) -> None:
    """As a sentence for notes."""
    assert left_out_sentence(told).startswith(said)
