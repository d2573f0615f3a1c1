"""Causes of logs that are printed, hidden, missing, wrong, too frequent, or written to a file."""

from __future__ import annotations

import ast
import math
import re

from grader.grading.judging.diagnosis.rules import Case, Clue, hint_rule, log_call, rounded_down, silent_topic
from grader.grading.judging.diagnosis.wiring import (
    Made,
    callback_nodes,
    conditions,
    constant_value,
    is_flag,
    is_log,
    is_read,
    made,
    made_for,
    message_of,
    names_in,
    number_in_code,
    pauses,
    python_loggers,
    reached,
    roots,
    runs,
    set_at_first_only,
    stored_elsewhere,
    switches,
    target_of,
    time_since,
    timer_code,
    unformatted_fields,
    value_of,
)
from grader.grading.judging.facts import LogFacts, LogPaceFacts, WrongLogFacts
from grader.grading.judging.logs.outputs import printed_lines, student_records
from grader.grading.judging.source import Source, argument, chain, last_name, literal_text, subtree
from grader.grading.model.exercise import Location, Outcome, ProblemKind
from grader.grading.model.wording import number

#: A sleep from this length on in a callback probably explains what is late or missing.
_LONG_PAUSE_S = 0.2
_HANDLERS = ("FileHandler", "RotatingFileHandler", "TimedRotatingFileHandler", "WatchedFileHandler")
_OPENS = ("open", "io.open", "codecs.open")
#: Levels that hide records of level INFO.
_HIGH_LEVELS = ("WARN", "WARNING", "ERROR", "FATAL")
_COMMENTED_LOG = re.compile(r"^\s*#.*get_logger\(\)\.(info|warn|warning|error)\s*\(")
#: Logging methods of Python's own loggers.
_PYTHON_LOGS = ("debug", "info", "warning", "warn", "error", "critical", "exception")


def _prints(source: Source) -> list[ast.Call]:
    return [c for c in source.all(ast.Call) if chain(c.func) in ("print", "sys.stdout.write", "pprint")]


def _must_log(case: Case) -> Case | None:
    """Return a case whose check asks for any record, or for records of what arrived."""
    return case if case.logs or case.criterion.check_name in ("uses_logger", "logs_received") else None


@hint_rule(outcome=Outcome.NOT_MET, given=_must_log, priority=11010)
def _into_file(case: Case) -> Clue | None:
    """No expected text is logged or printed, but the program writes to a file."""
    source = case.source
    writing = next(filter(_writes, source.all(ast.Call)), None)
    if writing is None or not _unseen(case):
        return None
    hint = f"{source.code(writing, 60)}: the grader does not see what goes into a file; "
    return Clue(f"{hint}write it with self.get_logger().info(...)", source.place(writing), key="into_file")


def _unseen(case: Case) -> bool:
    if case.criterion.check_name == "uses_logger":
        return not student_records(case.trace, case.process) and not printed_lines(case.trace, case.process)
    wrong, logged = case.found(WrongLogFacts), case.found(LogFacts)
    if wrong is not None:
        return wrong.absent
    return logged is not None and logged.expected == logged.missing


def _writes(call: ast.Call) -> bool:
    """Return whether a call opens a file for output."""
    name = last_name(call.func)
    if name in _HANDLERS or name == "write_text":
        return True
    if name == "basicConfig":
        return any(k.arg == "filename" for k in call.keywords)
    plain = chain(call.func) in _OPENS
    mode = literal_text(argument(call, 1 if plain else 0, "mode")) if name == "open" else None
    return bool(mode) and mode is not None and bool(set(mode) & set("wax"))


@hint_rule(outcome=Outcome.PARTLY, fault=None, given=_must_log, priority=11020)
def _printed(case: Case) -> Clue | None:
    """Lines are printed instead of logged."""
    name, source = case.criterion.check_name, case.source
    prints = [c for c in _prints(source) if c.args]
    if name == "logs_received":
        item = made_for(source, "subscription", case.check.topic)
        inside = set(runs(source, item)) if item is not None else set()
        prints = [c for c in prints if c in inside] or prints
    elif len(prints) > 1:
        prints = _most_printed(case, prints)
    if not prints:
        return _by_python(case) if name == "uses_logger" and case.fault is None else None
    code = source.code(prints[0], 60)
    hint = f"{code} does not log: write self.get_logger().info(...)"
    return Clue(hint, source.place(prints[0]), key="printed")


