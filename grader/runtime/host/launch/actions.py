"""The actions of `launch` that set something, or visit other actions."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from .context import Context, Substitution, text_of
from .entities import Action, walk
from .left_out import LeftOutError


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
        """Call it; what it would return when an event happens is not known before."""
        if context.in_handler:
            raise LeftOutError("action", "OpaqueFunction")
        made = self.function(context, *self.args, **self.kwargs)
        if made is not None and not isinstance(made, Iterable):
            raise TypeError(f"expected a list of actions from {_called(self.function)}, found {type(made).__name__}")
        return () if made is None else made


def _called(function: Any) -> str:
    name = getattr(function, "__name__", "")
    return f"{name}()" if name.isidentifier() else "the function"


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


def setting_action(name: str, put: Callable[..., Any]) -> type[Action]:
    """Return an action of this name that calls a function with the context and what the action was given."""
    return type(name, (_Setting,), {"put": staticmethod(put), "__doc__": f"The action {name}."})


def _set_environment(context: Context, name: Any, value: Any = "", *_: Any) -> None:
    variable = text_of(name, context)
    context.environment[variable] = text_of(value, context)
    if not variable.startswith(("RCUTILS_", "PYTHONUNBUFFERED")):  # these only change how logs look
        raise LeftOutError("variable", variable)


def _log(context: Context, message: Any) -> None:
    try:
        text_of(message, context)
    except LeftOutError:
        if not context.in_handler:  # there, messages are about the event, and change nothing for the nodes
            raise


#: By the name that each has in `launch.actions`.
ACTIONS: dict[str, Any] = {
    "DeclareLaunchArgument": DeclareLaunchArgument,
    "GroupAction": GroupAction,
    "LogInfo": setting_action("LogInfo", _log),
    "OpaqueFunction": OpaqueFunction,
    "SetEnvironmentVariable": setting_action("SetEnvironmentVariable", _set_environment),
    "SetLaunchConfiguration": SetLaunchConfiguration,
    "TimerAction": TimerAction,
}
