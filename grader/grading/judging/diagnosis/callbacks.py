"""Causes of exceptions while a node is constructed, and around its callbacks: wrong arguments, or missing values."""

from __future__ import annotations

import ast
import re
from collections.abc import Container

from grader.grading.judging.diagnosis.names import NODE_PROPERTIES, closest
from grader.grading.judging.diagnosis.rules import Case, Clue, Crash, crash_rule, hint_rule, lines_of
from grader.grading.judging.diagnosis.wiring import (
    Made,
    bare_statements,
    made,
    target_of,
    value_of,
)
from grader.grading.judging.source import (
    Function,
    Source,
    argument,
    chain,
    covers,
    first_line,
    last_line,
    last_name,
    literal_text,
    parameters,
)
from grader.grading.model.exercise import Location
from grader.runtime.model.trace import Fault, FaultKind

_QUOTES = "\"'"


@crash_rule("", *FaultKind, priority=4010)
def _callback_called(crash: Crash) -> Clue | None:
    """`create_timer(0.05, self.tick())`: the function runs once, and its result is used as the callback."""
    source = crash.source
    result = crash.said(r"not callable|callable object|callback should be either")
    given = [(item.call, item.callback) for item in made(source, "timer", "subscription")]
    given += [(call, argument(call, 2, "callback")) for call in source.calls("create_service")]
    given += [(call, argument(call, 0, "callback")) for call in source.calls("add_done_callback")]
    ran = {crash.line, *(line for line, _ in crash.frames())}
    for call, called in given:
        serves = last_name(call.func) == "create_service"
        if not isinstance(called, ast.Call) or not (_returns_nothing(source, called) or serves):
            continue
        if (result and not serves) or any(covers(call, line) for line in ran):
            bare = source.code(called.func)
            hint = f"{source.code(called)} calls the function at once: pass {bare}, without the parentheses"
            if last_name(call.func) == "add_done_callback" and called.args[1:]:
                rest = ", ".join(source.code(argument_, 30) for argument_ in called.args[1:])
                hint = f"{source.code(called)} calls the function at once: pass lambda future: {bare}(future, {rest})"
            return Clue(hint, source.place(call))
    return None


@hint_rule(fault=None, priority=4012)
def _thread_called(case: Case) -> Clue | None:
    """`Thread(target=node.run())`: the function runs before there is a thread, which then has nothing to do."""
    for source in case.sources.values():
        for call in source.calls("Thread"):
            target = argument(call, 1, "target")
            if isinstance(target, ast.Call) and _returns_nothing(source, target):
                bare = source.code(target.func)
                hint = f"{source.code(target)} runs the function at once, and not in the thread: write target={bare}"
                return Clue(hint, source.place(call), key=f"thread:{source.file}:{first_line(call)}")
    return None


def _returns_nothing(source: Source, call: ast.Call) -> bool:
    functions = source.functions(last_name(call.func))
    returns = [r for r in source.all(ast.Return) if r.value is not None and source.function_of(r) in functions]
    return bool(functions) and not returns


@crash_rule(
    r"callback should be either be callable|positional argument|has no attribute|is not defined|NoneType", priority=4015
)
def _defined_twice(crash: Crash) -> Clue | None:
    """Two methods have one name, as after copy and paste: the second one replaces the first."""
    source, inside = crash.source, {name for _, name in crash.frames()}
    named = {last_name(m.callback) for m in made(source, "timer", "subscription") if covers(m.call, crash.line)}
    called = crash.said(r"(\w+)\(\) (?:takes|missing|got)")
    named |= {called[1].rpartition(".")[2]} if called else set()
    return twice(source, named | (inside - {"<module>", "__init__", "main"}))


