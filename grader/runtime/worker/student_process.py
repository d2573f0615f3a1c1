"""A student process as seen by the worker: its socket, its output and its end."""

from __future__ import annotations

import base64
import contextlib
import itertools
import os
import re
import select
import signal
import socket
import subprocess
import time
from collections.abc import Collection, Sequence
from dataclasses import field, replace

from grader.runtime.host.protocol import (
    MOST_WRITTEN,
    Answer,
    Exited,
    FilesWritten,
    LaunchReport,
    Note,
    Reached,
    Ready,
    Report,
    ThreadFault,
    WrittenContent,
    decoded_report,
    encoded_line,
)
from grader.runtime.host.written import ALL_BYTES, FILE_BYTES
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import size
from grader.runtime.model.trace import Fault, FaultKind, LogRecord, OutputLine, Start, WrittenFile
from grader.runtime.sandbox.protocol import INSTALLED, Command
from grader.runtime.sandbox.starter import StartedProcess
from grader.runtime.worker.console import TEXT_CHARACTERS
from grader.runtime.worker.core import Process
from grader.runtime.worker.ending import ended_by, exited, graders_fault, limit_behind
from grader.runtime.worker.notes import Places, hidden_notes, note_of, reported_start
from grader.runtime.worker.workload import Workload

#: The format of log records on standard error. Each process has its own token, known only to the logging library and
#: the worker, so a program cannot write log records itself.
LOG_FORMAT = "\x1e{token}\x1f{severity}\x1f{name}\x1f{file_name}\x1f{line_number}\x1f{message}\x1d"
#: A record with its token. No field can extend over the start of the next record, so that a stream of unfinished
#: records is parsed in linear time.
_RECORD = re.compile(
    "\x1e([0-9a-f]{32})\x1f([A-Z]+)\x1f([^\x1e\x1f]*)\x1f([^\x1e\x1f]*)\x1f([0-9]+)\x1f([^\x1d\x1e]*)\x1d\n?"
)
#: The host never sends a longer report.
REPORT_BYTES = 4 << 20
#: The host never sends more reports at once; and the most reads from its socket and from each stream in a row.
REPORTS_AT_ONCE, READS_AT_ONCE = 1000, 256
#: The most notes that are kept, and the maximum length of a note.
NOTES, NOTE_CHARACTERS = 100, 500
#: The most audit events that the host reports of its program, and the maximum length of their names.
REACHED, NAME_CHARACTERS = 20, 60
#: Where a process with a view of files of its own has its home and its temporary files.
OWN_FOLDER = "/tmp"  # noqa: S108
#: Where such a process sees its submission.
SUBMISSION = "/submission"
#: How much one read takes at most, and milliseconds after which a wait for a report looks at the time.
READ_BYTES, LOOK_MS = 1 << 16, 1000
#: The maximum length of the name of a file that a program wrote.
WRITTEN_NAME_CHARACTERS = 200
#: How much of the end of standard error is kept to find out why a process ended.
LAST_BYTES = 16_000
#: Real seconds that a process has to end by itself after the stop signal.
GRACE_S = 0.2
#: Real seconds to wait for the exit code of a process that has closed its connection, as it does when it ends: a busy
#: machine takes long from one to the other. Only a program that closes the connection and lives on takes all of it.
CLOSED_S = 5.0
#: Real seconds without a report after which a process is given up; the host's own watchdog acts sooner.
SILENCE_S = 90.0