def _most_printed(case: Case, prints: list[ast.Call]) -> list[ast.Call]:
    """Return the print calls, those whose fixed text matches most of the printed lines first."""
    lines = [o.text for o in printed_lines(case.trace, case.process)][:400]

    def seen(call: ast.Call) -> int:
        words = [w for n in ast.walk(call) if (w := literal_text(n)) and len(w.strip()) > 2]
        return max((sum(w.strip() in line for line in lines) for w in words), default=0)

    return sorted(prints, key=seen, reverse=True) if case.logs else prints


@hint_rule("uses_logger", priority=11030)
def _python_logging(case: Case) -> Clue | None:
    """Python's logging module is used instead of the node's logger."""
    return _by_python(case)


def _by_python(case: Case) -> Clue | None:
    source = case.source
    names = python_loggers(source)
    calls = (c for c in source.calls(*_PYTHON_LOGS) if chain(c.func).rpartition(".")[0] in names)
    own = next(calls, None)
    if own is None:
        return None
    hint = f"{source.code(own, 60)} is Python's own logging, which ROS does not see: use self.get_logger().info(...)"
    return Clue(hint, source.place(own))


def _nothing_logged(case: Case) -> bool:
    return not student_records(case.trace, case.process)


#: A placeholder of `%` in a text that is logged as it stands.
_PERCENT = re.compile(r"%[-+ 0#]*\d*(?:\.\d+)?[dfgeEsi](?![A-Za-z])")


def _must_show(case: Case) -> Case | None:
    """Return a case whose check asks for certain texts in the logs."""
    return case if case.logs or case.criterion.check_name in ("logs_received", "logs_values", "logs_matching") else None


@hint_rule(given=_must_show, priority=11040)
def _text_as_it_stands(case: Case) -> Clue | None:
    """The f of an f-string is missing, or the values behind a `%` or in `format`."""
    source = case.source
    logs = [n for n in source.all(ast.Call) if is_log(source, n) or chain(n.func) == "print"]
    plain = [(call, t) for call in logs if len(call.args) == 1 and (t := literal_text(call.args[0])) is not None]
    written = {o.text.strip() for o in student_records(case.trace, case.process)}
    written |= {o.text.strip() for o in printed_lines(case.trace, case.process)}
    doubled = [
        c for c in logs if c.args and isinstance(c.args[0], ast.JoinedStr) and "{{" in source.code(c.args[0], 200)
    ]
    for call in doubled:
        if any("{" in w and "}" in w for w in written):
            hint = f"double braces print one brace: write single ones, in {source.code(call.args[0], 50)}"
            return Clue(hint, source.place(call))
    for call, text in plain:
        if unformatted_fields(text) and text.strip() in written:
            return Clue(f"the f before the string is missing: f{source.code(call.args[0], 50)}", source.place(call))
        empty = re.findall(r"\{(?::[^{}]*)?\}", text)
        if empty and text.strip() in written:
            values = ", ".join(["..."] * len(empty))
            return Clue(f"{empty[0]} is printed as it is: put .format({values}) after the string", source.place(call))
        places = _PERCENT.findall(text)
        if places and text.strip() in written:
            values = ", ".join(["..."] * len(places))
            hint = f"{places[0]} is printed as it is: put % ({values}) after the string"
            return Clue(hint, source.place(call))
    return None


@hint_rule(outcome=Outcome.NOT_MET, given=_must_log, priority=11050)
def _level_raised(case: Case) -> Clue | None:
    """The program hides its own records."""
    for call in case.source.calls("set_level", "set_logger_level"):
        level = last_name(call.args[-1]) if call.args else ""
        if _nothing_logged(case) and level.upper() in _HIGH_LEVELS:
            hint = f"{case.source.code(call)} hides logs below the level {level.upper()}: remove it"
            return Clue(hint, case.source.place(call), key="level_raised")
    return None


