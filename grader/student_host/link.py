"""The connection to the grader: JSON lines over an inherited socket; the host sends a report, the grader answers."""

import json
import socket
from typing import Any

from . import originals


class Link:
    """The host's end of the connection.

    Args:
        descriptor: Number of the inherited socket.
    """

    def __init__(self, descriptor: int) -> None:
        self._socket = socket.socket(fileno=descriptor)
        self._socket.settimeout(None)
        self._lines = self._socket.makefile("rb")
        self._sending = originals.allocate_lock()
        self._cut = False

    def send(self, report: dict[str, Any]) -> None:
        """Send one report; raises OSError if the grader is gone, which ends the process."""
        line = json.dumps(report).encode() + b"\n"
        with self._sending:
            if not self._cut:
                self._socket.sendall(line)

    def is_free(self) -> bool:
        """Return whether no thread is sending at this moment."""
        return not self._sending.locked()

    def cut(self) -> None:
        """Close the connection in a forked process, which the grader does not know."""
        self._cut = True
        self._lines.close()
        self._socket.close()

    def ask(self, report: dict[str, Any]) -> dict[str, Any]:
        """Send one report and return the answer; raises ConnectionError if the grader is gone."""
        self.send(report)
        return self.next_answer()

    def next_answer(self) -> dict[str, Any]:
        """Wait for the grader's next answer; raises ConnectionError if the grader is gone."""
        line = self._lines.readline()
        if not line:
            raise ConnectionError("the grader is gone")
        answer: dict[str, Any] = json.loads(line)
        return answer