def twice(source: Source, names: Container[str]) -> Clue | None:
    """Return a clue if one of these functions is defined twice in one class or file."""
    seen: dict[tuple[ast.AST | None, str], Function] = {}
    for function in source.functions():
        place = source.parents.get(function), function.name
        first = seen.setdefault(place, function)
        plain = not function.decorator_list and not first.decorator_list
        if first is not function and function.name in names and plain and not isinstance(place[0], (ast.If, ast.Try)):
            hint = (
                f"{function.name} is defined twice, in {lines_of(first, function)}, and only this second one counts: "
            )
            return Clue(f"{hint}give one of them another name", source.place(function))
    return None


@crash_rule(priority=4020)
def _callback_signature(crash: Crash) -> Clue | None:
    """A callback does not accept the arguments that it is called with."""
    return (
        _lacks_self(crash, crash.source)
        or _timed_with_message(crash, crash.source)
        or _subscription_signature(crash)
        or _service_signature(crash)
        or _filter_signature(crash)
    )


def _filter_signature(crash: Crash) -> Clue | None:
    """The callback of a message filter takes another number of messages than the filter passes."""
    source, found = crash.source, crash.said(r"(\w+)\(\) (?:takes|missing) ")
    for call in source.calls("registerCallback") if found else ():
        functions = source.functions(last_name(argument(call, 0, "cb")))
        if found is None or len(functions) != 1 or functions[0].name != found[1]:
            continue
        owner = chain(call.func).rpartition(".")[0]
        makers = [
            c for c in source.calls("TimeSynchronizer", "ApproximateTimeSynchronizer") if target_of(source, c) == owner
        ]
        first = makers[0].args[0] if len(makers) == 1 and makers[0].args else None
        count = len(first.elts) if isinstance(first, (ast.List, ast.Tuple)) else 1
        names = ["msg"] if count == 1 else [f"msg_{k}" for k in range(1, count + 1)]
        own = ["self"] if source.is_method(functions[0]) else []
        passes = "one message" if count == 1 else f"{count} messages"
        hint = f"the filter passes {passes}: def {functions[0].name}({', '.join([*own, *names])}):"
        return Clue(hint, source.place(functions[0]))
    return None


def _lacks_self(crash: Crash, source: Source) -> Clue | None:
    found = crash.said(r"(\w+)\(\) takes 0 positional arguments but 1 was given")
    methods = [f for f in source.functions(found[1]) if source.is_method(f)] if found else []
    if len(methods) != 1 or parameters(methods[0]):
        return None
    return Clue(f"a method takes self first: def {methods[0].name}(self):", source.place(methods[0]))


def _timed_with_message(crash: Crash, source: Source) -> Clue | None:
    found = crash.said(r"(\w+)\(\) missing 1 required positional argument: '(\w+)'")
    functions = source.functions(found[1]) if found else []
    timed = [m.callback for m in made(source, "timer") if found is not None and last_name(m.callback) == found[1]]
    if found is None or len(functions) != 1 or not timed:
        return None
    given = timed[0]
    if found[2] == "self":
        code = source.code(given) if given is not None else found[1]
        return Clue(f"{code} is not bound to an object: pass self.{found[1]}", source.place(given or functions[0]))
    if given is not None and any(last_name(m.callback) == found[1] for m in made(source, "subscription")):
        hint = f"{found[1]} is the callback of the subscription, which passes the message: give the timer a method of "
        return Clue(f"{hint}its own", source.place(given))
    rest = ", ".join(p for p in parameters(functions[0]) if p != found[2])
    hint = f"a timer calls {found[1]} without arguments: def {found[1]}({rest}):"
    return Clue(hint, source.place(functions[0]))


def _subscription_signature(crash: Crash) -> Clue | None:
    if not crash.said(r"callback should be either be callable|takes \d positional argument"):
        return None
    source = crash.source
    for item in made(source, "subscription"):
        named = crash.said(rf"\b{re.escape(last_name(item.callback))}\(\) takes")
        functions = source.functions(last_name(item.callback))
        if len(functions) == 1 and (named or covers(item.call, crash.line)):
            return _too_few_parameters(source, functions[0], item.callback)
    return None