@hint_rule("logs_received", priority=11060)
def _received_at_debug(case: Case) -> Clue | None:
    """What is received is logged at a level that is not shown."""
    item = made_for(case.source, "subscription", case.check.topic)
    inside = runs(case.source, item) if item is not None else []
    logs = [n for n in inside if isinstance(n, ast.Call) and is_log(case.source, n)]
    if not logs or any(last_name(c.func) != "debug" for c in logs) or any(case.source.calls("set_level")):
        return None
    hint = f"{case.source.code(logs[0], 60)} is not shown, because the default level is INFO: use info"
    return Clue(hint, case.source.place(logs[0]))


def _shows_nothing(case: Case) -> Case | None:
    """Return a case whose check asks for any record, or finds no record that shows the fields of a message."""
    return case if case.logs or case.criterion.check_name == "uses_logger" else None


@hint_rule(given=_shows_nothing, priority=11070)
def _debug_only(case: Case) -> Clue | None:
    if any(case.source.calls("set_level", "set_logger_level")):
        return None
    logs = [n for n in case.source.all(ast.Call) if is_log(case.source, n)]
    wrong = case.found(WrongLogFacts)
    if wrong is not None and wrong.right == 0:
        leaves = {field.rpartition(".")[2] for field in wrong.fields}
        logs = [n for n in logs if any(name.rpartition(".")[2] in leaves for name in names_in(n))]
    elif not _nothing_logged(case):
        return None
    if not logs or any(last_name(c.func) != "debug" for c in logs):
        return None
    hint = f"{case.source.code(logs[0], 60)} is not shown, because the default level is INFO: use info"
    return Clue(hint, case.source.place(logs[0]))


@hint_rule(outcome=Outcome.NOT_MET, given=_shows_nothing, priority=11080)
def _commented_out(case: Case) -> Clue | None:
    if not _nothing_logged(case) or any(is_log(case.source, n) for n in case.source.all(ast.Call)):
        return None
    row = next((k for k, line in enumerate(case.source.lines, 1) if _COMMENTED_LOG.match(line[:300])), 0)
    if not row:
        return None
    return Clue("the log is commented out: remove the #", Location(case.source.file, row))


def _must_repeat(case: Case) -> Case | None:
    """Return a case whose check asks for a log of each message, or for logs at a certain pace."""
    paced = case.found(LogPaceFacts) is not None
    return case if paced or case.logs or case.criterion.check_name == "logs_received" else None


@hint_rule(given=_must_repeat, priority=11090)
def _logged_once(case: Case) -> Clue | None:
    call = log_call(case)
    if call is None:
        return None
    once = argument(call, 99, "once")
    if isinstance(once, ast.Constant) and once.value is True:
        return Clue("once=True writes this log only once: remove it", case.source.place(call), key="once")
    wrong, pace = case.found(WrongLogFacts), case.found(LogPaceFacts)
    few = (wrong is not None and wrong.cause == "few") or (pace is not None and pace.count == 1)
    test = next(case.source.around(call, ast.If), None)
    if not few or test is None or not _set_inside(test):
        return None
    hint = f"under 'if {case.source.code(test.test, 40)}' this logs only once: log repeatedly"
    return Clue(hint, case.source.place(test), key="once")


def _set_inside(test: ast.If) -> bool:
    """Return whether code under a condition changes it."""
    if not is_flag(test.test):
        return False
    stored = (t for s in test.body for n in ast.walk(s) if isinstance(n, ast.Assign) for t in n.targets)
    return any(chain(t) in names_in(test.test) for t in stored)


@hint_rule(priority=11085)
def _timer_set_back(case: Case) -> Clue | None:
    """The callback of a subscription starts the only timer anew with each message, or stops it."""
    source, timers = case.source, made(case.source, "timer")
    rare = case.found(LogPaceFacts) is not None or case.found(WrongLogFacts) is not None or bool(silent_topic(case))
    names = {target_of(source, timer.call) for timer in timers}
    name = next(iter(names)) if len(names) == 1 else ""
    if not rare or not name:
        return None
    timed = runs(source, timers[0])
    for item in made(source, "subscription"):
        for node in runs(source, item):
            called = node.func if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) else None
            if called is None or chain(called.value) != name or called.attr not in ("reset", "cancel") or node in timed:
                continue
            does = "starts the timer anew with" if called.attr == "reset" else "stops the timer after"
            hint = f"{source.code(node, 40)} {does} each message, so that it never fires: remove it"
            return Clue(hint, source.place(node), key="log_pace")
    return None


