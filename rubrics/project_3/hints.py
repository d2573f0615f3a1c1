"""A hint rule of project 3: a client that logs one decision at the level of the other."""

from __future__ import annotations

import ast
from dataclasses import dataclass

from grader.api import Case, Clue, LogRecord, Outcome, hint_rule, is_log, last_name, number


@dataclass(frozen=True, slots=True)
class _Reaction:
    """What a client logged between a response and its next request."""

    records: tuple[LogRecord, ...]

    @property
    def warned(self) -> bool:
        return any(r.severity in ("WARN", "ERROR", "FATAL") for r in self.records)

    def lines(self, severity: str) -> set[int]:
        return {r.line for r in self.records if r.severity == severity}


def _after(case: Case, kind: str) -> list[_Reaction]:
    """Return the reactions to the responses of a kind."""
    mine = (e for e in case.check.episodes(case.trace) if e.kind.value == kind)
    return [_Reaction(tuple(o for o in e.sure if isinstance(o, LogRecord))) for e in mine]


@hint_rule("reacts_to_responses", outcome=Outcome.NOT_MET, priority=3140)
def _wrong_level(case: Case) -> Clue | None:
    """One side logs at the level of the other, or at a level that is not shown."""
    check = case.check
    good, low = _after(case, "good"), _after(case, "low")
    if check.side == "above" and good and low and all(a.warned for a in good + low):
        lines = set.intersection(*(a.lines("WARN") for a in good)) - set().union(*(a.lines("WARN") for a in low))
        return _level_clue(case, lines, f"use info above {number(check.threshold)}")
    if check.side == "at_or_below" and good and low and not any(a.warned for a in good + low):
        lines = set.intersection(*(a.lines("INFO") for a in low)) - set().union(*(a.lines("INFO") for a in good))
        return _level_clue(case, lines, "use warning") or _unseen_level(case, "warning")
    return _unseen_level(case, "info") if check.side == "above" and not any(a.warned for a in good) else None


def _level_clue(case: Case, lines: set[int], advice: str) -> Clue | None:
    calls = [c for line in sorted(lines) for c in case.source.on_line(line, ast.Call) if is_log(case.source, c)]
    if len(calls) != 1:
        return None
    hint = f"{case.source.code(calls[0], 60)} has the wrong level, {last_name(calls[0].func)}: {advice}"
    return Clue(hint, case.source.place(calls[0]))


def _unseen_level(case: Case, level: str) -> Clue | None:
    """Return the only log of level DEBUG, which nobody sees."""
    hidden = [c for c in case.source.calls("debug") if is_log(case.source, c)]
    if len(hidden) != 1 or any(case.source.calls("set_level", "set_logger_level")):
        return None
    hint = f"{case.source.code(hidden[0], 60)} is not shown, because the default level is INFO: use {level}"
    return Clue(hint, case.source.place(hidden[0]))
