"""Causes behind exceptions around callbacks: what is passed, what is taken, and what is not there yet or any more."""

from __future__ import annotations

import ast
import re

from grader.judging.diagnosis.case import Case, Cause, Clue, frames
from grader.judging.diagnosis.wiring import made
from grader.judging.source import Function, Source, argument, chain, covers, first_line, last_name, parameters


def _callback_called(case: Case) -> Clue | None:
    """`create_timer(0.05, self.tick())`: the function runs once, and its result is what is called back."""
    if case.faulty is None:
        return None
    fault, source = case.faulty
    result = case.said(r"not callable|callable object|callback should be either")
    for item in (*made(source, "timer"), *made(source, "subscription")):
        called = item.callback
        if not isinstance(called, ast.Call) or not _returns_nothing(source, called):
            continue
        if result or covers(item.call, fault.line):
            bare = source.code(called.func)
            hint = f"{source.code(called)} calls the function at once: pass {bare}, without the parentheses"
            return Clue(hint, source.place(item.call))
    return None


def _returns_nothing(source: Source, call: ast.Call) -> bool:
    functions = source.functions(last_name(call.func))
    returns = [r for r in source.all(ast.Return) if r.value is not None and source.function_of(r) in functions]
    return bool(functions) and not returns


def _signature(case: Case) -> Clue | None:
    """A callback that does not take what it is called with."""
    if case.faulty is None:
        return None
    source = case.faulty[1]
    return (
        _lacks_self(case, source)
        or _timed_with_message(case, source)
        or _subscription_signature(case)
        or _service_signature(case)
    )


def _lacks_self(case: Case, source: Source) -> Clue | None:
    found = case.said(r"(\w+)\(\) takes 0 positional arguments but 1 was given")
    methods = [f for f in source.functions(found[1]) if source.is_method(f)] if found else []
    if len(methods) != 1 or parameters(methods[0]):
        return None
    return Clue(f"a method takes self first: def {methods[0].name}(self):", source.place(methods[0]))


def _timed_with_message(case: Case, source: Source) -> Clue | None:
    found = case.said(r"(\w+)\(\) missing 1 required positional argument: '(\w+)'")
    functions = source.functions(found[1]) if found else []
    if (
        found is None
        or len(functions) != 1
        or not any(last_name(m.callback) == found[1] for m in made(source, "timer"))
    ):
        return None
    rest = ", ".join(p for p in parameters(functions[0]) if p != found[2])
    hint = f"a timer calls {found[1]} without arguments: def {found[1]}({rest}):"
    return Clue(hint, source.place(functions[0]))


def _subscription_signature(case: Case) -> Clue | None:
    if case.faulty is None or not case.said(r"callback should be either be callable|takes \d positional argument"):
        return None
    fault, source = case.faulty
    for item in made(source, "subscription"):
        named = case.said(rf"\b{re.escape(last_name(item.callback))}\(\) takes")
        functions = source.functions(last_name(item.callback))
        if len(functions) == 1 and (named or covers(item.call, fault.line)):
            return _too_few_parameters(source, functions[0], item.callback)
    return None


def _too_few_parameters(source: Source, function: Function, callback: ast.expr | None) -> Clue | None:
    names = parameters(function)
    bound = source.is_method(function) and isinstance(callback, ast.Attribute)
    if bound and len(names) == 1 and names != ["self"]:
        return Clue(f"self is missing: def {function.name}(self, {names[0]}):", source.place(function))
    if names not in ([], ["self"]):
        return None
    own = "self, " if bound else ""
    hint = f"the subscription hands over the message: def {function.name}({own}msg):"
    return Clue(hint, source.place(function))


def _service_signature(case: Case) -> Clue | None:
    if case.faulty is None:
        return None
    _, source = case.faulty
    for call in source.calls("create_service"):
        callback = argument(call, 2, "callback")
        functions = source.functions(last_name(callback))
        if len(functions) != 1:
            continue
        function = functions[0]
        if case.said(rf"\b{re.escape(function.name)}\(\) (takes|missing)"):
            hint = f"a service hands over request and response: def {function.name}(self, request, response):"
            return Clue(hint, source.place(function))
        empty = all(r.value is None for r in source.all(ast.Return) if source.function_of(r) is function)
        if empty and case.said(r"^TypeError$|^TypeError: *$|[Rr]esponse"):
            return Clue(f"{function.name} must end with: return response", source.place(function))
    return None


def _no_data_yet(case: Case) -> Clue | None:
    """What a callback is to store is read before the first message has come."""
    if case.faulty is None or not case.said(r"NoneType|has no attribute"):
        return None
    fault, source = case.faulty
    function = source.function_at(fault.line)
    callbacks = {last_name(m.callback) for m in made(source, "subscription")}
    if function is None or not frames(fault) or function.name in callbacks:
        return None
    for node in source.on_line(fault.line, ast.Attribute):
        name = chain(node)
        if name != f"self.{node.attr}" or not isinstance(node.ctx, ast.Load):
            continue
        stores = source.stores(name)
        stored_by = {f.name for n in stores if (f := source.function_of(n)) is not None}
        if not stored_by & callbacks:
            continue
        begin = f"begin {function.name} with: if {name} is None: return"
        if case.said("NoneType") and any(_starts_with_none(source, n) for n in stores):
            return Clue(f"{name} is None until the first message comes: {begin}")
        unset = case.said(rf"object has no attribute '{re.escape(node.attr)}'")
        if unset and "__init__" not in stored_by:
            return Clue(f"{name} is not there before the first message: set {name} = None in __init__, and {begin}")
    return None


def _starts_with_none(source: Source, store: ast.AST) -> bool:
    statement = source.parents.get(store)
    value = statement.value if isinstance(statement, (ast.Assign, ast.AnnAssign)) else None
    return isinstance(value, ast.Constant) and value.value is None


def _shut_down_early(case: Case) -> Clue | None:
    texts = r"Context must be initialized before|rcl_shutdown already called|does not support the context manager"
    if case.faulty is None or not case.said(rf"{texts}|InvalidHandle|context is (not valid|invalid)"):
        return None
    fault, source = case.faulty
    for call in source.calls("shutdown", "try_shutdown", "destroy_node", "destroy_publisher"):
        function = source.function_of(call)
        if function is not None and source.is_method(function) and function.name not in ("__del__", "destroy_node"):
            hint = f"{source.code(call)} in {function.name} ends the node while it runs: take it out"
            return Clue(hint, source.place(call))
        before = function is source.function_at(fault.line) and first_line(call) < fault.line
        if before and last_name(call.func) != "destroy_node" and "shutdown" not in source.line(fault.line):
            hint = f"{source.code(call)} comes too early: ROS has ended before line {fault.line}"
            return Clue(hint, source.place(call))
    return None


CALLBACKS = (
    Cause("callback_called", _callback_called),
    Cause("callback_signature", _signature),
    Cause("no_data_yet", _no_data_yet),
    Cause("shut_down_early", _shut_down_early),
)
