"""One student process as the worker sees it: its line, its output, its end."""

from __future__ import annotations

import contextlib
import json
import os
import re
import selectors
import signal
import socket
import subprocess
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from grader.model.trace import Fault, FaultKind, LogRecord, OutputLine
from grader.recording.isolation.protocol import Command

#: How the host's processes write log records on standard error, so that they can be told from other output.
LOG_FORMAT = "\x1e{severity}\x1f{name}\x1f{file_name}\x1f{line_number}\x1f{message}\x1d"
#: No part of a record runs over the start of the next one: a stream of starts without ends is read in linear time.
LOG_RECORD = re.compile("\x1e([A-Z]+)\x1f([^\x1e\x1f]*)\x1f([^\x1e\x1f]*)\x1f([0-9]+)\x1f([^\x1d\x1e]*)\x1d\n?")
#: Output of one stream beyond this is read, but not kept.
OUTPUT_BYTES = 1 << 20
#: A report longer than this is not the host's.
REPORT_BYTES = 4 << 20
#: A text longer than this is cut.
TEXT_CHARACTERS = 4000
#: Real seconds that a process gets to end by itself after the stop signal.
GRACE_S = 0.2
#: Real seconds without a report, after which a process is taken for dead weight; the host's own watchdog is faster.
SILENCE_S = 90.0


