"""Checks on a sensor: its values lie in a range and are drawn, and it logs what comes back to it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from grader.core.errors import HarnessError
from grader.core.exercise import Finding, Problem, ProblemKind
from grader.core.quantities import NS_PER_MS, NS_PER_S, seconds
from grader.core.trace import Endpoint, Trace
from grader.judging.attribution import Sought, crowd, followed, standing
from grader.judging.findings import met, not_met, partly
from grader.judging.output import printed_lines, student_records
from grader.judging.positions.numbers import Printed
from grader.judging.randomness import pattern_of
from grader.judging.silence import (
    explain_no_message,
    explain_no_subscription,
    fault_hint,
    first_fault,
    heard_from_ns,
    student_endpoints,
)
from grader.judging.values import Held, Reading, carries_number, held, published, published_numbers
from grader.judging.wording import counted, fault_sentence, moment, number, numbers, quote, unit_of

#: Rounding to single precision must not push a value out of its range.
_EDGE = 1e-5
#: So many equal values or fewer may have been drawn: whole numbers repeat.
_FEWEST_FOR_CONSTANT = 5
#: How long after the next value came a log may still show the one before.
_LATE_NS = NS_PER_S
#: A value that was there for less than this need not have been logged.
_SHORTEST_NS = 1_200 * NS_PER_MS
_RANDOM_HINT = "draw a new value for every message: random.uniform({low}, {high})"
_PRINT_HINT = "write the received values through the node's logger: self.get_logger().info(...)"


@dataclass(frozen=True, slots=True)
class RandomInRange:
    """Every number on a topic lies in a range, and the numbers are drawn: no constant, cycle, ramp or smooth curve.

    Attributes:
        topic: Topic name as on the wire; its messages carry one number, as `data` or `temperature`.
        low: Smallest value allowed, the edge inside.
        high: Largest value allowed, the edge inside.
    """

    topic: str
    low: float
    high: float

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if no value is outside and the values may have been drawn."""
        messages = published(trace, self.topic)
        if not messages:
            silent = explain_no_message(trace, self.topic)
            return not_met(silent.reason, silent.evidence, blocked_by="topic_rate")
        values = published_numbers(trace, self.topic)
        if len(values) < len(messages):
            return not_met(f"{self.topic}: {quote(messages[0].type)} carries no number", {"type": messages[0].type})
        return self._outside(values) or self._computed(values) or self._drawn(values)

    @property
    def _hint(self) -> str:
        return _RANDOM_HINT.format(low=f"{float(self.low)}", high=f"{float(self.high)}")

    def _evidence(self, values: Sequence[Reading]) -> dict[str, Any]:
        got = [r.value for r in values]
        return {
            "messages": len(got),
            "min": min(got),
            "max": max(got),
            "distinct": len(set(got)),
            "first_values": got[:10],
        }

    def _outside(self, values: Sequence[Reading]) -> Finding | None:
        unit = unit_of(self.topic)
        bad = [r for r in values if not self.low - _EDGE <= r.value <= self.high + _EDGE]
        if not bad:
            return None
        first = bad[0]
        side = f"above {number(self.high)}" if first.value > self.high else f"below {number(self.low)}"
        side = "that is no number" if math.isnan(first.value) else f"{side}{unit}"
        reason = f"{self.topic}: first {side} at {moment(first.t_ns)} ({number(first.value)}{unit}); "
        reason += f"{len(bad)} of {len(values)} values lie outside {number(self.low)} to {number(self.high)}{unit}"
        evidence = self._evidence(values) | {"outside": len(bad), "first_outside_s": seconds(first.t_ns)}
        return not_met(reason, evidence, hint=self._hint)

    def _computed(self, values: Sequence[Reading]) -> Finding | None:
        got = [r.value for r in values]
        pattern = "constant" if len(got) == 1 else pattern_of(got)
        if pattern is None:
            return None
        if pattern == "constant" and len(got) < _FEWEST_FOR_CONSTANT:
            reason = (
                f"{self.topic}: {counted(len(got), 'value')} ({numbers(got)}{unit_of(self.topic)}) cannot show chance"
            )
            return not_met(reason, self._evidence(values), hint=self._hint, blocked_by="topic_rate")
        problem = None
        if pattern == "constant":
            shown = f"constant, {number(got[0])}{unit_of(self.topic)} in all {len(got)} messages"
            problem = Problem(ProblemKind.CONSTANT)
        else:
            shown = f"{pattern} ({numbers(got[:5])}, ...)"
        reason = f"{self.topic}: the values are not random but {shown}"
        return not_met(reason, self._evidence(values) | {"pattern": pattern}, hint=self._hint, problem=problem)

    def _drawn(self, values: Sequence[Reading]) -> Finding:
        got = [r.value for r in values]
        unit = unit_of(self.topic)
        reason = f"{self.topic}: {counted(len(got), 'value')} from {number(min(got))} to {number(max(got))}{unit}, "
        reason += f"{len(set(got))} of them different; "
        reason += f"expected random ones in {number(self.low)} to {number(self.high)}{unit}"
        return met(reason, self._evidence(values))


