"""Runs a plan on the wall clock, without the grader's code in the students' processes."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import time
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from grader.core.limits import Limits
from grader.core.quantities import NS_PER_S
from grader.core.trace import LogRecord, Observation, OutputLine
from grader.execution.console import Logged, last_traceback, read_console, thread_tracebacks
from grader.execution.ending import reported_fault
from grader.execution.observer import Observer
from grader.execution.plan import Plan
from grader.execution.sandbox.protocol import Command
from grader.execution.student_process import NodeProcess
from grader.execution.wall_runner import LOOK_S, WallRunner

#: Name of the sandbox process, which starts the student's.
SANDBOX = "bwrap"
#: Maximum number of sandbox processes around the student's.
DEEP = 8
INTERRUPTED = 128 + signal.SIGINT


class BareProcess(NodeProcess):
    """A process without a connection to the grader: it runs at once, is watched, and is stopped by a signal."""

    @classmethod
    def begin(cls, name: str, root: str, command: Command, limits: Limits) -> BareProcess:
        """Start the process."""
        ours, unused_end = socket.socketpair()
        student = cls.start(name, root, command, ours, limits)
        assert isinstance(student, cls)
        student.unused_end = unused_end
        return student

    #: The other end of the socket pair, which no process uses.
    unused_end: socket.socket | None = None
    _told_end = False

    def tell(self, answer: Mapping[str, Any]) -> None:
        """Send SIGINT if the answer is to stop; drop any other answer, since no host would read it."""
        if answer.get("stop") and not self._has_ended():
            with contextlib.suppress(OSError):
                os.kill(self._program(), signal.SIGINT)

    def reports(self) -> list[dict[str, Any] | None]:
        """Report the end of the process once; None stands for an end by a signal or a limit."""
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
        """Close the file descriptors of a process that has ended."""
        super().close()
        if self.unused_end is not None:
            self.unused_end.close()

    def _has_ended(self) -> bool:
        return self.process.poll() is not None

    def _parsed(self, t_ns: int, stream: str, text: str) -> list[LogRecord | OutputLine]:
        """Return the output as lines; log records are parsed from them at the end of the run."""
        return [*self._lines(t_ns, stream, text)]

    def _program(self) -> int:
        """Return the pid of the student's program, inside of the sandbox's own processes."""
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


#: How long, in real time, to wait for the first node.
FIRST_NODE_NS = 15 * NS_PER_S
#: A program that creates its first node later than PROMPT_NS after its start does something else first. For such a
#: program time starts after IMPORTS_NS, when its imports should be done.
PROMPT_NS, IMPORTS_NS = NS_PER_S // 5, NS_PER_S // 2
#: How often to check the graph until the first node appears.
FIRST_LOOK_NS = 10_000_000


class BareRunner(WallRunner):
    """Runs one plan on the real clock, with bare processes; see `WallRunner`."""

    def __init__(self, plan: Plan, students: list[NodeProcess], observer: Observer) -> None:
        super().__init__(plan, students, observer)
        self._logs: list[Logged] = []
        observer.subscribe_to_logs()

    def _begin(self) -> None:
        """Wait for the first node, and start the clock."""
        begin_ns = time.monotonic_ns()
        deadline_ns = begin_ns + (IMPORTS_NS if self._plan.first_node_ns > PROMPT_NS else FIRST_NODE_NS)
        next_ns = 0
        while not self._recorder.graph.nodes and not self._finished() and (now_ns := time.monotonic_ns()) < deadline_ns:
            if now_ns >= next_ns:
                self._look_at_graph(0)
                next_ns = now_ns + FIRST_LOOK_NS
            for student in self._students:
                self._hear(student, 0)
            time.sleep(LOOK_S)
        self._started = time.monotonic_ns()

    def _look(self, now_ns: int) -> None:
        super()._look(now_ns)
        remaining = self._plan.limits.lines - len(self._logs)
        self._logs += self._observer.logs()[: max(0, remaining)]

    def _observations(self) -> tuple[Observation, ...]:
        self._logs += self._observer.logs()
        return tuple(self._read())

    def _read(self) -> Iterator[Observation]:
        """Yield the observations, with the log records and thread faults that are found in the output."""
        seen = self._recorder.observations
        read: dict[int, list[Observation]] = {}
        for student in self._students:
            lines = [o for o in seen if isinstance(o, OutputLine) and o.process == student.name]
            found = read_console(lines, self._logs, partial(_relative, student.root))
            read |= {id(line): [] if one is None else [one] for line, one in zip(lines, found, strict=True)}
            errors = [o for o in found if isinstance(o, OutputLine) and o.stream == "stderr"]
            for number, fault in thread_tracebacks([line.text for line in errors], student.root).items():
                line = errors[number]
                read[id(line)].append(reported_fault(student.name, line.t_ns, fault, self._plan.limits, student.places))
        for observation in seen:
            yield from read.get(id(observation), [observation])


def _relative(root: str, path: str) -> str:
    return path[len(root) + 1 :] if path.startswith(f"{root}/") else ""
