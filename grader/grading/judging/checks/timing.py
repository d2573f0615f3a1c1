"""Checks on when messages come: gaps, latency, silence, and reactions to inputs."""

from __future__ import annotations

import math
import statistics
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from grader.grading.judging.charts import Lanes, drawn_case, gaps_panel
from grader.grading.judging.checks.fields import too_few_messages
from grader.grading.judging.findings import (
    FAULT_KEY,
    explain_fault,
    explain_no_message,
    explain_no_subscription,
    faulted,
    first_fault,
    met,
    not_met,
    waiting_for,
)
from grader.grading.judging.plots import Drawing, Plot, delay_panel
from grader.grading.judging.series import curve
from grader.grading.judging.values import (
    JITTER_NS,
    FieldRule,
    NoSuchField,
    RuleOrValue,
    as_number,
    as_rule,
    at_path,
    breach,
    broken_rules,
    heard_from_ns,
    number_at,
    published,
    rules_text,
    student_endpoints,
    value_at,
)
from grader.grading.model.chart import Band, Level, Stretch, Tone
from grader.grading.model.exercise import Finding, ProblemKind, Roles
from grader.grading.model.measures import Measure, Reading
from grader.grading.model.wording import first_few, moment, number, quote, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S, DurationNs, FieldFormula, FieldOf, counted, seconds, within
from grader.runtime.model.trace import Delivery, Message, Trace

MarkName = Literal[
    "stream_starts", "stream_stops", "server_starts", "server_stops", "process_starts", "exited", "stop_signal"
]


@dataclass(frozen=True, slots=True)
class Period:
    """The gaps between the messages on a topic are neither too short nor too long, one by one or on average.

    `topic_rate` judges the average, with a window and an end; this check judges each gap. On the wall clock, a gap may
    be off by 50 ms.

    Attributes:
        topic: Topic name as on the wire.
        least: Shortest gap allowed.
        largest: Longest gap allowed.
        average: Average gap expected.
        tolerance: Largest difference of the average, as a share of it; the edge is inside.
        at_least: Number of messages needed for a judgement.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    measures: ClassVar[Measure] = Measure("time between two messages", "s")
    topic: str
    least: DurationNs | None = None
    largest: DurationNs | None = None
    average: DurationNs | None = None
    tolerance: float = 0.05
    at_least: int = 3

    @property
    def expected(self) -> str:
        parts = [f"{word} {_ms(ns)}" for word, ns in (("at least", self.least), ("at most", self.largest)) if ns]
        if self.average is not None:
            parts.append(f"{_ms(self.average)} ± {number(100 * self.tolerance)} % on average")
        return f"gaps of {' and '.join(parts) or 'any length'} between the messages on {self.topic}"

    def judge(self, trace: Trace) -> Finding:
        times = [m.t_ns for m in published(trace, self.topic)]
        # Two messages have one gap, and fewer none.
        if len(times) < max(2, self.at_least):
            return too_few_messages(trace, self.topic, len(times), max(2, self.at_least))
        gaps = [(a, b - a) for a, b in pairwise(times)]
        lengths = [seconds(gap) for _, gap in gaps]
        measured = [Reading(t_ns, seconds(gap)) for t_ns, gap in gaps]
        evidence = {
            "topic": self.topic,
            "messages": len(times),
            "min_s": min(lengths),
            "max_s": max(lengths),
            "average_s": statistics.fmean(lengths),
        }
        text = f"{self.topic}: gaps from {min(lengths):.3f} s to {max(lengths):.3f} s, "
        text += f"{evidence['average_s']:.3f} s on average"
        # Single gaps before the average: one that is wrong is a moment that a student can look at.
        wrong = self._wrong(trace, gaps)
        if wrong is not None:
            t_ns, gap = wrong
            reason = f"{moment(t_ns)}, {self.topic}: {seconds(gap):.4g} s to the next message, expected {self.expected}"
            return not_met(reason, evidence | {"first_wrong_s": seconds(t_ns)}, measured=measured)
        average = (times[-1] - times[0]) / len(gaps)
        if self.average is not None and not within(average, self.average, self.tolerance * self.average):
            return not_met(f"{text}; expected {self.expected}", evidence, measured=measured)
        return met(text, evidence, measured=measured)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the time from each message to the next, with what is allowed."""
        times = [m.t_ns for m in published(trace, self.topic)]
        if len(times) < 2:
            return Drawing((Plot(self.topic),))
        ends = {"at least": self.least, "at most": self.largest}
        levels = [Level(seconds(ns), f"{word} {_ms(ns)}", name=word) for word, ns in ends.items() if ns]
        bands = []
        if self.average is not None:
            share, mean = self.tolerance * seconds(self.average), seconds(self.average)
            label = f"{_ms(self.average)} ± {number(100 * self.tolerance)} % on average"
            bands.append(Band(mean - share, mean + share, label))
        gaps = [seconds(b - a) for a, b in pairwise(times)]
        said = f"{counted(len(times), 'message')}, {min(gaps):.3f} s to {max(gaps):.3f} s apart."
        panel = gaps_panel("message", times, bands=bands, levels=levels)
        return Drawing(panels=((panel, said),), title=f"Intervals on {self.topic}")

    def _wrong(self, trace: Trace, gaps: Sequence[tuple[int, int]]) -> tuple[int, int] | None:
        jitter = JITTER_NS[trace.clock]
        # The jitter of the wall clock in both directions: a late message makes one gap longer and the next one shorter.
        least, largest = (self.least or 0) - jitter, self.largest
        for t_ns, gap in gaps:
            if gap < least or (largest is not None and gap > largest + jitter):
                return t_ns, gap
        return None


