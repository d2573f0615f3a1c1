"""What a file makes of ROS: its publishers, subscriptions and timers, and which code each of them leads to."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

from grader.judging.diagnosis.constants import bindings
from grader.judging.source import Function, Source, argument, chain, first_line, last_name, subtree, text_of

#: More publishers, subscriptions or timers than this are not looked at, of each kind.
MOST_MADE = 20
LOGS = ("debug", "info", "warn", "warning", "error", "fatal")


@dataclass(frozen=True, slots=True)
class Made:
    """One publisher, subscription or timer as the text makes it.

    Attributes:
        kind: `publisher`, `subscription` or `timer`.
        call: The call that makes it.
        type: Last part of the message type's name; empty if unknown.
        topic: Topic as it is written; None if the text does not tell.
        callback: What is called back.
        period: Period of a timer.
        qos: Depth or profile.
    """

    kind: str
    call: ast.Call
    type: str = ""
    topic: str | None = None
    callback: ast.expr | None = None
    period: ast.expr | None = None
    qos: ast.expr | None = None


def made(source: Source, kind: str) -> list[Made]:
    """Return the publishers, subscriptions or timers of a file, in the order of the text."""
    found = []
    for call in islice(source.calls(f"create_{kind}"), MOST_MADE):
        if kind == "timer":
            period, callback = argument(call, 0, "timer_period_sec"), argument(call, 1, "callback")
            found.append(Made(kind, call, period=period, callback=callback))
            continue
        type_, topic = argument(call, 0, "msg_type"), text(source, argument(call, 1, "topic"))
        callback = argument(call, 2, "callback") if kind == "subscription" else None
        qos = argument(call, 3 if kind == "subscription" else 2, "qos_profile")
        found.append(Made(kind, call, last_name(type_), topic, callback, qos=qos))
    return found


def text(source: Source, node: ast.expr | None, depth: int = 0) -> str | None:
    """Return the text of a literal, or of a name that is assigned one literal."""
    literal = text_of(node)
    if literal is not None or node is None or depth > 3:
        return literal
    if isinstance(node, ast.Name):
        values = [s.value for s in bindings(source, node.id) if isinstance(s, ast.Assign)]
    elif isinstance(node, ast.Attribute):
        around = [source.parents.get(n) for n in source.stores(chain(node))]
        values = [s.value for s in around if isinstance(s, ast.Assign)]
    else:
        return None
    return text(source, values[0], depth + 1) if len(values) == 1 else None


def goes_to(written: str | None, topic: str) -> bool:
    """Return whether a topic as written may be this one on the wire; namespaces may stand before it."""
    if not written:
        return False
    bare = written.removeprefix("~").strip("/")
    return topic == written or topic.endswith(f"/{bare}")


def made_for(source: Source, kind: str, topic: str, type_: str = "") -> Made | None:
    """Return what makes the publisher or subscription of a topic; the only one of its type if no topic is written."""
    everything = made(source, kind)
    on_topic = [m for m in everything if goes_to(m.topic, topic)]
    if len(on_topic) > 1 and type_:
        on_topic = [m for m in on_topic if m.type == type_] or on_topic
    if on_topic:
        return on_topic[0]
    unknown = [m for m in everything if m.topic is None and m.type == type_]
    return unknown[0] if len(unknown) == 1 else None


def target_of(source: Source, call: ast.AST) -> str:
    """Return the dotted name that a value is assigned to at once; empty if it is to none."""
    statement = source.parents.get(call)
    if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
        return chain(statement.targets[0])
    return chain(statement.target) if isinstance(statement, ast.AnnAssign) else ""


def roots(source: Source, callback: ast.expr | None) -> Sequence[ast.AST]:
    """Return the functions or lambdas that a callback argument stands for; empty if the text does not tell."""
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
    """Yield every node that may run when these functions run, through calls to functions of the file."""
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


def is_log(source: Source, node: ast.AST) -> bool:
    """Return whether a node is a call that logs through an rclpy logger, as far as the text tells."""
    if not isinstance(node, ast.Call) or last_name(node.func) not in LOGS:
        return False
    base = chain(node.func).rpartition(".")[0]
    named = base.rpartition(".")[2].strip("_").lower() in ("logger", "log")
    return "get_logger()" in base or (named and base not in python_loggers(source))


def python_loggers(source: Source) -> set[str]:
    """Return the names that stand for loggers of Python's own logging module."""
    found = (target_of(source, c) for c in islice(source.calls("getLogger"), MOST_MADE))
    return {"logging", *found} - {""}


def publish_calls(source: Source, publisher: Made | None = None) -> list[ast.Call]:
    """Return the calls that publish, through one publisher if it has a name of its own, or all."""
    calls = [c for c in source.calls("publish") if isinstance(c.func, ast.Attribute)]
    if publisher is None or len(made(source, "publisher")) < 2:
        return calls
    name = target_of(source, publisher.call).rpartition(".")[2]
    return [c for c in calls if isinstance(c.func, ast.Attribute) and last_name(c.func.value) == name]


def used(source: Source, function: Function) -> bool:
    """Return whether anything outside a function names it."""
    inside = set(subtree(function))
    names = (n for n in source.names() if last_name(n) == function.name and n not in inside)
    listed = any(text_of(n) == function.name for n in source.all(ast.Constant))
    return listed or any(isinstance(n.ctx, ast.Load) for n in names)


def conditions(source: Source, call: ast.AST) -> list[ast.If]:
    """Return what a call depends on: the conditions around it, and those before it that return early."""
    function = source.function_of(call)
    around = [n for n in source.around(call) if isinstance(n, ast.If)]
    returns = (r for r in source.all(ast.Return) if source.function_of(r) is function)
    early = [n for r in returns if first_line(r) < first_line(call) for n in source.around(r) if isinstance(n, ast.If)]
    return [*around, *early]


def changes(source: Source, test: ast.expr) -> bool:
    """Return whether a condition asks for something that the running node changes: an attribute, or a global name."""
    names = {chain(n) for n in ast.walk(test) if isinstance(n, (ast.Name, ast.Attribute))} - {"self", ""}
    stores = (s for name in names for s in source.stored.get(name, ()))
    return any((f := source.function_of(s)) is not None and f.name not in ("__init__", "main") for s in stores)


def is_flag(test: ast.expr) -> bool:
    """Return whether a condition asks for one name only: `x`, `not x`, `x is None` or `x == False`."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        test = test.operand
    if isinstance(test, ast.Compare) and len(test.comparators) == 1:
        other = test.comparators[0]
        plain = isinstance(other, ast.Constant) and (other.value is None or isinstance(other.value, bool))
        return plain and isinstance(test.left, (ast.Name, ast.Attribute))
    return isinstance(test, (ast.Name, ast.Attribute))


def called_only(source: Source, function: Function) -> bool:
    """Return whether a function is called by its name only, and never handed on for somebody else to call."""
    names = [n for n in source.names() if last_name(n) == function.name and isinstance(n.ctx, ast.Load)]
    return all(isinstance(c := source.parents.get(n), ast.Call) and c.func is n for n in names)
