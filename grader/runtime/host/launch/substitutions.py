"""The substitutions of `launch` and `launch_ros`."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from typing import Any

from .context import Context, Substitution, current_context, text_of, truth_of, word_for
from .left_out import LeftOutError


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


class FindPackageShare(Substitution):
    """The folder of a package."""

    def __init__(self, package: Any) -> None:
        self.package = package

    def perform(self, context: Context) -> str:
        """Return the folder."""
        return self.find(text_of(self.package, context))

    def find(self, package: str) -> str:
        """Return the folder of a package at once."""
        return current_context().share_of(package)


class FindPackagePrefix(FindPackageShare):
    """The prefix of a package."""

    def find(self, package: str) -> str:
        """Return the prefix of a package at once."""
        return current_context().prefix_of(package)


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


def _chosen(context: Context, condition: Any, if_value: Any = "", else_value: Any = "") -> str:
    return text_of(if_value if truth_of(condition, context) else else_value, context)


def _same(context: Context, left: Any, right: Any) -> str:
    return word_for(text_of(left, context) == text_of(right, context))


def _content(context: Context, path: Any) -> str:
    with open(text_of(path, context), encoding="utf-8") as file:
        return file.read()


def _impossible(what: str) -> Callable[..., str]:
    def make(context: Context, *parts: Any, **more: Any) -> str:
        raise LeftOutError("substitution", what, ", ".join(text_of(part, context) for part in parts or more.values()))

    return make


#: By the name that each has in `launch.substitutions`.
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
    "NotEqualsSubstitution": _made("NotEqualsSubstitution", lambda c, a, b: word_for(text_of(a, c) != text_of(b, c))),
    "NotSubstitution": _made("NotSubstitution", lambda c, a: word_for(not truth_of(a, c))),
    "AndSubstitution": _made("AndSubstitution", lambda c, a, b: word_for(truth_of(a, c) and truth_of(b, c))),
    "OrSubstitution": _made("OrSubstitution", lambda c, a, b: word_for(truth_of(a, c) or truth_of(b, c))),
    "AnySubstitution": _made("AnySubstitution", lambda c, *all_: word_for(any(truth_of(a, c) for a in all_))),
    "AllSubstitution": _made("AllSubstitution", lambda c, *all_: word_for(all(truth_of(a, c) for a in all_))),
    "IfElseSubstitution": _made("IfElseSubstitution", _chosen),
    "FileContent": _made("FileContent", _content),
    "AnonName": _made("AnonName", lambda context, name: f"{text_of(name, context)}_1"),
    "LaunchLogDir": _made("LaunchLogDir", lambda context: context.environment.get("ROS_LOG_DIR", "/tmp")),  # noqa: S108
    "Command": _made("Command", _impossible("Command")),
    "FindExecutable": _made("FindExecutable", _impossible("FindExecutable")),
}


#: By the name that each has in `launch_ros.substitutions`.
ROS_SUBSTITUTIONS: dict[str, Any] = {
    "FindPackageShare": FindPackageShare,
    "FindPackage": FindPackagePrefix,
    "FindPackagePrefix": FindPackagePrefix,
    "ExecutableInPackage": _made("ExecutableInPackage", _impossible("ExecutableInPackage")),
    "Parameter": _made("Parameter", _impossible("Parameter")),
}
