"""Causes of values that are used as what they are not: called, indexed, compared, added, formatted, converted."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from grader.grading.judging.diagnosis.names import (
    KEYWORD_SLIPS,
    MESSAGE_FIELDS,
    NODE_METHODS,
    SIGNATURES,
    SINGLE_NUMBERS,
    article,
)
from grader.grading.judging.diagnosis.rules import Clue, Crash, crash_rule
from grader.grading.judging.diagnosis.wiring import (
    ORDERS,
    constant_value,
    made,
    message_classes,
    node_made,
    number_in_code,
    received,
    sole_assignment,
    target_of,
    uniform_call,
    variable_of,
)
from grader.grading.judging.source import (
    Function,
    Source,
    argument,
    chain,
    first_line,
    last_name,
    literal_text,
    parameters,
    quoted_number,
)

#: Fields of messages that may hold a number.
_LEAVES = {name for names in MESSAGE_FIELDS.values() for name in names} | {"sec", "nanosec"}
_PLACEHOLDER = re.compile(r"%(?!%)[-+ 0#]*[\d.*]*[a-zA-Z]")
#: An argument is missing, or there are too many: of any function, as Python says it from 3.10 to 3.14.
_ARITY = (
    r"^TypeError: (?:[\w.<>]*\.)?(\w+)\(\) (?:missing \d+ required (?:positional|keyword-only) arguments?: (.*)"
    r"|takes (?:from \d+ to )?(\d+|no|exactly \w+) (?:positional )?arguments?"
    r"(?: but (\d+) w\w+ given| \((\d+) given\))?"
    r"|got an unexpected keyword argument '(\w+)'|got multiple values for argument '(\w+)')"
)


def _calls(crash: Crash, name: str = "") -> list[ast.Call]:
    """Return the calls that begin on the line of the fault, of a function if one is named."""
    found = [c for c in crash.source.on_line(crash.line, ast.Call) if not name or last_name(c.func) == name]
    return [c for c in found if first_line(c) == crash.line] or found


def _known_classes(source: Source) -> set[str]:
    return message_classes(source) | set(MESSAGE_FIELDS)


# --- the whole message instead of what is in it ----------------------------------------------------------------------

_WHOLE = re.compile(
    r"not supported between instances of '(?P<a>\w+)' and '(?P<b>\w+)'"
    r"|unsupported operand type\(s\) for [^:]+: '(?P<c>\w+)' and '(?P<d>\w+)'"
    r"|bad operand type for \S+ ?[^:]*: '(?P<e>\w+)'"
    r"|(?:argument must be .*, not|must be real number, not|number is required, not) '?(?P<f>\w+)'?"
    r"|unsupported format string passed to (?P<g>\w+)\.__format__"
    r'|can only concatenate \w+ \(not "(?P<h>\w+)"\)'
    r"|type (?P<i>\w+) doesn't define __\w+__ method"
)
_PARTS = re.compile(
    r"'(?P<a>\w+)' object (?:is not (?P<called>callable)|is not subscriptable|does not support item assignment"
    r"|is not iterable|cannot be interpreted)|cannot unpack non-iterable (?P<b>\w+) object"
    r"|object of type '(?P<c>\w+)' has no len|argument of type '(?P<d>\w+)' is not iterable"
    r"|'(?P<e>\w+)' object is not an iterator"
)


@crash_rule(r"^TypeError", priority=7010)
def _whole_message(crash: Crash) -> Clue | None:
    """A message is compared, added or formatted, instead of a field of it."""
    found = crash.said(_WHOLE.pattern)
    classes = _known_classes(crash.source)
    type_ = next((t for t in found.groupdict().values() if t in classes), "") if found else ""
    if not type_ or type_ not in MESSAGE_FIELDS:
        return None
    name = _holder(crash, type_)
    fields = MESSAGE_FIELDS[type_]
    if type_ in SINGLE_NUMBERS:
        return Clue(f"{name} is the whole message: the number in it is {name}.data")
    return Clue(f"{name} is the whole {type_}: use one of its fields, {_dotted(name, fields)}")


def _dotted(name: str, fields: tuple[str, ...]) -> str:
    return ", ".join(f"{name}.{field}" for field in fields)


def _holder(crash: Crash, type_: str) -> str:
    """Return the expression on the line that holds a message of a type, as far as the text shows it."""
    source = crash.source
    message = received(source, source.function_at(crash.line))
    names = [n for n in source.on_line(crash.line, ast.Name) if isinstance(n.ctx, ast.Load)]
    if message is not None and message.type == type_ and any(n.id == message.name for n in names):
        return message.name
    for name in names:
        for store in source.stored.get(name.id, ()):
            value = getattr(source.parents.get(store), "value", None)
            if isinstance(value, ast.Call) and last_name(value.func) == type_:
                return name.id
    local = [n.id for n in names if n.id in source.stored and not isinstance(source.parents.get(n), ast.Attribute)]
    if len(set(local)) == 1:
        return local[0]
    kept = [n for n in source.on_line(crash.line, ast.Attribute) if chain(n).startswith("self.")]
    whole = [n for n in kept if not isinstance(source.parents.get(n), (ast.Attribute, ast.Call))]
    return source.code(whole[0], 40) if len(whole) == 1 else "msg"


@crash_rule(r"^TypeError", priority=7020)
def _message_parts(crash: Crash) -> Clue | None:
    """A message is called, indexed, unpacked or iterated: its fields have names."""
    found = crash.said(_PARTS.pattern)
    if found is None:
        return None
    known = found.groupdict()
    type_ = next((t for key, t in known.items() if key != "called" and t in MESSAGE_FIELDS), "")
    if not type_:
        return None
    fields = MESSAGE_FIELDS[type_]
    code = _used_so(crash, type_)
    if known["called"] and not any(c.args for c in _calls(crash) if _short_code(crash, c.func) == code):
        return Clue(f"{code} is {article(type_)} {type_}, not a function: write it without the parentheses")
    if known["called"]:
        hint = (
            f"{code} is {article(type_)} {type_}, not a function: set its fields one by one, {code}.{fields[0]} = ..."
        )
        return Clue(hint)
    return Clue(f"{code} is {article(type_)} {type_}: its fields have names, {_dotted(code, fields)}")


def _short_code(crash: Crash, node: ast.AST) -> str:
    """Return the code of a node of the file, in short."""
    return crash.source.code(node, 40)


def _used_so(crash: Crash, type_: str) -> str:
    """Return the code of what is called, indexed or unpacked on the line."""
    source = crash.source
    values: list[ast.AST] = [n.value for n in source.on_line(crash.line, ast.Subscript)]
    values = values[-1:]
    if not values and crash.said("callable"):
        values = [c.func for c in _calls(crash) if last_name(c.func)]
    if not values:
        targets = (a for a in source.on_line(crash.line, ast.Assign) if isinstance(a.targets[0], ast.Tuple))
        values = [a.value for a in targets]
    if not values:
        values = [c.args[0] for c in _calls(crash, "len") if c.args]
    values = values or [n.iter for n in source.on_line(crash.line, ast.For)]
    return source.code(values[0], 40) if values else _holder(crash, type_)


# --- calls -----------------------------------------------------------------------------------------------------------


@crash_rule(r"^TypeError: '(\w+)' object is not callable", priority=7030)
def _not_callable(crash: Crash) -> Clue | None:
    kind = crash.found[1]
    if kind == "str":
        return _quoted_callback(crash)
    source = crash.source
    clues = (_hidden_method(source, call.func) or _called_value(source, kind, call) for call in _calls(crash))
    return next((clue for clue in clues if clue is not None), None)


def _called_value(source: Source, kind: str, call: ast.Call) -> Clue | None:
    code = source.code(call.func, 40)
    if kind == "module" and isinstance(call.func, ast.Name) and source.aliases.get(call.func.id) == call.func.id:
        return _module_called(call.func.id)
    if kind == "Publisher" and _is_publisher(source, call.func):
        return Clue(f"{code} is the publisher: write {code}.publish(...)")
    if kind in ("float", "int", "bool") and isinstance(call.func, ast.Attribute) and call.func.attr in _LEAVES:
        return Clue(f"{code} is a number, not a function: write it without the parentheses")
    if isinstance(call.func, ast.Name) and call.func.id in source.stored:
        store = source.stored[call.func.id][0]
        hint = f"{call.func.id} is assigned here, which hides the function of this name: choose another name"
        return Clue(hint, source.place(store))
    if isinstance(call.func, ast.Constant):
        return Clue(f"a number before a parenthesis is a call: to multiply, write {code} * (...)")
    return None


def _hidden_method(source: Source, func: ast.expr) -> Clue | None:
    """Return a clue if an attribute takes the name of a method, of Node or of the file."""
    dotted, name = chain(func), last_name(func)
    methods = any(source.is_method(f) for f in source.functions(name))
    if dotted != f"self.{name}" or not (methods or name in NODE_METHODS):
        return None
    hint = f"{dotted} is assigned here, which hides the method of this name: choose another name"
    return next((Clue(hint, source.place(store)) for store in source.stores(dotted)), None)


def _is_publisher(source: Source, func: ast.expr) -> bool:
    """Return whether an expression names a publisher."""
    return chain(func) in {target_of(source, m.call) for m in made(source, "publisher")} - {""}


def _module_called(name: str) -> Clue | None:
    usual = {"random": "random.uniform(...)", "time": "time.sleep(...)", "math": "math.sin(...)"}
    example = f", such as {usual[name]}" if name in usual else ""
    return Clue(f"{name} is a module: call a function in it{example}")


def _quoted_callback(crash: Crash) -> Clue | None:
    source = crash.source
    for item in made(source, "timer", "subscription"):
        name = literal_text(item.callback)
        if name is not None and item.callback is not None and len(name) < 60:
            hint = f"pass the method itself, without quotes: self.{name.strip('.')}"
            return Clue(hint, source.place(item.callback))
    return None


@crash_rule(r"callback should be either be callable|Callback must be callable", priority=7040)
def _text_callback(crash: Crash) -> Clue | None:
    return _quoted_callback(crash)


@crash_rule(r"^NotImplementedError: Service classes can not be instantiated", priority=7050)
def _service_instance(crash: Crash) -> Clue | None:
    """`Trigger()`: only the request and the response of a service can be made."""
    source = crash.source
    for call in _calls(crash):
        name = last_name(call.func)
        if not source.aliases.get(name, "").rpartition(".")[0].endswith("srv"):
            continue
        around = source.parents.get(call)
        where = last_name(around.func) if isinstance(around, ast.Call) else ""
        if where in ("create_service", "create_client"):
            return Clue(f"pass the service class: {name}, without the parentheses")
        if where in ("call_async", "call"):
            return Clue(f"a call sends a request: write {name}.Request()")
        function = source.function_at(crash.line)
        given = parameters(function)[-1:] if function is not None else []
        serving = {last_name(argument(c, 2, "callback")) for c in source.calls("create_service")}
        if function is not None and function.name in serving and given:
            return Clue(f"the callback already receives the response, as {given[0]}: fill it in and return it")
        return Clue(f"{name} is a service: create its request, {name}.Request(), or its response, {name}.Response()")
    return None


@crash_rule(r"^TypeError:? *$|^TypeError: None$", priority=7060)
def _wrong_request(crash: Crash) -> Clue | None:
    """Rclpy raises a bare TypeError for a request or response of another type."""
    source = crash.source
    for call in _calls(crash):
        if last_name(call.func) in ("call_async", "call") and call.args:
            given = call.args[0]
            if isinstance(given, ast.Attribute) and given.attr == "Request":
                code = source.code(given)
                return Clue(f"{code} is the class: write {code}() to create a request")
            return Clue("a call takes a request object such as Trigger.Request()")
    for call in source.calls("create_service"):
        functions = source.functions(last_name(argument(call, 2, "callback")))
        if len(functions) != 1 or len(parameters(functions[0])) < 2:
            continue
        response = parameters(functions[0])[-1]
        replaced = _replaced_response(source, functions[0], response)
        if replaced is not None:
            return replaced
        returns = [r for r in source.all(ast.Return) if source.function_of(r) is functions[0]]
        wrong = [r for r in returns if chain(r.value) != response and not isinstance(r.value, ast.Call)]
        if wrong:
            return Clue(
                f"{functions[0].name} must return the response itself: return {response}", source.place(wrong[0])
            )
    return None


def _replaced_response(source: Source, function: Function, response: str) -> Clue | None:
    """Return a clue if the callback of a service assigns something else to its parameter for the response."""
    for statement in source.all(ast.Assign):
        value = statement.value
        target = response in map(chain, statement.targets)
        if source.function_of(statement) is not function or not target or isinstance(value, ast.Call):
            continue
        if last_name(value) == "Response":
            hint = f"{source.code(value, 40)} is the class: remove this line, because {function.name} already receives "
            return Clue(f"{hint}the response", source.place(statement))
        hint = f"{source.code(statement, 60)} replaces the response: set a field of {response} instead"
        return Clue(hint, source.place(statement))
    return None


@crash_rule(
    r"^TypeError: (?:\w+\.)?(?:__init__\(\): )?incompatible constructor arguments|^TypeError: __init__\(\)",
    priority=7070,
)
def _node_name(crash: Crash) -> Clue | None:
    """The name of the node is not a string."""
    for call in _calls(crash, "__init__"):
        first = argument(call, 0, "node_name")
        if first is not None and chain(call.func) == "super().__init__" and literal_text(first) is None:
            name = crash.fault.process.removesuffix(".py")
            return Clue(f"the node name is a string: super().__init__('{name}')")
    return None


@crash_rule(_ARITY, in_file=False, priority=7080)
def _wrong_arguments(crash: Crash) -> Clue | None:
    """A function gets too few or too many arguments, or one by a name that it does not have."""
    name = crash.found[1]
    missing, keyword = crash.found[2], crash.found[6] or crash.found[7]
    if name in SIGNATURES:
        return _of_node(crash, name, missing, keyword)
    if name == "init" and keyword is not None and not crash.source.functions(name):
        return Clue("rclpy.init has no such argument: write rclpy.init(args=args)")
    special = {
        "publish": "publish takes one message: set its fields, then publish(msg)",
        "sleep": "sleep takes a number of seconds: time.sleep(0.5)",
        "destroy_node": "destroy_node takes no argument: node.destroy_node()",
    }
    if name in special and not crash.source.functions(name):
        return Clue(special[name])
    return (
        _spun_nothing(crash, name)
        or _to_super(crash, name)
        or _message_by_position(crash, name)
        or _to_random(crash, name)
        or _to_own(crash, name)
        or _to_call(crash, name)
    )


def _of_node(crash: Crash, name: str, missing: str | None, keyword: str | None) -> Clue | None:
    usual = {
        "create_publisher": "create_publisher(MessageType, '/topic', 10)",
        "create_subscription": "create_subscription(MessageType, '/topic', self.callback, 10)",
        "create_timer": "create_timer(seconds, self.callback)",
        "create_service": "create_service(ServiceType, '/name', self.callback)",
        "create_client": "create_client(ServiceType, '/name')",
        "create_rate": "create_rate(hertz)",
    }
    if keyword is not None:
        meant = KEYWORD_SLIPS.get(keyword.lower(), "")
        if meant not in SIGNATURES[name]:
            meant = {"topic": "srv_name", "msg_type": "srv_type"}.get(meant, "")
        if crash.found[7]:
            return Clue(f"{keyword} is given twice, by position and by name: remove one")
        return Clue(f"{name} has no argument {keyword}: write {meant}") if meant in SIGNATURES[name] else None
    call = next(iter(_calls(crash, name)), None)
    if missing is not None and call is not None and name == "create_timer" and len(call.args) == 1:
        first = crash.source.code(call.args[0], 40)
        number = number_in_code(crash.source, call.args[0])
        lacks = "the method to call is missing" if number is not None else "the period in seconds is missing"
        right = f"create_timer({first}, self.callback)" if number is not None else f"create_timer(0.1, {first})"
        return Clue(f"{lacks}: {right}")
    return Clue(f"write {usual[name]}")


def _spun_nothing(crash: Crash, name: str) -> Clue | None:
    if name not in ("spin", "spin_once") or crash.source.functions(name):
        return None
    node = node_made(crash.source)
    called = variable_of(crash.source, node) if node is not None else "node"
    return Clue(f"{name} takes the node: rclpy.{name}({called})")


def _to_super(crash: Crash, name: str) -> Clue | None:
    if name != "__init__":
        return None
    for call in _calls(crash, "__init__"):
        if chain(call.func) == "super().__init__" and call.args and chain(call.args[0]) == "self":
            rest = ", ".join(crash.source.code(a, 40) for a in call.args[1:])
            return Clue(f"super() already passes self: super().__init__({rest})")
    return None


def _message_by_position(crash: Crash, name: str) -> Clue | None:
    """`Twist(0.5, 0.1)`: the fields of a message are given by name."""
    if name != "__init__":
        return None
    for call in _calls(crash):
        type_ = last_name(call.func)
        if type_ in MESSAGE_FIELDS and call.args:
            fields = MESSAGE_FIELDS[type_]
            shown = ", ".join(f"{field}=..." for field in fields[:3])
            hint = f"the fields of {article(type_)} {type_} are given by name: {type_}({shown})"
            return Clue(f"{hint}, or set one by one afterwards")
    return None


_RANDOM = {
    "random": "random() takes no limits and draws from 0 to 1: random.uniform(low, high) takes two",
    "uniform": "uniform takes the lowest and the highest number: random.uniform(low, high)",
    "randint": "randint takes the lowest and the highest whole number: random.randint(low, high)",
    "choice": "choice takes one list: random.choice([a, b])",
    "gauss": "gauss takes the mean and the standard deviation: random.gauss(mean, deviation)",
}


def _to_random(crash: Crash, name: str) -> Clue | None:
    call = next(iter(_calls(crash, name)), None)
    if name not in _RANDOM or call is None or crash.source.functions(name):
        return None
    if name == "random" and len(call.args) == 2:
        low, high = (crash.source.code(a, 20) for a in call.args)
        return Clue(f"random takes no limits: write {uniform_call(crash.source, low, high, call)}")
    return Clue(_RANDOM[name])


def _to_own(crash: Crash, name: str) -> Clue | None:
    """A function of the file is called with other arguments than it has parameters."""
    source = crash.source
    functions = source.functions(name)
    if name == "__init__":
        made_here = {last_name(c.func) for c in _calls(crash)}
        functions = [f for f in functions if (c := source.class_of(f)) is not None and c.name in made_here]
    if len(functions) != 1:
        return None
    function, method = functions[0], source.is_method(functions[0])
    names = parameters(function)
    call_name = name
    if name == "__init__" and (owner := source.class_of(function)) is not None:
        call_name = owner.name
    calls = _calls(crash, call_name)
    if method and names[:1] != ["self"] and calls and "self" not in names:
        rest = ", ".join(["self", *names])
        return Clue(f"self is missing: def {name}({rest}):", source.place(function))
    if len(calls) != 1:
        return None
    own = names[1:] if method else names
    needed = own[: len(own) - len(function.args.defaults)] if function.args.defaults else own
    wanted = f"{call_name}({', '.join(needed)})" if needed else f"{call_name}()"
    return Clue(f"{source.code(calls[0], 50)} does not match line {first_line(function)}, def {name}: call {wanted}")


def _to_call(crash: Crash, name: str) -> Clue | None:
    if name in ("call_async", "call") and _calls(crash, name):
        return Clue(f"{name} takes the request: {name}(Trigger.Request())")
    return None


# --- operators and texts ---------------------------------------------------------------------------------------------


@crash_rule(
    r'^TypeError: can only concatenate str \(not "(?:float|int|NoneType|list|bool)"\)'
    r"|^TypeError: unsupported operand type\(s\) for \+=?: '(?:float|int)' and 'str'"
    r"|^TypeError: can only concatenate (?:list|tuple)",
    priority=7090,
)
def _text_and_number(crash: Crash) -> Clue | None:
    """`'x: ' + value`."""
    source = crash.source
    sums = [n for n in source.on_line(crash.line, ast.BinOp) if isinstance(n.op, ast.Add)]
    if not sums:
        return None
    parts = list(_summands(sums[0]))
    texts = [literal_text(p) for p in parts]
    if not any(t is not None for t in texts):
        return None
    numbers = [quoted_number(p) for p in parts if literal_text(p) is not None]
    if all(numbers):
        number = numbers[0]
        return Clue(f"'{number}' is a string: write {number} without quotes to calculate with it")
    filled = [t if t is not None else f"{{{source.code(p, 30)}}}" for t, p in zip(texts, parts, strict=True)]
    shown = "".join(filled)
    quote = '"' if "'" in shown else "'"
    if len(shown) > 60 or '"' in shown or "…" in shown:
        return Clue("a number cannot be added to a string: put it into an f-string, f'... {value}'")
    return Clue(f"a number cannot be added to a string: write f{quote}{shown}{quote}")


def _summands(node: ast.expr) -> Iterator[ast.expr]:
    """Yield the parts of a sum, `str(x)` as `x`."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        yield from _summands(node.left)
        yield from _summands(node.right)
    elif isinstance(node, ast.Call) and chain(node.func) == "str" and len(node.args) == 1:
        yield node.args[0]
    else:
        yield node


