"""Checks on a student's service client: how often it calls, and that it waits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from itertools import pairwise
from typing import Annotated, ClassVar

from grader.grading.judging.charts import Lanes, drawn_case, gaps_panel
from grader.grading.judging.checks.logs import complained
from grader.grading.judging.findings import (
    explain_fault,
    explain_no_client,
    fault_hint,
    fault_sentence,
    first_fault,
    met,
    not_met,
    only_printed,
    waiting_for,
)
from grader.grading.judging.logs.outputs import printed_lines, student_records
from grader.grading.judging.plots import Drawing
from grader.grading.judging.service_calls import LATENESS_NS, Call, calls_of
from grader.grading.judging.values import RuleOrValue, breach, broken_rules, rules_text
from grader.grading.model.chart import Band
from grader.grading.model.exercise import Finding, ProblemKind, Roles
from grader.grading.model.wording import moment, number, quote, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S, DurationNs, FieldOf, counted, seconds
from grader.runtime.model.trace import Trace

_WAIT_HINT = "wait in a loop: while not client.wait_for_service(timeout_sec=1.0): log that the node is waiting"


@dataclass(frozen=True, slots=True)
class CallsOfClient:
    """A student's client sends the expected number of requests to the grader's server, with a period if one is given.

    A gap may be longer by the time that the server took to respond. After a call without a response, the gap may have
    any length.

    Attributes:
        service: Service name as on the wire.
        calls: Smallest number of requests.
        at_most: Largest number of requests; `calls` if left out.
        period: Time expected from one request to the next; free if left out.
        tolerance: Largest difference of each gap from the period.
        fields: What every request must hold by field path: a value, or `{equals, items, tolerance, low, high, pattern,
            example}`.
    """

    roles: ClassVar[Roles] = Roles(calls=("service",))
    service: str
    calls: int
    at_most: int | None = None
    period: DurationNs | None = None
    tolerance: DurationNs = NS_PER_S // 4
    fields: Annotated[Mapping[str, RuleOrValue], FieldOf("service", "_Request")] = field(default_factory=dict)

    @property
    def expected(self) -> str:
        text = f"{counted(self.calls, 'request')} on {self.service}"
        text += f" with {rules_text(self.fields)}" if self.fields else ""
        if self.period is None:
            return text
        return f"{text}, {number(seconds(self.period))} ± {number(seconds(self.tolerance))} s apart"

    def judge(self, trace: Trace) -> Finding:
        calls = calls_of(trace, self.service, "student")
        if not calls:
            return explain_no_client(trace, self.service)
        gaps = [b.request.t_ns - a.request.t_ns for a, b in pairwise(calls)]
        evidence = {
            "service": self.service,
            "requests": len(calls),
            "times_s": [seconds(c.request.t_ns) for c in calls[:100]],
        }
        # The number first: with calls missing, the gaps between the others are not those of the task.
        if not self.calls <= len(calls) <= max(self.calls, self.at_most or 0):
            return self._miscounted(trace, calls, evidence)
        for request in (c.request for c in calls):
            for path in broken_rules(request.value, self.fields)[:1]:
                flaw = breach(request.value, path, self.fields[path])
                reason = f"{moment(request.t_ns)}, {self.service}: {flaw} in the request"
                return not_met(reason, evidence | {"field": path}, problem=ProblemKind.WRONG_VALUE)
        wrong = self._wrong_gap(trace, calls) if self.period is not None else None
        asked = f"{self.service}: {counted(len(calls), 'request')}"
        if wrong is None:
            apart = f", {number(sum(gaps) / len(gaps) / NS_PER_S)} s apart on average" if gaps else ""
            return met(asked + apart, evidence)
        place, gap = wrong
        wanted = f"{span(self.period or 0)} ± {number(seconds(self.tolerance))} s"
        reason = f"{asked}; {seconds(gap):.3f} s from number {place} to number {place + 1}, expected {wanted}"
        hint = f"wait {span(self.period or 0)} after each response before the next request"
        return not_met(reason, evidence, hint=hint, problem=ProblemKind.WRONG_RATE)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the calls, and the time from each to the next with the period."""
        times = [c.request.t_ns for c in calls_of(trace, self.service, "student")]
        if len(times) < 2:
            return Drawing(services=(self.service,))
        bands = []
        if self.period is not None:
            label = f"{number(seconds(self.period))} ± {number(seconds(self.tolerance))} s"
            bands.append(Band(seconds(self.period - self.tolerance), seconds(self.period + self.tolerance), label))
        gaps = [seconds(b - a) for a, b in pairwise(times)]
        said = f"{min(gaps):.3f} s to {max(gaps):.3f} s from request to request."
        return Drawing(services=(self.service,), panels=((gaps_panel("request", times, bands=bands), said),))

    def _wrong_gap(self, trace: Trace, calls: Sequence[Call]) -> tuple[int, int] | None:
        """Return the number of the first call whose gap to the next is wrong, and the gap."""
        slack = LATENESS_NS[trace.clock] + self.tolerance
        period = self.period or 0
        for place, (one, following) in enumerate(pairwise(calls), 1):
            gap = following.request.t_ns - one.request.t_ns
            # A client may count its pause from the request or from the response, and both are right.
            took = 0 if one.response is None else max(0, one.response.t_ns - one.request.t_ns)
            if gap < period - slack or (one.response is not None and gap > period + slack + took):
                return place, gap
        return None

    def _miscounted(self, trace: Trace, calls: Sequence[Call], evidence: dict[str, object]) -> Finding:
        reason = f"{self.service}: {counted(len(calls), 'request')}, expected {self.calls}"
        if len(calls) > self.calls:
            hint = f"call the service {self.calls} times: for i in range({self.calls})"
            return not_met(reason, evidence, hint=hint, problem=ProblemKind.TOO_MANY)
        if crashed := explain_fault(trace, reason, evidence, last=True):
            return crashed
        last = calls[-1]
        waiting = "; the last one got no response" if last.response is None else ""
        ended = trace.marks("exited")
        ended_said = f"; {ended[0].detail} ended at {moment(ended[0].t_ns)}" if ended else ""
        # It would have sent the next one after the end: then the rubric observes too briefly.
        if not ended and not waiting and last.request.t_ns + (self.period or 0) + self.tolerance >= trace.stop_ns:
            raise HarnessError(f"{self.service}: the recording ends before {self.calls} requests could be sent")
        return not_met(reason + waiting + ended_said, evidence, problem=ProblemKind.TOO_FEW)