def _too_few_parameters(source: Source, function: Function, callback: ast.expr | None) -> Clue | None:
    names = parameters(function)
    bound = source.is_method(function) and isinstance(callback, ast.Attribute)
    timed = any(last_name(m.callback) == function.name for m in made(source, "timer"))
    if timed and names == ["self"]:
        hint = f"{function.name} is the callback of the timer: a subscription needs its own, with self and msg"
        return Clue(hint, source.place(callback) if callback is not None else source.place(function))
    if bound and len(names) == 1 and names != ["self"]:
        return Clue(f"self is missing: def {function.name}(self, {names[0]}):", source.place(function))
    if names not in ([], ["self"]):
        return None
    own = "self, " if bound else ""
    hint = f"a subscription passes the message: def {function.name}({own}msg):"
    return Clue(hint, source.place(function))


def _service_signature(crash: Crash) -> Clue | None:
    source = crash.source
    for call in source.calls("create_service"):
        callback = argument(call, 2, "callback")
        functions = source.functions(last_name(callback))
        if len(functions) != 1:
            continue
        function = functions[0]
        if crash.said(rf"\b{re.escape(function.name)}\(\) (takes|missing)"):
            hint = f"a service passes request and response: def {function.name}(self, request, response):"
            return Clue(hint, source.place(function))
        empty = all(r.value is None for r in source.all(ast.Return) if source.function_of(r) is function)
        if empty and crash.said(r"^TypeError$|^TypeError: *$|[Rr]esponse"):
            given = [n for n in parameters(function) if n != "self"]
            hint = f"{function.name} must end with: return {given[1] if len(given) > 1 else 'response'}"
            return Clue(hint, Location(source.file, last_line(function)))
    return None


@crash_rule("NoneType|has no attribute", priority=4030)
def _no_data_yet(crash: Crash) -> Clue | None:
    """A value that a callback stores is read before the first message."""
    source = crash.source
    function = source.function_at(crash.line)
    callbacks = {last_name(m.callback) for m in made(source, "subscription")}
    if function is None or not crash.frames() or function.name in callbacks:
        return None
    for node in source.on_line(crash.line, ast.Attribute):
        name = chain(node)
        if name != f"self.{node.attr}" or not isinstance(node.ctx, ast.Load):
            continue
        stores = source.stores(name)
        stored_by = {source.function_name(n) for n in stores} - {""}
        if not stored_by & callbacks:
            continue
        begin = _begin(crash, function, name)
        turned = _turned_test(source, function, name)
        if turned is not None:
            hint = f"'if {source.code(turned.test, 40)}' is the wrong way round: write if {name} is None"
            return Clue(hint, source.place(turned))
        if crash.said("NoneType") and any(_starts_with_none(source, n) for n in stores):
            return Clue(f"{name} is None until the first message arrives: {begin}")
        unset = crash.said(rf"object has no attribute '{re.escape(node.attr)}'")
        if unset and "__init__" not in stored_by:
            early = function.name == "__init__" and not _in_lambda(crash)
            first = "" if early else f"set {name} = None in __init__, and "
            return Clue(f"{name} does not exist before the first message: {first}{begin}")
    return None


def _in_lambda(crash: Crash) -> bool:
    return crash.frames()[-1][1] == "<lambda>"


def _begin(crash: Crash, function: Function, name: str) -> str:
    """Return what to do in a function that reads a value which only a callback sets."""
    if _in_lambda(crash):
        return f"put a method in place of the lambda that begins with: if {name} is None: return"
    if function.name == "__init__":
        line = crash.line
        return f"line {line} runs before anything can arrive: move it into a callback"
    return f"begin {function.name} with: if {name} is None: return"


