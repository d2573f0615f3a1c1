"""Evaluates a Python launch file: modules in place of `launch` and `launch_ros` describe nodes and start nothing.

The names and their meaning are those of `launch` and `launch_ros` of ROS 2 Jazzy, which no wheel holds and which start
processes themselves. What ROS has and is not described here is left out, with its name and line; what ROS does not have
either raises what it raises there.
"""

from __future__ import annotations

import difflib
import errno
import functools
import json
import logging
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.machinery import ModuleSpec
from types import FrameType, ModuleType
from typing import Any

from . import launch_names
from .launch_shares import Shares
from .protocol import LaunchedNode, NotEvaluated

#: The deepest nesting of included launch files.
DEEPEST = 20
#: The longest name or text of something that is left out.
MOST_CHARACTERS = 200
#: Names this similar to a package of the submission are taken for a misspelling of it.
SIMILARITY = 0.8
#: So similar are the parts in which a misspelling and the name differ; `orion` and `robot` are not.
ALIKE = 0.7
_TRUE, _FALSE = ("true", "1", "yes", "on"), ("false", "0", "no", "off")


class LeftOutError(BaseException):
    """Something that only ROS itself can do; the action that needs it is left out.

    Not an Exception: what a launch file does after one would not be what it does in ROS.

    Args:
        code: What it is; the grader has the words for each code.
        name: Which one.
        text: What it was given, as text.
    """

    def __init__(self, code: str, name: str = "", text: str = "") -> None:
        super().__init__(code)
        self.told = NotEvaluated(code, name[:MOST_CHARACTERS], text[:MOST_CHARACTERS])
        self.place = _written_at()


class Context:
    """What a launch file is evaluated with: its arguments, namespaces, and what it sets for all nodes."""

    def __init__(
        self,
        packages: Mapping[str, str],
        shares: Shares,
        arguments: Mapping[str, str],
        most_nodes: int,
        most_left_out: int,
    ) -> None:
        self.most_nodes, self.most_left_out, self.shares = most_nodes, most_left_out, shares
        self.launch_configurations = dict(arguments)
        self.environment = dict(os.environ)
        self.packages = packages
        self.namespaces: list[str] = []
        self.remappings: list[tuple[str, str]] = []
        self.parameters: list[tuple[str, Any]] = []
        self.parameter_files: list[str] = []
        self.files: list[str] = []
        self.delay_s = 0.0
        self.nodes: list[LaunchedNode] = []
        self.left_out: list[NotEvaluated] = []

    def perform_substitution(self, value: Any) -> str:
        """Return the text of a substitution."""
        return text_of(value, self)

    def scope(self) -> tuple[Any, ...]:
        """Return a copy of everything that a group restores at its end."""
        kept = (self.launch_configurations, self.namespaces, self.remappings, self.parameters, self.parameter_files)
        return tuple(part.copy() for part in kept)

    def restore(self, kept: tuple[Any, ...]) -> None:
        """Restore what `scope` has returned."""
        self.launch_configurations, self.namespaces, self.remappings, self.parameters, self.parameter_files = kept

    def leave_out(self, file: str, line: int, error: LeftOutError) -> None:
        """Note something that is not evaluated; what is left out again at the same place is counted."""
        told = error.told._replace(file=file, line=line)
        for place, one in enumerate(self.left_out):
            # All nodes that are too many make one note, wherever they were written.
            if one.code == told.code if told.code == "nodes" else one._replace(times=told.times) == told:
                self.left_out[place] = one._replace(times=one.times + 1)
                return
        if len(self.left_out) < self.most_left_out:
            self.left_out.append(told)

    def leave_out_here(self, error: LeftOutError) -> None:
        """Note something that is not evaluated, where the launch file is now."""
        self.leave_out(*_written_at(), error)

    def know(self, package: object) -> bool:
        """Return whether the submission has a package; raises what ROS does for a name that is a misspelling of one."""
        if not isinstance(package, str):
            raise TypeError(f"expected the name of a package, found {type(package).__name__}")
        if package not in self.packages and meant_by(package, self.packages):
            raise PackageNotFoundError(f"package '{package}' not found, searching: {sorted(self.packages)}")
        return package in self.packages

    def share_of(self, package: str) -> str:
        """Return the share folder of a package of the submission."""
        if not self.know(package):
            raise LeftOutError("package", package)
        return self.shares.share_of(package)

    def prefix_of(self, package: str) -> str:
        """Return the prefix of a package of the submission."""
        if not self.know(package):
            raise LeftOutError("package", package)
        return self.shares.prefix_of(package)


def meant_by(package: str, known: Iterable[str]) -> str:
    """Return the package of which a name is a misspelling; empty if it may be the name of another one.

    A name with a part more, or with another number, is often that of a released package: `turtlesim` and
    `my_turtlesim`, `turtlebot3_gazebo` and `turtlebot4_gazebo`.
    """
    for near in difflib.get_close_matches(package, list(known), n=3, cutoff=SIMILARITY):
        one, other = (re.sub(r"[0-9]", "", name).split("_") for name in (package, near))
        # What both share, such as `description`, makes them no more alike.
        mine, theirs = ("_".join(part for part in a if part not in b) for a, b in ((one, other), (other, one)))
        if mine and theirs and difflib.SequenceMatcher(None, mine, theirs).ratio() >= ALIKE:
            return near
    return ""


