"""Turns the reports of a student's process into faults; what it says is untrusted, also where it has the right type."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping

from grader.runtime.host.faults import GRADERS, TEXT_CHARACTERS
from grader.runtime.host.protocol import FRAMES, Exited, FaultReport
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import duration, size
from grader.runtime.model.trace import Fault, FaultKind, Mark
from grader.runtime.plan import Plan
from grader.runtime.sandbox.start import OUTGROWN
from grader.runtime.worker.notes import Places

#: Processor seconds that a node may use until it first blocks, including its imports, and later between two blocks.
START_CPU_S = 10.0
#: Later there are no imports; a callback that takes longer hangs for everybody who waits for the node.
WAKE_UP_CPU_S = 5.0
#: Real seconds that a node may wait for something that is neither ROS nor time, such as a keyboard.
BLOCKED_S = 5.0
#: The texts for the codes that the host's watchdog reports for a process that hangs.
_HUNG = {
    "start_limit": f"did not return within {START_CPU_S:g} s of processor time",
    "wake_up_limit": f"did not return within {WAKE_UP_CPU_S:g} s of processor time",
    "blocked": f"waited {BLOCKED_S:g} s for something outside the ROS graph",
    "alarm": "sets an alarm that rings in real time",
    "events_executor": "makes an EventsExecutor, which waits in real time",
    "kernel_clock": "reads a clock of the kernel, which shows real time",
    "process": "starts another process, which runs in real time",
    "waiting": "waits for something outside the ROS graph",
    "timed_event": "waits for a missed deadline or a lost liveliness, which the middleware times in real time",
}
#: A module of the host, as a process names it.
_MODULE = re.compile(r"[a-z_]{1,40}(?:/[a-z_]{1,40})?\.py")
#: Qualified names of classes and functions as Python writes them; free text does not match.
_TYPE = re.compile(r"(?=.{1,200}$)[^\W\d]\w*(?:\.(?:<locals>|[^\W\d]\w*))*")
_FUNCTION = re.compile(r"(?=.{1,100}$)(?:<(?:module|lambda|listcomp|setcomp|dictcomp|genexpr)>|[^\W\d]\w*)")
#: The C++ runtime writes this before it aborts a process that is out of memory.
NO_MEMORY = b"std::bad_alloc"
#: What C++ writes when a thread cannot be started; the resource monitor may not have seen the threads before it.
NO_THREAD = b"std::system_error"
#: A process that aborts with at least this share of its allowed threads has hit the limit.
NEARLY_ALL = 0.9
#: A process that receives SIGXCPU below this share of its processor time has sent the signal itself.
HARDLY_ANY = 0.5
#: The exit code of a program that Ctrl-C ended, and the exceptions that ROS programs raise then.
STOPPED_CODE = 130
NORMAL_AT_STOP = ("ExternalShutdownException", "rcl_shutdown already called", "KeyboardInterrupt")


def reported_fault(process: str, t_ns: int, told: FaultReport, limits: Limits, places: Places) -> Fault:
    """Convert a reported fault; an error that a limit caused names the limit.

    Args:
        process: Name of the process.
        t_ns: Time of the fault.
        told: What the process reports.
        limits: Limits of the process.
        places: The files of the submission; places outside of them are dropped.
    """
    hung = _HUNG.get(told.code)
    kind = FaultKind.SYNTAX_ERROR if told.code == "syntax_error" else FaultKind.HUNG if hung else FaultKind.EXCEPTION
    # Codes before words: what an exception says is up to the program.
    text = hung or graders_fault(process, told) or _own_words(told)
    python = sys.version_info[:2] if kind is FaultKind.SYNTAX_ERROR else None
    if python is not None:
        text += f" (read by Python {python[0]}.{python[1]})"
    behind = next((words for error, words in _errors(limits).items() if error in text), "")
    file, line = _place(told, places, kind)
    return Fault(
        t_ns=t_ns,
        process=process,
        kind=kind,
        text=f"{text} (the limit is {behind})" if behind else text,
        file=file,
        line=line,
        frames=_frames(told, places),
        python=python,
    )


def graders_fault(process: str, told: FaultReport | None) -> str:
    """Describe a reported fault of the grader's own code in a process, for a bug report; empty if it is another one."""
    if told is None or told.code != GRADERS:
        return ""
    # From the student's process: only what looks like a module and a line is shown.
    known = _MODULE.fullmatch(told.module) and 0 < told.at < 10_000
    where = f", {told.module} line {told.at}" if known else ""
    what = told.type if _TYPE.fullmatch(told.type) else "Exception"
    return f"the grader's own code failed in the process of {process}: {what}{where}; please report this line"


def _own_words(told: FaultReport) -> str:
    """Format an exception as Python does: `Type: message`, on one line."""
    name = told.type if _TYPE.fullmatch(told.type) else "Exception"
    message = " ".join(told.message[:TEXT_CHARACTERS].split())
    return (f"{name}: {message}" if message else name)[:TEXT_CHARACTERS]


