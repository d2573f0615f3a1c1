"""Causes behind exceptions from values and names: wrong types in fields, slips of the pen, nobody at the keyboard."""

from __future__ import annotations

import ast

from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.names import FIELDS, LOGGER, MESSAGE_FIELDS, NODE_METHODS, PUBLISHER, RCLPY, closest
from grader.judging.diagnosis.wiring import made, target_of
from grader.judging.source import Source, chain, last_name, subtree


def _wrong_field_type(case: Case) -> Clue | None:
    found = case.said(r"The '(\w+)' field must be (?:of type '(\w+)'|a sub message of type '(\w+)')")
    if found is None:
        return None
    field, type_, message = found[1], found[2] or "", found[3] or ""
    value, target = _given(case, field)
    if message:
        inner = ", ".join(MESSAGE_FIELDS.get(message, ())) or "fields"
        return Clue(f"{target.removesuffix(' = ') or field} is a {message}: set its own {inner} one by one")
    if type_ != "float":
        other = {"int": "a whole number", "str": "text", "bool": "True or False"}.get(type_)
        written = case.source.code(value, 40) if value is not None and case.source is not None else "..."
        return Clue(f"the field {field} takes {other}: write {target}{type_}({written})") if other else None
    if value is None or case.source is None:
        return Clue(f"the field {field} takes a float: write 0.5 or 0.0, or float(...) around a variable")
    return _not_a_float(case.source, value, target)


def _not_a_float(source: Source, value: ast.expr, target: str) -> Clue:
    if isinstance(value, ast.Tuple) and len(value.elts) == 1:
        number = source.code(value.elts[0])
        return Clue(f"the comma at the end makes it a tuple: write {target}{number} without the comma", key="tuple")
    written = source.code(value, 40)
    if _is_whole(value):
        return Clue(f"{written} is a whole number, the field takes a float: write {target}{written}.0")
    return Clue(f"the field takes a float only: write {target}float({written})")


def _given(case: Case, field: str) -> tuple[ast.expr | None, str]:
    """Return the value that a field is given at the fault, and what stands before it, such as `msg.x = `."""
    if case.faulty is None:
        return None, ""
    fault, source = case.faulty
    for statement in source.on_line(fault.line, ast.Assign):
        for target in statement.targets:
            if isinstance(target, ast.Attribute) and target.attr == field:
                return statement.value, f"{source.code(target)} = "
    keywords = [k for c in source.on_line(fault.line, ast.Call) for k in c.keywords if k.arg == field]
    chosen = next((k for k in keywords if _is_whole(k.value)), keywords[0] if len(keywords) == 1 else None)
    return (chosen.value, f"{field}=") if chosen is not None else (None, "")


def _is_whole(value: ast.expr | None) -> bool:
    if isinstance(value, ast.UnaryOp):
        value = value.operand
    return isinstance(value, ast.Constant) and type(value.value) is int


def _published_wrongly(case: Case) -> Clue | None:
    wrong = case.said(r"Expected <class '([\w.]+)\.(\w+)'>, got <class '([\w.]+)'>")
    if wrong is None:
        lacks = case.said(r"Publisher\.publish\(\) missing 1 required positional argument")
        return Clue("publish takes the message to send: publish(msg)") if lacks else None
    expected, got = wrong[2], wrong[3].rpartition(".")[2]
    if got == f"Metaclass_{expected}":
        return Clue(f"{expected} is the class; publish an object of it: {expected}()")
    return Clue(f"this publisher sends {expected} objects, not {got}: make one, set its fields and publish it")


def _undeclared_parameter(case: Case) -> Clue | None:
    found = case.said(r"undeclared parameter\(s\): ([\w./]+)")
    if found is None:
        return None
    return Clue(f"declare the parameter first, in __init__: self.declare_parameter('{found[1][:60]}', default_value)")


def _wrong_attribute(case: Case) -> Clue | None:
    found = case.said(r"^AttributeError: '(\w+)' object has no attribute '(\w+)'")
    if found is None:
        module = case.said(r"^AttributeError: module 'rclpy' has no attribute '(\w+)'")
        return _rclpy_name(module[1]) if module else None
    owner, name = found[1], found[2]
    if owner in ("function", "method") and name in LOGGER:
        return Clue(f"get_logger is a method, call it: self.get_logger().{name}(...)")
    if owner in ("Publisher", "RcutilsLogger"):
        near = closest(name, PUBLISHER if owner == "Publisher" else LOGGER)
        return Clue(f"{name} should be {near}") if near else None
    return _message_field(owner, name) or _own_attribute(case, owner, name)


def _message_field(owner: str, name: str) -> Clue | None:
    if (owner, name) in FIELDS:
        return Clue(f"a {owner} has no {name}; in the message it is {FIELDS[owner, name]}")
    if owner not in MESSAGE_FIELDS:
        return None
    near = closest(name, MESSAGE_FIELDS[owner], 0.6)
    return Clue(f"{name} should be {near}" if near else f"a {owner} has {', '.join(MESSAGE_FIELDS[owner])}, no {name}")