@crash_rule(
    r"unsupported operand type\(s\) for [-+]=?: '(?:Time|Duration)' and|and '(?:Time|Duration)'$", priority=7100
)
def _time_and_number(crash: Crash) -> Clue | None:
    del crash
    return Clue(
        "a ROS time and a number cannot be mixed: subtract two times, (now - start).nanoseconds / 1e9 is in seconds"
    )


@crash_rule(r"^TypeError: can't multiply sequence by non-int|^TypeError: can only concatenate list", priority=7110)
def _text_or_list_as_number(crash: Crash) -> Clue | None:
    """`'0.5' * 1.0` and `[0.5] + 0.1`."""
    source = crash.source
    for node in source.on_line(crash.line, ast.BinOp):
        for side in (node.left, node.right):
            if written := quoted_number(side):
                return Clue(f"{source.code(side)} is a string: write {written} without quotes to calculate with it")
            if isinstance(side, ast.List) and len(side.elts) == 1:
                inside = source.code(side.elts[0], 30)
                return Clue(f"{source.code(side, 40)} is a list: write {inside} without the square brackets")
    return None


@crash_rule(r"not supported between instances of '(float|int|str)' and '(float|int|str)'", priority=7120)
def _text_compared(crash: Crash) -> Clue | None:
    """A number is compared with a text."""
    source = crash.source
    for test in source.on_line(crash.line, ast.Compare):
        for side in (test.left, *test.comparators):
            if written := quoted_number(side):
                return Clue(f"{source.code(side)} is a string: compare with the number {written}")
    tests = [t for t in source.on_line(crash.line, ast.Compare) if isinstance(t.ops[0], ORDERS)]
    if len(tests) == 1 and len(tests[0].ops) == 1:
        found = _text_side(source, tests[0].left if crash.found[1] == "str" else tests[0].comparators[0])
        if found is not None:
            return found
    return Clue("one side is a string, the other a number: convert the string with float(...)")


