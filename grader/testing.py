"""Helpers to test your own checks and hint rules: build traces by hand, and ask a check or a rule about them.

    from grader.api import TraceBuilder, judge

    def test_a_steady_pump_is_met():
        trace = TraceBuilder("pump.py").messages("/flow", "std_msgs/msg/Float32", {"data": 1.5}, rate_hz=10).trace()
        assert judge(StartsEarly("/flow", within=500_000_000), trace).credit == 1

Times are seconds since the scenario began. Add observations in any order; the trace is sorted like a recording.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from typing import Any

from grader.grading.judging.authored import finding_flaw
from grader.grading.judging.checks import CHECKS
from grader.grading.judging.diagnosis import fault_of
from grader.grading.judging.diagnosis.rules import Case, Clue, Rule, clue_flaw
from grader.grading.judging.findings import met, not_met, partly
from grader.grading.judging.source import read_source
from grader.grading.model.exercise import Check, Criterion, Finding, Outcome, ask
from grader.grading.model.report import Verdict
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S, nanoseconds
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    Delivery,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Mark,
    Message,
    Observation,
    OutputLine,
    Request,
    Response,
    ServiceEnd,
    Trace,
)

__all__ = ["TraceBuilder", "builtin_check", "explain", "judge", "met", "not_met", "partly"]

#: Order within one instant: the scenario, the grader, the graph, the nodes.
_PHASE = {Mark: 0, Delivery: 1, GraphSnapshot: 2}

#: Fields of a message, or a function that returns them for the index of a message.
Value = Mapping[str, object] | Callable[[int], Mapping[str, object]]


def judge(check: Check, trace: Trace, sources: Mapping[str, str] | None = None) -> Finding:
    """Run a check on a trace, and make sure that its finding can be reported.

    Args:
        check: The check; it is run twice.
        trace: The trace.
        sources: Text of the students' files by name, for a check that has `judge_sources`.

    Raises:
        ValueError: The check returned an invalid Finding, or a different one the second time, or it changed the trace,
            which other checks share.
    """
    before = repr(trace)
    finding = ask(check, trace, sources)
    wrong = finding_flaw(finding)
    if wrong:
        raise ValueError(f"{type(check).__name__} {wrong}")
    if repr(ask(check, trace, sources)) != repr(finding):  # NaN never equals itself
        raise ValueError(f"{type(check).__name__} gave another finding when it judged again")
    if repr(trace) != before:
        raise ValueError(f"{type(check).__name__} changed the trace")
    return finding


def builtin_check(name: str, **parameters: Any) -> Check:
    """Return one of the grader's checks, by its name and parameters as in a rubric; times are in nanoseconds.

    Raises:
        KeyError: There is no such check.
        TypeError: A parameter is missing, or there is no such parameter.
    """
    from grader.grading.rubrics.exercise_checks import known_checks  # noqa: PLC0415  takes long

    check: Check = known_checks()[name](**parameters)
    return check


def explain(
    rule: Rule, check: Check, trace: Trace, sources: Mapping[str, str], siblings: Sequence[Check] = ()
) -> Clue | None:
    """Ask one hint rule about what a check finds in a trace; None if nothing is lost, or the rule does not apply.

    Args:
        rule: The rule.
        check: The check; it may be one of the rubric's own.
        trace: The trace.
        sources: Text of the students' files by name.
        siblings: Checks of other criteria of the exercise, if the rule looks at them.

    Raises:
        ValueError: The check or the rule returned something that cannot be reported.
    """
    finding = judge(check, trace, sources)
    if finding.credit == 1:
        return None
    outcome = Outcome.PARTLY if finding.credit else Outcome.NOT_MET
    # a check of one's own has its name from the rubric, which is not there: it is taken to be the one that is meant
    meant = (name for name in rule.checks if isinstance(name, str) and name not in CHECKS)
    criterion = _criterion("tested", check, trace, next(meant, ""))
    verdict = Verdict(
        "tested",
        "",
        outcome,
        finding.credit,
        Fraction(1),
        finding.reason,
        hint=finding.hint,
        location=finding.location,
        evidence=finding.evidence,
        problem=finding.problem,
    )
    files = {name: read_source(name, text) for name, text in sources.items()}
    others = tuple(_criterion(f"sibling_{n}", one, trace) for n, one in enumerate(siblings))
    case = Case(criterion, verdict, trace, files, fault_of(verdict, trace), others, finding.facts)
    clue = rule.clue(case)
    if clue is not None and (wrong := clue_flaw(clue, case)):
        raise ValueError(f"the rule {rule.id}: {wrong}")
    return clue


def _criterion(id_: str, check: Check, trace: Trace, own: str = "") -> Criterion:
    """Return a criterion with a check, which has its name in rubrics, or `own` if it is not the grader's."""
    name = next((name for name, kind in CHECKS.items() if type(check) is kind), own)
    return Criterion(id_, "", Fraction(1), trace.scenario, check, check_name=name)


