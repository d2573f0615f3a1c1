"""Starts the logging library so that its records, and nothing else, can be told from what a program writes itself."""

from __future__ import annotations

import os

from . import originals

_VARIABLE = "RCUTILS_CONSOLE_OUTPUT_FORMAT"


class Log:
    """The logging library of this process, whose records begin with a token.

    Args:
        log_format: How records are written; `{token}` stands for the token.

    Attributes:
        token: Drawn anew for each process; empty once the library has it.
    """

    def __init__(self, log_format: str) -> None:
        self.token = originals.urandom(16).hex()
        self._format = log_format

    def open(self) -> None:
        """Have the library read the format, once.

        The variable is gone again afterwards: neither the student's program nor its children can read it.
        """
        import rclpy.logging
        from rclpy.impl.implementation_singleton import rclpy_implementation

        os.putenv(_VARIABLE, self._format.replace("{token}", self.token))
        try:
            rclpy.logging.initialize()
        finally:
            os.unsetenv(_VARIABLE)
            self.token = ""
        # Logging goes on after it is shut down, but would read the environment anew.
        rclpy_implementation.rclpy_logging_shutdown = lambda: None
