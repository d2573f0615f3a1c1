"""What a process wrote: log records and printed lines without those of ROS and Python, and the numbers in them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

from grader.grading.judging.findings import AT_ONCE_NS, first_fault
from grader.grading.judging.texts import Printed, clean, printed_numbers, readings, template_of
from grader.grading.judging.values import number_at, per_trace, text_at
from grader.runtime.model.trace import LogRecord, OutputLine, Trace

#: Warnings that rclpy writes through the node's own logger when QoS policies are incompatible.
_RCLPY_TEXT = re.compile(r"New (publisher|subscription) discovered on (topic|service) .*incompatible QoS", re.DOTALL)
#: Loggers of the layers below rclpy, which report their own failures.
_MIDDLEWARE = re.compile(r"(rmw|rcl|rcutils|rosidl|rcl_\w+|rmw_\w+|rosidl_\w+)(\.|$)")
_TRACEBACK_HEAD = re.compile(r"\s*(Traceback \(most recent call last\):|Exception in thread .*|Exception ignored .*)$")
_BETWEEN_TRACEBACKS = re.compile(r"(The above exception was|During handling of the above exception)")
_INTERPRETER = re.compile(
    r".*:\d+: \w*Warning: "  # warnings.warn
    r"|sys:\d+: \w*Warning: "
    r"|Fatal Python error: |Current thread 0x|Thread 0x[0-9a-f]+ "
    r"|usage: .*\.py|.*\.py: error: "  # argparse
    r"|\[(DEBUG|INFO|WARN|ERROR|FATAL)\] \[\d+\.\d+\] \["  # rcutils writing a record to its console
    r"|>>> \[rcutils|.*\[(RTPS|SECURITY|DDS|XMLPARSER)\w* (Error|Warning)\]"
    r"|terminate called |Segmentation fault|Aborted|Killed|.*Assertion .* failed"
)


@per_trace
def student_records(trace: Trace, process: str) -> tuple[LogRecord, ...]:
    """Return the records of a process without those of rclpy and the layers below it."""
    return tuple(r for r in trace.records(process) if r.t_ns < trace.stop_ns and not _of_ros(r))


def _of_ros(record: LogRecord) -> bool:
    if record.file:
        return False
    return bool(_RCLPY_TEXT.match(record.text[:400]) or _MIDDLEWARE.match(record.logger))


@per_trace
def printed_lines(trace: Trace, process: str) -> tuple[OutputLine, ...]:
    """Return the lines that a process printed, without tracebacks, interpreter warnings and blank lines."""
    faults = [" ".join(f.text.split()) for f in trace.faults(process)]
    lines = [o for o in trace.lines(process) if o.t_ns < trace.stop_ns and o.text.strip()]
    # the text of an exception may continue over several lines, without indentation like printed ones
    lines = [o for o in lines if o.stream != "stderr" or not any(" ".join(o.text.split()) in f for f in faults)]
    outs = [o for o in lines if o.stream != "stderr"]
    errs = _without_interpreter_noise([o for o in lines if o.stream == "stderr"])
    kept = {id(o) for o in [*_without_prompt(trace, process, outs), *errs]}
    return tuple(o for o in lines if id(o) in kept)


def is_no_node(trace: Trace, process: str) -> bool:
    """Return whether a process had no node in the graph; one that logged and ended at once may have had one unseen."""
    seen = {node for graph in trace.graphs() for node in graph.nodes}
    others = {f"/{r.logger.replace('.', '/')}" for r in trace.records() if r.process != process}
    if not trace.graphs() or seen - others:
        return False
    fault = first_fault(trace, process)
    return not (fault is not None and fault.t_ns < AT_ONCE_NS and student_records(trace, process))


def written(trace: Trace, process: str) -> tuple[LogRecord | OutputLine, ...]:
    """Return the records of a process, followed by the lines that it printed."""
    return (*student_records(trace, process), *printed_lines(trace, process))


def _without_prompt(trace: Trace, process: str, lines: list[OutputLine]) -> list[OutputLine]:
    """Return the lines without the prompt of an `input()` at which the process ended: there is no keyboard."""
    ends = [f for f in trace.faults(process) if f.said("^EOFError")]
    prompt = next((o for o in reversed(lines) if ends and o.t_ns <= ends[0].t_ns), None)
    return [o for o in lines if o is not prompt]


def _without_interpreter_noise(lines: Iterable[OutputLine]) -> list[OutputLine]:
    kept: list[OutputLine] = []
    inside_traceback = after_warning = False
    for line in lines:
        indented = line.text[:1] in (" ", "\t")
        if _TRACEBACK_HEAD.match(line.text) or _BETWEEN_TRACEBACKS.match(line.text):
            inside_traceback = True
        elif inside_traceback:
            inside_traceback = indented  # the first unindented line is the exception itself
        elif _INTERPRETER.match(line.text[:400]):
            after_warning = True
        elif not (after_warning and indented):
            after_warning = False
            kept.append(line)
    return kept


Output = LogRecord | OutputLine


@lru_cache(maxsize=4096)
def numbers_in(text: str) -> tuple[Printed, ...]:
    """Return the numbers of a text in every way in which it may be meant."""
    return tuple(n for body in readings(clean(text)) if body is not None for n in printed_numbers(body))


def after(text: str, printed: Printed) -> str:
    """Return what follows a number of a text, without white space between them."""
    return clean(text)[printed.stop :].lstrip()


@lru_cache(maxsize=4096)
def shape_of(text: str) -> str:
    """Return a text with masked numbers and without white space; equal for texts of the same wording."""
    body = clean(text)
    return template_of(body, printed_numbers(body))


def in_window(outputs: Sequence[Output], start_ns: int, stop_ns: int) -> list[Output]:
    """Return the outputs written in [start_ns, stop_ns)."""
    return [o for o in outputs if start_ns <= o.t_ns < stop_ns]


def number_in(text: str, pattern: str | None = None) -> float | None:
    """Return the number that the pattern finds in a text, or without a pattern the first number."""
    if pattern is not None:
        match = re.search(pattern, text[:2_000])
        if match is None:
            return None
        text = match[1] if match.re.groups and match[1] is not None else match[0]
    found = numbers_in(text)
    return found[0].value if found else None


def number_told(value: Mapping[str, object], path: str, pattern: str | None = None) -> float | None:
    """Return the number at a path: a field that is a number, or the number that a text there tells.

    Args:
        value: The fields of a message, a request or a response.
        path: Path of the field.
        pattern: Regular expression whose first group, or whole match, is the number in a text; its first number if
            None.
    """
    text = text_at(value, path)
    return number_at(value, path) if text is None else number_in(text, pattern)