def _text_side(source: Source, side: ast.expr) -> Clue | None:
    """Return a clue about the text in a comparison, at the line that makes it if it is used for nothing else."""
    code = source.code(side, 60)
    if _made_by(side, "str"):
        return Clue(f"{code} is a string: write {_inside(source, side)}, without str")
    for call in (s.value for s in source.all(ast.Expr)):
        here = source.function_of(call) is source.function_of(side)
        if here and _made_by(call, "float", "int") and source.code(call) in (f"float({code})", f"int({code})"):
            return Clue(f"{source.code(call)} does not change {code}: write {code} = float({code})", source.place(call))
    value = sole_assignment(source, side) if isinstance(side, ast.Name) else None
    whole = value or side
    if isinstance(whole, ast.Attribute) and whole.attr == "message":
        hint = f"{source.code(whole, 60)} is a whole text: take the number out of it, and convert it with float(...)"
        return Clue(hint, source.place(whole))
    if isinstance(value, (ast.Call, ast.Subscript)) and _is_only_compared(source, side):
        right = _inside(source, value) if _made_by(value, "str") else f"float({source.code(value, 60)})"
        return Clue(f"{code} is a string: write {code} = {right}", source.place(value))
    if value is None or isinstance(value, (ast.Call, ast.Subscript)):
        return Clue(f"{code} is a string: write float({code}) to compare it with a number")
    return None