@dataclass(frozen=True, slots=True)
class LogsReceived:
    """A process logs the numbers that are published to it, each at least once while it lasts or up to a second later.

    Numbers count to the precision printed. One that stands among so many others that chance explains it shows nothing:
    a place in the text must follow the values. Values that are printed instead of logged are half of it.

    Attributes:
        process: File name of the student process.
        topic: Topic that the numbers are published on.
    """

    process: str
    topic: str

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if every value is in a log record, half if printed lines are needed."""
        fault = first_fault(trace, self.process)
        values = held(trace, self.topic, heard_from_ns=heard_from_ns(trace, self.topic))
        subscriptions = [e for e in student_endpoints(trace, "subscription") if e.topic == self.topic]
        if not subscriptions and fault is None:
            return explain_no_subscription(trace, self.topic)
        if not values or (subscriptions and not any(carries_number(e.type) for e in subscriptions)):
            return self._no_values(trace, subscriptions)
        return self._judged(trace, values, subscriptions)

    def _judged(self, trace: Trace, values: Sequence[Held], subscriptions: Sequence[Endpoint]) -> Finding:
        fault = first_fault(trace, self.process)
        records = student_records(trace, self.process)
        sought = self._sought(values, trace)
        unlogged = _missing(values, followed(records, sought), trace)
        evidence: dict[str, Any] = {"values": [v.value for v in values], "missing": [v.value for v in unlogged]}
        if not unlogged:
            reason = f"{self.process}: all {len(values)} values of {self.topic} are logged"
            return met(f"{reason} ({numbers(v.value for v in values)})", evidence)
        if not _missing(values, followed([*records, *printed_lines(trace, self.process)], sought), trace):
            reason = f"{self.process}: all {len(values)} values of {self.topic} are printed, not all of them are logged"
            return partly(reason, evidence, hint=_PRINT_HINT)
        absent = _missing(values, standing(records, sought), trace)
        evidence["missing"] = [v.value for v in absent or unlogged]
        if fault is not None:
            lost = f"{len(absent or unlogged)} of {len(values)} values of {self.topic} were not logged"
            return not_met(f"{fault_sentence(fault)}; {lost}", evidence, hint=fault_hint(fault), fault=fault)
        if absent:
            return self._unlogged(subscriptions, values, absent, evidence)
        among = crowd(records, sought[values.index(unlogged[0])])
        return self._hidden(values, unlogged, among, evidence)

    def _hidden(
        self, values: Sequence[Held], unlogged: Sequence[Held], among: str, evidence: dict[str, Any]
    ) -> Finding:
        first = unlogged[0]
        reason = f"{self.process}: {len(unlogged)} of {len(values)} values of {self.topic} are not told from other "
        reason += f"numbers, the first is {number(first.value)} at {moment(first.start_ns)}: {among}"
        hint = f"log the number that came on {self.topic}, and none that it might have been"
        return not_met(reason, evidence, hint=hint)

    def _no_values(self, trace: Trace, subscriptions: Sequence[Endpoint]) -> Finding:
        types = [e.type for e in subscriptions]
        if types and not any(carries_number(t) for t in types):
            reason = f"{self.topic}: the subscription takes {quote(types[0])}, which carries no number"
            return not_met(reason, {"type": types[0]}, hint="use a numeric message type, e.g. std_msgs/msg/Float32")
        fault = first_fault(trace, self.process)
        if fault is None:
            raise HarnessError(f"{self.topic}: no number was published on it")
        return not_met(f"{fault_sentence(fault)}; nothing was logged after it", hint=fault_hint(fault), fault=fault)

    def _sought(self, values: Sequence[Held], trace: Trace) -> list[Sought]:
        scale = max(abs(v.value) for v in values)
        stops = [v.stop_ns + (_LATE_NS if v.stop_ns < trace.stop_ns else 1) for v in values]
        return [
            Sought(v.start_ns, stop_ns, v.value, scale, partial(_shows, v.value))
            for v, stop_ns in zip(values, stops, strict=True)
        ]

    def _unlogged(
        self,
        subscriptions: Sequence[Endpoint],
        values: Sequence[Held],
        unlogged: Sequence[Held],
        evidence: dict[str, Any],
    ) -> Finding:
        first = unlogged[0]
        reason = f"{self.process}: {len(unlogged)} of {len(values)} values of {self.topic} are never logged, "
        reason += f"the first is {number(first.value)} at {moment(first.start_ns)}"
        logged = {v.value for v in values} - {v.value for v in unlogged}
        if logged and logged <= {0.0, 100.0}:
            reason += "; only 0 and 100 are, so what is logged is not what was received"
        if all(e.durability == "transient_local" for e in subscriptions):
            reason += (
                "; the subscription asks for transient_local durability, which a volatile publisher does not offer"
            )
        hint = "log msg.data in the callback of the subscription to " + self.topic
        return not_met(reason, evidence, hint=hint)


def _missing(values: Sequence[Held], logged: frozenset[int], trace: Trace) -> list[Held]:
    """Return the values that are not logged, but for one that came so late that it need not be."""
    return [v for k, v in enumerate(values) if k not in logged and trace.stop_ns - v.start_ns >= _SHORTEST_NS]


def _shows(value: float, printed: Printed) -> bool:
    return printed.shows(value)
