"""Faults as a student's process reports them: untrusted values, taken over field by field."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from typing import Any

from grader.core.limits import Limits
from grader.core.quantities import duration, size
from grader.core.trace import Fault, FaultKind, Mark
from grader.execution.notes import Places
from grader.execution.plan import Plan
from grader.execution.sandbox.start import OUTGROWN

TEXT_CHARACTERS, FRAMES = 500, 20
#: Processor seconds that a node may use until it first blocks, its imports included, and between two such moments.
START_CPU_S = 10.0
WAKE_UP_CPU_S = 5.0
#: Real seconds that a node may wait for something that is neither ROS nor time, such as a keyboard.
BLOCKED_S = 5.0
#: The words for the codes with which a process is ended that does not come back.
_HUNG = {
    "start_limit": f"did not return within {START_CPU_S:g} s of processor time",
    "wake_up_limit": f"did not return within {WAKE_UP_CPU_S:g} s of processor time",
    "blocked": f"waited {BLOCKED_S:g} s for something outside the ROS graph",
    "alarm": "sets an alarm that rings in real time",
    "process": "starts another process, which runs in real time",
    "waiting": "waits for something outside the ROS graph",
}
#: The whole name of a class, and of a function, as Python writes them: names only, no sentences.
_TYPE = re.compile(r"(?=.{1,200}$)[^\W\d]\w*(?:\.(?:<locals>|[^\W\d]\w*))*")
_FUNCTION = re.compile(r"(?=.{1,100}$)(?:<(?:module|lambda|listcomp|setcomp|dictcomp|genexpr)>|[^\W\d]\w*)")
#: What C++ writes before it ends a process that found no memory.
NO_MEMORY = b"std::bad_alloc"
#: A process that had this share of the threads it may have, and then failed, wanted more.
NEARLY_ALL = 0.9
#: A process that had used less than this share of its processor time has sent itself the signal of that limit.
HARDLY_ANY = 0.5
#: The exit code of a program that Ctrl-C has ended, and the exceptions that ROS programs end with then.
STOPPED_CODE = 130
NORMAL_AT_STOP = ("ExternalShutdownException", "rcl_shutdown already called", "KeyboardInterrupt")


def reported_fault(process: str, t_ns: int, data: Any, limits: Limits, places: Places) -> Fault:
    """Return the fault that a report describes; an error that a limit is behind names the limit.

    Args:
        process: Name of the process.
        t_ns: When.
        data: What it says: a code, where, and for an exception its type and its message, which are its own words.
        limits: What it may use.
        places: The files of the submission; any other place is left out.
    """
    data = data if isinstance(data, dict) else {}
    code = data.get("code")
    hung = _HUNG.get(code) if isinstance(code, str) else None
    kind = FaultKind.SYNTAX_ERROR if code == "syntax_error" else FaultKind.HUNG if hung else FaultKind.EXCEPTION
    text = hung or _own_words(data)
    python = sys.version_info[:2] if kind is FaultKind.SYNTAX_ERROR else None
    if python is not None:
        text += f" (read by Python {python[0]}.{python[1]})"
    behind = next((words for error, words in _errors(limits).items() if error in text), "")
    file, line = _place(data, places, kind)
    return Fault(
        t_ns=t_ns,
        process=process,
        kind=kind,
        text=f"{text} (the limit is {behind})" if behind else text,
        file=file,
        line=line,
        frames=_frames(data.get("frames"), places),
        python=python,
    )


def _own_words(data: Mapping[str, Any]) -> str:
    """Return an exception as Python tells it: `Type: message`, on one line."""
    name, message = data.get("type"), data.get("message")
    name = name if isinstance(name, str) and _TYPE.fullmatch(name) else "Exception"
    message = " ".join(message[:TEXT_CHARACTERS].split()) if isinstance(message, str) else ""
    return (f"{name}: {message}" if message else name)[:TEXT_CHARACTERS]


def _place(data: Mapping[str, Any], places: Places, kind: FaultKind) -> tuple[str, int]:
    """Return file and line of a fault, where the submission has them; empty and 0 otherwise."""
    file, line = data.get("file"), data.get("line")
    if not isinstance(file, str) or not places.has(file):
        return "", 0
    if kind is FaultKind.SYNTAX_ERROR and type(line) is int:
        line = min(line, places.lines(file))  # Python places what is missing at the end behind the last line
    return (file, line) if type(line) is int and places.has(file, line) else (file, 0)


def _frames(data: Any, places: Places) -> tuple[str, ...]:
    frames = [f for f in data[:FRAMES] if isinstance(f, list) and len(f) == 3] if isinstance(data, list) else []
    return tuple(
        f"{file}:{line} in {name}"
        for file, line, name in frames
        if places.has(file, line) and isinstance(name, str) and _FUNCTION.fullmatch(name)
    )


def ending_fault(process: str, t_ns: int, report: Mapping[str, Any], limits: Limits, places: Places) -> Fault:
    """Return the fault of a process that says how it ended."""
    if isinstance(report.get("fault"), dict):
        return reported_fault(process, t_ns, report["fault"], limits, places)
    code = report.get("code")
    return exited(process, t_ns, code if type(code) is int else None)


def exited(process: str, t_ns: int, code: int | None) -> Fault:
    """Return the fault of a process that ended by itself; the code is None if it is not known."""
    text = f"exited with code {'?' if code is None else code}"
    return Fault(t_ns, process, FaultKind.EXITED, text, exit_code=code)


def ended_by(process: str, t_ns: int, signal: str) -> Fault:
    """Return the fault of a process that a signal ended without a limit that explains it."""
    return Fault(t_ns, process, FaultKind.KILLED, _by(signal), signal=signal)


def ending(  # noqa: PLR0913 - each comes from another place
    process: str, t_ns: int, report: Mapping[str, Any], plan: Plan, places: Places, *, stopped: bool
) -> Fault | Mark:
    """Return the fault of a process that says how it ended, or the mark of an end that is none.

    Args:
        process: Name of the process.
        t_ns: When.
        report: What it says.
        plan: Whether it is free to end, and its limits.
        places: The files of the submission.
        stopped: Whether it had got the stop signal.
    """
    if stopped and is_normal_stop(report):
        return Mark(t_ns, "stopped", process)
    if process in plan.may_exit and is_free_exit(report):
        return Mark(t_ns, "exited", process)
    return ending_fault(process, t_ns, report, plan.limits, places)


def is_free_exit(report: Mapping[str, Any]) -> bool:
    """Return whether a process says that it ended by itself and with code 0."""
    return not isinstance(report.get("fault"), dict) and report.get("code") == 0


def is_normal_stop(report: Mapping[str, Any]) -> bool:
    """Return whether a process ended after the stop signal as ROS programs do.

    rclpy shuts its contexts down at that signal, so a program that shuts down once more is told so.
    """
    fault = report.get("fault")
    if isinstance(fault, dict):
        return fault.get("code") == "exception" and any(normal in _own_words(fault) for normal in NORMAL_AT_STOP)
    return report.get("code") in (0, STOPPED_CODE)


def never_stopped(process: str, t_ns: int, patience_ns: int) -> Fault:
    """Return the fault of a process that did not end after the stop signal."""
    return Fault(t_ns, process, FaultKind.HUNG, f"did not end within {duration(patience_ns)} after Ctrl-C")


def _by(signal: str) -> str:
    return f"ended by {signal}"


def limit_behind(signal: str, last_words: bytes, most_threads: int, used_ns: int, limits: Limits) -> str:
    """Return which limit a process was ended at that a signal ended, in words; empty if none explains it.

    Args:
        signal: Name of the signal.
        last_words: The end of what it wrote on standard error; it serves the wording only.
        most_threads: The most threads it had.
        used_ns: The processor time it had used when that was last looked at.
        limits: What it might use.
    """
    if signal == "SIGXCPU" and used_ns > HARDLY_ANY * limits.processor_ns:
        return f"stopped at {limits.processor_words()}"
    if signal == "SIGXFSZ":
        return f"stopped at {size(limits.file_bytes)} in one file"
    if signal == OUTGROWN.name:
        return f"stopped at {size(limits.scratch_bytes)} in one folder"
    if signal == "SIGABRT" and NO_MEMORY in last_words:
        return f"{_by(signal)} after it wrote {NO_MEMORY.decode()} (the limit is {limits.memory_words()})"
    if signal == "SIGABRT" and most_threads >= NEARLY_ALL * limits.processes:
        return f"{_by(signal)} (the limit is {limits.processes_words()})"
    return ""


def _errors(limits: Limits) -> Mapping[str, str]:
    """Return the words for each error by which Python tells of a limit."""
    return {
        "MemoryError": limits.memory_words(),
        "Cannot allocate memory": limits.memory_words(),
        "can't start new thread": limits.processes_words(),
        "pthread_create failed: Resource temporarily unavailable": limits.processes_words(),
        "[Errno 11] Resource temporarily unavailable": limits.processes_words(),
        "[Errno 24] Too many open files": f"{limits.open_files:,} open files",
        "[Errno 27] File too large": f"{size(limits.file_bytes)} in one file",
        "[Errno 28] No space left on device": f"{size(limits.scratch_bytes)} in one folder",
    }