def _made_by(node: ast.expr, *names: str) -> bool:
    """Return whether an expression is a call of a conversion, such as `str(x)`."""
    return isinstance(node, ast.Call) and chain(node.func) in names and len(node.args) == 1


def _inside(source: Source, call: ast.expr) -> str:
    """Return the code of the only argument of a call."""
    return source.code(call.args[0], 60) if isinstance(call, ast.Call) else ""


def _is_only_compared(source: Source, name: ast.expr) -> bool:
    """Return whether a variable is compared or shown wherever its function reads it, and never used as a text."""
    function = source.function_of(name)
    reads = [n for n in source.all(ast.Name) if chain(n) == chain(name) and isinstance(n.ctx, ast.Load)]
    here = [source.parents.get(n) for n in reads if source.function_of(n) is function]
    shown = (ast.Compare, ast.FormattedValue, ast.Tuple)
    return all(isinstance(n, shown) or (isinstance(n, ast.BinOp) and isinstance(n.op, ast.Mod)) for n in here)


@crash_rule(
    r"unsupported operand type|can't multiply sequence by non-int|can only concatenate|not supported between"
    r"|bad operand type|must be (?:a )?real number|must be str, not",
    priority=7130,
)
def _starts_as(crash: Crash) -> Clue | None:
    """An attribute starts as None, or as a text, and is used as a number."""
    source = crash.source
    for node in source.on_line(crash.line, ast.Attribute):
        name = chain(node)
        if name != f"self.{node.attr}":
            continue
        for store in source.stores(name):
            statement = source.parents.get(store)
            value = statement.value if isinstance(statement, (ast.Assign, ast.AnnAssign)) else None
            if not isinstance(value, ast.Constant) or not (value.value is None or isinstance(value.value, str)):
                continue
            fits = crash.said("NoneType") if value.value is None else crash.said(r"str\b|sequence")
            if fits:
                hint = f"{source.code(statement or store)} is not a number to calculate with: start with 0 or 0.0"
                return Clue(hint, source.place(store))
    return None


