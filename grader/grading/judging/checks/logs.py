"""Checks on a node's log records: whether it writes any, their content, and how often they come."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from grader.grading.judging.charts import Lanes, gaps_panel, series
from grader.grading.judging.findings import (
    LOGGER_HINT,
    explain_fault,
    explain_no_message,
    fault_sentence,
    faulted,
    first_fault,
    limit_hint,
    met,
    not_met,
    observed,
    only_printed,
    waiting_for,
)
from grader.grading.judging.logs.outputs import Output, is_no_node, numbers_in, printed_lines, shape_of, student_records
from grader.grading.judging.plots import Drawing, Plot
from grader.grading.judging.values import JITTER_NS, LONGEST_MATCHED, number_at, published
from grader.grading.model.chart import Band, Level, Look, Panel, Tone
from grader.grading.model.exercise import Finding, Location, ProblemKind, Roles
from grader.grading.model.wording import first_few, moment, number, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import DurationNs, FieldOf, Pattern, counted, seconds, within
from grader.runtime.model.trace import LogRecord, Message, Trace


def no_node(trace: Trace, process: str, evidence: dict[str, object]) -> Finding:
    """Return no credit for output of a process without a node."""
    reason = f"{process}: no node in the ROS graph in {observed(trace)}; output without a node does not count"
    fault = first_fault(trace, process)
    if fault is not None:
        reason = f"{fault_sentence(fault)}; {reason}"
    hint = "create the node, and log with node.get_logger()"
    return not_met(reason, evidence, hint=hint, fault=fault, problem=ProblemKind.NO_NODE)


def complained(process: str, bad: Sequence[LogRecord], when: str, more: Mapping[str, object], hint: str) -> Finding:
    """Return no credit for records of severity ERROR or FATAL, at the place of the first one."""
    reason = f"{process}: {counted(len(bad), 'record')} of severity ERROR or FATAL{when}, the first at "
    reason += f"{moment(bad[0].t_ns)}: {quote(bad[0].text)}"
    location = Location(bad[0].file, bad[0].line) if bad[0].file and bad[0].line > 0 else None
    return replace(
        not_met(reason, {"records": len(bad), **more}, hint=hint, problem=ProblemKind.ERRORS_LOGGED), location=location
    )


@dataclass(frozen=True, slots=True)
class UsesLogger:
    """A process writes at least one record through an rclpy logger, of any visible severity.

    Lines that are printed instead give half the points. A process without a node in the ROS graph logs nothing, and the
    prompt of an `input()` is not a line.

    Attributes:
        process: File name of the student process, e.g. `velocity_publisher.py`.
    """

    process: str

    @property
    def expected(self) -> str:
        return f"a record of {self.process} through its logger; half if only printed"

    def judge(self, trace: Trace) -> Finding:
        records = student_records(trace, self.process)
        lines = printed_lines(trace, self.process)
        evidence = {"process": self.process, "records": len(records), "printed_lines": len(lines)}
        # Without any output, the missing log is the first thing to say; the missing node has criteria of its own.
        if (records or lines) and is_no_node(trace, self.process):
            return no_node(trace, self.process, evidence)
        if records:
            first = records[0]
            reason = f"{self.process}: {counted(len(records), 'log record')}, the first at {moment(first.t_ns)}"
            evidence |= {"first_s": seconds(first.t_ns), "first": quote(first.text), "severity": first.severity}
            return met(f"{reason}: {quote(first.text)}", evidence)
        if lines:
            reason = f"{self.process}: {counted(len(lines), 'line')} printed, none through the logger"
            return only_printed(reason, evidence | {"first": quote(lines[0].text)})
        return explain_fault(trace, "nothing was logged", evidence, process=self.process) or not_met(
            f"{self.process}: no log record in {observed(trace)}",
            evidence,
            hint=limit_hint(trace) or LOGGER_HINT,
            problem=ProblemKind.NOT_LOGGED,
        )


_LEVELS = ("DEBUG", "INFO", "WARN", "ERROR", "FATAL")


@dataclass(frozen=True, slots=True)
class LogsMatching:
    """A process writes enough log records that match a pattern, of a level, with a period if one is given.

    Matching printed lines give half the points, if their number and period are right.

    Attributes:
        process: File name of the student process.
        pattern: Regular expression that is found in the text; every text if left out.
        level: Lowest severity that counts.
        exactly: Whether higher severities do not count.
        at_least: Fewest records.
        at_most: Most records; any number if left out.
        period: Average time expected from one to the next.
        tolerance: Largest difference of the average, as a share of the period.
    """

    process: str
    pattern: Pattern | None = None
    level: Literal["DEBUG", "INFO", "WARN", "ERROR", "FATAL"] = "DEBUG"
    exactly: bool = False
    at_least: int = 1
    at_most: int | None = None
    period: DurationNs | None = None
    tolerance: float = 0.1

    @property
    def expected(self) -> str:
        most = f" and at most {self.at_most}" if self.at_most is not None else ""
        text = f" matching {self.pattern}" if self.pattern else ""
        level = "" if self.level == "DEBUG" else f" of severity {self.level}{'' if self.exactly else ' or higher'}"
        every = f", one every {number(seconds(self.period))} s" if self.period is not None else ""
        return f"at least {self.at_least}{most} log records of {self.process}{level}{text}{every}"

    def judge(self, trace: Trace) -> Finding:
        records = student_records(trace, self.process)
        mine = [r for r in records if self._of_level(r) and self._matches(r)]
        flaw = self._flaw(mine)
        evidence = self._evidence(mine)
        # A program may log without a node, through rclpy's own loggers; the exercise asks for what nodes do.
        if mine and is_no_node(trace, self.process):
            return no_node(trace, self.process, evidence)
        if not flaw:
            first = f", the first at {moment(mine[0].t_ns)}: {quote(mine[0].text, 80)}" if mine else ""
            return met(f"{self.process}: {counted(len(mine), 'record')}{first}", evidence)
        lines = [o for o in printed_lines(trace, self.process) if self._matches(o)]
        if (
            lines
            and not is_no_node(trace, self.process)
            and not self._flaw(sorted([*mine, *lines], key=lambda o: o.t_ns))
        ):
            reason = f"{self.process}: {counted(len(lines), 'line')} printed, {counted(len(mine), 'record')} logged"
            return only_printed(f"{reason}; expected {self.expected}", evidence)
        reason = f"{self.process}: {flaw}; expected {self.expected}"
        fault = first_fault(trace, self.process)
        # Too many records, or a wrong period, were there before the crash.
        if fault is not None and len(mine) < self.at_least:
            return faulted(fault, flaw, evidence)
        return not_met(reason + self._others(records), evidence)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the records that match and the others, and the time from one match to the next."""
        records = student_records(trace, self.process)
        mine = [r for r in records if self._of_level(r) and self._matches(r)]
        if not records:
            return Drawing()
        lanes = Lanes()
        lanes.add("matching")
        lanes.write("matching", mine, Tone.GOOD)
        lanes.add("other")
        lanes.write("other", (r for r in records if r not in mine), Tone.FAINT)
        lines = printed_lines(trace, self.process)
        if lines:
            lanes.add("printed")
            lanes.write("printed", lines, Tone.SECOND)
        said = f"{len(mine)} of {counted(len(records), 'record')} match."
        panels = [(lanes.panel(self.process), said)]
        if self.period is not None and len(mine) > 1:
            share = self.tolerance * self.period
            label = f"{number(seconds(self.period))} s ± {number(100 * self.tolerance)} % on average"
            band = Band(seconds(round(self.period - share)), seconds(round(self.period + share)), label)
            panels.append((gaps_panel("match", [r.t_ns for r in mine], bands=(band,)), ""))
        return Drawing(panels=tuple(panels), title=f"What {self.process} logged")

    def _of_level(self, record: LogRecord) -> bool:
        if record.severity not in _LEVELS:
            return False
        rank = _LEVELS.index(record.severity) - _LEVELS.index(self.level)
        return rank == 0 if self.exactly else rank >= 0

    def _matches(self, output: Output) -> bool:
        return self.pattern is None or re.search(self.pattern, output.text[:LONGEST_MATCHED]) is not None

    def _flaw(self, found: Sequence[Output]) -> str:
        if len(found) < self.at_least or (self.at_most is not None and len(found) > self.at_most):
            return f"{counted(len(found), 'record')} of that kind"
        if self.period is None:
            return ""
        if len(found) < 2:
            return f"{counted(len(found), 'record')}, too few to measure a period"
        average = (found[-1].t_ns - found[0].t_ns) / (len(found) - 1)
        if within(average, self.period, self.tolerance * self.period):
            return ""
        return f"{len(found)} records, one every {average / 1e9:.3f} s on average"

    def _evidence(self, found: Sequence[Output]) -> dict[str, object]:
        return {"records": len(found), "times_s": [seconds(o.t_ns) for o in found[:60]]}

    def _others(self, records: Sequence[LogRecord]) -> str:
        seen = list(dict.fromkeys(f"{r.severity} {quote(r.text, 50)}" for r in records))
        return f"; logged: {first_few(seen, 2)}" if seen else "; nothing was logged"


