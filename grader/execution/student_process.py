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
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from grader.core.limits import Limits
from grader.core.quantities import size
from grader.core.trace import Fault, FaultKind, LogRecord, OutputLine, Start
from grader.execution.ending import ended_by, exited, limit_behind
from grader.execution.notes import Places, hidden_notes, note_of, start_of
from grader.execution.sandbox.protocol import Command
from grader.execution.workload import Workload

#: How the logging library writes records on standard error. Each process has a token of its own, which only the library
#: and the worker know: what a program writes itself is no log record.
LOG_FORMAT = "\x1e{token}\x1f{severity}\x1f{name}\x1f{file_name}\x1f{line_number}\x1f{message}\x1d"
#: What follows the token. No part of a record runs over the start of the next one: a stream of starts without ends is
#: read in linear time.
_LOG_FIELDS = "\x1f([A-Z]+)\x1f([^\x1e\x1f]*)\x1f([^\x1e\x1f]*)\x1f([0-9]+)\x1f([^\x1d\x1e]*)\x1d\n?"
_TOKEN = re.compile("[0-9a-f]{32}")
#: A report longer than this is not the host's.
REPORT_BYTES = 4 << 20
#: More reports than this at once are not the host's; so much is read of its line and of each stream without a pause.
REPORTS_AT_ONCE, READS_AT_ONCE = 1000, 256
#: Notes that are kept, and how long one is at most.
NOTES, NOTE_CHARACTERS = 100, 500
#: The host tells of so many things that its program reached for, by names of this length.
REACHED, NAME_CHARACTERS = 20, 60
#: The end of what a process wrote on standard error, kept to tell what ended it.
LAST_BYTES = 16_000
#: A text longer than this is cut.
TEXT_CHARACTERS = 4000
#: Real seconds that a process gets to end by itself after the stop signal.
GRACE_S = 0.2
#: Real seconds without a report, after which a process is taken for dead weight; the host's own watchdog is faster.
SILENCE_S = 90.0


