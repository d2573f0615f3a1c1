"""Notes what a test calls on its world: the line, and the time at which the call began and ended."""

from __future__ import annotations

import contextlib
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from grader.grading.model.tested_run import NotedCall
from grader.runtime.model.trace import Endpoint, Observation, ServiceEnd
from grader.runtime.steps import (
    Advance,
    CallService,
    Command,
    Interrupt,
    Kill,
    Publish,
    SendGoal,
    Serve,
    ServeAction,
    Simulate,
)
from grader.world.names import absolute_name
from grader.world.telling import OF_EVERY_NODE

#: The last so many calls are kept: a test may call `advance` a million times.
MOST_CALLS = 400
Given = ParamSpec("Given")
Value = TypeVar("Value")
#: Path, line and time at which a call began.
_Begun = tuple[str, int, int]
#: Where the grader's own code lies: the line of a call is the nearest one outside of it.
_GRADER = f"{Path(__file__).parents[1]}/"


class CallLog:
    """The calls of a test so far; a call inside of another one does not count.

    Args:
        now_ns: Gives the time since the test began.

    Attributes:
        calls: The last calls, in order.
        count: How many there were in all.
        looked_at: The topics that the test has looked at.
        ends: What the test and its simulations publish, hear, serve and call, each with the time from which on.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._is_inside = False
        self.calls: deque[NotedCall] = deque(maxlen=MOST_CALLS)
        self.count = 0
        self.looked_at: dict[str, None] = {}
        self.ends: dict[Endpoint | ServiceEnd, int] = {}
        self._last_ns = 0

    def begin(self) -> _Begun | None:
        """Return where and when a call begins; None if it is inside of another one."""
        if self._is_inside:
            return None
        self._is_inside = True
        return (*_place(), self._now_ns())

    def end(self, name: str, begun: _Begun | None, *, failed: bool) -> None:
        """Note a call that has begun, now that it has ended."""
        if begun is None:
            return
        self._is_inside = False
        self.count += 1
        file, line, begin_ns = begun
        self.calls.append(NotedCall(name, file, line, begin_ns, self._now_ns(), failed))

    def note(self, command: Command | None, told: Mapping[str, Any], observations: Sequence[Observation]) -> None:
        """Take in what a command offers to programs, and the commands of handles and programs, which are calls, too."""
        del told, observations
        begin_ns, self._last_ns = self._last_ns, self._now_ns()
        for end in _ends_of(command):
            self.ends.setdefault(end, self._last_ns)
        name = _OUTSIDE.get(type(command))
        if name is None or self._is_inside:
            return
        # A look at what has happened is not a step, though time has passed on the wall clock since the last command.
        if isinstance(command, Advance) and min(command.to_ns, self._last_ns) <= begin_ns:
            return
        file, line = _place()
        last = self.calls[-1] if self.calls else None
        if last is not None and (last.name, last.file, last.line, last.end_ns) == (name, file, line, begin_ns):
            self.calls[-1] = replace(last, end_ns=self._last_ns)
            return
        self.count += 1
        self.calls.append(NotedCall(name, file, line, begin_ns, self._last_ns, failed=False))

    def complain(self) -> None:
        """Complain of nothing."""

    def noting(self, name: str, function: Callable[Given, Value]) -> Callable[Given, Value]:
        """Return a function whose calls are noted."""

        def called(*args: Given.args, **kwargs: Given.kwargs) -> Value:
            __tracebackhide__ = True
            begun, failed = self.begin(), True
            try:
                value = function(*args, **kwargs)
                failed = False
                return value
            finally:
                self.end(name, begun, failed=failed)

        return called


def noted_call(method: Callable[Given, Value]) -> Callable[Given, Value]:
    """Let the calls of a method of a world be noted in its `_log`."""

    @wraps(method)
    def called(*args: Given.args, **kwargs: Given.kwargs) -> Value:
        __tracebackhide__ = True
        world: Any = args[0]
        log: CallLog = world._log  # noqa: SLF001 - the methods of a world alone are decorated
        return log.noting(method.__name__, method)(*args, **kwargs)

    return called


#: The commands of handles of calls and goals, and of programs, with their methods.
_OUTSIDE: Mapping[type, str] = {Advance: "wait", CallService: "cancel", Interrupt: "interrupt", Kill: "kill"}
#: What the test and a simulation are called among nodes.
_TEST, _SIMULATION = "the test", "simulation"


def _ends_of(command: Command | None) -> Iterator[Endpoint | ServiceEnd]:
    """Yield what a command publishes, hears, serves and calls, without services that every node has."""
    if isinstance(command, Publish):
        policies = (
            "best_effort" if command.best_effort else "reliable",
            "transient_local" if command.latched else "volatile",
        )
        yield Endpoint("publisher", command.topic, command.type, _TEST, -1, *policies)
    elif isinstance(command, Serve):
        yield ServiceEnd("service", command.service, command.type, _TEST)
    elif isinstance(command, ServeAction):
        yield ServiceEnd("service", f"{command.action}/_action/send_goal", f"{command.type}_SendGoal", _TEST)
    elif isinstance(command, CallService):
        if command.service.rpartition("/")[2] not in OF_EVERY_NODE:
            yield ServiceEnd("client", command.service, command.type, _TEST)
    elif isinstance(command, SendGoal):
        goal = command.goal
        yield ServiceEnd("client", f"{goal.action}/_action/send_goal", f"{goal.type}_SendGoal", _TEST)
    elif isinstance(command, Simulate):
        who = f"{_SIMULATION} {command.number + 1}" if command.number else _SIMULATION
        for topic, type_ in command.publishes.items():
            yield Endpoint("publisher", absolute_name(topic), type_, who, -1, "reliable", "volatile")
        for topic, types in command.hears.items():
            yield Endpoint("subscription", absolute_name(topic), types[0], who, -1, "best_effort", "volatile")
        for service, type_ in command.serves.items():
            yield ServiceEnd("service", absolute_name(service), type_, who)


def _place() -> tuple[str, int]:
    """Return path and line of the nearest frame outside of the grader."""
    frame = sys._getframe(1)  # noqa: SLF001 - inspect.stack reads the source of every frame
    while frame.f_back is not None and _is_own(frame.f_code.co_filename):
        frame = frame.f_back
    return frame.f_code.co_filename, frame.f_lineno


def _is_own(file: str) -> bool:
    return file.startswith(_GRADER) or file == contextlib.__file__
