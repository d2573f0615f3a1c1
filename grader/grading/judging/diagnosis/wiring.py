"""Reads how a file uses ROS: endpoints, timers, the code that they run, and the values of expressions."""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import islice
from typing import TypeGuard

from grader.grading.judging.diagnosis.names import LOG_METHODS, SPINS
from grader.grading.judging.source import (
    Function,
    Loop,
    Source,
    argument,
    chain,
    first_line,
    last_name,
    literal_text,
    parameters,
    subtree,
)
from grader.grading.model.wording import quote
from grader.runtime.model.dataclass import dataclass

#: Names that stand for names, and operators in operators: a program of the course needs two or three.
_DEEPEST = 12
#: A field of an f-string.
_FIELD = re.compile(r"\{(?P<value>[A-Za-z_][\w.]*(?:\(\))?(?:\[[^\]{}]*\])*)(?:![rsa])?(?::[^{}]*)?\}")
_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
}
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "float": float,
    "int": lambda x: float(int(x)),
    "abs": abs,
    "math.radians": math.radians,
    "math.degrees": math.degrees,
    "np.deg2rad": math.radians,
    "np.rad2deg": math.degrees,
}
_NAMED = {"math.pi": math.pi, "np.pi": math.pi, "numpy.pi": math.pi}


@dataclass(frozen=True, slots=True)
class Constant:
    """A number, and the expression in the text to change for another number."""

    value: float
    origin: ast.AST


def constant_value(source: Source, node: ast.AST | None, depth: int = 0) -> Constant | None:
    """Return the value of an expression, or None if it cannot be read from the text."""
    if node is None or depth > _DEEPEST:
        return None
    if isinstance(node, ast.Constant):
        return _literal(node)
    if isinstance(node, (ast.UnaryOp, ast.BinOp)):
        return _arithmetic(source, node, depth)
    if isinstance(node, ast.Call):
        return _called(source, node, depth)
    return _named(source, node, depth) if isinstance(node, (ast.Name, ast.Attribute)) else None


def _literal(node: ast.Constant) -> Constant | None:
    plain = isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    try:
        return Constant(float(node.value), node) if plain else None  # type: ignore[arg-type]
    except OverflowError:
        return None


def _named(source: Source, node: ast.Name | ast.Attribute, depth: int) -> Constant | None:
    if chain(node) in _NAMED:
        return Constant(_NAMED[chain(node)], node)
    if isinstance(node, ast.Attribute) and node.attr in ("value", "double_value", "integer_value"):
        found = _parameter(source, node.value, depth)
        if found is not None:
            return found
    return constant_value(source, _only_assignment(source, node), depth + 1)


def number_in_code(source: Source, node: ast.AST | None) -> float | None:
    """Return the value of an expression, or None."""
    found = constant_value(source, node)
    return None if found is None else found.value


def _arithmetic(source: Source, node: ast.UnaryOp | ast.BinOp, depth: int) -> Constant | None:
    if isinstance(node, ast.UnaryOp):
        inner = constant_value(source, node.operand, depth + 1)
        if inner is None or not isinstance(node.op, (ast.USub, ast.UAdd)):
            return None
        return Constant(-inner.value if isinstance(node.op, ast.USub) else inner.value, node)
    left, right = constant_value(source, node.left, depth + 1), constant_value(source, node.right, depth + 1)
    apply = _BINARY.get(type(node.op))
    if left is None or right is None or apply is None:
        return None
    try:
        value = apply(left.value, right.value)
    except (ArithmeticError, ValueError):
        return None
    # the only named number is the one to change: RATE in 1 / RATE
    named = [c.origin for c, at in ((left, node.left), (right, node.right)) if c.origin is not at]
    return Constant(value, named[0] if len(named) == 1 else node)


def _called(source: Source, call: ast.Call, depth: int) -> Constant | None:
    apply = _FUNCTIONS.get(chain(call.func))
    if apply is None or len(call.args) != 1 or call.keywords:
        return None
    inner = constant_value(source, call.args[0], depth + 1)
    try:
        return None if inner is None else Constant(apply(inner.value), call)
    except (ArithmeticError, ValueError):
        return None


