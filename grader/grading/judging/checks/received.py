"""Checks on a node that logs what it receives: each number, or each message converted to one or more units."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field as dataclass_field
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Annotated, Any, ClassVar

from grader.grading.judging.charts import expected_series, series
from grader.grading.judging.facts import LogFacts
from grader.grading.judging.findings import (
    explain_fault,
    explain_no_subscription,
    faulted,
    first_fault,
    met,
    not_met,
    only_printed,
    request_said,
)
from grader.grading.judging.logs.conversions import LoggedNumbers, times, wrong_conversion
from grader.grading.judging.logs.matching import Sought, followed, other_numbers, shows_about, standing
from grader.grading.judging.logs.outputs import Output, after, in_window, numbers_in, printed_lines, student_records
from grader.grading.judging.plots import Drawing, Plot
from grader.grading.judging.texts import Printed, clean
from grader.grading.judging.values import (
    JITTER_NS,
    Held,
    carries_number,
    delivered_numbers,
    heard_from_ns,
    held,
    number_at,
    student_endpoints,
)
from grader.grading.model.chart import Look, Panel, Tone
from grader.grading.model.exercise import Finding, ProblemKind, Roles
from grader.grading.model.measures import Reading
from grader.grading.model.wording import moment, number, numbers, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S, FieldOf, counted, seconds
from grader.runtime.model.trace import ClockKind, Endpoint, LogRecord, Message, Trace, unusual_request

#: How long after a message its log may come, if there are enough numbers in total.
_LATE_NS = NS_PER_S
#: A number is precise enough if its last digit is at most this share of the largest value.
_FINE = 0.1
_Logged = Callable[[Sequence[Output], Sequence[Sought]], frozenset[int]]


@dataclass(frozen=True, slots=True)
class _Received:
    """A message: its time, the end of the time for its log, and its number."""

    t_ns: int
    stop_ns: int
    value: float


@dataclass(frozen=True, slots=True)
class LogsValues:
    """A process logs what it receives: all converted numbers of each message, in one record or in several.

    Numbers count to the precision printed, with their sign; a conversion may use a constant such as 3.14159. A number
    is ignored if its last digit is more than a tenth of the largest value, or if it appears among so many others that
    chance explains it. A log may come up to a second late if none is left out. Numbers that are printed instead of
    logged give half the points.

    Attributes:
        process: File name of the student process.
        topic: Topic of the messages.
        field: Path of the number.
        unit_factors: Factors by which the number is multiplied; all of the products must be logged.
        share: Share of the messages that must be logged.
        units: Factors of units by the beginnings of the words that name them after a number, such as `{rad: 1}`; two
            products that name each other's units for every message do not count. No unit needs to be named.
    """

    roles: ClassVar[Roles] = Roles(hears=("topic",), given=("topic",))
    noun: ClassVar[str] = "message"
    process: str
    topic: str
    field: Annotated[str, FieldOf("topic")] = "data"
    unit_factors: tuple[float, ...] = (1.0,)
    share: float = 1.0
    units: Mapping[str, float] = dataclass_field(default_factory=dict)

    @property
    def expected(self) -> str:
        products = " and ".join(map(times, self.unit_factors))
        return f"{self.process} logs {products} for each message on {self.topic}; half the points if only printed"

    def judge(self, trace: Trace) -> Finding:
        fault = first_fault(trace, self.process)
        subscribed = student_endpoints(trace, "subscription", self.topic)
        if not subscribed and fault is None:
            return explain_no_subscription(trace, self.topic)
        received = self._received(trace)
        if not received:
            return _nothing(trace, self.process, f"{self.topic}: no number {self.field} was published on it")
        return _judged(self, trace, received)

    def when_logged(
        self,
        trace: Trace,  # noqa: ARG002 - as of the other check
        received: Sequence[_Received],
        unlogged: Sequence[_Received],
        records: Sequence[Output],
    ) -> Finding:
        """Return the finding if enough is logged."""
        evidence = self.evidence_of(received, unlogged)
        return met(f"{self._said(received, unlogged)} logged{self._example(received, records)}", evidence)

    def when_printed(self, received: Sequence[_Received], evidence: dict[str, object]) -> Finding:
        """Return the finding if enough is written, but not through the logger."""
        return only_printed(f"{self._said(received, ())} printed, not all of them logged", evidence)

    def among(
        self,
        trace: Trace,  # noqa: ARG002 - as of the other check
        received: Sequence[_Received],  # noqa: ARG002 - as of the other check
        one: _Received,
        records: Sequence[Output],
    ) -> str:
        """Return a clause about the numbers among which something is lost."""
        return other_numbers(records, self._sought([one], [one.stop_ns])[0])

    def when_missing(
        self, trace: Trace, received: Sequence[_Received], absent: Sequence[_Received], evidence: dict[str, object]
    ) -> Finding:
        """Return the finding if something was never written."""
        records = student_records(trace, self.process)
        # The cause is looked for in one of the two: prints for debugging beside right logs would lead it astray.
        outputs = records if any(numbers_in(r.text) for r in records) else printed_lines(trace, self.process)
        return self._explain(received, absent, outputs, evidence)

    def swapped_units(self, received: Sequence[_Received], outputs: Sequence[Output]) -> str:
        """Return that two products of every message are followed by each other's units; empty if they are not."""
        # Only units of other products: a program may name the right unit of a product in any words.
        others = [f for f in dict.fromkeys(self.units.values()) if f not in self.unit_factors]
        for mine, other in ((f, o) for f in self.unit_factors for o in others):
            if all(
                # At every message, and both ways: numbers that happen to be alike do not swap their units all the time.
                self._named(one, outputs, mine, other) and self._named(one, outputs, other, mine)
                for one in received
            ):
                first = received[0]
                found = quote(" / ".join(o.text for o in in_window(outputs, first.t_ns, first.stop_ns)), 80)
                numbers_ = f"{number(mine * first.value)} and {number(other * first.value)}"
                return f"{self.process}: the units of {numbers_} are swapped at every message, as in {found!r}"
        return ""

    def _named(self, one: _Received, outputs: Sequence[Output], factor: float, unit: float) -> bool:
        """Return whether a product of a message is followed by the name of a unit, wherever it is logged."""
        words = tuple(word for word, f in self.units.items() if f == unit)
        return any(
            shows_about(n, factor * one.value, coarsest=math.inf) and after(o.text, n).lower().startswith(words)
            for o in in_window(outputs, one.t_ns, one.stop_ns)
            for n in numbers_in(o.text)
        )

    def drawing(self, trace: Trace) -> Drawing:
        """Return what came, and below it the numbers that had to be logged with the nearest that were."""
        received = self._received(trace)
        records, lines = student_records(trace, self.process), printed_lines(trace, self.process)
        panels = [self._logged_panel(received, factor, records, lines) for factor in self.unit_factors[:4]]
        title = f"Messages on {self.topic} and what {self.process} logged"
        return Drawing((Plot(self.topic, (self.field,)),), panels=tuple(panels), processes=(self.process,), title=title)

    def _logged_panel(
        self, received: Sequence[_Received], factor: float, *written: Sequence[Output]
    ) -> tuple[Panel, str]:
        """Return a product of each message with the number that was logged or printed for it, right or wrong."""
        largest = max((abs(r.value) for r in received), default=0.0)
        kinds: dict[tuple[str, Tone], list[tuple[int, float, str]]] = {}
        for one in received:
            answer = next((a for outputs in written if (a := self._answer(one, factor, largest, outputs))), None)
            if answer is not None:
                output, value, right = answer
                verb = "logged" if isinstance(output, LogRecord) else "printed"
                kind = (f"{verb}, right", Tone.GOOD) if right else (f"{verb}, wrong", Tone.BAD)
                kinds.setdefault(kind, []).append((output.t_ns, value, clean(output.text)))
        rows = [expected_series([Reading(r.t_ns, factor * r.value) for r in received])]
        for (name, tone), some in kinds.items():
            points, texts = [(seconds(t_ns), value) for t_ns, value, _ in some], [text for *_, text in some]
            rows.append(series(name, points, look=Look.DOTS, tone=tone, texts=texts))
        said = ", ".join(f"{len(some)} {name}" for (name, _), some in kinds.items()) or "none found"
        panel = Panel(f"logged: {times(factor)}", "", tuple(rows))
        return panel, f"For {times(factor)}, {counted(len(received), 'number')} expected: {said}."

    def _answer(
        self, one: _Received, factor: float, largest: float, outputs: Sequence[Output]
    ) -> tuple[Output, float, bool] | None:
        """Return the text with a product of a message, or else the first one with a number, and whether it is right."""
        wanted = factor * one.value
        for output in in_window(outputs, one.t_ns, max(one.stop_ns, one.t_ns + _LATE_NS)):
            shown = next((n for n in numbers_in(output.text) if _shows(wanted, abs(factor) * largest, n)), None)
            if shown is not None:
                return output, shown.value, True
        for output in in_window(outputs, one.t_ns, one.stop_ns):
            values = [n.value for n in numbers_in(output.text) if math.isfinite(n.value)]
            if values:
                return output, min(values, key=lambda value: abs(value - wanted)), False
        return None

    def _received(self, trace: Trace) -> list[_Received]:
        jitter_ns = JITTER_NS[trace.clock]
        from_ns = heard_from_ns(trace, self.topic)
        sent = [d for d in trace.deliveries(self.topic) if from_ns <= d.t_ns < trace.stop_ns - jitter_ns]
        # A log belongs to a message until the next one comes, so that no log is counted for two.
        stops = [*(d.t_ns + jitter_ns for d in sent), trace.stop_ns][1:]
        pairs = [(d, stop, number_at(d.value, self.field)) for d, stop in zip(sent, stops, strict=True)]
        return [_Received(d.t_ns - jitter_ns, stop, value) for d, stop, value in pairs if value is not None]

    def is_enough(self, received: Sequence[_Received], unlogged: Sequence[_Received]) -> bool:
        """Return whether enough is logged."""
        # The slack is for shares such as 0.9 of 10, which floating point puts above 9.
        return len(received) - len(unlogged) >= self.share * len(received) - 1e-9

    def unlogged_in(
        self,
        trace: Trace,  # noqa: ARG002 - as of the other check
        received: Sequence[_Received],
        outputs: Sequence[Output],
        logged: _Logged = followed,
    ) -> list[_Received]:
        """Return what is not logged in some outputs."""
        punctual = self._unshown(received, [r.stop_ns for r in received], outputs, logged)
        written = sum(len(numbers_in(o.text)) for o in outputs if o.t_ns >= received[0].t_ns)
        # Late logs count only if there are as many numbers as messages: else those of one message would stand for
        # several.
        if not punctual or written < self.share * len(received) * len(self.unit_factors):
            return punctual
        late = self._unshown(received, [r.t_ns + _LATE_NS for r in received], outputs, logged)
        return [r for r in punctual if r in late]

    def _unshown(
        self, received: Sequence[_Received], stops_ns: Sequence[int], outputs: Sequence[Output], logged: _Logged
    ) -> list[_Received]:
        found = logged(outputs, self._sought(received, stops_ns))
        many = len(self.unit_factors)
        return [r for k, r in enumerate(received) if not found >= set(range(k * many, (k + 1) * many))]

    def _sought(self, received: Sequence[_Received], stops_ns: Sequence[int]) -> list[Sought]:
        """Return the values that must be logged: one per factor for each message."""
        largest = max(abs(r.value) for r in received)
        return [
            Sought(r.t_ns, stop_ns, f * r.value, abs(f) * largest, partial(_shows, f * r.value, abs(f) * largest))
            for r, stop_ns in zip(received, stops_ns, strict=True)
            for f in self.unit_factors
        ]

    def evidence_of(self, received: Sequence[_Received], unlogged: Sequence[_Received]) -> dict[str, object]:
        """Return the numbers behind the finding."""
        return {
            "messages": len(received),
            "logged": len(received) - len(unlogged),
            "factors": list(self.unit_factors),
            "first_missing": [[seconds(r.t_ns), r.value] for r in unlogged[:10]],
        }

    def _said(self, received: Sequence[_Received], unlogged: Sequence[_Received]) -> str:
        logged = len(received) - len(unlogged)
        return f"{self.process}: {logged} of {counted(len(received), 'message')} of {self.topic} are"

    def _example(self, received: Sequence[_Received], outputs: Sequence[Output]) -> str:
        for one in received:
            found = in_window(outputs, one.t_ns, one.stop_ns)
            if found:
                return f", {number(one.value)} as: {quote(' / '.join(o.text for o in found), 80)}"
        return ""

    def _explain(
        self,
        received: Sequence[_Received],
        unlogged: Sequence[_Received],
        outputs: Sequence[Output],
        evidence: dict[str, object],
    ) -> Finding:
        first = unlogged[0]
        wanted = " and ".join(number(f * first.value) for f in self.unit_factors)
        found = in_window(outputs, first.t_ns, first.stop_ns)
        wrote = f"found {quote(' / '.join(o.text for o in found), 80)}" if found else "found no log"
        reason = f"{self.process}: {len(unlogged)} of {counted(len(received), 'message')} of {self.topic} are not "
        reason += f"logged correctly, the first at {moment(first.t_ns)}: expected {wanted}, {wrote}"
        cause, hint = self._cause(received, unlogged, outputs)
        problem = ProblemKind.WRONG_VALUE if found else ProblemKind.NOT_LOGGED
        brief = f"{self.topic}: expected a log of {wanted}, {wrote}"
        return not_met(f"{reason}; {cause}" if cause else reason, evidence, hint=hint, problem=problem, brief=brief)

    def _cause(
        self, received: Sequence[_Received], unlogged: Sequence[_Received], outputs: Sequence[Output]
    ) -> tuple[str, str]:
        silent = [r for r in unlogged if not in_window(outputs, r.t_ns, r.stop_ns)]
        rule = f"log in the callback of the subscription to {self.topic}, once for each message"
        # From the plainest cause to the subtlest: no log, few logs, the message before, a wrong factor.
        if len(silent) == len(received):
            return "", rule
        if silent and (len(silent) > len(received) / 2 or len(silent) == len(unlogged)):
            return f"nothing is logged for {len(silent)} of the messages", rule
        logged = [LoggedNumbers(r.value, self._numbers(r, outputs)) for r in received]
        if any(self._behind(logged, f) for f in self.unit_factors):
            return "each log has the number of the previous message", "store the number before you log it, not after"
        largest = max(abs(r.value) for r in received)
        # Mostly, because a log or two may hold another number; what all but a fifth of the messages show is meant.
        right = [f for f in self.unit_factors if self._mostly(logged, f, _FINE * abs(f) * largest)]
        for factor in (f for f in self.unit_factors if f not in right):
            cause, hint = wrong_conversion(logged, factor, right)
            if cause:
                return f"{times(factor)}: {cause}", hint
            if right and all(len(h.numbers) <= len(right) for h in logged):
                return f"{times(factor)} is missing, only {' and '.join(map(times, right))}", ""
        return "", ""

    def _numbers(self, one: _Received, outputs: Sequence[Output]) -> tuple[Printed, ...]:
        return tuple(n for o in in_window(outputs, one.t_ns, one.stop_ns) for n in numbers_in(o.text))

    def _behind(self, logged: Sequence[LoggedNumbers], factor: float) -> bool:
        """Return whether each product but the first is logged one message too late."""

        def shows(here: LoggedNumbers, value: float) -> bool:
            return any(shows_about(n, factor * value, coarsest=_FINE * abs(factor * value)) for n in here.numbers)

        # Between equal values, being one message behind cannot be seen.
        pairs = [(a, b) for a, b in pairwise(logged) if a.value != b.value]
        return bool(pairs) and all(shows(b, a.value) and not shows(b, b.value) for a, b in pairs)

    def _mostly(self, logged: Sequence[LoggedNumbers], factor: float, coarsest: float) -> bool:
        hits = sum(any(shows_about(n, factor * h.value, coarsest=coarsest) for n in h.numbers) for h in logged)
        return hits > 0.8 * len(logged)


