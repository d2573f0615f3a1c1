"""Traces made with grader.testing: what the checks that come with the grader find in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import pytest

from grader.grading.judging.checks.logs import UsesLogger
from grader.grading.judging.checks.rate import TopicRate
from grader.grading.judging.checks.topics import FieldValues, Publishes, Subscribes
from grader.grading.model.exercise import Finding, Location, Problem, ProblemKind
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import FaultKind, Trace
from grader.runtime.worker.ending import exited
from grader.testing import TraceBuilder, judge, met

FLOAT = "std_msgs/msg/Float32"


def pump(**changes: Any) -> TraceBuilder:
    return TraceBuilder("pump.py", "/pump", **changes)


def test_messages_at_a_rate_are_exactly_at_that_rate() -> None:
    """A thirtieth of a second is no whole number of nanoseconds, and the rate holds all the same."""
    trace = pump(stop_s=10.2).messages("/flow", FLOAT, {"data": 1.5}, rate_hz=30).trace()
    finding = judge(TopicRate("/flow", 30.0, 0.001, 10_000_000_000), trace)
    assert finding.credit == 1, finding.reason
    assert judge(Publishes("/flow", FLOAT), trace).credit == 1


def test_values_may_follow_the_number_of_a_message() -> None:
    """One that differs is found."""
    trace = pump().messages("/flow", FLOAT, lambda n: {"data": 2.0 if n == 3 else 1.5}, rate_hz=10).trace()
    finding = judge(FieldValues("/flow", {"data": 1.5}), trace)
    assert (finding.credit, finding.evidence["wrong"], finding.evidence["first_wrong_s"]) == (0, 1, 0.4)


def test_graph_logs_calls_and_faults_arrive_in_order() -> None:
    """Whatever the order in which they were put, and with their process and lines."""
    trace = (
        pump()
        .fault(5, "KeyError: 'x'", line=7)
        .log(1, "pumping", line=3)
        .printed(2, "hello")
        .subscription("/level", FLOAT, reliability="best_effort")
        .server("/empty", "std_srvs/srv/Trigger")
        .call(3, "/empty", "std_srvs/srv/Trigger", {}, {"success": True}, answer_s=0.5)
        .call(4, "/empty", "std_srvs/srv/Trigger", {}, None)
        .delivery(0, "/level", FLOAT, {"data": 1.0})
        .mark(0, "stream_starts", "/level")
        .trace()
    )
    assert [type(o).__name__ for o in trace.observations] == [
        *("Mark", "Delivery", "GraphSnapshot", "LogRecord", "OutputLine", "Request", "Response", "Request", "Fault")
    ]
    assert judge(Subscribes("/level", FLOAT), trace).credit == 1
    assert judge(UsesLogger("pump.py"), trace).credit == 1
    assert [(r.number, r.client) for r in trace.requests("/empty", "grader")] == [(1, 1), (2, 1)]
    (fault,) = trace.faults("pump.py")
    assert (fault.kind, fault.file, fault.line) == (FaultKind.EXCEPTION, "pump.py", 7)


@dataclass(frozen=True)
class Gives:
    """A check that returns what it is given."""

    finding: Any

    def judge(self, trace: Trace) -> Finding:
        given: Finding = self.finding
        return given


def made(*values: Any, **more: Any) -> Finding:
    """Return a finding with values of any type, as an own check may."""
    return Finding(*values, **more)


def test_a_process_that_ends_by_itself_has_an_exit_code() -> None:
    """As one of a recording has."""
    (fault,) = pump().exited(5, 3).trace().faults()
    assert fault == exited("pump.py", 5 * NS_PER_S, 3)


made_up: Any = Problem(ProblemKind.BURSTS)
object.__setattr__(made_up, "kind", "bursts")


@pytest.mark.parametrize(
    ("finding", "wrong"),
    [
        (True, "returned a bool, expected a Finding"),
        (made(Fraction(1), 5), "gave a reason of type int, expected a str"),
        (Finding(Fraction(1), "", {"x": {1, 2}}), "gave evidence that holds more than plain JSON values"),
        (made(Fraction(1), "", location=("pump.py", 3)), "gave a location of type tuple, expected a Location"),
        (made(Fraction(1), "", location=Location("pump.py", 0)), "gave the location pump.py:0, expected a file and"),
        (made(Fraction(1), "", blocked_by=7), "gave a blocked_by of type int, expected the id of a criterion"),
        (made(Fraction(1), "", problem=made_up), "gave a problem of the kind 'bursts', expected a Problem"),
        (made(Fraction(0), "", problem="bursts"), "gave a problem of type str, expected a Problem"),
    ],
)
def test_a_finding_that_no_report_could_show_is_refused(finding: Finding | bool, wrong: str) -> None:
    """With the words that an instructor would read in the report."""
    with pytest.raises(ValueError, match=wrong):
        judge(Gives(finding), pump().trace())


def test_a_check_may_see_the_files() -> None:
    """It is then asked about them as well, and about the trace alone where there are none."""

    class Short:
        def judge(self, trace: Trace) -> Finding:
            return met("not looked at")

        def judge_sources(self, trace: Trace, sources: Mapping[str, str]) -> Finding:
            return met(f"{len(sources['pump.py'])} characters")

    assert judge(Short(), pump().trace(), {"pump.py": "abc"}).reason == "3 characters"
    assert judge(Short(), pump().trace()).reason == "not looked at"


def test_a_check_that_changes_the_trace_is_refused() -> None:
    """Other checks read it too."""

    class Sorts:
        def judge(self, trace: Trace) -> Finding:
            value: Any = trace.messages()[0].value
            value["data"] = 0.0
            return met("sorted")

    with pytest.raises(ValueError, match="Sorts changed the trace"):
        judge(Sorts(), pump().message(1, "/flow", FLOAT, {"data": 1.5}).trace())


def test_a_check_that_changes_its_mind_is_refused() -> None:
    """Checks are pure: the same trace gives the same finding."""

    class Counts:
        asked = 0

        def judge(self, trace: Trace) -> Finding:
            self.asked += 1
            return met(f"asked {self.asked} times")

    with pytest.raises(ValueError, match="gave another finding when it judged again"):
        judge(Counts(), pump().trace())