@crash_rule(
    r"^TypeError: not (?:enough|all) arguments|^TypeError: %(\w) format|^TypeError: must be real number", priority=7140
)
def _percent(crash: Crash) -> Clue | None:
    """`'%.2f, %.2f' % x, y`: placeholders and values do not fit."""
    source = crash.source
    for node in source.on_line(crash.line, ast.BinOp):
        written = literal_text(node.left)
        if not isinstance(node.op, ast.Mod) or written is None:
            continue
        places = len(_PLACEHOLDER.findall(written))
        values = node.right.elts if isinstance(node.right, ast.Tuple) else [node.right]
        around = source.parents.get(node)
        behind = (
            around.args[around.args.index(node) + 1 :] if isinstance(around, ast.Call) and node in around.args else []
        )
        behind = around.elts[1:] if isinstance(around, ast.Tuple) and around.elts[0] is node else behind
        if places == len(values) + len(behind) and behind:
            given = ", ".join(source.code(v, 30) for v in (*values, *behind))
            return Clue(f"put the values in one pair of parentheses: % ({given})")
        if places != len(values):
            one = f"{places} placeholder{'s' if places != 1 else ''}"
            return Clue(f"the string has {one}, but {len(values)} value{'s' if len(values) != 1 else ''} after the %")
        return Clue("a placeholder such as %.2f or %d takes a number: use %s for anything else")
    return None


