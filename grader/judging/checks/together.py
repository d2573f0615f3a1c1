"""The check on a sensor and a controller that run together: every number gets the right answer."""

from __future__ import annotations

import statistics
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, ClassVar

from grader.core.dataclass import dataclass
from grader.core.exercise import Finding, Problem, ProblemKind, Roles
from grader.core.quantities import NS_PER_MS, FieldOf, counted, seconds, within
from grader.core.trace import ClockKind, Endpoint, Fault, LogRecord, OutputLine, Trace, unmet_policy
from grader.judging.facts import AnswerFacts
from grader.judging.findings import FAULT_KEY, explain_no_message, fault_hint, fault_sentence, first_fault, met, not_met
from grader.judging.plots import Drawing, threshold_drawing
from grader.judging.series import steps_behind
from grader.judging.values import (
    EXACT,
    JITTER_NS,
    Reading,
    last_of_instant,
    published,
    published_numbers,
    student_endpoints,
)
from grader.judging.wording import in_unit, moment, number, quote, span

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
    on both sides of the threshold, both answers must occur. Inputs that never change, or that are drawn again and again
    from one side only, prove nothing; inputs that change too slowly to reach the other side are accepted.

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
        return f"every {self.input} of the one node answered by the other on {self.output}: {answers}"

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
        answers = last_of_instant(published_numbers(trace, self.output, self.output_field))
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
            reason = f"{moment(one.t_ns)}, {self.output}: {both} at one instant for {number(recent[-1].value)}"
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
        behind = steps_behind(inputs, answers, lambda got, value: within(got, self._expected(value), EXACT))
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
        reason = f"{topic}: nothing after {moment(last_ns)}, expected to go on to {span(trace.stop_ns)}"
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
            return not_met(f"{reason}{in_unit(self.unit)} all the time", evidence, problem=fixed)
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
        return met(f"{reason}all right; the answer changed {counted(evidence['answer_changes'], 'time')}", evidence)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the messages between the student's two nodes, with the threshold and the expected answers."""
        expected = [
            Reading(r.t_ns, self._expected(r.value)) for r in published_numbers(trace, self.input, self.input_field)
        ]
        return threshold_drawing(self, expected)


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