def _rclpy_name(name: str) -> Clue | None:
    if name == "Node":
        return Clue("Node is in rclpy.node: from rclpy.node import Node, then class ...(Node)")
    near = closest(name, RCLPY)
    return Clue(f"rclpy.{name} should be rclpy.{near}") if near else None


def _own_attribute(case: Case, owner: str, name: str) -> Clue | None:
    """A misspelt attribute of the student's own node, or one that was made a local variable."""
    if case.faulty is None or not any(c.name == owner for c in case.faulty[1].all(ast.ClassDef)):
        return None
    fault, source = case.faulty
    items = [m for kind in ("publisher", "subscription", "timer") for m in made(source, kind)]
    local = next((m for m in items if target_of(source, m.call) == name), None)
    if local is not None:
        hint = f"{name} is a variable of {_name_of(source, local.call)} only: write self.{name} = ..."
        return Clue(hint, source.place(local.call))
    publishers = [t for m in items if m.kind == "publisher" and (t := target_of(source, m.call)).startswith("self.")]
    if f"self.{name}.publish(" in source.line(fault.line) and len(publishers) == 1:
        return Clue(f"the publisher is called {publishers[0]}: write {publishers[0]}.publish(...)")
    stored = [
        n.attr for n in source.all(ast.Attribute) if chain(n) == f"self.{n.attr}" and isinstance(n.ctx, ast.Store)
    ]
    methods = [f.name for f in source.functions() if source.is_method(f) and not f.name.startswith("__")]
    near = closest(name, [*stored, *methods], 0.8) or closest(name, NODE_METHODS, 0.85)
    return Clue(f"self.{name} should be self.{near}") if near else None


def _name_of(source: Source, node: ast.AST) -> str:
    function = source.function_of(node)
    return function.name if function is not None else "the file"


def _with_init(case: Case) -> Clue | None:
    """`with rclpy.init():`, which later releases of rclpy know."""
    if case.faulty is None or not case.said(r"does not support the context manager|__enter__"):
        return None
    fault, source = case.faulty
    for block in source.on_line(fault.line, ast.With):
        first = block.items[0].context_expr
        if isinstance(first, ast.Call) and chain(first.func) == "rclpy.init":
            hint = "this release of rclpy does not know 'with rclpy.init()': call rclpy.init() on a line of its own"
            return Clue(hint, source.place(block))
    return None


def _logger_arguments(case: Case) -> Clue | None:
    if case.said(r"rclpy_logging_rcutils_log\(\): incompatible function arguments"):
        return Clue("the logger takes text: put the value into an f-string, info(f'{value}')")
    found = case.said(r"RcutilsLogger\.(\w+)\(\) takes 2 positional arguments but \d+ were given")
    return Clue(f"{found[1]} takes one text: put the values into it, {found[1]}(f'... {{value}}')") if found else None


def _own_raise(case: Case) -> Clue | None:
    """The student's own raise ends the node."""
    if case.faulty is None or not case.said(""):
        return None
    fault, source = case.faulty
    raised = next(source.on_line(fault.line, ast.Raise), None)
    if raised is None or source.function_at(fault.line) is None:
        return None
    return Clue(f"{source.code(raised)} ends the node: log a warning instead, and go on")


def _recursion(case: Case) -> Clue | None:
    found = case.said(r"^RecursionError") and case.faulty
    function = found[1].function_at(found[0].line) if found else None
    if not found or function is None or f" in {function.name}" not in "".join(found[0].frames[-3:]):
        return None
    named = any(last_name(n) == function.name for n in subtree(function) if isinstance(n, (ast.Name, ast.Attribute)))
    hint = f"{function.name} uses itself again and again: give what it stands for another name"
    return Clue(hint, found[1].place(function)) if named else None


def _unattended(case: Case) -> Clue | None:
    """The program waits for somebody at the keyboard, or for arguments on the command line."""
    if case.said(r"^EOFError|^termios\.error|^_?curses\.error"):
        what = "input()" if case.said("^EOFError") else "the keyboard"
        return Clue(f"nobody sits at the keyboard while the node runs: write the values down, without {what}")
    if case.faulty is None:
        return None
    fault, source = case.faulty
    if case.said(r"^IndexError") and "argv" in source.line(fault.line):
        return Clue("the file is run without arguments: give the value a default in the program")
    return None


CRASHES = (
    Cause("wrong_field_type", _wrong_field_type),
    Cause("published_wrongly", _published_wrongly),
    Cause("undeclared_parameter", _undeclared_parameter),
    Cause("wrong_attribute", _wrong_attribute),
    Cause("with_init", _with_init),
    Cause("logger_arguments", _logger_arguments),
    Cause("unattended", _unattended),
    Cause("endless_recursion", _recursion),
    Cause("own_raise", _own_raise),
)
