"""What a launch file is evaluated with, and what substitutions are worth in it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

from ..protocol import LaunchedNode, LaunchHandler, LaunchStep, NotEvaluated
from .left_out import LeftOutError
from .package_names import PackageNotFoundError, meant_by
from .places import written_at
from .shares import Shares

_TRUE, _FALSE = ("true", "1", "yes", "on"), ("false", "0", "no", "off")


class Substitution:
    """A text that is known only when the launch file is evaluated."""

    def perform(self, context: Context) -> str:
        """Return the text."""
        raise NotImplementedError


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
        #: Reads a launch file that is not in Python, by its path.
        self.read_markup: Callable[[str, Context], Any] | None = None
        self.nodes: list[LaunchedNode] = []
        #: What is done when the launch file begins, or by the event handler that is described now.
        self.steps: list[LaunchStep] = []
        self.handlers: list[LaunchHandler] = []
        #: Describes the handlers that were registered, once everything else is described.
        self.undescribed: list[Callable[[Context], None]] = []
        self.in_handler = False
        self.left_out: list[NotEvaluated] = []

    def perform_substitution(self, value: Any) -> str:
        """Return the text of a substitution."""
        return text_of(value, self)

    def do(self, what: str, number: int = 0) -> None:
        """Note what the launch file does here, after the delay of the timers around it."""
        self.steps.append(LaunchStep(what, number, self.delay_s))

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
        self.leave_out(*written_at(), error)

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


#: What is evaluated now.
_current: Context | None = None


def begin_evaluation(context: Context) -> None:
    """Make a context the one that is evaluated now; a process evaluates one launch file, and what that includes."""
    global _current  # noqa: PLW0603  what a substitution finds without being performed
    _current = context


def current_context() -> Context:
    """Return what is evaluated now."""
    assert _current is not None
    return _current


class LaunchContext(Context):
    """A context that a launch file makes for itself."""

    def __init__(self, *, argv: Any = None, noninteractive: bool = False) -> None:
        one = current_context()
        super().__init__(one.packages, one.shares, {}, one.most_nodes, one.most_left_out)


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


def truth_of(value: Any, context: Context) -> bool:
    """Return whether a text or a substitution says that something is true; raises if it says neither."""
    text = text_of(value, context) if not isinstance(value, bool) else str(value)
    if text.strip().casefold() not in (*_TRUE, *_FALSE):
        raise ValueError(f"invalid condition expression: expected true or false, found '{text[:80]}'")
    return text.strip().casefold() in _TRUE


def word_for(value: bool) -> str:
    """Return the word that stands for a truth value in texts of `launch` and in YAML."""
    return "true" if value else "false"