#: What one of it is, in seconds -> how it is called.
_UNITS = {1e-9: "nanoseconds", 1e-6: "microseconds", 1e-3: "milliseconds", 1.0: "seconds"}
_IN_NANOSECONDS = ("time_ns", "monotonic_ns", "perf_counter_ns")
_IN_SECONDS = ("time.time", "time.monotonic", "time.perf_counter")
#: How many names and operators of a time are followed.
_DEEPEST_TIME = 8


@hint_rule(priority=11095)
def _time_in_another_unit(case: Case) -> Clue | None:
    """A log waits for a time that is compared in nanoseconds or milliseconds with a number of seconds."""
    pace, call = case.found(LogPaceFacts), log_call(case)
    if call is None or pace is None:
        return None
    source = case.source
    tests = {n for node in callback_nodes(source) if isinstance(node, ast.If) for n in ast.walk(node.test)}
    for node in tests:
        clue = _of_duration(source, node, pace)
        if clue is not None:
            return clue
    for switch in switches(source):
        unit = _unit_s(source, switch.tested) if switch.node in tests else None
        waited_s = switch.limit.value * unit if unit is not None else pace.wanted_s
        if unit is None or not _explains_pace(waited_s, pace):
            continue
        named = next((name for size, name in _UNITS.items() if math.isclose(size, unit)), "")
        if not named:
            continue
        exact, power = pace.wanted_s / unit, round(math.log10(1 / unit))
        right = f"{number(pace.wanted_s)} * 1e{power}" if power > 3 and pace.wanted_s != 1 else f"1e{power}"
        right = right if power > 3 else number(exact)
        hint = f"'{source.code(switch.node, 50)}' compares {named}: write {right} for {number(pace.wanted_s)} s"
        return Clue(hint, source.place(switch.limit.origin), key="log_pace")
    return None


def _explains_pace(waited_s: float, pace: LogPaceFacts) -> bool:
    """Return whether waiting this long makes logs as frequent, or as rare, as they are."""
    far = not 0.5 < waited_s / pace.wanted_s < 2
    return far and (waited_s < pace.wanted_s) == (pace.count > 2)


def _of_duration(source: Source, node: ast.AST, pace: LogPaceFacts) -> Clue | None:
    """Return a clue if a time is compared with a `Duration` of another length."""
    if not isinstance(node, ast.Call) or last_name(node.func) != "Duration" or node.args:
        return None
    sizes = {"seconds": 1.0, "nanoseconds": 1e-9}
    parts = [(number_in_code(source, k.value), sizes.get(k.arg or "")) for k in node.keywords]
    known = [value * size for value, size in parts if value is not None and size is not None]
    if not known or len(known) < len(parts) or not _explains_pace(sum(known), pace):
        return None
    hint = f"{source.code(node, 50)} is {number(sum(known))} s: write Duration(seconds={number(pace.wanted_s)})"
    return Clue(hint, source.place(node), key="log_pace")


def _unit_s(source: Source, node: ast.AST | None, depth: int = 0) -> float | None:
    """Return how many seconds one unit of a time is, as far as the text shows it."""
    if node is None or depth > _DEEPEST_TIME:
        return None
    if isinstance(node, ast.BinOp):
        return _unit_of_pair(source, node, depth)
    called = node.func if isinstance(node, ast.Call) else None
    if last_name(called) in _IN_NANOSECONDS or (isinstance(node, ast.Attribute) and node.attr == "nanoseconds"):
        return 1e-9
    if called is not None:
        return 1.0 if source.resolved(called) in _IN_SECONDS else None
    value = value_of(source, node)
    return None if value is node else _unit_s(source, value, depth + 1)


def _unit_of_pair(source: Source, node: ast.BinOp, depth: int) -> float | None:
    """Return the unit of a difference of times, or of one that is multiplied or divided by a number."""
    left, right = _unit_s(source, node.left, depth + 1), _unit_s(source, node.right, depth + 1)
    if isinstance(node.op, ast.Sub):
        return left if left is not None else right
    by = number_in_code(source, node.right)
    if left is None or not by or not isinstance(node.op, (ast.Mult, ast.Div, ast.FloorDiv)):
        return None
    return left / by if isinstance(node.op, ast.Mult) else left * by


