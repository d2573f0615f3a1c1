"""Lets a program that stops at `breakpoint()` talk to the terminal of whoever runs its test."""

from __future__ import annotations

import os
import pdb
import sys
from types import FrameType
from typing import Any


def debug_at(terminal: str, program: str) -> None:
    """Let all debuggers of the module `pdb` read from a terminal and write to it.

    The standard streams of a program are no terminal: its output is recorded, and it has no input. Other processes use
    the terminal as well, so it does not become that of this process, and Ctrl-C there reaches only whoever runs the
    test.

    Args:
        terminal: The path of the terminal's device.
        program: What the program is called.
    """
    reading, writing = (os.open(terminal, way | os.O_NOCTTY) for way in (os.O_RDONLY, os.O_WRONLY))
    reads = os.fdopen(reading, encoding="utf-8", errors="replace")
    writes = os.fdopen(writing, "w", encoding="utf-8", buffering=1)

    class Debugger(pdb.Pdb):
        def __init__(self, *arguments: Any, **named: Any) -> None:
            # The stop signal is for the program, which would otherwise enter the debugger with it.
            super().__init__(*arguments, **{**named, "stdin": reads, "stdout": writes, "nosigint": True})

        def set_trace(self, frame: FrameType | None = None, *arguments: Any, **named: Any) -> None:
            self.message(f"\n{program} has stopped, and virtual time with it; c continues")
            super().set_trace(frame or sys._getframe().f_back, *arguments, **named)

    pdb.Pdb = Debugger  # type: ignore[misc]