@crash_rule(
    r"^IndexError: Replacement index (\d+) out of range|^KeyError: '(\w*)'$|^IndexError: tuple index out of range",
    priority=7150,
)
def _format_fields(crash: Crash) -> Clue | None:
    """`'{} {}'.format(x)`: braces and values do not fit."""
    for call in _calls(crash, "format"):
        written = literal_text(call.func.value) if isinstance(call.func, ast.Attribute) else None
        if written is None:
            continue
        places = len(re.findall(r"(?<!\{)\{(?!\{)", written))
        given = len(call.args) + len(call.keywords)
        if places > given:
            return Clue(f"the string needs {places} values, format gets {given}: pass each of them to format(...)")
        if crash.found[2]:
            return Clue(f"format gets no {crash.found[2]}: write {crash.found[2]}=... to it, or use an f-string")
    return None


@crash_rule(
    r"^ValueError: (?:Unknown format code '(\w)' for object of type '(\w+)'|Invalid format specifier"
    r"|Sign not allowed|Precision not allowed)|^TypeError: unsupported format string passed to (\w+)",
    priority=7160,
)
def _format_code(crash: Crash) -> Clue | None:
    """`{x:d}` of a float, `{text:.2f}`, `{None:.2f}`."""
    code, type_, other = crash.found.groups()
    source = crash.source
    formatted = [n for n in source.on_line(crash.line, ast.FormattedValue) if n.format_spec is not None]
    value = source.code(formatted[0].value, 30) if len(formatted) == 1 else "the value"
    if type_ == "str" and code in tuple("feEgGdn%"):
        return Clue(f"{value} is a string here: convert it with float(...), or remove the format")
    if type_ == "float":
        specs = [
            (n, literal_text(s.values[0]))
            for n in formatted
            if isinstance(s := n.format_spec, ast.JoinedStr) and s.values
        ]
        own = next((n for n, spec in specs if spec is not None and spec.endswith(code)), None)
        shown = f"{{{source.code(own.value, 30)}:.2f}}" if own is not None else ":.2f"
        return Clue(f"the format {code} is for integers: write {shown} for a float")
    if other == "NoneType":
        return Clue(f"{value} is None here: check for it before you log it")
    if other in ("method", "builtin_function_or_method", "function"):
        return Clue(f"{value} is not called: write the parentheses")
    if other is not None:
        return Clue(f"{value} is a {other}, which takes no number format: format one of its numbers")
    return Clue("Python does not know the format after the colon: write {value:.2f}")


