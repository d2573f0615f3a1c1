"""The check on how often a topic is published, in the terms of `ros2 topic hz`."""

from __future__ import annotations

import statistics
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import ClassVar

from grader.grading.judging.charts import gaps_panel, series, time_chart
from grader.grading.judging.facts import RateFacts
from grader.grading.judging.findings import (
    explain_no_message,
    fault_hint,
    fault_sentence,
    faults_before_stop,
    first_fault,
    met,
    not_met,
    partly,
)
from grader.grading.judging.values import published
from grader.grading.model.chart import Band, Chart, Level, Panel, Point, Tone
from grader.grading.model.exercise import Finding, ProblemKind, Roles
from grader.grading.model.measures import Measure
from grader.grading.model.wording import moment, number, quote, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S, DurationNs, Hertz, counted, seconds, within
from grader.runtime.model.trace import ClockKind, Fault, FaultKind, Trace

#: How much later than two periods before the end the last message may be missing: rounding, or a busy machine.
_END_SLACK_NS = {ClockKind.VIRTUAL: NS_PER_MS, ClockKind.WALL: 250 * NS_PER_MS}
#: A fault in an interval so many times as long as usual has interrupted the messages.
_PAUSE = 1.5
#: Fewer messages in the last quarter give no rate.
_FEWEST_LATER = 10


@dataclass(frozen=True, slots=True)
class _Measured:
    """Statistics of the message times in a window; times in seconds."""

    times_ns: tuple[int, ...]
    stop_ns: int
    rate_hz: float
    min_s: float
    max_s: float
    std_dev_s: float

    @property
    def average_ns(self) -> float:
        return (self.times_ns[-1] - self.times_ns[0]) / (len(self.times_ns) - 1)

    @property
    def steady(self) -> bool:
        """Whether at least half of the intervals are within half of the average."""
        # Half of the intervals, not all: a machine that is late once gives one long interval and one short, and in
        # bursts of two none is near the average.
        least, most = 0.5 * self.average_ns, 1.5 * self.average_ns
        usual = sum(least <= b - a <= most for a, b in pairwise(self.times_ns))
        return 2 * usual >= len(self.times_ns) - 1

    def sentence(self) -> str:
        least, most = f"{self.min_s:.3f}", f"{self.max_s:.3f}"
        apart = least if least == most else f"{least} to {most}"
        return f"{self.rate_hz:.3f} Hz on average, {len(self.times_ns)} messages {apart} s apart"