@dataclass
class NodeProcess(Process):
    """A running student process; see `Process` for what virtual time knows of it.

    Attributes:
        root: The submission's folder as the process sees it.
        offers: The services, clients and parameters that it has reported.
        exit_code: Its exit code as a shell shows it, 128 and the number of the signal that ended it; None until it has
            ended, or if it is not known.
        limits: Its limits.
        workload: Measures the cost of its steps; None until its program starts.
        most_bytes: Peak memory of the process and its children.
        most_threads: Peak number of threads of the process and its children.
        used_ns: Processor time of the process and its children when the resource monitor last looked.
        stopped: The limit that it reached, in words; empty if it reached none.
        unsettled: Why its program does not settle, as it reports; empty if it does.
        stop_signalled: Whether the stop signal was sent or is about to be sent.
        stopping: Whether the stop signal was sent.
        log_token: The token that its log records begin with; empty if it has none, and then no log records.
        file: The file that it runs, relative to the submission.
        arguments: What its program is given on the command line.
        launched_by: The launch file that it comes from, with its line; empty if it comes from none.
        given: The names of parameters, and the remappings, that this launch file gives it.
        places: The files of the submission.
        prefix: The folder below which its packages are installed; empty if it has none.
        keeps_paths: Whether paths stay in what it writes, because it runs where its files lie.
        own_folder: The folder of its home and its temporary files; empty if it has none.
        start_told: How its file is started, as it reported before it ran any of the student's code.
        grader_failed: What failed in the grader's own code in the process, as it reports; empty if nothing did.
        written: Small files that its program wrote, as it reports.
        reached: Names of audit events that its program raised, as it reports.
        silence_s: See `SILENCE_S`.
        closed_s: See `CLOSED_S`.
    """

    root: str
    process: subprocess.Popen[bytes] | StartedProcess
    line: socket.socket
    limits: Limits = field(default_factory=Limits)
    offers: set[tuple[str, str, str]] = field(default_factory=set)
    exit_code: int | None = None
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
    arguments: str = ""
    launched_by: str = ""
    given: tuple[tuple[str, ...], tuple[tuple[str, str], ...]] = ((), ())
    places: Places = field(default_factory=lambda: Places(None))
    prefix: str = ""
    keeps_paths: bool = False
    own_folder: str = ""
    start_told: Start | None = None
    grader_failed: str = ""
    written: tuple[WrittenFile, ...] = ()
    reached: list[str] = field(default_factory=list)
    silence_s: float = SILENCE_S
    closed_s: float = CLOSED_S
    _closed: bool = False  # whether it has closed its end of the connection
    _pending: bytes = b""
    _streams: dict[str, bytearray] = field(default_factory=lambda: {"stdout": bytearray(), "stderr": bytearray()})
    _kept: dict[str, int] = field(default_factory=lambda: {"stdout": 0, "stderr": 0})
    _lines_kept: int = 0
    _last: bytes = b""
    _poll: select.poll = field(default_factory=select.poll)
    _sources: dict[int, str] = field(default_factory=dict)  # descriptor -> stream; empty for the socket

    @property
    def roots(self) -> tuple[int, ...]:
        """The processes that all others descend from."""
        return self.process.roots if isinstance(self.process, StartedProcess) else (self.process.pid,)

    @classmethod
    def start(cls, name: str, root: str, command: Command, line: socket.socket, limits: Limits) -> NodeProcess:
        """Start the process; `line` is the worker's end of the socket pair."""
        try:
            process = subprocess.Popen(
                command.argv,
                env=dict(command.environment),
                pass_fds=command.pass_fds,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                # A session of its own: signals to its group, and Ctrl-C at the terminal, reach nobody else.
                start_new_session=True,
            )
        finally:
            for descriptor in command.opened_fds:
                os.close(descriptor)
        return cls.started(name, root, process, line, limits)

    @classmethod
    def started(
        cls,
        name: str,
        root: str,
        process: subprocess.Popen[bytes] | StartedProcess,
        line: socket.socket,
        limits: Limits,
    ) -> NodeProcess:
        """Watch a process that has just been started."""
        student = cls(name, root, process, line, limits)
        # First, because the kernel looks in this order: where there is a report, the output before it is found as well.
        student._register(line.fileno(), "")
        for stream, source in (("stdout", process.stdout), ("stderr", process.stderr)):
            if source is not None:
                # A program may write without end, or stop in the middle of a line; neither holds up the worker.
                os.set_blocking(source.fileno(), False)
                student._register(source.fileno(), stream)
        return student

    def _register(self, descriptor: int, stream: str) -> None:
        self._poll.register(descriptor, select.POLLIN)
        self._sources[descriptor] = stream

    def descriptors(self) -> tuple[int, ...]:
        """Return what the process writes to, until it has ended; may be called from another thread."""
        return () if self.ended else tuple(self._sources)

    def tell(self, answer: Answer) -> None:
        """Send an answer. A dead process is noticed at its next report."""
        try:
            self.line.sendall(encoded_line(answer))
        except OSError:
            return

    def is_ready(self) -> bool:
        """Wait for the first report, sent before any of the student's code runs; return whether it is valid."""
        report = self.report()
        if not isinstance(report, Ready):
            return False
        self.log_token = report.log_token
        return True

    def measured(self, t_ns: int) -> Workload:
        """Return the workload of the process; the first call marks the start of its program."""
        if self.workload is None:
            self.workload = Workload(self.process.pid, t_ns)
        return self.workload

    def note(self, report: Note) -> None:
        """Record a note: how the file is started, which comes first, or something that readers must know."""
        # The first counts: a program that writes to this socket itself could only add another one.
        if report.code == "started":
            if self.start_told is None and (start := reported_start(self.name, self.file, report, self.places)):
                self.start_told = replace(start, arguments=self.arguments, launched_by=self.launched_by)
                self.notes += hidden_notes(start)
        elif len(self.notes) < NOTES and (text := note_of(self.file, report, self.places)):
            self.notes.append(text[:NOTE_CHARACTERS])

    def report(self) -> Report | None:
        """Wait for the next report, as `_next_report` does, and record what no runner has to know on the way."""
        report = self._next_report()
        while report is not None and self._is_aside(report):
            report = self._next_report()
        return report

    def _is_aside(self, report: Report) -> bool:
        """Record a report of an audit event or of written files; return whether it was one."""
        if isinstance(report, Reached) and len(self.reached) < REACHED:
            self.reached.append(report.what[:NAME_CHARACTERS])
            return True
        # Once, at its end; more of them come from the program.
        if isinstance(report, FilesWritten) and not self.written:
            self.written = written_files(self.name, report.files)
            return True
        return False

    def last_report(self, seconds: float) -> None:
        """Wait for what a process reports when it is told to stop at the end of a recording, at most so long."""
        deadline = time.monotonic() + seconds
        while (left_s := deadline - time.monotonic()) > 0 and len(self._pending) <= REPORT_BYTES:
            for descriptor, _ in self._poll.poll(left_s * 1000):
                stream = self._sources[descriptor]
                if stream:
                    self._read_all(stream)
                elif not self._receive():
                    return
            while b"\n" in self._pending:
                report = self._parsed_report()
                if isinstance(report, Exited):
                    return
                if report is not None:
                    self._is_aside(report)

    def _next_report(self) -> Report | None:
        """Wait for the next report and read output meanwhile; None if the process has ended or timed out."""
        if b"\n" in self._pending:
            self.drain()
            return self._parsed_report()
        deadline = time.monotonic() + self.silence_s
        while b"\n" not in self._pending:
            for descriptor, _ in self._poll.poll(LOOK_MS):
                stream = self._sources[descriptor]
                if stream:
                    self._read_all(stream)
                elif not self._receive():
                    return None
            if time.monotonic() > deadline or len(self._pending) > REPORT_BYTES:
                return None
        return self._parsed_report()

    def _parsed_report(self) -> Report | None:
        line, _, self._pending = self._pending.partition(b"\n")
        report = decoded_report(line)
        if isinstance(report, (Exited, ThreadFault, LaunchReport)):
            self.grader_failed = self.grader_failed or graders_fault(self.name, report.fault)
        return report

    def reports(self) -> list[Report | None]:
        """Return the reports that have arrived, without waiting; the last one is None if the process has ended."""
        gone = False
        for _ in range(READS_AT_ONCE):
            if gone or not any(not self._sources[descriptor] for descriptor, _ in self._poll.poll(0)):
                break
            gone = not self._receive() or len(self._pending) > REPORT_BYTES
        if self._pending.count(b"\n") > REPORTS_AT_ONCE:
            return [None]
        found: list[Report | None] = []
        while b"\n" in self._pending:
            report = self._parsed_report()
            if report is None or not self._is_aside(report):
                found.append(report)
        return [*found, None] if gone and not any(isinstance(report, Exited) for report in found) else found

    def _receive(self) -> bool:
        try:
            received = self.line.recv(1 << 16)
        except OSError:
            received = b""
        self._pending += received
        self._closed = not received
        return not self._closed

    def _read(self, stream: str) -> bool:
        """Read from a stream without blocking; return whether there may be more output."""
        source = self.process.stdout if stream == "stdout" else self.process.stderr
        if source is None or source.closed:
            return False
        try:
            found = os.read(source.fileno(), READ_BYTES)
        except BlockingIOError:
            return False
        if not found:
            self._poll.unregister(source.fileno())
            del self._sources[source.fileno()]
            source.close()
            return False
        most = self.limits.output_bytes
        if self._kept[stream] <= most < self._kept[stream] + len(found):
            self.notes.append(f"{self.name}: more than {size(most)} on {stream}: the rest was ignored")
        self._streams[stream] += found[: max(0, most - self._kept[stream])]
        self._kept[stream] += len(found)
        if stream == "stderr":
            self._last = (self._last + found)[-LAST_BYTES:]
        return len(found) == READ_BYTES

    def drain(self, reads: int = READS_AT_ONCE) -> None:
        """Read the output so far, with at most `reads` reads from each stream."""
        ready = {self._sources[descriptor] for descriptor, _ in self._poll.poll(0)}
        for stream in ("stdout", "stderr"):
            if stream in ready:
                self._read_all(stream, reads)

    def _read_all(self, stream: str, reads: int = READS_AT_ONCE) -> None:
        for _ in range(reads):
            if not self._read(stream):
                break

    def output(self, t_ns: int, *, final: bool = False) -> list[LogRecord | OutputLine]:
        """Return the complete records and lines since the last call; `final` adds an unfinished line."""
        found: list[LogRecord | OutputLine] = []
        for stream, buffer in self._streams.items():
            if not buffer:
                continue
            end = len(buffer) if final else _complete(buffer, self._record_start() if stream == "stderr" else b"")
            text = bytes(buffer[:end]).decode("utf-8", "backslashreplace")
            del buffer[:end]
            found += self._parsed(t_ns, stream, text) if self._lines_kept <= self.limits.lines else []
        return self._within_limit(found)

    def _within_limit(self, found: list[LogRecord | OutputLine]) -> list[LogRecord | OutputLine]:
        most = self.limits.lines
        if self._lines_kept <= most < self._lines_kept + len(found):
            self.notes.append(f"{self.name}: more than {most:,} lines and log records: the rest was ignored")
        kept = found[: max(0, most - self._lines_kept)]
        self._lines_kept += len(found)
        return kept

    def _parsed(self, t_ns: int, stream: str, text: str) -> list[LogRecord | OutputLine]:
        found: list[LogRecord | OutputLine] = []
        position = 0
        for match in _RECORD.finditer(text) if stream == "stderr" else ():
            token, severity, logger, file, line, message = match.groups()
            if token != self.log_token:
                continue  # the program has written it
            found += self._lines(t_ns, stream, text[position : match.start()])
            relative, place = file.removeprefix(f"{self.root}/"), int(line[:9])
            if relative == file or not self.places.has(relative, place):
                relative, place = "", 0
            shortened = self._anywhere(message)[:TEXT_CHARACTERS]
            found.append(LogRecord(t_ns, self.name, severity, logger, shortened, relative, place))
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
        """Remove the folders of the submission and of its prefix from a text, because they differ from run to run.

        The process's own folder becomes that of the strongest tiers.
        """
        if self.keeps_paths:
            return text
        if self.prefix:
            text = text.replace(f"{self.prefix}/", "").replace(self.prefix, f"{OWN_FOLDER}/home/{INSTALLED}")
        text = text.replace(f"{self.root}/", "")
        if not self.own_folder:
            return text
        text = text.replace(self.root, SUBMISSION) if self.root.startswith(f"{self.own_folder}/") else text
        return text.replace(self.own_folder, OWN_FOLDER)

    def death(self, t_ns: int) -> Fault:
        """End a process that died or stopped reporting, and return its fault."""
        ended = self._ends(self.closed_s if self._closed else GRACE_S)
        self.end_now()
        code = self.process.wait()
        self.exit_code = code if code >= 0 else 128 - code
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
        """Kill the process and its children at a limit; may be called from another thread.

        Args:
            why: The limit, in words.
            family: Known pids of its children.
        """
        self.stopped = self.stopped or why
        if self.process.returncode is None:
            for pid in family:
                with contextlib.suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
            with contextlib.suppress(OSError):
                os.killpg(self.process.pid, signal.SIGKILL)

    def _ends(self, seconds: float = GRACE_S) -> bool:
        """Wait for the process to end by itself, at most so long; return whether it did."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(seconds)
        return self.process.returncode is not None

    def kill(self) -> None:
        """Kill the process, if it is still running, and its process group."""
        self._ends()
        self.end_now()

    def end_now(self) -> None:
        """Kill the process and its process group at once."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def close(self) -> None:
        """Close the file descriptors of a process that has ended."""
        self.line.close()
        for source in (self.process.stdout, self.process.stderr):
            if source is not None:
                source.close()
        if isinstance(self.process, StartedProcess):
            self.process.close()


def written_files(process: str, files: Sequence[WrittenContent]) -> tuple[WrittenFile, ...]:
    """Return the files that a process reports to have written, without those that are too large or oddly named."""
    found: list[WrittenFile] = []
    for name, content in files:
        if len(content) > FILE_BYTES * 4 // 3 + 4:
            continue
        parts = name.split("/")
        odd = len(name) > WRITTEN_NAME_CHARACTERS or not name.isprintable() or {"", ".", ".."} & {*parts}
        with contextlib.suppress(ValueError):
            if not odd and base64.b64encode(base64.b64decode(content, validate=True)).decode() == content:
                found.append(WrittenFile(process, name, content))
    sizes = itertools.accumulate(len(file.content) for file in found)
    return tuple(file for file, size in zip(found, sizes, strict=True) if size <= ALL_BYTES * 4 // 3 + 4 * MOST_WRITTEN)


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _complete(buffer: bytearray, record_start: bytes) -> int:
    """Return the length of the part of a buffer that has only complete lines and complete log records."""
    end = buffer.rfind(b"\n") + 1
    if not record_start:
        return end
    opened = buffer.rfind(record_start, 0, end)
    if opened > buffer.rfind(b"\x1d", 0, end):
        return opened
    return end
