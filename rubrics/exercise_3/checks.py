"""The checks of exercise 3: a controller that switches at a threshold, alone and together with its sensor."""

from __future__ import annotations

import statistics
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from grader.api import (
    NS_PER_S,
    ClockKind,
    Drawing,
    Endpoint,
    Fault,
    FieldOf,
    Finding,
    HarnessError,
    Level,
    LogRecord,
    OutputLine,
    Plot,
    Problem,
    ProblemKind,
    Reading,
    Roles,
    Trace,
    delivered_numbers,
    explain_fault,
    explain_no_message,
    met,
    not_met,
    published,
    published_numbers,
    seconds,
    within,
)
from grader.api.unstable import (
    EXACT,
    FAULT_KEY,
    JITTER_NS,
    NS_PER_MS,
    Held,
    counted,
    fault_hint,
    fault_sentence,
    faulted,
    first_fault,
    heard_from_ns,
    held,
    in_unit,
    moment,
    number,
    numbers,
    quote,
    span,
    student_endpoints,
    unmet_policy,
)

#: How long after a new input the answer to the previous one is still accepted.
_GRACE_NS = 300 * NS_PER_MS
#: The same for a controller that answers on a timer: one of its periods, at most this.
_LONGEST_GRACE_NS = 1_200 * NS_PER_MS
#: A controller that publishes at least this often repeats itself; silence then means that it stopped.
_REPEATING_NS = 1_200 * NS_PER_MS
#: With this many answers, and this share of them at the instant of an input, the controller does not use a timer.
_FEWEST_AT_ONCE, _SHARE_AT_ONCE = 10, 0.97
#: Step between the lags that are tried, and the longest lag.
_LAG_STEP_NS, _LONGEST_LAG_NS = 100 * NS_PER_MS, 8 * NS_PER_S
#: Maximum number of inputs that an answer may lag behind.
_FURTHEST_BEHIND = 25
#: Minimum share of answers that must fit for a lag to be reported.
_SURE_BEHIND = 0.97
#: Fewer answers than this may fit by chance.
_FEWEST_ANSWERS = 10
#: Whether an answer (first) is right for an input (second).
_Right = Callable[[float, float], bool]


@dataclass(frozen=True, slots=True)
class AnswerRow:
    """One input that was held for some time, and the answer to it."""

    input: float
    answer: float | None  # the last answer while it was held; None for none
    expected: float


@dataclass(frozen=True, slots=True)
class AnswerFacts:
    """The answers of a controller that are wrong."""

    rows: tuple[AnswerRow, ...] = ()  # in the order of the inputs, if each one was held for some time
    late: bool = False  # whether each answer fits an earlier input


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
        answers = _last_of_instant(every)
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
        if not before or _repeats(_last_of_instant(answers)) or any(f.t_ns <= asked.start_ns for f in trace.faults()):
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
        answers = _last_of_instant(every)
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
            cause = f"; {' and '.join(map(number, sorted(both)))} are published at the same time"
            hint = f"publish one answer to each number on {self.input}"
            return not_met(reason + cause, evidence, hint=hint, problem=ProblemKind.CONTRADICTION, brief=brief)
        lag = _lag_ns([Reading(h.start_ns, h.value) for h in inputs], answers, self._right)
        if lag is not None:
            reason += f"; the answers match what was published {span(lag)} earlier"
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
            return "", f"a value just above {limit} counts too: compare it without rounding"
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
        return _drawing(self, expected)


def _deaf(subscriptions: Sequence[Endpoint]) -> str:
    """Return what keeps subscriptions from hearing an ordinary publisher; empty if nothing does, or of one only."""
    if all(e.durability == "transient_local" for e in subscriptions):
        return " with transient_local durability, which a volatile publisher does not offer"
    usual = Endpoint("publisher", "", "", "", -1, "reliable", "volatile")
    policies = [unmet_policy(usual, end) for end in subscriptions]
    if policies and policies[0] is not None and None not in policies:
        return f" and requests {policies[0][1]} where an ordinary publisher offers {policies[0][0]}"
    return ""


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