@dataclass(frozen=True, slots=True)
class Latency:
    """After each input on one topic, a message on another follows within a time, whatever its content.

    Inputs whose time is not over when the recording ends are left out. On the wall clock, 50 ms more are accepted.

    Attributes:
        input: Topic of the inputs.
        output: Topic of the outputs.
        within: Longest time from an input to the next output.
        share: Share of the inputs that must be followed in time.
    """

    roles: ClassVar[Roles] = Roles(hears=("input",), speaks=("output",))
    measures: ClassVar[Measure] = Measure("time to the next message", "s")
    input: str
    output: str
    within: DurationNs
    share: float = 1.0

    @property
    def expected(self) -> str:
        return f"a message on {self.output} within {_ms(self.within)} of each one on {self.input}"

    def judge(self, trace: Trace) -> Finding:
        outputs = [m.t_ns for m in published(trace, self.output)]
        if not outputs:
            return explain_no_message(trace, self.output)
        jitter = JITTER_NS[trace.clock]
        sent = (given.t_ns for given in _inputs(trace, self.input))
        # Others could still have been answered after the end.
        inputs = [t for t in sent if t + self.within + jitter < trace.stop_ns]
        if not inputs:
            return _no_input(trace, self.input)
        delays = [self._delay(t_ns, outputs, jitter) for t_ns in inputs]
        late = [(t, d) for t, d in zip(inputs, delays, strict=True) if d is None or d > self.within + jitter]
        evidence: dict[str, object] = {"inputs": len(inputs), "outputs": len(outputs), "late": len(late)}
        known = [d for d in delays if d is not None]
        took_s = [math.inf if d is None else seconds(d) for d in delays]
        measured = list(map(Reading, inputs, took_s))
        evidence["slowest_s"] = seconds(max(known, default=0))
        # The slack is for shares such as 0.9 of 10, which floating point puts above 9.
        if len(inputs) - len(late) >= self.share * len(inputs) - 1e-9:
            reason = f"{self.output}: within {evidence['slowest_s']:.3f} s after {counted(len(inputs), 'input')}"
            return met(f"{reason} on {self.input}", evidence, measured=measured)
        t_ns, delay = late[0]
        took = "nothing" if delay is None else f"a message only after {seconds(delay):.3f} s"
        reason = f"{moment(t_ns)}, {self.output}: {took} after an input on {self.input}, expected one within "
        reason += f"{_ms(self.within)}; so after {len(late)} of {counted(len(inputs), 'input')}"
        fault = first_fault(trace)
        # A late answer was late before the crash; only what never came is due to it.
        if fault is not None and delay is None:
            return faulted(fault, reason, evidence, last=True)
        problem = ProblemKind.NO_ANSWER if delay is None else ProblemKind.TOO_LATE
        return not_met(reason, evidence | {"first_late_s": seconds(t_ns)}, problem=problem, measured=measured)

    def drawing(self, trace: Trace) -> Drawing:
        """Return inputs and outputs as marks, and the time from each input to the next output."""
        jitter = JITTER_NS[trace.clock]
        inputs = [given.t_ns for given in _inputs(trace, self.input) if given.t_ns < trace.stop_ns]
        outputs = [m.t_ns for m in published(trace, self.output)]
        delays = [(t, d) for t in inputs if (d := self._delay(t, outputs, jitter)) is not None]
        if not inputs and not outputs:
            return Drawing()
        lanes = Lanes()
        for name, times, tone in ((self.input, inputs, Tone.MAIN), (self.output, outputs, Tone.SECOND)):
            lanes.add(name)
            lanes.dots(name, ((t_ns, "") for t_ns in times), tone)
        said = f"{counted(len(inputs), 'input')} on {self.input}, {counted(len(outputs), 'message')} on {self.output}."
        panels = ((lanes.panel("messages"), said), delay_panel("next message", delays, self.within))
        return Drawing(panels=panels, title=f"From {self.input} to {self.output}")

    def _delay(self, t_ns: int, outputs: Sequence[int], jitter: int) -> int | None:
        # On the wall clock, both may be recorded late, and so in the wrong order.
        place = bisect_left(outputs, t_ns - jitter)
        return max(0, outputs[place] - t_ns) if place < len(outputs) else None


