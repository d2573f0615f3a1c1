"""Causes of exceptions from values and names, and of nodes that end early or hang."""

from __future__ import annotations

import ast

from grader.grading.judging.diagnosis.names import MESSAGE_FIELDS, SINGLE_NUMBERS, SPINS
from grader.grading.judging.diagnosis.rules import Case, Clue, Crash, crash_rule, hint_rule
from grader.grading.judging.diagnosis.wiring import (
    bare_statements,
    head_of,
    made,
    names_called,
    node_made,
    reached,
    received,
    returns_nothing,
    roots,
    spins,
    value_of,
    variable_of,
)
from grader.grading.judging.source import (
    Loop,
    Source,
    argument,
    chain,
    covers,
    first_line,
    last_name,
    literal_text,
    subtree,
)
from grader.grading.model.wording import named
from grader.runtime.model.trace import FaultKind

_EXITS = ("exit", "quit", "_exit")
#: Functions that draw without arguments, and are often named without being called.
_DRAWS = ("random.random", "time.time", "time.monotonic")


@crash_rule(
    r"The '(\w+)' field must be (?:of type '(\w+)'|a sub message of type '(\w+)')", in_file=False, priority=5010
)
def _wrong_field_type(crash: Crash) -> Clue | None:
    field, type_, message = crash.found.groups(default="")
    value, target = _given(crash, field)
    if message:
        inner = ", ".join(MESSAGE_FIELDS.get(message, ())) or "fields"
        return Clue(f"{target.removesuffix(' = ') or field} is a {message}: set its fields {inner} one by one")
    if type_ != "float":
        other = {"int": "an integer", "str": "text", "bool": "True or False"}.get(type_)
        written = crash.source.code(value, 40) if value is not None else "..."
        asked = {criterion.check_name for criterion in (crash.case.criterion, *crash.case.others)}
        if type_ == "str" and field == "data" and "random_in_range" in asked:
            item = next((m for m in made(crash.source, "publisher") if m.type == "String"), None)
            if item is not None:
                hint = "String holds text, but the task asks for numbers: use a numeric type such as Float32"
                return Clue(hint, crash.source.place(item.call))
        literal = literal_text(value) or ""
        if type_ == "bool" and literal.capitalize() in ("True", "False"):
            return Clue(f"{written} is a string: write {target}{literal.capitalize()}, without quotes")
        return Clue(f"the field {field} takes {other}: write {target}{type_}({written})") if other else None
    if value is None:
        return Clue(f"the field {field} takes a float: write 0.5 or 0.0, or float(...) around a variable")
    return _not_a_float(crash.source, value, target)


def _not_a_float(  # noqa: PLR0911  as below
    source: Source, value: ast.expr, target: str
) -> Clue:
    kept = value_of(source, value)
    if kept is not value and isinstance(kept, ast.Tuple) and len(kept.elts) == 1:
        code = source.code(value)
        hint = f"the comma at the end makes a tuple of {code}: write {code} = {source.code(kept.elts[0])}"
        return Clue(hint, source.place(kept), key="tuple")
    if isinstance(value, ast.Tuple) and len(value.elts) == 1:
        number = source.code(value.elts[0])
        return Clue(f"the comma at the end makes it a tuple: write {target}{number} without the comma", key="tuple")
    written = source.code(value, 40)
    if isinstance(value, ast.Tuple) and len(value.elts) == 2 and all(map(_is_whole, value.elts)):
        number = ".".join(source.code(e) for e in value.elts)
        return Clue(f"a decimal comma makes two numbers: write {target}{number}", key="comma")
    number = (literal_text(value) or "").strip().replace(",", ".")
    if number.lstrip("+-").replace(".", "", 1).isdigit():
        number = number if "." in number else f"{number}.0"
        return Clue(f"{written} is a string, but the field takes a number: write {target}{number}", key="quoted_number")
    if literal_text(value) is not None:
        return Clue(f"{written} is a string, but the field takes a number: write {target}0.0, with your number")
    if isinstance(value, ast.Call) and chain(value.func) == "str" and len(value.args) == 1:
        return Clue(f"str() makes a string, the field takes a float: write {target}{source.code(value.args[0], 50)}")
    return _no_number_yet(source, value, target, written)


