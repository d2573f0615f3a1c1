"""The check on logs by their level, their text, their number and their period."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from grader.core.exercise import Finding, Pattern
from grader.core.quantities import DurationNs, seconds, within
from grader.core.trace import LogRecord, Trace
from grader.judging.checks.logs import LOGGER_HINT, no_node
from grader.judging.findings import met, not_met, partly
from grader.judging.output import is_no_node, printed_lines, student_records
from grader.judging.printed import Output
from grader.judging.silence import fault_hint, first_fault
from grader.judging.wording import counted, fault_sentence, listed, moment, number, quote

_LEVELS = ("DEBUG", "INFO", "WARN", "ERROR", "FATAL")
_LONGEST = 2_000


@dataclass(frozen=True, slots=True)
class LogsMatching:
    """A process writes log records that match a pattern, of a level, so many of them, with a period where one is given.

    Lines that match are half of it, if they are enough and come in that period.

    Attributes:
        process: File name of the student process.
        pattern: Regular expression that is found in the text; every text if left out.
        level: Lowest severity that counts.
        exactly: Whether a higher severity does not count.
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
        """What is expected, in one phrase."""
        most = f" and at most {self.at_most}" if self.at_most is not None else ""
        text = f" matching {self.pattern}" if self.pattern else ""
        level = "" if self.level == "DEBUG" else f" of severity {self.level}{'' if self.exactly else ' or higher'}"
        every = f", one every {number(seconds(self.period))} s" if self.period is not None else ""
        return f"at least {self.at_least}{most} log records of {self.process}{level}{text}{every}"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit for records, half for printed lines."""
        records = student_records(trace, self.process)
        mine = [r for r in records if self._of_level(r) and self._matches(r)]
        flaw = self._flaw(mine)
        evidence = self._evidence(mine)
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
            return partly(f"{reason}; expected {self.expected}", evidence, hint=LOGGER_HINT)
        reason = f"{self.process}: {flaw}; expected {self.expected}"
        fault = first_fault(trace, self.process)
        if fault is not None and len(mine) < self.at_least:
            return not_met(f"{fault_sentence(fault)}; {flaw}", evidence, hint=fault_hint(fault), fault=fault)
        return not_met(reason + self._others(records), evidence)

    def _of_level(self, record: LogRecord) -> bool:
        if record.severity not in _LEVELS:
            return False
        rank = _LEVELS.index(record.severity) - _LEVELS.index(self.level)
        return rank == 0 if self.exactly else rank >= 0

    def _matches(self, output: Output) -> bool:
        return self.pattern is None or re.search(self.pattern, output.text[:_LONGEST]) is not None

    def _flaw(self, found: Sequence[Output]) -> str:
        if len(found) < self.at_least or (self.at_most is not None and len(found) > self.at_most):
            return f"{counted(len(found), 'record')} of that kind"
        if self.period is None:
            return ""
        if len(found) < 2:
            return f"{counted(len(found), 'record')}, too few to have a period"
        average = (found[-1].t_ns - found[0].t_ns) / (len(found) - 1)
        if within(average, self.period, self.tolerance * self.period):
            return ""
        return f"{len(found)} records, one every {average / 1e9:.3f} s on average"

    def _evidence(self, found: Sequence[Output]) -> dict[str, Any]:
        return {"records": len(found), "times_s": [seconds(o.t_ns) for o in found[:60]]}

    def _others(self, records: Sequence[LogRecord]) -> str:
        seen = list(dict.fromkeys(f"{r.severity} {quote(r.text, 50)}" for r in records))
        return f"; logged: {listed(seen, 2)}" if seen else "; nothing was logged"
