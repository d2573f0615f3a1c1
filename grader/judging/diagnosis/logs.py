"""Causes behind logs that are printed, hidden, missing, wrong, or too many."""

from __future__ import annotations

import ast
import re
from collections import Counter

from grader.judging.checks.logs import UsesLogger
from grader.judging.checks.odometry import LogPeriod, LogsPosition, WaitsGracefully
from grader.judging.checks.sensor import LogsReceived
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.constants import constant
from grader.judging.diagnosis.silence import timer_code
from grader.judging.diagnosis.source import Source, argument, chain, last_name, text_of
from grader.judging.diagnosis.wiring import Made, is_log, made, made_for, reached, roots
from grader.judging.output import printed_lines, student_records
from grader.judging.wording import number
from grader.model.exercise import Location, Outcome
from grader.model.quantities import seconds

_COMMENTED_LOG = re.compile(r"^\s*#.*get_logger\(\)\.(info|warn|warning|error)\s*\(")


def _prints(source: Source) -> list[ast.Call]:
    return [c for c in source.all(ast.Call) if chain(c.func) in ("print", "sys.stdout.write", "pprint")]


def _printed(case: Case) -> Clue | None:
    """Lines are printed that should be logged."""
    check = case.criterion.check
    partly = case.verdict.outcome is Outcome.PARTLY
    if not isinstance(check, (UsesLogger, LogsPosition, LogsReceived)) or not partly or case.source is None:
        return None
    source = case.source
    prints = [c for c in _prints(source) if c.args]
    if isinstance(check, LogsReceived):
        item = made_for(source, "subscription", check.topic)
        inside = set(reached(source, roots(source, item.callback))) if item is not None else set()
        prints = [c for c in prints if c in inside] or prints
    elif len(prints) > 1:
        prints = _most_printed(case, prints)
    if not prints:
        return _python_logging(case)
    code = source.code(prints[0], 60)
    hint = f"{code} does not log: write self.get_logger().info(...)"
    return Clue(hint, source.place(prints[0]), key="printed")


def _most_printed(case: Case, prints: list[ast.Call]) -> list[ast.Call]:
    """Return the print calls with those first whose fixed text is in the lines that were printed most."""
    lines = [o.text for o in printed_lines(case.trace, case.process)][:400]

    def seen(call: ast.Call) -> int:
        words = [w for n in ast.walk(call) if (w := text_of(n)) and len(w.strip()) > 2]
        return max((sum(w.strip() in line for line in lines) for w in words), default=0)

    return sorted(prints, key=seen, reverse=True) if isinstance(case.criterion.check, LogsPosition) else prints


def _python_logging(case: Case) -> Clue | None:
    """Python's own logging module instead of the node's logger."""
    check = case.criterion.check
    if not isinstance(check, UsesLogger) or case.source is None or case.fault is not None:
        return None
    source = case.source
    own = [c for c in source.all(ast.Call) if chain(c.func).startswith("logging.") and last_name(c.func) in _LEVELS]
    if not own:
        return None
    hint = f"{source.code(own[0])} is Python's own logging, which ROS does not see: self.get_logger().info(...)"
    return Clue(hint, source.place(own[0]))


_LEVELS = ("debug", "info", "warning", "warn", "error", "critical", "exception")


def _nothing_logged(case: Case) -> bool:
    check = case.criterion.check
    asks = isinstance(check, (UsesLogger, LogsPosition))
    return asks and case.fault is None and not student_records(case.trace, case.process)


def _debug_only(case: Case) -> Clue | None:
    if not _nothing_logged(case) or case.source is None or list(case.source.calls("set_level")):
        return None
    logs = [n for n in case.source.all(ast.Call) if is_log(n)]
    if not logs or any(last_name(c.func) != "debug" for c in logs):
        return None
    hint = f"{case.source.code(logs[0], 60)} is not shown: the level is INFO unless it is changed; use info"
    return Clue(hint, case.source.place(logs[0]))


def _commented_out(case: Case) -> Clue | None:
    if not _nothing_logged(case) or case.source is None or any(is_log(n) for n in case.source.all(ast.Call)):
        return None
    row = next((k for k, line in enumerate(case.source.lines, 1) if _COMMENTED_LOG.match(line[:300])), 0)
    if not row or case.verdict.outcome is Outcome.PARTLY:
        return None
    return Clue("the log is commented out: take the # away", Location(case.source.file, row))


def position_log(case: Case) -> ast.Call | None:
    """Return the call that wrote most of the records."""
    if case.source is None:
        return None
    source = case.source
    lines = Counter(r.line for r in student_records(case.trace, case.process) if r.file == source.file and r.line)
    for row, _ in lines.most_common():
        call = next((c for c in source.on_line(row, ast.Call) if is_log(c)), None)
        if call is not None:
            return call
    logs = [n for n in source.all(ast.Call) if is_log(n)]
    return logs[0] if len(logs) == 1 else None