def _no_number_yet(  # noqa: PLR0911  one for each kind of value
    source: Source, value: ast.expr, target: str, written: str
) -> Clue:
    """Return the clue for a literal that is not a valid number."""
    message = received(source, source.function_of(value))
    if message is not None and chain(value) == message.name and message.type in SINGLE_NUMBERS:
        return Clue(f"{written} is the whole message: write {target}{written}.data")
    if isinstance(value, ast.Constant) and (value.value is None or isinstance(value.value, bool)):
        return Clue(f"{value.value} is not a number: write {target}0.0, or your number")
    if isinstance(value, ast.Call) and returns_nothing(source, value):
        return Clue(f"{written} returns None: make it return the number, or write {target}0.0")
    if isinstance(value, ast.Call) and last_name(value.func) in ("now", "get_clock"):
        return Clue(f"{written} is a ROS time, not a number: its nanoseconds are {written}.nanoseconds")
    undeclared = _declared_without_value(source, value)
    if undeclared is not None:
        return undeclared
    if isinstance(value, ast.Call) and last_name(value.func) == "get_parameter":
        return Clue(f"{written} is the parameter, not its value: write {target}{written}.value")
    if isinstance(value, (ast.Attribute, ast.Name)) and source.resolved(value) in _DRAWS:
        return Clue(f"{written} is the function itself: call it, {written}()")
    if _is_whole(value):
        return Clue(f"{written} is an integer, but the field takes a float: write {target}{written}.0")
    return Clue(f"the field takes only a float: write {target}float({written})")


def _declared_without_value(source: Source, value: ast.expr) -> Clue | None:
    """`get_parameter(name).value` of a parameter that was declared without a value."""
    call = value.value if isinstance(value, ast.Attribute) and value.attr == "value" else None
    if not isinstance(call, ast.Call) or last_name(call.func) != "get_parameter" or not call.args:
        return None
    name = literal_text(call.args[0])
    for declared in source.calls("declare_parameter"):
        if len(declared.args) == 1 and not declared.keywords and literal_text(declared.args[0]) == name:
            hint = f"the parameter has no value: write {source.code(declared).removesuffix(')')}, 0.5)"
            return Clue(hint, source.place(declared))
    return None


def _given(crash: Crash, field: str) -> tuple[ast.expr | None, str]:
    """Return the value assigned to a field at the fault, and the code before it, such as `msg.x = `."""
    source = crash.source
    for statement in source.on_line(crash.line, ast.Assign):
        for target in statement.targets:
            if isinstance(target, ast.Attribute) and target.attr == field:
                return statement.value, f"{source.code(target)} = "
    keywords = [k for c in source.on_line(crash.line, ast.Call) for k in c.keywords if k.arg == field]
    chosen = next((k for k in keywords if _is_whole(k.value)), keywords[0] if len(keywords) == 1 else None)
    return (chosen.value, f"{field}=") if chosen is not None else (None, "")


def _is_whole(value: ast.expr | None) -> bool:
    if isinstance(value, ast.UnaryOp):
        value = value.operand
    return isinstance(value, ast.Constant) and type(value.value) is int


@crash_rule(
    r"Expected <class '([\w.]+)\.(\w+)'>, got <class '([\w.]+)'>"
    r"|Publisher\.publish\(\) missing 1 required positional argument",
    in_file=False,
    priority=5020,
)
def _published_wrongly(crash: Crash) -> Clue | None:
    wrong = crash.said(r"Expected <class '[\w.]+\.(\w+)'>, got <class '([\w.]+)'>")
    if wrong is None:
        return Clue("publish takes the message to send: publish(msg)")
    expected, got = wrong[1], wrong[2].rpartition(".")[2]
    if got == f"Metaclass_{expected}":
        return _published_class(crash, expected)
    replaced = _replaced_message(crash, expected)
    if replaced is not None:
        return replaced
    return Clue(f"this publisher sends {expected} objects, not {got}: create one, set its fields and publish it")