@hint_rule(priority=11097)
def _time_stands_still(case: Case) -> Clue | None:
    """The time of the last log is never stored anew, or in another variable, so that each message is logged."""
    pace, call, source = case.found(LogPaceFacts), log_call(case), case.source
    if call is None or pace is None or not 0 < pace.average_s < pace.wanted_s:
        return None
    for test in conditions(source, call):
        passed = time_since(source, test.test)
        last = chain(passed.right) if passed is not None else ""
        if passed is None or not source.stores(last) or not set_at_first_only(source, last):
            continue
        now = source.code(passed.left, 40)
        for statement in (s for s in source.all(ast.Assign) if source.function_of(s) is source.function_of(call)):
            target = chain(statement.targets[0])
            if source.code(statement.value, 40) == now and target and not is_read(source, target):
                return Clue(stored_elsewhere(source, statement, last, now), source.place(statement), key="log_pace")
        around = call in set(subtree(test))
        stays, where = ("true", "under it") if around else ("false", "below it")
        hint = f"{last} never changes, so '{source.code(test.test, 40)}' stays {stays}: add {last} = {now} {where}"
        return Clue(hint, source.place(test), key="log_pace")
    return None


@hint_rule(priority=11100)
def _log_period(case: Case) -> Clue | None:
    """The timer, the throttle or the callback sets the wrong pace."""
    pace, call = case.found(LogPaceFacts), log_call(case)
    if call is None or pace is None or pace.count == 0:
        return None
    source, wanted_s, average = case.source, pace.wanted_s, pace.average_s
    worth = constant_value(source, argument(call, 99, "throttle_duration_sec"))
    rare = pace.count <= 2 and worth is not None and worth.value > 2 * wanted_s
    if worth is not None and (rare or 0.8 * worth.value <= average <= 1.3 * worth.value):
        hint = f"throttle_duration_sec={number(worth.value)} allows a log every {number(worth.value)} s"
        unit = ", because it is in seconds" if rare else ""
        return Clue(f"{hint}: write {wanted_s}{unit}", source.place(worth.origin), key="log_pace")
    timers = [m for m in made(source, "timer") if call in runs(source, m)]
    if timers:
        return _timer_pace(source, timers, average, wanted_s) if len(timers) == 1 else None
    return _message_pace(case, source, call, wanted_s)


def _message_pace(case: Case, source: Source, call: ast.Call, wanted_s: float) -> Clue | None:
    """The log is written in the callback of the subscription, each time or every n-th time."""
    subscriptions = [m for m in made(source, "subscription") if call in runs(source, m)]
    if not subscriptions or argument(call, 99, "throttle_duration_sec") is not None:
        return None
    inside = [n for m in subscriptions for n in runs(source, m) if isinstance(n, ast.If)]
    counted_by = next((n for n in inside if _counts(source, n.test) and call in set(reached(source, [n]))), None)
    if counted_by is not None:
        hint = f"'if {source.code(counted_by.test, 40)}' counts messages, not seconds: log from a timer of {wanted_s} s"
        return Clue(hint, source.place(counted_by), key="log_pace")
    if not case.is_about(ProblemKind.ONE_PER_MESSAGE):
        return None
    hint = f"this logs every message: give it throttle_duration_sec={wanted_s}, or log from a timer"
    return Clue(hint, source.place(call), key="log_pace")


def _counts(source: Source, test: ast.expr) -> bool:
    """Return whether a condition is `n % 20 == 0`, or compares a counter with a number."""
    if any(isinstance(n, ast.BinOp) and isinstance(n.op, ast.Mod) for n in ast.walk(test)):
        return True
    counters = {chain(a.target) for a in source.all(ast.AugAssign) if number_in_code(source, a.value) == 1}
    limits = [number_in_code(source, c) for c in test.comparators] if isinstance(test, ast.Compare) else []
    return isinstance(test, ast.Compare) and chain(test.left) in counters and None not in limits