class PackageNotFoundError(KeyError):
    """A package that is neither in the submission nor installed."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


PackageNotFoundError.__module__ = "ament_index_python.packages"


class LaunchDescriptionEntity:
    """An entry of a launch description, or a description."""


class Action(LaunchDescriptionEntity):
    """One entry of a launch description, and where it was written."""

    condition: Any = None
    file, line = "", 0

    def __init__(self, *, condition: Any = None, **_: Any) -> None:
        if condition is not None and not callable(getattr(condition, "evaluate", None)):
            raise TypeError(f"condition: expected a condition such as IfCondition, found {type(condition).__name__}")
        self.condition = condition
        self.file, self.line = _written_at()

    def execute(self, context: Context) -> Iterable[Any]:
        """Do what the action does, and return the actions to visit next; launch files derive actions from it."""
        return ()


#: The folders whose files are named as places: that of the submission, and that of the rubric's own files.
_folders: tuple[str, ...] = ()


#: What is evaluated now.
_evaluation: Any = None


def _written_at() -> tuple[str, int]:
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        name = frame.f_code.co_filename
        for folder in _folders:
            if name.startswith(folder):
                return os.path.relpath(name, folder), frame.f_lineno
        frame = frame.f_back
    return "", 0


def _listed(parts: Any) -> list[Any]:
    return list(parts) if isinstance(parts, (list, tuple)) else [parts]


def _pairs(given: Any, what: str) -> list[tuple[Any, Any]]:
    """Return the pairs of names and values that an argument holds; raises what a launch file did wrong."""
    if isinstance(given, Lacking):
        return [(given, given)]
    if not isinstance(given, Iterable):
        raise TypeError(f"{what}: expected pairs of a name and a value, found {type(given).__name__}")
    rows = list(given)
    for row in rows:
        if isinstance(row, str) or not isinstance(row, (tuple, list)) or len(row) != 2:
            raise TypeError(f"{what}: expected pairs of a name and a value, found {row!r}")
    return [(row[0], row[1]) for row in rows]


def _several(given: Any) -> list[Any]:
    """Return the items of an argument; what is left out stands for its items."""
    return [given] if isinstance(given, Lacking) else list(given or ())


def text_of(value: Any, context: Context) -> str:
    """Return a text, a substitution, or a sequence of these as one text."""
    if not isinstance(context, Context):
        raise TypeError(f"expected a launch context, found {type(context).__name__}")
    if isinstance(value, str):
        return value
    if isinstance(value, Substitution):
        return value.perform(context)
    if isinstance(value, os.PathLike):
        return str(os.fspath(value))
    if isinstance(value, (list, tuple)):
        return "".join(text_of(part, context) for part in value)
    raise TypeError(f"expected a text or a substitution, found {type(value).__name__}: {value!r}")


class Substitution:
    """A text that is known only when the launch file is evaluated."""

    def perform(self, context: Context) -> str:
        """Return the text."""
        raise NotImplementedError


class TextSubstitution(Substitution):
    """A fixed text."""

    def __init__(self, *, text: str) -> None:
        if not isinstance(text, str):
            raise TypeError(f"TextSubstitution expected Text object got '{type(text)}' instead.")
        self.text = text

    def perform(self, context: Context) -> str:
        """Return the text."""
        return self.text


class SubstitutionFailure(RuntimeError):  # noqa: N818  the name in launch
    """A substitution has no text."""


SubstitutionFailure.__module__ = "launch.substitutions.substitution_failure"


class LaunchConfiguration(Substitution):
    """The value of a launch argument."""

    def __init__(self, variable_name: Any, *, default: Any = None) -> None:
        self.name, self.default = variable_name, default

    def perform(self, context: Context) -> str:
        """Return the value or the default."""
        name = text_of(self.name, context)
        if name in context.launch_configurations:
            return context.launch_configurations[name]
        if self.default is None:
            raise SubstitutionFailure(f"launch configuration '{name}' does not exist")
        return text_of(self.default, context)


class EnvironmentVariable(Substitution):
    """The value of an environment variable."""

    def __init__(self, name: Any, *, default_value: Any = None) -> None:
        self.name, self.default = name, default_value

    def perform(self, context: Context) -> str:
        """Return the value or the default."""
        name = text_of(self.name, context)
        if name in context.environment:
            return context.environment[name]
        if self.default is None:
            raise SubstitutionFailure(f"environment variable '{name}' does not exist")
        return text_of(self.default, context)


class _Made(Substitution):
    """A substitution whose text a function makes from the texts of its parts."""

    def __init__(self, *parts: Any, **more: Any) -> None:
        self.parts, self.more = parts, more

    def perform(self, context: Context) -> str:
        """Return the text."""
        text: str = self.make(context, *self.parts, **self.more)
        return text

    @staticmethod
    def make(context: Context, *parts: Any, **more: Any) -> str:
        """Return the text from the parts."""
        raise NotImplementedError


def _made(name: str, make: Callable[..., str]) -> type[Substitution]:
    return type(name, (_Made,), {"make": staticmethod(make), "__doc__": f"The substitution {name} of launch."})


def _joined(context: Context, parts: Any) -> str:
    if not isinstance(parts, Iterable):
        raise TypeError(f"expected a list of the parts of a path, found {type(parts).__name__}")
    return os.path.join(*[text_of(part, context) for part in parts])


def _python(context: Context, expression: Any, *_: Any, **__: Any) -> str:
    names = {**vars(math), "math": math}
    return str(eval(text_of(expression, context), names))  # noqa: S307  what the substitution does, in the sandbox


def _truth(value: Any, context: Context) -> bool:
    text = text_of(value, context) if not isinstance(value, bool) else str(value)
    if text.strip().casefold() not in (*_TRUE, *_FALSE):
        raise ValueError(f"invalid condition expression: expected true or false, found '{text[:80]}'")
    return text.strip().casefold() in _TRUE


def _word(value: bool) -> str:
    return "true" if value else "false"


def _chosen(context: Context, condition: Any, if_value: Any = "", else_value: Any = "") -> str:
    return text_of(if_value if _truth(condition, context) else else_value, context)


def _same(context: Context, left: Any, right: Any) -> str:
    return _word(text_of(left, context) == text_of(right, context))


def _content(context: Context, path: Any) -> str:
    with open(text_of(path, context), encoding="utf-8") as file:
        return file.read()


def _impossible(what: str) -> Callable[..., str]:
    def make(context: Context, *parts: Any, **more: Any) -> str:
        raise LeftOutError("substitution", what, ", ".join(text_of(part, context) for part in parts or more.values()))

    return make


SUBSTITUTIONS: dict[str, Any] = {
    "TextSubstitution": TextSubstitution,
    "LaunchConfiguration": LaunchConfiguration,
    "EnvironmentVariable": EnvironmentVariable,
    "PathJoinSubstitution": _made("PathJoinSubstitution", _joined),
    "PathSubstitution": _made("PathSubstitution", lambda context, path: text_of(path, context)),
    "PythonExpression": _made("PythonExpression", _python),
    "ThisLaunchFile": _made("ThisLaunchFile", lambda context: context.files[-1]),
    "ThisLaunchFileDir": _made("ThisLaunchFileDir", lambda context: os.path.dirname(context.files[-1])),
    "EqualsSubstitution": _made("EqualsSubstitution", _same),
    "NotEqualsSubstitution": _made("NotEqualsSubstitution", lambda c, a, b: _word(text_of(a, c) != text_of(b, c))),
    "NotSubstitution": _made("NotSubstitution", lambda c, a: _word(not _truth(a, c))),
    "AndSubstitution": _made("AndSubstitution", lambda c, a, b: _word(_truth(a, c) and _truth(b, c))),
    "OrSubstitution": _made("OrSubstitution", lambda c, a, b: _word(_truth(a, c) or _truth(b, c))),
    "AnySubstitution": _made("AnySubstitution", lambda c, *all_: _word(any(_truth(a, c) for a in all_))),
    "AllSubstitution": _made("AllSubstitution", lambda c, *all_: _word(all(_truth(a, c) for a in all_))),
    "IfElseSubstitution": _made("IfElseSubstitution", _chosen),
    "FileContent": _made("FileContent", _content),
    "AnonName": _made("AnonName", lambda context, name: f"{text_of(name, context)}_1"),
    "LaunchLogDir": _made("LaunchLogDir", lambda context: context.environment.get("ROS_LOG_DIR", "/tmp")),  # noqa: S108
    "Command": _made("Command", _impossible("Command")),
    "FindExecutable": _made("FindExecutable", _impossible("FindExecutable")),
}


class FindPackageShare(Substitution):
    """The folder of a package."""

    def __init__(self, package: Any) -> None:
        self.package = package

    def perform(self, context: Context) -> str:
        """Return the folder."""
        return self.find(text_of(self.package, context))

    def find(self, package: str) -> str:
        """Return the folder of a package at once."""
        folder: str = _evaluation.share_of(package)
        return folder


class FindPackagePrefix(FindPackageShare):
    """The prefix of a package."""

    def find(self, package: str) -> str:
        """Return the prefix of a package at once."""
        folder: str = _evaluation.prefix_of(package)
        return folder


ROS_SUBSTITUTIONS: dict[str, Any] = {
    "FindPackageShare": FindPackageShare,
    "FindPackage": FindPackagePrefix,
    "FindPackagePrefix": FindPackagePrefix,
    "ExecutableInPackage": _made("ExecutableInPackage", _impossible("ExecutableInPackage")),
    "Parameter": _made("Parameter", _impossible("Parameter")),
}


class Condition:
    """A condition of an action."""

    def __init__(self, first: Any, *parts: Any) -> None:
        self.parts = (first, *parts)

    def evaluate(self, context: Context) -> bool:
        """Return whether the action is done."""
        return _truth(self.parts[0], context)


class IfCondition(Condition):
    """The action is done if the expression is true."""


class UnlessCondition(Condition):
    """The action is done if the expression is false."""

    def evaluate(self, context: Context) -> bool:
        """Return whether the action is done."""
        return not super().evaluate(context)


class LaunchConfigurationEquals(Condition):
    """The action is done if a launch argument has a value."""

    def __init__(self, name: Any, expected: Any) -> None:
        super().__init__(name, expected)

    def evaluate(self, context: Context) -> bool:
        """Return whether the action is done."""
        name, expected = self.parts
        found = context.launch_configurations.get(name)
        return found is None if expected is None else found == text_of(expected, context)


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    """The action is done unless a launch argument has a value."""

    def evaluate(self, context: Context) -> bool:
        """Return whether the action is done."""
        return not super().evaluate(context)


class LaunchDescription(LaunchDescriptionEntity):
    """The actions of a launch file, in order."""

    def __init__(self, initial_entities: Iterable[Any] | None = None, **_: Any) -> None:
        self.entities = [] if initial_entities is None else list(initial_entities)

    def add_action(self, action: Any) -> None:
        """Add an action at the end."""
        self.entities.append(action)

    add_entity = add_action


class DeclareLaunchArgument(Action):
    """An argument of the launch file."""

    def __init__(
        self, name: str, *, default_value: Any = None, description: str = "", choices: Any = None, **more: Any
    ) -> None:
        super().__init__(**more)
        self.name, self.default = name, default_value
        if default_value is not None and not isinstance(default_value, (str, Substitution, list, tuple, os.PathLike)):
            raise TypeError(f"default_value: expected a text or a substitution, found {type(default_value).__name__}")
        if not isinstance(name, str):
            raise TypeError(f"name: expected a text, found {type(name).__name__}")
        self.choices = [] if choices is None else list(choices)

    def execute(self, context: Context) -> Iterable[Any]:
        """Set the default, unless the argument is given."""
        if self.name not in context.launch_configurations:
            if self.default is None:
                raise RuntimeError(f"Required launch argument '{self.name}' was not provided")
            context.launch_configurations[self.name] = text_of(self.default, context)
        value = context.launch_configurations[self.name]
        if self.choices and value not in self.choices:
            raise RuntimeError(f"Argument '{self.name}' provided value '{value}' is not valid: {self.choices}")
        return ()


class SetLaunchConfiguration(Action):
    """A launch argument is set."""

    def __init__(self, name: Any, value: Any, **more: Any) -> None:
        super().__init__(**more)
        self.name, self.value = name, value

    def execute(self, context: Context) -> Iterable[Any]:
        """Set it."""
        context.launch_configurations[text_of(self.name, context)] = text_of(self.value, context)
        return ()


class GroupAction(Action):
    """Several actions with a scope of their own."""

    def __init__(
        self,
        actions: Iterable[Any],
        *,
        scoped: bool = True,
        forwarding: bool = True,
        launch_configurations: Mapping[Any, Any] | None = None,
        **more: Any,
    ) -> None:
        super().__init__(**more)
        self.actions, self.scoped = list(actions), scoped
        self.values = {} if launch_configurations is None else dict(launch_configurations)

    def execute(self, context: Context) -> Iterable[Any]:
        """Visit the actions in their scope."""
        kept = context.scope()
        given = {text_of(name, context): text_of(value, context) for name, value in self.values.items()}
        context.launch_configurations.update(given)
        walk(self.actions, context)
        if self.scoped:
            context.restore(kept)
        return ()


class TimerAction(Action):
    """Actions that are done later."""

    def __init__(self, *, period: Any, actions: Iterable[Any], cancel_on_shutdown: Any = True, **more: Any) -> None:
        super().__init__(**more)
        self.period, self.actions = period, list(actions)

    def execute(self, context: Context) -> Iterable[Any]:
        """Visit the actions with the delay."""
        period = self.period if isinstance(self.period, (int, float)) else float(text_of(self.period, context))
        context.delay_s += float(period)
        walk(self.actions, context)
        context.delay_s -= float(period)
        return ()


class OpaqueFunction(Action):
    """A function that returns actions."""

    def __init__(self, *, function: Callable[..., Any], args: Any = None, kwargs: Any = None, **more: Any) -> None:
        super().__init__(**more)
        self.function = function
        self.args, self.kwargs = () if args is None else args, {} if kwargs is None else kwargs

    def execute(self, context: Context) -> Iterable[Any]:
        """Call it."""
        made = self.function(context, *self.args, **self.kwargs)
        if made is not None and not isinstance(made, Iterable):
            raise TypeError(f"expected a list of actions from {_called(self.function)}, found {type(made).__name__}")
        return () if made is None else made


def _called(function: Any) -> str:
    name = getattr(function, "__name__", "")
    return f"{name}()" if name.isidentifier() else "the function"


class PythonLaunchDescriptionSource:
    """A launch file by its path."""

    def __init__(self, launch_file_path: Any, **_: Any) -> None:
        self.path = launch_file_path


class IncludeLaunchDescription(Action):
    """Another launch file, with arguments."""

    def __init__(self, launch_description_source: Any, *, launch_arguments: Any = None, **more: Any) -> None:
        super().__init__(**more)
        self.source, self.given = launch_description_source, () if launch_arguments is None else launch_arguments

    def execute(self, context: Context) -> Iterable[Any]:
        """Set the arguments and visit what the file describes."""
        for name, value in _pairs(self.given, "launch_arguments"):
            context.launch_configurations[text_of(name, context)] = text_of(value, context)
        if isinstance(self.source, LaunchDescription):
            return self.source.entities
        path = context.shares.found(text_of(getattr(self.source, "path", self.source), context))
        if not path.endswith(".py"):
            raise LeftOutError("launch_file", os.path.basename(path))
        if len(context.files) >= DEEPEST:
            raise RecursionError(f"launch files include each other more than {DEEPEST} times")
        context.files.append(path)
        walk(described_by(path, context).entities, context)
        context.files.pop()
        return ()


class ParameterValue:
    """The value of a parameter with its type."""

    def __init__(self, value: Any, *, value_type: Any = None) -> None:
        self.value, self.type = value, value_type


class ParameterFile:
    """A parameter file."""

    def __init__(self, param_file: Any, *, allow_substs: Any = False) -> None:
        self.path, self.allow_substs = param_file, allow_substs


class Parameter:
    """One parameter by name and value."""

    def __init__(self, name: Any, value: Any, *, value_type: Any = None, **_: Any) -> None:
        self.name, self.value = name, ParameterValue(value, value_type=value_type) if value_type else value


#: What a process is given that has no meaning for its node.
_IGNORED = {
    *("output", "output_format", "emulate_tty", "log_cmd", "exec_name", "respawn_delay", "respawn_max_retries"),
    *("sigterm_timeout", "sigkill_timeout", "cached_output", "cwd", "shell"),
}
_NOT_SUPPORTED = ("prefix", "env", "additional_env", "on_exit", "respawn")


class Node(Action):
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
        unknown = [name for name in more if name not in (*_IGNORED, *_NOT_SUPPORTED)]
        if unknown:
            raise TypeError(f"{type(self).__name__}() got an unexpected keyword argument '{unknown[0]}'")
        self.package, self.executable, self.name, self.namespace = package, executable, name, namespace
        if isinstance(parameters, str) or not isinstance(parameters, (Sequence, type(None), Lacking)):
            raise TypeError(f"Expecting list of parameters, got {parameters}")
        self.parameters = _several(parameters)
        self.remappings = _pairs(() if remappings is None else remappings, "remappings")
        self.arguments, self.ros_arguments, self.more = _several(arguments), _several(ros_arguments), more

    def execute(self, context: Context) -> Iterable[Any]:
        """Describe the node."""
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
        given = [f"{one}:={_yaml(value)}" for one, value in context.parameters]
        files = [*context.parameter_files]
        texts = [[os.path.basename(path), _read(path)] for path in files]
        # As launch_ros does: without a namespace, the node's own code may set one.
        target = f"{namespace.rstrip('/')}/{name}" if name and namespace is not None else "/**"
        for entry in self.parameters:
            texts += self._parameters(entry, target, context)
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
                context.delay_s,
                self.file,
                self.line,
            )
        )
        return ()

    def _parameters(self, entry: Any, target: str, context: Context) -> list[list[str]]:
        """Return the name and text of the parameter file for an entry of `parameters`."""
        if isinstance(entry, Mapping):
            values = dict(_flat(entry, context))
        elif isinstance(entry, Parameter):
            values = {text_of(entry.name, context): _evaluated(entry.value, context)}
        else:
            given = entry.path if isinstance(entry, ParameterFile) else entry
            path = context.shares.found(text_of(given, context))
            if not os.path.isfile(path):  # as launch_ros does, with a warning
                context.leave_out(self.file, self.line, LeftOutError("parameter_file", os.path.basename(path)))
                return []
            return [[os.path.basename(path), _read(path)]]
        body = ", ".join(f"{json.dumps(name)}: {_yaml(value)}" for name, value in values.items())
        return [[f"{{{body}}}", f"{json.dumps(target)}: {{ros__parameters: {{{body}}}}}\n"]]


class LifecycleNode(Node):
    """A lifecycle node, which stays unconfigured."""

    def __init__(self, *, name: Any, namespace: Any, **more: Any) -> None:
        super().__init__(name=name, namespace=namespace, **more)


def _read(path: str) -> str:
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read(1 << 20)


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


def _flat(parameters: Mapping[Any, Any], context: Context, prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in parameters.items():
        name = prefix + text_of(key, context)
        if isinstance(value, Mapping):
            yield from _flat(value, context, f"{name}.")
        else:
            yield name, _evaluated(value, context)


def _evaluated(value: Any, context: Context) -> Any:  # noqa: PLR0911 - one for each kind of value
    """Return the value of a parameter; the text of a substitution is read as YAML, as launch_ros does."""
    if isinstance(value, ParameterValue):
        inner = value.value
        text = text_of(inner, context) if isinstance(inner, (str, Substitution)) else None
        if text is None or value.type is None:
            return _evaluated(inner, context)
        return text if value.type is str else value.type(_loaded(text)) if value.type in (int, float) else _loaded(text)
    if isinstance(value, Substitution):
        return _loaded(value.perform(context))
    if isinstance(value, (list, tuple)) and any(isinstance(item, Substitution) for item in value):
        if all(isinstance(item, (str, Substitution)) for item in value):
            return _loaded(text_of(value, context))
        return [_evaluated(item, context) for item in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return list(value) if isinstance(value, tuple) else value


def _loaded(text: str) -> Any:
    import yaml  # comes with rclpy

    return yaml.safe_load(text)


def _yaml(value: Any) -> str:
    """Return a value as YAML that rcl reads with the same type."""
    if isinstance(value, bool):
        return _word(value)
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, list):
        if {type(item) for item in value} == {int, float}:
            value = [float(item) for item in value]
        return f"[{', '.join(_yaml(item) for item in value)}]"
    raise TypeError(f"expected the value of a parameter, found {type(value).__name__}")


class _Setting(Action):
    """An action that sets something for the actions after it, in the same scope."""

    def __init__(self, *parts: Any, **more: Any) -> None:
        known = {name: value for name, value in more.items() if name != "condition"}
        super().__init__(condition=more.get("condition"))
        self.parts = (*parts, *known.values())

    def execute(self, context: Context) -> Iterable[Any]:
        """Set it."""
        self.put(context, *self.parts)
        return ()

    @staticmethod
    def put(context: Context, *parts: Any) -> None:
        """Set it."""
        raise NotImplementedError


def _setting(name: str, put: Callable[..., Any]) -> type[Action]:
    return type(name, (_Setting,), {"put": staticmethod(put), "__doc__": f"The action {name}."})


def _push_namespace(context: Context, namespace: Any) -> None:
    context.namespaces.append(text_of(namespace, context))
    # launch_ros keeps the namespace there, and launch files read it.
    context.launch_configurations["ros_namespace"] = _absolute(context.namespaces)


def _set_parameters(context: Context, path: Any, *_: Any) -> None:
    context.parameter_files.append(text_of(path, context))


def _set_environment(context: Context, name: Any, value: Any = "", *_: Any) -> None:
    variable = text_of(name, context)
    context.environment[variable] = text_of(value, context)
    if not variable.startswith(("RCUTILS_", "PYTHONUNBUFFERED")):  # these only change how logs look
        raise LeftOutError("variable", variable)


class ExecuteProcess(Action):
    """A command; only `ros2 run` is understood."""

    def __init__(self, *, cmd: Any, condition: Any = None, **_: Any) -> None:
        super().__init__(condition=condition)
        self.command = list(cmd)

    def execute(self, context: Context) -> Iterable[Any]:
        """Describe the node of `ros2 run`, or leave the command out."""
        words = [text_of(part, context) for part in self.command]
        words = words[0].split() + words[1:] if words else []
        if words[:2] != ["ros2", "run"] or len(words) < 4:
            raise LeftOutError("command", " ".join(words[:3]), " ".join(words))
        split = words.index("--ros-args") if "--ros-args" in words else len(words)
        node = Node(package=words[2], executable=words[3], arguments=words[4:split], ros_arguments=words[split + 1 :])
        node.file, node.line = self.file, self.line
        return [node]


class Lacking(Action, Substitution):
    """Something that ROS or another package has and that is not here: what needs it is left out.

    Args:
        code: Why, as for `LeftOutError`.
        name: What it is.
    """

    _why = ("name", "launch")

    def __init__(self, code: str, name: str) -> None:
        super().__init__()
        self._why = (code, name)

    def _needed(self, *_: Any, **__: Any) -> Any:
        raise LeftOutError(*self._why)

    execute = perform = evaluate = _needed
    __str__ = __repr__ = __format__ = __fspath__ = __bytes__ = __bool__ = __int__ = __float__ = __index__ = _needed
    __iter__ = __next__ = __len__ = __contains__ = __getitem__ = __enter__ = __instancecheck__ = __lt__ = __gt__ = (
        _needed
    )
    __add__ = __radd__ = __truediv__ = __rtruediv__ = __mod__ = _needed

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self

    def __call__(self, *_: Any, **__: Any) -> Any:
        """Return the same: what it makes is not here either."""
        return self


class Unknown(Lacking):
    """A class of ROS that is not evaluated."""

    def __init__(self, *_: Any, condition: Any = None, **__: Any) -> None:
        Action.__init__(self, condition=condition)

    def execute(self, context: Context) -> Iterable[Any]:
        """Leave the action out."""
        raise LeftOutError("action", type(self).__name__)


class _Attribute:
    """What a class of ROS has under a name and is not here, for the class and its objects."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> Lacking:
        return Lacking("name", f"{owner.__name__}.{self._name}")