def _turned_test(source: Source, function: Function, name: str) -> ast.If | None:
    """Return the test that returns if there is a value, instead of if there is none."""
    for test in source.all(ast.If):
        asked = test.test
        leaves = len(test.body) == 1 and isinstance(test.body[0], ast.Return)
        if not leaves or source.function_of(test) is not function:
            continue
        plain = isinstance(asked, (ast.Name, ast.Attribute)) and chain(asked) == name
        compared = isinstance(asked, ast.Compare) and chain(asked.left) == name and isinstance(asked.ops[0], ast.IsNot)
        if plain or compared:
            return test
    return None


def _starts_with_none(source: Source, store: ast.AST) -> bool:
    statement = source.parents.get(store)
    value = statement.value if isinstance(statement, (ast.Assign, ast.AnnAssign)) else None
    return isinstance(value, ast.Constant) and value.value is None


@crash_rule(
    "^TypeError: 'method' object"
    "|^AttributeError: '(?:function|method)' object has no attribute '(?:handle|add_entity|wake)'",
    priority=4035,
)
def _method_over_property(crash: Crash) -> Clue | None:
    """A method has the name of a property of Node, which rclpy reads."""
    source = crash.source
    for owner in source.deriving("Node"):
        for function in (f for f in owner.body if isinstance(f, Function)):
            if function.name in NODE_PROPERTIES and not function.decorator_list:
                hint = f"Node itself uses the name {function.name}: rename the method, for example my_{function.name}"
                return Clue(hint, source.place(function))
    return None


@crash_rule(
    "Context must be initialized before|rcl_shutdown already called|does not support the context manager"
    "|InvalidHandle|context is (not valid|invalid)",
    priority=4040,
)
def _shut_down_early(crash: Crash) -> Clue | None:
    source, line = crash.source, crash.line
    for call in source.calls("shutdown", "try_shutdown", "destroy_node", "destroy_publisher"):
        function = source.function_of(call)
        if function is not None and source.is_method(function) and function.name not in ("__del__", "destroy_node"):
            hint = f"{source.code(call)} in {function.name} ends the node while it runs: remove it"
            return Clue(hint, source.place(call))
        before = function is source.function_at(line) and first_line(call) < line
        if before and last_name(call.func) != "destroy_node" and "shutdown" not in source.line(line):
            hint = f"{source.code(call)} comes too early: ROS is shut down before line {line}"
            return Clue(hint, source.place(call))
    return None


@crash_rule(r"create_(publisher|subscription)\(\) missing \d required positional arguments?: (.*)", priority=4050)
def _missing_qos(crash: Crash) -> Clue | None:
    found, call = crash.found, _call_at_fault(crash, f"create_{crash.found[1]}")
    if call is None or not call.args:
        return None
    written, last = crash.source.code(call), call.args[-1]
    if found[1] == "subscription" and isinstance(last, ast.Constant) and isinstance(last.value, int):
        return Clue(f"{written} has no callback: the third argument is the method to call, the fourth the queue depth")
    if "callback" in found[2] or "topic" in found[2] or not written.endswith(")"):
        return None
    return Clue(f"the queue depth is missing: {written[:-1]}, 10)")


def _call_at_fault(crash: Crash, *names: str) -> ast.Call | None:
    """Return the call of one of these functions on the line of the fault."""
    return next((c for c in crash.source.calls(*names) if covers(c, crash.line)), None)


@crash_rule("has no setter|can't set attribute|handle cannot be modified|has no attribute 'add_node'", priority=4060)
def _read_only_property(crash: Crash) -> Clue | None:
    for node in crash.source.on_line(crash.line, ast.Attribute):
        if isinstance(node.ctx, ast.Store) and chain(node) == f"self.{node.attr}" and node.attr in NODE_PROPERTIES:
            return Clue(f"Node already uses the name {node.attr}: rename yours, for example self.my_{node.attr}")
    return None