def _parameter(source: Source, call: ast.AST, depth: int) -> Constant | None:
    """Return the default of a ROS parameter that a call reads or declares."""
    if isinstance(call, ast.Call) and last_name(call.func) == "get_parameter_value":
        call = call.func.value if isinstance(call.func, ast.Attribute) else call
    if not isinstance(call, ast.Call):
        return None
    if last_name(call.func) == "declare_parameter":
        return constant_value(source, argument(call, 1, "value"), depth + 1)
    name = literal_text(argument(call, 0, "name"))
    if last_name(call.func) != "get_parameter" or name is None:
        return None
    declared = [c for c in source.calls("declare_parameter") if literal_text(argument(c, 0, "name")) == name]
    return constant_value(source, argument(declared[0], 1, "value"), depth + 1) if len(declared) == 1 else None


def _only_assignment(source: Source, name: ast.Name | ast.Attribute) -> ast.expr | None:
    """Return the value of a name that is assigned exactly once."""
    if isinstance(name, ast.Attribute):
        return _only_attribute(source, name)
    function = source.function_of(name)
    if function is not None:
        if name.id in parameters(function):
            return _only_default(source, function, name.id)
        inside = [n for n in bindings(source, name.id) if source.function_of(n) is function]
        if inside:
            return _value(inside[0]) if len(inside) == 1 else None
    outside = [n for n in bindings(source, name.id) if source.function_of(n) is None and source.class_of(n) is None]
    changed = any(name.id in g.names for g in source.all(ast.Global))
    return _value(outside[0]) if len(outside) == 1 and not changed else None


def _only_attribute(source: Source, name: ast.Attribute) -> ast.expr | None:
    wanted = chain(name)
    if not wanted.startswith("self.") or "(" in wanted:
        return None
    stores = source.stores(wanted)
    if stores:
        return _value(source.parents.get(stores[0])) if len(stores) == 1 else None
    named = [n for n in bindings(source, name.attr) if isinstance(source.parents.get(n), ast.ClassDef)]
    return _value(named[0]) if len(named) == 1 and wanted.count(".") == 1 else None


def bindings(source: Source, name: str) -> list[ast.AST]:
    """Return the statements that assign a plain name, in the order of the text."""
    return [source.parents[n] for n in source.stored.get(name, ()) if n in source.parents]


def _value(statement: ast.AST | None) -> ast.expr | None:
    if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
        return statement.value
    return statement.value if isinstance(statement, ast.AnnAssign) else None


def _only_default(source: Source, function: ast.FunctionDef | ast.AsyncFunctionDef, name: str) -> ast.expr | None:
    """Return the default of a parameter, if no call in the file passes arguments to the function."""
    names = parameters(function)
    owner = source.class_of(function)
    known_as = [function.name, owner.name] if owner is not None and function.name == "__init__" else [function.name]
    passed = [c for c in source.calls(*known_as) if (c.args or c.keywords) and "super()" not in chain(c.func)]
    place = names.index(name) - len(names) + len(function.args.defaults)
    return function.args.defaults[place] if place >= 0 and not passed else None


def given_leaf(source: Source, leaf: str) -> list[ast.AST]:
    """Return the assignments and keyword arguments that set a field such as `data`."""
    found: list[ast.AST] = []
    for statement in source.all(ast.Assign):
        attributes = [t for t in statement.targets if isinstance(t, ast.Attribute) and t.attr == leaf]
        if any(not chain(t).startswith("self.") or chain(t).count(".") > 1 for t in attributes):
            found.append(statement)
    keywords = (k for c in source.all(ast.Call) for k in c.keywords)
    return found + [k for k in keywords if k.arg == leaf]


#: What makes an object with a method `uniform` of its own.
_GENERATORS = ("random.Random", "random.SystemRandom", "numpy.random.default_rng", "numpy.random.RandomState")


