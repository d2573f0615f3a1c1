"""A student's process with nothing of the grader in it: what it says and how it ends is seen from outside.

No line to the grader is open in it, nothing is replaced, its environment, arguments and paths are those of a program in
any sandbox. So what it does here does not depend on whether it looks for the grader.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from grader.model.limits import Limits
from grader.model.trace import LogRecord, OutputLine
from grader.recording.console import last_traceback
from grader.recording.isolation.protocol import Command
from grader.recording.student import Student

#: The sandbox's own program, which starts the student's.
SANDBOX = "bwrap"
#: How many processes deep the student's is in its sandbox at most.
DEEP = 8
INTERRUPTED = 128 + signal.SIGINT


class BareStudent(Student):
    """A process that has no line to the grader: it is started at once, watched, and stopped by a signal."""

    @classmethod
    def begin(cls, name: str, root: str, command: Command, limits: Limits) -> BareStudent:
        """Start the process."""
        ours, nobodys = socket.socketpair()
        student = cls.start(name, root, command, ours, limits)
        assert isinstance(student, cls)
        student.nobodys = nobodys
        return student

    #: The other end of the line, which nobody has.
    nobodys: socket.socket | None = None
    _told_end = False

    def tell(self, answer: Mapping[str, Any]) -> None:
        """Send the stop signal, if that is what it is to be told; there is nobody to tell anything else."""
        if answer.get("stop") and not self._has_ended():
            with contextlib.suppress(OSError):
                os.kill(self._program(), signal.SIGINT)

    def reports(self) -> list[dict[str, Any] | None]:
        """Return how it ended, once it has; None for the end by a signal or a limit."""
        if self._told_end or not self._has_ended():
            return []
        self._told_end = True
        self.drain()
        code = self.process.returncode
        if self.stopped or not (0 <= code <= 128 or code in (INTERRUPTED, -signal.SIGINT)):
            return [None]
        report: dict[str, Any] = {"kind": "exited", "code": INTERRUPTED if code == -signal.SIGINT else code}
        fault = last_traceback(self._last.decode("utf-8", "backslashreplace"), self.root) if code == 1 else None
        return [{**report, "fault": fault} if fault else report]

    def close(self) -> None:
        """Free the descriptors of a process that has ended."""
        super().close()
        if self.nobodys is not None:
            self.nobodys.close()

    def _has_ended(self) -> bool:
        return self.process.poll() is not None

    def _parsed(self, t_ns: int, stream: str, text: str) -> list[LogRecord | OutputLine]:
        """Return what it wrote as lines; records are found in them at the end."""
        return [*self._lines(t_ns, stream, text)]

    def _program(self) -> int:
        """Return the process of the student's program, which the sandbox's own processes are around."""
        pid = self.process.pid
        for _ in range(DEEP):
            children = _children(pid)
            if _name(pid) != SANDBOX or not children:
                break
            pid = children[0]
        return pid


def _children(pid: int) -> list[int]:
    try:
        return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()]
    except (OSError, ValueError):
        return []


def _name(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/comm").read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