@crash_rule(priority=4070)
def _super_init(crash: Crash) -> Clue | None:
    """The constructor of Node was not called, called too late, or misspelt."""
    if crash.said(r"descriptor '__init__' requires a 'super' object"):
        return Clue("super needs parentheses: super().__init__('node_name')")
    misspelt = crash.said(r"'super' object has no attribute '(\w+)'")
    if misspelt and closest(misspelt[1], ("__init__",)):
        return Clue(f"{misspelt[1]} is a typo: write super().__init__('node_name')")
    if crash.said(r"Node\.__init__\(\) missing 1 required positional argument: 'node_name'"):
        return _no_name(crash.fault, crash.source) or _super_of_other(crash)
    return _no_base(crash) or _super_of_other(crash) or _used_before_super(crash)


def _super_of_other(crash: Crash) -> Clue | None:
    """`super(Node).__init__(...)` and `Node.__init__('name')`."""
    for call in crash.source.on_line(crash.line, ast.Call):
        base = call.func.value if isinstance(call.func, ast.Attribute) and call.func.attr == "__init__" else None
        named = isinstance(base, ast.Name) and bool(call.args) and literal_text(call.args[0]) is not None
        other = isinstance(base, ast.Call) and chain(base.func) == "super" and bool(base.args)
        if named or other:
            given = ", ".join(crash.source.code(a, 40) for a in call.args if chain(a) != "self")
            return Clue(f"write super().__init__({given})")
    return None


def _no_base(crash: Crash) -> Clue | None:
    owner = next(crash.source.on_line(crash.line, ast.ClassDef), None)
    if owner is None or owner.bases or not crash.said(r"object\.__init__\(\) takes exactly one argument"):
        return None
    return Clue(f"make it a node: class {owner.name}(Node):", crash.source.place(owner))


def _no_name(fault: Fault, source: Source) -> Clue | None:
    calls = list(source.on_line(fault.line, ast.Call))
    if any(chain(c.func) == "super().__init__" for c in calls):
        return Clue(f"give the node a name: super().__init__('{fault.process.removesuffix('.py')}')")
    made_here = {last_name(c.func) for c in calls}
    for function in source.functions():
        owner = source.parents.get(function)
        slip = function.name != "__init__" and function.name.strip("_").lower() in ("init", "int", "inti", "ini")
        if slip and isinstance(owner, ast.ClassDef) and owner.name in made_here:
            hint = f"{function.name} is never called: the constructor is __init__"
            return Clue(f"{hint}, with two underscores on each side", source.place(function))
    return None


def _used_before_super(crash: Crash) -> Clue | None:
    missing = crash.said(r"'(\w+)' object has no attribute '(_\w+)'")
    source, where = crash.source, crash.frames()
    if missing is None or not where or where[-1][1] != "__init__":
        return None
    owner = next((c for c in source.all(ast.ClassDef) if c.name == missing[1]), None)
    if owner is None or any(last_name(n) == missing[2] for n in source.all(ast.Attribute)):
        return None
    constructor = next((f for f in source.functions("__init__") if source.class_of(f) is owner), None)
    calls = [c for c in source.calls("__init__") if source.class_of(c) is owner]
    if constructor is None or not owner.bases:
        return None
    if not calls:
        hint = "the first line of __init__ must be super().__init__('node_name')"
        return Clue(hint, source.place(constructor))
    if first_line(calls[0]) > crash.line:
        hint = f"{source.code(calls[0])} must come first: line {crash.line} uses the node before it"
        return Clue(hint, source.place(calls[0]))
    return None


@crash_rule(priority=4080)
def _init_order(crash: Crash) -> Clue | None:
    source, line = crash.source, crash.line
    inits = [c for c in source.calls("init") if chain(c.func) in ("rclpy.init", "init")]
    if crash.said(r"init\(\) must only be called once"):
        others = [c for c in inits if first_line(c) != line]
        again = f" and in {lines_of(*others)}" if others else ""
        return Clue(f"rclpy.init() may be called only once; it is called here{again}: remove one of them")
    if not crash.said(r"NotInitializedException|rclpy\.init\(\) has not been called"):
        return None
    used = next((number for number, name in reversed(crash.frames()) if name != "__init__"), line)
    named = next((n for n in bare_statements(source) if chain(n) == "rclpy.init"), None)
    if not inits and named is not None:
        return Clue("rclpy.init is not called: write rclpy.init()", source.place(named))
    if not inits:
        at = next((c for c in source.on_line(used, ast.Call) if first_line(c) == used), None)
        hint = f"call rclpy.init() before line {used}: nothing in ROS works without it"
        return Clue(hint, source.place(at) if at is not None else None)
    return _init_elsewhere(source, inits, used)