def own_uniform(source: Source, low: str, high: str, like: ast.Call | None = None) -> str:
    """Return the call of `uniform` by what the file imports and calls in another draw; empty if it imports neither."""
    owner = like.func.value if like is not None and isinstance(like.func, ast.Attribute) else None
    made_by = value_of(source, owner)
    generator = isinstance(made_by, ast.Call) and source.resolved(made_by.func) in _GENERATORS
    if owner is not None and (generator or source.resolved(owner) in ("random", "numpy.random")):
        return f"{chain(owner)}.uniform({low}, {high})"
    meant = ("random.uniform", "numpy.random.uniform")
    function = next((name for name, dotted in source.aliases.items() if dotted in meant), "")
    module = next((name for name, dotted in source.aliases.items() if dotted == "random"), "")
    if function or "random" in source.stars:
        return f"{function or 'uniform'}({low}, {high})"
    return f"{module}.uniform({low}, {high})" if module else ""


def uniform_call(source: Source, low: str, high: str, like: ast.Call | None = None) -> str:
    """Return the call of `uniform` that a file can make, followed by the import that it lacks."""
    own = own_uniform(source, low, high, like)
    if own or not any(dotted.startswith("random.") for dotted in source.aliases.values()):
        return own or f"random.uniform({low}, {high})"
    return f"uniform({low}, {high}), and import it with from random import uniform"


#: Maximum number of publishers, subscriptions or timers examined, of each kind.
MOST_MADE = 20


@dataclass(frozen=True, slots=True)
class Made:
    """A publisher, subscription or timer that the text creates.

    Attributes:
        kind: `publisher`, `subscription` or `timer`.
        type: Last part of the message type's name; empty if unknown.
        topic: Topic as written; None if it cannot be read from the text.
        qos: The depth or profile argument.
    """

    kind: str
    call: ast.Call
    type: str = ""
    topic: str | None = None
    callback: ast.expr | None = None
    period: ast.expr | None = None
    qos: ast.expr | None = None


def made(source: Source, *kinds: str) -> list[Made]:
    """Return the publishers, subscriptions or timers of a file, those of a kind in the order of the text."""
    return [_made(source, k, call) for k in kinds for call in islice(source.calls(f"create_{k}"), MOST_MADE)]


def _made(source: Source, kind: str, call: ast.Call) -> Made:
    if kind == "timer":
        period, callback = argument(call, 0, "timer_period_sec"), argument(call, 1, "callback")
        return Made(kind, call, period=period, callback=callback)
    type_, topic = argument(call, 0, "msg_type"), text_in_code(source, argument(call, 1, "topic"))
    callback = argument(call, 2, "callback") if kind == "subscription" else None
    qos = argument(call, 3 if kind == "subscription" else 2, "qos_profile")
    return Made(kind, call, last_name(type_), topic, callback, qos=qos)


def text_in_code(source: Source, node: ast.expr | None, depth: int = 0) -> str | None:
    """Return the text of a literal, or of a name that is assigned a literal."""
    literal = literal_text(node)
    if literal is not None or node is None or depth > 3:
        return literal
    if isinstance(node, ast.Name):
        values = [s.value for s in bindings(source, node.id) if isinstance(s, ast.Assign)]
    elif isinstance(node, ast.Attribute):
        around = [source.parents.get(n) for n in source.stores(chain(node))]
        values = [s.value for s in around if isinstance(s, ast.Assign)]
    else:
        return None
    return text_in_code(source, values[0], depth + 1) if len(values) == 1 else None


def text_origin(source: Source, node: ast.expr | None, otherwise: ast.AST) -> ast.AST:
    """Return the literal of a text, also of one that has a name; `otherwise` if the text does not show it."""
    for _ in range(3):
        if literal_text(node) is not None and node is not None:
            return node
        value = value_of(source, node)
        node = value if isinstance(value, ast.expr) else None
    return otherwise


def goes_to(written: str | None, topic: str) -> bool:
    """Return whether a topic as written may be this one on the wire; a namespace may be prepended."""
    if not written:
        return False
    bare = written.removeprefix("~").strip("/")
    return topic == written or topic.endswith(f"/{bare}")


def elsewhere_because(written: str | None, wanted: str) -> str:
    """Return why a name as written became another one on the wire, as the end of a hint; empty if it did not."""
    if written is not None and written.startswith("~"):
        return "; ~ stands for the name of the node"
    if written is not None and written.strip("/") == wanted.strip("/"):
        return "; the node's namespace is put before the name"
    return ""


