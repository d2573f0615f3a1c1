"""Checks on a program: its parameters, how it ends, and what its source uses."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

from grader.grading.judging.charts import drawn_case, expected_series, series
from grader.grading.judging.findings import (
    explain_fault,
    explain_no_message,
    fault_hint,
    fault_sentence,
    faulted,
    faults_before_stop,
    first_fault,
    met,
    not_met,
)
from grader.grading.judging.plots import Drawing, Plot
from grader.grading.judging.service_calls import (
    LATENESS_NS,
    ParameterSetting,
    ReportedParameter,
    asked_for,
    reported_parameter,
    settings,
)
from grader.grading.judging.source import Source, read_source
from grader.grading.judging.values import FieldRule, as_number, published, shown_value, value_at
from grader.grading.model.chart import Look, Panel
from grader.grading.model.exercise import Finding, Location, ProblemKind, Roles
from grader.grading.model.measures import Reading
from grader.grading.model.wording import first_few, moment, number, quote, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S, DurationNs, FieldOf, counted, seconds, within
from grader.runtime.model.trace import FaultKind, Message, Trace

_DECLARE_HINT = "declare it where the node is created: self.declare_parameter('{name}', ...)"
_READ_HINT = "read the parameter each time it is used, self.get_parameter('{name}').value, or react to its change"


@dataclass(frozen=True, slots=True)
class ParameterDeclared:
    """A student's node has a parameter with the given value and type; read before it is set.

    The scenario needs the stimulus `parameter` without `set`.

    Attributes:
        name: Name of the parameter.
        node: Fully qualified name of the node; the one that the stimulus addresses if left out.
        value: Expected default value; free if left out.
        tolerance: Largest difference from an expected number.
        type: Expected type; if left out, whole and fractional numbers are equal.
    """

    name: str
    node: str | None = None
    value: str | float | bool | None = None
    tolerance: float = 1e-9
    type: Literal["bool", "integer", "double", "string"] | None = None

    @property
    def expected(self) -> str:
        kind = f" of type {self.type}" if self.type else ""
        value = "" if self.value is None else f", by default {shown_value(self.value)}"
        return f"the parameter {self.name}{kind}{value}"

    def judge(self, trace: Trace) -> Finding:
        calls = asked_for(trace, self.name, self.node)
        answers = [found for call in calls if (found := reported_parameter(call, self.name)) is not None]
        if not answers:
            return _unanswered(trace, self.name, self.node, asked=bool(calls))
        # The first answer: later ones may be about a value that the grader has set.
        found = min(answers, key=lambda a: a.t_ns)
        evidence = {"node": found.node, "name": self.name, "type": found.type, "value": found.value}
        if not found.type:
            reason = f"{quote(found.node)}: has no parameter {self.name}, expected {self.expected}"
            return not_met(reason, evidence, hint=_DECLARE_HINT.format(name=self.name), problem=ProblemKind.ABSENT)
        flaw = self._flaw(found)
        text = f"{quote(found.node)}: the parameter {self.name} is {shown_value(found.value)} [{found.type}]"
        if not flaw:
            return met(text, evidence)
        return not_met(f"{text}, expected {flaw}", evidence, problem=ProblemKind.WRONG_VALUE)

    def _flaw(self, found: ReportedParameter) -> str:
        if self.type not in (None, found.type):
            return f"type {self.type}"
        if self.value is None or FieldRule(equals=self.value, tolerance=self.tolerance).allows(found.value):
            return ""
        return shown_value(self.value)


def _unanswered(trace: Trace, name: str, node: str | None, *, asked: bool) -> Finding:
    """Return no credit with the reason why no node reported a parameter.

    Raises:
        HarnessError: The node was there, but nobody asked it.
    """
    if crashed := explain_fault(trace, f"the parameter {name} could not be read"):
        return crashed
    nodes = list(dict.fromkeys(n for graph in trace.graphs() for n in graph.nodes))
    # A node of another name is the problem of the check on names; here it only prevents the question.
    if node is not None and node not in nodes:
        reason = f"{node}: not in the ROS graph, so {name} could not be read; found {first_few(nodes) or 'no node'}"
        return not_met(reason, {"nodes": nodes[:20]}, blocked_by="node_name", problem=ProblemKind.OTHER_NAME)
    if asked:
        who = node or "the node"
        reason, hint = f"{who}: no response to the request for the parameter {name}", "spin the node: rclpy.spin(node)"
        return not_met(reason, hint=hint, problem=ProblemKind.NO_ANSWER)
    raise HarnessError(f"the recording does not request the parameter {name}")


#: More messages than this, and twice as many as asked for, are a flood.
_FLOOD = 100
#: Longest time without a message before the next value, or the end, in periods.
_LONGEST_GAP = 2.5


@dataclass(frozen=True, slots=True)
class ParameterTakesEffect:
    """After a parameter was set, the published messages follow it: a field, a rate or a period.

    The scenario needs the stimulus `parameter` with `set`. Each value is judged from the allowed delay up to the next
    value; a value that the node rejects is a mistake.

    Attributes:
        name: Name of the parameter.
        topic: Topic that shows the effect.
        effect: `field`: the field equals the value; `rate`: the value is the rate in hertz; `period`: the value is the
            time between messages in seconds.
        field: Path of the field.
        tolerance: Largest difference; of a field in its unit, of a rate or period as a share of it.
        within: Longest delay of the effect.
        node: Fully qualified name of the node; the one whose parameter was set if left out.
        text: What the field holds if the value is a part of it, with `{}` in its place, such as `Hello {}!`.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    name: str
    topic: str
    effect: Literal["field", "rate", "period"] = "field"
    field: Annotated[str, FieldOf("topic")] = "data"
    tolerance: float = 0.05
    within: DurationNs = NS_PER_S
    node: str | None = None
    text: str | None = None

    def __post_init__(self) -> None:
        if self.text is not None and (self.effect != "field" or self.text.count("{}") != 1):
            raise ValueError("expected `text` to hold {} once, and the effect `field`")

    @property
    def expected(self) -> str:
        what = self.field if self.effect == "field" else f"the {self.effect}"
        return f"within {span(self.within)} of setting {self.name}, {what} of {self.topic} has its value"

    def judge(self, trace: Trace) -> Finding:
        tries = settings(trace, self.name, self.node)
        if not any(s.answered for s in tries):
            return _unanswered(trace, self.name, self.node, asked=bool(tries))
        messages = published(trace, self.topic)
        if not messages:
            return explain_no_message(trace, self.topic)
        stops = [*(s.t_ns for s in tries), trace.stop_ns][1:]
        evidence: dict[str, object] = {"set": [[seconds(s.t_ns), s.value, s.taken] for s in tries]}
        for one, stop_ns in zip(tries, stops, strict=True):
            flaw, hint = self._flaw(one, stop_ns, messages)
            if flaw:
                fault = first_fault(trace)
                reason = f"{moment(one.t_ns)}, {self.name} = {shown_value(one.value)}: {flaw}"
                # A crash while this value applied is why its effect is missing; one after it is not.
                if fault is not None and fault.t_ns <= stop_ns:
                    return faulted(fault, reason, evidence, last=True)
                return not_met(reason, evidence, hint=hint)
        values = ", ".join(shown_value(s.value) for s in tries)
        return met(f"{self.topic}: follows {self.name} ({values}) within {span(self.within)}", evidence)

    def drawing(self, trace: Trace) -> Drawing:
        """Return what the parameter changes, with its value from the time on when it has to show."""
        tries = settings(trace, self.name, self.node)
        stops = [*(s.t_ns for s in tries), trace.stop_ns][1:]
        times = [m.t_ns for m in published(trace, self.topic)]
        cases = tuple(
            drawn_case(s.t_ns, stop_ns, f"{self.name} = {shown_value(s.value)}{'' if s.taken else ', refused'}")
            for s, stop_ns in zip(tries, stops, strict=True)
        )
        known = [(s, as_number(s.value)) for s in tries]
        wanted = tuple(Reading(s.t_ns + self.within, value) for s, value in known if value is not None)
        wanted += tuple(Reading(trace.stop_ns, r.value) for r in wanted[-1:] if r.t_ns < trace.stop_ns)
        title = f"{self.topic} after {self.name} was set"
        if self.effect == "field":
            return Drawing((Plot(self.topic, (self.field,), expected=wanted),), cases=cases, title=title)
        if len(times) < 2:
            return Drawing((Plot(self.topic),), cases=cases, title=title)
        lengths = [seconds(b - a) for a, b in pairwise(times)]
        period = self.effect == "period"
        points = [(seconds(t), d if period or not d else 1 / d) for t, d in zip(times[1:], lengths, strict=True)]
        line = series(f"{self.effect} of {self.topic}", points, look=Look.DOTS)
        panel = Panel(self.effect, "s" if period else "Hz", (expected_series(wanted), line))
        said = f"{counted(len(times), 'message')}, {min(lengths):.3f} s to {max(lengths):.3f} s apart."
        return Drawing(panels=((panel, said),), cases=cases, title=title)

    def _flaw(self, one: ParameterSetting, stop_ns: int, messages: Sequence[Message]) -> tuple[str, str]:
        """Describe what is wrong after a value was set, and a hint; empty if nothing is."""
        if not one.answered:
            return "no answer", "spin the node: rclpy.spin(node)"
        if not one.taken:
            return f"refused{': ' + quote(one.why, 80) if one.why else ''}", _DECLARE_HINT.format(name=self.name)
        start_ns = one.t_ns + self.within
        hint = _READ_HINT.format(name=self.name)
        if start_ns >= stop_ns:
            at_once = [m for m in messages if one.t_ns <= m.t_ns < stop_ns]
            rate = None if self.effect == "field" else self._rate(one)
            # A recording that is full of messages ends early.
            # Twice as many as asked for, and some: a flood ends the recording before the effect is due, and is the
            # student's. Anything else is a mistake of the rubric.
            if rate is None or len(at_once) <= _FLOOD + 2 * rate * seconds(self.within):
                raise HarnessError(f"{self.name}: the next value or the end comes before the effect is due")
            took_s = seconds(stop_ns - one.t_ns)
            return f"{len(at_once)} messages on {self.topic} within {took_s:.3f} s, expected {number(rate)} Hz", hint
        after = [m for m in messages if start_ns <= m.t_ns < stop_ns]
        if self.effect == "field":
            return self._field_flaw(one, after), hint
        return self._pace_flaw(one, after, stop_ns), hint

    def _rate(self, one: ParameterSetting) -> float:
        """Return the rate that a value asks for, in hertz."""
        wanted = as_number(one.value)
        if wanted is None or not wanted > 0:
            raise HarnessError(f"{self.name}: {shown_value(one.value)} is neither a rate nor a period")
        return wanted if self.effect == "rate" else 1 / wanted

    def _field_flaw(self, one: ParameterSetting, after: Sequence[Message]) -> str:
        if not after:
            return f"no message on {self.topic} afterwards"
        if isinstance(one.value, (list, tuple)):
            rule = FieldRule(items=tuple(one.value), tolerance=self.tolerance)
        elif self.text is not None:
            rule = FieldRule(equals=self.text.replace("{}", str(one.value)))
        else:
            rule = FieldRule(equals=one.value, tolerance=self.tolerance)
        wrong = next((m for m in after if not rule.allows(_held(m, self.field))), None)
        if wrong is None:
            return ""
        return (
            f"{self.field} is {shown_value(_held(wrong, self.field))} at {moment(wrong.t_ns)}, expected {rule.wanted}"
        )

    def _pace_flaw(self, one: ParameterSetting, after: Sequence[Message], stop_ns: int) -> str:
        rate = self._rate(one)
        # Two messages have one interval, and the first of them may come between two values.
        if len(after) < 3:
            return f"{len(after)} messages on {self.topic} afterwards, expected {number(rate)} Hz"
        # At least a nanosecond: messages of one instant are infinitely fast, and judged as such.
        measured = (len(after) - 1) / seconds(max(1, after[-1].t_ns - after[0].t_ns))
        if not within(measured, rate, self.tolerance * rate):
            return f"{measured:.3f} Hz on {self.topic} afterwards, expected {number(rate)} Hz"
        # The rate of some messages followed by silence is right on average.
        if seconds(stop_ns - after[-1].t_ns) > _LONGEST_GAP / rate:
            return f"no message on {self.topic} after {moment(after[-1].t_ns)}, expected {number(rate)} Hz"
        return ""


