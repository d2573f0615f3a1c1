"""Checks on a node that logs what came to it: each text on a topic, or each response of a service."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

from grader.grading.judging.findings import (
    explain_fault,
    explain_no_client,
    explain_no_subscription,
    faulted,
    first_fault,
    met,
    not_met,
    only_printed,
)
from grader.grading.judging.logs.matching import says
from grader.grading.judging.logs.outputs import Output, in_window, printed_lines, student_records
from grader.grading.judging.service_calls import calls_of
from grader.grading.judging.values import JITTER_NS, heard_from_ns, shown_value, student_endpoints, value_at
from grader.grading.model.exercise import Finding, ProblemKind, Roles
from grader.grading.model.wording import moment, quote, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S, DurationNs, FieldOf, counted, seconds
from grader.runtime.model.trace import Trace


@dataclass(frozen=True, slots=True)
class _Heard:
    """Something that came to the node and must be logged: its time, and the content of its field."""

    t_ns: int
    value: object


@dataclass(frozen=True, slots=True)
class LogsTexts:
    """A process logs each text that it receives, word for word, with any words around it.

    Texts that are printed instead of logged give half the points.

    Attributes:
        process: File name of the student process.
        topic: Topic of the texts.
        field: Path of the text.
        within: Longest time from a message to its log record.
    """

    roles: ClassVar[Roles] = Roles(hears=("topic",), given=("topic",))
    process: str
    topic: str
    field: Annotated[str, FieldOf("topic")] = "data"
    within: DurationNs = NS_PER_S

    @property
    def expected(self) -> str:
        return f"{self.process} logs the text of each message on {self.topic}; half the points if only printed"

    def judge(self, trace: Trace) -> Finding:
        if not student_endpoints(trace, "subscription", self.topic) and first_fault(trace, self.process) is None:
            return explain_no_subscription(trace, self.topic)
        from_ns = heard_from_ns(trace, self.topic)
        sent = ((d.t_ns, value_at(d.value, self.field)) for d in trace.deliveries(self.topic) if d.t_ns >= from_ns)
        texts = [_Heard(t_ns, value) for t_ns, value in sent if isinstance(value, str)]
        hint = f"log msg.{self.field} in the callback of the subscription to {self.topic}"
        return _judged(trace, self.process, texts, self.within, _Source(self.topic, "message", hint))


@dataclass(frozen=True, slots=True)
class LogsResponse:
    """A client logs what each response of the grader's server says: a text, a number, or a list of numbers.

    Texts count word for word, numbers to the precision printed, and lists if all of their numbers follow each other in
    one record. Printing instead of logging gives half the points.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        field: Path of the field in the response.
        within: Longest time from a response to its log record.
    """

    roles: ClassVar[Roles] = Roles(calls=("service",))
    process: str
    service: str
    field: Annotated[str, FieldOf("service", "_Response")]
    within: DurationNs = NS_PER_S

    @property
    def expected(self) -> str:
        return f"{self.process} logs {self.field} of each response of {self.service}; half the points if only printed"

    def judge(self, trace: Trace) -> Finding:
        calls = calls_of(trace, self.service, "student")
        if not calls:
            return explain_no_client(trace, self.service)
        responses = [c.response for c in calls if c.response is not None]
        heard = [_Heard(r.t_ns, value_at(r.value, self.field)) for r in responses]
        hint = f"log response.{self.field} once the response has arrived"
        return _judged(trace, self.process, heard, self.within, _Source(self.service, "response", hint))


@dataclass(frozen=True, slots=True)
class _Source:
    """Where something came from: its name, the word for what comes from it, and how to log that."""

    name: str
    word: str
    hint: str

    def all(self, count: int) -> str:
        """Return that so many, which are all, are something."""
        return f"the {self.word} of {self.name} is" if count == 1 else f"all {count} {self.word}s of {self.name} are"


def _judged(trace: Trace, process: str, heard: Sequence[_Heard], within_ns: int, source: _Source) -> Finding:
    """Return the finding about what came from a source."""
    jitter_ns = JITTER_NS[trace.clock]
    # One nanosecond more, because windows are half-open and a log at the very limit is in time.
    late_ns = within_ns + jitter_ns + 1
    # What came shortly before the end could still have been logged after it, unless the process had ended by itself.
    due = [one for one in heard if one.t_ns + late_ns <= trace.stop_ns or _ended(trace, process)]
    if not due:
        if crashed := explain_fault(trace, "nothing was logged after it", process=process):
            return crashed
        raise HarnessError(f"{source.name}: no {source.word} was sent, or only too late to be logged")

    def near(outputs: Sequence[Output], one: _Heard) -> list[Output]:
        return in_window(outputs, one.t_ns - jitter_ns, one.t_ns + late_ns)

    def unlogged(outputs: Sequence[Output]) -> list[_Heard]:
        return [one for one in due if not any(says(o.text, one.value) for o in near(outputs, one))]

    records = student_records(trace, process)
    missing = unlogged(records)
    evidence: dict[str, object] = {
        f"{source.word}s": len(due),
        "missing": [shown_value(one.value) for one in missing[:20]],
    }
    if not missing:
        return met(f"{process}: {source.all(len(due))} logged, such as {shown_value(due[0].value)}", evidence)
    # Logged and printed together: a program that logs some and prints the others has written all of them.
    if not unlogged(sorted([*records, *printed_lines(trace, process)], key=lambda o: o.t_ns)):
        return only_printed(f"{process}: {source.all(len(due))} printed, not all of them logged", evidence)
    first = missing[0]
    found = near(records, first)
    wrote = f"found {quote(' / '.join(o.text for o in found), 80)}" if found else "found no log"
    wanted = f"expected {shown_value(first.value)} within {span(within_ns)}, {wrote}"
    reason = f"{process}: {len(missing)} of {counted(len(due), source.word)} of {source.name} not logged, the first at "
    reason += f"{moment(first.t_ns)}: {wanted}"
    fault = first_fault(trace, process)
    # A crash after that time is not why this one was not logged.
    if fault is not None and fault.t_ns < first.t_ns + late_ns:
        return faulted(fault, reason, evidence, last=True)
    problem = ProblemKind.WRONG_VALUE if found else ProblemKind.NOT_LOGGED
    known = evidence | {"first_missing_s": seconds(first.t_ns)}
    return not_met(reason, known, hint=source.hint, problem=problem, brief=f"{source.name}: {wanted}")


def _ended(trace: Trace, process: str) -> bool:
    """Return whether a process ended before the recording did, so that nothing more is to be expected of it."""
    return any(mark.t_ns < trace.stop_ns for mark in trace.marks("exited", process))
