"""Checks on the numbers in a topic's messages: their values, their range, a formula, or randomness."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from grader.grading.judging.facts import DrawFacts, SeriesFacts
from grader.grading.judging.findings import explain_fault, explain_no_message, faulted, met, not_met
from grader.grading.judging.logs.outputs import number_told
from grader.grading.judging.plots import Drawing, Plot, value_panels
from grader.grading.judging.series import Curve, Sample, curve, followed_instead, pattern_of
from grader.grading.judging.values import (
    FEW,
    JITTER_NS,
    FewSuffice,
    FieldRule,
    RuleOrValue,
    as_number,
    as_rule,
    broken_rules,
    number_at,
    published,
    published_numbers,
    shown_value,
    text_at,
    value_at,
)
from grader.grading.model.chart import Band
from grader.grading.model.exercise import Finding, Problem, ProblemKind, Roles
from grader.grading.model.measures import Measure, Reading
from grader.grading.model.wording import in_unit, moment, number, numbers, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import SLACK, FieldNumber, FieldOf, Formula, Pattern, counted, seconds, within
from grader.runtime.model.trace import Delivery, Fault, Message, Trace

#: Names of the extremes of a list, with the edge that each may cross.
_EXTREMES: tuple[tuple[str, Callable[[Sequence[float]], float], str], ...] = (
    ("smallest", min, "low"),
    ("largest", max, "high"),
)


class EqualFields:
    """A check whether fields hold what is expected in every message on a topic."""

    __slots__ = ()
    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    topic: str
    after_discovery: bool

    @property
    def at_least(self) -> int:
        """Number of messages needed for a judgement."""
        return 1

    @property
    def rules(self) -> dict[str, FieldRule]:
        """What is expected by field path."""
        raise NotImplementedError

    @property
    def _wanted(self) -> str:
        exact = {p: "= " if r.equals is not None or r.items is not None else "" for p, r in self.rules.items()}
        return ", ".join(f"{path} {exact[path]}{rule.wanted}" for path, rule in self.rules.items())

    @property
    def expected(self) -> str:
        return f"{self._wanted} in every message on {self.topic}"

    def judge(self, trace: Trace) -> Finding:
        messages = published(trace, self.topic, self.after_discovery)
        if len(messages) < max(1, self.at_least):
            return too_few_messages(trace, self.topic, len(messages), self.at_least)
        rules = self.rules
        # most messages equal the one before, which is faster to see than to judge; but True equals 1
        equal_counts = not any(isinstance(rule.equals, bool) or rule.items for rule in rules.values())
        wrong: list[tuple[Message, list[str]]] = []
        paths: list[str] = []
        before: tuple[str, Mapping[str, object]] | None = None
        for message in messages:
            if not equal_counts or (message.type, message.value) != before:
                paths, before = broken_rules(message.value, rules), (message.type, message.value)
            if paths:
                wrong.append((message, paths))
        values = {path: rule.wanted if rule.equals is None else rule.equals for path, rule in rules.items()}
        evidence = {"topic": self.topic, "values": values, "messages": len(messages), "wrong": len(wrong)}
        if not wrong:
            return met(f"{self.topic}: {self._wanted} in {counted(len(messages), 'message')}", evidence)
        first, paths = wrong[0]
        got = {path: value for path in paths if (value := value_at(first.value, path)) is not None}
        told = {path: read for path, value in got.items() if (read := as_number(value)) is not None}
        evidence |= {"first_wrong_s": seconds(first.t_ns), "found": told, "field": paths[0]}
        # A missing field before a wrong value: the type is then another one, and so are the other fields.
        if paths[0] not in got:
            reason = f"{moment(first.t_ns)}, {self.topic}: {quote(first.type)} has no field {paths[0]}"
            return not_met(reason, evidence, problem=ProblemKind.NO_FIELD)
        found = ", ".join(f"{path} is {shown_value(value)}" for path, value in got.items())
        brief = f"{self.topic}: {found}, expected {', '.join(rules[path].wanted for path in got)}"
        share = "all" if len(wrong) == len(messages) else f"{len(wrong)} of"
        where = "the only message" if len(messages) == 1 else f"{share} {len(messages)} messages"
        reason, hint = f"{moment(first.t_ns)}, {brief}; wrong in {where}", self.slip(first, paths)
        return not_met(reason, evidence, hint=hint, problem=ProblemKind.WRONG_VALUE, brief=brief)

    def slip(self, first: Message, paths: Sequence[str]) -> str:  # noqa: ARG002 - not every check knows slips
        """Return a hint about the first wrong message and its wrong fields; empty if there is none."""
        return ""

    def drawing(self, trace: Trace) -> Drawing:  # noqa: ARG002 - as every check
        """Return the fields with what is expected of them."""
        return Drawing((Plot(self.topic, rules=self.rules),))


@dataclass(frozen=True, slots=True)
class FieldEqual(FewSuffice, EqualFields):
    """Every message on a topic has the expected value in each named field: numbers, texts, truth values or lists.

    Attributes:
        topic: Topic name as on the wire.
        fields: What is expected by field path: a value, or `{equals, items, tolerance, low, high, pattern, example}`.
        tolerance: Largest difference of a number without a tolerance of its own.
        at_least: Number of messages needed for a judgement.
        after_discovery: Whether messages do not count that are sent as soon as the publisher is created, before anybody
            can have discovered it.
    """

    topic: str
    fields: Annotated[Mapping[str, RuleOrValue], FieldOf("topic")]
    tolerance: float = 1e-6
    at_least: int = 1
    after_discovery: bool = False

    @property
    def rules(self) -> dict[str, FieldRule]:
        """What is expected by field path."""
        return {path: as_rule(rule, self.tolerance) for path, rule in self.fields.items()}


@dataclass(frozen=True, slots=True)
class InRange:
    """A question about numbers that lie in a range."""

    measures: ClassVar[Measure] = Measure("distance from the range")
    topic: str
    low: FieldNumber | None = None
    high: FieldNumber | None = None
    field: Annotated[str, FieldOf("topic")] = "data"

    @property
    def rule(self) -> FieldRule:
        """What each number has to keep."""
        return FieldRule(low=self.low, high=self.high)

    def numbers(self, value: Mapping[str, object]) -> list[float]:
        """Return the number of a message, or those of a list; none if something else is among them."""
        # Something else among them makes the whole list useless.
        found = value_at(value, self.field)
        read = [as_number(v) for v in (found if isinstance(found, (list, tuple)) else (found,))]
        return [] if None in read else [v for v in read if v is not None]

    def judged(self, messages: Sequence[Message | Delivery], fault: Fault | None = None) -> Finding:
        """Judge messages; a fault before the first wrong number is its reason."""
        each = [(m, self.numbers(m.value)) for m in messages]
        outside = [(m, bad[0]) for m, values in each if (bad := [v for v in values if not self.rule.allows(v)])]
        every = [v for _, values in each for v in values]
        measured = [Reading(m.t_ns, max(map(self._outside_by, values))) for m, values in each if values]
        evidence: dict[str, object] = {"messages": len(each), "outside": len(outside)}
        evidence |= {"min": min(every), "max": max(every)} if every else {}
        if not outside:
            seen = f"from {number(min(every))} to {number(max(every))}" if every else "without numbers"
            reason = f"{self.topic}: {self.field} {seen} in {counted(len(each), 'message')}"
            return met(f"{reason}, expected {self.rule.wanted}", evidence, measured=measured)
        message, value = outside[0]
        reason = f"{moment(message.t_ns)}, {self.topic}: {self.field} is {number(value)}, expected {self.rule.wanted}; "
        reason += f"outside in {len(outside)} of {counted(len(each), 'message')}"
        known = evidence | {"first_outside_s": seconds(message.t_ns)}
        # A crash after the first wrong number does not explain it.
        if fault is not None and fault.t_ns <= message.t_ns:
            return faulted(fault, reason, known, last=True)
        return not_met(reason, known, problem=ProblemKind.WRONG_VALUE, measured=measured)

    def _outside_by(self, value: float) -> float:
        """Return how far a number is outside the range; 0 inside."""
        if self.rule.allows(value):
            return 0.0
        edges = (edge for edge in (self.low, self.high) if edge is not None)
        return min((abs(value - edge) for edge in edges), default=0.0)

    def drawn(self, messages: Sequence[Message | Delivery]) -> Drawing:
        """Return the number with its range; of a list, the smallest and the largest."""
        if not any(isinstance(value_at(m.value, self.field), (list, tuple)) for m in messages):
            return Drawing((Plot(self.topic, rules={self.field: self.rule}),))
        kept = [(name, pick) for name, pick, edge in _EXTREMES if getattr(self, edge) is not None]
        ends = [(m.t_ns, {name: pick(v) for name, pick in kept}) for m in messages if (v := self.numbers(m.value))]
        plot = Plot(self.topic, rules={name: self.rule for name, _ in kept})
        panels = tuple(value_panels(plot, ends, f"{self.field} on {self.topic}"))
        return Drawing(panels=panels, title=f"The numbers in {self.field} of {self.topic}")


@dataclass(frozen=True, slots=True)
class FieldInRange(FewSuffice, InRange):
    """A number in every message on a topic lies in a range, its edges inside; NaN lies in none.

    A list of numbers, such as the ranges of a laser scan, lies in the range if each of them does.

    Attributes:
        topic: Topic name as on the wire.
        low: Smallest value allowed; none if left out.
        high: Largest value allowed; none if left out.
        field: Path of the number, or of the list of numbers.
        at_least: Number of messages needed for a judgement.
        after_discovery: Whether messages do not count that are sent as soon as the publisher is created, before anybody
            can have discovered it.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    at_least: int = 1
    after_discovery: bool = False

    @property
    def expected(self) -> str:
        return f"{self.field} {self.rule.wanted} in every message on {self.topic}"

    def judge(self, trace: Trace) -> Finding:
        messages = published(trace, self.topic, self.after_discovery)
        if len(messages) < max(1, self.at_least):
            return too_few_messages(trace, self.topic, len(messages), self.at_least)
        bare = next((m for m in messages if not self.numbers(m.value)), None)
        return self.judged(messages) if bare is None else _no_number(bare, self.field)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the number with its range; of a list, the smallest and the largest."""
        return self.drawn(published(trace, self.topic, self.after_discovery))


@dataclass(frozen=True, slots=True)
class FieldMonotone(FewSuffice):
    """A number on a topic only rises, or only falls, from each message to the next.

    Attributes:
        topic: Topic name as on the wire.
        direction: `rising` or `falling`.
        field: Path of the number.
        strictly: Whether equal neighbours are a mistake; a constant series always is.
        at_least: Number of messages needed for a judgement.
        after_discovery: Whether messages do not count that are sent as soon as the publisher is created, before anybody
            can have discovered it.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    topic: str
    direction: Literal["rising", "falling"] = "rising"
    field: Annotated[str, FieldOf("topic")] = "data"
    strictly: bool = False
    at_least: int = 3
    after_discovery: bool = False

    @property
    def expected(self) -> str:
        return f"{self.field} on {self.topic} only {self.direction}{', never equal' if self.strictly else ''}"

    def judge(self, trace: Trace) -> Finding:
        messages = published(trace, self.topic, self.after_discovery)
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
            reason += f"{number(values[k])}, expected {self.direction} values; {counted(len(wrong), 'time')} in all"
            known = evidence | {"first_wrong_s": seconds(messages[k].t_ns)}
            return not_met(reason, known, problem=ProblemKind.WRONG_VALUE)
        ends = f"from {number(values[0])} to {number(values[-1])} in {counted(len(values), 'message')}"
        # A series that only rises or falls and ends where it began is constant, which obeys the rule and shows nothing.
        if values[0] == values[-1]:
            reason = f"{self.topic}: {self.field} never changes, {ends}, expected {self.direction} values"
            return not_met(reason, evidence, problem=ProblemKind.CONSTANT)
        return met(f"{self.topic}: {self.field} only {self.direction}, {ends}", evidence)

    def _fine(self, before: float, after: float) -> bool:
        step = after - before if self.direction == "rising" else before - after
        if math.isnan(step):
            return False
        # The slack is for sums of decimal fractions, whose last bit may fall while they stand still.
        return step > 0 if self.strictly else step >= -SLACK * max(1.0, abs(before))