#: Minimum share of the texts of one shape that must show the published number for the shape to count as its log.
_SHOWING = 0.6
#: Minimum share of the messages with a log for the logs to count as one for every message.
_FLOOD = 0.5
#: Largest difference of the average, as a share of the expected distance.
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
    """A process writes one log for every n messages that it publishes, and not one for each.

    The logs that hold the published number count; without any, all logs with or after the first message. The first log
    may come with any message, and a gap may be off by one message. Logs that are printed instead give half the points.

    Attributes:
        process: File name of the student process.
        topic: Topic that it publishes.
        every: Number of messages from one log to the next.
        field: Path of the published number.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    process: str
    topic: str
    every: int
    field: Annotated[str, FieldOf("topic")] = "data"

    @property
    def expected(self) -> str:
        return f"one log of {self.process} for every {self.every} messages on {self.topic}; half if only printed"

    def judge(self, trace: Trace) -> Finding:
        messages = published(trace, self.topic)
        if not messages:
            return waiting_for("publishes", explain_no_message(trace, self.topic))
        # Two whole distances: with one, a program that logs once at all would pass.
        if len(messages) < 2 * self.every + 1:
            return self._few(trace, messages)
        records, lines = student_records(trace, self.process), printed_lines(trace, self.process)
        logged = self._rhythms(trace, messages, records)
        flood = self._flooded(logged, messages)
        if flood:
            return flood
        # One right reading suffices: a program may log other things as well, and nothing says which of its logs is
        # meant.
        right = next((r for r in logged if not self._flaw(r, messages)), None)
        if right is not None:
            return met(self._said(right, records, "logged"), self._evidence(right, messages))
        printed = self._rhythms(trace, messages, lines)
        shown = next((r for r in printed if not self._flaw(r, messages)), None)
        if shown is not None and not self._flooded(printed, messages):
            reason = f"{self._said(shown, lines, 'printed')}, not through the logger"
            return only_printed(reason, self._evidence(shown, messages))
        return self._wrong(messages, logged or printed)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the published numbers, the messages from one log to the next, and the logs."""
        messages = published(trace, self.topic)
        records, lines = student_records(trace, self.process), printed_lines(trace, self.process)
        found = self._rhythms(trace, messages, records) or self._rhythms(trace, messages, lines)
        panels: list[tuple[Panel, str]] = []
        if found and len(found[0].places) > 1:
            pairs = [(seconds(messages[b].t_ns), float(b - a)) for a, b in pairwise(found[0].places)]
            level = Level(self.every, f"{self.every} messages")
            dots = series("messages since the previous log", pairs, look=Look.DOTS, tone=Tone.SECOND)
            said = f"{counted(len(found[0].places), 'log')}, one for {number(found[0].average)} messages on average."
            panels.append((Panel("from log to log", "messages", (dots,), levels=(level,)), said))
        return Drawing((Plot(self.topic, (self.field,)),), panels=tuple(panels), processes=(self.process,))

    def _rhythms(self, trace: Trace, messages: Sequence[Message], outputs: Sequence[Output]) -> list[_Rhythm]:
        """Return the possible interpretations of the outputs, the likeliest first, including that of all outputs."""
        jitter_ns = JITTER_NS[trace.clock]
        times = [m.t_ns for m in messages]
        # A log belongs to the last message before it: programs log while or after they publish.
        placed = [(bisect_right(times, o.t_ns + jitter_ns) - 1, o) for o in outputs]
        # What was written before the first message is about something else.
        placed = [(place, o) for place, o in placed if place >= 0]
        shapes: dict[str, list[tuple[int, Output]]] = {}
        for place, output in placed:
            shapes.setdefault(shape_of(output.text), []).append((place, output))
        # Texts of one shape are one statement of the program; those with the published number are meant, if there are
        # any.
        showing = [group for group in shapes.values() if self._shows(group, messages)]
        groups = [[pair for group in showing for pair in group], *showing] if showing else [placed, *shapes.values()]
        rhythms = [_Rhythm(tuple(sorted({place for place, _ in group}))) for group in [*groups, placed] if group]
        return list(dict.fromkeys(rhythms))

    def _shows(self, group: Sequence[tuple[int, Output]], messages: Sequence[Message]) -> bool:
        hits = 0
        for place, output in group:
            # A program may log before it publishes, or count before it logs.
            near = messages[max(0, place - 1) : place + 2]
            values = [v for m in near if (v := number_at(m.value, self.field)) is not None]
            hits += any(printed.shows(value) for printed in numbers_in(output.text) for value in values)
        return hits >= _SHOWING * len(group)

    def _flaw(self, found: _Rhythm, messages: Sequence[Message]) -> str:
        """Describe what is wrong with the spacing, as a clause; empty if nothing is."""
        places, last = found.places, len(messages) - 1
        if len(places) < 2:
            return f"only with message {places[0] + 1}"
        # With a log for every second message, a gap that is off by one would be a log for each.
        slack = 1 if self.every > 2 else 0
        if not within(found.average, self.every, _AVERAGE * self.every):
            return f"one for {number(found.average)} messages on average"
        gap = next(((a, b) for a, b in pairwise(places) if abs(b - a - self.every) > slack), None)
        if gap is not None:
            return f"{gap[1] - gap[0]} messages from number {gap[0] + 1} to number {gap[1] + 1}"
        # Counting from 0 or from 1, the first log comes with one of the first messages.
        if places[0] > self.every:
            return f"none before message {places[0] + 1}"
        return f"none after message {places[-1] + 1}" if last - places[-1] > self.every + slack else ""

    def _flooded(self, found: Sequence[_Rhythm], messages: Sequence[Message]) -> Finding | None:
        """Return a finding if there is a log for nearly every message; None otherwise."""
        most = max(found, key=lambda rhythm: len(rhythm.places), default=_Rhythm(()))
        # Half of the messages is right if every second one is asked for.
        if self.every < 3 or len(most.places) < _FLOOD * len(messages):
            return None
        reason = f"{self.process}: there is output for {len(most.places)} of {len(messages)} messages; "
        hint = f"count the messages, and log when the count is divisible by {self.every}: count % {self.every} == 0"
        return not_met(
            reason + self._wanted, self._evidence(most, messages), hint=hint, problem=ProblemKind.ONE_PER_MESSAGE
        )

    @property
    def _wanted(self) -> str:
        return f"expected one log for every {self.every} messages on {self.topic}"

    def _said(self, found: _Rhythm, outputs: Sequence[Output], how: str) -> str:
        reason = f"{self.process}: {how} {counted(len(found.places), 'time')}, one for {number(found.average)} messages"
        first = next((o for o in outputs if numbers_in(o.text)), outputs[0])
        return f"{reason} on {self.topic}: {quote(first.text, 80)}"

    def _evidence(self, found: _Rhythm, messages: Sequence[Message]) -> dict[str, object]:
        places = [place + 1 for place in found.places[:_MOST_IN_EVIDENCE]]
        return {"messages": len(messages), "logs": len(found.places), "with_message": places, "every": self.every}

    def _few(self, trace: Trace, messages: Sequence[Message]) -> Finding:
        reason = f"{self.topic}: {counted(len(messages), 'message')} are too few to show one log for every {self.every}"
        few = not_met(reason, {"messages": len(messages)}, blocked_by="topic_rate", problem=ProblemKind.TOO_FEW)
        return explain_fault(trace, reason, process=self.process) or few

    def _wrong(self, messages: Sequence[Message], found: Sequence[_Rhythm]) -> Finding:
        if not found:
            first = moment(messages[0].t_ns)
            reason = f"{self.process}: nothing is logged from the first message at {first} on; {self._wanted}"
            known = {"messages": len(messages), "logs": 0, "every": self.every}
            return not_met(reason, known, hint=LOGGER_HINT, problem=ProblemKind.NOT_LOGGED)
        flaw = self._flaw(found[0], messages)
        reason = f"{self.process}: {counted(len(found[0].places), 'log')}, {flaw}; {self._wanted}"
        hint = f"count every message that is published, and log when count % {self.every} == 0"
        return not_met(reason, self._evidence(found[0], messages), hint=hint)
