"""The check on a controller that switches at a threshold, tested with scripted numbers."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from grader.core.dataclass import dataclass
from grader.core.errors import HarnessError
from grader.core.exercise import Finding, Problem, ProblemKind, Roles
from grader.core.quantities import NS_PER_MS, FieldOf, counted, seconds, within
from grader.core.trace import ClockKind, Endpoint, Trace
from grader.judging.facts import AnswerFacts, AnswerRow
from grader.judging.findings import explain_fault, explain_no_message, faulted, first_fault, met, not_met
from grader.judging.plots import Drawing, threshold_drawing
from grader.judging.series import lag_ns
from grader.judging.values import (
    EXACT,
    Held,
    Reading,
    delivered_numbers,
    heard_from_ns,
    held,
    last_of_instant,
    published,
    published_numbers,
    student_endpoints,
)
from grader.judging.wording import in_unit, moment, number, numbers, quote, span

#: How long after a new input the answer to the previous one is still accepted.
_GRACE_NS = 300 * NS_PER_MS
#: The same for a controller that answers on a timer: one of its periods, at most this.
_LONGEST_GRACE_NS = 1_200 * NS_PER_MS
#: A controller that publishes at least this often repeats itself; silence then means that it stopped.
_REPEATING_NS = 1_200 * NS_PER_MS
#: With this many answers, and this share of them at the instant of an input, the controller does not use a timer.
_FEWEST_AT_ONCE, _SHARE_AT_ONCE = 10, 0.97


@dataclass(frozen=True, slots=True)
class _Violation:
    """A held input with a wrong answer; `got` is None if there was no answer."""

    t_ns: int
    held: Held
    got: float | None


@dataclass(frozen=True, slots=True)
class ThresholdResponse:
    """A controller alone answers held inputs: one value above a threshold, another at or below it.

    It may answer each input, publish only on change, or publish on a timer of up to a second. After a new input the old
    answer is accepted for a while, until the new one has come, and no other. A controller that answers at the instant
    of an input must answer that input, and not the previous one.

    Attributes:
        input: Topic that the numbers are published on.
        output: Topic of the answers.
        threshold: Where the answer changes; the threshold itself is not above.
        above: Answer expected above the threshold.
        otherwise: Answer expected at or below it.
        side: The side that this criterion judges.
        input_field: Path of the number in the input; by default `data`, or else its only number.
        output_field: The same in the answers.
        unit: Unit of the input, for reasons and charts, e.g. `m`.
    """

    roles: ClassVar[Roles] = Roles(hears=("input",), speaks=("output",))
    input: str
    output: str
    threshold: float
    above: float
    otherwise: float
    side: Literal["above", "at_or_below"]
    input_field: Annotated[str, FieldOf("input")] = ""
    output_field: Annotated[str, FieldOf("output")] = ""
    unit: str = ""

    @property
    def expected(self) -> str:
        limit = f"{number(self.threshold)}{in_unit(self.unit)}"
        side, answer = ("above", self.above) if self.side == "above" else ("at or below", self.otherwise)
        return f"{number(answer)} on {self.output} for every {self.input} {side} {limit}"

    def judge(self, trace: Trace) -> Finding:
        inputs = held(trace, self.input, self.input_field, heard_from_ns=heard_from_ns(trace, self.input))
        messages = published(trace, self.output)
        if not messages:
            return self._once(self._silent(trace))
        mine = [h for h in inputs if (h.value > self.threshold) == (self.side == "above")]
        if not mine:
            return self._nothing_asked(trace)
        every = published_numbers(trace, self.output, self.output_field)
        answers = last_of_instant(every)
        if not answers:
            type_ = messages[0].type
            reason, problem = f"{self.output}: {quote(type_)} carries no number", ProblemKind.NO_NUMBER
            return self._once(not_met(reason, {"type": type_}, problem=problem))
        grace_ns = _grace(answers)
        prompt = (
            answers if _answers_at_once(delivered_numbers(trace, self.input, self.input_field), trace, answers) else ()
        )
        found = [self._violation(h, every, trace, grace_ns) or self._behind(h, prompt) for h in mine]
        violations = [v for v in found if v is not None]
        evidence = self._evidence(inputs, answers)
        if violations:
            wrong = self._violated(trace, violations, inputs, every, evidence)
            return replace(wrong, facts=self._facts(inputs, answers, wrong.problem))
        side = "above" if self.side == "above" else "at or below"
        reason = (
            f"{self.output}: {number(self._expected(mine[0].value))} for each of {counted(len(mine), 'value')} {side} "
        )
        reason += f"{number(self.threshold)}{in_unit(self.unit)} ({numbers(h.value for h in mine)})"
        return met(reason, evidence)

    def _once(self, finding: Finding) -> Finding:
        """Return a finding that is the same for both sides, so that the second side waits for the first."""
        return replace(finding, blocked_by="threshold_response")

    def _expected(self, value: float) -> float:
        return self.above if value > self.threshold else self.otherwise

    def _right(self, got: float, value: float) -> bool:
        return within(got, self._expected(value), EXACT)

    def _violation(self, asked: Held, answers: Sequence[Reading], trace: Trace, grace_ns: int) -> _Violation | None:
        during = [a for a in answers if asked.start_ns <= a.t_ns < asked.stop_ns]
        wrong = [a for a in during if a.t_ns > asked.start_ns + grace_ns and not self._right(a.value, asked.value)]
        if wrong:
            first = next(a for a in during if not self._right(a.value, asked.value))
            return _Violation(first.t_ns, asked, first.value)
        if asked.stop_ns == trace.stop_ns and asked.stop_ns - asked.start_ns <= grace_ns:
            return None  # the observation ended before an answer was due
        before = [a for a in answers if a.t_ns < asked.start_ns]
        if during:
            bad = self._unsettled(asked, during, before)
            return None if bad is None else _Violation(bad.t_ns, asked, bad.value)
        if not before or _repeats(last_of_instant(answers)) or any(f.t_ns <= asked.start_ns for f in trace.faults()):
            return _Violation(asked.start_ns, asked, None)
        carried = before[-1].value
        return None if self._right(carried, asked.value) else _Violation(asked.start_ns, asked, carried)

    def _behind(self, asked: Held, prompt: Sequence[Reading]) -> _Violation | None:
        """Return a violation if a prompt controller still answered the previous input; None otherwise."""
        at_once = next((a for a in prompt if a.t_ns == asked.start_ns), None)
        if at_once is None or self._right(at_once.value, asked.value):
            return None
        return _Violation(at_once.t_ns, asked, at_once.value)

    def _unsettled(self, asked: Held, during: Sequence[Reading], before: Sequence[Reading]) -> Reading | None:
        """Return the first answer that is neither the old one, before the new one has come, nor the right one."""
        old = (before or during)[-1 if before else 0].value
        came = False
        for answer in during:
            if self._right(answer.value, asked.value):
                came = True
            elif came or not within(answer.value, old, EXACT):
                return answer
        return None if came else during[-1]

    def _evidence(self, inputs: Sequence[Held], answers: Sequence[Reading]) -> dict[str, object]:
        rows = [[seconds(h.start_ns), h.value, _state(h, answers), self._expected(h.value)] for h in inputs]
        return {"columns": ["t_s", "input", "answer", "expected"], "rows": rows, "answers": len(answers)}

    def _facts(self, inputs: Sequence[Held], answers: Sequence[Reading], problem: Problem | None) -> AnswerFacts:
        rows = (AnswerRow(h.value, _state(h, answers), self._expected(h.value)) for h in inputs)
        return AnswerFacts(tuple(rows), late=problem is not None and problem.kind is ProblemKind.BEHIND)

    def _violated(
        self,
        trace: Trace,
        violations: Sequence[_Violation],
        inputs: Sequence[Held],
        every: Sequence[Reading],
        evidence: dict[str, object],
    ) -> Finding:
        first = violations[0]
        answers = last_of_instant(every)
        unit = in_unit(self.unit)
        wanted = number(self._expected(first.held.value))
        found = "no answer" if first.got is None else number(first.got)
        brief = f"{self.output}: {found} for {number(first.held.value)}{unit} on {self.input}, expected {wanted}"
        reason = f"{moment(first.t_ns)}, {brief}"
        fault = first_fault(trace)
        if fault is not None and first.got is None:
            return faulted(fault, reason, evidence, last=True)
        both = {a.value for a in every if a.t_ns == first.t_ns and first.got is not None}
        if len(both) > 1:
            cause = f"; {' and '.join(map(number, sorted(both)))} are published at one instant"
            hint = f"publish one answer to each number on {self.input}"
            return not_met(reason + cause, evidence, hint=hint, problem=ProblemKind.CONTRADICTION, brief=brief)
        lag = lag_ns([Reading(h.start_ns, h.value) for h in inputs], answers, self._right)
        if lag is not None:
            reason += f"; the answers are right for what was published {span(lag)} before"
            hint = f"answer the newest message on {self.input}"
            known = evidence | {"lag_s": seconds(lag)}
            return not_met(reason, known, hint=hint, problem=ProblemKind.BEHIND, brief=brief)
        cause, hint = self._diagnosis(violations, inputs, answers)
        kind = ProblemKind.NO_ANSWER if first.got is None else ProblemKind.WRONG_ANSWER
        return not_met(reason + cause, evidence, hint=hint, problem=kind, brief=brief)

    def _diagnosis(
        self, violations: Sequence[_Violation], inputs: Sequence[Held], answers: Sequence[Reading]
    ) -> tuple[str, str]:
        """Return an addition to the reason, and a hint; both may be empty."""
        limit = f"{number(self.threshold)}{in_unit(self.unit)}"
        rule = f"publish {number(self.above)} above {limit} and {number(self.otherwise)} at or below it"
        logic = self._logic(inputs, answers)
        if logic:
            return logic, rule
        mistaken = [v.held.value for v in violations]
        if self.side == "at_or_below" and all(v == self.threshold for v in mistaken):
            return "", f"{limit} itself is not above {limit}: compare with > and not with >="
        low = all(v.got is not None and within(v.got, self.otherwise, EXACT) for v in violations)
        near = self.side == "above" and low and all(0 < v - self.threshold <= 1 for v in mistaken)
        if near and any(h.value > self.threshold + 1 for h in inputs):
            return "", f"every value above {limit} counts, however little: compare it as it is, without rounding"
        return "", rule

    def _logic(self, inputs: Sequence[Held], answers: Sequence[Reading]) -> str:
        """Return the rule that the answers follow instead of the threshold; empty if that is unclear."""
        if self._inverted(inputs, answers):
            return "; the answers are the wrong way round for every value"
        if len({a.value for a in answers}) == 1:
            return f"; {number(answers[0].value)} is the only answer ever given"
        return f"; once at {number(self.above)} it stays there" if self._stays_on(answers) else ""

    def _stays_on(self, answers: Sequence[Reading]) -> bool:
        values = [a.value for a in answers]
        after = values[values.index(self.above) :] if self.above in values else []
        return len(after) > 1 and all(v == self.above for v in after)

    def _inverted(self, inputs: Sequence[Held], answers: Sequence[Reading]) -> bool:
        states = ((asked.value, _state(asked, answers)) for asked in inputs)
        pairs = [(value, got) for value, got in states if got is not None]
        flipped = {self.above: self.otherwise, self.otherwise: self.above}
        both = {v > self.threshold for v, _ in pairs} == {True, False}
        # exactly at the threshold, inverted logic may give either answer
        away = [(v, got) for v, got in pairs if v != self.threshold]
        return both and all(within(got, flipped[self._expected(v)], EXACT) for v, got in away)

    def _silent(self, trace: Trace) -> Finding:
        """Return why the controller never answered, and whether it had subscribed."""
        why = explain_no_message(trace, self.output)
        ends = student_endpoints(trace, "subscription", self.input)
        if first_fault(trace) is not None or why.evidence.get("messages"):
            return why
        if not ends:
            others = [e.topic for e in student_endpoints(trace, "subscription")]
            instead = f"; it subscribes to {quote(others[0])}" if others else ""
            reason, hint = f"{why.reason}; nothing subscribes to {self.input}{instead}", f"subscribe to {self.input}"
            return not_met(reason, why.evidence, hint=hint, problem=ProblemKind.ABSENT)
        reason = f"{why.reason}; {quote(ends[0].node)} subscribes to {self.input}{_deaf(ends)}"
        return not_met(reason, why.evidence, problem=why.problem)

    def _nothing_asked(self, trace: Trace) -> Finding:
        if crashed := explain_fault(trace, f"no answer on {self.output}"):
            return crashed
        raise HarnessError(f"{self.input}: no value on this side of {number(self.threshold)} was published")

    def drawing(self, trace: Trace) -> Drawing:
        """Return the inputs of the controller with its threshold, and its answers with the expected ones."""
        expected = [Reading(h.start_ns, self._expected(h.value)) for h in held(trace, self.input, self.input_field)]
        expected += [Reading(trace.stop_ns, r.value) for r in expected[-1:]]
        return threshold_drawing(self, expected)


def _deaf(subscriptions: Sequence[Endpoint]) -> str:
    latched = all(e.durability == "transient_local" for e in subscriptions)
    return " with transient_local durability, which a volatile publisher does not offer" if latched else ""


def _answers_at_once(sent: Sequence[Reading], trace: Trace, answers: Sequence[Reading]) -> bool:
    """Return whether a controller answers each input at its own instant, which only virtual time can tell."""
    asked = {r.t_ns for r in sent}
    prompt = sum(a.t_ns in asked for a in answers)
    enough = trace.clock is ClockKind.VIRTUAL and prompt >= _FEWEST_AT_ONCE and 2 * prompt >= len(asked)
    return enough and prompt >= _SHARE_AT_ONCE * len(answers)


def _state(asked: Held, answers: Sequence[Reading]) -> float | None:
    """Return the last answer before the end of an input; None before the first answer."""
    return next((a.value for a in reversed(answers) if a.t_ns < asked.stop_ns), None)


def _gaps(answers: Sequence[Reading]) -> list[int]:
    return [b.t_ns - a.t_ns for a, b in pairwise(answers)]


def _grace(answers: Sequence[Reading]) -> int:
    """Return how long after a new input the old answer may still come: one period of a timer-driven controller."""
    gaps = _gaps(answers)
    period = round(statistics.median(gaps)) if gaps else 0
    return max(_GRACE_NS, min(period, _LONGEST_GRACE_NS))


def _repeats(answers: Sequence[Reading]) -> bool:
    """Return whether the controller repeats its answers, instead of publishing only on change."""
    gaps = _gaps(answers)
    return bool(gaps) and statistics.median(gaps) <= _REPEATING_NS