# --- numbers, lists and conversions ----------------------------------------------------------------------------------


@crash_rule(r"^ZeroDivisionError", priority=7170)
def _divided_by_zero(crash: Crash) -> Clue | None:
    source = crash.source
    divisions = [n for n in source.on_line(crash.line, ast.BinOp) if isinstance(n.op, (ast.Div, ast.FloorDiv, ast.Mod))]
    if len(divisions) != 1:
        return None
    divisor, code = divisions[0].right, source.code(divisions[0].right, 40)
    worth = constant_value(source, divisor)
    if worth is not None and worth.value == 0 and worth.origin is not divisor:
        return Clue(f"{code} is 0, and division by 0 fails: give it another value", source.place(worth.origin))
    if worth is not None and worth.value == 0:
        return Clue("division by 0 fails: write another number")
    return Clue(f"{code} is 0 here: check for it before you divide")


@crash_rule(
    r"^TypeError: 'float' object cannot be interpreted as an integer|^ValueError: non-integer"
    r"|^TypeError: (?:list|tuple|string) indices must be integers|^TypeError: slice indices must be integers",
    priority=7180,
)
def _whole_number(crash: Crash) -> Clue | None:
    source = crash.source
    for call in _calls(crash):
        if last_name(call.func) in ("randint", "randrange") and any(not _whole(a) for a in call.args):
            given = [source.code(a, 20) for a in call.args]
            low, high = given[:2] if len(given) > 1 else ("0", given[0])
            return Clue(f"{last_name(call.func)} takes integers: write {uniform_call(source, low, high, call)}")
        if chain(call.func) == "range":
            return Clue("range takes integers: convert each of them with int(...)")
    if crash.said("indices must be integers"):
        return Clue("a list index is an integer: use int(...), or a dict to look up by name")
    return None