@dataclass(frozen=True, slots=True)
class TopicRate:
    """A topic is published at a rate, measured from its first message on.

    The rate is (n - 1) / (t_last - t_first) over the window, like that of `ros2 topic hz`. Messages must continue to
    the end of the window and be spread over it: bursts with the right average do not count. Without a window, the whole
    observation counts, and its last quarter must be within twice the tolerance. The type is free.

    Attributes:
        topic: Topic name as on the wire.
        rate: Expected rate.
        tolerance: Largest difference for full credit; the edge is inside.
        window: Duration that is measured, from the first message on; to the end of the observation if left out.
        partly_tolerance: Largest difference for half credit; none if left out.
        after_discovery: Whether messages do not count that are sent as soon as the publisher is created, before anybody
            can have discovered it.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    measures: ClassVar[Measure] = Measure("difference from the rate", "Hz")
    topic: str
    rate: Hertz
    tolerance: Hertz
    window: DurationNs | None = None
    partly_tolerance: Hertz | None = None
    after_discovery: bool = False

    @property
    def expected(self) -> str:
        over = "over the whole observation" if self.window is None else f"over {span(self.window)}"
        text = f"{self.topic} at {number(self.rate)} ± {number(self.tolerance)} Hz on average {over}"
        if self.partly_tolerance is not None:
            text += f"; half the points at {number(self.rate)} ± {number(self.partly_tolerance)} Hz"
        return text

    def judge(self, trace: Trace) -> Finding:
        times = [m.t_ns for m in published(trace, self.topic, self.after_discovery)]
        if not times:
            return explain_no_message(trace, self.topic)
        stop_ns = trace.stop_ns if self.window is None else min(trace.stop_ns, times[0] + self.window)
        # Half-open, like every window: at 20 Hz, ten seconds hold 200 messages whether or not one comes at the very
        # end.
        inside = tuple(sorted(t for t in times if t < stop_ns))
        # One instant has no rate: the division below would be by zero.
        if inside[-1] == inside[0]:
            return self._too_few(trace, inside)
        found = _measure(inside, stop_ns)
        evidence = self._evidence(found)
        # A flaw first: with bursts, a stop or a late start, the average says nothing, however right it is.
        graded = self._flaw(trace, found, evidence) or self._grade(found, evidence)
        finding = (self._slack(found, evidence) if graded.credit else None) or _after_fault(graded, trace, found)
        return replace(finding, facts=RateFacts(len(inside), seconds(inside[0]), found.rate_hz, found.max_s, self.rate))

    @property
    def _period_ns(self) -> float:
        return NS_PER_S / self.rate

    @property
    def _period_s(self) -> str:
        return number(1 / self.rate)

    @property
    def _wanted(self) -> str:
        over = "" if self.window is None else f" over {span(self.window)}"
        return f"expected {number(self.rate)} ± {number(self.tolerance)} Hz{over}"

    def _slack(self, found: _Measured, evidence: dict[str, object]) -> Finding | None:
        """Return a finding if the rate changed at the end, which the average hides; None otherwise."""
        first, last = found.times_ns[0], found.times_ns[-1]
        # The last quarter: an average over ten seconds stays within 5 % if the rate is halved in the last second only,
        # but not what is measured there alone.
        later = tuple(t for t in found.times_ns if t >= (first + 3 * last) // 4)
        if self.window is not None or len(later) < _FEWEST_LATER or later[-1] == later[0]:
            return None
        rate_hz = _measure(later, found.stop_ns).rate_hz
        # Twice the tolerance, because a quarter of the messages measures a rate less surely; where half the points are
        # given, twice that tolerance.
        if within(rate_hz, self.rate, 2 * max(self.tolerance, self.partly_tolerance or 0)):
            return None
        reason = f"{self.topic}: {found.sentence()}; {rate_hz:.3f} Hz from {moment(later[0])} on; "
        reason += f"{self._wanted} to the end"
        known, brief = evidence | {"later_rate_hz": rate_hz}, self._brief(rate_hz, f" from {moment(later[0])} on")
        return not_met(reason, known, hint=self._hint(rate_hz), problem=ProblemKind.RATE_CHANGES, brief=brief)

    def _evidence(self, found: _Measured) -> dict[str, object]:
        return {
            "topic": self.topic,
            "rate_hz": found.rate_hz,
            "min_s": found.min_s,
            "max_s": found.max_s,
            "std_dev_s": found.std_dev_s,
            "window": len(found.times_ns),
            "first_s": seconds(found.times_ns[0]),
            "last_s": seconds(found.times_ns[-1]),
            "expected_hz": self.rate,
            "tolerance_hz": self.tolerance,
        }

    def _grade(self, found: _Measured, evidence: dict[str, object]) -> Finding:
        reason = f"{self.topic}: {found.sentence()}; {self._wanted}"
        off = abs(found.rate_hz - self.rate)
        if within(found.rate_hz, self.rate, self.tolerance):
            return met(reason, evidence, measured=off)
        hint, problem, brief = self._hint(found.rate_hz), ProblemKind.WRONG_RATE, self._brief(found.rate_hz)
        if self.partly_tolerance is not None and within(found.rate_hz, self.rate, self.partly_tolerance):
            return partly(reason, evidence, hint=hint, problem=problem, brief=brief, measured=off)
        return not_met(reason, evidence, hint=hint, problem=problem, brief=brief, measured=off)

    def _brief(self, rate_hz: float, when: str = "") -> str:
        """Return the rate in a few words, with as many decimals as show that it is wrong."""
        # With one decimal, 20.96 Hz would read as 21.0, which 20 ± 1 Hz includes.
        digits = next((n for n in (1, 2) if not within(round(rate_hz, n), self.rate, self.tolerance)), 3)
        return f"{self.topic}: {rate_hz:.{digits}f} Hz{when}, {self._wanted}"

    def _flaw(self, trace: Trace, found: _Measured, evidence: dict[str, object]) -> Finding | None:
        """Return why the average of a window is not meaningful, or None if it is."""
        first, last = found.times_ns[0], found.times_ns[-1]
        seen = f"{self.topic}: {found.sentence()}"
        # Bursts first: a long interval between two of them looks like a stop.
        if not found.steady:
            hint = f"publish one message every {self._period_s} s rather than several at once"
            reason, problem = f"{seen}; the messages come in bursts; {self._wanted}", ProblemKind.BURSTS
            brief = f"{self.topic}: the messages come in bursts, {self._wanted}"
            return not_met(reason, evidence, hint=hint, problem=problem, brief=brief)
        silence = found.stop_ns - last
        # Two periods, of what is expected or of what comes: a slow node is judged for its rate, not for having stopped.
        if silence > max(2 * self._period_ns, 2 * found.average_ns) + _END_SLACK_NS[trace.clock]:
            ended, fault = _ending(trace, first, last)
            hint = fault_hint(fault) if fault else ""
            reason, problem = f"{seen}; {ended}; {self._wanted}", ProblemKind.STOPPED
            brief = "" if fault else f"{self.topic}: the messages {ended}, {self._wanted}"
            return not_met(reason, evidence, hint=hint, fault=fault, problem=problem, brief=brief)
        length = found.stop_ns - first
        if self.window is not None and length < self.window - self._period_ns - _END_SLACK_NS[trace.clock]:
            observed = f"only {span(length)} could be observed, the first message was published at {moment(first)}"
            fault = first_fault(trace)
            observed += f"; {fault_sentence(fault)}" if fault else ""
            # A window that could not be observed whole says nothing about the rate unless that is wrong too.
            off = fault is None and not within(found.rate_hz, self.rate, self.tolerance)
            hint = self._hint(found.rate_hz) if off else ""
            reason, problem = f"{seen}; {observed}; {self._wanted}", ProblemKind.TOO_LATE
            brief = "" if fault else f"{self.topic}: the first message was published at {moment(first)}"
            return not_met(reason, evidence, hint=hint, fault=fault, problem=problem, brief=brief)
        return None

    def _too_few(self, trace: Trace, times: tuple[int, ...]) -> Finding:
        if len(times) == 1:
            found = f"1 message, at {moment(times[0])}"
        else:
            found = f"{counted(len(times), 'message')}, all at {moment(times[0])}"
        evidence = {"topic": self.topic, "window": len(times), "first_s": seconds(times[0]), "expected_hz": self.rate}
        fault, facts = first_fault(trace), RateFacts(len(times), seconds(times[0]))
        if fault is not None:
            reason = f"{self.topic}: {found}; {fault_sentence(fault)}; {self._wanted}"
            return not_met(reason, evidence, fault=fault, facts=facts)
        hint = f"publish from a timer: create_timer({self._period_s}, ...) takes the period in seconds"
        reason, problem = f"{self.topic}: {found}; {self._wanted}", ProblemKind.TOO_FEW
        return not_met(reason, evidence, hint=hint, problem=problem, facts=facts)

    def _hint(self, rate_hz: float) -> str:
        period = self._period_s
        rule = f"create_timer({period}, ...): the argument is the period in seconds, 1/{number(self.rate)} = {period}"
        # A wrong period is rarely off by so much, and a loop without a pause always is.
        if rate_hz > 20 * self.rate:
            return f"the loop has no pause; use {rule}"
        # A sleep in a loop comes after the work, which takes at most a fifth of a period here.
        if 0.8 * self.rate <= rate_hz < self.rate:
            return f"a loop with sleep adds the time of its own work to each period; use {rule}"
        return rule

    def drawing(self, trace: Trace) -> Chart | None:
        """Return the chart of a rate, or None with fewer than two messages."""
        times = sorted(m.t_ns for m in published(trace, self.topic, self.after_discovery))
        if len(times) < 2 or times[0] == times[-1]:
            return None
        inside = [t for t in times if self.window is None or t < times[0] + self.window]
        title, panels = f"Rate of {self.topic}", (_rate_panel(self, times), _interval_panel(self, times))
        return time_chart(trace, f"rate {self.topic}", title, _describe_rate(self, inside), *panels)


def _measure(times: tuple[int, ...], stop_ns: int) -> _Measured:
    gaps = [seconds(b - a) for a, b in pairwise(times)]
    # n - 1 gaps, not n: counting messages overstates a short window
    rate_hz = (len(times) - 1) / seconds(times[-1] - times[0])
    low, high = min(gaps), max(gaps)
    # an exact sum of squares is slow, and in virtual time there is rarely any deviation
    deviation = statistics.pstdev(gaps) if high > low else 0.0
    return _Measured(times, stop_ns, rate_hz, low, high, deviation)


def _after_fault(finding: Finding, trace: Trace, found: _Measured) -> Finding:
    """Return a finding about too few messages with the fault that made them pause, after which a node began again."""
    kind = finding.problem.kind if finding.problem is not None and not finding.credit else None
    if kind not in (ProblemKind.BURSTS, ProblemKind.WRONG_RATE):
        return finding
    gaps = list(pairwise(found.times_ns))
    longer = _PAUSE * statistics.median(b - a for a, b in gaps)
    pauses = [(a, b) for a, b in gaps if b - a > longer]
    fault = next((f for f in faults_before_stop(trace) if any(a <= f.t_ns <= b for a, b in pauses)), None)
    if fault is None:
        return finding
    reason, hint = f"{finding.reason}; {fault_sentence(fault)}", fault_hint(fault)
    return not_met(reason, finding.evidence, hint=hint, fault=fault, measured=finding.measured)


def _ending(trace: Trace, first_ns: int, last_ns: int) -> tuple[str, Fault | None]:
    """Return a clause about messages that stopped before the window ended, and the fault that stopped them, if any."""
    stopped = f"stopped after {span(last_ns - first_ns)}"
    fault = next((f for f in trace.faults() if last_ns <= f.t_ns <= trace.stop_ns), None)
    if fault is not None:
        exited = fault.kind is FaultKind.EXITED
        return fault_sentence(fault) if exited else f"{stopped}: {fault_sentence(fault)}", fault
    limit = next((m for m in trace.marks("limit") if m.t_ns >= last_ns), None)
    return (f"{stopped}: {quote(limit.detail)}" if limit else stopped), None


#: The rate at a moment is measured over this time before it, or over this many periods if they are longer.
_TRAILING_NS = NS_PER_S
_TRAILING_PERIODS = 4


def _rate_panel(check: TopicRate, times: Sequence[int]) -> Panel:
    bands = [_band(check.rate, check.tolerance, "full points", Tone.GOOD)]
    if check.partly_tolerance is not None:
        bands.insert(0, _band(check.rate, check.partly_tolerance, "half the points", Tone.WARNING))
    points = _rates(times, max(_TRAILING_NS, round(_TRAILING_PERIODS * NS_PER_S / check.rate)))
    return Panel("rate over the last second", "Hz", (series("rate", points),), tuple(bands))


def _interval_panel(check: TopicRate, times: Sequence[int]) -> Panel:
    expected = Level(1000 / check.rate, f"{number(1000 / check.rate)} ms")
    return gaps_panel("message", times, levels=(expected,), unit="ms")


def _band(rate: float, tolerance: float, label: str, tone: Tone) -> Band:
    return Band(rate - tolerance, rate + tolerance, f"{number(rate)} ± {number(tolerance)} Hz: {label}", tone)


def _rates(times: Sequence[int], trailing_ns: int) -> list[Point]:
    """Return the rate over the time before each message, once that much time has passed."""
    points = []
    for k, t in enumerate(times):
        first = bisect_left(times, t - trailing_ns)
        # Before that, a single short interval would show as a peak that was never there.
        whole = t - times[0] >= trailing_ns or k == len(times) - 1
        if whole and t > times[first]:
            points.append((seconds(t), (k - first) * NS_PER_S / (t - times[first])))
    return points


def _describe_rate(check: TopicRate, times: Sequence[int]) -> str:
    gaps = [(b - a) / NS_PER_MS for a, b in pairwise(times)]
    if len(times) < 2 or times[-1] == times[0]:
        return f"{counted(len(times), 'message')} on {check.topic} in the window."
    average = (len(times) - 1) * NS_PER_S / (times[-1] - times[0])
    span_s = seconds(times[-1] - times[0])
    return (
        f"{counted(len(times), 'message')} on {check.topic} within {span_s:.1f} s, at {average:.3f} Hz on average; "
        f"single intervals from {min(gaps):.1f} to {max(gaps):.1f} ms. Accepted: {number(check.rate)} ± "
        f"{number(check.tolerance)} Hz over the whole window, not interval by interval."
    )