def like_ros(kind: type, key: str) -> None:
    """Make a class take what that of ROS takes and have what that has, as far as it differs."""
    for name in launch_names.attributes(key):
        if not hasattr(kind, name):
            setattr(kind, name, _Attribute(name))
    signature = launch_names.signature(key) if _knows_release() else None
    if signature is None:
        return
    build: Any = kind.__init__  # type: ignore[misc]
    if "__init__" not in vars(kind):  # that of its base, without what that one takes
        build = getattr(build, "__wrapped__", build)

    @functools.wraps(build)
    def checked(self: Any, *parts: Any, **more: Any) -> None:
        try:
            bound = signature.bind(*parts, **more)
        except TypeError as error:
            raise TypeError(f"{kind.__name__}.__init__() {error}") from None
        build(self, *bound.args, **bound.kwargs)

    kind.__init__ = checked  # type: ignore[misc]


def _knows_release() -> bool:
    """Return whether the names of the ROS release are known; one that is newer may have others."""
    return os.environ.get("ROS_DISTRO", launch_names.RELEASE) == launch_names.RELEASE


def unknown(module: str, name: str) -> Any:
    """Return what stands for a name of a module of ROS that is not evaluated."""
    if not _TYPE.fullmatch(name):
        return Lacking("name", f"{module}.{name}")
    if name.endswith(("Error", "Failure", "Exception")):
        return type(name, (Exception,), {"__doc__": "An exception of launch.", "__module__": module})
    kind = type(name, (Unknown,), {"__doc__": "Not evaluated.", "_why": ("name", f"{module}.{name}")})
    like_ros(kind, launch_names.key_of(module, name))
    return kind