@dataclass
class Student:
    """A running student process.

    Attributes:
        name: The wanted file name; what traces call the process.
        root: The submission's folder as the process sees it.
        wake_ns: When it next wants to run, or None.
        claims: Its endpoints, as it says.
        arrivals: What it has not yet been told is on its way to it.
        told: The counterparts it has been told to wait for.
        offers: What it has told of services, clients and parameters.
        nudged: Whether it should look again at this instant, because its endpoints were matched.
        ended: Whether it has ended.
        used_ns: Processor time it has used, as it says.
        unsettled: Why its program does not settle, as it says; empty if it does.
    """

    name: str
    root: str
    process: subprocess.Popen[bytes]
    line: socket.socket
    wake_ns: int | None = None
    claims: list[dict[str, Any]] = field(default_factory=list)
    arrivals: dict[str, int] = field(default_factory=dict)
    told: dict[str, dict[str, int]] = field(default_factory=dict)
    offers: set[tuple[str, str, str]] = field(default_factory=set)
    nudged: bool = False
    ended: bool = False
    used_ns: int = 0
    unsettled: str = ""
    notes: list[str] = field(default_factory=list)
    _pending: bytes = b""
    _streams: dict[str, bytearray] = field(default_factory=lambda: {"stdout": bytearray(), "stderr": bytearray()})
    _kept: dict[str, int] = field(default_factory=lambda: {"stdout": 0, "stderr": 0})
    _selector: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)

    @classmethod
    def start(cls, name: str, root: str, command: Command, line: socket.socket) -> Student:
        """Start the process; `line` is the worker's end."""
        process = subprocess.Popen(
            command.argv,
            env=dict(command.environment),
            pass_fds=command.pass_fds,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        for descriptor in command.opened_fds:
            os.close(descriptor)
        student = cls(name, root, process, line)
        for stream, source in (("stdout", process.stdout), ("stderr", process.stderr)):
            if source is not None:
                os.set_blocking(source.fileno(), False)
                student._selector.register(source, selectors.EVENT_READ, stream)
        student._selector.register(line, selectors.EVENT_READ, "line")
        return student

    def tell(self, answer: Mapping[str, Any]) -> None:
        """Send an answer; a process that is gone is noticed at its next report."""
        try:
            self.line.sendall(json.dumps(answer).encode() + b"\n")
        except OSError:
            return

    def report(self) -> dict[str, Any] | None:
        """Wait for the next report, reading its output meanwhile; None if the process has ended or never reports."""
        deadline = time.monotonic() + SILENCE_S
        while b"\n" not in self._pending:
            ready = self._selector.select(timeout=1.0)
            for key, _ in ready:
                if key.data != "line":
                    self._read(key.data)
                elif not self._receive():
                    return None
            if time.monotonic() > deadline or len(self._pending) > REPORT_BYTES:
                return None
        self.drain()
        return self._parsed_report()

    def _parsed_report(self) -> dict[str, Any] | None:
        line, _, self._pending = self._pending.partition(b"\n")
        try:
            data = json.loads(line)
        except (ValueError, RecursionError):
            return None
        return data if isinstance(data, dict) else None

    def reports(self) -> list[dict[str, Any] | None]:
        """Return the reports that are there, without waiting; a last None if the process has ended."""
        gone = False
        while any(key.data == "line" for key, _ in self._selector.select(timeout=0)) and not gone:
            gone = not self._receive()
        found: list[dict[str, Any] | None] = []
        while b"\n" in self._pending:
            found.append(self._parsed_report())
        return [*found, None] if gone and not any(r and r.get("kind") == "exited" for r in found) else found

    def _receive(self) -> bool:
        try:
            received = self.line.recv(1 << 16)
        except OSError:
            return False
        self._pending += received
        return bool(received)

    def _read(self, stream: str) -> bool:
        """Read what a stream holds; return whether it held anything."""
        source = self.process.stdout if stream == "stdout" else self.process.stderr
        if source is None or source.closed:
            return False
        try:
            found = os.read(source.fileno(), 1 << 16)
        except BlockingIOError:
            return False
        if not found:
            self._selector.unregister(source)
            source.close()
            return False
        room = OUTPUT_BYTES - self._kept[stream]
        if self._kept[stream] <= OUTPUT_BYTES < self._kept[stream] + len(found):
            self.notes.append(f"{self.name}: output on {stream} beyond {OUTPUT_BYTES >> 20} MiB was not kept")
        self._streams[stream] += found[: max(0, room)]
        self._kept[stream] += len(found)
        return True

    def drain(self) -> None:
        """Read everything that has been written so far."""
        for stream in ("stdout", "stderr"):
            while self._read(stream):
                if self._kept[stream] > 64 * OUTPUT_BYTES:
                    break

    def output(self, t_ns: int, *, final: bool = False) -> list[LogRecord | OutputLine]:
        """Return the complete records and lines written since the last time; `final` adds an unfinished line."""
        found: list[LogRecord | OutputLine] = []
        for stream, buffer in self._streams.items():
            end = len(buffer) if final else _complete(buffer, records=stream == "stderr")
            text = bytes(buffer[:end]).decode("utf-8", "backslashreplace")
            del buffer[:end]
            found += self._parsed(t_ns, stream, text)
        return found

    def _parsed(self, t_ns: int, stream: str, text: str) -> list[LogRecord | OutputLine]:
        found: list[LogRecord | OutputLine] = []
        position = 0
        for match in LOG_RECORD.finditer(text) if stream == "stderr" else ():
            found += self._lines(t_ns, stream, text[position : match.start()])
            severity, logger, file, line, message = match.groups()
            relative = file[len(self.root) + 1 :] if file.startswith(self.root + "/") else ""
            place = int(line[:9]) if relative else 0
            found.append(LogRecord(t_ns, self.name, severity, logger, message[:TEXT_CHARACTERS], relative, place))
            position = match.end()
        return found + self._lines(t_ns, stream, text[position:])

    def _lines(self, t_ns: int, stream: str, text: str) -> list[LogRecord | OutputLine]:
        return [
            OutputLine(t_ns, self.name, stream, line[:TEXT_CHARACTERS])
            for line in text.replace("\r\n", "\n").split("\n")
            if line
        ]

    def death(self, t_ns: int) -> Fault:
        """Return the fault of a process that ended without a word."""
        self.kill()
        code = self.process.wait()
        if code < 0 or code > 128:
            number = -code if code < 0 else code - 128
            try:
                name = signal.Signals(number).name
            except ValueError:
                name = f"signal {number}"
            return Fault(t_ns, self.name, FaultKind.KILLED, f"ended by {name}")
        return Fault(t_ns, self.name, FaultKind.EXITED, f"exited with code {code}")

    def kill(self) -> None:
        """End the process, if it has not ended, and everything it started."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(GRACE_S)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def close(self) -> None:
        """Free the descriptors of a process that has ended."""
        self._selector.close()
        self.line.close()
        for source in (self.process.stdout, self.process.stderr):
            if source is not None:
                source.close()


def _complete(buffer: bytearray, *, records: bool) -> int:
    """Return how much of a buffer consists of whole lines and, on a stream that has them, whole log records."""
    end = buffer.rfind(b"\n") + 1
    if not records:
        return end
    opened = buffer.rfind(b"\x1e", 0, end)
    if opened > buffer.rfind(b"\x1d", 0, end):
        return opened
    return end
