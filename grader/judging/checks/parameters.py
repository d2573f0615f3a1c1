"""Checks on parameters: that a node declares one, with which value, and that setting it changes what the node does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from grader.core.errors import HarnessError
from grader.core.exercise import Finding
from grader.core.quantities import NS_PER_S, DurationNs, seconds, within
from grader.core.trace import Message, Trace
from grader.judging.findings import met, not_met
from grader.judging.parameters import Got, Set, asked_for, got, settings
from grader.judging.paths import NoSuchField, at_path
from grader.judging.rules import FieldRule, shown
from grader.judging.silence import explain_no_message, fault_hint, first_fault
from grader.judging.values import as_number, published
from grader.judging.wording import fault_sentence, listed, moment, number, quote, span

_DECLARE_HINT = "declare it where the node is created: self.declare_parameter('{name}', ...)"
_READ_HINT = "read the parameter each time it is used, self.get_parameter('{name}').value, or react to its change"


@dataclass(frozen=True, slots=True)
class ParameterDeclared:
    """A student's node has a parameter, with the value and of the type named; read before anybody sets it.

    The scenario has to ask for it: `parameter` without `set`.

    Attributes:
        name: Name of the parameter.
        node: Fully qualified name of the node; the one that was asked if left out.
        value: Default value expected; free if left out.
        tolerance: Largest difference from a number expected.
        type: Type expected; a whole and a fractional number are alike if left out.
    """

    name: str
    node: str | None = None
    value: str | float | bool | None = None
    tolerance: float = 1e-9
    type: Literal["bool", "integer", "double", "string"] | None = None

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        kind = f" of type {self.type}" if self.type else ""
        value = "" if self.value is None else f", by default {shown(self.value)}"
        return f"the parameter {self.name}{kind}{value}"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if the first answer to the question for it fits."""
        calls = asked_for(trace, self.name, self.node)
        answers = [found for call in calls if (found := got(call, self.name)) is not None]
        if not answers:
            return _unanswered(trace, self.name, self.node, asked=bool(calls))
        found = min(answers, key=lambda a: a.t_ns)
        evidence = {"node": found.node, "name": self.name, "type": found.type, "value": found.value}
        if not found.type:
            reason = f"{quote(found.node)}: has no parameter {self.name}, expected {self.expected}"
            return not_met(reason, evidence, hint=_DECLARE_HINT.format(name=self.name))
        flaw = self._flaw(found)
        said = f"{quote(found.node)}: the parameter {self.name} is {shown(found.value)} [{found.type}]"
        return not_met(f"{said}, expected {flaw}", evidence) if flaw else met(said, evidence)

    def _flaw(self, found: Got) -> str:
        if self.type not in (None, found.type):
            return f"type {self.type}"
        if self.value is None or FieldRule(equals=self.value, tolerance=self.tolerance).allows(found.value):
            return ""
        return shown(self.value)


def _unanswered(trace: Trace, name: str, node: str | None, *, asked: bool) -> Finding:
    """Return no credit and why nobody told a parameter.

    Raises:
        HarnessError: Nobody asked a node that was there.
    """
    fault = first_fault(trace)
    if fault is not None:
        reason = f"{fault_sentence(fault)}; the parameter {name} could not be asked for"
        return not_met(reason, hint=fault_hint(fault), fault=fault)
    nodes = list(dict.fromkeys(n for graph in trace.graphs() for n in graph.nodes))
    if node is not None and node not in nodes:
        reason = f"{node}: not in the ROS graph, so it was not asked for {name}; found {listed(nodes) or 'no node'}"
        return not_met(reason, {"nodes": nodes[:20]}, blocked_by="node_name")
    if asked:
        who = node or "the node"
        return not_met(f"{who}: no answer to the question for {name}", hint="spin the node: rclpy.spin(node)")
    raise HarnessError(f"the recording does not ask for the parameter {name}")