def _held(message: Message, path: str) -> Any:
    return value_at(message.value, path)


_SHUTDOWN_HINT = "end on Ctrl-C: except KeyboardInterrupt: pass, then destroy the node and rclpy.try_shutdown()"


@dataclass(frozen=True, slots=True)
class NoFault:
    """A process, or every one, survives the recording: no exception, no early end, no hanging.

    Anything after the stop signal is ignored.

    Attributes:
        process: File name of the student process; all of them if left out.
    """

    process: str | None = None

    @property
    def expected(self) -> str:
        return f"{self.process or 'every process'} runs to the end without an exception"

    def judge(self, trace: Trace) -> Finding:
        faults = faults_before_stop(trace, self.process)
        if not faults:
            return met(f"{self.process or 'every process'}: no fault in {span(trace.stop_ns)}", {"faults": 0})
        first = first_fault(trace, self.process) or faults[0]
        reason = f"{moment(first.t_ns)}: {fault_sentence(first)}"
        more = f"; {counted(len(faults), 'fault')} in all" if len(faults) > 1 else ""
        return not_met(reason + more, {"faults": len(faults)}, hint=fault_hint(first), fault=first)


@dataclass(frozen=True, slots=True)
class CleanShutdown:
    """A process stopped with Ctrl-C (SIGINT) ends soon, with exit code 0 or by that signal, and without another error.

    The scenario has to stop it: `shutdown` in the rubric.

    Attributes:
        process: File name of the student process.
        within: Longest time to its end.
    """

    process: str
    within: DurationNs = 2 * NS_PER_S

    @property
    def expected(self) -> str:
        return f"{self.process} ends within {number(seconds(self.within))} s of Ctrl-C, without another exception"

    def of_beginning(self) -> None:
        """Say that a beginning shows nothing, because it ends before Ctrl-C."""

    def judge(self, trace: Trace) -> Finding:
        signals = trace.marks("stop_signal", self.process)
        faults = trace.faults(self.process)
        if not signals:
            if faults:
                first = min(faults, key=lambda f: f.t_ns)
                reason = f"{fault_sentence(first)}; it ended before Ctrl-C"
                return not_met(reason, hint=fault_hint(first), fault=first)
            ended = trace.marks("exited", self.process)
            if ended:
                reason = f"{self.process} ended by itself at {moment(ended[0].t_ns)}, before it was stopped"
                return not_met(reason, problem=ProblemKind.ENDED)
            raise HarnessError(f"{self.process}: the scenario has no `shutdown`, so it was not stopped")
        asked_ns = signals[0].t_ns
        stopped = [m for m in trace.marks("stopped", self.process) if m.t_ns >= asked_ns]
        after = [f for f in faults if f.t_ns >= asked_ns]
        if stopped and not after:
            took = stopped[0].t_ns - asked_ns
            reason = f"{self.process}: ended {seconds(took):.3f} s after Ctrl-C"
            # On the wall clock, the end of a process is noticed a little later.
            if took <= self.within + LATENESS_NS[trace.clock]:
                return met(reason, {"took_s": seconds(took)})
            reason += f", expected within {number(seconds(self.within))} s"
            return not_met(reason, {"took_s": seconds(took)}, problem=ProblemKind.TOO_LATE)
        if after:
            reason = f"{moment(after[0].t_ns)}, after Ctrl-C: {fault_sentence(after[0])}"
            # An exception has a cause of its own, which a rule of diagnosis names.
            hint = "" if after[0].kind is FaultKind.EXCEPTION else _SHUTDOWN_HINT
            return not_met(reason, hint=hint, fault=after[0])
        reason = f"{self.process}: still running {span(self.within)} after Ctrl-C at {moment(asked_ns)}"
        return not_met(reason, {"asked_s": seconds(asked_ns)}, hint=_SHUTDOWN_HINT, problem=ProblemKind.STILL_RUNNING)


