"""The check on a node that logs each message it receives, converted into one unit or several."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from grader.core.errors import HarnessError
from grader.core.exercise import Finding
from grader.core.quantities import NS_PER_S, seconds
from grader.core.trace import Trace
from grader.judging.attribution import Sought, crowd, followed, standing
from grader.judging.checks.logs import LOGGER_HINT
from grader.judging.conversions import Heard, wrong_conversion
from grader.judging.findings import met, not_met, partly
from grader.judging.output import printed_lines, student_records
from grader.judging.paths import number_at
from grader.judging.positions.numbers import Printed
from grader.judging.printed import Output, in_window, numbers_in, shows_about, times
from grader.judging.silence import explain_no_subscription, fault_hint, first_fault, heard_from_ns, student_endpoints
from grader.judging.values import JITTER_NS
from grader.judging.wording import counted, fault_sentence, moment, number, quote

#: How long after a message its log may come, where there are as many numbers as it takes.
_LATE_NS = NS_PER_S
#: A number tells something if its last digit is at most this share of the largest value.
_FINE = 0.1

_Logged = Callable[[Sequence[Output], Sequence[Sought]], frozenset[int]]


@dataclass(frozen=True, slots=True)
class _Received:
    """One message: its time, the time until which its log is its own, and its number."""

    t_ns: int
    stop_ns: int
    value: float


@dataclass(frozen=True, slots=True)
class LogsValues:
    """A process logs what it receives: for each message all of its converted numbers, in one record or in several.

    Numbers count to the precision printed, with their sign; a conversion may use a constant such as 3.14159. A number
    whose last digit is more than a tenth of the largest value tells nothing, and neither does one that stands among so
    many others that chance explains it. A log may come up to a second late, if
    none is left out. Numbers that are printed instead are half of it.

    Attributes:
        process: File name of the student process.
        topic: Topic that the messages are published on.
        field: Path of the number.
        unit_factors: What the number is multiplied by; all of the products must be logged.
        share: Share of the messages that must be logged.
    """

    process: str
    topic: str
    field: str = "data"
    unit_factors: tuple[float, ...] = (1.0,)
    share: float = 1.0

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if enough messages are in log records, half if printed lines are needed."""
        fault = first_fault(trace, self.process)
        subscribed = [e for e in student_endpoints(trace, "subscription") if e.topic == self.topic]
        if not subscribed and fault is None:
            return explain_no_subscription(trace, self.topic)
        received = self._received(trace)
        if not received:
            return self._nothing(trace)
        return self._judged(trace, received)

    def _judged(self, trace: Trace, received: Sequence[_Received]) -> Finding:
        fault = first_fault(trace, self.process)
        records = student_records(trace, self.process)
        unlogged = self._unlogged(received, records)
        evidence = self._evidence(received, unlogged)
        if self._enough(received, unlogged):
            return met(f"{self._said(received, unlogged)} logged{self._example(received, records)}", evidence)
        lines = printed_lines(trace, self.process)
        if self._enough(received, self._unlogged(received, sorted([*records, *lines], key=lambda o: o.t_ns))):
            return partly(f"{self._said(received, ())} printed, not all of them logged", evidence, hint=LOGGER_HINT)
        absent = self._unlogged(received, records, standing)
        hidden = self._enough(received, absent)
        if fault is not None:
            lost = f"{len(unlogged if hidden else absent)} of {len(received)} messages of {self.topic} were not logged"
            return not_met(f"{fault_sentence(fault)}; {lost}", evidence, hint=fault_hint(fault), fault=fault)
        if hidden:
            return self._hidden(received, unlogged, records, evidence)
        outputs = records if any(numbers_in(r.text) for r in records) else lines
        return self._explain(received, absent, outputs, self._evidence(received, absent))

    def _hidden(
        self,
        received: Sequence[_Received],
        unlogged: Sequence[_Received],
        records: Sequence[Output],
        evidence: dict[str, Any],
    ) -> Finding:
        first = unlogged[0]
        among = crowd(records, self._sought([first], [first.stop_ns])[0])
        reason = f"{self.process}: {len(unlogged)} of {counted(len(received), 'message')} of {self.topic} are not told "
        reason += f"from other numbers, the first is {number(first.value)} at {moment(first.t_ns)}: {among}"
        hint = f"log the number that came on {self.topic}, and none that it might have been"
        return not_met(reason, evidence, hint=hint)

    def _received(self, trace: Trace) -> list[_Received]:
        jitter_ns = JITTER_NS[trace.clock]
        from_ns = heard_from_ns(trace, self.topic)
        sent = [d for d in trace.deliveries(self.topic) if from_ns <= d.t_ns < trace.stop_ns - jitter_ns]
        stops = [*(d.t_ns + jitter_ns for d in sent), trace.stop_ns][1:]
        pairs = [(d, stop, number_at(d.value, self.field)) for d, stop in zip(sent, stops, strict=True)]
        return [_Received(d.t_ns - jitter_ns, stop, value) for d, stop, value in pairs if value is not None]

    def _nothing(self, trace: Trace) -> Finding:
        fault = first_fault(trace, self.process)
        if fault is None:
            raise HarnessError(f"{self.topic}: no number {self.field} was published on it")
        return not_met(f"{fault_sentence(fault)}; nothing was logged after it", hint=fault_hint(fault), fault=fault)

    def _enough(self, received: Sequence[_Received], unlogged: Sequence[_Received]) -> bool:
        return len(received) - len(unlogged) >= self.share * len(received) - 1e-9

    def _unlogged(
        self, received: Sequence[_Received], outputs: Sequence[Output], logged: _Logged = followed
    ) -> list[_Received]:
        punctual = self._unshown(received, [r.stop_ns for r in received], outputs, logged)
        written = sum(len(numbers_in(o.text)) for o in outputs if o.t_ns >= received[0].t_ns)
        if not punctual or written < self.share * len(received) * len(self.unit_factors):
            return punctual
        late = self._unshown(received, [r.t_ns + _LATE_NS for r in received], outputs, logged)
        return [r for r in punctual if r in late]

    def _unshown(
        self, received: Sequence[_Received], stops_ns: Sequence[int], outputs: Sequence[Output], logged: _Logged
    ) -> list[_Received]:
        found = logged(outputs, self._sought(received, stops_ns))
        many = len(self.unit_factors)
        return [r for k, r in enumerate(received) if not found >= set(range(k * many, (k + 1) * many))]

    def _sought(self, received: Sequence[_Received], stops_ns: Sequence[int]) -> list[Sought]:
        """Return what is to be logged: for each message one value a factor."""
        largest = max(abs(r.value) for r in received)
        return [
            Sought(r.t_ns, stop_ns, f * r.value, abs(f) * largest, partial(_shows, f * r.value, abs(f) * largest))
            for r, stop_ns in zip(received, stops_ns, strict=True)
            for f in self.unit_factors
        ]

    def _evidence(self, received: Sequence[_Received], unlogged: Sequence[_Received]) -> dict[str, Any]:
        return {
            "messages": len(received),
            "logged": len(received) - len(unlogged),
            "factors": list(self.unit_factors),
            "first_missing": [[seconds(r.t_ns), r.value] for r in unlogged[:10]],
        }

    def _said(self, received: Sequence[_Received], unlogged: Sequence[_Received]) -> str:
        logged = len(received) - len(unlogged)
        return f"{self.process}: {logged} of {counted(len(received), 'message')} of {self.topic} are"

    def _example(self, received: Sequence[_Received], outputs: Sequence[Output]) -> str:
        for one in received:
            found = in_window(outputs, one.t_ns, one.stop_ns)
            if found:
                return f", {number(one.value)} as: {quote(' / '.join(o.text for o in found), 80)}"
        return ""

    def _explain(
        self,
        received: Sequence[_Received],
        unlogged: Sequence[_Received],
        outputs: Sequence[Output],
        evidence: dict[str, Any],
    ) -> Finding:
        first = unlogged[0]
        wanted = " and ".join(number(f * first.value) for f in self.unit_factors)
        found = in_window(outputs, first.t_ns, first.stop_ns)
        wrote = f"found {quote(' / '.join(o.text for o in found), 80)}" if found else "found no log"
        reason = (
            f"{self.process}: {len(unlogged)} of {counted(len(received), 'message')} of {self.topic} are not logged "
        )
        reason += f"rightly, the first at {moment(first.t_ns)}: expected {wanted}, {wrote}"
        said, hint = self._cause(received, unlogged, outputs)
        return not_met(f"{reason}; {said}" if said else reason, evidence, hint=hint)

    def _cause(
        self, received: Sequence[_Received], unlogged: Sequence[_Received], outputs: Sequence[Output]
    ) -> tuple[str, str]:
        silent = [r for r in unlogged if not in_window(outputs, r.t_ns, r.stop_ns)]
        rule = f"log in the callback of the subscription to {self.topic}, once for each message"
        if len(silent) == len(received):
            return "", rule
        if len(silent) > len(received) / 2:
            return f"nothing is logged at {len(silent)} of the messages", rule
        heard = [Heard(r.value, self._numbers(r, outputs)) for r in received]
        largest = max(abs(r.value) for r in received)
        right = [f for f in self.unit_factors if self._mostly(heard, f, _FINE * abs(f) * largest)]
        for factor in (f for f in self.unit_factors if f not in right):
            said, hint = wrong_conversion(heard, factor, right)
            if said:
                return f"{times(factor)}: {said}", hint
            if right and all(len(h.numbers) <= len(right) for h in heard):
                return f"{times(factor)} is not there, only {' and '.join(map(times, right))}", ""
        return "", ""

    def _numbers(self, one: _Received, outputs: Sequence[Output]) -> tuple[Any, ...]:
        return tuple(n for o in in_window(outputs, one.t_ns, one.stop_ns) for n in numbers_in(o.text))

    def _mostly(self, heard: Sequence[Heard], factor: float, coarsest: float) -> bool:
        hits = sum(any(shows_about(n, factor * h.value, coarsest=coarsest) for n in h.numbers) for h in heard)
        return hits > 0.8 * len(heard)


def _shows(value: float, largest: float, printed: Printed) -> bool:
    return shows_about(printed, value, coarsest=_FINE * largest)