def _timer_pace(source: Source, timers: list[Made], average_s: float, wanted_s: float) -> Clue | None:
    worth = constant_value(source, timers[0].period)
    if worth is not None and worth.value == 0:
        return rounded_down(source, timers[0], wanted_s)
    if worth is None or abs(worth.value - average_s) > 0.05 * average_s or worth.value == wanted_s:
        return None
    hint = f"{timer_code(source, timers[0])} fires every {number(worth.value)} s: write {wanted_s}"
    return Clue(hint, source.place(worth.origin), key="log_pace")


def _rare(case: Case) -> Case | None:
    """Return a case whose check misses logs or responses that a sleep may hold up."""
    missing, pace = case.found(LogFacts), case.found(LogPaceFacts)
    late = case.is_about(ProblemKind.TOO_LATE) and bool(case.serves)
    few = missing is not None and missing.missing > 0
    slow = pace is not None and (pace.average_s > pace.wanted_s or case.is_about(ProblemKind.STOPPED))
    heard = case.is_about(ProblemKind.NOT_LOGGED) and (bool(case.logs) or case.criterion.check_name.startswith("logs_"))
    return case if late or few or slow or heard else None


@hint_rule(given=_rare, priority=11105)
def _logs_held_up(case: Case) -> Clue | None:
    """A sleep in a callback, or beside spin_once, holds up the other callbacks."""
    for source in [case.source] if case.process else case.sources.values():
        pause = next((p for p in pauses(source) if (p.seconds or 0.0) >= _LONG_PAUSE_S), None)
        if pause is not None:
            return Clue(pause.hint(source), source.place(pause.call), key="old_messages")
    return None


@hint_rule("logs_received", priority=11110)
def _received_not_logged(case: Case) -> Clue | None:
    """The callback of the subscription does not log, or does not log what it received."""
    source, check = case.source, case.check
    item = made_for(source, "subscription", check.topic)
    start = roots(source, item.callback) if item is not None else []
    facts = case.found(LogFacts)
    if item is None or not start or facts is None or not facts.missing:
        return None
    inside = list(reached(source, start))
    received_as = f"{message_of(source, item)}.data"
    logs = [n for n in inside if isinstance(n, ast.Call) and is_log(source, n)]
    if len(logs) == 1:
        return _wrong_log(source, logs[0], inside, received_as)
    elsewhere = any(is_log(source, n) and _shows(n, _stored(inside)) for n in source.all(ast.Call))
    if logs or elsewhere or case.verdict.outcome is not Outcome.NOT_MET:
        return None
    name = last_name(item.callback) or "the callback"
    return Clue(f"{name} receives the values but does not log them: log {received_as} in it", source.place(start[0]))


def _wrong_log(source: Source, log: ast.Call, inside: list[ast.AST], received_as: str) -> Clue | None:
    """Return a clue if a log shows no value, or only attributes unrelated to the message."""
    names = [n for a in log.args for n in _inner(a) if isinstance(n, (ast.Name, ast.Attribute))]
    if not names:
        return Clue(f"this log contains no value: log what was received, {received_as}", source.place(log))
    whole = [n for n in names if not isinstance(source.parents.get(n), ast.Attribute)]
    own = [chain(n) for n in whole if chain(n).startswith("self.")]
    if len(own) < len(whole) or set(own) & _stored(inside):
        return None
    return Clue(f"{source.code(log, 60)} does not show what was received: log {received_as}", source.place(log))


#: Functions that convert an angle to radians.
_TO_RADIANS = ("radians", "deg2rad")
#: How many operators of a conversion are followed.
_DEEPEST_FACTOR = 12
#: A factor beyond this makes degrees of radians.
_DEGREES = 50.0
#: Pi with four decimals, 3.1416, is as exact as this; with two, it is not, and a log with two decimals shows it.
_EXACT = 1e-5
#: A factor as near as this, such as 180 / 3.14 or 57, is meant to be the right one.
_NEARLY = 0.06