def _published_class(crash: Crash, expected: str) -> Clue:
    """`publish(Twist)` beside a message that is filled in, or of a variable that holds the class."""
    source = crash.source
    made = [a for a in source.all(ast.Assign) if len(a.targets) == 1]
    for call in source.on_line(crash.line, ast.Call):
        name = chain(call.args[0]) if last_name(call.func) == "publish" and call.args else ""
        held = [a for a in made if name and chain(a.targets[0]) == name and chain(a.value) == expected]
        if held:
            hint = f"{expected} is the class: write {source.code(held[0])}() to create an object"
            return Clue(hint, source.place(held[0]))
        here = source.function_of(call)
        objects = {
            target: None
            for a in made
            if isinstance(a.value, ast.Call) and last_name(a.value.func) == expected
            if (target := chain(a.targets[0])).startswith("self.") or source.function_of(a) is here
        }
        if len(objects) == 1:
            return Clue(f"{expected} is the class: publish the message, publish({next(iter(objects))})")
    return Clue(f"{expected} is the class; publish an object of it: {expected}()")


def _replaced_message(crash: Crash, expected: str) -> Clue | None:
    """Return a clue if a variable holds a message first, and then what belongs into a field of it."""
    source = crash.source
    for call in source.on_line(crash.line, ast.Call):
        name = chain(call.args[0]) if last_name(call.func) == "publish" and call.args else ""
        here = source.function_of(call)
        near = [n for n in source.stored.get(name, ()) if source.function_of(n) is here or name.startswith("self.")]
        statements = [s for n in near if isinstance(s := source.parents.get(n), ast.Assign)]
        made_here = [s for s in statements if isinstance(s.value, ast.Call) and last_name(s.value.func) == expected]
        others = [s for s in statements if s not in made_here]
        if not made_here or len(others) != 1:
            continue
        code, value = source.code(others[0], 60), source.code(others[0].value, 60)
        right = f"write {name}.data = {value}" if expected in SINGLE_NUMBERS else "set a field of it instead"
        hint = f"{code} replaces the {expected} message: {right}"
        return Clue(hint, source.place(others[0]))
    return None


@crash_rule(r"Parameter\(s\) already declared: \['([\w./]+)'", in_file=False, priority=5030)
def _declared_twice(crash: Crash) -> Clue | None:
    return Clue(f"the parameter {named(crash.found[1], 60)} is declared twice: remove one declare_parameter")


@crash_rule(r"^(?:\w+\.)*ParameterUninitializedException: .*'([\w./]+)'", in_file=False, priority=5035)
def _parameter_without_value(crash: Crash) -> Clue | None:
    """A parameter is declared with a type and without a value, and nobody sets it."""
    name = crash.found[1]
    declared = [c for c in crash.case.source.calls("declare_parameter") if c.args and literal_text(c.args[0]) == name]
    hint = f"the parameter {name[:60]} has no value: give it a default, declare_parameter('{name[:60]}', value)"
    return Clue(hint, crash.case.source.place(declared[0]) if len(declared) == 1 else None)


@crash_rule("^ValueError: generator already executing", in_file=False, priority=5038)
def _spun_by_two(crash: Crash) -> Clue | None:
    """`rclpy.spin` of several threads uses one executor, which only one thread may run."""
    source = crash.case.source
    threads = [
        c for c in source.calls("Thread") if (w := argument(c, 1, "target")) is not None and _spins_in(source, w)
    ]
    hint = "rclpy.spin and spin_once share one executor, which only one thread may run: spin in one thread, or give "
    return Clue(f"{hint}each thread an executor of its own", source.place(threads[0]) if threads else None)


def _spins_in(source: Source, target: ast.expr) -> bool:
    """Return whether a thread's function is, or calls, one that spins."""
    return last_name(target) in SPINS or bool(names_called(source, roots(source, target)) & set(SPINS))


@crash_rule(r"undeclared parameter\(s\): \[?'?([\w./]+)", in_file=False, priority=5040)
def _undeclared_parameter(crash: Crash) -> Clue | None:
    name = crash.found[1][:60]
    return Clue(f"declare the parameter first, in __init__: self.declare_parameter('{name}', default_value)")


