"""The check on an output that follows from an input, message by message."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from grader.core.errors import HarnessError
from grader.core.exercise import Finding
from grader.core.quantities import NS_PER_S, DurationNs, seconds
from grader.core.trace import Delivery, Message, Trace
from grader.judging.findings import met, not_met
from grader.judging.paths import NoSuchField, at_path
from grader.judging.rules import FieldRule, Rule, as_rule, breach, broken_rules, told
from grader.judging.silence import (
    explain_no_message,
    explain_no_subscription,
    fault_hint,
    first_fault,
    heard_from_ns,
    student_endpoints,
)
from grader.judging.values import JITTER_NS, published
from grader.judging.wording import counted, fault_sentence, listed, moment, quote, span


@dataclass(frozen=True, slots=True)
class ReactionCase:
    """One kind of input and what is to come of it.

    Attributes:
        when: What the input holds, by field path; the first case that fits is the one that applies.
        then: What the output has to hold, by field path.
        copies: Output field path -> input field path that it has to equal.
        silent: Whether nothing may come at all.
    """

    when: Mapping[str, str | float | bool | FieldRule]
    then: Mapping[str, str | float | bool | FieldRule] = field(default_factory=dict)
    copies: Mapping[str, str] = field(default_factory=dict)
    silent: bool = False

    def rules(self, given: Mapping[str, Any]) -> dict[str, Rule]:
        """Return what the output has to hold after an input."""
        return {**self.then, **{path: _copied(given, source) for path, source in self.copies.items()}}


def _copied(given: Mapping[str, Any], source: str) -> Rule:
    try:
        found = at_path(given, source)
    except NoSuchField:
        raise HarnessError(f"the input has no field {source} to be copied") from None
    if isinstance(found, (list, tuple)):
        return FieldRule(items=tuple(found))
    if isinstance(found, (str, int, float)):
        return FieldRule(equals=found)
    raise HarnessError(f"the field {source} of the input is neither a number nor a text nor a list")


@dataclass(frozen=True, slots=True)
class _Asked:
    """One input, the case it belongs to, and the outputs from it up to the next input."""

    given: Delivery | Message
    case: ReactionCase
    stop_ns: int
    outputs: tuple[Message, ...]


@dataclass(frozen=True, slots=True)
class Reaction:
    """After each input an output comes that fits it: its fields hold what the case of that input asks for.

    The fitting output must come within a time, and no other may follow it until the next input. So a node may answer
    once, or repeat its answer on a timer, or go on with the old one until its next period. Inputs that fit no case are
    not asked about. Every case must have been tried.

    Attributes:
        input: Topic of the inputs.
        output: Topic of the outputs.
        cases: Each with `when`, and `then`, `copies` or `silent`.
        within: How long the output may take.
        tolerance: Largest difference of a number that is given without a tolerance of its own.
    """

    input: str
    output: str
    cases: tuple[ReactionCase, ...]
    within: DurationNs = NS_PER_S
    tolerance: float = 1e-6

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        return f"within {span(self.within)} of each {self.input} a message on {self.output} that fits it"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if every input is answered rightly; the reason names the first that is not."""
        asked = self._asked(trace)
        outputs = published(trace, self.output)
        missing = [case for case in self.cases if not any(a.case is case for a in asked)]
        if missing:
            return self._untried(trace, missing)
        if not outputs and not all(a.case.silent for a in asked):
            return self._silent(trace)
        wrong = [(a, said) for a in asked if (said := self._wrong(trace, a))]
        evidence = {"inputs": len(asked), "outputs": len(outputs), "wrong": len(wrong)}
        if wrong:
            return self._explain(trace, wrong, len(asked), evidence)
        return met(f"{self.output}: right after each of {counted(len(asked), 'input')} on {self.input}", evidence)

    def _asked(self, trace: Trace) -> list[_Asked]:
        jitter_ns = JITTER_NS[trace.clock]
        from_ns = heard_from_ns(trace, self.input)
        given: list[Delivery | Message] = [d for d in trace.deliveries(self.input) if d.t_ns >= from_ns]
        given = [g for g in given or published(trace, self.input) if g.t_ns < trace.stop_ns]
        stops = [*(g.t_ns for g in given), trace.stop_ns + jitter_ns][1:]
        outputs = published(trace, self.output)
        found = []
        for one, stop_ns in zip(given, stops, strict=False):
            case = next((c for c in self.cases if not broken_rules(one.value, c.when)), None)
            last_chance = stop_ns == trace.stop_ns + jitter_ns and stop_ns - one.t_ns <= self.within
            if case is None or last_chance:
                continue
            during = tuple(o for o in outputs if one.t_ns - jitter_ns <= o.t_ns < stop_ns - jitter_ns)
            found.append(_Asked(one, case, stop_ns, during))
        return found

    def _wrong(self, trace: Trace, asked: _Asked) -> str:
        """Return what is wrong with the outputs after an input; empty if nothing is."""
        if asked.case.silent:
            return f"{moment(asked.outputs[0].t_ns)}: a message came, expected none" if asked.outputs else ""
        rules = asked.case.rules(asked.given.value)
        fits = [not broken_rules(o.value, rules, self.tolerance) for o in asked.outputs]
        due_ns = asked.given.t_ns + self.within + JITTER_NS[trace.clock]
        first = next((k for k, fit in enumerate(fits) if fit and asked.outputs[k].t_ns <= due_ns), None)
        if first is None:
            return self._missing(asked, rules, fits)
        spoilt = next((o for o, fit in zip(asked.outputs[first:], fits[first:], strict=True) if not fit), None)
        return "" if spoilt is None else f"right at first, then {self._difference(spoilt, rules)}"

    def _missing(self, asked: _Asked, rules: Mapping[str, Rule], fits: Sequence[bool]) -> str:
        late = next((o for o, fit in zip(asked.outputs, fits, strict=True) if fit), None)
        if late is not None:
            took = seconds(late.t_ns - asked.given.t_ns)
            return f"the right message came after {took:.3f} s, expected within {span(self.within)}"
        if not asked.outputs:
            return f"no message within {span(self.within)}, expected {told(rules)}"
        return self._difference(asked.outputs[-1], rules)

    def _difference(self, output: Message, rules: Mapping[str, Rule]) -> str:
        path = broken_rules(output.value, rules, self.tolerance)[0]
        return f"{moment(output.t_ns)}: {breach(output.value, path, as_rule(rules[path], self.tolerance))}"

    def _explain(
        self, trace: Trace, wrong: Sequence[tuple[_Asked, str]], total: int, evidence: dict[str, Any]
    ) -> Finding:
        asked, said = wrong[0]
        shown = listed([f"{path} = {_short(asked.given.value, path)}" for path in asked.case.when])
        reason = f"{self.output}, after {shown} on {self.input} at {moment(asked.given.t_ns)}: {said}; "
        reason += f"wrong after {len(wrong)} of {counted(total, 'input')}"
        fault = first_fault(trace)
        if fault is not None and not asked.outputs:
            return not_met(f"{reason}; {fault_sentence(fault)}", evidence, hint=fault_hint(fault), fault=fault)
        return not_met(reason, evidence | {"first_wrong_s": seconds(asked.given.t_ns)})

    def _silent(self, trace: Trace) -> Finding:
        heard = [e for e in student_endpoints(trace, "subscription") if e.topic == self.input]
        if not heard and trace.deliveries(self.input) and first_fault(trace) is None:
            return explain_no_subscription(trace, self.input)
        return explain_no_message(trace, self.output)

    def _untried(self, trace: Trace, missing: Sequence[ReactionCase]) -> Finding:
        fault = first_fault(trace)
        case = told(missing[0].when)
        if fault is not None:
            reason = f"{fault_sentence(fault)}; {self.input} with {case} did not come before"
            return not_met(reason, hint=fault_hint(fault), fault=fault)
        if not trace.deliveries(self.input):
            found = explain_no_message(trace, self.input)
            return not_met(found.reason, found.evidence, hint=found.hint, blocked_by="publishes")
        raise HarnessError(f"{self.input}: no input with {case} was published in time")


def _short(value: Mapping[str, Any], path: str) -> str:
    try:
        return quote(str(at_path(value, path)), 60)
    except NoSuchField:
        return "nothing"
