"""Checks on a student's service server: that it exists, that it answers, and the content of its answers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar

from grader.grading.judging.charts import compared_panels
from grader.grading.judging.findings import explain_fault, explain_no_server, first_fault, met, not_met, waiting_for
from grader.grading.judging.plots import Drawing
from grader.grading.judging.series import curve
from grader.grading.judging.service_calls import LATENESS_NS, Call, calls_of
from grader.grading.judging.values import FewSuffice, RuleOrValue, breach, broken_rules, number_at, rules_text
from grader.grading.model.exercise import Finding, ProblemKind, Roles
from grader.grading.model.wording import moment, number, quote, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import (
    NS_PER_S,
    DurationNs,
    FieldFormula,
    FieldOf,
    ServiceType,
    counted,
    seconds,
    within,
)
from grader.runtime.model.trace import Response, Trace

_RETURN_HINT = "a service callback takes (self, request, response) and ends with return response"


@dataclass(frozen=True, slots=True)
class ServiceAvailable:
    """A node of the submission offers a service of a type: it is in the ROS graph, or it has answered.

    Attributes:
        service: Service name as on the wire, e.g. `/add_two_ints`.
        type: Service type, e.g. `example_interfaces/srv/AddTwoInts`.
    """

    roles: ClassVar[Roles] = Roles(serves=("service",))
    service: str
    type: ServiceType

    @property
    def expected(self) -> str:
        return f"the service {self.service} with type {self.type}"

    def judge(self, trace: Trace) -> Finding:
        answers = [r for r in trace.responses(self.service, "student") if r.type == self.type]
        ends = [e for e in trace.service_ends("service", self.service) if e.type == self.type]
        # A response proves the server even if the graph was never looked at while it was there.
        if not answers and all(end.unusual for end in ends):
            return explain_no_server(trace, self.service, self.type)
        node = quote(ends[0].node) if ends else "a node"
        evidence = {"service": self.service, "type": self.type, "responses": len(answers)}
        return met(f"{self.service}: {node} offers it with type {self.type}", evidence)


@dataclass(frozen=True, slots=True)
class ServiceAnswersAll:
    """A student's server answers every request of the grader's clients, each within a time.

    Requests that are not yet due when the recording ends are left out.

    Attributes:
        service: Service name as on the wire.
        within: Longest time to a response.
        at_least: Number of requests needed for a judgement.
    """

    roles: ClassVar[Roles] = Roles(serves=("service",))
    service: str
    within: DurationNs = NS_PER_S
    at_least: int = 1

    @property
    def expected(self) -> str:
        return f"a response to every request on {self.service} within {number(seconds(self.within))} s"

    def judge(self, trace: Trace) -> Finding:
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
            took = f"the response took {seconds(first.response.t_ns - first.request.t_ns):.3f} s"
        reason = f"{moment(first.request.t_ns)}, {self.service}: {took}, expected one within {span(self.within)}; "
        reason += f"late or unanswered: {len(unanswered)} of {counted(len(calls), 'request')}"
        known = dict(evidence) | {"first_unanswered_s": seconds(first.request.t_ns)}
        hint = "" if any(c.response for c in calls) else _RETURN_HINT
        problem = ProblemKind.NO_ANSWER if first.response is None else ProblemKind.TOO_LATE
        return explain_fault(trace, reason, known, last=True) or not_met(reason, known, hint=hint, problem=problem)

    def drawing(self, trace: Trace) -> Drawing:  # noqa: ARG002 - as every check
        """Return the calls with the time that each took."""
        return Drawing(services=(self.service,), within_ns=self.within)


def _due(call: Call, trace: Trace, late_ns: int) -> bool:
    return call.response is not None or call.request.t_ns + late_ns < trace.stop_ns


@dataclass(frozen=True, slots=True)
class ServiceResponse(FewSuffice):
    """Every response of a student's server has the expected value in each named field.

    Whether every request has a response is judged by `service_answers_all`.

    Attributes:
        service: Service name as on the wire.
        fields: What is expected by field path: a value, or `{equals, tolerance, low, high, pattern, example}`.
        at_least: Number of responses needed for a judgement.
    """

    roles: ClassVar[Roles] = Roles(serves=("service",))
    service: str
    fields: Annotated[Mapping[str, RuleOrValue], FieldOf("service", "_Response")]
    at_least: int = 1

    @property
    def expected(self) -> str:
        return f"in every response of {self.service}: {rules_text(self.fields)}"

    def judge(self, trace: Trace) -> Finding:
        found = [r for r in trace.responses(self.service, "student") if r.t_ns < trace.stop_ns]
        if len(found) < max(1, self.at_least):
            return too_few_responses(trace, self.service, len(found), self.at_least)
        # Counted from 1, as people count responses.
        wrong = [(k, r) for k, r in enumerate(found, 1) if broken_rules(r.value, self.fields)]
        evidence = {"service": self.service, "responses": len(found), "wrong": len(wrong)}
        if not wrong:
            return met(f"{self.service}: {rules_text(self.fields)} in {counted(len(found), 'response')}", evidence)
        place, first = wrong[0]
        path = broken_rules(first.value, self.fields)[0]
        reason = f"{moment(first.t_ns)}, {self.service}: {breach(first.value, path, self.fields[path])} in response "
        reason += f"{place}; wrong in {len(wrong)} of {counted(len(found), 'response')}"
        known = evidence | {"field": path, "first_wrong_s": seconds(first.t_ns)}
        return not_met(reason, known, hint=_hint(first, path), problem=ProblemKind.WRONG_VALUE)

    def drawing(self, trace: Trace) -> Drawing:  # noqa: ARG002 - as every check
        """Return the calls and the fields of the responses."""
        return Drawing(services=(self.service,), rules=self.fields)


def _hint(response: Response, path: str) -> str:
    """Return a hint if a field was left at its default; empty otherwise."""
    value = response.value.get(path)
    return f"set response.{path} before the response is returned" if value in ("", False) else ""


def too_few_responses(trace: Trace, service: str, found: int, wanted: int) -> Finding:
    """Return no credit with the reason why a server gave too few responses."""
    if not trace.requests(service, "grader"):
        return never_asked(trace, service)
    reason = f"{service}: {counted(found, 'response')}, expected at least {max(1, wanted)}"
    return explain_fault(trace, reason) or not_met(
        reason, {"responses": found}, blocked_by="service_answers_all", problem=ProblemKind.TOO_FEW
    )


def never_asked(trace: Trace, service: str) -> Finding:
    """Return no credit with the reason why a server could not be called.

    Raises:
        HarnessError: The server existed and was running.
    """
    # Also if there is none at all: `all` of nothing is true.
    if all(end.unusual for end in trace.service_ends("service", service)):
        return waiting_for("service_available", explain_no_server(trace, service))
    if crashed := explain_fault(trace, f"{service} could not be called"):
        return crashed
    raise HarnessError(f"{service}: it was not called, or too late for a response")


#: Numbers in the evidence, at most.
_MOST_IN_EVIDENCE = 250


@dataclass(frozen=True, slots=True)
class _Answer:
    """A response with the number read from it and the expected one; `got` is None if no number could be read."""

    response: Response
    got: float | None
    wanted: float


@dataclass(frozen=True, slots=True)
class ServiceFunction(FewSuffice):
    """A number in every response of a student's server follows a formula of the fields of its request.

    The formula may use the request's numeric fields, such as `a` or `pose.x`, numbers, pi, + - * / % **, and sin, cos,
    tan, exp, sqrt, abs and floor. Requests for which it has no value are left out. Whether every request has a response
    is judged by `service_answers_all`.

    Attributes:
        service: Service name as on the wire.
        field: Path of the number in the response.
        formula: What it must be, e.g. `a + b`.
        tolerance: Largest difference.
        at_least: Number of responses needed for a judgement.
    """

    roles: ClassVar[Roles] = Roles(serves=("service",))
    service: str
    field: Annotated[str, FieldOf("service", "_Response")]
    formula: Annotated[FieldFormula, FieldOf("service", "_Request", formula=True)]
    tolerance: float = 1e-6
    at_least: int = 1

    @property
    def expected(self) -> str:
        return f"{self.field} = {self.formula} in every response of {self.service}"

    def judge(self, trace: Trace) -> Finding:
        answers = self._answers(calls_of(trace, self.service, "grader"))
        if len(answers) < max(1, self.at_least):
            return too_few_responses(trace, self.service, len(answers), self.at_least)
        wrong = [a for a in answers if a.got is None or not within(a.got, a.wanted, self.tolerance)]
        evidence: dict[str, object] = {
            "service": self.service,
            "responses": len(answers),
            "wrong": len(wrong),
            "numbers": [a.got for a in answers[:_MOST_IN_EVIDENCE]],
        }
        if not wrong:
            reason = f"{self.service}: {self.field} = {self.formula} in {counted(len(answers), 'response')}"
            return met(f"{reason}, such as {number(answers[-1].wanted)}", evidence)
        first = wrong[0]
        found = "no number" if first.got is None else number(first.got)
        brief = f"{self.service}: {self.field} is {found}, expected {self.formula} = {number(first.wanted)}"
        reason = f"{moment(first.response.t_ns)}, {brief}; wrong in {len(wrong)} of "
        reason += counted(len(answers), "response")
        # Only if all of them are 0 or missing: one other number shows that the field is set.
        hint = f"set response.{self.field} before the response is returned" if not any(a.got for a in answers) else ""
        known = evidence | {"first_wrong_s": seconds(first.response.t_ns)}
        return not_met(reason, known, hint=hint, problem=ProblemKind.WRONG_VALUE, brief=brief)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the calls, and the number in each response with the expected one."""
        answers = self._answers(calls_of(trace, self.service, "grader"))
        compared = [(a.response.t_ns, a.got, a.wanted) for a in answers]
        panels = compared_panels(f"{self.field} of the response", compared, self.tolerance, "the responses")
        return Drawing(services=(self.service,), panels=panels)

    def _answers(self, calls: Sequence[Call]) -> list[_Answer]:
        wanted = curve(self.formula, of_fields=True)
        found = []
        for call in calls:
            given = {name: number_at(call.request.value, name) for name in wanted.names}
            known = {name: value for name, value in given.items() if value is not None}
            # A field that is missing or no number, and a division by zero, have no answer that could be right or wrong.
            value = wanted.of(known) if len(known) == len(given) else math.nan
            if call.response is not None and math.isfinite(value):
                found.append(_Answer(call.response, number_at(call.response.value, self.field), value))
        return found
