"""The cause behind logs that nobody sees: they go into a file."""

from __future__ import annotations

import ast

from grader.core.exercise import Outcome
from grader.judging.checks.logs import UsesLogger
from grader.judging.checks.odometry import LogsPosition
from grader.judging.checks.sensor import LogsReceived
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.output import printed_lines, student_records
from grader.judging.source import Source, argument, chain, last_name, text_of

_HANDLERS = ("FileHandler", "RotatingFileHandler", "TimedRotatingFileHandler", "WatchedFileHandler")
_OPENS = ("open", "io.open", "codecs.open")


def _into_file(case: Case) -> Clue | None:
    """Nothing that was asked for is logged or printed, and the program writes into a file."""
    source = case.source
    if source is None or case.fault is not None or case.verdict.outcome is not Outcome.NOT_MET or not _unseen(case):
        return None
    writing = _opened(source)
    if writing is None:
        return None
    hint = f"{source.code(writing, 60)}: what goes into a file is not seen by the grader; "
    return Clue(f"{hint}write it with self.get_logger().info(...)", source.place(writing), key="into_file")


def _unseen(case: Case) -> bool:
    check = case.criterion.check
    if isinstance(check, UsesLogger):
        return not student_records(case.trace, case.process) and not printed_lines(case.trace, case.process)
    if isinstance(check, LogsPosition):
        return case.evidence("cause") in ("nothing", "no_pair") and case.evidence("right") == 0
    values, missing = case.evidence("values"), case.evidence("missing")
    return isinstance(check, LogsReceived) and bool(values) and values == missing


def _opened(source: Source) -> ast.Call | None:
    """Return the call that opens a file for what is logged, if there is one."""
    return next((call for call in source.all(ast.Call) if _writes(call)), None)


def _writes(call: ast.Call) -> bool:
    name = last_name(call.func)
    if name in _HANDLERS or name == "write_text":
        return True
    if name == "basicConfig":
        return any(k.arg == "filename" for k in call.keywords)
    plain = chain(call.func) in _OPENS
    mode = text_of(argument(call, 1 if plain else 0, "mode")) if name == "open" else None
    return bool(mode) and mode is not None and bool(set(mode) & set("wax"))


FILES = (Cause("into_file", _into_file),)