@dataclass(frozen=True, slots=True)
class WaitsForService:
    """A client survives the time before its server appears, logs that it waits, and calls once the server is there.

    The wording is free, but a record of severity ERROR or FATAL does not count. Printing it instead of logging gives
    half the points.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        within: Longest time from the server's appearance to the first request.
    """

    roles: ClassVar[Roles] = Roles(calls=("service",))
    process: str
    service: str
    within: DurationNs = 5 * NS_PER_S

    @property
    def expected(self) -> str:
        return f"{self.process} waits for {self.service}, logs that it waits, and calls it once it is available"

    def judge(self, trace: Trace) -> Finding:
        starts = trace.marks("server_starts", self.service)
        # Without a server, the whole recording is the time before it.
        appears_ns = starts[0].t_ns if starts else trace.stop_ns + 1
        # First: a client that gave up has not called later either, and that is not its mistake.
        gave_up = self._gave_up(trace, appears_ns)
        if gave_up is not None:
            return gave_up
        if not starts or appears_ns == 0:
            raise HarnessError(f"{self.service}: the recording has no time before the server appears")
        asked = [c.request.t_ns for c in calls_of(trace, self.service, "student") if c.request.t_ns >= appears_ns]
        if not asked or asked[0] - appears_ns > self.within + LATENESS_NS[trace.clock]:
            return self._never_asked(trace, appears_ns, asked)
        return self._said(trace, appears_ns, asked[0])

    def drawing(self, trace: Trace) -> Drawing:
        """Return the calls with what the client wrote, and the time without a server."""
        starts = trace.marks("server_starts", self.service)
        until_ns = min(starts[0].t_ns if starts else trace.stop_ns, trace.stop_ns)
        cases = (drawn_case(0, until_ns, f"{self.service} is not available"),)
        panels = []
        if not calls_of(trace, self.service, "student"):
            lanes = Lanes()
            lanes.add("request")
            panels.append((lanes.panel(self.service), f"No request on {self.service}."))
        title = f"Calls of {self.service} and what {self.process} wrote"
        return Drawing((), (self.service,), panels=tuple(panels), processes=(self.process,), cases=cases, title=title)

    def _gave_up(self, trace: Trace, appears_ns: int) -> Finding | None:
        """Return a finding if the client ended while waiting, or logged an error; None otherwise."""
        fault = first_fault(trace, self.process)
        when = f"while {self.service} was not available"
        if fault is not None and fault.t_ns < appears_ns:
            hint = fault_hint(fault) or _WAIT_HINT
            return not_met(f"{fault_sentence(fault)}, {when}", {"fault_s": seconds(fault.t_ns)}, hint=hint, fault=fault)
        ended = next((m for m in trace.marks("exited", self.process) if m.t_ns < appears_ns), None)
        if ended is not None:
            reason = f"{self.process} ended at {moment(ended.t_ns)}, {when}"
            return not_met(reason, {"ended_s": seconds(ended.t_ns)}, hint=_WAIT_HINT, problem=ProblemKind.ENDED)
        records = [r for r in student_records(trace, self.process) if r.t_ns < appears_ns]
        # Waiting is what is asked for, so that a program which calls it an error has not understood the task.
        bad = [r for r in records if r.severity in ("ERROR", "FATAL")]
        if not bad:
            return None
        return complained(self.process, bad, f" {when}", {}, "waiting is not an error: log it with info or warn")

    def _never_asked(self, trace: Trace, appears_ns: int, asked: Sequence[int]) -> Finding:
        there = f"{self.service} appeared at {moment(appears_ns)}"
        if crashed := explain_fault(trace, f"{there}, no request was sent", process=self.process):
            return crashed
        # A client whose QoS fits no server is there and reaches none, which another check explains.
        usual = [e for e in trace.service_ends("client", self.service) if not e.unusual]
        if not trace.requests(self.service, "student") and not usual:
            return waiting_for("service_calls", explain_no_client(trace, self.service))
        when = f"the first request was sent at {moment(asked[0])}" if asked else "no request was sent"
        if not asked and trace.stop_ns - appears_ns <= self.within:
            raise HarnessError(f"{self.service}: the recording ends too soon after the server appeared")
        reason = f"{there}, {when}, expected one within {span(self.within)}"
        problem = ProblemKind.TOO_LATE if asked else ProblemKind.SILENT
        return not_met(reason, {"appears_s": seconds(appears_ns)}, hint=_WAIT_HINT, problem=problem)

    def _said(self, trace: Trace, appears_ns: int, asked_ns: int) -> Finding:
        records = [r for r in student_records(trace, self.process) if r.t_ns < appears_ns]
        lines = [o for o in printed_lines(trace, self.process) if o.t_ns < appears_ns]
        evidence = {
            "appears_s": seconds(appears_ns),
            "first_request_s": seconds(asked_ns),
            "records": len(records),
            "printed_lines": len(lines),
        }
        waited = (
            f"{self.process}: alive through {span(appears_ns)} without {self.service}, calls it at {moment(asked_ns)}"
        )
        if records:
            return met(
                f"{waited}; {counted(len(records), 'record')} meanwhile: {quote(records[-1].text, 80)}", evidence
            )
        if lines:
            return only_printed(f"{waited}; it prints that it waits, but does not log it", evidence)
        return not_met(
            f"{waited}, but logs nothing while it waits", evidence, hint=_WAIT_HINT, problem=ProblemKind.NOT_LOGGED
        )