def _shows(value: float, largest: float, printed: Printed) -> bool:
    return shows_about(printed, value, coarsest=_FINE * largest)


#: A value that lasted less than this need not be logged.
_SHORTEST_NS = 1_200 * NS_PER_MS
#: Fewest numbers whose changes show that a process is always one message behind.
_CHANGES = 3
#: Fewest values between the smallest and the largest that are never logged, while only these two are.
_BETWEEN = 2
#: Largest share of the messages at whose instants a process that logs from its callback may publish, or not log.
_IN_STEP = 0.1
_PRINT_HINT = "write the received values through the node's logger: self.get_logger().info(...)"


@dataclass(frozen=True, slots=True)
class LogsReceived:
    """A process logs the numbers published to it, each at least once while it lasts or up to a second later.

    Numbers count to the precision printed. A number among so many others that chance explains it is ignored: a position
    in the text must follow the values. Values that are printed instead of logged give half the points.

    Attributes:
        process: File name of the student process.
        topic: Topic of the numbers.
        field: Path of the number; by default `data`, or else the only number of a message.
    """

    noun: ClassVar[str] = "value"
    roles: ClassVar[Roles] = Roles(hears=("topic",), given=("topic",))
    process: str
    topic: str
    field: Annotated[str, FieldOf("topic")] = ""

    @property
    def expected(self) -> str:
        return f"{self.process} logs every value that it receives on {self.topic}; half the points if only printed"

    def judge(self, trace: Trace) -> Finding:
        fault = first_fault(trace, self.process)
        values = held(trace, self.topic, self.field, heard_from_ns=heard_from_ns(trace, self.topic))
        subscriptions = student_endpoints(trace, "subscription", self.topic)
        if not subscriptions and fault is None:
            return explain_no_subscription(trace, self.topic)
        # A subscription of a type without numbers cannot have received any, whatever the grader published.
        if not values or (subscriptions and not (self.field or any(carries_number(e.type) for e in subscriptions))):
            return self._no_values(trace, subscriptions)
        return _judged(self, trace, values)

    def when_logged(
        self, trace: Trace, values: Sequence[Held], unlogged: Sequence[Held], records: Sequence[Output]
    ) -> Finding:
        """Return the finding if enough is logged."""
        evidence = self.evidence_of(values, unlogged)
        if behind := self._behind(trace, values, records):
            hint = "store the number before you log it, not after"
            return not_met(behind, evidence, hint=hint, problem=ProblemKind.BEHIND)
        reason = f"{self.process}: all {len(values)} values of {self.topic} are logged"
        return met(f"{reason} ({numbers(v.value for v in values)})", evidence)

    def when_printed(self, values: Sequence[Held], evidence: dict[str, object]) -> Finding:
        """Return the finding if enough is written, but not through the logger."""
        reason = f"{self.process}: all {len(values)} values of {self.topic} are printed, not all of them are logged"
        return only_printed(reason, evidence, _PRINT_HINT)

    def among(self, trace: Trace, values: Sequence[Held], one: Held, records: Sequence[Output]) -> str:
        """Return a clause about the numbers among which something is lost."""
        return other_numbers(records, self._sought(values, trace)[values.index(one)])

    def evidence_of(self, values: Sequence[Held], unlogged: Sequence[Held]) -> dict[str, object]:
        """Return the numbers behind the finding."""
        return {"values": [v.value for v in values], "missing": [v.value for v in unlogged]}

    def is_enough(self, values: Sequence[Held], unlogged: Sequence[Held]) -> bool:
        """Return whether enough is logged."""
        return not (values and unlogged)

    def unlogged_in(
        self, trace: Trace, values: Sequence[Held], outputs: Sequence[Output], logged: _Logged = followed
    ) -> list[Held]:
        """Return the values that are not logged, except for one that came too late."""
        found = logged(outputs, self._sought(values, trace))
        return [v for k, v in enumerate(values) if k not in found and trace.stop_ns - v.start_ns >= _SHORTEST_NS]

    def _behind(self, trace: Trace, values: Sequence[Held], records: Sequence[Output]) -> str:
        """Return that a process logs at each message, but the number of the message before; empty if it does not.

        Only virtual time tells a log in the callback of the subscription from one in a timer's.
        """
        sent = {r.t_ns for r in delivered_numbers(trace, self.topic, self.field) if r.t_ns >= values[0].start_ns}
        ticks = {m.t_ns for m in trace.of(Message)}
        # A program that also publishes at these instants acts in a timer of the same period, which may run before the
        # callback of the subscription.
        if trace.clock is not ClockKind.VIRTUAL or len(values) < _CHANGES or len(sent & ticks) > _IN_STEP * len(sent):
            return ""
        found: dict[int, list[Printed]] = {}
        for record in records:
            if record.t_ns in sent:
                found.setdefault(record.t_ns, []).extend(numbers_in(record.text))

        def shows(t_ns: int, value: float) -> bool:
            return any(n.shows(value) for n in found.get(t_ns, ()))

        changes = [(new.start_ns, old.value, new.value) for old, new in pairwise(values)]
        if len(found) <= (1 - _IN_STEP) * len(sent) or not all(
            shows(t, old) and not shows(t, new) for t, old, new in changes
        ):
            return ""
        t_ns, old, new = changes[0]
        return (
            f"{self.process}: it logs the number of the previous message on {self.topic}: "
            f"{number(old)} at {moment(t_ns)}, when {number(new)} was received"
        )

    def _no_values(self, trace: Trace, subscriptions: Sequence[Endpoint]) -> Finding:
        types = [e.type for e in subscriptions]
        if types and not self.field and not any(carries_number(t) for t in types):
            reason = f"{self.topic}: the subscription takes {quote(types[0])}, which carries no number"
            hint = "use a numeric message type, e.g. std_msgs/msg/Float32"
            return not_met(reason, {"type": types[0]}, hint=hint, problem=ProblemKind.NO_NUMBER)
        return _nothing(trace, self.process, f"{self.topic}: no number was published on it")

    def _sought(self, values: Sequence[Held], trace: Trace) -> list[Sought]:
        scale = max(abs(v.value) for v in values)
        # The last value has no later time; one nanosecond includes the end of the recording itself.
        stops = [v.stop_ns + (_LATE_NS if v.stop_ns < trace.stop_ns else 1) for v in values]
        return [
            Sought(v.start_ns, stop_ns, v.value, scale, partial(Printed.shows, value=v.value))
            for v, stop_ns in zip(values, stops, strict=True)
        ]

    def when_missing(
        self, trace: Trace, values: Sequence[Held], unlogged: Sequence[Held], evidence: dict[str, object]
    ) -> Finding:
        """Return the finding if something was never written."""
        subscriptions = student_endpoints(trace, "subscription", self.topic)
        first = unlogged[0]
        reason = f"{self.process}: {len(unlogged)} of {len(values)} values of {self.topic} are never logged, "
        reason += f"the first is {number(first.value)} at {moment(first.start_ns)}"
        sent, logged = {v.value for v in values}, {v.value for v in values} - {v.value for v in unlogged}
        # Programs that map a number to on and off log only its two ends, whatever comes between them.
        if logged and logged <= (ends := {min(sent), max(sent)}) and len(sent - ends) >= _BETWEEN:
            only = f"{' and '.join(map(number, sorted(logged)))} {'is' if len(logged) == 1 else 'are'}"
            reason += f"; only {only}, so the log does not show what was received"
        requests = [unusual_request(e) for e in subscriptions]
        if requests and requests[0] is not None and None not in requests:
            reason += f"; the subscription asks for {request_said(requests[0])}"
        hint = "log msg.data in the callback of the subscription to " + self.topic
        brief = f"{self.topic}: {number(first.value)} is never logged"
        return not_met(reason, evidence, hint=hint, problem=ProblemKind.NOT_LOGGED, brief=brief)