@crash_rule(r"undeclared parameter\(s\): \[\]", priority=5045)
def _sets_undeclared(crash: Crash) -> Clue | None:
    """`set_parameters` with a parameter that is not declared, which its exception does not name."""
    function = crash.source.function_at(crash.line)
    within = [c for c in crash.source.calls("Parameter") if function is None or covers(function, c.lineno)]
    names = [name for call in within if (name := literal_text(argument(call, 0, "name")))]
    calls = [*crash.source.calls("declare_parameter")]
    declared = {name for call in calls if (name := literal_text(argument(call, 0, "name")))}
    missing = next((name for name in names if name not in declared), "")
    if not missing:
        return None
    called, last = named(missing, 60), missing.replace(".", "/").rpartition("/")[2]
    if last in declared:
        return Clue(f"the parameter is called {named(last, 60)}, not {called}")
    return Clue(f"declare the parameter first, in __init__: self.declare_parameter('{called}', default_value)")


@crash_rule("does not support the context manager|__enter__", priority=5050)
def _with_init(crash: Crash) -> Clue | None:
    """`with rclpy.init():`, which only later releases of rclpy support."""
    for block in crash.source.on_line(crash.line, ast.With):
        first = block.items[0].context_expr
        if isinstance(first, ast.Call) and chain(first.func) == "rclpy.init":
            hint = "this release of rclpy does not know 'with rclpy.init()': call rclpy.init() on a line of its own"
            return Clue(hint, crash.source.place(block))
    return None


@crash_rule(
    r"rclpy_logging_rcutils_log\(\): incompatible function arguments"
    r"|RcutilsLogger\.(\w+)\(\) takes 2 positional arguments but \d+ were given",
    in_file=False,
    priority=5060,
)
def _logger_arguments(crash: Crash) -> Clue | None:
    name = crash.found[1]
    if name is None:
        return Clue("the logger takes a string: put the value into an f-string, info(f'{value}')")
    return Clue(f"{name} takes one string: put the values into it, {name}(f'... {{value}}')")


@crash_rule(r"^ValueError: Logger severity cannot be changed between calls", priority=5065)
def _level_of_a_line(crash: Crash) -> Clue | None:
    """One call logs with several levels: `log = logger.warning if low else logger.info`, then `log(...)`."""
    calls = list(crash.source.on_line(crash.line, ast.Call))
    hint = "one call keeps its level: call info(...) in one branch of an if, and warning(...) in the other"
    return Clue(hint, crash.source.place(calls[0])) if calls else Clue(hint)


@crash_rule(r"^EOFError|^termios\.error|^_?curses\.error|^IndexError", in_file=False, priority=5070)
def _unattended(crash: Crash) -> Clue | None:
    """The program waits for keyboard input, or for command line arguments."""
    if crash.found[0] != "IndexError":
        what = "input()" if crash.found[0] == "EOFError" else "the keyboard"
        return Clue(f"there is no keyboard while the node runs: set the values in the program, without {what}")
    if "argv" not in crash.source.line(crash.line):
        return None
    return Clue("the file is run without arguments: give the value a default in the program")


@crash_rule("^RecursionError", priority=5080)
def _endless_recursion(crash: Crash) -> Clue | None:
    function = crash.source.function_at(crash.line)
    if function is None or f" in {function.name}" not in "".join(crash.fault.frames[-3:]):
        return None
    named = any(last_name(n) == function.name for n in subtree(function) if isinstance(n, (ast.Name, ast.Attribute)))
    hint = f"{function.name} calls itself forever: rename one of the two things called {function.name}"
    return Clue(hint, crash.source.place(function)) if named else None


@crash_rule(priority=5090)
def _own_raise(crash: Crash) -> Clue | None:
    """The student's own `raise` ends the node."""
    source = crash.source
    raised = next(source.on_line(crash.line, ast.Raise), None)
    if raised is None or source.function_at(crash.line) is None:
        return None
    return Clue(f"{source.code(raised)} ends the node: log a warning instead, and continue")


@hint_rule(fault=None, priority=5100)
def _events_executor(case: Case) -> Clue | None:
    used = next(case.source.calls("EventsExecutor"), None)
    stuck = made(case.source, "timer") if case.fault is None else case.fault.kind is FaultKind.HUNG
    if used is None or not stuck:
        return None
    hint = "EventsExecutor never calls timers in this release of rclpy: use rclpy.spin(node)"
    return Clue(hint, case.source.place(used))


