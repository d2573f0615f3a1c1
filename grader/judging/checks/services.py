"""Checks on a student's service server: that it exists, that it answers, and the content of its answers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby, pairwise
from typing import Annotated

from grader.core.chart import Look, Panel, Tone
from grader.core.dataclass import dataclass
from grader.core.errors import HarnessError
from grader.core.exercise import Finding, ProblemKind
from grader.core.quantities import (
    NS_PER_S,
    DurationNs,
    FieldFormula,
    FieldOf,
    Pattern,
    ServiceType,
    counted,
    seconds,
    within,
)
from grader.core.trace import Response, Trace
from grader.judging.charts import expected_series, series
from grader.judging.findings import explain_fault, explain_no_server, first_fault, met, not_met, waiting_for
from grader.judging.logs.outputs import number_in
from grader.judging.plots import Drawing
from grader.judging.series import curve
from grader.judging.service_calls import LATENESS_NS, Call, calls_of
from grader.judging.values import FewSuffice, Reading, RuleOrValue, breach, broken_rules, number_at, rules_text, text_at
from grader.judging.wording import listed, moment, number, numbers, quote, span

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

    @property
    def expected(self) -> str:
        return f"the service {self.service} with type {self.type}"

    def judge(self, trace: Trace) -> Finding:
        answers = [r for r in trace.responses(self.service, "student") if r.type == self.type]
        ends = [e for e in trace.service_ends("service", self.service) if e.type == self.type]
        if not answers and not ends:
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
    if not trace.service_ends("service", service):
        return waiting_for("service_available", explain_no_server(trace, service))
    if crashed := explain_fault(trace, f"{service} could not be called"):
        return crashed
    raise HarnessError(f"{service}: it was not called, or too late for a response")


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
        hint = f"set response.{self.field} before the response is returned" if not any(a.got for a in answers) else ""
        known = evidence | {"first_wrong_s": seconds(first.response.t_ns)}
        return not_met(reason, known, hint=hint, problem=ProblemKind.WRONG_VALUE, brief=brief)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the calls, and the number in each response with the expected one."""
        return _answers_drawing(self, self._answers(calls_of(trace, self.service, "grader")))

    def _answers(self, calls: Sequence[Call]) -> list[_Answer]:
        wanted = curve(self.formula, of_fields=True)
        found = []
        for call in calls:
            given = {name: number_at(call.request.value, name) for name in wanted.names}
            known = {name: value for name, value in given.items() if value is not None}
            value = wanted.of(known) if len(known) == len(given) else math.nan
            if call.response is not None and math.isfinite(value):
                found.append(_Answer(call.response, number_at(call.response.value, self.field), value))
        return found


_MOST_IN_EVIDENCE = 250
_KEEP_HINT = "keep the number in an attribute of the node, self.name, and change it there at each call"


@dataclass(frozen=True, slots=True)
class _Answer:
    """A response with the number read from it and the expected one; `got` is None if no number could be read."""

    response: Response
    got: float | None
    wanted: float


