"""The check on whether a node writes through its logger."""

from __future__ import annotations

from dataclasses import dataclass

from grader.judging.findings import met, not_met, partly
from grader.judging.output import printed_lines, student_records
from grader.judging.silence import fault_hint, first_fault
from grader.judging.wording import counted, fault_sentence, moment, quote, span
from grader.model.exercise import Finding
from grader.model.quantities import seconds
from grader.model.trace import Trace

LOGGER_HINT = "write through the node's logger: self.get_logger().info(...)"


@dataclass(frozen=True, slots=True)
class UsesLogger:
    """A process writes at least one record through an rclpy logger, of any severity that is shown.

    Lines that are printed instead are half of it.

    Attributes:
        process: File name of the student process, e.g. `velocity_publisher.py`.
    """

    process: str

    def judge(self, trace: Trace) -> Finding:
        """Return full credit for a record, half for printed lines only."""
        records = student_records(trace, self.process)
        lines = printed_lines(trace, self.process)
        evidence = {"process": self.process, "records": len(records), "printed_lines": len(lines)}
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
