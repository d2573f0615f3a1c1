"""Parses a node's standard error in the default ROS format into log records, tracebacks and other lines.

A line shows where a record begins, but not where it ends or which source line logged it. The records that node loggers
publish on /rosout show both. A record of any other logger is assumed to be one line long.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence

from grader.runtime.host.protocol import FaultReport
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import LogRecord, OutputLine

#: `[INFO] [1767225600.000000000] [node]: text`, the default of RCUTILS_CONSOLE_OUTPUT_FORMAT.
HEADER = re.compile(r"\[(DEBUG|INFO|WARN|ERROR|FATAL)\] \[(\d{1,12})\.(\d{9})\] \[([^\]]*)\]: (.*)", re.DOTALL)
#: A longer line, or text of a log record, is cut: up to 50,000 of them are kept.
TEXT_CHARACTERS = 4000
TRACEBACK, IN_THREAD = "Traceback (most recent call last):", "Exception in thread "
#: An exception has no more lines of text than this after its first one.
MESSAGE_LINES = 10
_FRAME = re.compile(r'  File "([^"]+)", line (\d{1,9})(?:, in (.+))?')
_SYNTAX = re.compile(r"(SyntaxError|IndentationError|TabError): (.*)")


@dataclass(frozen=True, slots=True)
class Logged:
    """A log record as a node's logger publishes it on /rosout: time, logger, text and source line."""

    sec: int
    nanosec: int
    logger: str
    text: str
    file: str
    line: int
    arrived_ns: int = 0  # when the middleware received it, by the system clock; 0 if that is not known


def read_console(
    lines: Sequence[OutputLine], logs: Iterable[tuple[int, Logged]], relative: Callable[[str], str]
) -> list[LogRecord | OutputLine | None]:
    """Classify each line of one process: a log record, a plain line, or None for a continuation of a record.

    A line is found when the grader looks, which may be late; the record that tells the same may have arrived before.

    Args:
        lines: The output of the process, in order; only standard error has log records.
        logs: The records that were published on /rosout, each with the time at which it arrived, at the latest.
        relative: Makes a path relative to the submission; returns an empty string for a path outside of it.
    """
    known: dict[tuple[int, int, str], list[tuple[int, Logged]]] = {}
    for arrived_ns, one in logs:
        known.setdefault((one.sec, one.nanosec, one.logger), []).append((arrived_ns, one))
    found: list[LogRecord | OutputLine | None] = list(lines)
    errors = [number for number, line in enumerate(lines) if line.stream == "stderr"]
    position = 0
    while position < len(errors):
        line = lines[errors[position]]
        match = HEADER.fullmatch(line.text)
        rest: list[int] = []
        if match is not None:
            severity, sec, nanosec, logger, text = match.groups()
            arrived_ns, log = _published(known.get((int(sec), int(nanosec), logger), []), text) or (line.t_ns, None)
            if log is not None:
                more = [part for part in log.text.split("\n")[1:] if part]
                rest = errors[position + 1 : position + 1 + len(more)]
                text = log.text if [lines[n].text for n in rest] == more else text
                rest = rest if text == log.text else []
            file = relative(log.file) if log else ""
            place = log.line if log and file else 0
            found[errors[position]] = LogRecord(
                min(arrived_ns, line.t_ns), line.process, severity, logger, text[:TEXT_CHARACTERS], file, place
            )
        for number in rest:
            found[number] = None
        position += 1 + len(rest)
    return found


def _published(candidates: list[tuple[int, Logged]], first: str) -> tuple[int, Logged] | None:
    for index, (_, log) in enumerate(candidates):
        if log.text.startswith(first):
            return candidates.pop(index)
    return None


def last_traceback(text: str, root: str) -> FaultReport | None:
    """Find the exception that ended a process in the end of its output; None if there is no traceback.

    Args:
        text: The end of its standard error.
        root: The submission's folder as the process sees it.
    """
    lines = text.replace("\r\n", "\n").rstrip("\n").split("\n")
    starts = [n for n, line in enumerate(lines) if line == TRACEBACK and not _is_in_thread(lines, n)]
    if starts:
        block = _block(lines[starts[-1] :])
        after = lines[starts[-1] + len(block) :]
        # the exception's text may have more lines, but a log record means that the program went on
        return None if len(after) > MESSAGE_LINES or any(map(HEADER.fullmatch, after)) else described(block, root)
    syntax = _SYNTAX.match(lines[-1])
    return described(lines, root) if syntax else None


def thread_tracebacks(lines: Sequence[str], root: str) -> dict[int, FaultReport]:
    """Find the exceptions that ended threads, keyed by the index of their first line."""
    found = {}
    for number, line in enumerate(lines):
        if line == TRACEBACK and _is_in_thread(lines, number):
            found[number] = described(_block(lines[number:]), root)
    return found


def described(lines: Sequence[str], root: str) -> FaultReport:
    """Convert a traceback to a fault, in the format in which the host reports faults."""
    places = [match for line in lines if (match := _FRAME.fullmatch(line))]
    own = [
        (file[len(root) + 1 :], int(number), name)
        for file, number, name in (place.groups() for place in places)
        if file.startswith(f"{root}/")
    ]
    last = next((line for line in reversed(lines) if line and not line.startswith(" ")), "")
    code = "syntax_error" if _SYNTAX.match(last) and places and own and places[-1][1].startswith(root) else "exception"
    file, number, _ = own[-1] if own else ("", 0, "")
    type_, _, message = last.replace(f"{root}/", "").partition(": ")
    frames = [frame for frame in own if frame[2]]
    return FaultReport(code, type_, message, file=file, line=number, frames=frames)


def _is_in_thread(lines: Sequence[str], number: int) -> bool:
    return number > 0 and lines[number - 1].startswith(IN_THREAD)


def _block(lines: Sequence[str]) -> Sequence[str]:
    """Return the lines of a traceback, without the lines after it."""
    for number, line in enumerate(lines[1:], 1):
        if not line.startswith(" "):
            return lines[: number + 1]
    return lines