def walk(entities: Iterable[Any], context: Context) -> None:
    """Visit actions in order; raises what a launch file's own code raises."""
    for entity in entities:
        if isinstance(entity, LaunchDescription):
            walk(entity.entities, context)
            continue
        if isinstance(entity, type) or not isinstance(entity, Action):
            raise TypeError(f"expected an action in the launch description, found {type(entity).__name__}")
        try:
            if entity.condition is None or entity.condition.evaluate(context):
                walk(entity.execute(context), context)
        except LeftOutError as error:
            context.leave_out(entity.file, entity.line, error)


def described_by(path: str, context: Context) -> LaunchDescription:
    """Run a launch file and return what its `generate_launch_description` returns."""
    with open(path, "rb") as source:
        # In a share folder lies a copy: the places are those in the submission.
        code = compile(source.read(), context.shares.source_of(path), "exec", dont_inherit=True)
    module = ModuleType("launch_file")
    module.__file__ = path
    exec(code, module.__dict__)  # noqa: S102  evaluating the student's file is the purpose
    make = getattr(module, "generate_launch_description", None)
    if not callable(make):
        raise AttributeError(f"{os.path.basename(path)} has no function generate_launch_description()")
    made = make()
    if not isinstance(made, LaunchDescription):
        raise TypeError(f"generate_launch_description() returned {type(made).__name__}, expected a LaunchDescription")
    return made