class _OfSource:
    """A check of a file's text, which is in no recording."""

    __slots__ = ()
    process: str

    def judge(self, trace: Trace) -> Finding:  # noqa: ARG002 - as every check
        raise HarnessError(f"{self.process}: its source was not kept")


@dataclass(frozen=True, slots=True)
class SourceUses(_OfSource):
    """A student's file contains a class that derives from a given one, and calls of given functions or methods.

    The file is read, not run: imports under other names are followed, and unreachable lines count.

    Attributes:
        process: File name of the student process.
        derives_from: Classes of which one must be a base, e.g. `rclpy.node.Node`; none if left out.
        calls: Functions that must all be called: a full name such as `rclpy.spin`, or the name of a method such as
            `create_timer`.
    """

    process: str
    derives_from: tuple[str, ...] = ()
    calls: tuple[str, ...] = ()

    @property
    def expected(self) -> str:
        parts = [f"a class that derives from {' or '.join(self.derives_from)}"] if self.derives_from else []
        return f"in {self.process} {' and '.join([*parts, *(f'a call of {name}' for name in self.calls)])}"

    def judge_sources(self, trace: Trace, sources: Mapping[str, str]) -> Finding:
        source = _source(trace, sources, self.process)
        if isinstance(source, Finding):
            return source
        classes = source.deriving(*self.derives_from) if self.derives_from else []
        found = {name: source.calling(name) for name in self.calls}
        evidence: dict[str, object] = {
            "classes": [c.name for c in classes][:20],
            "calls": {name: [c.lineno for c in calls][:20] for name, calls in found.items()},
        }
        missing = [f"a call of {name}" for name, calls in found.items() if not calls]
        if self.derives_from and not classes:
            missing.insert(0, f"a class that derives from {' or '.join(self.derives_from)}")
        if missing:
            return not_met(f"{self.process}: expected {' and '.join(missing)}, found none", evidence)
        told = [f"class {quote(c.name, 40)} in line {c.lineno}" for c in classes[:1]]
        told += [f"{name} in line {calls[0].lineno}" for name, calls in found.items()]
        return met(f"{self.process}: {', '.join(told) or 'nothing was required'}", evidence)