def _judged(check: LogsValues | LogsReceived, trace: Trace, came: Sequence[Any]) -> Finding:
    """Return the finding about what a process logged of what came to it.

    The questions in their order: is all of it logged, is it at least printed, is it lost because of a fault, does it
    stand only among so many other numbers that chance explains it, or is it missing?
    """
    fault = first_fault(trace, check.process)
    records, lines = student_records(trace, check.process), printed_lines(trace, check.process)
    unlogged: list[Any] = list(check.unlogged_in(trace, came, records))
    if isinstance(check, LogsValues) and (swapped := check.swapped_units(came, records)):
        hint = "log the unit of each number"
        return not_met(swapped, check.evidence_of(came, unlogged), hint=hint, problem=ProblemKind.WRONG_VALUE)
    if check.is_enough(came, unlogged):
        return check.when_logged(trace, came, unlogged, records)
    facts = LogFacts(len(came), len(unlogged))
    written: list[Output] = sorted([*records, *lines], key=lambda o: o.t_ns)
    unwritten: list[Any] = list(check.unlogged_in(trace, came, written))
    if check.is_enough(came, unwritten):
        return replace(check.when_printed(came, check.evidence_of(came, unlogged)), facts=facts)
    # `standing` asks whether a number stands somewhere at all, `followed` whether a place in the text follows the
    # values.
    absent: list[Any] = list(check.unlogged_in(trace, came, records, standing))
    hidden = check.is_enough(came, absent)
    lost = unlogged if hidden else absent
    evidence, facts = check.evidence_of(came, lost), LogFacts(len(came), len(lost))
    if fault is not None:
        text = f"{len(lost)} of {len(came)} {check.noun}s of {check.topic} were not logged"
        return replace(faulted(fault, text, evidence), facts=facts)
    if not hidden:
        return replace(check.when_missing(trace, came, absent, evidence), facts=facts)
    first = unlogged[0]
    among = check.among(trace, came, first, records)
    reason = f"{check.process}: {len(lost)} of {counted(len(came), check.noun)} of {check.topic} are lost among other "
    reason += f"numbers, the first is {number(first.value)} at {moment(first.t_ns)}: {among}"
    hint = f"log the number received on {check.topic}, and no others"
    return replace(not_met(reason, evidence, hint=hint, problem=ProblemKind.AMONG_OTHERS), facts=facts)


def _nothing(trace: Trace, process: str, problem: str) -> Finding:
    """Return no credit for a process that ended before any message came.

    Raises:
        HarnessError: The process was running: `problem`.
    """
    if crashed := explain_fault(trace, "nothing was logged after it", process=process):
        return crashed
    raise HarnessError(problem)