def _numbers(messages: Sequence[Message], path: str, pattern: str | None = None) -> Finding | tuple[float, ...]:
    """Return the number at a path of each message, or in the text there if a pattern finds it; or why there is none."""
    values = [_number(m, path, pattern) for m in messages]
    found = tuple(v for v in values if v is not None)
    if len(found) == len(values):
        return found
    bare = next(m for m, v in zip(messages, values, strict=True) if v is None)
    text = text_at(bare.value, path)
    if pattern is not None and text is not None:
        reason = f"{moment(bare.t_ns)}, {bare.topic}: no number where expected in {path}, {quote(text, 60)!r}"
        return not_met(reason, {"topic": bare.topic, "text": text[:200]}, problem=ProblemKind.NO_NUMBER)
    return _no_number(bare, path)


def _no_number(message: Message, path: str) -> Finding:
    reason = f"{moment(message.t_ns)}, {message.topic}: {quote(message.type)} has no number {path}"
    return not_met(reason, {"topic": message.topic, "type": message.type}, problem=ProblemKind.NO_FIELD)


def _number(message: Message, path: str, pattern: str | None) -> float | None:
    return number_at(message.value, path) if pattern is None else number_told(message.value, path, pattern)


def too_few_messages(trace: Trace, topic: str, found: int, wanted: int) -> Finding:
    """Return no credit with the reason why a topic has too few messages."""
    if found == 0:
        return explain_no_message(trace, topic)
    reason = f"{topic}: {counted(found, 'message')}, expected at least {wanted}"
    return explain_fault(trace, reason, last=True) or not_met(reason, {"messages": found}, problem=ProblemKind.TOO_FEW)