def made_for(source: Source, kind: str, topic: str, type_: str = "") -> Made | None:
    """Return the publisher or subscription of a topic; the only one of its type if no topic can be read."""
    everything = made(source, kind)
    on_topic = [m for m in everything if goes_to(m.topic, topic)]
    if len(on_topic) > 1 and type_:
        on_topic = [m for m in on_topic if m.type == type_] or on_topic
    if on_topic:
        return on_topic[0]
    unknown = [m for m in everything if m.topic is None and m.type == type_]
    return unknown[0] if len(unknown) == 1 else None


def target_of(source: Source, call: ast.AST) -> str:
    """Return the dotted name that a value is directly assigned to; empty if there is none."""
    statement = source.parents.get(call)
    if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
        return chain(statement.targets[0])
    return chain(statement.target) if isinstance(statement, ast.AnnAssign) else ""


def roots(source: Source, callback: ast.expr | None) -> Sequence[ast.AST]:
    """Return the functions or lambdas that a callback argument refers to; empty if unknown."""
    if isinstance(callback, ast.Lambda):
        return [callback]
    if isinstance(callback, ast.Call) and last_name(callback.func) == "partial" and callback.args:
        return roots(source, callback.args[0])
    found = source.functions(last_name(callback)) if isinstance(callback, (ast.Name, ast.Attribute)) else []
    return found if len(found) == 1 else _of_same_class(source, callback, found)


def _of_same_class(source: Source, callback: ast.expr | None, found: Sequence[Function]) -> Sequence[ast.AST]:
    owner = source.class_of(callback) if callback is not None else None
    return [f for f in found if owner is not None and source.class_of(f) is owner][:1]


