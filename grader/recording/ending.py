"""Faults as a student's process reports them: untrusted values, taken over field by field."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from grader.model.limits import Limits
from grader.model.quantities import duration, size
from grader.model.trace import Fault, FaultKind, Mark
from grader.recording.isolation.start import OUTGROWN
from grader.recording.plan import Plan

KINDS = {kind.value: kind for kind in FaultKind}
TEXT_CHARACTERS, PLACE_CHARACTERS, FRAMES = 500, 300, 20
#: What C++ writes before it ends a process that found no memory.
NO_MEMORY = b"std::bad_alloc"
_UNEXPLAINED = re.compile("ended by SIG[A-Z0-9]+")
#: A process that had this share of the threads it may have, and then failed, wanted more.
NEARLY_ALL = 0.9
#: The exit code of a program that Ctrl-C has ended, and the exceptions that ROS programs end with then.
STOPPED_CODE = 130
NORMAL_AT_STOP = ("ExternalShutdownException", "rcl_shutdown already called", "KeyboardInterrupt")


def reported_fault(process: str, t_ns: int, data: Mapping[str, Any], limits: Limits) -> Fault:
    """Return the fault that a report describes; an error that a limit is behind names the limit."""
    text = str(data.get("text", ""))[:TEXT_CHARACTERS]
    behind = next((words for error, words in _errors(limits).items() if error in text), "")
    frames, line = data.get("frames"), data.get("line")
    return Fault(
        t_ns=t_ns,
        process=process,
        kind=KINDS.get(str(data.get("kind")), FaultKind.EXCEPTION),
        text=f"{text} (the limit is {behind})" if behind else text,
        file=str(data.get("file", ""))[:PLACE_CHARACTERS],
        line=line if type(line) is int and line > 0 else 0,
        frames=tuple(str(f)[:PLACE_CHARACTERS] for f in frames[:FRAMES]) if isinstance(frames, list) else (),
    )


def ending_fault(process: str, t_ns: int, report: Mapping[str, Any], limits: Limits) -> Fault:
    """Return the fault of a process that says how it ended."""
    if isinstance(report.get("fault"), dict):
        return reported_fault(process, t_ns, report["fault"], limits)
    code = report.get("code")
    return Fault(t_ns, process, FaultKind.EXITED, f"exited with code {code if type(code) is int else '?'}")


def ending(process: str, t_ns: int, report: Mapping[str, Any], plan: Plan, *, stopped: bool) -> Fault | Mark:
    """Return the fault of a process that says how it ended, or the mark of an end that is none.

    Args:
        process: Name of the process.
        t_ns: When.
        report: What it says.
        plan: Whether it is free to end, and its limits.
        stopped: Whether it had got the stop signal.
    """
    if stopped and is_normal_stop(report):
        return Mark(t_ns, "stopped", process)
    if process in plan.may_exit and is_free_exit(report):
        return Mark(t_ns, "exited", process)
    return ending_fault(process, t_ns, report, plan.limits)


def is_free_exit(report: Mapping[str, Any]) -> bool:
    """Return whether a process says that it ended by itself and with code 0."""
    return not isinstance(report.get("fault"), dict) and report.get("code") == 0


def is_normal_stop(report: Mapping[str, Any]) -> bool:
    """Return whether a process ended after the stop signal as ROS programs do.

    rclpy shuts its contexts down at that signal, so a program that shuts down once more is told so.
    """
    fault = report.get("fault")
    if isinstance(fault, dict):
        return any(normal in str(fault.get("text", ""))[:TEXT_CHARACTERS] for normal in NORMAL_AT_STOP)
    return report.get("code") in (0, STOPPED_CODE)


def never_stopped(process: str, t_ns: int, patience_ns: int) -> Fault:
    """Return the fault of a process that did not end after the stop signal."""
    return Fault(t_ns, process, FaultKind.HUNG, f"did not end within {duration(patience_ns)} after Ctrl-C")


def ended_by(signal: str) -> str:
    """Return what a fault says where a signal ended a process, and no limit explains it."""
    return f"ended by {signal}"


def is_unexplained(fault: Fault) -> bool:
    """Return whether a signal and no limit ended a process: its own doing, or a machine that was out of threads."""
    return fault.kind is FaultKind.KILLED and _UNEXPLAINED.fullmatch(fault.text) is not None


def limit_behind(signal: str, last_words: bytes, most_threads: int, limits: Limits) -> str:
    """Return which limit a process was ended at that a signal ended, in words; empty if none explains it.

    Args:
        signal: Name of the signal.
        last_words: The end of what it wrote on standard error; it serves the wording only.
        most_threads: The most threads it had.
        limits: What it might use.
    """
    if signal == "SIGXCPU":
        return f"stopped at {limits.processor_words()}"
    if signal == "SIGXFSZ":
        return f"stopped at {size(limits.file_bytes)} in one file"
    if signal == OUTGROWN.name:
        return f"stopped at {size(limits.scratch_bytes)} in one folder"
    if signal == "SIGABRT" and NO_MEMORY in last_words:
        return f"{ended_by(signal)}: it found no more memory (the limit is {limits.memory_words()})"
    if signal == "SIGABRT" and most_threads >= NEARLY_ALL * limits.processes:
        return f"{ended_by(signal)} (the limit is {limits.processes_words()})"
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