def _inputs(trace: Trace, topic: str) -> list[Delivery | Message]:
    """Return the grader's messages on a topic that had a subscriber; without any, those of the student's nodes."""
    from_ns = heard_from_ns(trace, topic)
    # The input of a node may come from another one of the student's.
    return [d for d in trace.deliveries(topic) if d.t_ns >= from_ns] or [*published(trace, topic)]


@dataclass(frozen=True, slots=True)
class Silence:
    """Nothing is published on a topic for some time: in a window of the recording, or after or before a moment of it.

    The window begins at the moment `after`, or else with the recording, and ends at the moment `before`, or else with
    the recording. A node that crashed by then earns no points for its silence.

    Attributes:
        topic: Topic name as on the wire.
        after: Moment at which the silence begins, e.g. `stream_stops`.
        before: Moment at which the silence ends, e.g. `stream_starts`.
        of: Topic, service or file of the moment; any if left out.
        grace: Time from the beginning of the window in which messages are accepted.
        duration: Length of the window after its grace; up to its end if left out.
    """

    measures: ClassVar[Measure] = Measure("number of messages")
    topic: str
    after: MarkName | None = None
    before: MarkName | None = None
    of: str | None = None
    grace: DurationNs = 0
    duration: DurationNs | None = None

    @property
    def expected(self) -> str:
        parts = [f"{word} {mark}" for word, mark in (("after", self.after), ("before", self.before)) if mark]
        grace = f", {_ms(self.grace)} of tolerance" if self.grace else ""
        return f"no message on {self.topic} {' and '.join(parts).replace('_', ' ')}{grace}".replace("  ", " ")

    def judge(self, trace: Trace) -> Finding:
        fault = first_fault(trace)
        start_ns, stop_ns = self._window(trace)
        if start_ns is None or stop_ns is None:
            if fault is not None:
                return faulted(fault, "it ended before the silent period began")
            raise HarnessError(f"{self.topic}: the recording has no moment {self.after or self.before}")
        # That is a mistake in the rubric, not the student's: there is nothing to be silent in.
        if stop_ns <= start_ns and fault is None:
            raise HarnessError(f"{self.topic}: the silent period has no length")
        found = [m.t_ns for m in published(trace, self.topic) if start_ns <= m.t_ns < stop_ns]
        evidence = {"topic": self.topic, "window_s": [seconds(start_ns), seconds(stop_ns)], "messages": len(found)}
        window = f"from {seconds(start_ns):.3f} s to {seconds(stop_ns):.3f} s"
        if found:
            reason = f"{self.topic}: {counted(len(found), 'message')} {window}, the first at {moment(found[0])}"
            known = evidence | {"first_s": seconds(found[0])}
            return not_met(f"{reason}; expected none", known, measured=len(found))
        # Any crash before the end of the window counts: nobody knows what the node would have sent after it.
        if fault is not None and fault.t_ns < stop_ns:
            return faulted(fault, f"the silence {window} earns no points", evidence)
        return met(f"{self.topic}: no message {window}", evidence, measured=0)

    def _window(self, trace: Trace) -> tuple[int, int] | tuple[None, None]:
        """Return when the window of silence begins and ends; None if the recording has no such moment."""
        start_ns = self._moment(trace, self.after, 0)
        stop_ns = self._moment(trace, self.before, trace.stop_ns)
        if start_ns is None or stop_ns is None:
            return None, None
        # At the edges, the recorded order of a mark and of a message says nothing on the wall clock; the ends of the
        # recording need no such margin.
        start_ns += self.grace + (JITTER_NS[trace.clock] if self.after else 0)
        stop_ns -= JITTER_NS[trace.clock] if self.before else 0
        return start_ns, min(stop_ns, start_ns + self.duration) if self.duration else stop_ns

    def drawing(self, trace: Trace) -> Drawing:
        """Return the messages on the topic, with the window in which none may come."""
        start_ns, stop_ns = self._window(trace)
        cases: tuple[Stretch, ...] = ()
        if start_ns is not None and stop_ns is not None and start_ns < stop_ns:
            cases = (drawn_case(start_ns, stop_ns, "no message expected"),)
        lanes = Lanes()
        lanes.add(self.topic)
        found = published(trace, self.topic)
        lanes.dots("message", ((m.t_ns, "") for m in found), Tone.MAIN)
        said = f"{counted(len(found), 'message')} on {self.topic}."
        return Drawing(panels=((lanes.panel("messages"), said),), cases=cases, title=f"Silence on {self.topic}")

    def _moment(self, trace: Trace, name: str | None, otherwise: int) -> int | None:
        if name is None:
            return otherwise
        marks = trace.marks(name, self.of)
        return marks[0].t_ns if marks else None