def reached(source: Source, start: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """Yield every node that may run when these functions run, including calls to functions of the file."""
    seen: set[ast.AST] = set()
    waiting = list(start)
    while waiting:
        function = waiting.pop(0)
        if function in seen:
            continue
        seen.add(function)
        for node in subtree(function):
            yield node
            if isinstance(node, ast.Call) and isinstance(node.func, (ast.Name, ast.Attribute)):
                waiting.extend(roots(source, node.func))


def names_called(source: Source, start: Sequence[ast.AST]) -> set[str]:
    """Return the names of all functions and methods that may be called when these functions run."""
    return {last_name(n.func) for n in reached(source, start) if isinstance(n, ast.Call)}


def runs(source: Source, item: Made) -> list[ast.AST]:
    """Return every node that may run in the callback of a subscription or timer."""
    return list(reached(source, roots(source, item.callback)))


def callback_nodes(source: Source) -> list[ast.AST]:
    """Return every node that may run in a callback of a timer, a subscription or a service."""
    found = [n for m in made(source, "timer", "subscription") for n in runs(source, m)]
    servers = [argument(c, 2, "callback") for c in islice(source.calls("create_service"), MOST_MADE)]
    return found + [n for callback in servers for n in reached(source, roots(source, callback))]


@dataclass(frozen=True, slots=True)
class Pause:
    """A `time.sleep` that holds callbacks up.

    Attributes:
        call: The sleep.
        seconds: How long it takes; None if the text does not show it.
        spun: The `spin_once` of the loop that it stands in; None if it stands in a callback.
    """

    call: ast.Call
    seconds: float | None
    spun: ast.Call | None = None

    def hint(self, source: Source, held: str = "every callback of the node") -> str:
        """Return what it does, and what to do.

        Args:
            source: Its file.
            held: What it holds up.
        """
        code = source.code(self.call, 50)
        if self.spun is None:
            name = source.function_name(self.call) or "the callback"
            return f"{code} in {name} holds up {held}: remove it"
        node = self.spun.args[0] if self.spun.args else None
        given = source.code(node, 30) if node is not None else "node"
        return f"{code} beside spin_once holds up {held}: call rclpy.spin({given}) in place of the loop"


def pauses(source: Source) -> list[Pause]:
    """Return the sleeps that hold callbacks up: those in a callback, and those beside `spin_once` in a loop."""
    found: dict[ast.Call, Pause] = {}
    for node in callback_nodes(source):
        if _sleeps(node, source):
            found.setdefault(node, Pause(node, number_in_code(source, argument(node, 0, "secs"))))
    for loop in source.loops():
        inside = list(reached(source, [loop]))
        spun = next((n for n in inside if isinstance(n, ast.Call) and last_name(n.func) == "spin_once"), None)
        for node in inside if spun is not None else ():
            if _sleeps(node, source):
                found.setdefault(node, Pause(node, number_in_code(source, argument(node, 0, "secs")), spun))
    return sorted(found.values(), key=lambda pause: first_line(pause.call))


def _sleeps(node: ast.AST, source: Source) -> TypeGuard[ast.Call]:
    if not isinstance(node, ast.Call) or not (node.args or node.keywords):
        return False
    return chain(node.func) in ("time.sleep", "sleep") or source.resolved(node.func) == "time.sleep"


@dataclass(frozen=True, slots=True)
class Switch:
    """A comparison with a number, turned so that the number is on the right."""

    node: ast.Compare
    op: ast.cmpop
    limit: Constant
    tested: ast.expr


#: Comparison -> the same one with its sides exchanged.
_TURNED: dict[type[ast.cmpop], type[ast.cmpop]] = {ast.Gt: ast.Lt, ast.GtE: ast.LtE, ast.Lt: ast.Gt, ast.LtE: ast.GtE}
ORDERS = tuple(_TURNED)
#: Largest difference of a number from a limit that it is taken for.
_SAME_LIMIT = 1e-6


def switches(source: Source, limit: float | None = None) -> list[Switch]:
    """Return the comparisons of something with a number that the text shows, with that limit if one is given."""
    found = []
    for node in source.all(ast.Compare):
        if len(node.ops) != 1:
            continue
        left, right = constant_value(source, node.left), constant_value(source, node.comparators[0])
        op: ast.cmpop = node.ops[0]
        if right is not None and left is None and isinstance(op, ORDERS):
            found.append(Switch(node, op, right, node.left))
        elif left is not None and right is None and isinstance(op, ORDERS):
            found.append(Switch(node, _TURNED[type(op)](), left, node.comparators[0]))
    return [s for s in found if limit is None or abs(s.limit.value - limit) <= _SAME_LIMIT]


def text_comparisons(source: Source, nodes: Iterable[ast.AST]) -> list[ast.Compare]:
    """Return the comparisons among nodes that compare with a number in quotes, letter by letter."""
    found = []
    for node in nodes:
        if not isinstance(node, ast.Compare) or len(node.ops) != 1 or not isinstance(node.ops[0], ORDERS):
            continue
        texts = [text_in_code(source, side) for side in (node.left, node.comparators[0])]
        if any(text is not None and text.strip().replace(".", "", 1).isdigit() for text in texts):
            found.append(node)
    return found


def names_in(node: ast.AST) -> set[str]:
    """Return the dotted names in a node, without `self` itself."""
    return {chain(n) for n in ast.walk(node) if isinstance(n, (ast.Name, ast.Attribute))} - {"self", ""}


def is_log(source: Source, node: ast.AST) -> bool:
    """Return whether a node is a call of an rclpy logger, as far as the text shows."""
    if not isinstance(node, ast.Call) or last_name(node.func) not in LOG_METHODS:
        return False
    base = chain(node.func).rpartition(".")[0]
    named = base.rpartition(".")[2].strip("_").lower() in ("logger", "log")
    return "get_logger()" in base or (named and base not in python_loggers(source))


def python_loggers(source: Source) -> set[str]:
    """Return the names of loggers of Python's logging module."""
    found = (target_of(source, c) for c in islice(source.calls("getLogger"), MOST_MADE))
    return {"logging", *found} - {""}


def publish_calls(source: Source, publisher: Made | None = None) -> list[ast.Call]:
    """Return the calls that publish, through one publisher if it has a name, or all."""
    calls = [c for c in source.calls("publish") if isinstance(c.func, ast.Attribute)]
    if publisher is None or len(made(source, "publisher")) < 2:
        return calls
    name = target_of(source, publisher.call).rpartition(".")[2]
    return [c for c in calls if isinstance(c.func, ast.Attribute) and last_name(c.func.value) == name]


def used(source: Source, function: Function) -> bool:
    """Return whether a function's name is used outside of it."""
    inside = set(subtree(function))
    names = (n for n in source.names() if last_name(n) == function.name and n not in inside)
    listed = any(literal_text(n) == function.name for n in source.all(ast.Constant))
    return listed or any(isinstance(n.ctx, ast.Load) for n in names)


def has_no_caller(source: Source, function: Function) -> bool:
    """Return whether nothing calls a function: neither the file nor, by its name, Python, ROS or a base class."""
    owner = source.class_of(function)
    plain = owner is None or all(last_name(b) in ("Node", "object") for b in owner.bases)
    named = function.name.startswith("__") or function.name == "main" or function.decorator_list
    return plain and not named and not used(source, function)


def conditions(source: Source, call: ast.AST) -> list[ast.If]:
    """Return the conditions of a call: those around it, and earlier ones that return."""
    function = source.function_of(call)
    around = list(source.around(call, ast.If))
    returns = (r for r in source.all(ast.Return) if source.function_of(r) is function)
    return [*around, *(n for r in returns if first_line(r) < first_line(call) for n in source.around(r, ast.If))]


def changes(source: Source, test: ast.expr) -> bool:
    """Return whether a condition uses a name that functions other than `__init__` and `main` assign."""
    stores = (s for name in names_in(test) for s in source.stored.get(name, ()))
    return any(source.function_name(s) not in ("", "__init__", "main") for s in stores)


def is_flag(test: ast.expr) -> bool:
    """Return whether a condition tests only one name: `x`, `not x`, `x is None` or `x == False`."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        test = test.operand
    if isinstance(test, ast.Compare) and len(test.comparators) == 1:
        other = test.comparators[0]
        plain = isinstance(other, ast.Constant) and (other.value is None or isinstance(other.value, bool))
        return plain and isinstance(test.left, (ast.Name, ast.Attribute))
    return isinstance(test, (ast.Name, ast.Attribute))


def called_only(source: Source, function: Function) -> bool:
    """Return whether a function is only called by name, and never passed on."""
    names = [n for n in source.names() if last_name(n) == function.name and isinstance(n.ctx, ast.Load)]
    return all(isinstance(c := source.parents.get(n), ast.Call) and c.func is n for n in names)


def head_of(source: Source, loop: Loop) -> str:
    """Return the first line of a loop without its colon."""
    if isinstance(loop, ast.While):
        return f"while {source.code(loop.test, 40)}"
    return f"for {source.code(loop.target, 20)} in {source.code(loop.iter, 40)}"


#: What runs callbacks beside each other, or code beside the callbacks.
_THREADS = {"Thread", "start_new_thread", "ThreadPoolExecutor", "MultiThreadedExecutor"}


def has_threads(source: Source) -> bool:
    """Return whether a program has threads, so that a callback that waits does not hold up all others."""
    return any(last_name(n) in _THREADS for n in source.names())


def spins(source: Source) -> list[ast.AST]:
    """Return the places that name a spinning function, called or passed to a thread."""
    return [n for n in source.names() if last_name(n) in SPINS]


def spun_again(source: Source, inside: Collection[ast.AST]) -> ast.Call | None:
    """Return a call among the nodes of callbacks that spins the node, which spins already; None if there is none."""
    if not any(last_name(n) == "spin" for n in source.names()):
        return None
    return next((c for c in source.calls("spin_until_future_complete", "spin_once") if c in inside), None)


def unspun_wait(source: Source) -> tuple[ast.While, str] | None:
    """Return a loop until a future is done in which nothing spins the node, and what the future is called there."""
    for loop in source.all(ast.While):
        asked = [n.func for n in ast.walk(loop.test) if isinstance(n, ast.Call) and last_name(n.func) == "done"]
        if asked and not names_called(source, [loop]) & set(SPINS):
            return loop, chain(asked[0]).removesuffix(".done") or "future"
    return None


def node_made(source: Source) -> ast.Call | None:
    """Return the call that creates the node."""
    classes = {c.name for c in source.all(ast.ClassDef) if any(last_name(b) == "Node" for b in c.bases)}
    calls = [c for c in source.all(ast.Call) if last_name(c.func) in {*classes, "create_node", "Node"}]
    return next((c for c in calls if not isinstance(source.parents.get(c), ast.ClassDef)), None)


def variable_of(source: Source, call: ast.AST, otherwise: str = "node") -> str:
    """Return the variable that a new object is assigned to, without an annotation; `otherwise` if there is none."""
    return target_of(source, call) or otherwise if isinstance(source.parents.get(call), ast.Assign) else otherwise


def node_at(source: Source, place: ast.AST) -> str:
    """Return what the node is called at a place: `self` in its own methods, elsewhere its variable."""
    function = source.function_of(place)
    if function is not None and source.is_method(function) and source.class_of(function) in source.deriving("Node"):
        return "self"
    node = node_made(source)
    seen = node is not None and source.function_of(node) in (function, None)
    return variable_of(source, node) if node is not None and seen else "node"


def spin_for(source: Source, place: ast.AST, future: str = "future") -> str:
    """Return the call that waits for a future at a place."""
    return f"rclpy.spin_until_future_complete({node_at(source, place)}, {future})"


def message_of(source: Source, item: Made | None) -> str:
    """Return what the callback of a subscription calls its message; `msg` if the text does not show it."""
    for function in roots(source, item.callback) if item is not None else ():
        names = parameters(function) if isinstance(function, (Function, ast.Lambda)) else []
        own = [n for n in names if n != "self"]
        if own:
            return own[0]
    return "msg"


def timer_code(source: Source, item: Made) -> str:
    """Return the code that creates a timer, in short."""
    period = source.code(item.period, 40) if item.period is not None else "?"
    callback = source.code(item.callback, 40) if item.callback is not None else "?"
    return f"create_timer({period}, {callback})"


def short(type_: str) -> str:
    """Return the class name of a message type."""
    return quote(type_.rpartition("/")[2], 40)


def received(source: Source, function: Function | None) -> ReceivedMessage | None:
    """Return what the callback of a subscription receives; None for any other function."""
    if function is None:
        return None
    for item in made(source, "subscription"):
        if function in roots(source, item.callback):
            names = parameters(function)
            own = names[1:] if source.is_method(function) or names[:1] == ["self"] else names
            return ReceivedMessage(own[0] if own else "", item.type, len(own), item)
    return None


@dataclass(frozen=True, slots=True)
class ReceivedMessage:
    """The message that a callback receives.

    Attributes:
        name: The first parameter; empty if there is none.
        type: Last part of the message type's name.
        count: Number of parameters, without self.
    """

    name: str
    type: str
    count: int
    item: Made


def message_classes(source: Source) -> set[str]:
    """Return the names in a file that stand for message classes and for classes of the file."""
    imported = {name for name, dotted in source.aliases.items() if ".msg." in f".{dotted}" and name[:1].isupper()}
    return imported | {c.name for c in source.all(ast.ClassDef)}


def bare_statements(source: Source) -> list[ast.Name | ast.Attribute]:
    """Return the statements that consist of a name alone, such as `rclpy.spin`, which do nothing."""
    values = (n.value for n in source.all(ast.Expr))
    return [v for v in values if isinstance(v, (ast.Name, ast.Attribute))]


def sole_assignment(source: Source, name: ast.Name) -> ast.expr | None:
    """Return the value of the only assignment to a local variable in the function of a name."""
    function = source.function_of(name)
    inside = [n for n in bindings(source, name.id) if source.function_of(n) is function]
    return _value(inside[0]) if len(inside) == 1 else None


#: Methods that return nothing, and are taken for ones that do.
_NOTHING = frozenset({"publish", "append", "sort", "extend", "update", "clear", "shuffle", "spin", "destroy_node"})


def returns_nothing(source: Source, call: ast.Call) -> bool:
    """Return whether a call gives None: of a function of the file without a value, or of a well-known method."""
    functions = source.functions(last_name(call.func))
    if functions:
        returns = [r for r in source.all(ast.Return) if r.value is not None and source.function_of(r) in functions]
        return not returns and not any(isinstance(f, ast.AsyncFunctionDef) for f in functions)
    return last_name(call.func) in (*_NOTHING, *LOG_METHODS) and isinstance(call.func, ast.Attribute)


def set_at_first_only(source: Source, counter: str) -> bool:
    """Return whether an attribute is set in the constructor alone, or a variable to a number outside of any loop."""
    stores = source.stored.get(counter, ())
    if "." in counter:
        return all(source.function_name(s) == "__init__" for s in stores)
    values = [getattr(source.parents.get(s), "value", None) for s in stores]
    plain = all(isinstance(source.parents.get(s), ast.Assign) for s in stores)
    looped = any(any(source.around(s, kind)) for s in stores for kind in (ast.While, ast.For))
    return plain and not looped and all(isinstance(value, ast.Constant) for value in values)


def shared_names(source: Source, function: Function, first: str) -> str:
    """Return the variables of the file that a function assigns as its own and others read, one of them first."""
    outside = {n for n, places in source.stored.items() if any(_of_the_file(source, place) for place in places)}
    inside = set(subtree(function))
    mine = {n.id for n in inside if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    elsewhere = {n.id for n in source.all(ast.Name) if isinstance(n.ctx, ast.Load) and n not in inside}
    declared = {name for n in inside if isinstance(n, ast.Global) for name in n.names}
    return ", ".join([first, *sorted((mine & outside & elsewhere) - declared - {first})])


def _of_the_file(source: Source, place: ast.AST) -> bool:
    return source.function_of(place) is None and source.class_of(place) is None


def stored_elsewhere(source: Source, statement: ast.Assign, kept: str, value: str) -> str:
    """Return the hint about a value that goes to a variable that nobody reads, in place of the one that is kept."""
    target = chain(statement.targets[0])
    lost = "not read" if "." in target else f"local to {source.function_name(statement)}"
    return f"{target} is {lost}, so {kept} never changes: write {kept} = {value}"


def is_read(source: Source, dotted: str) -> bool:
    """Return whether the value of a name or an attribute is used anywhere in the file."""
    return any(isinstance(n.ctx, ast.Load) and chain(n) == dotted for n in source.names())


def attributes_read(source: Source) -> set[str]:
    """Return the attributes whose values are used anywhere in the file, as `self.x`."""
    return {chain(n) for n in source.all(ast.Attribute) if isinstance(n.ctx, ast.Load)}


def names_attributes_by_text(source: Source) -> bool:
    """Return whether the file reads or sets attributes by names that its text need not show."""
    return "getattr" in source.called or "setattr" in source.called


def time_since(source: Source, test: ast.expr) -> ast.BinOp | None:
    """Return `now - self.last` of a condition, also through a local variable; None if it compares no such time."""
    local = [v for n in ast.walk(test) if isinstance(n, ast.Name) and (v := sole_assignment(source, n)) is not None]
    for node in (n for tree in (test, *local) for n in ast.walk(tree)):
        last = chain(node.right) if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub) else ""
        if isinstance(node, ast.BinOp) and last.startswith("self.") and last.count(".") == 1:
            return node
    return None


def spin_timeout(call: ast.Call) -> ast.expr | None:
    """Return the timeout of spin_once: a function of rclpy that takes the node first, or a method of an executor."""
    return argument(call, 2 if chain(call.func) in ("rclpy.spin_once", "spin_once") else 0, "timeout_sec")


def waits_for_ever(source: Source, call: ast.Call) -> bool:
    """Return whether a call is a spin_once that returns only when something has woken the node."""
    if last_name(call.func) != "spin_once" or any(keyword.arg is None for keyword in call.keywords):
        return False
    given = value_of(source, spin_timeout(call))
    return given is None or (isinstance(given, ast.Constant) and given.value is None)


def value_of(source: Source, node: ast.AST | None) -> ast.AST | None:
    """Return the expression that a name stands for if it is assigned exactly once; otherwise the node itself."""
    if isinstance(node, (ast.Name, ast.Attribute)):
        return _only_assignment(source, node) or node
    return node


def unformatted_fields(text: str) -> list[str]:
    """Return the values that a text would show if it were an f-string, as it names them."""
    return [m["value"] for m in _FIELD.finditer(text)]
