"""Checks on when messages come: the gaps between them, how soon after an input, and not at all."""

from __future__ import annotations

import statistics
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

from grader.core.errors import HarnessError
from grader.core.exercise import Finding
from grader.core.quantities import DurationNs, seconds, within
from grader.core.trace import Trace
from grader.judging.findings import met, not_met
from grader.judging.silence import explain_no_message, fault_hint, first_fault, heard_from_ns
from grader.judging.values import JITTER_NS, published
from grader.judging.wording import counted, fault_sentence, moment, number, span

MarkName = Literal[
    "stream_starts", "stream_stops", "server_starts", "server_stops", "process_starts", "exited", "stop_signal"
]


@dataclass(frozen=True, slots=True)
class Period:
    """The gaps between the messages on a topic are neither too short nor too long, one by one or on average.

    What `topic_rate` asks on average, with a window and an end, this asks of each gap. On the wall clock a gap may be
    off by 50 ms.

    Attributes:
        topic: Topic name as on the wire.
        least: Shortest gap allowed.
        largest: Longest gap allowed.
        average: Average gap expected.
        tolerance: Largest difference of the average, as a share of it; the edge is inside.
        at_least: How many messages there must be to tell.
    """

    topic: str
    least: DurationNs | None = None
    largest: DurationNs | None = None
    average: DurationNs | None = None
    tolerance: float = 0.05
    at_least: int = 3

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        parts = [f"{word} {_ms(ns)}" for word, ns in (("at least", self.least), ("at most", self.largest)) if ns]
        if self.average is not None:
            parts.append(f"{_ms(self.average)} ± {number(100 * self.tolerance)} % on average")
        return f"gaps of {' and '.join(parts) or 'any length'} between the messages on {self.topic}"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if no gap is out of bounds; the reason names the first that is."""
        times = [m.t_ns for m in published(trace, self.topic)]
        if not times:
            return explain_no_message(trace, self.topic)
        if len(times) < max(2, self.at_least):
            return self._few(trace, len(times))
        gaps = [(a, b - a) for a, b in pairwise(times)]
        lengths = [seconds(gap) for _, gap in gaps]
        evidence = {
            "topic": self.topic,
            "messages": len(times),
            "min_s": min(lengths),
            "max_s": max(lengths),
            "average_s": statistics.fmean(lengths),
        }
        said = f"{self.topic}: gaps from {min(lengths):.3f} s to {max(lengths):.3f} s, "
        said += f"{evidence['average_s']:.3f} s on average"
        wrong = self._wrong(trace, gaps)
        if wrong is not None:
            t_ns, gap = wrong
            reason = f"{moment(t_ns)}, {self.topic}: {seconds(gap):.4g} s to the next message, expected {self.expected}"
            return not_met(reason, evidence | {"first_wrong_s": seconds(t_ns)})
        average = (times[-1] - times[0]) / len(gaps)
        if self.average is not None and not within(average, self.average, self.tolerance * self.average):
            return not_met(f"{said}; expected {self.expected}", evidence)
        return met(said, evidence)

    def _wrong(self, trace: Trace, gaps: Sequence[tuple[int, int]]) -> tuple[int, int] | None:
        jitter = JITTER_NS[trace.clock]
        least, largest = (self.least or 0) - jitter, self.largest
        for t_ns, gap in gaps:
            if gap < least or (largest is not None and gap > largest + jitter):
                return t_ns, gap
        return None

    def _few(self, trace: Trace, found: int) -> Finding:
        reason = f"{self.topic}: {counted(found, 'message')}, expected at least {max(2, self.at_least)}"
        fault = first_fault(trace)
        if fault is not None:
            return not_met(f"{reason}; {fault_sentence(fault)}", hint=fault_hint(fault), fault=fault)
        return not_met(reason, {"messages": found})


@dataclass(frozen=True, slots=True)
class Latency:
    """After each input on one topic a message on another follows within a time, whatever it holds.

    Inputs whose time is not over when the recording ends are left out. On the wall clock 50 ms are let pass.

    Attributes:
        input: Topic of the inputs.
        output: Topic of the outputs.
        within: Longest time from an input to the next output.
        share: Share of the inputs that must be followed in time.
    """

    input: str
    output: str
    within: DurationNs
    share: float = 1.0

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        return f"a message on {self.output} within {_ms(self.within)} of each one on {self.input}"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if enough inputs are followed in time; the reason names the first that is not."""
        outputs = [m.t_ns for m in published(trace, self.output)]
        if not outputs:
            return explain_no_message(trace, self.output)
        jitter = JITTER_NS[trace.clock]
        inputs = self._inputs(trace, jitter)
        if not inputs:
            return _no_input(trace, self.input)
        delays = [self._delay(t_ns, outputs, jitter) for t_ns in inputs]
        late = [(t, d) for t, d in zip(inputs, delays, strict=True) if d is None or d > self.within + jitter]
        evidence: dict[str, Any] = {"inputs": len(inputs), "outputs": len(outputs), "late": len(late)}
        known = [d for d in delays if d is not None]
        evidence["slowest_s"] = seconds(max(known, default=0))
        if len(inputs) - len(late) >= self.share * len(inputs) - 1e-9:
            reason = f"{self.output}: within {evidence['slowest_s']:.3f} s after {counted(len(inputs), 'input')}"
            return met(f"{reason} on {self.input}", evidence)
        t_ns, delay = late[0]
        took = "nothing" if delay is None else f"a message only after {seconds(delay):.3f} s"
        reason = f"{moment(t_ns)}, {self.output}: {took} after an input on {self.input}, expected one within "
        reason += f"{_ms(self.within)}; so after {len(late)} of {counted(len(inputs), 'input')}"
        fault = first_fault(trace)
        if fault is not None and delay is None:
            return not_met(f"{reason}; {fault_sentence(fault)}", evidence, hint=fault_hint(fault), fault=fault)
        return not_met(reason, evidence | {"first_late_s": seconds(t_ns)})

    def _inputs(self, trace: Trace, jitter: int) -> list[int]:
        from_ns = heard_from_ns(trace, self.input)
        sent = [d.t_ns for d in trace.deliveries(self.input) if d.t_ns >= from_ns]
        sent = sent or [m.t_ns for m in published(trace, self.input)]
        return [t for t in sent if t + self.within + jitter < trace.stop_ns]

    def _delay(self, t_ns: int, outputs: Sequence[int], jitter: int) -> int | None:
        place = bisect_left(outputs, t_ns - jitter)
        return max(0, outputs[place] - t_ns) if place < len(outputs) else None


