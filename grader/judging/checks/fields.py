"""Checks on the fields of the messages on a topic: what they equal, where they lie, and which way they go."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

from grader.core.exercise import Finding
from grader.core.quantities import SLACK, seconds
from grader.core.trace import Message, Trace
from grader.judging.findings import met, not_met
from grader.judging.paths import number_at
from grader.judging.rules import FieldRule, as_rule, breach, broken_rules, told
from grader.judging.silence import explain_no_message, fault_hint, first_fault
from grader.judging.values import published
from grader.judging.wording import counted, fault_sentence, moment, number, quote


@dataclass(frozen=True, slots=True)
class FieldEqual:
    """Every message on a topic holds what is expected in each field named: numbers, texts, truth values or lists.

    Attributes:
        topic: Topic name as on the wire.
        fields: What is expected by field path: a value, or `{equals, items, tolerance, low, high, pattern, example}`.
        tolerance: Largest difference of a number that is given without a tolerance of its own.
        at_least: How many messages there must be to tell.
    """

    topic: str
    fields: Mapping[str, str | float | bool | FieldRule]
    tolerance: float = 1e-6
    at_least: int = 1

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        return f"{told(self.fields)} in every message on {self.topic}"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if no message differs; the reason names the first that does."""
        messages = published(trace, self.topic)
        if len(messages) < max(1, self.at_least):
            return too_few_messages(trace, self.topic, len(messages), self.at_least)
        wrong = [m for m in messages if broken_rules(m.value, self.fields, self.tolerance)]
        evidence = {"topic": self.topic, "messages": len(messages), "wrong": len(wrong)}
        if not wrong:
            return met(f"{self.topic}: {told(self.fields)} in {counted(len(messages), 'message')}", evidence)
        path = broken_rules(wrong[0].value, self.fields, self.tolerance)[0]
        clause = breach(wrong[0].value, path, as_rule(self.fields[path], self.tolerance))
        reason = f"{moment(wrong[0].t_ns)}, {self.topic}: {clause}; wrong in {len(wrong)} of "
        reason += counted(len(messages), "message")
        return not_met(reason, evidence | {"field": path, "first_wrong_s": seconds(wrong[0].t_ns)})


@dataclass(frozen=True, slots=True)
class FieldInRange:
    """A number in every message on a topic lies in a range, its edges inside; NaN lies in none.

    Attributes:
        topic: Topic name as on the wire.
        low: Smallest value allowed; none if left out.
        high: Largest value allowed; none if left out.
        field: Path of the number.
        at_least: How many messages there must be to tell.
    """

    topic: str
    low: float | None = None
    high: float | None = None
    field: str = "data"
    at_least: int = 1

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        return f"{self.field} {FieldRule(low=self.low, high=self.high).wanted} in every message on {self.topic}"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if no value is outside; the reason names the first that is."""
        messages = published(trace, self.topic)
        if len(messages) < max(1, self.at_least):
            return too_few_messages(trace, self.topic, len(messages), self.at_least)
        values = _numbers(messages, self.field)
        if isinstance(values, Finding):
            return values
        rule = FieldRule(low=self.low, high=self.high)
        outside = [(m, v) for m, v in zip(messages, values, strict=True) if not rule.allows(v)]
        evidence: dict[str, Any] = {"messages": len(values), "outside": len(outside)}
        evidence |= {"min": min(values), "max": max(values)}
        if not outside:
            reason = f"{self.topic}: {self.field} from {number(min(values))} to {number(max(values))} in "
            return met(f"{reason}{counted(len(values), 'message')}, expected {rule.wanted}", evidence)
        message, value = outside[0]
        reason = f"{moment(message.t_ns)}, {self.topic}: {self.field} is {number(value)}, expected {rule.wanted}; "
        reason += f"{len(outside)} of {counted(len(values), 'value')} lie outside"
        return not_met(reason, evidence | {"first_outside_s": seconds(message.t_ns)})


@dataclass(frozen=True, slots=True)
class FieldMonotone:
    """A number on a topic only rises, or only falls, from each message to the next.

    Attributes:
        topic: Topic name as on the wire.
        direction: `rising` or `falling`.
        field: Path of the number.
        strictly: Whether equal neighbours are a mistake; a series that never moves always is.
        at_least: How many messages there must be to tell.
    """

    topic: str
    direction: Literal["rising", "falling"] = "rising"
    field: str = "data"
    strictly: bool = False
    at_least: int = 3

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        return f"{self.field} on {self.topic} only {self.direction}{', never equal' if self.strictly else ''}"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if no step goes the other way; the reason names the first that does."""
        messages = published(trace, self.topic)
        if len(messages) < max(2, self.at_least):
            return too_few_messages(trace, self.topic, len(messages), max(2, self.at_least))
        values = _numbers(messages, self.field)
        if isinstance(values, Finding):
            return values
        wrong = [k for k, (a, b) in enumerate(pairwise(values), 1) if not self._fine(a, b)]
        evidence = {"messages": len(values), "wrong_steps": len(wrong), "first_values": list(values[:10])}
        if wrong:
            k = wrong[0]
            reason = f"{moment(messages[k].t_ns)}, {self.topic}: {self.field} goes from {number(values[k - 1])} to "
            reason += f"{number(values[k])}, expected it {self.direction}; so {counted(len(wrong), 'time')}"
            return not_met(reason, evidence | {"first_wrong_s": seconds(messages[k].t_ns)})
        ends = f"from {number(values[0])} to {number(values[-1])} in {counted(len(values), 'message')}"
        if values[0] == values[-1]:
            return not_met(f"{self.topic}: {self.field} never moves, {ends}, expected it {self.direction}", evidence)
        return met(f"{self.topic}: {self.field} only {self.direction}, {ends}", evidence)

    def _fine(self, before: float, after: float) -> bool:
        step = after - before if self.direction == "rising" else before - after
        if math.isnan(step):
            return False
        return step > 0 if self.strictly else step >= -SLACK * max(1.0, abs(before))


def _numbers(messages: Sequence[Message], path: str) -> Finding | tuple[float, ...]:
    values = [number_at(m.value, path) for m in messages]
    found = tuple(v for v in values if v is not None)
    if len(found) == len(values):
        return found
    bare = next(m for m, v in zip(messages, values, strict=True) if v is None)
    reason = f"{moment(bare.t_ns)}, {bare.topic}: {quote(bare.type)} has no number {path}"
    return not_met(reason, {"topic": bare.topic, "type": bare.type})


def too_few_messages(trace: Trace, topic: str, found: int, wanted: int) -> Finding:
    """Return no credit and why there are not enough messages on a topic."""
    if found == 0:
        return explain_no_message(trace, topic)
    reason = f"{topic}: {counted(found, 'message')}, expected at least {wanted}"
    fault = first_fault(trace)
    if fault is not None:
        return not_met(f"{reason}; {fault_sentence(fault)}", hint=fault_hint(fault), fault=fault)
    return not_met(reason, {"messages": found})
