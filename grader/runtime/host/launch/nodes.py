"""The actions that describe nodes, and those that set something for all nodes after them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..protocol import LaunchedNode
from .actions import setting_action
from .context import Context, text_of, truth_of
from .entities import walk
from .handlers import ProcessAction, handle_exits
from .left_out import LeftOutError
from .package_names import meant_by
from .parameters import Parameter, ParameterFile, evaluated_parameter, flattened, read_parameter_file, yaml_text
from .unknown import Lacking, items_of, pairs_of

#: What a process is given that has no meaning for its node.
_IGNORED = {
    *("output", "output_format", "emulate_tty", "log_cmd", "exec_name"),
    *("sigterm_timeout", "sigkill_timeout", "cached_output", "cwd", "shell"),
}


_NOT_SUPPORTED = ("prefix", "env", "additional_env")
#: What is done when a process has ended.
_AT_END = ("on_exit", "respawn", "respawn_delay", "respawn_max_retries")


class Node(ProcessAction):
    """A program of a package, with what it is started with."""

    def __init__(  # noqa: PLR0913  as in launch_ros
        self,
        *,
        executable: Any,
        package: Any = None,
        name: Any = None,
        namespace: Any = None,
        parameters: Any = None,
        remappings: Any = None,
        arguments: Any = None,
        ros_arguments: Any = None,
        condition: Any = None,
        **more: Any,
    ) -> None:
        super().__init__(condition=condition)
        unknown = [name for name in more if name not in (*_IGNORED, *_NOT_SUPPORTED, *_AT_END)]
        if unknown:
            raise TypeError(f"{type(self).__name__}() got an unexpected keyword argument '{unknown[0]}'")
        self.package, self.executable, self.name, self.namespace = package, executable, name, namespace
        if isinstance(parameters, str) or not isinstance(parameters, (Sequence, type(None), Lacking)):
            raise TypeError(f"Expecting list of parameters, got {parameters}")
        self.parameters = items_of(parameters)
        self.remappings = pairs_of(() if remappings is None else remappings, "remappings")
        self.arguments, self.ros_arguments, self.more = items_of(arguments), items_of(ros_arguments), more

    def execute(self, context: Context) -> Iterable[Any]:
        """Describe the node, and what is done at its end."""
        if self.number is not None:
            self.start_again(context)
            return ()
        if len(context.nodes) >= context.most_nodes:
            raise LeftOutError("nodes")
        for name in _NOT_SUPPORTED:
            given = self.more.get(name)
            if isinstance(given, Lacking) or given:
                context.leave_out(self.file, self.line, LeftOutError("node_argument", name))
        name = text_of(self.name, context) if self.name is not None else ""
        namespace = _namespace(context, text_of(self.namespace, context) if self.namespace is not None else None)
        rules = [*([f"__node:={name}"] if name else []), *([] if namespace is None else [f"__ns:={namespace}"])]
        own = [(text_of(old, context), text_of(new, context)) for old, new in self.remappings]
        rules += [f"{old}:={new}" for old, new in (*context.remappings, *own)]
        given = [f"{one}:={yaml_text(value)}" for one, value in context.parameters]
        files = [*context.parameter_files]
        texts = [[os.path.basename(path), read_parameter_file(path)] for path in files]
        # As launch_ros does: without a namespace, the node's own code may set one.
        target = f"{namespace.rstrip('/')}/{name}" if name and namespace is not None else "/**"
        named: list[str] = []
        for entry in self.parameters:
            texts += self._parameters(entry, target, context, named)
        ros = [part for rule in rules for part in ("-r", rule)] + [part for one in given for part in ("-p", one)]
        package = text_of(self.package, context) if self.package is not None else ""
        context.nodes.append(
            LaunchedNode(
                package,
                "" if package in context.packages else meant_by(package, context.packages),
                text_of(self.executable, context),
                [text_of(one, context) for one in self.arguments],
                [*ros, *(text_of(one, context) for one in self.ros_arguments)],
                texts,
                self.file,
                self.line,
                named,
                [[old, new] for old, new in own],
                *self._respawned(context),
            )
        )
        self.number = len(context.nodes) - 1
        context.do("start", self.number)
        if (on_exit := self.more.get("on_exit")) is not None:
            handle_exits(self, on_exit, context)
        return ()

    def _respawned(self, context: Context) -> tuple[bool, float, int]:
        """Return whether the node is started again at its end, how much later, and how often at most."""
        given, delay_s = self.more.get("respawn"), self.more.get("respawn_delay")
        most = self.more.get("respawn_max_retries")
        for name in _AT_END[1:]:
            if isinstance(self.more.get(name), Lacking):
                context.leave_out(self.file, self.line, LeftOutError("node_argument", name))
                return False, 0.0, -1
        again = given if isinstance(given, bool) else given is not None and truth_of(given, context)
        if not again:
            return False, 0.0, -1
        if not isinstance(delay_s, (int, float, type(None))):
            raise TypeError(f"respawn_delay: expected a number of seconds, found {type(delay_s).__name__}")
        if not isinstance(most, (int, type(None))):
            raise TypeError(f"respawn_max_retries: expected a whole number, found {type(most).__name__}")
        return True, float(delay_s or 0.0), -1 if most is None else most

    def _parameters(self, entry: Any, target: str, context: Context, named: list[str]) -> list[list[str]]:
        """Return the name and text of the parameter file for an entry of `parameters`; `named` gets those by name."""
        if isinstance(entry, Mapping):
            values = dict(flattened(entry, context))
        elif isinstance(entry, Parameter):
            values = {text_of(entry.name, context): evaluated_parameter(entry.value, context)}
        else:
            given = entry.path if isinstance(entry, ParameterFile) else entry
            path = context.shares.found(text_of(given, context))
            if not os.path.isfile(path):  # as launch_ros does, with a warning
                context.leave_out(self.file, self.line, LeftOutError("parameter_file", os.path.basename(path)))
                return []
            return [[os.path.basename(path), read_parameter_file(path)]]
        named += values
        body = ", ".join(f"{json.dumps(name)}: {yaml_text(value)}" for name, value in values.items())
        return [[f"{{{body}}}", f"{json.dumps(target)}: {{ros__parameters: {{{body}}}}}\n"]]


class LifecycleNode(Node):
    """A lifecycle node, which stays unconfigured."""

    def __init__(self, *, name: Any, namespace: Any, **more: Any) -> None:
        super().__init__(name=name, namespace=namespace, **more)


class ExecuteProcess(ProcessAction):
    """A command; only `ros2 run` is understood."""

    def __init__(self, *, cmd: Any, condition: Any = None, **more: Any) -> None:
        super().__init__(condition=condition)
        self.command = list(cmd)
        self.at_end = {name: given for name, given in more.items() if name in _AT_END}

    def execute(self, context: Context) -> Iterable[Any]:
        """Describe the node of `ros2 run`, or leave the command out."""
        if self.number is not None:
            self.start_again(context)
            return ()
        words = [text_of(part, context) for part in self.command]
        words = words[0].split() + words[1:] if words else []
        if words[:2] != ["ros2", "run"] or len(words) < 4:
            raise LeftOutError("command", " ".join(words[:3]), " ".join(words))
        split = words.index("--ros-args") if "--ros-args" in words else len(words)
        node = Node(
            package=words[2],
            executable=words[3],
            arguments=words[4:split],
            ros_arguments=words[split + 1 :],
            **self.at_end,
        )
        node.file, node.line = self.file, self.line
        walk([node], context)
        self.number = node.number
        return ()


def _namespace(context: Context, own: str | None) -> str | None:
    """Return the namespace of a node: its own below those that were pushed; None if there is none at all."""
    parts = [*context.namespaces, *([] if own is None else [own])]
    return _absolute(parts) if parts else None


def _absolute(parts: Iterable[str]) -> str:
    """Return the namespace that consists of others, each below the one before unless it begins with a slash."""
    whole = ""
    for part in filter(None, parts):
        whole = part if part.startswith("/") else f"{whole.rstrip('/')}/{part}"
    return whole or "/"


def _push_namespace(context: Context, namespace: Any) -> None:
    context.namespaces.append(text_of(namespace, context))
    # launch_ros keeps the namespace there, and launch files read it.
    context.launch_configurations["ros_namespace"] = _absolute(context.namespaces)


def _set_parameters(context: Context, path: Any, *_: Any) -> None:
    context.parameter_files.append(text_of(path, context))


#: By the name that each has in `launch_ros.actions`.
ROS_ACTIONS: dict[str, Any] = {
    "Node": Node,
    "LifecycleNode": LifecycleNode,
    "PushRosNamespace": setting_action("PushRosNamespace", _push_namespace),
    "PushROSNamespace": setting_action("PushROSNamespace", _push_namespace),
    "SetParameter": setting_action(
        "SetParameter",
        lambda context, name, value: context.parameters.append((name, evaluated_parameter(value, context))),
    ),
    "SetParametersFromFile": setting_action("SetParametersFromFile", _set_parameters),
    "SetRemap": setting_action(
        "SetRemap", lambda context, old, new: context.remappings.append((text_of(old, context), text_of(new, context)))
    ),
    "SetUseSimTime": setting_action(
        "SetUseSimTime", lambda context, value: context.parameters.append(("use_sim_time", bool(value)))
    ),
}