def _ms(duration_ns: int) -> str:
    return f"{number(seconds(duration_ns))} s"


def _no_input(trace: Trace, topic: str) -> Finding:
    if crashed := explain_fault(trace, f"nothing had been published on {topic} by then"):
        return crashed
    # There was input, and none of it could be judged: the recording is too short.
    if trace.deliveries(topic) or published(trace, topic):
        raise HarnessError(f"{topic}: no input was published early enough in {span(trace.stop_ns)}")
    return waiting_for("publishes", explain_no_message(trace, topic))


@dataclass(frozen=True, slots=True)
class ReactionCase:
    """A kind of input and the expected output.

    Attributes:
        when: Content of the input, by field path; the first matching case applies.
        then: Content of the output, by field path.
        copies: Output field path -> input field path with the same value.
        formulas: Output field path -> formula of the input's numeric fields, such as `sin(theta / 2)`.
        silent: Whether no output may come at all.
    """

    when: Annotated[Mapping[str, RuleOrValue], FieldOf("input")]
    then: Annotated[Mapping[str, RuleOrValue], FieldOf("output")] = field(default_factory=dict)
    copies: Annotated[Mapping[str, str], FieldOf("output", values="input")] = field(default_factory=dict)
    formulas: Annotated[Mapping[str, FieldFormula], FieldOf("output", values="input", formula=True)] = field(
        default_factory=dict
    )
    silent: bool = False

    def rules(self, given: Mapping[str, object]) -> dict[str, RuleOrValue]:
        """Return the rules for the output after an input."""
        copied = {path: _copied(given, source) for path, source in self.copies.items()}
        return {**self.then, **copied, **{path: _computed(given, text) for path, text in self.formulas.items()}}


def _copied(given: Mapping[str, object], source: str) -> RuleOrValue:
    try:
        found = at_path(given, source)
    except NoSuchField:
        raise HarnessError(f"the input has no field {source} to be copied") from None
    if isinstance(found, (list, tuple)):
        return FieldRule(items=tuple(found))
    if isinstance(found, (str, int, float)):
        return FieldRule(equals=found)
    raise HarnessError(f"the field {source} of the input is neither a number nor a text nor a list")


def _computed(given: Mapping[str, object], formula: str) -> float:
    wanted = curve(formula, of_fields=True)
    known = {name: value for name in wanted.names if (value := number_at(given, name)) is not None}
    value = wanted.of(known) if len(known) == len(wanted.names) else math.nan
    if not math.isfinite(value):
        raise HarnessError(f"{formula} has no value for an input")
    return value