ACTIONS: dict[str, Any] = {
    "Action": Action,
    "DeclareLaunchArgument": DeclareLaunchArgument,
    "ExecuteProcess": ExecuteProcess,
    "GroupAction": GroupAction,
    "IncludeLaunchDescription": IncludeLaunchDescription,
    "LogInfo": _setting("LogInfo", lambda context, msg: text_of(msg, context)),
    "OpaqueFunction": OpaqueFunction,
    "SetEnvironmentVariable": _setting("SetEnvironmentVariable", _set_environment),
    "SetLaunchConfiguration": SetLaunchConfiguration,
    "TimerAction": TimerAction,
}
ROS_ACTIONS: dict[str, Any] = {
    "Node": Node,
    "LifecycleNode": LifecycleNode,
    "PushRosNamespace": _setting("PushRosNamespace", _push_namespace),
    "PushROSNamespace": _setting("PushROSNamespace", _push_namespace),
    "SetParameter": _setting(
        "SetParameter", lambda context, name, value: context.parameters.append((name, _evaluated(value, context)))
    ),
    "SetParametersFromFile": _setting("SetParametersFromFile", _set_parameters),
    "SetRemap": _setting(
        "SetRemap", lambda context, old, new: context.remappings.append((text_of(old, context), text_of(new, context)))
    ),
    "SetUseSimTime": _setting(
        "SetUseSimTime", lambda context, value: context.parameters.append(("use_sim_time", bool(value)))
    ),
}
_CONDITIONS: dict[str, Any] = {
    kind.__name__: kind
    for kind in (IfCondition, UnlessCondition, LaunchConfigurationEquals, LaunchConfigurationNotEquals)
}
_DESCRIPTIONS: dict[str, Any] = {
    "ParameterValue": ParameterValue,
    "ParameterFile": ParameterFile,
    "Parameter": Parameter,
}


