"""The check on logs that come once for so many published messages."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from grader.core.exercise import Finding
from grader.core.quantities import within
from grader.core.trace import Message, Trace
from grader.judging.checks.logs import LOGGER_HINT
from grader.judging.findings import met, not_met, partly
from grader.judging.output import printed_lines, student_records
from grader.judging.paths import number_at
from grader.judging.printed import Output, numbers_in, shape_of
from grader.judging.silence import explain_no_message, fault_hint, first_fault
from grader.judging.values import JITTER_NS, published
from grader.judging.wording import counted, fault_sentence, moment, number, quote

#: Share of the texts of one shape that must show the published number for the shape to count as its log.
_SHOWING = 0.6
#: Share of the messages with a log from which on it is one for every message.
_FLOOD = 0.5
#: Largest difference of the average, as a share of the distance asked for.
_AVERAGE = 0.05
_MOST_IN_EVIDENCE = 60


@dataclass(frozen=True, slots=True)
class _Rhythm:
    """The numbers of the messages at which something was written, increasing."""

    places: tuple[int, ...]

    @property
    def average(self) -> float:
        return (self.places[-1] - self.places[0]) / (len(self.places) - 1)


@dataclass(frozen=True, slots=True)
class LogsEvery:
    """A process writes one log for every so many messages that it publishes, and not one for each.

    The logs that count are those that hold the published number; where none does, all that come with or after the first
    message. With which message the first of them comes is free, and a gap may be off by one message. Logs that are
    printed instead are half of it.

    Attributes:
        process: File name of the student process.
        topic: Topic that it publishes.
        every: How many messages there are from one log to the next.
        field: Path of the published number.
    """

    process: str
    topic: str
    every: int
    field: str = "data"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit for records in that rhythm, half for printed lines."""
        messages = published(trace, self.topic)
        if not messages:
            silent = explain_no_message(trace, self.topic)
            return not_met(silent.reason, silent.evidence, hint=silent.hint, blocked_by="publishes")
        if len(messages) < 2 * self.every + 1:
            return self._few(trace, messages)
        records, lines = student_records(trace, self.process), printed_lines(trace, self.process)
        logged = self._rhythms(trace, messages, records)
        flood = self._flooded(logged, messages)
        if flood:
            return flood
        right = next((r for r in logged if not self._flaw(r, messages)), None)
        if right is not None:
            return met(self._said(right, records, "logged"), self._evidence(right, messages))
        printed = self._rhythms(trace, messages, lines)
        shown = next((r for r in printed if not self._flaw(r, messages)), None)
        if shown is not None and not self._flooded(printed, messages):
            reason = f"{self._said(shown, lines, 'printed')}, not through the logger"
            return partly(reason, self._evidence(shown, messages), hint=LOGGER_HINT)
        return self._wrong(messages, logged or printed)

    def _rhythms(self, trace: Trace, messages: Sequence[Message], outputs: Sequence[Output]) -> list[_Rhythm]:
        """Return the rhythms that the outputs may be meant in, the likeliest first; that of them all is among them."""
        jitter_ns = JITTER_NS[trace.clock]
        times = [m.t_ns for m in messages]
        placed = [(bisect_right(times, o.t_ns + jitter_ns) - 1, o) for o in outputs]
        placed = [(place, o) for place, o in placed if place >= 0]
        shapes: dict[str, list[tuple[int, Output]]] = {}
        for place, output in placed:
            shapes.setdefault(shape_of(output.text), []).append((place, output))
        showing = [group for group in shapes.values() if self._shows(group, messages)]
        groups = [[pair for group in showing for pair in group], *showing] if showing else [placed, *shapes.values()]
        rhythms = [_Rhythm(tuple(sorted({place for place, _ in group}))) for group in [*groups, placed] if group]
        return list(dict.fromkeys(rhythms))

    def _shows(self, group: Sequence[tuple[int, Output]], messages: Sequence[Message]) -> bool:
        hits = 0
        for place, output in group:
            near = messages[max(0, place - 1) : place + 2]
            values = [v for m in near if (v := number_at(m.value, self.field)) is not None]
            hits += any(printed.shows(value) for printed in numbers_in(output.text) for value in values)
        return hits >= _SHOWING * len(group)

    def _flaw(self, found: _Rhythm, messages: Sequence[Message]) -> str:
        """Return what is wrong with a rhythm, as a clause; empty if nothing is."""
        places, last = found.places, len(messages) - 1
        if len(places) < 2:
            return f"only with message {places[0] + 1}"
        slack = 1 if self.every > 2 else 0
        if not within(found.average, self.every, _AVERAGE * self.every):
            return f"one for {number(found.average)} messages on average"
        gap = next(((a, b) for a, b in pairwise(places) if abs(b - a - self.every) > slack), None)
        if gap is not None:
            return f"{gap[1] - gap[0]} messages from number {gap[0] + 1} to number {gap[1] + 1}"
        if places[0] > self.every:
            return f"none before message {places[0] + 1}"
        return f"none after message {places[-1] + 1}" if last - places[-1] > self.every + slack else ""

    def _flooded(self, found: Sequence[_Rhythm], messages: Sequence[Message]) -> Finding | None:
        """Return that there is a log for every message or nearly so; None if there is not."""
        most = max(found, key=lambda rhythm: len(rhythm.places), default=_Rhythm(()))
        if self.every < 3 or len(most.places) < _FLOOD * len(messages):
            return None
        reason = f"{self.process}: something is written with {len(most.places)} of {len(messages)} messages; "
        hint = f"count the messages, and log when the count is divisible by {self.every}: count % {self.every} == 0"
        return not_met(reason + self._wanted, self._evidence(most, messages), hint=hint)

    @property
    def _wanted(self) -> str:
        return f"expected one log for every {self.every} messages on {self.topic}"

    def _said(self, found: _Rhythm, outputs: Sequence[Output], how: str) -> str:
        reason = f"{self.process}: {counted(len(found.places), 'time')} {how}, one for {number(found.average)} messages"
        first = next((o for o in outputs if numbers_in(o.text)), outputs[0])
        return f"{reason} on {self.topic}: {quote(first.text, 80)}"

    def _evidence(self, found: _Rhythm, messages: Sequence[Message]) -> dict[str, Any]:
        places = [place + 1 for place in found.places[:_MOST_IN_EVIDENCE]]
        return {"messages": len(messages), "logs": len(found.places), "with_message": places, "every": self.every}

    def _few(self, trace: Trace, messages: Sequence[Message]) -> Finding:
        fault = first_fault(trace, self.process)
        reason = f"{self.topic}: {counted(len(messages), 'message')} cannot show one log for every {self.every}"
        if fault is None:
            return not_met(reason, {"messages": len(messages)}, blocked_by="topic_rate")
        return not_met(f"{fault_sentence(fault)}; {reason}", hint=fault_hint(fault), fault=fault)

    def _wrong(self, messages: Sequence[Message], found: Sequence[_Rhythm]) -> Finding:
        if not found:
            first = moment(messages[0].t_ns)
            reason = f"{self.process}: nothing is logged from the first message at {first} on; {self._wanted}"
            return not_met(reason, {"messages": len(messages), "logs": 0, "every": self.every}, hint=LOGGER_HINT)
        flaw = self._flaw(found[0], messages)
        reason = f"{self.process}: {counted(len(found[0].places), 'log')}, {flaw}; {self._wanted}"
        hint = f"count every message that is published, and log when count % {self.every} == 0"
        return not_met(reason, self._evidence(found[0], messages), hint=hint)