@dataclass(frozen=True, slots=True)
class _Asked:
    """An input, its case, and the outputs until the next input."""

    given: Delivery | Message
    case: ReactionCase
    outputs: tuple[Message, ...]


@dataclass(frozen=True, slots=True)
class Reaction:
    """After each input comes a matching output: its fields hold what the case of that input requires.

    The matching output must come within a time, and no other may follow it until the next input. So a node may answer
    once, repeat its answer on a timer, or continue with the old one until its next period. Inputs without a matching
    case are ignored. Every case must have been tried.

    Attributes:
        input: Topic of the inputs.
        output: Topic of the outputs.
        cases: Each with `when`, and `then`, `copies`, `formulas` or `silent`.
        within: Longest time to the output.
        tolerance: Largest difference of a number without a tolerance of its own.
    """

    roles: ClassVar[Roles] = Roles(hears=("input",), speaks=("output",))
    measures: ClassVar[Measure] = Measure("time to the right message", "s")
    input: str
    output: str
    cases: tuple[ReactionCase, ...]
    within: DurationNs = NS_PER_S
    tolerance: float = 1e-6

    @property
    def expected(self) -> str:
        return f"within {span(self.within)} of each {self.input} a message on {self.output} that fits it"

    def judge(self, trace: Trace) -> Finding:
        asked = self._asked(trace)
        outputs = published(trace, self.output)
        # Before anything else: a check whose case was never tried has judged less than it is worth.
        missing = [case for case in self.cases if not any(a.case is case for a in asked)]
        if missing:
            return self._untried(trace, missing)
        if not outputs and not all(a.case.silent for a in asked):
            return self._silent(trace)
        told = [(a, self._wrong(trace, a)) for a in asked]
        wrong = [(a, flaw) for a, flaw in told if flaw]
        evidence: dict[str, object] = {"inputs": len(asked), "outputs": len(outputs), "wrong": len(wrong)}
        # infinite where the right message did not come, or another one followed
        took = [(a, math.inf if flaw else self._took_s(a)) for a, flaw in told if not a.case.silent]
        measured = [Reading(a.given.t_ns, took_s) for a, took_s in took]
        if wrong:
            found = self._explain(trace, wrong, len(asked), evidence)
            return found if FAULT_KEY in found.evidence else replace(found, measured=measured)
        reason = f"{self.output}: right after each of {counted(len(asked), 'input')} on {self.input}"
        return met(reason, evidence, measured=measured)

    def _took_s(self, asked: _Asked) -> float:
        """Return how long the right message took, which has come."""
        rules = asked.case.rules(asked.given.value)
        first = next(o for o in asked.outputs if not broken_rules(o.value, rules, self.tolerance))
        return seconds(max(0, first.t_ns - asked.given.t_ns))

    def _asked(self, trace: Trace) -> list[_Asked]:
        jitter_ns = JITTER_NS[trace.clock]
        given = [g for g in _inputs(trace, self.input) if g.t_ns < trace.stop_ns]
        stops = [*(g.t_ns for g in given), trace.stop_ns + jitter_ns][1:]
        outputs = published(trace, self.output)
        found = []
        for one, stop_ns in zip(given, stops, strict=False):
            case = next((c for c in self.cases if not broken_rules(one.value, c.when)), None)
            # An input shortly before the end could still have been answered after it.
            last_chance = stop_ns == trace.stop_ns + jitter_ns and stop_ns - one.t_ns <= self.within
            if case is None or last_chance:
                continue
            # The same shift at both ends, so that each output belongs to one input.
            during = tuple(o for o in outputs if one.t_ns - jitter_ns <= o.t_ns < stop_ns - jitter_ns)
            found.append(_Asked(one, case, during))
        return found

    def drawing(self, trace: Trace) -> Drawing:
        """Return inputs above outputs, with the numbers expected, and each input as a case."""
        asked = self._asked(trace)
        whens = dict.fromkeys(path for case in self.cases for path in case.when)
        thens = dict.fromkeys(path for case in self.cases for path in (*case.then, *case.copies))
        wanted: dict[str, list[Reading]] = {}
        for one in asked:
            for path, rule in one.case.rules(one.given.value).items():
                if (equal := as_number(as_rule(rule).equals)) is not None:
                    wanted.setdefault(path, []).append(Reading(one.given.t_ns, equal))
        # the first field is the one that is drawn with what was expected
        first = next((path for path in thens if path in wanted), "")
        fields = tuple(sorted(thens, key=lambda path: path != first))
        expected = wanted.get(first, [])
        expected += [Reading(trace.stop_ns, r.value) for r in expected[-1:]]
        stops = [*(a.given.t_ns for a in asked), trace.stop_ns][1:]
        cases = [
            drawn_case(
                a.given.t_ns,
                stop_ns,
                quote(rules_text(a.case.when), 40) or "otherwise",
                Tone.BAD if self._wrong(trace, a) else Tone.GOOD,
            )
            for a, stop_ns in zip(asked, stops, strict=False)
        ]
        plots = (Plot(self.input, tuple(whens)), Plot(self.output, fields, expected=tuple(expected)))
        return Drawing(plots, cases=tuple(cases))

    def _wrong(self, trace: Trace, asked: _Asked) -> str:
        """Describe what is wrong with the outputs after an input; empty if nothing is."""
        if asked.case.silent:
            return f"{moment(asked.outputs[0].t_ns)}: a message was published, expected none" if asked.outputs else ""
        rules = asked.case.rules(asked.given.value)
        fits = [not broken_rules(o.value, rules, self.tolerance) for o in asked.outputs]
        due_ns = asked.given.t_ns + self.within + JITTER_NS[trace.clock]
        first = next((k for k, fit in enumerate(fits) if fit and asked.outputs[k].t_ns <= due_ns), None)
        if first is None:
            return self._missing(asked, rules, fits)
        # Only outputs after the first right one: before it, a node may repeat the answer to the input before.
        spoilt = next((o for o, fit in zip(asked.outputs[first:], fits[first:], strict=True) if not fit), None)
        return "" if spoilt is None else f"right at first, then {self._difference(spoilt, rules)}"

    def _missing(self, asked: _Asked, rules: Mapping[str, RuleOrValue], fits: Sequence[bool]) -> str:
        late = next((o for o, fit in zip(asked.outputs, fits, strict=True) if fit), None)
        if late is not None:
            took = seconds(late.t_ns - asked.given.t_ns)
            return f"the right message was published after {took:.3f} s, expected within {span(self.within)}"
        if not asked.outputs:
            return f"no message within {span(self.within)}, expected {rules_text(rules)}"
        return self._difference(asked.outputs[-1], rules)

    def _difference(self, output: Message, rules: Mapping[str, RuleOrValue]) -> str:
        path = broken_rules(output.value, rules, self.tolerance)[0]
        return f"{moment(output.t_ns)}: {breach(output.value, path, as_rule(rules[path], self.tolerance))}"

    def _explain(
        self, trace: Trace, wrong: Sequence[tuple[_Asked, str]], total: int, evidence: dict[str, object]
    ) -> Finding:
        asked, flaw = wrong[0]
        shown = first_few([f"{path} = {_short(asked.given.value, path)}" for path in asked.case.when])
        reason = f"{self.output}, after {shown} on {self.input} at {moment(asked.given.t_ns)}: {flaw}; "
        reason += f"wrong after {len(wrong)} of {counted(total, 'input')}"
        fault = first_fault(trace)
        if fault is not None and not asked.outputs:
            return faulted(fault, reason, evidence, last=True)
        problem = ProblemKind.WRONG_ANSWER if asked.outputs else ProblemKind.NO_ANSWER
        return not_met(reason, evidence | {"first_wrong_s": seconds(asked.given.t_ns)}, problem=problem)

    def _silent(self, trace: Trace) -> Finding:
        subscriptions = student_endpoints(trace, "subscription", self.input)
        if not subscriptions and trace.deliveries(self.input) and first_fault(trace) is None:
            return explain_no_subscription(trace, self.input)
        return explain_no_message(trace, self.output)

    def _untried(self, trace: Trace, missing: Sequence[ReactionCase]) -> Finding:
        case = rules_text(missing[0].when)
        if crashed := explain_fault(trace, f"{self.input} with {case} was not published before"):
            return crashed
        if not trace.deliveries(self.input):
            return waiting_for("publishes", explain_no_message(trace, self.input))
        raise HarnessError(f"{self.input}: no input with {case} was published in time")


def _short(value: Mapping[str, object], path: str) -> str:
    return quote(str(value_at(value, path, "nothing")), 60)
