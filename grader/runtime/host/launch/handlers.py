"""Event handlers of `launch`: what is done when a process starts or ends, and when the launch file is shut down."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..protocol import MOST_HANDLERS, LaunchHandler
from .context import Context
from .entities import Action, LaunchDescriptionEntity, walk
from .left_out import LeftOutError
from .unknown import Lacking

#: The number of a node that no handler knows: it is not described, so that its events never happen.
NOBODY = -2


class ProcessAction(Action):
    """An action that starts a process, whose events handlers wait for.

    Attributes:
        number: The number of the node that it has described; None before, and for one that is left out.
    """

    number: int | None = None

    def start_again(self, context: Context) -> None:
        """Start what is described already, which an event handler may do that is called before the action is reached.

        Raises:
            RuntimeError: The action is there twice; launch executes none twice.
        """
        assert self.number is not None
        if not context.in_handler:
            raise RuntimeError(f"{type(self).__name__} action: executed more than once")
        context.do("start", self.number)


class _Handler:
    """A handler of one kind of event.

    Args:
        target: The action whose events it handles; None for those of any.
        given: What to do, or a function that says so.
        handle_once: Whether it handles the first event only.
    """

    event = name = argument = ""

    def __init__(self, target: Any, given: Any, *, handle_once: bool) -> None:
        if not (target is None or isinstance(target, Action) or callable(target)):
            raise TypeError("action_matcher must be an 'ExecuteLocal' instance or a callable")
        self.target, self.once = target, handle_once
        self.number: int | None = None
        # as launch does: what is callable is called with the event
        self.calls = callable(given) and not isinstance(given, Action)
        self.actions = list(given) if isinstance(given, Iterable) and not isinstance(given, Lacking) else [given]
        wrong = [one for one in self.actions if not isinstance(one, LaunchDescriptionEntity)]
        if wrong and not self.calls:
            raise TypeError(
                f"expected all items in '{self.argument}' iterable to be of type 'LaunchDescriptionEntity' "
                f"but got '{type(wrong[0])}'"
            )

    def register(self, context: Context) -> None:
        """Register the handler here; what it does is described last, because events happen after everything else."""
        any_action = self.event == "complete" and self.target is None
        by_function = self.calls or (callable(self.target) and not isinstance(self.target, Action))
        other = self.target is not None and not isinstance(self.target, ProcessAction)
        if not self.event or any_action or by_function or other or len(context.handlers) >= MOST_HANDLERS:
            raise LeftOutError("handler", self.name)
        if self.number is None:
            self.number = len(context.handlers)
            context.handlers.append(LaunchHandler())
            files = list(context.files)
            context.undescribed.append(lambda context: self._describe(context, files))
        context.do("register", self.number)

    def _describe(self, context: Context, files: list[str]) -> None:
        assert self.number is not None
        # as when the event happens: groups have ended, so that their namespaces and arguments are gone
        kept, around = context.scope(), (context.steps, context.files, context.delay_s, context.in_handler)
        context.steps, context.files, context.delay_s, context.in_handler = [], files, 0.0, True
        walk(self.actions, context)
        steps = context.steps
        context.steps, context.files, context.delay_s, context.in_handler = around
        context.restore(kept)
        context.handlers[self.number] = LaunchHandler(self.event, -1, self.once, steps)
        # its node may be described by a handler that comes after it
        context.undescribed.append(self._set_node)

    def _set_node(self, context: Context) -> None:
        assert self.number is not None
        if self.target is not None:
            number = self.target.number
            context.handlers[self.number] = context.handlers[self.number]._replace(
                node=NOBODY if number is None else number
            )


class _ProcessHandler(_Handler):
    """A handler of an event of processes; one without an event is left out where it is registered."""

    def __init__(self, *, target_action: Any = None, handle_once: bool = False, **given: Any) -> None:
        super().__init__(target_action, given.get(self.argument, []), handle_once=handle_once)


class OnProcessStart(_ProcessHandler):
    """A process has started."""

    event, name, argument = "start", "OnProcessStart", "on_start"


class OnProcessExit(_ProcessHandler):
    """A process has ended."""

    event, name, argument = "exit", "OnProcessExit", "on_exit"


class OnExecutionComplete(_ProcessHandler):
    """An action has ended for good."""

    event, name, argument = "complete", "OnExecutionComplete", "on_completion"


class OnProcessIO(_ProcessHandler):
    """A process has written something; it takes functions alone, which read that."""

    name, argument = "OnProcessIO", "on_stdout"


class OnShutdown(_Handler):
    """The launch file is shut down."""

    event, name, argument = "shutdown", "OnShutdown", "on_shutdown"

    def __init__(self, *, on_shutdown: Any, handle_once: bool = False) -> None:
        super().__init__(None, on_shutdown, handle_once=handle_once)


def handle_exits(target: ProcessAction, on_exit: Any, context: Context) -> None:
    """Register what a node does with its own `on_exit`."""
    OnProcessExit(target_action=target, on_exit=on_exit).register(context)


class RegisterEventHandler(Action):
    """An event handler is registered."""

    def __init__(self, event_handler: Any, **more: Any) -> None:
        super().__init__(**more)
        self.handler = event_handler

    def execute(self, context: Context) -> Iterable[Any]:
        """Register it, or leave it out."""
        if not isinstance(self.handler, _Handler):
            raise LeftOutError("action", type(self).__name__)
        self.handler.register(context)
        return ()


class _ShutdownEvent:
    """The event that shuts a launch file down."""

    def __init__(self, *, reason: Any = "", due_to_sigint: bool = False, **_: Any) -> None:
        self.reason, self.due_to_sigint = reason, due_to_sigint


class EmitEvent(Action):
    """An event is emitted; only the one that shuts the launch file down is understood."""

    def __init__(self, *, event: Any, **more: Any) -> None:
        super().__init__(**more)
        if not isinstance(event, (_ShutdownEvent, Lacking)):
            raise RuntimeError(f"EmitEvent() expected an event instance, got '{event}'.")
        self.event = event

    def execute(self, context: Context) -> Iterable[Any]:
        """Shut down, or leave the event out."""
        if not isinstance(self.event, _ShutdownEvent):
            raise LeftOutError("action", "EmitEvent")
        context.do("shutdown")
        return ()


def _shut_down(self: EmitEvent, *, reason: Any = "reason not given", **more: Any) -> None:
    EmitEvent.__init__(self, event=_ShutdownEvent(reason=reason), **more)


#: By the name that each has in `launch.actions`.
EVENT_ACTIONS: dict[str, Any] = {
    "RegisterEventHandler": RegisterEventHandler,
    "EmitEvent": EmitEvent,
    "Shutdown": type("Shutdown", (EmitEvent,), {"__init__": _shut_down, "__doc__": "The action Shutdown of launch."}),
}
#: By the name that each has in `launch.events`.
EVENTS: dict[str, Any] = {
    "Shutdown": type("Shutdown", (_ShutdownEvent,), {"__doc__": "The event Shutdown of launch."}),
}
