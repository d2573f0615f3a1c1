"""A launch file in XML or YAML describes what the same one in Python does; what is hostile in it is refused."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import pytest

from grader.runtime.host.faults import Describer
from grader.runtime.host.launch.evaluation import describe
from grader.runtime.host.launch.markup import DEEPEST_ELEMENT, MOST_BYTES, MOST_ELEMENTS
from grader.runtime.host.protocol import LaunchedNode, NotEvaluated

Described = tuple[list[LaunchedNode], list[NotEvaluated]]
Evaluate = Callable[..., Described]


@pytest.fixture
def described(tmp_path: Path) -> Evaluate:
    """Evaluate a launch file with this name and text, and others beside it."""

    def evaluate(name: str, text: str, arguments: dict[str, str] | None = None, **others: str) -> Described:
        folder = tmp_path / "robot" / "launch"
        folder.mkdir(parents=True, exist_ok=True)
        (tmp_path / "robot" / "own.yaml").write_text("/**: {ros__parameters: {rate: 2.0}}\n")
        for other, content in {name: text, **{one.replace("_dot_", "."): c for one, c in others.items()}}.items():
            (folder / other).write_text(content)
        with patch.dict(sys.modules), patch("os.system"), patch("sys.meta_path", [*sys.meta_path]):
            given = ((str(tmp_path),), str(folder / name), {"robot": str(tmp_path / "robot")}, arguments or {})
            found = describe(*given, most_nodes=16, most_left_out=50)
            return list(found.nodes), list(found.left_out)

    return evaluate


#: The same in XML, YAML and Python.
ALIKE = {
    "a node": (
        "<node pkg='robot' exec='talker' name='a' namespace='b' args='go -v' ros_args='--log-level debug'/>",
        "- node: {pkg: robot, exec: talker, name: a, namespace: b, args: go -v, ros_args: --log-level debug}",
        "Node(package='robot', executable='talker', name='a', namespace='b', arguments=['go', '-v'],"
        " ros_arguments=['--log-level', 'debug'])",
    ),
    "no namespace": (
        "<node pkg='robot' exec='talker' name='a'><param name='x' value='1'/></node>",
        "- node: {pkg: robot, exec: talker, name: a, param: [{name: x, value: 1}]}",
        "Node(package='robot', executable='talker', name='a', parameters=[{'x': 1}])",
    ),
    "an empty namespace": (
        "<node pkg='robot' exec='talker' name='a' namespace=''><param name='x' value='1'/></node>",
        "- node: {pkg: robot, exec: talker, name: a, namespace: '', param: [{name: x, value: 1}]}",
        "Node(package='robot', executable='talker', name='a', namespace='', parameters=[{'x': 1}])",
    ),
    "a text in the log": (
        "<log message='begins'/><node pkg='robot' exec='talker'/>",
        "- log: {message: begins}\n- node: {pkg: robot, exec: talker}",
        "LogInfo(msg='begins'), Node(package='robot', executable='talker')",
    ),
    "parameters of all nodes from a file": (
        "<set_parameters_from_file filename='$(find-pkg-share robot)/own.yaml'/><node pkg='robot' exec='talker'/>",
        "- set_parameters_from_file: {filename: $(find-pkg-share robot)/own.yaml}\n- node: {pkg: robot, exec: talker}",
        "SetParametersFromFile([FindPackageShare('robot'), '/own.yaml']), Node(package='robot', executable='talker')",
    ),
    "remappings": (
        "<node pkg='robot' exec='talker'><remap from='x' to='/y'/><remap from='z' to='w'/></node>",
        "- node: {pkg: robot, exec: talker, remap: [{from: x, to: /y}, {from: z, to: w}]}",
        "Node(package='robot', executable='talker', remappings=[('x', '/y'), ('z', 'w')])",
    ),
    "types": (
        "<node pkg='robot' exec='talker'><param name='i' value='1'/><param name='f' value='1.0'/>"
        "<param name='s' value='go'/><param name='b' value='true'/><param name='n' value='5' type='str'/></node>",
        "- node: {pkg: robot, exec: talker, param: [{name: i, value: 1}, {name: f, value: 1.0}, {name: s, value: go},"
        " {name: b, value: true}, {name: n, value: '5', type: str}]}",
        "Node(package='robot', executable='talker', parameters=[{'i': 1}, {'f': 1.0}, {'s': 'go'}, {'b': True},"
        " {'n': '5'}])",
    ),
    "nested parameters": (
        "<node pkg='robot' exec='talker'><param name='pid'><param name='kp' value='1.5'/></param></node>",
        "- node: {pkg: robot, exec: talker, param: [{name: pid, param: [{name: kp, value: 1.5}]}]}",
        "Node(package='robot', executable='talker', parameters=[{'pid': {'kp': 1.5}}])",
    ),
    "a list": (
        "<node pkg='robot' exec='talker'><param name='l' value='1;2;3' value-sep=';'/></node>",
        "- node: {pkg: robot, exec: talker, param: [{name: l, value: [1, 2, 3]}]}",
        "Node(package='robot', executable='talker', parameters=[{'l': [1, 2, 3]}])",
    ),
    "a list with a substitution": (
        "<arg name='a' default='x'/><node pkg='robot' exec='talker'>"
        "<param name='l' value='$(var a);b' value-sep=';'/></node>",
        "- arg: {name: a, default: x}\n- node: {pkg: robot, exec: talker, param: [{name: l, value: ['$(var a)', b]}]}",
        "Node(package='robot', executable='talker', parameters=[{'l': ['x', 'b']}])",
    ),
    "a list of a type": (
        "<arg name='a' default='1'/><node pkg='robot' exec='talker'>"
        "<param name='l' value='$(var a);2' value-sep=';' type='list_of_strs'/></node>",
        "- arg: {name: a, default: '1'}\n"
        "- node: {pkg: robot, exec: talker, param: [{name: l, value: ['$(var a)', '2'], type: list_of_strs}]}",
        "Node(package='robot', executable='talker', parameters=[{'l': ['1', '2']}])",
    ),
    "a parameter file": (
        "<node pkg='robot' exec='talker'><param from='$(find-pkg-share robot)/own.yaml'/></node>",
        "- node: {pkg: robot, exec: talker, param: [{from: $(find-pkg-share robot)/own.yaml}]}",
        "Node(package='robot', executable='talker', parameters=[PathJoinSubstitution([FindPackageShare('robot'),"
        " 'own.yaml'])])",
    ),
    "an argument": (
        "<arg name='n' default='5'/><node pkg='robot' exec='talker'><param name='n' value='$(var n)'/></node>",
        "- arg: {name: n, default: '5'}\n- node: {pkg: robot, exec: talker, param: [{name: n, value: $(var n)}]}",
        "DeclareLaunchArgument('n', default_value='5'), Node(package='robot', executable='talker',"
        " parameters=[{'n': LaunchConfiguration('n')}])",
    ),
    "a condition": (
        "<arg name='on' default='false'/><node pkg='robot' exec='a' if='$(var on)'/>"
        "<node pkg='robot' exec='b' unless='$(var on)'/>",
        "- arg: {name: 'on', default: 'false'}\n- node: {pkg: robot, exec: a, if: $(var on)}\n"
        "- node: {pkg: robot, exec: b, unless: $(var on)}",
        "DeclareLaunchArgument('on', default_value='false'), Node(package='robot', executable='a',"
        " condition=IfCondition(LaunchConfiguration('on'))), Node(package='robot', executable='b',"
        " condition=UnlessCondition(LaunchConfiguration('on')))",
    ),
    "a group": (
        "<group><push-ros-namespace namespace='g'/><node pkg='robot' exec='a'/></group><node pkg='robot' exec='b'/>",
        "- group: [push_ros_namespace: {namespace: g}, node: {pkg: robot, exec: a}]\n- node: {pkg: robot, exec: b}",
        "GroupAction([PushRosNamespace('g'), Node(package='robot', executable='a')]),"
        " Node(package='robot', executable='b')",
    ),
    "a group without a scope": (
        "<group scoped='false'><let name='n' value='b'/></group><node pkg='robot' exec='$(var n)'/>",
        "- group: {scoped: false, children: [let: {name: n, value: b}]}\n- node: {pkg: robot, exec: $(var n)}",
        "GroupAction([SetLaunchConfiguration('n', 'b')], scoped=False),"
        " Node(package='robot', executable=LaunchConfiguration('n'))",
    ),
    "a timer": (
        "<timer period='2.5'><node pkg='robot' exec='a'/></timer>",
        "- timer: {period: 2.5, children: [node: {pkg: robot, exec: a}]}",
        "TimerAction(period=2.5, actions=[Node(package='robot', executable='a')])",
    ),
    "settings": (
        "<set_remap from='x' to='y'/><set_parameter name='p' value='1'/><set_use_sim_time value='true'/>"
        "<node pkg='robot' exec='a'/>",
        "- set_remap: {from: x, to: y}\n- set_parameter: {name: p, value: 1}\n- set_use_sim_time: {value: true}\n"
        "- node: {pkg: robot, exec: a}",
        "SetRemap('x', 'y'), SetParameter('p', 1), SetUseSimTime(True), Node(package='robot', executable='a')",
    ),
    "what is computed": (
        "<node pkg='robot' exec='a' args=\"$(eval '2 * 3') $(eval 1 + 1)x y\" name=\"$(env NOWHERE here)\"/>",
        "- node: {pkg: robot, exec: a, args: \"$(eval '2 * 3') $(eval 1 + 1)x y\", name: $(env NOWHERE here)}",
        "Node(package='robot', executable='a', arguments=['6', '2x', 'y'], name='here')",
    ),
    "a command": (
        "<executable cmd='ros2 run robot talker --ros-args -r a:=b'/>",
        "- executable: {cmd: ros2 run robot talker --ros-args -r a:=b}",
        "ExecuteProcess(cmd=['ros2', 'run', 'robot', 'talker', '--ros-args', '-r', 'a:=b'])",
    ),
}
IMPORTS = """from launch import LaunchDescription
from launch.actions import *
from launch.actions import (DeclareLaunchArgument, ExecuteProcess, GroupAction, IncludeLaunchDescription,
    SetLaunchConfiguration, TimerAction)
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node, PushRosNamespace, SetParameter, SetParametersFromFile, SetRemap, SetUseSimTime
from launch_ros.substitutions import FindPackageShare
"""


def in_python(actions: str) -> str:
    return f"{IMPORTS}\n\ndef generate_launch_description():\n    return LaunchDescription([{actions}])\n"


def of_nodes(found: Described) -> list[LaunchedNode]:
    assert found[1] == []
    return [node._replace(file="", line=0) for node in found[0]]


@pytest.mark.parametrize(("xml", "yaml", "python"), ALIKE.values(), ids=ALIKE)
def test_all_three_describe_the_same_nodes(described: Evaluate, xml: str, yaml: str, python: str) -> None:
    """With the same arguments, rules and parameter files."""
    nodes = of_nodes(described("a.launch.py", in_python(python)))
    assert nodes
    assert of_nodes(described("a.launch.xml", f"<launch>{xml}</launch>")) == nodes
    assert of_nodes(described("a.launch.yaml", "launch:\n" + yaml)) == nodes


def test_a_node_has_the_line_that_it_begins_on(described: Evaluate) -> None:
    """As in Python, relative to the submission."""
    (node,), _ = described("a.launch.xml", "<launch>\n\n  <node pkg='robot'\n        exec='talker'/>\n</launch>")
    assert (node.file, node.line) == ("robot/launch/a.launch.xml", 3)
    (node,), _ = described("a.launch.yaml", "launch:\n\n- node:\n    pkg: robot\n    exec: talker\n")
    assert (node.file, node.line) == ("robot/launch/a.launch.yaml", 3)


def test_files_of_all_kinds_include_each_other(described: Evaluate) -> None:
    """With arguments, each for what it includes."""
    include = "<include file='$(dirname)/b.launch.yaml'><arg name='who' value='talker'/></include>"
    inner = "launch:\n- include: {file: $(dirname)/c.launch.py, arg: [{name: who, value: $(var who)}]}\n"
    python = in_python("Node(package='robot', executable=LaunchConfiguration('who'))")
    (node,), left_out = described(
        "a.launch.xml", f"<launch>{include}</launch>", b_dot_launch_dot_yaml=inner, c_dot_launch_dot_py=python
    )
    assert (node.executable, left_out) == ("talker", [])


LEFT_OUT = {
    "a container": ("<node_container pkg='x' exec='y' name='z' namespace=''/>", ("action", "node_container")),
    "a prefix": ("<node pkg='robot' exec='a' launch-prefix='gdb'/>", ("node_argument", "prefix")),
    "a command": ("<executable cmd='ls -l'/>", ("command", "ls -l")),
    "xacro": ("<node pkg='robot' exec='a' args='$(command xacro)'/>", ("substitution", "Command")),
    "a search for a program": (
        "<node pkg='robot' exec='a' args='$(find-exec python3)'/>",
        ("substitution", "FindExecutable"),
    ),
}


@pytest.mark.parametrize(("xml", "told"), LEFT_OUT.values(), ids=LEFT_OUT)
def test_what_only_ros_can_do_is_left_out(described: Evaluate, xml: str, told: tuple[str, str]) -> None:
    """With the line."""
    _, left_out = described("a.launch.xml", f"<launch>\n{xml}</launch>")
    assert [(one.code, one.name, one.line) for one in left_out] == [(*told, 2)]


DEEP = "<group>" * (DEEPEST_ELEMENT + 1)
WRONG = {
    "an open element": ("a.launch.xml", "<launch>\n<node>\n</launch>", 3, "not valid XML: mismatched tag"),
    "no root": ("a.launch.xml", "", 1, "not valid XML: no element found"),
    "entities": (
        "a.launch.xml",
        '<!DOCTYPE launch [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>\n<launch>&b;</launch>',
        1,
        "entities are not read",
    ),
    "many elements": ("a.launch.xml", f"<launch>{'<arg/>' * MOST_ELEMENTS}</launch>", 1, "too many elements"),
    "deep elements": ("a.launch.xml", f"<launch>{DEEP}", 1, "too many elements, or too deep in each other"),
    "a large file": ("a.launch.xml", "<launch>" + " " * MOST_BYTES, 1, "expected at most 1 MiB, found more"),
    "another root": ("a.launch.xml", "<robot/>", 1, "Expected 'launch' as root tag"),
    "no package": ("a.launch.xml", "<launch>\n<node exec='a'/></launch>", 2, "<node> needs the attribute 'pkg'"),
    "a misspelt attribute": (
        "a.launch.xml",
        "<launch>\n<node pkg='robot' exec='a' nmae='b'/></launch>",
        2,
        "unexpected in <node>: the attribute 'nmae'",
    ),
    "a misspelt element": (
        "a.launch.xml",
        "<launch>\n<nod pkg='a'/></launch>",
        2,
        "Unrecognized entity of the type: nod",
    ),
    "an inner line": (
        "a.launch.xml",
        "<launch>\n<group>\n<node pkg='a'/>\n</group></launch>",
        3,
        "<node> needs the attribute 'exec'",
    ),
    "an unknown substitution": (
        "a.launch.xml",
        "<launch>\n<node pkg='robot' exec='$(find robot)'/></launch>",
        2,
        "Unknown substitution: find",
    ),
    "an open substitution": (
        "a.launch.xml",
        "<launch><let name='a' value='$(var b'/></launch>",
        1,
        "expected ) at the end",
    ),
    "deep substitutions": (
        "a.launch.xml",
        f"<launch><let name='a' value='{'$(var ' * 999}'/></launch>",
        1,
        "too deep",
    ),
    "both conditions": (
        "a.launch.xml",
        "<launch><node pkg='a' exec='b' if='1' unless='1'/></launch>",
        1,
        "if and unless conditions can't be used simultaneously",
    ),
    "a tab in YAML": ("a.launch.yaml", "launch:\n\t- node: {}\n", 2, "not valid YAML: found character"),
    "no list": ("a.launch.yaml", "launch: {node: {pkg: a}}\n", 1, "expected a value of `node`, found a mapping"),
    "an empty file": ("a.launch.yaml", "", 1, "expected `launch:` and a list of actions"),
    "two keys": (
        "a.launch.yaml",
        "launch:\n- {node: {pkg: a, exec: b}, arg: {}}\n",
        2,
        "expected a mapping with one key",
    ),
    "anchors": (
        "a.launch.yaml",
        "launch:\n- &a\n  node: {pkg: robot, exec: a}\n- *a\n",
        4,
        "anchors are not read, nor too many values",
    ),
    "deep YAML": ("a.launch.yaml", f"launch:\n- {'[' * 2000}", 2, "not valid YAML"),
}


@pytest.mark.parametrize(("name", "text", "line", "told"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_read_is_a_fault_at_its_line(
    described: Evaluate, tmp_path: Path, name: str, text: str, line: int, told: str
) -> None:
    """Entities, anchors, depth and size cost nothing; the fault is the file's, not the grader's."""
    with pytest.raises((AttributeError, RuntimeError, ValueError)) as raised:
        described(name, text)
    fault = Describer(str(tmp_path)).exception(raised.value)
    assert (fault.code, fault.file, fault.line) == ("exception", f"robot/launch/{name}", line)
    assert told in fault.message
