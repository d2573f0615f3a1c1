"""Starts the logging library so that its records, and nothing else, can be told from what a program writes itself."""

from __future__ import annotations

import os

from . import originals

_VARIABLE = "RCUTILS_CONSOLE_OUTPUT_FORMAT"


def open_log(log_format: str) -> str:
    """Have the logging library begin each record with a token, and return the token.

    The library reads its environment once, here. The variable is gone before the student's program begins: neither this
    process nor its children can read it.

    Args:
        log_format: How records are written; `{token}` stands for the token.
    """
    import rclpy.logging
    from rclpy.impl.implementation_singleton import rclpy_implementation

    token = originals.urandom(16).hex()
    os.putenv(_VARIABLE, log_format.replace("{token}", token))
    try:
        rclpy.logging.initialize()
    finally:
        os.unsetenv(_VARIABLE)
    # Logging goes on after it is shut down, but would read the environment anew.
    rclpy_implementation.rclpy_logging_shutdown = lambda: None
    return token