@hint_rule("logs_values", outcome=Outcome.NOT_MET, problem=ProblemKind.WRONG_VALUE, priority=11140)
def _converted_wrongly(case: Case) -> Clue | None:
    """The line that converts the received number, or the only one that logs it."""
    source, advice = case.source, case.verdict.hint or case.criterion.hint
    item = made_for(source, "subscription", case.check.topic)
    inside = runs(source, item) if item is not None else []
    wants_degrees = max(map(abs, case.check.unit_factors), default=0.0) > _DEGREES
    for node in inside:
        if isinstance(node, ast.Call) and last_name(node.func) in _TO_RADIANS and wants_degrees:
            code, given = source.code(node, 40), source.code(node.args[0], 30) if node.args else "..."
            return Clue(f"{code} converts degrees to radians: write math.degrees({given})", source.place(node))
    scaled = [n for n in inside if isinstance(n, ast.BinOp) and isinstance(n.op, (ast.Mult, ast.Div))]
    whole = [n for n in scaled if source.parents.get(n) not in scaled]
    wrong = [n for n in whole if _factor(source, n) not in (None, 1.0) and not _is_degrees(_factor(source, n))]
    if len(wrong) == 1 and wants_degrees:
        return _wrong_factor(source, wrong[0])
    logs = [n for n in inside if isinstance(n, ast.Call) and is_log(source, n)]
    return Clue(advice, source.place(logs[0])) if len(logs) == 1 and advice else None


def _factor(source: Source, node: ast.AST, depth: int = 0) -> float | None:
    """Return what a product or quotient multiplies its only unknown part by; None if the text does not show it."""
    if not isinstance(node, ast.BinOp) or depth > _DEEPEST_FACTOR:
        worth = number_in_code(source, node)
        return 1.0 if worth is None else worth
    left, right = _factor(source, node.left, depth + 1), _factor(source, node.right, depth + 1)
    if left is None or right is None or not isinstance(node.op, (ast.Mult, ast.Div)):
        return None
    return left * right if isinstance(node.op, ast.Mult) else left / right if right else None


def _wrong_factor(source: Source, node: ast.BinOp) -> Clue:
    """Return the clue for a product or quotient that should make degrees of radians."""
    factor = _factor(source, node) or 0.0
    near = math.isclose(abs(factor), math.degrees(1.0), rel_tol=_NEARLY)
    does = "is not exact enough" if near else "does not make degrees of radians"
    return Clue(f"{source.code(node, 50)} {does}: write math.degrees({_converted(source, node)})", source.place(node))


def _converted(source: Source, node: ast.expr) -> str:
    """Return the code of the only unknown part of a product or quotient."""
    while True:
        if isinstance(node, ast.BinOp):
            node = node.right if number_in_code(source, node.left) is not None else node.left
        elif isinstance(node, ast.Call) and chain(node.func) in ("int", "round", "float") and node.args:
            node = node.args[0]
        else:
            return source.code(node, 40)


def _is_degrees(factor: float | None) -> bool:
    return factor is not None and math.isclose(factor, math.degrees(1.0), rel_tol=_EXACT)


def _logged_between(source: Source, test: ast.If, by: ast.BinOp) -> Clue | None:
    """Return a clue if a condition is true for all messages but those that are asked for: `count % 10`."""
    asked = test.test
    unequal = isinstance(asked, ast.Compare) and asked.left is by and isinstance(asked.ops[0], ast.NotEq)
    if asked is not by and not unequal:
        return None
    code = source.code(by, 40)
    return Clue(f"'{source.code(asked, 40)}' is false when {code} is 0: write {code} == 0", source.place(test))


def _logged_by_quotient(source: Source, test: ast.If, divisions: list[ast.BinOp], every: int) -> Clue | None:
    """Return a clue if a condition compares a quotient in place of the rest: `count // 10 == 0`."""
    by = [n for n in divisions if isinstance(n.op, (ast.FloorDiv, ast.Div)) and not number_in_code(source, n)]
    worth = number_in_code(source, by[0].right) if len(by) == 1 else None
    if worth is None or worth <= 0:
        return None
    first = f"the first {number(worth)} messages" if isinstance(by[0].op, ast.FloorDiv) else "the first message only"
    hint = f"'{source.code(test.test, 40)}' holds for {first}: write {source.code(by[0].left, 30)} % {every} == 0"
    return Clue(hint, source.place(test))


