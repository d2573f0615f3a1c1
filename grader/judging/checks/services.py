"""Checks on a student's service server: that it is there, that it answers, and what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from grader.core.errors import HarnessError
from grader.core.exercise import Finding, ServiceType
from grader.core.quantities import NS_PER_S, DurationNs, seconds
from grader.core.trace import Response, Trace
from grader.judging.findings import met, not_met
from grader.judging.rules import FieldRule, breach, broken_rules, told
from grader.judging.services import LATENESS_NS, Call, calls_of, explain_no_server
from grader.judging.silence import fault_hint, first_fault
from grader.judging.wording import counted, fault_sentence, moment, quote, span

_RETURN_HINT = "a service callback takes (self, request, response) and ends with return response"


@dataclass(frozen=True, slots=True)
class ServiceAvailable:
    """A node of the submission offers a service of a type: it is in the ROS graph, or it has answered.

    Attributes:
        service: Service name as on the wire, e.g. `/battery/get_status`.
        type: Service type, e.g. `std_srvs/srv/Trigger`.
    """

    service: str
    type: ServiceType

    def judge(self, trace: Trace) -> Finding:
        """Return full credit for one fitting server or more."""
        answers = [r for r in trace.responses(self.service, "student") if r.type == self.type]
        ends = [e for e in trace.service_ends("service", self.service) if e.type == self.type]
        if not answers and not ends:
            return explain_no_server(trace, self.service, self.type)
        node = quote(ends[0].node) if ends else "a node"
        evidence = {"service": self.service, "type": self.type, "responses": len(answers)}
        return met(f"{self.service}: {node} offers it with type {self.type}", evidence)


@dataclass(frozen=True, slots=True)
class ServiceAnswersAll:
    """A student's server answers every request of every client of the grader's, each within a time.

    Requests whose time is not over when the recording ends are left out.

    Attributes:
        service: Service name as on the wire.
        within: How long a response may take.
        at_least: How many requests there must have been to tell.
    """

    service: str
    within: DurationNs = NS_PER_S
    at_least: int = 1

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if no response is missing or late; the reason names the first that is."""
        late_ns = self.within + LATENESS_NS[trace.clock]
        fault = first_fault(trace)
        calls = [c for c in calls_of(trace, self.service, "grader") if _due(c, trace, late_ns) or fault is not None]
        if not calls:
            return never_asked(trace, self.service)
        unanswered = [c for c in calls if c.response is None or c.response.t_ns - c.request.t_ns > late_ns]
        clients = len({c.request.client for c in calls})
        evidence = {"service": self.service, "requests": len(calls), "clients": clients, "unanswered": len(unanswered)}
        if not unanswered:
            slowest = max(seconds(c.response.t_ns - c.request.t_ns) for c in calls if c.response is not None)
            asked = f"{counted(len(calls), 'request')} of {counted(clients, 'client')}"
            return met(f"{self.service}: {asked} answered, the slowest within {slowest:.3f} s", evidence)
        return self._explain(trace, calls, unanswered, evidence)

    def _explain(
        self, trace: Trace, calls: Sequence[Call], unanswered: Sequence[Call], evidence: Mapping[str, object]
    ) -> Finding:
        first = unanswered[0]
        took = "no response"
        if first.response is not None:
            took = f"the response came after {seconds(first.response.t_ns - first.request.t_ns):.3f} s"
        reason = f"{moment(first.request.t_ns)}, {self.service}: {took}, expected one within {span(self.within)}; "
        reason += f"so for {len(unanswered)} of {counted(len(calls), 'request')}"
        known = dict(evidence) | {"first_unanswered_s": seconds(first.request.t_ns)}
        fault = first_fault(trace)
        if fault is not None:
            return not_met(f"{reason}; {fault_sentence(fault)}", known, hint=fault_hint(fault), fault=fault)
        return not_met(reason, known, hint="" if any(c.response for c in calls) else _RETURN_HINT)


def _due(call: Call, trace: Trace, late_ns: int) -> bool:
    return call.response is not None or call.request.t_ns + late_ns < trace.stop_ns


@dataclass(frozen=True, slots=True)
class ServiceResponse:
    """Every response of a student's server holds what is expected in each field named.

    Whether there is a response to every request is the question of `service_answers_all`.

    Attributes:
        service: Service name as on the wire.
        fields: What is expected by field path: a value, or `{equals, tolerance, low, high, pattern, example}`.
        at_least: How many responses there must be to tell.
    """

    service: str
    fields: Mapping[str, str | float | bool | FieldRule]
    at_least: int = 1

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if no response differs; the reason names the first that does."""
        found = [r for r in trace.responses(self.service, "student") if r.t_ns < trace.stop_ns]
        if len(found) < max(1, self.at_least):
            return too_few_responses(trace, self.service, len(found), self.at_least)
        wrong = [(k, r) for k, r in enumerate(found, 1) if broken_rules(r.value, self.fields)]
        evidence = {"service": self.service, "responses": len(found), "wrong": len(wrong)}
        if not wrong:
            return met(f"{self.service}: {told(self.fields)} in {counted(len(found), 'response')}", evidence)
        place, first = wrong[0]
        path = broken_rules(first.value, self.fields)[0]
        reason = f"{moment(first.t_ns)}, {self.service}: {breach(first.value, path, self.fields[path])} in response "
        reason += f"{place}; wrong in {len(wrong)} of {counted(len(found), 'response')}"
        return not_met(
            reason, evidence | {"field": path, "first_wrong_s": seconds(first.t_ns)}, hint=_hint(first, path)
        )


def _hint(response: Response, path: str) -> str:
    """Return that a field was left at its default, where it holds that."""
    value = response.value.get(path)
    return f"set response.{path} before the response is returned" if value in ("", False) else ""


def too_few_responses(trace: Trace, service: str, found: int, wanted: int) -> Finding:
    """Return no credit and why a server has not answered often enough."""
    if not trace.requests(service, "grader"):
        return never_asked(trace, service)
    reason = f"{service}: {counted(found, 'response')}, expected at least {max(1, wanted)}"
    fault = first_fault(trace)
    if fault is not None:
        return not_met(f"{fault_sentence(fault)}; {reason}", hint=fault_hint(fault), fault=fault)
    return not_met(reason, {"responses": found}, blocked_by="service_answers_all")


def never_asked(trace: Trace, service: str) -> Finding:
    """Return no credit and why a server could not be asked.

    Raises:
        HarnessError: It was there, and lived.
    """
    fault = first_fault(trace)
    if not trace.service_ends("service", service):
        why = explain_no_server(trace, service)
        return not_met(why.reason, why.evidence, hint=why.hint, blocked_by="service_available")
    if fault is None:
        raise HarnessError(f"{service}: nothing was asked of it, or too late to be answered")
    return not_met(f"{fault_sentence(fault)}; {service} could not be asked", hint=fault_hint(fault), fault=fault)