@crash_rule("", FaultKind.HUNG, priority=5110)
def _endless_loop(crash: Crash) -> Clue | None:
    """The innermost call of the stack that stands in a loop of the file names the loop."""
    source, where = crash.source, crash.frames()
    inside = [(loop, name) for line, name in where for loop in source.loops() if covers(loop, line)]
    inside = [(loop, name) for loop, name in inside if source.function_name(loop) in ("", name)] or inside
    if not inside or not where:
        return None
    loop, name = inside[-1]
    head = f"'{head_of(source, loop)}'"
    if name == "__init__":
        hint = f"the loop {head} keeps the constructor from returning, so nothing else runs"
    elif name in {last_name(m.callback) for m in made(source, "timer", "subscription")}:
        hint = f"the loop {head} keeps {name} from returning: a callback must return at once"
    else:
        hint = f"the loop {head} neither waits nor spins: let a timer call the code instead"
    return Clue(hint, source.place(loop))


@crash_rule("", FaultKind.EXITED, priority=5120)
def _named_only(crash: Crash) -> Clue | None:
    """A function that starts something is named, and not called."""
    source = crash.source
    for node in bare_statements(source):
        name = last_name(node)
        if name == "main" or name in SPINS:
            made_here = node_made(source)
            given = variable_of(source, made_here) if made_here is not None and name in SPINS else ""
            code = source.code(node, 40)
            hint = f"{code} is not called: write {code}({given})"
            return Clue(hint, source.place(node), key=f"named:{first_line(node)}")
    return None


@crash_rule("", FaultKind.EXITED, priority=5130)
def _never_awaited(crash: Crash) -> Clue | None:
    """`async def main` called as a function only makes a coroutine, which nothing runs."""
    source = crash.source
    functions = {f.name: f for f in source.all(ast.AsyncFunctionDef)}
    for statement in source.all(ast.Expr):
        call = statement.value
        function = functions.get(chain(call.func)) if isinstance(call, ast.Call) else None
        if function is not None and source.function_of(statement) is None:
            hint = f"{function.name} is async, so {source.code(call, 40)} does not run it: write def {function.name}"
            return Clue(f"{hint}, without async", source.place(function))
    return None


@crash_rule("", FaultKind.EXITED, priority=5140)
def _empty_file(crash: Crash) -> Clue | None:
    if crash.source.nodes or any(row.strip() for row in crash.source.lines[:2000]):
        return None
    return Clue("the file is empty: hand in the one that holds your node")


@crash_rule("", FaultKind.EXITED, priority=5150)
def _left_by_arguments(crash: Crash) -> Clue | None:
    source = crash.source
    if crash.fault.exit_code != 2:
        return None
    for call in source.calls("add_argument"):
        first = call.args[0] if call.args else None
        keywords = {k.arg: k.value for k in call.keywords}
        positional = isinstance(first, ast.Constant) and not str(first.value).startswith("-")
        required = isinstance(keywords.get("required"), ast.Constant) and "default" not in keywords
        if (positional and "nargs" not in keywords and "default" not in keywords) or required:
            hint = "the file is run without arguments: give this one a default, as an option such as '--speed'"
            return Clue(hint, source.place(call))
    return None


@crash_rule("", FaultKind.EXITED, priority=5160)
def _left_by_exit(crash: Crash) -> Clue | None:
    source = crash.source
    exits: list[ast.AST] = [c for c in source.calls(*_EXITS) if chain(c.func) in (*_EXITS, "sys.exit", "os._exit")]
    raised = {r: r.exc.func if isinstance(r.exc, ast.Call) else r.exc for r in source.all(ast.Raise)}
    exits += [r for r, name in raised.items() if last_name(name) == "SystemExit"]
    if len(exits) != 1 or _at_the_end(source, exits[0]):
        return None
    leaving = exits[0]
    test = _argument_test(source, leaving)
    if test:
        hint = f"the file is run without arguments, so '{test}' is true: give the values defaults"
        return Clue(hint, source.place(leaving))
    if str(crash.fault.exit_code) != _exit_code(leaving):
        return None
    hint = f"{source.code(leaving, 40)} ends the program: the node must run until it is stopped"
    return Clue(hint, source.place(leaving))


