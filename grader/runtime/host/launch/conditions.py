"""The conditions of `launch`: whether an action is done."""

from __future__ import annotations

from typing import Any

from .context import Context, text_of, truth_of


class Condition:
    """A condition of an action."""

    def __init__(self, first: Any, *parts: Any) -> None:
        self.parts = (first, *parts)

    def evaluate(self, context: Context) -> bool:
        """Return whether the action is done."""
        return truth_of(self.parts[0], context)


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
