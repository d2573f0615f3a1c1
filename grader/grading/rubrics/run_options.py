"""The key `run` of a scenario: what a process is given when it is started, as `ros2 run` and `ros2 launch` take it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field, PlainValidator, WithJsonSchema

from grader.grading.rubrics.types import MatchingText, Shape, wrong
from grader.runtime.model.scenario import RunOptions
from grader.runtime.model.wording import printable

_NODE = r"[A-Za-z_][A-Za-z0-9_]*"
_ROS = r"[~/A-Za-z_][A-Za-z0-9_/]*"
NodeName = Annotated[str, MatchingText(_NODE, "a node name such as lidar", "lidar")]
Namespace = Annotated[str, MatchingText(rf"/|/?{_NODE}(?:/{_NODE})*", "a namespace such as /robot1", "/robot1")]
_From = Annotated[str, MatchingText(rf"(?:{_NODE}:)?{_ROS}", "a topic or service name such as chatter", "chatter")]
_To = Annotated[str, MatchingText(_ROS, "a topic or service name such as /talk", "/talk")]
YamlFile = Annotated[
    str, MatchingText(r"[^/\\\x00-\x1f]+\.ya?ml", "a YAML file such as parameters.yaml, without folders", "talker.yaml")
]
_VALUES = "a number, a text, yes or no, a list of one of these, or a mapping of parameters"
Scalar = bool | int | float | str


def parameter_value(name: str, value: object) -> str:
    """Return the value of a parameter as YAML that rcl reads with the same type; raises what a rubric's mistake is."""
    if isinstance(value, list) and value and all(isinstance(item, (bool, int, float, str)) for item in value):
        kinds = {type(item) for item in value}
        if kinds == {int, float}:
            value, kinds = [float(item) for item in value], {float}
        if len(kinds) == 1:
            return f"[{', '.join(_scalar(item) for item in value)}]"
        raise wrong(f"values of one type in the list `{printable(name, 40)}`")
    if isinstance(value, (bool, int, float, str)):
        return _scalar(value)
    raise wrong(f"{_VALUES} as `{printable(name, 40)}`")


def _scalar(value: Scalar) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def flat(parameters: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield the name and value of each parameter; nested ones have dots in their names."""
    for name, value in parameters.items():
        whole = f"{prefix}{name}"
        if isinstance(value, Mapping):
            yield from flat(value, f"{whole}.")
        else:
            yield whole, parameter_value(whole, value)


def _parameters(value: object) -> dict[str, str]:
    if not isinstance(value, dict):
        raise wrong("parameters such as `rate: 5.0`")
    found = dict(flat(value))
    odd = next((name for name in found if not all(c.isalnum() or c in "_.-" for c in name)), None)
    if odd is not None:
        raise wrong(f"a parameter's name of letters, digits, `_` and `.`, not {printable(odd, 40)}")
    return found


def _texts(value: object) -> dict[str, str]:
    """Convert the arguments of a launch file, all of which are texts, as `ros2 launch FILE name:=value` takes them."""
    if not isinstance(value, dict) or not all(isinstance(item, (bool, int, float, str)) for item in value.values()):
        raise wrong("launch arguments such as `rate: 5.0`")
    return {str(name): item if isinstance(item, str) else _scalar(item) for name, item in value.items()}


_ANYTHING: dict[str, Any] = {"type": "object"}
Parameters = Annotated[dict[str, str], PlainValidator(_parameters), WithJsonSchema(_ANYTHING)]
LaunchArguments = Annotated[
    dict[str, str],
    PlainValidator(_texts),
    WithJsonSchema({"type": "object", "additionalProperties": {"type": ["string", "number", "boolean"]}}),
]


class RunShape(Shape):
    """What a process is given when it is started, as on the command line of `ros2 run` or `ros2 launch`."""

    arguments: Annotated[tuple[str, ...], Field(description="arguments of the program, before the ROS arguments")] = ()
    name: Annotated[NodeName | None, Field(description="node name")] = None
    namespace: Annotated[Namespace | None, Field(description="namespace of the node")] = None
    remappings: dict[_From, _To] = Field(default={}, description="names to replace, each with its new name")
    parameters: Parameters = Field(default={}, description="parameters with their values, nested as in a YAML file")
    parameters_file: Annotated[
        YamlFile | None, Field(description="parameter file of ROS, from `files` or `provided`")
    ] = None
    launch_arguments: LaunchArguments = Field(default={}, description="arguments of a launch file, as `name:=value`")

    def built(self) -> RunOptions:
        """Return the options."""
        return RunOptions(
            arguments=self.arguments,
            name=self.name or "",
            namespace=self.namespace or "",
            remappings=tuple(self.remappings.items()),
            parameters=tuple(self.parameters.items()),
            parameters_file=self.parameters_file or "",
            launch_arguments=tuple(self.launch_arguments.items()),
        )