#: An answer may belong to any input that was current within this time before it.
_CURRENT_NS = 250 * NS_PER_MS
#: A controller must publish within this time if its last answer does not fit the input: one period of 1 s and slack.
_SPEAK_NS = 1_250 * NS_PER_MS
#: Minimum share of the answers that must fit the inputs with one common delay, if there are enough answers.
_AGREEING_SHARE = 0.75
#: The same if time is exact and nearly every input is answered.
_AGREEING_SHARE_PROMPT = 0.97
_FEWEST_FOR_SHARE = 10
#: Gaps that differ by at most this, and their minimum share, for answers to come from a timer.
_EVEN_NS, _EVEN_SHARE = 20 * NS_PER_MS, 0.9
#: Maximum share of the inputs on one side whose answers may be missing if answers are rare.
_RARE = 0.3
#: Fewest steps that reveal the sensor's range, and the largest ratio of range to usual step. Independent draws span 3
#: to 5 of their steps, a random walk with this many steps spans 10 and more.
_FEWEST_TO_STAY = 40
_STEPS_IN_RANGE = 6.0


@dataclass(frozen=True, slots=True)
class AnswersTogether:
    """A sensor and a controller work together: each answer fits a current input, and the answers continue.

    If the sensor subscribes to the answers, types and QoS must be compatible.

    The controller may answer each input, publish only on change, or publish on a timer of up to a second. If inputs are
    on both sides of the threshold, both answers must occur. Inputs that never change, or that are only
    drawn from one side, prove nothing; inputs that change too slowly to reach the other side are accepted.

    If answers are rare, as from a timer of a second, a slightly wrong limit may go unnoticed: `threshold_response`
    judges the limit itself.

    Attributes:
        input: Topic of the sensor.
        output: Topic of the controller.
        threshold: Where the answer changes; the threshold itself is not above.
        above: Answer expected above the threshold.
        otherwise: Answer expected at or below it.
        input_field: Path of the number in the input; by default `data`, or else its only number.
        output_field: The same in the answers.
        unit: Unit of the input, for reasons and charts, e.g. `m`.
    """

    roles: ClassVar[Roles] = Roles(hears=("input",), speaks=("input", "output"))
    input: str
    output: str
    threshold: float
    above: float
    otherwise: float
    input_field: Annotated[str, FieldOf("input")] = ""
    output_field: Annotated[str, FieldOf("output")] = ""
    unit: str = ""

    @property
    def expected(self) -> str:
        limit = f"{number(self.threshold)}{in_unit(self.unit)}"
        answers = f"{number(self.above)} above {limit}, {number(self.otherwise)} otherwise"
        return f"every {self.input} message of one node answered by the other on {self.output}: {answers}"

    def judge(self, trace: Trace) -> Finding:
        sent, answered = published(trace, self.input), published(trace, self.output)
        for topic, field, messages in (
            (self.input, self.input_field, sent),
            (self.output, self.output_field, answered),
        ):
            if not messages:
                return self._silent(trace, topic)
            if len(published_numbers(trace, topic, field)) < len(messages):
                type_, problem = messages[0].type, Problem(ProblemKind.NO_NUMBER, (topic,))
                return not_met(f"{topic}: {quote(type_)} carries no number", {"type": type_}, problem=problem)
        inputs = published_numbers(trace, self.input, self.input_field)
        answers = _last_of_instant(published_numbers(trace, self.output, self.output_field))
        evidence = self._evidence(inputs, answers)
        return (
            self._contradictory(trace, inputs, evidence)
            or self._wrong_answer(trace, inputs, answers, evidence)
            or self._stopped_sensor(trace, inputs, evidence)
            or self._stopped_controller(trace, inputs, answers, evidence)
            or self._one_sided(inputs, answers, evidence)
            or _kept_apart(trace, self.output)
            or self._all_well(inputs, answers, evidence)
        )

    def _expected(self, value: float) -> float:
        return self.above if value > self.threshold else self.otherwise

    @property
    def _wrong(self) -> Problem:
        return Problem(ProblemKind.WRONG_ANSWER, (self.input, self.output))

    def _evidence(self, inputs: Sequence[Reading], answers: Sequence[Reading]) -> dict[str, int]:
        changes = sum(a.value != b.value for a, b in pairwise(answers))
        return {
            "inputs": len(inputs),
            "inputs_above": sum(r.value > self.threshold for r in inputs),
            "answers": len(answers),
            "answer_changes": changes,
        }

    def _silent(self, trace: Trace, topic: str) -> Finding:
        """Return why one of the two nodes publishes nothing; incompatible types or QoS come first."""
        apart = _kept_apart(trace, self.input) if topic == self.output else None
        if apart is not None and first_fault(trace) is None:
            return apart
        found = explain_no_message(trace, topic)
        if FAULT_KEY in found.evidence:
            return found
        return replace(found, problem=Problem(ProblemKind.NO_MESSAGE, (topic,)))

    def _contradictory(self, trace: Trace, inputs: Sequence[Reading], evidence: dict[str, int]) -> Finding | None:
        """Return a finding if different answers of one instant fit no current input."""
        times, jitter_ns = [r.t_ns for r in inputs], JITTER_NS[trace.clock]
        for one, following in pairwise(published_numbers(trace, self.output, self.output_field)):
            recent = _recent(inputs, times, one.t_ns, jitter_ns)
            # at the instant of the first input, a timer may have fired before it
            if one.t_ns != following.t_ns or one.value == following.value or not recent or one.t_ns == times[0]:
                continue
            if any(within(one.value, self._expected(r.value), EXACT) for r in recent):
                continue
            both = " and ".join(map(number, sorted((one.value, following.value))))
            reason = f"{moment(one.t_ns)}, {self.output}: {both} at the same time for {number(recent[-1].value)}"
            reason += f"{in_unit(self.unit)} on {self.input}, expected {number(self._expected(recent[-1].value))} only"
            hint = f"publish one answer to each number on {self.input}"
            known = evidence | {"first_wrong_s": seconds(one.t_ns)}
            return not_met(reason, known, hint=hint, problem=self._wrong)
        return None

    def _wrong_answer(
        self, trace: Trace, inputs: Sequence[Reading], answers: Sequence[Reading], evidence: dict[str, int]
    ) -> Finding | None:
        times, jitter_ns, timed = [r.t_ns for r in inputs], JITTER_NS[trace.clock], _on_a_timer(answers)
        for answer in answers:
            recent = _recent(inputs, times, answer.t_ns, jitter_ns)
            # until the first input arrives, a timer may publish either answer
            first = timed and answer.t_ns <= times[0] + jitter_ns
            if first and any(within(answer.value, either, EXACT) for either in (self.above, self.otherwise)):
                continue
            if not recent or any(within(answer.value, self._expected(r.value), EXACT) for r in recent):
                continue
            value, unit = recent[-1].value, in_unit(self.unit)
            reason = f"{moment(answer.t_ns)}, {self.output}: {number(answer.value)} for {number(value)}{unit} on "
            reason += f"{self.input}, expected {number(self._expected(value))}"
            return self._behind(reason, inputs, answers, evidence | {"first_wrong_s": seconds(answer.t_ns)})
        return self._inconsistent(trace, inputs, answers, evidence)

    def _behind(
        self, reason: str, inputs: Sequence[Reading], answers: Sequence[Reading], evidence: Mapping[str, float]
    ) -> Finding:
        """Return that an answer is wrong, and by how much the answers lag if that explains all of them."""
        behind = _steps_behind(inputs, answers, lambda got, value: within(got, self._expected(value), EXACT))
        if not behind:
            return not_met(reason, evidence, problem=self._wrong)
        reason += f"; the answers fit the input of {counted(behind, 'message')} earlier"
        hint = f"answer the newest message on {self.input}"
        known, late = {**evidence, "behind": behind}, AnswerFacts(late=True)
        return not_met(reason, known, hint=hint, problem=self._wrong, facts=late)

    def _inconsistent(
        self, trace: Trace, inputs: Sequence[Reading], answers: Sequence[Reading], evidence: dict[str, int]
    ) -> Finding | None:
        """Return a finding if no common delay explains most answers; None if one does."""
        times = [r.t_ns for r in inputs]
        later = [a for a in answers if a.t_ns - _CURRENT_NS > times[0]]
        if len(later) < _FEWEST_FOR_SHARE:
            return None
        prompt = trace.clock is ClockKind.VIRTUAL and len(inputs) <= 2 * len(answers) <= 2 * len(inputs)
        enough = _AGREEING_SHARE_PROMPT if prompt else _AGREEING_SHARE
        shares = []
        # a controller with its own timer is late by at most one period
        latest_ns = min(_CURRENT_NS, _usual_gap(answers) - 1) if prompt else _CURRENT_NS
        for delay_ns in (-JITTER_NS[trace.clock], *range(0, latest_ns + 1, _CURRENT_NS // 5)):
            for side in (bisect_left, bisect_right):
                seen = [inputs[side(times, a.t_ns - delay_ns) - 1] for a in later]
                fitting = sum(within(a.value, self._expected(r.value), EXACT) for a, r in zip(later, seen, strict=True))
                shares.append(fitting / len(later))
                if shares[-1] >= enough:
                    return None
        reason = f"{self.output}: at best {number(100 * max(shares))} % of {len(later)} answers fit {self.input}, "
        return self._behind(f"{reason}expected all of them", inputs, answers, evidence)

    def _stopped_sensor(self, trace: Trace, inputs: Sequence[Reading], evidence: dict[str, int]) -> Finding | None:
        gaps = [b.t_ns - a.t_ns for a, b in pairwise(inputs)]
        usual = statistics.median(gaps) if gaps else 0
        last = inputs[-1].t_ns
        if trace.stop_ns - last <= max(_SPEAK_NS, 3 * usual):
            return None
        return self._stopped(trace, self.input, last, evidence)

    def _stopped_controller(
        self, trace: Trace, inputs: Sequence[Reading], answers: Sequence[Reading], evidence: dict[str, int]
    ) -> Finding | None:
        times = [a.t_ns for a in answers]
        for asked in inputs:
            if asked.t_ns + _SPEAK_NS >= trace.stop_ns:
                break
            later = bisect_left(times, asked.t_ns)
            if later < len(answers) and times[later] <= asked.t_ns + _SPEAK_NS:
                continue
            before = answers[:later]
            # before its first answer, the state of a controller that publishes only on change is unknown
            if before and not within(before[-1].value, self._expected(asked.value), EXACT):
                return self._stopped(trace, self.output, before[-1].t_ns, evidence)
        return None

    def _stopped(self, trace: Trace, topic: str, last_ns: int, evidence: dict[str, int]) -> Finding:
        fault = next((f for f in trace.faults() if f.t_ns <= trace.stop_ns), None)
        reason = f"{topic}: no message after {moment(last_ns)}, expected messages until {span(trace.stop_ns)}"
        known, problem = evidence | {"last_s": seconds(last_ns)}, Problem(ProblemKind.STOPPED, (topic,))
        if fault is None:
            return not_met(reason, known, problem=problem)
        reason += f"; {fault_sentence(fault)}"
        return not_met(reason, known, hint=fault_hint(fault), fault=fault, problem=problem)

    def _one_sided(
        self, inputs: Sequence[Reading], answers: Sequence[Reading], evidence: dict[str, int]
    ) -> Finding | None:
        expected = [self._expected(r.value) for r in inputs]
        fixed = Problem(ProblemKind.NEVER_CHANGES, (self.input, self.output))
        if len({r.value for r in inputs}) == 1:
            reason = f"{self.output}: never changes, because {self.input} is {number(inputs[0].value)}"
            return not_met(f"{reason}{in_unit(self.unit)} throughout", evidence, problem=fixed)
        if len(set(expected)) == 1 and _stays(inputs):
            low, high = min(r.value for r in inputs), max(r.value for r in inputs)
            reason = f"{self.output}: never changes, because {self.input} stays between {number(low)} and "
            return not_met(f"{reason}{number(high)}{in_unit(self.unit)}", evidence, problem=fixed)
        # a timer of 1 s may miss rare inputs; a controller that answers every other input may not
        often = 0 if 2 * len(answers) >= len(inputs) else _RARE * len(inputs)
        asked = {w for w, count in Counter(expected).items() if count > often}
        given = {a.value for a in answers}
        lacking = sorted(w for w in asked if not any(within(g, w, EXACT) for g in given))
        if not lacking:
            return None
        reason = f"{self.output}: never {number(lacking[0])}, though {self.input} was on both sides of "
        return not_met(f"{reason}{number(self.threshold)}{in_unit(self.unit)}", evidence, problem=self._wrong)

    def _all_well(self, inputs: Sequence[Reading], answers: Sequence[Reading], evidence: dict[str, int]) -> Finding:
        reason = (
            f"{self.output}: {counted(len(answers), 'answer')} to {counted(len(inputs), 'value')} on {self.input}, "
        )
        return met(f"{reason}all correct; the answer changed {counted(evidence['answer_changes'], 'time')}", evidence)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the messages between the student's two nodes, with the threshold and the expected answers."""
        expected = [
            Reading(r.t_ns, self._expected(r.value)) for r in published_numbers(trace, self.input, self.input_field)
        ]
        return _drawing(self, expected)


def _usual_gap(answers: Sequence[Reading]) -> int:
    return round(statistics.median(b.t_ns - a.t_ns for a, b in pairwise(answers)))


def _on_a_timer(answers: Sequence[Reading]) -> bool:
    """Return whether answers may come from a timer: nearly all have the same gap."""
    if len(answers) < _FEWEST_FOR_SHARE:
        return True
    usual = _usual_gap(answers)
    even = sum(abs(b.t_ns - a.t_ns - usual) <= _EVEN_NS for a, b in pairwise(answers))
    return even >= _EVEN_SHARE * (len(answers) - 1)


def _stays(inputs: Sequence[Reading]) -> bool:
    """Return whether the inputs jump within all of their range, instead of drifting slowly beyond it."""
    steps = [abs(b.value - a.value) for a, b in pairwise(inputs)]
    values = [r.value for r in inputs]
    return len(steps) >= _FEWEST_TO_STAY and max(values) - min(values) <= _STEPS_IN_RANGE * statistics.median(steps)


def _recent(inputs: Sequence[Reading], times: Sequence[int], t_ns: int, jitter_ns: int) -> Sequence[Reading]:
    """Return the inputs that were current at some moment of the quarter second up to and including `t_ns`.

    On the wall clock, an input and the answer to it may reach the observer in the wrong order.
    """
    stop = bisect_right(times, t_ns + jitter_ns)
    start = bisect_right(times, t_ns - _CURRENT_NS, hi=stop)
    return inputs[max(0, start - 1) : stop]


def _kept_apart(trace: Trace, topic: str) -> Finding | None:
    """Return why the two ends of a topic cannot communicate, by type or QoS; None if they can."""
    publishers = student_endpoints(trace, "publisher", topic)
    subscriptions = student_endpoints(trace, "subscription", topic)
    pairs = [(p, s) for p in publishers for s in subscriptions if p.participant != s.participant]
    alike = [(p, s) for p, s in pairs if p.type == s.type]
    if not pairs or any(unmet_policy(p, s) is None for p, s in alike):
        return None
    here, there = (alike or pairs)[0]
    evidence = {"publisher": [here.node, here.type], "subscription": [there.node, there.type]}
    problem = Problem(ProblemKind.KEPT_APART, (topic,))
    one, other = _speakers(trace, here, there)
    policy = unmet_policy(here, there)
    if not alike or policy is None:
        text = f"{one} publishes {quote(here.type)}, {other} subscribes {quote(there.type)}"
        hint = f"use the same message type for {topic} in both files"
        return not_met(f"{topic}: {text}, so no message arrives", evidence, hint=hint, problem=problem)
    text = f"{one} offers {policy[0]}, {other} asks for {policy[1]}"
    hint = "pass the queue depth 10 as QoS on both sides"
    return not_met(f"{topic}: {text}, so no message arrives", evidence, hint=hint, problem=problem)


def _speakers(trace: Trace, here: Endpoint, there: Endpoint) -> tuple[str, str]:
    """Return the files of two processes if names and logs identify both, else their nodes."""
    files = _file_of(trace, here), _file_of(trace, there)
    if files[0] and files[1] and files[0] != files[1]:
        return files[0], files[1]
    one, other = quote(here.node), quote(there.node)
    return one, other if one != other else f"another node named {other}"


def _file_of(trace: Trace, endpoint: Endpoint) -> str:
    """Return the file whose process an endpoint belongs to; empty if its node has a name that another one has too."""
    everything = [e for kind in ("publisher", "subscription") for e in student_endpoints(trace, kind)]
    if len({e.participant for e in everything if e.node == endpoint.node}) > 1:
        return ""
    bare = endpoint.node.strip("/").replace("/", ".")
    for record in trace.records():
        if record.logger == bare:
            return record.process
    written: list[LogRecord | OutputLine | Fault] = [*trace.records(), *trace.lines(), *trace.faults()]
    named = (o.process for o in written if o.process.removesuffix(".py") == bare.rsplit(".", 1)[-1])
    return next(named, "")


def _lag_ns(inputs: Sequence[Reading], answers: Sequence[Reading], right: _Right) -> int | None:
    """Return by how much the answers lag behind the inputs that they are right for; None if they do not."""
    found: int | None = None
    for lag in range(0, _LONGEST_LAG_NS + 1, _LAG_STEP_NS):
        fits = _fit(inputs, answers, right, lag)
        if fits and lag == 0:
            return None
        if fits:
            found = lag
        elif found is not None:
            break
    return found


def _fit(inputs: Sequence[Reading], answers: Sequence[Reading], right: _Right, lag: int) -> bool:
    times = [r.t_ns for r in inputs]
    asked = [
        (a.value, inputs[bisect_right(times, a.t_ns - lag) - 1].value) for a in answers if a.t_ns - lag >= times[0]
    ]
    changes = len({got for got, _ in asked}) > 1
    return len(asked) >= _FEWEST_ANSWERS and changes and all(right(got, value) for got, value in asked)


def _steps_behind(inputs: Sequence[Reading], answers: Sequence[Reading], right: _Right) -> int:
    """Return how many inputs back the input is that nearly every answer is right for; 0 if there is none."""
    times = [r.t_ns for r in inputs]
    newest = [(a.value, bisect_right(times, a.t_ns) - 1) for a in answers]
    for behind in range(_FURTHEST_BEHIND + 1):
        asked = [(got, inputs[place - behind].value) for got, place in newest if place >= behind]
        if len(asked) < _FEWEST_ANSWERS or len({got for got, _ in asked}) < 2:
            return 0
        if sum(right(got, value) for got, value in asked) >= _SURE_BEHIND * len(asked):
            return behind
    return 0


def _last_of_instant(series: Sequence[Reading]) -> tuple[Reading, ...]:
    """Return one reading per instant: the last one."""
    return tuple({r.t_ns: r for r in series}.values())


def _drawing(check: ThresholdResponse | AnswersTogether, expected: Sequence[Reading]) -> Drawing:
    """Return the inputs of a controller with its threshold, above its answers with the expected ones."""
    level = Level(check.threshold, f"{number(check.threshold)}{in_unit(check.unit)}", name="threshold")
    heard = Plot(check.input, levels=(level,), unit=check.unit)
    return Drawing((heard, Plot(check.output, expected=tuple(expected))))


CHECKS = {"threshold_response": ThresholdResponse, "answers_together": AnswersTogether}
