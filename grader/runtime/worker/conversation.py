"""The worker's end of the line of a stepped run: commands and answers come in, questions and results go out."""

from __future__ import annotations

import select
import socket
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any


class Conversation:
    """Tells commands from answers.

    Args:
        line: The socket.
        received: What arrives on it, as values; nothing is sent there before the last command was answered.
        tell: Sends a value.
    """

    def __init__(self, line: socket.socket, received: Iterator[Any], tell: Callable[[Mapping[str, Any]], None]) -> None:
        self._line = line
        self._received = received
        self._early: deque[Any] = deque()
        self.tell = tell

    @property
    def descriptor(self) -> int:
        """What becomes readable when something arrives."""
        return self._line.fileno()

    def ask(self, question: Mapping[str, Any]) -> Any:
        """Ask the other side, and return its answer; between two commands, that comes with the next one."""
        self.tell(question)
        while "answer" not in (data := next(self._received)):
            self._early.append(data)
        return data["answer"]

    def commands(self, idle: Callable[[], None] | None) -> Iterator[Any]:
        """Yield the commands in turn; until each arrives, call a function repeatedly, if there is one."""
        while True:
            while idle is not None and not self._early and not select.select([self._line], [], [], 0)[0]:
                idle()
            data = self._early.popleft() if self._early else next(self._received, None)
            if data is None:
                return
            yield data
