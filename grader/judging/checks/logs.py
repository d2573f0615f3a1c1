"""The check on whether a node writes through its logger."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from grader.core.exercise import Finding
from grader.core.quantities import seconds
from grader.core.trace import Trace
from grader.judging.findings import met, not_met, partly
from grader.judging.output import is_no_node, printed_lines, student_records
from grader.judging.silence import fault_hint, first_fault
from grader.judging.wording import counted, fault_sentence, moment, quote, span

LOGGER_HINT = "write through the node's logger: self.get_logger().info(...)"


def no_node(trace: Trace, process: str, evidence: Mapping[str, Any]) -> Finding:
    """Return no credit for what was written by a process without a node."""
    reason = f"{process}: no node in the ROS graph in {span(trace.stop_ns)}; what is written without one does not count"
    fault = first_fault(trace, process)
    if fault is not None:
        reason = f"{fault_sentence(fault)}; {reason}"
    return not_met(reason, evidence, hint="create the node, and log with node.get_logger()", fault=fault)


@dataclass(frozen=True, slots=True)
class UsesLogger:
    """A process writes at least one record through an rclpy logger, of any severity that is shown.

    Lines that are printed instead are half of it. A process that has no node in the ROS graph logs nothing, and the
    prompt of an `input()` is no line.

    Attributes:
        process: File name of the student process, e.g. `velocity_publisher.py`.
    """

    process: str

    def judge(self, trace: Trace) -> Finding:
        """Return full credit for a record, half for printed lines only."""
        records = student_records(trace, self.process)
        lines = printed_lines(trace, self.process)
        evidence = {"process": self.process, "records": len(records), "printed_lines": len(lines)}
        if (records or lines) and is_no_node(trace, self.process):
            return no_node(trace, self.process, evidence)
        if records:
            first = records[0]
            reason = f"{self.process}: {counted(len(records), 'log record')}, the first at {moment(first.t_ns)}"
            evidence |= {"first_s": seconds(first.t_ns), "first": quote(first.text), "severity": first.severity}
            return met(f"{reason}: {quote(first.text)}", evidence)
        if lines:
            reason = f"{self.process}: {counted(len(lines), 'line')} printed, none through the logger"
            return partly(reason, evidence | {"first": quote(lines[0].text)}, hint=LOGGER_HINT)
        fault = first_fault(trace, self.process)
        if fault is not None:
            return not_met(
                f"{fault_sentence(fault)}; nothing was logged", evidence, hint=fault_hint(fault), fault=fault
            )
        return not_met(f"{self.process}: no log record in {span(trace.stop_ns)}", evidence, hint=LOGGER_HINT)