def _log_period(case: Case) -> Clue | None:
    """The timer, the throttle or the callback that sets the pace of the logs."""
    check = case.criterion.check
    average = case.evidence("average_period_s")
    if not isinstance(check, LogPeriod) or case.source is None or case.fault is not None:
        return None
    source, call, wanted = case.source, position_log(case), seconds(check.period)
    if call is None or not isinstance(average, float):
        return None
    throttle = argument(call, 99, "throttle_duration_sec")
    worth = constant(source, throttle)
    if worth is not None and 0.8 * worth.value <= average <= 1.3 * worth.value:
        hint = f"throttle_duration_sec={number(worth.value)} lets a log through every {number(worth.value)} s"
        return Clue(f"{hint}: write {wanted}", source.place(worth.origin), key="log_pace")
    timers = [m for m in made(source, "timer") if call in set(reached(source, roots(source, m.callback)))]
    if timers:
        return _timer_pace(source, timers, average, wanted) if len(timers) == 1 else None
    heard = [m for m in made(source, "subscription") if call in set(reached(source, roots(source, m.callback)))]
    if heard and throttle is None and "one for every message" in case.verdict.reason:
        hint = "this logs every message: give it throttle_duration_sec=1.0, or log the newest position from a timer"
        return Clue(hint, source.place(call), key="log_pace")
    return None


def _timer_pace(source: Source, timers: list[Made], average_s: float, wanted_s: float) -> Clue | None:
    worth = constant(source, timers[0].period)
    if worth is None or abs(worth.value - average_s) > 0.05 * average_s or worth.value == wanted_s:
        return None
    hint = f"{timer_code(source, timers[0])} is called every {number(worth.value)} s: write {wanted_s}"
    return Clue(hint, source.place(worth.origin), key="log_pace")


def _logged_once(case: Case) -> Clue | None:
    check = case.criterion.check
    call = position_log(case) if isinstance(check, (LogPeriod, LogsPosition)) and case.fault is None else None
    once = argument(call, 99, "once") if call is not None else None
    if call is None or case.source is None or not (isinstance(once, ast.Constant) and once.value is True):
        return None
    hint = "once=True lets this log through a single time: take it out"
    return Clue(hint, case.source.place(call), key="once")


def _received_not_logged(case: Case) -> Clue | None:
    """The callback of the subscription logs nothing, or not what it received."""
    check = case.criterion.check
    if not isinstance(check, LogsReceived) or case.source is None or case.fault is not None:
        return None
    source = case.source
    item = made_for(source, "subscription", check.topic)
    start = roots(source, item.callback) if item is not None else []
    if item is None or not start or not case.evidence("missing"):
        return None
    inside = list(reached(source, start))
    logs = [n for n in inside if isinstance(n, ast.Call) and is_log(n)]
    name = last_name(item.callback) or "the callback"
    if not logs and case.verdict.outcome is Outcome.NOT_MET:
        if any(is_log(n) and _mentions_stored(n, inside) for n in source.all(ast.Call)):
            return None
        return Clue(f"{name} receives the values and logs none of them: log msg.data in it", source.place(start[0]))
    if len(logs) == 1 and not any(isinstance(n, (ast.Name, ast.Attribute)) for a in logs[0].args for n in _inner(a)):
        return Clue("this log holds no value: log what was received, msg.data", source.place(logs[0]))
    return None


def _inner(node: ast.AST) -> list[ast.AST]:
    """Return the nodes that may give a text its value; the test of a conditional gives none."""
    if isinstance(node, ast.IfExp):
        return [*ast.walk(node.body), *ast.walk(node.orelse)]
    return list(ast.walk(node))


def _mentions_stored(log: ast.AST, callback: list[ast.AST]) -> bool:
    """Return whether a log elsewhere shows an attribute that the callback stores."""
    stored = {chain(n) for n in callback if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)}
    return any(chain(n) in stored for n in ast.walk(log) if isinstance(n, ast.Attribute))


def _error_while_waiting(case: Case) -> Clue | None:
    check = case.criterion.check
    if not isinstance(check, WaitsGracefully) or case.source is None or case.verdict.location is None or case.fault:
        return None
    logs = (c for c in case.source.on_line(case.verdict.location.line, ast.Call) if is_log(c))
    call = next(logs, None)
    if call is None or last_name(call.func) not in ("error", "fatal"):
        return None
    return Clue(f"that no data has come yet is no failure: use info or warn instead of {last_name(call.func)}")


LOGS = (
    Cause("printed", _printed),
    Cause("python_logging", _python_logging),
    Cause("debug_only", _debug_only),
    Cause("commented_out", _commented_out),
    Cause("logged_once", _logged_once),
    Cause("log_period", _log_period),
    Cause("received_not_logged", _received_not_logged),
    Cause("error_while_waiting", _error_while_waiting),
)
