"""The check that a process survives a silent topic: it neither fails while it waits, nor stops working for good."""

from __future__ import annotations

import re
from typing import ClassVar

from grader.grading.judging.checks.logs import complained
from grader.grading.judging.findings import fault_hint, fault_sentence, first_fault, met, not_met
from grader.grading.judging.logs.outputs import student_records, written
from grader.grading.judging.plots import Drawing, Plot
from grader.grading.model.chart import Stretch
from grader.grading.model.exercise import Finding, ProblemKind, Roles
from grader.grading.model.wording import moment, number, quote, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import DurationNs, seconds
from grader.runtime.model.trace import Fault, Trace

_DIGIT = re.compile(r"\d")


@dataclass(frozen=True, slots=True)
class WaitsGracefully:
    """A process survives a silence on a topic without an exception or ERROR record, and works once data arrives.

    Attributes:
        process: File name of the student process.
        topic: Topic that is silent at first.
        silence: Minimum duration of the silence in the recording.
    """

    roles: ClassVar[Roles] = Roles(given=("topic",))
    process: str
    topic: str
    silence: DurationNs

    @property
    def expected(self) -> str:
        silence = number(seconds(self.silence))
        return f"{self.process} lives through {silence} s without {self.topic}, without an error, and works afterwards"

    def judge(self, trace: Trace) -> Finding:
        fault = first_fault(trace, self.process)
        if fault is not None:
            return self._faulted(trace, fault)
        # All of the recording: an error once data has arrived is as wrong as one before.
        bad = [r for r in student_records(trace, self.process) if r.severity in ("ERROR", "FATAL")]
        if bad:
            more = {"first_s": seconds(bad[0].t_ns), "first": quote(bad[0].text)}
            return complained(
                self.process, bad, "", more, "waiting for data is not an error: log nothing, or use info or warn"
            )
        deliveries = trace.deliveries(self.topic)
        # That is a scenario without the situation that is asked about.
        if not deliveries or deliveries[0].t_ns < self.silence:
            raise HarnessError(
                f"{self.topic}: the recording has no silence of {span(self.silence)} before the first message"
            )
        return self._works(trace, deliveries[0].t_ns)

    def _faulted(self, trace: Trace, fault: Fault) -> Finding:
        deliveries = trace.deliveries(self.topic)
        early = not deliveries or fault.t_ns < deliveries[0].t_ns
        when = f"while nothing was published on {self.topic}" if early else f"after messages arrived on {self.topic}"
        hint = fault_hint(fault)
        # The usual mistake: a callback of a timer uses the last message before there is one.
        if fault.said("NoneType"):
            hint = "start with None and return early until a message has arrived"
        return not_met(f"{fault_sentence(fault)}, {when}", {"fault_s": seconds(fault.t_ns)}, hint=hint, fault=fault)

    def drawing(self, trace: Trace) -> Drawing:
        """Return what came after the silence, with what the process wrote all the time."""
        came = trace.deliveries(self.topic)
        first_s = seconds(min(came[0].t_ns if came else trace.stop_ns, trace.stop_ns))
        cases = (Stretch(0.0, first_s, f"nothing on {self.topic}"),)
        return Drawing((Plot(self.topic, most=1),), processes=(self.process,), cases=cases)

    def _works(self, trace: Trace, first_ns: int) -> Finding:
        outputs = written(trace, self.process)
        before = {o.text for o in outputs if o.t_ns < first_ns and not _DIGIT.search(o.text)}
        # a text without a number that was also written before the data is about waiting, not about the data
        after = min((o.t_ns for o in outputs if o.t_ns >= first_ns and o.text not in before), default=None)
        alive = f"{self.process}: alive through {span(first_ns)} without a message"
        if after is None:
            reason = f"{alive}, but no sign that the data arrived"
            return not_met(reason, blocked_by=self.topic, problem=ProblemKind.NOT_LOGGED)
        evidence = {"silence_s": seconds(first_ns), "first_output_s": seconds(after)}
        return met(f"{alive}, first output with data at {moment(after)}", evidence)