@dataclass(frozen=True, slots=True)
class SourceAvoids(_OfSource):
    """A file does not call given functions, anywhere or in callbacks, and optionally has no `global` statement.

    The file is read, not run: imports under other names are followed. A callback is a function passed to a timer,
    subscription, service, action or future, including every function of the file that it calls.

    Attributes:
        process: File name of the student process.
        calls: Forbidden calls: a full name such as `time.sleep`, or the name of a method such as `sleep`.
        where: `anywhere`, or `callbacks` only.
        globals: Whether `global` is forbidden as well.
    """

    process: str
    calls: tuple[str, ...] = ()
    where: Literal["anywhere", "callbacks"] = "anywhere"
    globals: bool = False

    @property
    def expected(self) -> str:
        return f"in {self.process}{' in callbacks' if self.where == 'callbacks' else ''} {self._nothing_forbidden}"

    @property
    def _nothing_forbidden(self) -> str:
        return " and ".join([f"no call of {name}" for name in self.calls] + ["no global"] * self.globals)

    def judge_sources(self, trace: Trace, sources: Mapping[str, str]) -> Finding:
        source = _source(trace, sources, self.process)
        if isinstance(source, Finding):
            return source
        found = self._found(source)
        evidence = {"found": [[name, line] for line, name in found][:20]}
        if not found:
            place = "in callbacks " if self.where == "callbacks" else ""
            return met(f"{self.process}: {place}{self._nothing_forbidden}", evidence)
        line, name = found[0]
        inside = " in a callback" if self.where == "callbacks" else ""
        reason = f"{self.process}:{line}: {name}{inside}, expected none; {counted(len(found), 'place')}"
        hint = "a callback must return at once: use a timer instead of waiting" if "sleep" in name and inside else ""
        return replace(not_met(reason, evidence, hint=hint), location=Location(self.process, line))

    def _found(self, source: Source) -> list[tuple[int, str]]:
        inside = source.called_back() if self.where == "callbacks" else None
        calls = [(c, name) for name in self.calls for c in source.calling(name)]
        places: Sequence[tuple[ast.stmt | ast.expr, str]] = calls
        if self.globals:
            places = [*calls, *((g, f"global {', '.join(g.names)[:60]}") for g in source.all(ast.Global))]
        return sorted({(n.lineno, name) for n, name in places if inside is None or n in inside})


def _source(trace: Trace, sources: Mapping[str, str], process: str) -> Source | Finding:
    """Return a file with its names resolved, or no credit with the reason why it cannot be read.

    Raises:
        HarnessError: The file is missing, or too long to be read.
    """
    if process not in sources:
        raise HarnessError(
            f"{process}: its source was not kept; there are {first_few(sorted(sources)) or 'no sources'}"
        )
    source = read_source(process, sources[process])
    if source.tree is not None:
        return source
    fault = first_fault(trace, process)
    # Any other file that cannot be read here could be run, so that it is the grader's fault.
    if fault is not None and fault.kind is FaultKind.SYNTAX_ERROR:
        return faulted(fault, "the file cannot be read")
    raise HarnessError(f"{process}: cannot be read as Python, or is too long")