@dataclass(frozen=True, slots=True)
class ServiceSequence(FewSuffice):
    """A number in the responses of a student's server changes by one step with each call, whoever calls.

    The number is read from a numeric field, or from a text: its first number, or what `pattern` finds. Calls of one
    instant may be answered in any order, and so may those to a server that lags behind. The rest of the text is judged
    by `service_response`.

    Attributes:
        service: Service name as on the wire.
        first: Number in the first response.
        step: Difference from one response to the next; negative for a falling number.
        field: Path of the field with the number.
        floor: Smallest number (for a rising number: largest).
        reset_to: Number that replaces the next one beyond `floor`; if left out, the last number stays.
        pattern: Regular expression whose first group, or whole match, is the number in a text.
        tolerance: Largest difference.
        at_least: Number of responses needed for a judgement.
    """

    service: str
    first: float
    step: float
    field: Annotated[str, FieldOf("service", "_Response")] = "message"
    floor: float | None = None
    reset_to: float | None = None
    pattern: Pattern | None = None
    tolerance: float = 1e-6
    at_least: int = 3

    @property
    def expected(self) -> str:
        text = (
            f"{self.field} of {self.service} is {number(self.first)} first and changes by {number(self.step)} each time"
        )
        again = "" if self.reset_to is None else f"; a number beyond it becomes {number(self.reset_to)}"
        return text + (f", not beyond {number(self.floor)}{again}" if self.floor is not None else "")

    def judge(self, trace: Trace) -> Finding:
        calls = calls_of(trace, self.service, "grader")
        answered = sorted((c for c in calls if c.response is not None), key=_answered_ns)
        if len(answered) < max(1, self.at_least):
            return too_few_responses(trace, self.service, len(answered), self.at_least)
        # A server that lags behind may lose requests, or process them in another order.
        orders = (self._answers(calls, lambda c: c.request.t_ns), self._answers(answered, _answered_ns))
        answers = min(orders, key=lambda order: len(self._wrong(order)))
        wrong = self._wrong(answers)
        got = [a.got for a in answers]
        evidence: dict[str, object] = {
            "service": self.service,
            "responses": len(answers),
            "numbers": got[:_MOST_IN_EVIDENCE],
            "wrong": len(wrong),
        }
        if wrong:
            return self._differs(answers, wrong[0], evidence)
        shown = ", ".join(number(a.wanted) for a in answers[:3])
        reason = f"{self.service}: {counted(len(answers), 'response')} in the right order: {shown}"
        return met(f"{reason}, ... {number(answers[-1].wanted)}", evidence)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the calls, and the number in each response with the expected one."""
        calls = [c for c in calls_of(trace, self.service, "grader") if c.response is not None]
        return _answers_drawing(self, self._answers(calls, _answered_ns))

    def _wrong(self, answers: Sequence[_Answer]) -> list[int]:
        return [k for k, a in enumerate(answers) if a.got is None or not within(a.got, a.wanted, self.tolerance)]

    def _answers(self, calls: Sequence[Call], instant: Callable[[Call], int]) -> list[_Answer]:
        """Return the responses in the order of their calls; within one instant, in the order of their numbers."""
        wanted = self._sequence()
        found: list[_Answer] = []
        for _, group in groupby(calls, key=instant):
            together = list(group)
            values = [next(wanted) for _ in together]
            responses = [c.response for c in together if c.response is not None]
            answers = [self._answer(r, values) for r in responses]
            found += sorted(answers, key=lambda a: -a.wanted if self.step < 0 else a.wanted)
        return found

    def _answer(self, response: Response, wanted: list[float]) -> _Answer:
        """Return the answer with its expected number, removed from the expected numbers of its instant."""
        got = self._read(response)
        fitting = (k for k, w in enumerate(wanted) if got is not None and within(got, w, self.tolerance))
        return _Answer(response, got, wanted.pop(next(fitting, 0)))

    def _sequence(self) -> Iterator[float]:
        """Yield the expected numbers, rounded to prevent accumulating errors."""
        value = self.first
        while True:
            yield value
            following = round(value + self.step, 9)
            rest = value if self.reset_to is None else self.reset_to
            value = rest if self._beyond(following) else following

    def _beyond(self, value: float) -> bool:
        if self.floor is None:
            return False
        return value < self.floor - 1e-9 if self.step < 0 else value > self.floor + 1e-9

    def _read(self, response: Response) -> float | None:
        direct = number_at(response.value, self.field)
        if direct is not None:
            return direct
        text = text_at(response.value, self.field)
        return None if text is None else number_in(text, self.pattern)

    def _differs(self, answers: Sequence[_Answer], place: int, evidence: dict[str, object]) -> Finding:
        first = answers[place]
        found = self._found(first)
        before = f" after {number(answers[place - 1].wanted)}" if place else ""
        reason = f"{moment(first.response.t_ns)}, {self.service}: {found}{before} in response {place + 1}, "
        reason += f"expected {number(first.wanted)}"
        cause, hint = self._instead([a.got for a in answers], place)
        known = evidence | {"first_wrong": place + 1, "first_wrong_s": seconds(first.response.t_ns)}
        return not_met(f"{reason}; {cause}" if cause else reason, known, hint=hint, problem=ProblemKind.WRONG_VALUE)

    def _found(self, answer: _Answer) -> str:
        if answer.got is not None:
            return number(answer.got)
        text = text_at(answer.response.value, self.field)
        return f"no field {self.field} with a number" if text is None else f"no number in {quote(text, 60)!r}"

    def _instead(self, got: Sequence[float | None], place: int) -> tuple[str, str]:
        """Return a clause about what the numbers do instead, and a hint; both empty if unclear."""
        values = [v for v in got if v is not None]
        if len(values) < max(3, len(got)):
            return "", ""
        if len(set(values)) == 1:
            return f"it is {number(values[0])} in every response", _KEEP_HINT
        steps = [b - a for a, b in pairwise(values[: max(place + 1, 4)])]
        usual = steps[0]
        if usual == 0 or not all(within(s, usual, self.tolerance) for s in steps):
            return self._repeats(values)
        if not within(usual, self.step, self.tolerance):
            return f"it changes by {number(usual)} with each call, expected {number(self.step)}", ""
        if within(values[0], self.first - self.step, self.tolerance):
            return (
                "the steps are right, but each response has the old number",
                "change the number first, then answer",
            )
        return (f"the steps are right, but the first number is {number(values[0])}", "") if place == 0 else ("", "")

    def _repeats(self, values: Sequence[float]) -> tuple[str, str]:
        again = [a == b for a, b in pairwise(values)]
        if sum(again) >= 0.4 * len(again):
            return f"numbers are repeated ({numbers(values[:4])}, ...)", _KEEP_HINT
        return "", ""


def _answered_ns(call: Call) -> int:
    return call.request.t_ns if call.response is None else call.response.t_ns


def _answers_drawing(check: ServiceFunction | ServiceSequence, answers: Sequence[_Answer]) -> Drawing:
    """Return the calls, and the number in each response with the expected one."""
    if not answers:
        return Drawing(services=(check.service,))
    rows = [expected_series([Reading(a.response.t_ns, a.wanted) for a in answers])]
    read = [(a, a.got) for a in answers if a.got is not None]
    wrong = len(answers) - len(read)
    for name, tone, right in (("right", Tone.GOOD, True), ("wrong", Tone.BAD, False)):
        some = [(seconds(a.response.t_ns), got) for a, got in read if within(got, a.wanted, check.tolerance) is right]
        rows += [series(name, some, look=Look.DOTS, tone=tone)] if some else []
        wrong += 0 if right else len(some)
    said = f"Numbers in the responses: {listed([number(got) for _, got in read], 6)}; {wrong} of {len(answers)} wrong."
    panel = Panel(f"{check.field} of the response", "", tuple(rows))
    return Drawing(services=(check.service,), panels=((panel, said),))