@dataclass(frozen=True, slots=True)
class ParameterTakesEffect:
    """After a parameter was set, what the node publishes follows it: a field, a rate or a period.

    The scenario has to set it: `parameter` with `set`. Each value that was set is looked at from the time allowed up to
    the next one, and a value that the node refuses is a mistake.

    Attributes:
        name: Name of the parameter.
        topic: Topic on which the effect shows.
        effect: `field`: the field equals the value; `rate`: messages come at that many hertz; `period`: one comes in
            that many seconds.
        field: Path of the field.
        tolerance: Largest difference; of a field in its unit, of a rate or period as a share of it.
        within: How soon the effect must show.
        node: Fully qualified name of the node; the one whose parameter was set if left out.
    """

    name: str
    topic: str
    effect: Literal["field", "rate", "period"] = "field"
    field: str = "data"
    tolerance: float = 0.05
    within: DurationNs = NS_PER_S
    node: str | None = None

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        what = self.field if self.effect == "field" else f"the {self.effect}"
        return f"within {span(self.within)} of setting {self.name}, {what} of {self.topic} has its value"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if every value set took effect; the reason names the first that did not."""
        tries = settings(trace, self.name, self.node)
        if not any(s.answered for s in tries):
            return _unanswered(trace, self.name, self.node, asked=bool(tries))
        messages = published(trace, self.topic)
        if not messages:
            return explain_no_message(trace, self.topic)
        stops = [*(s.t_ns for s in tries), trace.stop_ns][1:]
        evidence: dict[str, Any] = {"set": [[seconds(s.t_ns), s.value, s.taken] for s in tries]}
        for one, stop_ns in zip(tries, stops, strict=True):
            flaw, hint = self._flaw(one, stop_ns, messages)
            if flaw:
                fault = first_fault(trace)
                reason = f"{moment(one.t_ns)}, {self.name} = {shown(one.value)}: {flaw}"
                if fault is not None and fault.t_ns <= stop_ns:
                    reason = f"{reason}; {fault_sentence(fault)}"
                    return not_met(reason, evidence, hint=fault_hint(fault), fault=fault)
                return not_met(reason, evidence, hint=hint)
        values = ", ".join(shown(s.value) for s in tries)
        return met(f"{self.topic}: follows {self.name} ({values}) within {span(self.within)}", evidence)

    def _flaw(self, one: Set, stop_ns: int, messages: Sequence[Message]) -> tuple[str, str]:
        """Return what is wrong after one value was set, and a hint; empty if nothing is."""
        if not one.answered:
            return "no answer", "spin the node: rclpy.spin(node)"
        if not one.taken:
            return f"refused{': ' + quote(one.why, 80) if one.why else ''}", _DECLARE_HINT.format(name=self.name)
        start_ns = one.t_ns + self.within
        if start_ns >= stop_ns:
            raise HarnessError(f"{self.name}: the next value, or the end, comes before the effect has to show")
        after = [m for m in messages if start_ns <= m.t_ns < stop_ns]
        hint = _READ_HINT.format(name=self.name)
        if self.effect == "field":
            return self._field_flaw(one, after), hint
        return self._pace_flaw(one, after), hint

    def _field_flaw(self, one: Set, after: Sequence[Message]) -> str:
        if not after:
            return f"no message on {self.topic} afterwards"
        if isinstance(one.value, (list, tuple)):
            rule = FieldRule(items=tuple(one.value), tolerance=self.tolerance)
        else:
            rule = FieldRule(equals=one.value, tolerance=self.tolerance)
        wrong = next((m for m in after if not rule.allows(_held(m, self.field))), None)
        if wrong is None:
            return ""
        return f"{self.field} is {shown(_held(wrong, self.field))} at {moment(wrong.t_ns)}, expected {rule.wanted}"

    def _pace_flaw(self, one: Set, after: Sequence[Message]) -> str:
        wanted = as_number(one.value)
        if wanted is None or not wanted > 0:
            raise HarnessError(f"{self.name}: {shown(one.value)} is no rate and no period")
        rate = wanted if self.effect == "rate" else 1 / wanted
        if len(after) < 3:
            return f"{len(after)} messages on {self.topic} afterwards, expected {number(rate)} Hz"
        measured = (len(after) - 1) / seconds(max(1, after[-1].t_ns - after[0].t_ns))
        if within(measured, rate, self.tolerance * rate):
            return ""
        return f"{measured:.3f} Hz on {self.topic} afterwards, expected {number(rate)} Hz"


def _held(message: Message, path: str) -> Any:
    try:
        return at_path(message.value, path)
    except NoSuchField:
        return None