def _place(told: FaultReport, places: Places, kind: FaultKind) -> tuple[str, int]:
    """Return file and line of a fault if the submission has them; otherwise an empty string and 0."""
    file, line = told.file, told.line
    if not places.has(file):
        return "", 0
    if kind is FaultKind.SYNTAX_ERROR:
        line = min(line, places.lines(file))  # Python reports an unexpected end one line after the last
    return (file, line) if places.has(file, line) else (file, 0)


def _frames(told: FaultReport, places: Places) -> tuple[str, ...]:
    return tuple(
        f"{file}:{line} in {name}"
        for file, line, name in told.frames[:FRAMES]
        if places.has(file, line) and _FUNCTION.fullmatch(name)
    )


def ending_fault(process: str, t_ns: int, report: Exited, limits: Limits, places: Places) -> Fault:
    """Return the fault of a process that reported its end."""
    if report.fault is not None:
        return reported_fault(process, t_ns, report.fault, limits, places)
    return exited(process, t_ns, report.code)


def exited(process: str, t_ns: int, code: int | None) -> Fault:
    """Return the fault of a process that exited by itself; the code is None if it is unknown."""
    text = f"exited with code {'?' if code is None else code}"
    return Fault(t_ns, process, FaultKind.EXITED, text, exit_code=code)


def ended_by(process: str, t_ns: int, signal: str) -> Fault:
    """Return the fault of a process that was ended by a signal that no limit explains."""
    return Fault(t_ns, process, FaultKind.KILLED, _by(signal), signal=signal)


def ending(  # noqa: PLR0913 - each comes from another place
    process: str, t_ns: int, report: Exited, plan: Plan, places: Places, *, stopped: bool
) -> Fault | Mark:
    """Return the fault of a process that reported its end, or a mark if the end is normal.

    Args:
        process: Name of the process.
        t_ns: Time of the end.
        report: The report of the process.
        plan: Says whether the process may exit, and its limits.
        places: The files of the submission.
        stopped: Whether the process had received the stop signal.
    """
    # Before `may_exit`: after Ctrl-C, other endings are normal than before.
    if stopped and is_normal_stop(report):
        return Mark(t_ns, "stopped", process)
    if process in plan.may_exit and is_free_exit(report):
        return Mark(t_ns, "exited", process)
    return ending_fault(process, t_ns, report, plan.limits, places)


def is_free_exit(report: Exited) -> bool:
    """Return whether a process reports that it exited by itself with code 0."""
    return report.fault is None and report.code == 0


def is_normal_stop(report: Exited) -> bool:
    """Return whether a process ended after the stop signal as ROS programs do.

    rclpy shuts its contexts down at that signal, so a program that calls shutdown() itself gets an exception.
    """
    if report.fault is not None:
        words = _own_words(report.fault)
        return report.fault.code == "exception" and any(normal in words for normal in NORMAL_AT_STOP)
    return report.code in (0, STOPPED_CODE)


def never_stopped(process: str, t_ns: int, patience_ns: int) -> Fault:
    """Return the fault of a process that did not end after the stop signal."""
    return Fault(t_ns, process, FaultKind.HUNG, f"did not end within {duration(patience_ns)} after Ctrl-C")


def _by(signal: str) -> str:
    return f"ended by {signal}"


def limit_behind(signal: str, last_words: bytes, most_threads: int, used_ns: int, limits: Limits) -> str:
    """Describe the limit that explains why a signal ended a process; empty if no limit does.

    Args:
        signal: Name of the signal.
        last_words: The end of its standard error; used for the wording only.
        most_threads: The most threads that it had.
        used_ns: Its processor time when the resource monitor last looked.
        limits: Limits of the process.
    """
    # By the signal and what was measured; the last words of a program only choose the sentence.
    if signal == "SIGXCPU" and used_ns > HARDLY_ANY * limits.processor_ns:
        return f"stopped at {limits.processor_words()}"
    if signal == "SIGXFSZ":
        return f"stopped at {size(limits.file_bytes)} in one file"
    if signal == OUTGROWN.name:
        return f"stopped at {size(limits.scratch_bytes)} in one folder"
    if signal == "SIGABRT" and NO_MEMORY in last_words:
        return f"{_by(signal)} after it wrote {NO_MEMORY.decode()} (the limit is {limits.memory_words()})"
    if signal == "SIGABRT" and (NO_THREAD in last_words or most_threads >= NEARLY_ALL * limits.processes):
        return f"{_by(signal)} (the limit is {limits.processes_words()})"
    return ""


def _errors(limits: Limits) -> Mapping[str, str]:
    """Map each error message that Python gives at a limit to the description of that limit."""
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