def _whole(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


@crash_rule(
    r"^IndexError: (?:list index|string index|pop from|deque|array index|Cannot choose|index)|^IndexError$",
    priority=7190,
)
def _too_short(crash: Crash) -> Clue | None:
    source = crash.source
    if "argv" in source.line(crash.line):
        return None
    taken = next((n for n in source.on_line(crash.line, ast.Subscript) if isinstance(n.ctx, ast.Load)), None)
    if taken is not None:
        owner = source.code(taken.value, 40)
        return Clue(f"{owner} is too short for {source.code(taken, 40)} here: check its length first")
    call = next((c for c in _calls(crash) if last_name(c.func) in ("pop", "popleft", "choice")), None)
    return (
        Clue(f"{source.code(call, 40)} takes from an empty list: check its length first") if call is not None else None
    )


@crash_rule(r"^KeyError: (.+)$", priority=7200)
def _no_key(crash: Crash) -> Clue | None:
    source = crash.source
    taken = [n for n in source.on_line(crash.line, ast.Subscript) if isinstance(n.ctx, ast.Load)]
    if len(taken) != 1:
        return None
    owner = source.code(taken[0].value, 40)
    key = source.code(taken[0].slice, 30)
    return Clue(f"{owner} has no entry {key} yet: set it first, or read it with {owner}.get({key})")


@crash_rule(
    r"^ValueError: (?:could not convert string to float: |invalid literal for int\(\) with base 10: )(.*)$",
    priority=7210,
)
def _no_number(crash: Crash) -> Clue | None:
    source, found = crash.source, crash.found[1].strip("'\"")
    asked = "int" if crash.said("invalid literal for int") else "float"
    for call in _calls(crash):
        if chain(call.func) == asked and call.args:
            code = source.code(call, 40)
            if chain(call.func) == "int" and re.fullmatch(r"-?\d+\.\d*", found):
                return Clue(f"{code} takes only integers: write float({source.code(call.args[0], 30)})")
            if re.fullmatch(r"-?\d+,\d+", found):
                return Clue("Python has no decimal comma: write 0.5 instead of 0,5")
            unit = re.fullmatch(r"\s*-?\d+(?:\.\d+)?\s*([%°A-Za-z]{1,3})\s*", found)
            if unit is not None and asked == "float":
                right = f"float({source.code(call.args[0], 30)}.rstrip('{unit[1]}'))"
                return Clue(f"the string ends with {unit[1]}, so it is not a number: write {right}")
            return Clue(f"{code} needs a string that holds only a number: extract the number first")
    return None


@crash_rule(
    r"^ValueError: (not enough|too many) values to unpack|^TypeError: cannot unpack non-iterable (\w+) object",
    priority=7220,
)
def _unpacked(crash: Crash) -> Clue | None:
    source = crash.source
    for statement in source.on_line(crash.line, ast.Assign):
        target = statement.targets[0]
        if isinstance(target, ast.Tuple):
            code, count = source.code(statement.value, 40), len(target.elts)
            if crash.found[2]:
                return Clue(f"{code} is one {crash.found[2]}, and there are {count} names for it")
            return Clue(f"{code} does not have {count} elements: write as many names as it has")
    return None


@crash_rule(
    r"^TypeError: '(\w+)' object is not subscriptable|^TypeError: '(\w+)' object does not support item", priority=7230
)
def _not_indexed(crash: Crash) -> Clue | None:
    kind = crash.found[1] or crash.found[2]
    source = crash.source
    taken = list(source.on_line(crash.line, ast.Subscript))
    if kind in ("method", "builtin_function_or_method", "function") and taken:
        code = source.code(taken[-1].value, 40)
        return Clue(f"{code} is a function: call it with parentheses, {code}(...)")
    if kind in ("float", "int") and taken:
        code = source.code(taken[-1].value, 40)
        return Clue(f"{code} is a single number, not a list: use it as it is")
    return None


# --- coroutines ------------------------------------------------------------------------------------------------------


@crash_rule(r"^TypeError: __init__\(\) should return None", priority=7240)
def _returns_from_init(crash: Crash) -> Clue | None:
    source = crash.source
    found = [r for r in source.all(ast.Return) if r.value is not None and source.function_name(r) == "__init__"]
    if len(found) != 1:
        return None
    return Clue(f"__init__ must not return a value: remove {source.code(found[0], 40)}", source.place(found[0]))


@crash_rule(
    r"^TypeError: (str|int|float)\(\) argument 'encoding'"
    r"|^TypeError: (\w+)\(?\)? (?:expected|takes) at most \d arguments?",
    priority=7250,
)
def _too_many_for_builtin(crash: Crash) -> Clue | None:
    """`str('x', value)`, `float(0,5)`."""
    name = crash.found[1] or crash.found[2]
    for call in _calls(crash, name):
        if len(call.args) == 2 and name == "float" and all(_whole(a) for a in call.args):
            number = ".".join(crash.source.code(a) for a in call.args)
            return Clue(f"a decimal comma makes two numbers: write {number}")
        if name in ("str", "int", "float") and len(call.args) > 1:
            right = "f'... {value}'" if name == "str" else f"{name}(value)"
            return Clue(f"{name} takes one value: write {right}")
    return None


@crash_rule(
    r"'int' object has no attribute 'remove_node'|'(\w+)' object has no attribute '(?:add_node|remove_node|spin_once)'",
    priority=7260,
)
def _second_to_spin(crash: Crash) -> Clue | None:
    for call in _calls(crash, "spin"):
        if len(call.args) > 1:
            return Clue(f"spin takes only the node: rclpy.spin({crash.source.code(call.args[0], 40)})")
    return None


@crash_rule(r"^RuntimeError: no running event loop", priority=7270)
def _no_event_loop(crash: Crash) -> Clue | None:
    """`await asyncio.sleep()` in a callback of rclpy."""
    awaited = [c for c in crash.source.on_line(crash.line, ast.Call) if chain(c.func).startswith("asyncio.")]
    if not awaited:
        return None
    hint = (
        f"{crash.source.code(awaited[0], 40)} works in asyncio's own loop only, and rclpy.spin runs callbacks without"
    )
    return Clue(f"{hint} it: remove it, a timer sets the pace", crash.source.place(awaited[0]))


@crash_rule(r"^TypeError: object (\w+) can't be used in 'await' expression", priority=7280)
def _awaited_nothing(crash: Crash) -> Clue | None:
    awaits = list(crash.source.on_line(crash.line, ast.Await))
    if not awaits:
        return None
    code = crash.source.code(awaits[0].value, 40)
    return Clue(f"{code} cannot be awaited: write it without await")


@crash_rule(r"'coroutine' object", priority=7290)
def _not_awaited(crash: Crash) -> Clue | None:
    source = crash.source
    functions = {f.name: f for f in source.all(ast.AsyncFunctionDef)}
    for call in source.all(ast.Call):
        if last_name(call.func) in functions and not isinstance(source.parents.get(call), ast.Await):
            code, function = source.code(call, 40), functions[last_name(call.func)]
            if not isinstance(source.function_of(call), ast.AsyncFunctionDef):
                hint = f"{function.name} is async, so {code} only makes a coroutine: write def {function.name}"
                return Clue(f"{hint} without async", source.place(function))
            return Clue(f"{code} is async: write await {code}", source.place(call))
    return None
