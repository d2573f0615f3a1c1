"""Checks on a student's service client: how often it asks, and that it waits for its server."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from grader.core.errors import HarnessError
from grader.core.exercise import Finding, Location
from grader.core.quantities import NS_PER_S, DurationNs, seconds
from grader.core.trace import Trace
from grader.judging.checks.logs import LOGGER_HINT
from grader.judging.findings import met, not_met, partly
from grader.judging.output import printed_lines, student_records
from grader.judging.services import LATENESS_NS, Call, calls_of, explain_no_client
from grader.judging.silence import fault_hint, first_fault
from grader.judging.wording import counted, fault_sentence, moment, number, quote, span

_WAIT_HINT = "wait in a loop: while not client.wait_for_service(timeout_sec=1.0): log that it is still waited for"


@dataclass(frozen=True, slots=True)
class ServiceCalls:
    """A student's client asks the grader's server so many times, with a period where one is given.

    A gap may be longer by the time that its own response took. After a call without a response it may have any length.

    Attributes:
        service: Service name as on the wire.
        calls: How many requests there must be.
        at_most: How many there may be, if more than `calls` are no mistake.
        period: Time expected from one request to the next; free if left out.
        tolerance: Largest difference of each gap from the period.
    """

    service: str
    calls: int
    at_most: int | None = None
    period: DurationNs | None = None
    tolerance: DurationNs = NS_PER_S // 4

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if number and gaps are right; the reason names the first gap that is not."""
        calls = calls_of(trace, self.service, "student")
        if not calls:
            return explain_no_client(trace, self.service)
        gaps = [b.request.t_ns - a.request.t_ns for a, b in pairwise(calls)]
        evidence = {
            "service": self.service,
            "requests": len(calls),
            "times_s": [seconds(c.request.t_ns) for c in calls[:100]],
        }
        if not self.calls <= len(calls) <= max(self.calls, self.at_most or 0):
            return self._miscounted(trace, calls, evidence)
        wrong = self._wrong_gap(trace, calls) if self.period is not None else None
        asked = f"{self.service}: {counted(len(calls), 'request')}"
        if wrong is None:
            apart = f", {number(sum(gaps) / len(gaps) / NS_PER_S)} s apart on average" if gaps else ""
            return met(asked + apart, evidence)
        place, gap = wrong
        wanted = f"{span(self.period or 0)} ± {number(seconds(self.tolerance))} s"
        reason = f"{asked}; {seconds(gap):.3f} s from number {place} to number {place + 1}, expected {wanted}"
        return not_met(reason, evidence, hint=f"wait {span(self.period or 0)} after each answer before asking again")

    def _wrong_gap(self, trace: Trace, calls: Sequence[Call]) -> tuple[int, int] | None:
        """Return the number of the first call that another follows too soon or too late, and the gap."""
        slack = LATENESS_NS[trace.clock] + self.tolerance
        period = self.period or 0
        for place, (one, following) in enumerate(pairwise(calls), 1):
            gap = following.request.t_ns - one.request.t_ns
            took = 0 if one.response is None else max(0, one.response.t_ns - one.request.t_ns)
            if gap < period - slack or (one.response is not None and gap > period + slack + took):
                return place, gap
        return None

    def _miscounted(self, trace: Trace, calls: Sequence[Call], evidence: dict[str, Any]) -> Finding:
        reason = f"{self.service}: {counted(len(calls), 'request')}, expected {self.calls}"
        if len(calls) > self.calls:
            return not_met(reason, evidence, hint=f"ask {self.calls} times: for i in range({self.calls})")
        fault = first_fault(trace)
        if fault is not None:
            return not_met(f"{reason}; {fault_sentence(fault)}", evidence, hint=fault_hint(fault), fault=fault)
        last = calls[-1]
        waiting = "; the last one got no response" if last.response is None else ""
        ended = trace.marks("exited")
        ended_said = f"; {ended[0].detail} ended at {moment(ended[0].t_ns)}" if ended else ""
        if not ended and not waiting and last.request.t_ns + (self.period or 0) + self.tolerance >= trace.stop_ns:
            raise HarnessError(f"{self.service}: the recording ends before {self.calls} requests could be sent")
        return not_met(reason + waiting + ended_said, evidence)