@dataclass(frozen=True, slots=True)
class Silence:
    """Nothing is published on a topic for a while: in a window of the recording, or after or before a moment of it.

    The window begins at the mark `after`, else with the recording, and ends at the mark `before`, else with the
    recording. A node that crashed by then earns nothing by its silence.

    Attributes:
        topic: Topic name as on the wire.
        after: Moment from which on there is silence, e.g. `stream_stops`.
        before: Moment up to which there is silence, e.g. `stream_starts`.
        of: Topic, service or file that the moment belongs to; any if left out.
        grace: Time from the beginning of the window in which messages are let pass.
        duration: Length of the window after its grace; up to its end if left out.
    """

    topic: str
    after: MarkName | None = None
    before: MarkName | None = None
    of: str | None = None
    grace: DurationNs = 0
    duration: DurationNs | None = None

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        parts = [f"{word} {mark}" for word, mark in (("after", self.after), ("before", self.before)) if mark]
        grace = f", {_ms(self.grace)} of grace" if self.grace else ""
        return f"no message on {self.topic} {' and '.join(parts).replace('_', ' ')}{grace}".replace("  ", " ")

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if the window holds no message; the reason names the first that it holds."""
        fault = first_fault(trace)
        start_ns = self._moment(trace, self.after, 0)
        stop_ns = self._moment(trace, self.before, trace.stop_ns)
        if start_ns is None or stop_ns is None:
            if fault is not None:
                return not_met(f"{fault_sentence(fault)}; it came to no silence", hint=fault_hint(fault), fault=fault)
            raise HarnessError(f"{self.topic}: the recording has no moment {self.after or self.before}")
        start_ns += self.grace + (JITTER_NS[trace.clock] if self.after else 0)
        stop_ns = min(stop_ns - (JITTER_NS[trace.clock] if self.before else 0), start_ns + (self.duration or stop_ns))
        if stop_ns <= start_ns and fault is None:
            raise HarnessError(f"{self.topic}: the window of silence has no length")
        found = [m.t_ns for m in published(trace, self.topic) if start_ns <= m.t_ns < stop_ns]
        evidence = {"topic": self.topic, "window_s": [seconds(start_ns), seconds(stop_ns)], "messages": len(found)}
        window = f"from {seconds(start_ns):.3f} s to {seconds(stop_ns):.3f} s"
        if found:
            reason = f"{self.topic}: {counted(len(found), 'message')} {window}, the first at {moment(found[0])}"
            return not_met(f"{reason}; expected none", evidence | {"first_s": seconds(found[0])})
        if fault is not None and fault.t_ns < stop_ns:
            reason = f"{fault_sentence(fault)}; its silence {window} is no merit"
            return not_met(reason, evidence, hint=fault_hint(fault), fault=fault)
        return met(f"{self.topic}: no message {window}", evidence)

    def _moment(self, trace: Trace, name: str | None, otherwise: int) -> int | None:
        if name is None:
            return otherwise
        marks = trace.marks(name, self.of)
        return marks[0].t_ns if marks else None


def _ms(duration_ns: int) -> str:
    return f"{number(seconds(duration_ns))} s"


def _no_input(trace: Trace, topic: str) -> Finding:
    fault = first_fault(trace)
    if fault is not None:
        reason = f"{fault_sentence(fault)}; nothing had come on {topic} by then"
        return not_met(reason, hint=fault_hint(fault), fault=fault)
    if trace.deliveries(topic) or published(trace, topic):
        raise HarnessError(f"{topic}: no input was published early enough in {span(trace.stop_ns)}")
    found = explain_no_message(trace, topic)
    return not_met(found.reason, found.evidence, hint=found.hint, blocked_by="publishes")