def _argument_test(source: Source, node: ast.AST) -> str:
    """Return the condition on the command line around a node; empty if there is none."""
    tests = (source.code(n.test, 40) for n in source.around(node, ast.If))
    return next((t for t in tests if "argv" in t), "")


def _exit_code(node: ast.AST) -> str:
    call = node.exc if isinstance(node, ast.Raise) else node
    if not isinstance(call, ast.Call) or not call.args:
        return "0"
    first = call.args[0]
    return str(first.value) if isinstance(first, ast.Constant) else ""


def _at_the_end(source: Source, node: ast.AST) -> bool:
    """Return whether an exit comes after main(), or handles Ctrl-C."""
    handles = any(source.around(node, ast.ExceptHandler))
    return handles or (source.function_of(node) is None and not _argument_test(source, node))


@crash_rule("", FaultKind.EXITED, priority=5170)
def _shut_down_in_callback(crash: Crash) -> Clue | None:
    source = crash.source
    for item in made(source, "timer", "subscription"):
        for node in reached(source, source.functions(last_name(item.callback))):
            if isinstance(node, ast.Call) and chain(node.func) in ("rclpy.shutdown", "rclpy.try_shutdown"):
                hint = f"{source.code(node)} in a callback ends the node: it must run until it is stopped"
                return Clue(hint, source.place(node))
    return None


@crash_rule("", FaultKind.EXITED, priority=5180)
def _no_spin(crash: Crash) -> Clue | None:
    """The node is created, and the program ends."""
    source = crash.source
    node = node_made(source)
    if node is None or spins(source) or crash.fault.exit_code != 0:
        return None
    loops = [n for n in source.loops() if _publishes(source, n)]
    if loops:
        return _bounded_loop(source, loops)
    name = variable_of(source, node)
    hint = f"{source.code(node)} creates the node, then the program ends: call rclpy.spin({name}) after it"
    return Clue(hint, source.place(node))


def _bounded_loop(source: Source, loops: list[Loop]) -> Clue | None:
    loop = loops[-1]
    if isinstance(loop, ast.While) and not isinstance(loop.test, (ast.Compare, ast.BoolOp)):
        return None
    hint = f"the loop '{head_of(source, loop)}' ends, and the program with it"
    return Clue(f"{hint}: keep running until the node is stopped", source.place(loop))


def _publishes(source: Source, loop: ast.AST) -> bool:
    return any(isinstance(n, ast.Call) and last_name(n.func) == "publish" for n in reached(source, [loop]))


@crash_rule("", FaultKind.EXITED, priority=5190)
def _spins_once(crash: Crash) -> Clue | None:
    source = crash.source
    if crash.fault.exit_code != 0 or any(last_name(n) == "spin" for n in spins(source)):
        return None
    once = list(source.calls("spin_once"))
    loops = [n for c in once for n in source.around(c, ast.AST) if isinstance(n, (ast.While, ast.For))]
    if len(once) == 1 and not loops:
        hint = f"{source.code(once[0])} handles one event and returns: call spin, which runs until the node is stopped"
        return Clue(hint, source.place(once[0]))
    if len(loops) == 1:
        return _bounded_loop(source, loops)
    return None


@crash_rule("", FaultKind.EXITED, priority=5200)
def _gave_up(crash: Crash) -> Clue | None:
    """A `return` leaves main before the node spins."""
    source = crash.source
    last = list(source.calls("spin"))[-1:]
    if not last or crash.fault.exit_code != 0:
        return None
    leaving = [r for r in source.all(ast.Return) if source.function_of(r) is source.function_of(last[0])]
    early = [r for r in leaving if first_line(r) < first_line(last[0])]
    test = next(source.around(early[0], ast.If), None) if len(early) == 1 else None
    if test is None:
        return None
    hint = f"the return under 'if {source.code(test.test, 40)}' ends the program before {source.code(last[0], 40)}"
    return Clue(f"{hint}: keep waiting instead", source.place(early[0]))
