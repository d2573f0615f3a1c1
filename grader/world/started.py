"""A program that was started, as a test sees it, and lists that say why nothing has arrived in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar, overload

from grader.runtime.model.trace import Fault, LogRecord, OutputLine
from grader.world.errors import NoMessage

Value = TypeVar("Value")


class Messages(list[Value]):
    """What has arrived so far, such as messages of a topic; asking for what has not arrived says why there is none."""

    def __init__(self, found: Sequence[Value], why: Callable[[], NoMessage]) -> None:
        super().__init__(found)
        self._why = why

    @overload  # type: ignore[override]
    def __getitem__(self, index: int) -> Value: ...
    @overload
    def __getitem__(self, index: slice) -> list[Value]: ...
    def __getitem__(self, index: int | slice) -> Value | list[Value]:
        """Return a message or some of them; raises NoMessage for one that has not arrived."""
        __tracebackhide__ = True
        try:
            return super().__getitem__(index)
        except IndexError:
            raise (NoMessage(f"only {len(self)} so far") if self else self._why()) from None


class Program:
    """A program that was started, in its own process.

    Attributes:
        name: What it is called in messages.
        root: The folder that places in its code are relative to.
    """

    def __init__(
        self, name: str, root: Path, signal: Callable[[Program, str], None], catch_up: Callable[[], None]
    ) -> None:
        self.name = name
        self.root = root
        self._signal = signal
        self._catch_up = catch_up
        self._logs: list[LogRecord] = []
        self._lines: list[OutputLine] = []
        self._ended = False
        self._exit_code: int | None = None
        self.fault: Fault | None = None

    def __repr__(self) -> str:
        """Return name and state."""
        state = f"exited with code {self._exit_code}" if self._ended else "running"
        return f"<Program {self.name}: {state}>"

    @property
    def logs(self) -> list[LogRecord]:
        """What it has logged through rclpy: `t_ns`, `severity`, `logger`, `text`, `file` and `line`."""
        __tracebackhide__ = True
        self._catch_up()
        return Messages(self._logs, lambda: NoMessage(f"{self.name} has logged nothing"))

    @property
    def output(self) -> str:
        """What it has written to standard output and standard error, without log records."""
        __tracebackhide__ = True
        self._catch_up()
        return "".join(f"{line.text}\n" for line in self._lines)

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        __tracebackhide__ = True
        self._catch_up()
        return not self._ended

    @property
    def exit_code(self) -> int | None:
        """Its exit code as a shell shows it, so 128 and the number of a signal that ended it; None while it runs."""
        __tracebackhide__ = True
        self._catch_up()
        return self._exit_code

    def interrupt(self) -> None:
        """Send it the stop signal, as Ctrl-C does, and let it do what it does at once.

        A program that takes time to stop, in virtual time, goes on with the next step.
        """
        __tracebackhide__ = True
        self._signal(self, "interrupt")

    def kill(self) -> None:
        """End it at once, as SIGKILL does.

        Its nodes say no farewell: others see them until their lease ends, after 20 s.
        """
        __tracebackhide__ = True
        self._signal(self, "kill")

    def _note(self, observation: LogRecord | OutputLine | Fault) -> None:
        if isinstance(observation, LogRecord):
            self._logs.append(observation)
        elif isinstance(observation, OutputLine):
            self._lines.append(observation)
        else:
            self.fault = self.fault or observation

    def _end(self, exit_code: int | None) -> None:
        self._ended, self._exit_code = True, exit_code