@dataclass
class NodeProcess:
    """A running student process.

    Attributes:
        name: The wanted file name; what traces call the process.
        root: The submission's folder as the process sees it.
        wake_ns: When it next wants to run, or None.
        claims: Its endpoints, as it says.
        arrivals: What it has not yet been told is on its way to it.
        told: The counterparts it has been told to wait for.
        renewed: Whether its endpoints have changed since then.
        sees_graph: Whether its program looks at the graph itself, as it says.
        offers: What it has told of services, clients and parameters.
        nudged: Whether it should look again at this instant, because its endpoints were matched.
        ended: Whether it has ended.
        limits: What it may use.
        workload: What its steps cost; None until its program starts.
        most_bytes: Most memory that it and its children filled at once.
        most_threads: Most threads that it and its children had at once.
        used_ns: Processor time that it and its children had used when the guard last looked.
        stopped: Which limit it reached, in words; empty while it reached none.
        unsettled: Why its program does not settle, as it says; empty if it does.
        stop_signalled: Whether it is to get, or has got, the stop signal.
        stopping: Whether it has got it.
        log_token: What its log records begin with; without one there are none.
        file: The file that it runs, relative to the submission.
        places: The files of the submission.
        start_told: How its file is started, as it said before anything of it ran.
        reached: What its program reached for, as it says: names of events of Python's.
    """

    name: str
    root: str
    process: subprocess.Popen[bytes]
    line: socket.socket
    limits: Limits = field(default_factory=Limits)
    wake_ns: int | None = None
    claims: list[dict[str, Any]] = field(default_factory=list)
    arrivals: dict[str, int] = field(default_factory=dict)
    told: dict[str, dict[str, list[int]]] = field(default_factory=dict)
    renewed: bool = False
    sees_graph: bool = False
    offers: set[tuple[str, str, str]] = field(default_factory=set)
    nudged: bool = False
    ended: bool = False
    workload: Workload | None = None
    most_bytes: int = 0
    most_threads: int = 0
    used_ns: int = 0
    stopped: str = ""
    unsettled: str = ""
    stop_signalled: bool = False
    stopping: bool = False
    notes: list[str] = field(default_factory=list)
    log_token: str = ""
    file: str = ""
    places: Places = field(default_factory=lambda: Places(None))
    start_told: Start | None = None
    reached: list[str] = field(default_factory=list)
    _pending: bytes = b""
    _streams: dict[str, bytearray] = field(default_factory=lambda: {"stdout": bytearray(), "stderr": bytearray()})
    _kept: dict[str, int] = field(default_factory=lambda: {"stdout": 0, "stderr": 0})
    _lines_kept: int = 0
    _last: bytes = b""
    _selector: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)

    @classmethod
    def start(cls, name: str, root: str, command: Command, line: socket.socket, limits: Limits) -> NodeProcess:
        """Start the process; `line` is the worker's end."""
        try:
            process = subprocess.Popen(
                command.argv,
                env=dict(command.environment),
                pass_fds=command.pass_fds,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                start_new_session=True,
            )
        finally:
            for descriptor in command.opened_fds:
                os.close(descriptor)
        student = cls(name, root, process, line, limits)
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

    def is_ready(self) -> bool:
        """Wait for its first report, which comes before anything of the student's runs; return whether it is that."""
        report = self.report() or {}
        token = str(report.get("log_token"))
        self.log_token = token if _TOKEN.fullmatch(token) else ""
        return report.get("kind") == "ready"

    def measured(self, t_ns: int) -> Workload:
        """Return what measures its steps, from its program's start on, which is now if it has not started before."""
        if self.workload is None:
            self.workload = Workload(self.process.pid, t_ns)
        return self.workload

    def claims_of(self, kind: str, name: str) -> bool:
        """Return whether it says that it has an endpoint of a kind and name; every node has some services."""
        node = name.rpartition("/")[0] if kind == "service" else ""
        return any((c["kind"], c["name"]) in ((kind, name), ("node", node)) for c in self.claims)

    def note(self, report: Mapping[str, Any]) -> None:
        """Take down how its file is started, which it says first, or what else a reader must know."""
        if report.get("code") == "started":
            if self.start_told is None and (start := start_of(self.name, self.file, report, self.places)):
                self.start_told = start
                self.notes += hidden_notes(start)
        elif len(self.notes) < NOTES and (text := note_of(self.file, report, self.places)):
            self.notes.append(text[:NOTE_CHARACTERS])

    def report(self) -> dict[str, Any] | None:
        """Wait for the next report, as `_next_report` does; what its program reached for is taken down."""
        report = self._next_report()
        while report is not None and report.get("kind") == "reached" and len(self.reached) < REACHED:
            self.reached.append(str(report.get("what"))[:NAME_CHARACTERS])
            report = self._next_report()
        return report

    def _next_report(self) -> dict[str, Any] | None:
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
        for _ in range(READS_AT_ONCE):
            if gone or not any(key.data == "line" for key, _ in self._selector.select(timeout=0)):
                break
            gone = not self._receive() or len(self._pending) > REPORT_BYTES
        if self._pending.count(b"\n") > REPORTS_AT_ONCE:
            return [None]
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
        most = self.limits.output_bytes
        if self._kept[stream] <= most < self._kept[stream] + len(found):
            self.notes.append(f"{self.name}: more than {size(most)} on {stream}: the rest was not looked at")
        self._streams[stream] += found[: max(0, most - self._kept[stream])]
        self._kept[stream] += len(found)
        if stream == "stderr":
            self._last = (self._last + found)[-LAST_BYTES:]
        return True

    def drain(self, reads: int = READS_AT_ONCE) -> None:
        """Read what has been written so far; of a flood only so many pieces."""
        for stream in ("stdout", "stderr"):
            for _ in range(reads):
                if not self._read(stream):
                    break

    def output(self, t_ns: int, *, final: bool = False) -> list[LogRecord | OutputLine]:
        """Return the complete records and lines written since the last time; `final` adds an unfinished line."""
        found: list[LogRecord | OutputLine] = []
        for stream, buffer in self._streams.items():
            end = len(buffer) if final else _complete(buffer, self._record_start() if stream == "stderr" else b"")
            text = bytes(buffer[:end]).decode("utf-8", "backslashreplace")
            del buffer[:end]
            found += self._parsed(t_ns, stream, text) if self._lines_kept <= self.limits.lines else []
        return self._within_limit(found)

    def _within_limit(self, found: list[LogRecord | OutputLine]) -> list[LogRecord | OutputLine]:
        most = self.limits.lines
        if self._lines_kept <= most < self._lines_kept + len(found):
            self.notes.append(f"{self.name}: more than {most:,} lines and log records: the rest was not looked at")
        kept = found[: max(0, most - self._lines_kept)]
        self._lines_kept += len(found)
        return kept

    def _parsed(self, t_ns: int, stream: str, text: str) -> list[LogRecord | OutputLine]:
        found: list[LogRecord | OutputLine] = []
        position = 0
        start = self._record_start().decode() if stream == "stderr" else ""
        for match in re.finditer(start + _LOG_FIELDS, text) if start else ():
            found += self._lines(t_ns, stream, text[position : match.start()])
            severity, logger, file, line, message = match.groups()
            relative, place = file.removeprefix(f"{self.root}/"), int(line[:9])
            if relative == file or not self.places.has(relative, place):
                relative, place = "", 0
            said = self._anywhere(message)[:TEXT_CHARACTERS]
            found.append(LogRecord(t_ns, self.name, severity, logger, said, relative, place))
            position = match.end()
        return found + self._lines(t_ns, stream, text[position:])

    def _record_start(self) -> bytes:
        return f"\x1e{self.log_token}".encode() if self.log_token else b""

    def _lines(self, t_ns: int, stream: str, text: str) -> list[LogRecord | OutputLine]:
        return [
            OutputLine(t_ns, self.name, stream, line[:TEXT_CHARACTERS])
            for line in self._anywhere(text).replace("\r\n", "\n").split("\n")
            if line
        ]

    def _anywhere(self, text: str) -> str:
        """Return what a process wrote as it would be anywhere: the place that it runs at differs from run to run."""
        return text.replace(f"{self.root}/", "")

    def death(self, t_ns: int) -> Fault:
        """Return the fault of a process that ended without a word, or is ended because it no longer talks."""
        ended = self._ends()
        self._end_now()
        code = self.process.wait()
        if self.stopped:
            return Fault(t_ns, self.name, FaultKind.KILLED, self.stopped)
        if not ended:
            return Fault(t_ns, self.name, FaultKind.KILLED, "stopped: it no longer answered the grader")
        if 0 <= code <= 128:
            return exited(self.name, t_ns, code)
        name = _signal_name(-code if code < 0 else code - 128)
        behind = limit_behind(name, self._last, self.most_threads, self.used_ns, self.limits)
        return Fault(t_ns, self.name, FaultKind.KILLED, behind) if behind else ended_by(self.name, t_ns, name)

    def stop(self, why: str, family: Collection[int] = ()) -> None:
        """End the process at a limit, and what it started; may be called from another thread.

        Args:
            why: Which limit, in words.
            family: What it started that is still known as such.
        """
        self.stopped = self.stopped or why
        if self.process.returncode is None:
            for pid in family:
                with contextlib.suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
            with contextlib.suppress(OSError):
                os.killpg(self.process.pid, signal.SIGKILL)

    def _ends(self) -> bool:
        """Return whether the process ends by itself, which it gets a moment for."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(GRACE_S)
        return self.process.returncode is not None

    def kill(self) -> None:
        """End the process, if it has not ended, and everything it started."""
        self._ends()
        self._end_now()

    def _end_now(self) -> None:
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


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _complete(buffer: bytearray, record_start: bytes) -> int:
    """Return how much of a buffer consists of whole lines and, on a stream that has them, whole log records."""
    end = buffer.rfind(b"\n") + 1
    if not record_start:
        return end
    opened = buffer.rfind(record_start, 0, end)
    if opened > buffer.rfind(b"\x1d", 0, end):
        return opened
    return end