def _source(name: str) -> type[PythonLaunchDescriptionSource]:
    return type(name, (PythonLaunchDescriptionSource,), {"__doc__": f"The source {name}."})


_SOURCES = {
    "PythonLaunchDescriptionSource": PythonLaunchDescriptionSource,
    **{name: _source(name) for name in ("AnyLaunchDescriptionSource", "FrontendLaunchDescriptionSource")},
}
_SUBSTITUTION_TYPES = {
    "SomeSubstitutionsType": Any,
    "SomeSubstitutionsType_types_tuple": (str, Substitution, list, tuple),
}


class LaunchContext(Context):
    """A context that a launch file makes for itself."""

    def __init__(self, *, argv: Any = None, noninteractive: bool = False) -> None:
        one = _evaluation
        super().__init__(one.packages, one.shares, {}, one.most_nodes, one.most_left_out)


#: What is evaluated, by the modules of ROS that have it.
MODULES: dict[str, dict[str, Any]] = {
    "launch": {
        "LaunchDescription": LaunchDescription,
        "LaunchContext": LaunchContext,
        "LaunchDescriptionEntity": LaunchDescriptionEntity,
        "Action": Action,
        "Substitution": Substitution,
        **_SUBSTITUTION_TYPES,
    },
    "launch.actions": ACTIONS,
    "launch.conditions": _CONDITIONS,
    "launch.launch_description_sources": dict(_SOURCES),
    "launch.substitutions": SUBSTITUTIONS,
    "launch.logging": {"get_logger": logging.getLogger},
    "launch.some_substitutions_type": _SUBSTITUTION_TYPES,
    "launch.utilities": {
        "perform_substitutions": lambda context, parts: text_of(parts, context),
        "normalize_to_list_of_substitutions": _listed,
    },
    "launch_ros.actions": ROS_ACTIONS,
    "launch_ros.descriptions": _DESCRIPTIONS,
    "launch_ros.parameter_descriptions": _DESCRIPTIONS,
    "launch_ros.substitutions": ROS_SUBSTITUTIONS,
    "launch_xml.launch_description_sources": {"XMLLaunchDescriptionSource": _source("XMLLaunchDescriptionSource")},
    "launch_yaml.launch_description_sources": {"YAMLLaunchDescriptionSource": _source("YAMLLaunchDescriptionSource")},
}
_TYPE = re.compile(r"[A-Z]\w*")
_CLASSES = {
    launch_names.key_of(module, name): found
    for module, members in MODULES.items()
    for name, found in members.items()
    if isinstance(found, type)
}
for _key, _kind in _CLASSES.items():
    if _kind.__module__ == __name__ and _kind is not Context:
        like_ros(_kind, _key)