def _logged_at_one_number(source: Source, test: ast.If, every: int) -> Clue | None:
    """Return a clue if a condition compares the counter itself, as in `count == 10`."""
    asked = test.test
    if (
        not isinstance(asked, ast.Compare)
        or len(asked.ops) != 1
        or not isinstance(asked.left, (ast.Name, ast.Attribute))
        or not _is_counter(source, asked.left)
    ):
        return None
    hint = f"'{source.code(asked, 40)}' does not hold for every {every}th message: write "
    return Clue(f"{hint}{source.code(asked.left, 30)} % {every} == 0", source.place(test))


def _is_counter(source: Source, name: ast.Name | ast.Attribute) -> bool:
    """Return whether 1 is added to a variable."""
    statements = [source.parents.get(n) for n in source.stored.get(chain(name), ())]
    return any(isinstance(s, ast.AugAssign) and number_in_code(source, s.value) == 1 for s in statements)


def _inner(node: ast.AST) -> list[ast.AST]:
    """Return the nodes that may determine the value of a text; the test of a conditional does not."""
    if isinstance(node, ast.IfExp):
        return [*ast.walk(node.body), *ast.walk(node.orelse)]
    return list(ast.walk(node))


def _stored(callback: list[ast.AST]) -> set[str]:
    """Return the attributes that a callback assigns."""
    return {chain(n) for n in callback if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)}


def _shows(log: ast.AST, attributes: set[str]) -> bool:
    """Return whether a log shows one of these attributes."""
    return any(chain(n) in attributes for n in ast.walk(log) if isinstance(n, ast.Attribute))


@hint_rule("waits_gracefully", priority=11120)
def _error_while_waiting(case: Case) -> Clue | None:
    if case.verdict.location is None:
        return None
    logs = (c for c in case.source.on_line(case.verdict.location.line, ast.Call) if is_log(case.source, c))
    call = next(logs, None)
    if call is None or last_name(call.func) not in ("error", "fatal"):
        return None
    return Clue(f"this is not a failure of the node: use info or warn instead of {last_name(call.func)}")


@hint_rule("logs_every", priority=11125)
def _limited_by_time(case: Case) -> Clue | None:
    """The log has `throttle_duration_sec` where one for every ten messages is asked for."""
    call = log_call(case)
    limit = next((k for k in call.keywords if k.arg in ("throttle_duration_sec", "once")), None) if call else None
    if limit is None:
        return None
    hint = f"{case.source.code(limit, 40)} goes by time, not by messages: put the log under if count % "
    return Clue(f"{hint}{case.check.every} == 0", case.source.place(limit))


@hint_rule("logs_every", priority=11130)
def _log_every(case: Case) -> Clue | None:
    """`count % 100 == 0` where one log for every ten messages is asked for, or no condition at all."""
    source, every, call = case.source, case.check.every, log_call(case)
    logs = [n for n in source.all(ast.Call) if is_log(source, n)]
    timed = [n for m in made(source, "timer") for n in runs(source, m)]
    call = next((c for c in logs if c in timed), call)
    test = next(source.around(call, ast.If), None) if call is not None else None
    if call is not None and call in timed and test is None:
        return Clue(f"this logs every message: put it under if count % {every} == 0", source.place(call))
    if test is None:
        return None
    divisions = [n for n in ast.walk(test.test) if isinstance(n, ast.BinOp)]
    by = [n for n in divisions if isinstance(n.op, ast.Mod)]
    worth = constant_value(source, by[0].right) if len(by) == 1 else None
    if worth is None:
        return _logged_by_quotient(source, test, divisions, every) or _logged_at_one_number(source, test, every)
    rest = number_in_code(source, test.test.comparators[0]) if isinstance(test.test, ast.Compare) else None
    if rest is not None and rest >= worth.value:
        hint = f"'{source.code(test.test, 40)}' is never true, as it is below {number(worth.value)}: compare with 0"
        return Clue(hint, source.place(test))
    if worth.value == every:
        return _logged_between(source, test, by[0])
    hint = f"{source.code(by[0], 40)} is 0 for every {number(worth.value)}th message: write {every} instead of "
    return Clue(f"{hint}{number(worth.value)}", source.place(worth.origin))