#: How many messages may be lost until a subscription is discovered: half a second of 20 Hz.
LOST_AT_START = 10


@dataclass(frozen=True, slots=True)
class FieldFunction:
    """A field of every message on a topic follows a formula of the message's number n, which is 0 for the first one.

    The formula may use n, the time t in seconds since the first message, numbers, pi, + - * / % **, and sin, cos, tan,
    exp, sqrt, abs and floor. On the wall clock t may be off by 50 ms. NaN follows nothing.

    Attributes:
        topic: Topic name as on the wire.
        formula: What the field holds, e.g. `sin(0.1 * n)`.
        field: Path of the field, e.g. `data` or `linear.x`.
        tolerance: Largest difference, unit of the field.
        start_tolerance: Number of messages that may be lost before the first one received.
        at_least: Number of messages needed for a judgement.
        pattern: Regular expression whose first group, or whole match, is the number, if the field is a text.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    topic: str
    formula: Formula
    field: Annotated[str, FieldOf("topic")] = "data"
    tolerance: float = 1e-6
    start_tolerance: int = 0
    at_least: int = 10
    pattern: Pattern | None = None

    @property
    def expected(self) -> str:
        return f"{self.field} = {self.formula} in every message on {self.topic}, with n = 0 in the first one"

    def of_beginning(self) -> FieldFunction:
        """Return the check for a beginning, in which messages sent before discovery may be lost."""
        lost, few = max(self.start_tolerance, LOST_AT_START), min(self.at_least, FEW)
        return replace(self, start_tolerance=lost, at_least=few)

    def judge(self, trace: Trace) -> Finding:
        messages = published(trace, self.topic)
        if not messages:
            return explain_no_message(trace, self.topic)
        values = _numbers(messages, self.field, self.pattern)
        if isinstance(values, Finding):
            return values
        times = (seconds(m.t_ns - messages[0].t_ns) for m in messages)
        samples = [Sample(n, t_s, value) for n, (t_s, value) in enumerate(zip(times, values, strict=True))]
        return self._judged(trace, messages, samples)

    def _judged(self, trace: Trace, messages: Sequence[Message], samples: Sequence[Sample]) -> Finding:
        wanted = curve(self.formula)
        jitter_s = seconds(JITTER_NS[trace.clock])
        start, wrong = self._best_start(wanted, samples, jitter_s)
        facts = SeriesFacts(tuple(s.value for s in samples[:10]))
        evidence = {
            "topic": self.topic,
            "formula": self.formula,
            "messages": len(samples),
            "wrong": len(wrong),
            "first_values": [s.value for s in samples[:10]],
            "first_n": start,
        }
        if wrong:
            return replace(self._differs(wanted, messages, samples, (start, wrong), evidence), facts=facts)
        if len(samples) < self.at_least:
            return replace(self._few(trace, samples, evidence), facts=facts)
        lost = f", where the first one seen is n = {start}" if start else ""
        reason = f"{self.topic}: {self.field} follows {self.formula} in {counted(len(samples), 'message')}{lost}"
        return met(reason, evidence)

    def _best_start(self, wanted: Curve, samples: Sequence[Sample], jitter_s: float) -> tuple[int, list[Sample]]:
        """Return the number of the first message that gives the fewest errors; 0 unless another is better."""
        starts = range(max(0, self.start_tolerance) + 1)
        ways = [[s for s in samples if not self._right(wanted, s, jitter_s, start)] for start in starts]
        # The fewest errors, and of equal ones the lowest number: `min` keeps the first.
        best = min(starts, key=lambda start: len(ways[start]))
        return best, ways[best]

    def _right(self, wanted: Curve, sample: Sample, jitter_s: float, start: int) -> bool:
        # Both ends of the jitter: in so short a time, a formula hardly turns.
        got = [wanted.at(sample.n + start, sample.t_s + shift) for shift in (0.0, -jitter_s, jitter_s)]
        if within(sample.value, got[0], self.tolerance):
            return True
        slack = self.tolerance + SLACK
        return jitter_s > 0 and min(got) - slack <= sample.value <= max(got) + slack

    def _few(self, trace: Trace, samples: Sequence[Sample], evidence: dict[str, object]) -> Finding:
        found = f"{self.topic}: {counted(len(samples), 'message')}, expected at least {self.at_least}"
        few = not_met(found, evidence, blocked_by="topic_rate", problem=ProblemKind.TOO_FEW)
        return explain_fault(trace, found, evidence, last=True) or few

    def _differs(
        self,
        wanted: Curve,
        messages: Sequence[Message],
        samples: Sequence[Sample],
        found: tuple[int, Sequence[Sample]],
        evidence: dict[str, object],
    ) -> Finding:
        start, wrong = found
        first = wrong[0]
        t_ns = messages[first.n].t_ns
        expected = number(wanted.at(first.n + start, first.t_s))
        reason = f"{moment(t_ns)}, {self.topic}: {self.field} is {number(first.value)} in message n = "
        reason += f"{first.n + start}, expected {self.formula} = {expected}; "
        reason += f"wrong in {len(wrong)} of {counted(len(samples), 'message')}"
        instead = followed_instead(wanted, samples, self.tolerance)
        reason += f"; {instead.said}" if instead.said else ""
        brief = f"{self.topic}: {self.field} is {number(first.value)}, expected {self.formula} = {expected}"
        kind = ProblemKind.WRONG_VALUE if instead.start is None else ProblemKind.COUNT_START
        problem, known = Problem(kind, start=instead.start), evidence | {"first_wrong_s": seconds(t_ns)}
        return not_met(reason, known, hint=instead.hint, problem=problem, brief=brief)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the field with what the formula gives."""
        messages = published(trace, self.topic)
        wanted, expected = curve(self.formula), []
        for n, message in enumerate(messages):
            t_ns = message.t_ns - messages[0].t_ns
            expected.append(Reading(message.t_ns, wanted.at(n, seconds(t_ns))))
        if self.pattern is None:
            return Drawing((Plot(self.topic, (self.field,), expected=tuple(expected)),))
        read = [(m.t_ns, {"number": _number(m, self.field, self.pattern)}) for m in messages]
        plot = Plot(self.topic, ("number",), expected=tuple(expected))
        said = f"In {self.field} of {counted(len(read), 'message')} on {self.topic}"
        panels = value_panels(plot, read, said) if read else []
        return Drawing(panels=tuple(panels), title=f"The number in {self.field} of {self.topic}")