def install(context: Context) -> None:
    """Put the modules in place of `launch`, `launch_ros` and `ament_index_python`."""
    index = _index(context)
    for name in {**launch_names.MODULES, **MODULES}:
        module = sys.modules[name] = ModuleType(name)
        module.__path__ = []
        module.__dict__.update(MODULES.get(name, {}))
        module.__dict__["__getattr__"] = _of_ros(module)
        if name.startswith("ament_index_python"):
            names = launch_names.MODULES[name].split()
            module.__dict__.update({one: found for one, found in index.items() if one in names})
    for name in (*launch_names.MODULES, *MODULES):
        above, _, last = name.rpartition(".")
        if above:
            setattr(sys.modules[above], last, sys.modules[name])
    sys.meta_path.append(_Unavailable())


def _index(context: Context) -> dict[str, Any]:
    """Return what `ament_index_python` has: it knows the packages of the submission, and asks for no other in vain."""
    from pathlib import Path

    def share(package: str, *_: Any, **__: Any) -> str:
        return context.share_of(package)

    def unknown_to_us(package: object) -> None:
        if isinstance(package, str) and not context.know(package):
            context.leave_out_here(LeftOutError("package", package))

    def has_resource(resource_type: str, resource_name: str) -> Any:
        if resource_type != "packages":
            return Lacking("name", "ament_index_python.has_resource")
        unknown_to_us(resource_name)
        return context.prefix_of(resource_name) if resource_name in context.packages else False

    class Prefixes(dict[str, str]):
        """The prefixes of packages by name; whoever looks for another one is told that it is left out."""

        def __contains__(self, package: object) -> bool:
            unknown_to_us(package)
            return super().__contains__(package)

        def get(self, package: str, default: Any = None) -> Any:
            """Return the prefix of a package."""
            return super().get(package, default) if package in self else default

        def __missing__(self, package: str) -> str:
            return context.prefix_of(package)

    def prefixes() -> dict[str, str]:
        return Prefixes({package: context.prefix_of(package) for package in context.packages})

    def resources(resource_type: str) -> Any:
        return prefixes() if resource_type == "packages" else Lacking("name", "ament_index_python.get_resources")

    def search_paths() -> list[str]:
        return list(dict.fromkeys(context.prefix_of(package) for package in context.packages))

    return {
        "get_package_share_directory": share,
        "get_package_prefix": context.prefix_of,
        "get_package_share_path": lambda package, *_, **__: Path(context.share_of(package)),
        "get_packages_with_prefixes": prefixes,
        "get_resources": resources,
        "get_search_paths": search_paths,
        "has_resource": has_resource,
        "PackageNotFoundError": PackageNotFoundError,
        "RESOURCE_INDEX_SUBFOLDER": "share/ament_index/resource_index",
        "AMENT_PREFIX_PATH_ENV_VAR": "AMENT_PREFIX_PATH",
    }