@dataclass(frozen=True, slots=True)
class WaitsForService:
    """A client lives through the time before its server appears, says that it waits, and asks once it is there.

    What it says is free, as long as it is no ERROR or FATAL record. Saying so by printing only is half of it.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        within: How soon after the server appeared the first request must come.
    """

    process: str
    service: str
    within: DurationNs = 5 * NS_PER_S

    def judge(self, trace: Trace) -> Finding:
        """Return full credit for a record before the server appeared and a request after it."""
        starts = trace.marks("server_starts", self.service)
        appears_ns = starts[0].t_ns if starts else trace.stop_ns + 1
        gave_up = self._gave_up(trace, appears_ns)
        if gave_up is not None:
            return gave_up
        if not starts or appears_ns == 0:
            raise HarnessError(f"{self.service}: the recording has no time before the server appears")
        asked = [c.request.t_ns for c in calls_of(trace, self.service, "student") if c.request.t_ns >= appears_ns]
        if not asked or asked[0] - appears_ns > self.within + LATENESS_NS[trace.clock]:
            return self._never_asked(trace, appears_ns, asked)
        return self._said(trace, appears_ns, asked[0])

    def _gave_up(self, trace: Trace, appears_ns: int) -> Finding | None:
        """Return that the client did not live through the wait, or took it for an error; None if it did neither."""
        fault = first_fault(trace, self.process)
        when = f"while {self.service} was not there"
        if fault is not None and fault.t_ns < appears_ns:
            hint = fault_hint(fault) or _WAIT_HINT
            return not_met(f"{fault_sentence(fault)}, {when}", {"fault_s": seconds(fault.t_ns)}, hint=hint, fault=fault)
        ended = next((m for m in trace.marks("exited", self.process) if m.t_ns < appears_ns), None)
        if ended is not None:
            reason = f"{self.process} ended at {moment(ended.t_ns)}, {when}"
            return not_met(reason, {"ended_s": seconds(ended.t_ns)}, hint=_WAIT_HINT)
        records = [r for r in student_records(trace, self.process) if r.t_ns < appears_ns]
        bad = [r for r in records if r.severity in ("ERROR", "FATAL")]
        if not bad:
            return None
        reason = f"{self.process}: {counted(len(bad), 'record')} of severity ERROR or FATAL {when}, the first at "
        reason += f"{moment(bad[0].t_ns)}: {quote(bad[0].text)}"
        found = not_met(reason, {"records": len(bad)}, hint="waiting is no error: say it with info or warn")
        known = bad[0].file and bad[0].line > 0
        return replace(found, location=Location(bad[0].file, bad[0].line) if known else None)

    def _never_asked(self, trace: Trace, appears_ns: int, asked: Sequence[int]) -> Finding:
        fault = first_fault(trace, self.process)
        there = f"{self.service} appeared at {moment(appears_ns)}"
        if fault is not None:
            reason = f"{fault_sentence(fault)}; {there}, no request came"
            return not_met(reason, hint=fault_hint(fault), fault=fault)
        if not trace.requests(self.service, "student") and not trace.service_ends("client", self.service):
            found = explain_no_client(trace, self.service)
            return not_met(found.reason, found.evidence, hint=found.hint, blocked_by="service_calls")
        when = f"the first request came at {moment(asked[0])}" if asked else "no request came"
        if not asked and trace.stop_ns - appears_ns <= self.within:
            raise HarnessError(f"{self.service}: the recording ends too soon after the server appeared")
        reason = f"{there}, {when}, expected one within {span(self.within)}"
        return not_met(reason, {"appears_s": seconds(appears_ns)}, hint=_WAIT_HINT)

    def _said(self, trace: Trace, appears_ns: int, asked_ns: int) -> Finding:
        records = [r for r in student_records(trace, self.process) if r.t_ns < appears_ns]
        lines = [o for o in printed_lines(trace, self.process) if o.t_ns < appears_ns]
        evidence = {
            "appears_s": seconds(appears_ns),
            "first_request_s": seconds(asked_ns),
            "records": len(records),
            "printed_lines": len(lines),
        }
        waited = f"{self.process}: alive through {span(appears_ns)} without {self.service}, asks at {moment(asked_ns)}"
        if records:
            return met(
                f"{waited}; {counted(len(records), 'record')} meanwhile: {quote(records[-1].text, 80)}", evidence
            )
        if lines:
            return partly(f"{waited}; that it waits is printed, not logged", evidence, hint=LOGGER_HINT)
        return not_met(f"{waited}, but logs nothing while it waits", evidence, hint=_WAIT_HINT)
