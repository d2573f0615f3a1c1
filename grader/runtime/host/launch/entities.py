"""What a launch description consists of, and how its actions are visited."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .context import Context
from .left_out import LeftOutError
from .places import written_at


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
        self.file, self.line = written_at()

    def execute(self, context: Context) -> Iterable[Any]:
        """Do what the action does, and return the actions to visit next; launch files derive actions from it."""
        return ()


class LaunchDescription(LaunchDescriptionEntity):
    """The actions of a launch file, in order."""

    def __init__(self, initial_entities: Iterable[Any] | None = None, **_: Any) -> None:
        self.entities = [] if initial_entities is None else list(initial_entities)

    def add_action(self, action: Any) -> None:
        """Add an action at the end."""
        self.entities.append(action)

    add_entity = add_action


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