def _init_elsewhere(source: Source, inits: list[ast.Call], used: int) -> Clue | None:
    """Return a clue if ROS was initialised after line `used`, or shut down before it, in the same function."""
    here = source.function_at(used)
    late = [c for c in inits if first_line(c) > used and source.function_of(c) is here]
    if late and len(late) == len(inits):
        hint = f"{source.code(late[0])} comes too late: the node is created before it, in line {used}"
        return Clue(hint, source.place(late[0]))
    stops = [c for c in source.calls("shutdown", "try_shutdown") if first_line(c) < used]
    if stops and source.function_of(stops[-1]) is here:
        return Clue(f"{source.code(stops[-1])} has shut ROS down before line {used}", source.place(stops[-1]))
    return None


@crash_rule(priority=4090)
def _endpoint_arguments(crash: Crash) -> Clue | None:
    """Arguments of create_publisher, create_subscription or create_timer have the wrong order or type."""
    source = crash.source
    items = made(source, "publisher", "subscription", "timer")
    item = next((m for m in items if covers(m.call, crash.line) and m.call.args), None)
    if item is None:
        return None
    if item.kind == "timer":
        return _timer_arguments(crash, item)
    return _topic_arguments(crash, item) if _kinds_of(source, item) is None else _mixed_order(source, item)


def _timer_arguments(crash: Crash, item: Made) -> Clue | None:
    if not crash.said(r"must be a string or a real number, not '(method|function)'|operand type.*'(method|function)'"):
        return None
    period = crash.source.code(item.call.args[1]) if len(item.call.args) > 1 else "..."
    callback = crash.source.code(item.call.args[0])
    return Clue(f"the period comes first, then the callback: create_timer({period}, {callback})")


_ORDER = {"subscription": ["type", "topic", "callback", "depth"], "publisher": ["type", "topic", "depth"]}


def _kinds_of(source: Source, item: Made) -> list[str] | None:
    """Return what the arguments are if all that are wanted are there, in another order; None otherwise."""
    kinds, wanted = [_kind_of(source, a) for a in item.call.args], _ORDER[item.kind]
    return kinds if kinds != wanted and sorted(kinds) == sorted(wanted) else None


def _mixed_order(source: Source, item: Made) -> Clue | None:
    """Return the clue for type, topic, callback and depth in another order."""
    kinds, wanted = _kinds_of(source, item), _ORDER[item.kind]
    if kinds is None:
        return None
    ordered = [source.code(item.call.args[kinds.index(kind)], 40) for kind in wanted]
    names = "type, topic, callback, depth" if item.kind == "subscription" else "type, topic, depth"
    return Clue(f"the order is {names}: create_{item.kind}({', '.join(ordered)})")


def _kind_of(source: Source, node: ast.expr) -> str:
    """Return what an argument is, as far as the text shows it."""
    if isinstance(node, ast.Constant):
        return {str: "topic", int: "depth"}.get(type(node.value), "")
    if any(source.is_method(f) or f.name for f in source.functions(last_name(node))):
        return "callback"
    dotted = source.resolved(node)
    if last_name(node)[:1].isupper() and ".msg." in dotted:
        return "type"
    return "depth" if "qos" in dotted.lower() else ""


