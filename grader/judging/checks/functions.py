"""The check on a field that follows a formula of the message's number or of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from grader.core.exercise import Finding, Formula, Problem, ProblemKind
from grader.core.quantities import SLACK, seconds, within
from grader.core.trace import Message, Trace
from grader.judging.findings import met, not_met
from grader.judging.following import Sample, followed_instead
from grader.judging.formula import Curve, curve
from grader.judging.paths import number_at
from grader.judging.silence import explain_no_message, fault_hint, first_fault
from grader.judging.values import JITTER_NS, published
from grader.judging.wording import counted, fault_sentence, moment, number, quote


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
        start_tolerance: How many messages may have been lost before the first one was seen.
        at_least: How many messages there must be to tell.
    """

    topic: str
    formula: Formula
    field: str = "data"
    tolerance: float = 1e-6
    start_tolerance: int = 0
    at_least: int = 10

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if no message differs; the reason names the first that does."""
        messages = published(trace, self.topic)
        if not messages:
            return explain_no_message(trace, self.topic)
        samples = []
        for n, message in enumerate(messages):
            value = number_at(message.value, self.field)
            if value is None:
                reason = f"{moment(message.t_ns)}, {self.topic}: {quote(message.type)} has no number {self.field}"
                return not_met(reason, {"topic": self.topic, "type": message.type})
            samples.append(Sample(n, seconds(message.t_ns - messages[0].t_ns), value))
        return self._judged(trace, messages, samples)

    def _judged(self, trace: Trace, messages: Sequence[Message], samples: Sequence[Sample]) -> Finding:
        wanted = curve(self.formula)
        jitter_s = seconds(JITTER_NS[trace.clock])
        start, wrong = self._best_start(wanted, samples, jitter_s)
        evidence = {
            "topic": self.topic,
            "formula": self.formula,
            "messages": len(samples),
            "wrong": len(wrong),
            "first_values": [s.value for s in samples[:10]],
            "first_n": start,
        }
        if wrong:
            return self._differs(wanted, messages, samples, (start, wrong), evidence)
        if len(samples) < self.at_least:
            return self._few(trace, samples, evidence)
        lost = f", the first one seen being n = {start}" if start else ""
        reason = f"{self.topic}: {self.field} follows {self.formula} in {counted(len(samples), 'message')}{lost}"
        return met(reason, evidence)

    def _best_start(self, wanted: Curve, samples: Sequence[Sample], jitter_s: float) -> tuple[int, list[Sample]]:
        """Return the number of the first message that leaves the fewest wrong, 0 unless another is better."""
        starts = range(max(0, self.start_tolerance) + 1)
        ways = [[s for s in samples if not self._right(wanted, s, jitter_s, start)] for start in starts]
        best = min(starts, key=lambda start: len(ways[start]))
        return best, ways[best]

    def _right(self, wanted: Curve, sample: Sample, jitter_s: float, start: int) -> bool:
        got = [wanted.at(sample.n + start, sample.t_s + shift) for shift in (0.0, -jitter_s, jitter_s)]
        if within(sample.value, got[0], self.tolerance):
            return True
        slack = self.tolerance + SLACK
        return jitter_s > 0 and min(got) - slack <= sample.value <= max(got) + slack

    def _few(self, trace: Trace, samples: Sequence[Sample], evidence: dict[str, Any]) -> Finding:
        found = f"{self.topic}: {counted(len(samples), 'message')}, expected at least {self.at_least}"
        fault = first_fault(trace)
        if fault is None:
            return not_met(found, evidence, blocked_by="topic_rate")
        return not_met(f"{found}; {fault_sentence(fault)}", evidence, hint=fault_hint(fault), fault=fault)

    def _differs(
        self,
        wanted: Curve,
        messages: Sequence[Message],
        samples: Sequence[Sample],
        found: tuple[int, Sequence[Sample]],
        evidence: dict[str, Any],
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
        problem = Problem(ProblemKind.COUNT_START, start=instead.start) if instead.start is not None else None
        return not_met(reason, evidence | {"first_wrong_s": seconds(t_ns)}, hint=instead.hint, problem=problem)