@dataclass(slots=True)
class TraceBuilder:
    """Builds a trace from observations; every method except `trace` returns the builder.

    A topic with messages gets a publisher in the graph automatically; subscriptions have to be added.
    """

    process: str = "node.py"  # file name of the student's process that is observed
    node: str = "/node"  # name of its node
    stop_s: float = 10.0  # end of the observation
    clock: ClockKind = ClockKind.VIRTUAL  # which clock the nodes ran on
    _seen: list[Observation] = field(default_factory=list, repr=False)
    _ends: list[Endpoint] = field(default_factory=list, repr=False)
    _services: list[ServiceEnd] = field(default_factory=list, repr=False)

    def add(self, *observations: Observation) -> TraceBuilder:
        """Add observations of any kind."""
        self._seen.extend(observations)
        return self

    def message(
        self, t_s: float, topic: str, type_: str, value: Mapping[str, object], *, before_discovery: bool = False
    ) -> TraceBuilder:
        """Add one message of the student's node, with nested dicts for its fields.

        With `before_discovery` it was sent as soon as its publisher was created, so that nobody would have heard it.
        """
        return self.add(Message(nanoseconds(t_s), topic, type_, value, before_discovery=before_discovery))

    def messages(  # noqa: PLR0913  what, where and when
        self, topic: str, type_: str, value: Value, *, rate_hz: float, start_s: float = 0.1, stop_s: float | None = None
    ) -> TraceBuilder:
        """Add messages of the student's node at a rate.

        Args:
            topic: Absolute name.
            type_: e.g. `std_msgs/msg/Float32`.
            value: Their fields, or a function of the message's number.
            rate_hz: Messages per second.
            start_s: Time of the first message.
            stop_s: When they end; None for the end of the trace.
        """
        for number, t_ns in enumerate(self._times(rate_hz, start_s, stop_s)):
            self.add(Message(t_ns, topic, type_, value(number) if callable(value) else value))
        return self

    def delivery(self, t_s: float, topic: str, type_: str, value: Mapping[str, object]) -> TraceBuilder:
        """Add one message that the grader published to the student's node."""
        return self.add(Delivery(nanoseconds(t_s), topic, type_, value))

    def deliveries(  # noqa: PLR0913  as above
        self, topic: str, type_: str, value: Value, *, rate_hz: float, start_s: float = 0.1, stop_s: float | None = None
    ) -> TraceBuilder:
        """Add messages that the grader published at a rate; see `messages`."""
        for number, t_ns in enumerate(self._times(rate_hz, start_s, stop_s)):
            self.add(Delivery(t_ns, topic, type_, value(number) if callable(value) else value))
        return self

    def log(self, t_s: float, text: str, severity: str = "INFO", line: int = 0) -> TraceBuilder:
        """Add a log record of the node, with its line in the file if known."""
        where = self.process if line else ""
        logger = self.node.rsplit("/", 1)[-1]
        return self.add(LogRecord(nanoseconds(t_s), self.process, severity, logger, text, where, line))

    def printed(self, t_s: float, text: str, stream: str = "stdout") -> TraceBuilder:
        """Add a line that the process printed without the logger."""
        return self.add(OutputLine(nanoseconds(t_s), self.process, stream, text))

    def fault(
        self, t_s: float, text: str = "ValueError: no", kind: FaultKind = FaultKind.EXCEPTION, line: int = 1
    ) -> TraceBuilder:
        """Add a fault that ended the process, such as an exception, with its line in the file."""
        return self.add(Fault(nanoseconds(t_s), self.process, kind, text, self.process if line else "", line))

    def exited(self, t_s: float, code: int = 0) -> TraceBuilder:
        """Add a regular exit of the process, with its exit code."""
        text = f"exited with code {code}"
        return self.add(Fault(nanoseconds(t_s), self.process, FaultKind.EXITED, text, exit_code=code))

    def publisher(self, topic: str, type_: str, **attributes: Any) -> TraceBuilder:
        """Add a publisher of the node to the graph; attributes are those of an Endpoint, such as `reliability`."""
        return self._end("publisher", topic, type_, attributes)

    def subscription(self, topic: str, type_: str, **attributes: Any) -> TraceBuilder:
        """Add a subscription of the node to the graph; attributes as for `publisher`."""
        return self._end("subscription", topic, type_, attributes)

    def server(self, service: str, type_: str) -> TraceBuilder:
        """Add a service that the node offers to the graph."""
        self._services.append(ServiceEnd("service", service, type_, self.node))
        return self

    def client(self, service: str, type_: str) -> TraceBuilder:
        """Add a client of the node to the graph."""
        self._services.append(ServiceEnd("client", service, type_, self.node))
        return self

    def call(  # noqa: PLR0913  a request and its response
        self,
        t_s: float,
        service: str,
        type_: str,
        request: Mapping[str, object],
        response: Mapping[str, object] | None,
        *,
        answer_s: float = 0.0,
        by_student: bool = False,
    ) -> TraceBuilder:
        """Add a service call, by the grader or by the student's client.

        Args:
            t_s: Time of the request.
            service: Absolute name.
            type_: e.g. `std_srvs/srv/Trigger`.
            request: Fields of the request.
            response: Fields of the response; None if there was none.
            answer_s: Delay of the response.
            by_student: Whether the student's node sent the request and the grader answered.
        """
        asks, answers = ("student", "grader") if by_student else ("grader", "student")
        number = 1 + sum(isinstance(o, Request) and (o.service, o.sender) == (service, asks) for o in self._seen)
        client = 0 if by_student else 1
        self.add(Request(nanoseconds(t_s), service, type_, number, asks, client, request))
        if response is not None:
            when_ns = nanoseconds(t_s + answer_s)
            self.add(Response(when_ns, service, type_, number, answers, client, response))
        return self

    def mark(self, t_s: float, name: str, detail: str = "") -> TraceBuilder:
        """Add an event of the scenario itself; `Mark` lists the names."""
        return self.add(Mark(nanoseconds(t_s), name, detail))

    def trace(self, scenario: str = "alone") -> AssessedTrace:
        """Return the trace, with its observations in the order of a recording."""
        graph = self._graph()
        ordered = sorted([*self._seen, *graph], key=lambda seen: (seen.t_ns, _PHASE.get(type(seen), 3)))
        return AssessedTrace(scenario, self.clock, nanoseconds(self.stop_s), tuple(ordered))

    def _times(self, rate_hz: float, start_s: float, stop_s: float | None) -> list[int]:
        start_ns, stop_ns = nanoseconds(start_s), nanoseconds(self.stop_s if stop_s is None else stop_s)
        count = max(0, round((stop_ns - start_ns) * rate_hz / NS_PER_S) + 1)
        times = [start_ns + round(number * NS_PER_S / rate_hz) for number in range(count)]
        return [t_ns for t_ns in times if t_ns < stop_ns]

    def _end(self, kind: str, topic: str, type_: str, attributes: Mapping[str, Any]) -> TraceBuilder:
        known = {"node": self.node, "participant": 1, "reliability": "reliable", "durability": "volatile", "depth": 10}
        self._ends.append(Endpoint(kind, topic, type_, **{**known, **attributes}))
        return self

    def _graph(self) -> list[GraphSnapshot]:
        known = {(e.topic, e.type) for e in self._ends if e.kind == "publisher"}
        spoken = dict.fromkeys((o.topic, o.type) for o in self._seen if isinstance(o, Message))
        for topic, type_ in spoken:
            if (topic, type_) not in known:
                self.publisher(topic, type_)
        if not self._ends and not self._services:
            return []
        ends = sorted(self._ends, key=lambda e: (e.kind, e.topic, e.node))
        services = sorted(self._services, key=lambda e: (e.kind, e.service, e.node))
        nodes = sorted({*(end.node for end in ends), *(end.node for end in services)})
        return [GraphSnapshot(0, tuple(nodes), tuple(ends), tuple(services))]