@crash_rule(
    r"has no attribute '(?:__name__|_TYPE_SUPPORT|_CREATE_ROS_MESSAGE)'|isinstance\(\) arg 2 must be a type",
    priority=4100,
)
def _made_for_type(crash: Crash) -> Clue | None:
    """`create_publisher(Twist(), ...)`: an object stands in the place of the message class, as publishing shows."""
    for item in made(crash.source, "publisher", "subscription"):
        first = item.call.args[0] if item.call.args else None
        if isinstance(first, ast.Call):
            code = crash.source.code(first.func, 40)
            hint = f"{crash.source.code(first, 40)} creates a message: pass the class, {code}, without the parentheses"
            return Clue(hint, crash.source.place(item.call))
    return None


def _topic_arguments(crash: Crash, item: Made) -> Clue | None:  # noqa: PLR0911  one for each argument
    source, first = crash.source, item.call.args[0]
    second = item.call.args[1] if len(item.call.args) > 1 else None
    if crash.said(r"rclpy_resolve_name\(\): incompatible") and second is not None and last_name(second)[:1].isupper():
        return Clue(f"{source.code(second, 40)} is not a topic name: write a string such as '/name'")
    text_first = isinstance(first, ast.Constant) and isinstance(first.value, str)
    if text_first and len(item.call.args) > 1 and crash.said(r"rclpy_resolve_name\(\): incompatible"):
        other = source.code(item.call.args[1])
        return Clue(f"the message type comes first, then the topic: ({other}, {source.code(first)}, ...)")
    if text_first and crash.said(r"has no attribute '_TYPE_SUPPORT'"):
        return Clue(f"the message type is a class, without quotes: {source.code(first).strip(_QUOTES)}")
    if crash.said(r"type object 'module' has no attribute '_TYPE_SUPPORT'"):
        return Clue(f"{source.code(first)} is a module: pass a message class from it")
    if crash.said(r"Expected QoSProfile or int") and item.qos is not None:
        third = item.callback
        if third is not None and isinstance(third, ast.Constant) and isinstance(third.value, int):
            given = f"{source.code(item.qos)}, {source.code(third)}"
            return Clue(f"the callback comes third, then the queue depth: (..., {given})")
        return Clue(f"the queue depth is a number: write 10 instead of {source.code(item.qos)}")
    return None


@crash_rule(priority=4110)
def _parameter_arguments(crash: Crash) -> Clue | None:
    """The arguments of declare_parameter are swapped."""
    call = _call_at_fault(crash, "declare_parameter")
    if (
        call is None
        or len(call.args) < 2
        or literal_text(call.args[0]) is not None
        or literal_text(call.args[1]) is None
    ):
        return None
    name, value = crash.source.code(call.args[1]), crash.source.code(call.args[0])
    return Clue(f"the name comes first, then the value: declare_parameter({name}, {value})")


@crash_rule(r"Invalid(Node|Topic)NameException", in_file=False, priority=4120)
def _bad_name(crash: Crash) -> Clue | None:
    if crash.found[1] == "Node":
        return Clue("a node name may contain only letters, digits and underscores")
    hint = "a topic name may contain only letters, digits, _ and /, and no part may start with a digit"
    call = _call_at_fault(crash, "create_publisher", "create_subscription")
    # Where the name is written, which may be a constant of the file.
    written = value_of(crash.source, argument(call, 1, "topic")) if call is not None else None
    return Clue(
        hint, crash.source.place(written) if written is not None and literal_text(written) is not None else None
    )


@crash_rule("^TypeError|^AttributeError", priority=4130)
def _spun_class(crash: Crash) -> Clue | None:
    call = _call_at_fault(crash, "spin", "spin_once")
    if call is None or not call.args:
        return None
    name = last_name(call.args[0])
    if not any(c.name == name for c in crash.source.all(ast.ClassDef)):
        return None
    here = crash.source.function_of(call)
    objects = (target_of(crash.source, c) for c in crash.source.calls(name) if crash.source.function_of(c) is here)
    return Clue(f"spin takes a node, but {name} is the class: write {next(filter(None, objects), f'{name}()')}")