#: Rounding to single precision must not push a value out of its range.
_EDGE = 1e-5
#: Values that are spread evenly should reach the lowest and the highest fifth of their range. That so many miss one of
#: them happens with a chance of one in a million: 2 * 0.8**65.
_OUTER, _FEWEST_FOR_RANGE = 0.2, 65
#: Share of the values in the outer fifths of what they cover: about 0.4 if they are spread evenly, below 0.25 if they
#: gather around a mean, as a normal distribution does, which may leave a fifth of its range empty.
_EVENLY = 0.28
#: Mean step from one value to the next, as a share of what they cover: a third if each one is drawn anew, far less for
#: a random walk, which takes its time to get anywhere.
_DRAWN_ANEW = 0.2
#: Up to this many equal values may be random: whole numbers repeat.
_FEWEST_FOR_CONSTANT = 5
_RANDOM_HINT = "draw a new value for every message: random.uniform({low}, {high})"


@dataclass(frozen=True, slots=True)
class RandomInRange:
    """Every number on a topic is in a range, and the numbers are random: no constant, cycle, ramp or smooth curve.

    Numbers that are drawn evenly have to come from the whole range: of 65 or more, some are in its lowest fifth, and
    some in its highest one. Other distributions and random walks may stay near the middle.

    Attributes:
        topic: Topic name as on the wire.
        low: Smallest value allowed, the edge inside.
        high: Largest value allowed, the edge inside.
        after_discovery: Whether messages do not count that are sent as soon as the publisher is created, before anybody
            can have discovered it.
        field: Path of the number; by default `data`, or else the only number of a message.
        unit: Unit of the number, for reasons and charts, e.g. `m`.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    topic: str
    low: float
    high: float
    after_discovery: bool = False
    field: Annotated[str, FieldOf("topic")] = ""
    unit: str = ""

    @property
    def expected(self) -> str:
        span_ = f"{number(self.low)} to {number(self.high)}{in_unit(self.unit)}"
        return f"every value on {self.topic} within {span_}, and drawn at random"

    def judge(self, trace: Trace) -> Finding:
        messages = published(trace, self.topic, self.after_discovery)
        if not messages:
            # Silence is the problem of the check on the rate, and is explained there: the same lost point is not
            # explained twice.
            silent = explain_no_message(trace, self.topic)
            return not_met(silent.reason, silent.evidence, blocked_by="topic_rate", problem=silent.problem)
        values = published_numbers(trace, self.topic, self.field)
        if len(values) < len(messages):
            reason = f"{self.topic}: {quote(messages[0].type)} carries no number"
            return not_met(reason, {"type": messages[0].type}, problem=ProblemKind.NO_NUMBER)
        # The range first: a constant outside of it would be called constant, and mending that would not help.
        return self._outside(values) or self._computed(values) or self._narrow(values) or self._drawn(values)

    @property
    def _hint(self) -> str:
        return _RANDOM_HINT.format(low=f"{float(self.low)}", high=f"{float(self.high)}")

    def _evidence(self, values: Sequence[Reading]) -> dict[str, object]:
        got = [r.value for r in values]
        known = {"messages": len(got), "min": min(got), "max": max(got)}
        return known | {"distinct": len(set(got)), "first_values": got[:10]}

    def _outside(self, values: Sequence[Reading]) -> Finding | None:
        unit = in_unit(self.unit)
        bad = [r for r in values if not self.low - _EDGE <= r.value <= self.high + _EDGE]
        if not bad:
            return None
        first = bad[0]
        side = f"above {number(self.high)}" if first.value > self.high else f"below {number(self.low)}"
        side = "that is not a number" if math.isnan(first.value) else f"{side}{unit}"
        reason = f"{self.topic}: first {side} at {moment(first.t_ns)} ({number(first.value)}{unit}); "
        reason += f"{len(bad)} of {len(values)} values are outside {number(self.low)} to {number(self.high)}{unit}"
        evidence = self._evidence(values) | {"outside": len(bad), "first_outside_s": seconds(first.t_ns)}
        facts = DrawFacts(min(r.value for r in values), max(r.value for r in values), outside=len(bad))
        return not_met(reason, evidence, hint=self._hint, problem=ProblemKind.WRONG_VALUE, facts=facts)

    def _computed(self, values: Sequence[Reading]) -> Finding | None:
        got = [r.value for r in values]
        pattern = "constant" if len(got) == 1 else pattern_of(got)
        if pattern is None:
            return None
        # Too few to tell, and too few messages is what the check on the rate is about.
        if pattern == "constant" and len(got) < _FEWEST_FOR_CONSTANT:
            few = f"{counted(len(got), 'value')} ({numbers(got)}{in_unit(self.unit)})"
            reason = f"{self.topic}: {few} cannot show whether they are random"
            return not_met(
                reason, self._evidence(values), hint=self._hint, blocked_by="topic_rate", problem=ProblemKind.TOO_FEW
            )
        problem = ProblemKind.NOT_RANDOM
        if pattern == "constant":
            shown = f"constant, {number(got[0])}{in_unit(self.unit)} in all {len(got)} messages"
            problem = ProblemKind.CONSTANT
        else:
            shown = f"{pattern} ({numbers(got[:5])}, ...)"
        reason = f"{self.topic}: the values are not random but {shown}"
        evidence, facts = self._evidence(values) | {"pattern": pattern}, DrawFacts(min(got), max(got), pattern=pattern)
        return not_met(reason, evidence, hint=self._hint, problem=problem, facts=facts)

    def _narrow(self, values: Sequence[Reading]) -> Finding | None:
        """Return a finding if values that are drawn evenly leave out an end of the range; None otherwise."""
        got = [r.value for r in values]
        least, most = min(got), max(got)
        edge, extent = _OUTER * (self.high - self.low), most - least
        reaches = least <= self.low + edge and most >= self.high - edge
        if reaches or len(got) < _FEWEST_FOR_RANGE or not extent:
            return None
        outer = sum(not least + _OUTER * extent <= v <= most - _OUTER * extent for v in got)
        steps = sum(abs(b - a) for a, b in pairwise(got)) / (len(got) - 1)
        if outer < _EVENLY * len(got) or steps < _DRAWN_ANEW * extent:
            return None
        unit = in_unit(self.unit)
        brief = f"{self.topic}: only values from {number(least)} to {number(most)}{unit}, "
        brief += f"expected them from all of {number(self.low)} to {number(self.high)}{unit}"
        problem, facts = Problem(ProblemKind.WRONG_VALUE, detail="narrow"), DrawFacts(least, most, narrow=True)
        reason = f"{brief}; {len(got)} values are drawn evenly, and do not come near both ends"
        return not_met(reason, self._evidence(values), hint=self._hint, problem=problem, facts=facts, brief=brief)

    def _drawn(self, values: Sequence[Reading]) -> Finding:
        got = [r.value for r in values]
        unit = in_unit(self.unit)
        reason = f"{self.topic}: {counted(len(got), 'value')} from {number(min(got))} to {number(max(got))}{unit}, "
        reason += f"{len(set(got))} of them different; "
        reason += f"expected random ones in {number(self.low)} to {number(self.high)}{unit}"
        return met(reason, self._evidence(values))

    def drawing(self, trace: Trace) -> Drawing:  # noqa: ARG002 - as every check
        """Return the numbers with their range."""
        label = f"{number(self.low)} to {number(self.high)}{in_unit(self.unit)}"
        return Drawing((Plot(self.topic, bands=(Band(self.low, self.high, f"{label}: accepted"),), unit=self.unit),))
