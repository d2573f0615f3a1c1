"""The channels to the grader: JSON lines over an inherited socket, and log records marked by a token.

On the socket the host sends a report, and the grader answers; see `protocol`.
"""

from __future__ import annotations

import os
import socket

from . import originals
from .protocol import Answer, Report, decoded_answer, encoded_line

#: The most that is read at once.
ANSWER_BYTES = 1 << 16
_LOG_FORMAT_VARIABLE = "RCUTILS_CONSOLE_OUTPUT_FORMAT"


class Link:
    """The host's end of the connection."""

    _socket: socket.socket

    def __init__(self) -> None:
        self._sending = originals.allocate_lock()
        self._received = b""
        self._cut = False

    def open(self, descriptor: int) -> None:
        """Use the inherited socket with this number."""
        self._socket = socket.socket(fileno=descriptor)
        self._socket.settimeout(None)

    def send(self, report: Report) -> None:
        """Send one report; raises OSError if the grader is gone, which ends the process."""
        line = encoded_line(report)
        with self._sending:
            if not self._cut:
                self._socket.sendall(line)

    def is_free(self) -> bool:
        """Return whether no thread is sending at this moment."""
        return not self._sending.locked()

    def cut(self) -> None:
        """Close the connection in a forked process, which the grader does not know."""
        self._cut = True
        self._socket.close()

    def ask(self, report: Report) -> Answer:
        """Send one report and return the answer; raises ConnectionError if the grader is gone."""
        self.send(report)
        return self.next_answer()

    def next_answer(self) -> Answer:
        """Wait for the grader's next answer; raises ConnectionError if the grader is gone."""
        while b"\n" not in self._received:
            received = self._socket.recv(ANSWER_BYTES)
            if not received:
                raise ConnectionError("the grader is gone")
            self._received += received
        line, _, self._received = self._received.partition(b"\n")
        return decoded_answer(line)


class Log:
    """The logging library of this process, set up so that a token marks its records.

    A program cannot write records itself, because it does not know the token.

    Args:
        log_format: The format of records; `{token}` stands for the token.

    Attributes:
        token: Random for each process; empty once the library has it.
    """

    def __init__(self, log_format: str) -> None:
        self.token = originals.urandom(16).hex()
        self._format = log_format

    def open(self) -> None:
        """Make the library read the format, once.

        The environment variable is removed afterwards: neither the student's program nor its children can read it.
        """
        import rclpy.logging
        from rclpy.impl.implementation_singleton import rclpy_implementation

        os.putenv(_LOG_FORMAT_VARIABLE, self._format.replace("{token}", self.token))
        try:
            rclpy.logging.initialize()
        finally:
            os.unsetenv(_LOG_FORMAT_VARIABLE)
            self.token = ""
        # Logging continues after a shutdown, but would read the environment again.
        rclpy_implementation.rclpy_logging_shutdown = lambda: None