#: Packages that launch files import and that are not here: what they make is left out where it is used.
_ABSENT = (
    "launch_param_builder",
    "launch_pal",
    "launch_testing",
    "launch_testing_ament_cmake",
    "launch_testing_ros",
    "moveit_configs_utils",
    "nav2_common",
    "ros_gz_sim",
    "simple_launch",
    "webots_ros2_driver",
    "xacro",
)


class _Unavailable:
    """Finds the packages that are not here, and modules of launch that only a newer ROS may have."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Return what loads a module; None for one of others."""
        package = name.partition(".")[0]
        newer = package in _PACKAGES and not _knows_release()
        return ModuleSpec(name, self, is_package=True) if newer or package in _ABSENT else None  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return a module whose names are made when they are asked for."""
        module, package = ModuleType(spec.name), spec.name.partition(".")[0]
        module.__dict__["__getattr__"] = _absent(package) if package in _ABSENT else _of_ros(module)
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing: there is no code."""


_PACKAGES = frozenset(name.partition(".")[0] for name in MODULES)


def _absent(package: str) -> Callable[[str], Any]:
    def find(name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Lacking("module", package)

    return find


def _of_ros(module: ModuleType) -> Callable[[str], Any]:
    """Return what finds a name of a module of ROS: what is evaluated, or what stands for it; others do not exist."""

    def find(name: str) -> Any:
        where = module.__name__
        known = launch_names.has(where, name) or not (_knows_release() or name.startswith("_"))
        if not known:
            raise AttributeError(f"module '{where}' has no attribute '{name}'")
        found = _CLASSES.get(launch_names.key_of(where, name)) or unknown(where, name)
        setattr(module, name, found)
        return found

    return find


def _left_out_by(error: OSError, folders: Sequence[str]) -> LeftOutError | None:
    """Return what a launch file could not do in the sandbox and could do elsewhere; None if the mistake is its own."""
    step = error.__traceback__
    while step is not None and step.tb_next is not None:
        step = step.tb_next
    # Most commands are not in the sandbox, and no shell.
    if step is not None and step.tb_frame.f_code.co_filename == subprocess.__file__:
        command = step.tb_frame.f_locals.get("args") or ()
        words = [os.fsdecode(word) for word in command if isinstance(word, (str, bytes, os.PathLike))]
        return LeftOutError("command", text=" ".join(words[2:] if words[1:2] == ["-c"] else words))
    # The submission is there to be read.
    name = error.filename
    refused = error.errno in (errno.EROFS, errno.EACCES, errno.EPERM) and isinstance(name, str)
    inside = refused and any(os.path.abspath(name).startswith(folder) for folder in folders)
    return LeftOutError("written_file", os.path.basename(name)) if inside else None


def _without_shell(context: Context) -> Callable[[Any], int]:
    def system(command: Any) -> int:
        context.leave_out_here(LeftOutError("command", text=os.fsdecode(command)))
        return 0

    return system


def describe(  # noqa: PLR0913  what to evaluate, with what, and how much of it
    folders: tuple[str, ...],
    path: str,
    packages: Mapping[str, str],
    arguments: Mapping[str, str],
    *,
    prefix: str = "",
    most_nodes: int,
    most_left_out: int,
) -> tuple[list[LaunchedNode], list[NotEvaluated]]:
    """Evaluate a launch file; raises whatever it raises.

    Args:
        folders: The submission's folder, and that of the rubric's own files.
        path: The launch file, in one of them.
        packages: Name and folder of each ROS package of the submission.
        arguments: The launch arguments.
        prefix: The folder that share folders are laid out in; empty to lay out none.
        most_nodes: So many nodes are described; whatever follows the last one is left out.
        most_left_out: So many things are said to be left out.

    Returns:
        The nodes, and what was left out.
    """
    global _folders  # noqa: PLW0603  every action needs them, also those that a launch file makes at import
    _folders = tuple(os.path.join(folder, "") for folder in folders)
    global _evaluation  # noqa: PLW0603  what a substitution finds without being performed
    shares = Shares(packages, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), prefix)
    context = _evaluation = Context(packages, shares, arguments, most_nodes, most_left_out)
    install(context)
    setattr(os, "system", _without_shell(context))  # noqa: B010  a plain assignment would need its exact type
    # Once a package is built, a launch file imports the modules of its package.
    sys.path += [folder for folder in packages.values() if folder not in sys.path]
    context.files.append(path)
    try:
        walk(described_by(path, context).entities, context)
    except LeftOutError as error:
        _leave_out_all(context, path, error)
    except OSError as error:
        left_out = _left_out_by(error, _folders)
        if left_out is None:
            raise
        left_out.place = _place_of(error)
        _leave_out_all(context, path, left_out)
    return context.nodes, context.left_out


def _leave_out_all(context: Context, path: str, error: LeftOutError) -> None:
    """Note what ended the evaluation of a launch file."""
    error.told = error.told._replace(ends=True)
    file, line = error.place
    context.leave_out(file or os.path.basename(path), line, error)


def _place_of(error: BaseException) -> tuple[str, int]:
    """Return the last line of the submission that an exception went through."""
    place, step = ("", 0), error.__traceback__
    while step is not None:
        name = step.tb_frame.f_code.co_filename
        for folder in _folders:
            if name.startswith(folder):
                place = os.path.relpath(name, folder), step.tb_lineno
        step = step.tb_next
    return place
