"""Causes of names that a function does not see: never assigned, local to another function, or assigned too late."""

from __future__ import annotations

import ast

from grader.grading.judging.diagnosis.names import (
    FUNCTIONS,
    NODE_METHODS,
    OTHER_SPELLINGS,
    PLAIN_MODULES,
    ROS_1,
    ROS_1_CALLS,
    SINGLE_NUMBERS,
    closest,
    import_of,
)
from grader.grading.judging.diagnosis.rules import Clue, Crash, crash_rule
from grader.grading.judging.diagnosis.wiring import made, node_made, received, shared_names, variable_of
from grader.grading.judging.source import (
    Function,
    Source,
    chain,
    covers,
    first_line,
    last_line,
    last_name,
    parameters,
    subtree,
)

_CREATE = ("create_publisher", "create_subscription", "create_service", "create_client")


@crash_rule(r"^NameError: name '(\w+)' is not defined", priority=2010)
def _undefined_name(crash: Crash) -> Clue | None:
    name, source = crash.found[1], crash.source
    inside = [f for f in source.functions() if covers(f, crash.line)]
    function = inside[-1] if inside else None
    if name == "self":
        return _no_self(crash, inside)
    return (
        _other_spelling(name)
        or _ros_1(crash, name)
        or _node_method(crash, name, function)
        or _of_a_class(source, name, inside)
        or _text_without_quotes(crash, name)
        or _imported(source, name)
        or _in_another_function(source, name, function, crash.line)
        or _stored(source, name, inside)
        or _misspelt(source, name, crash.line)
        or _class_called_otherwise(source, name, crash.line)
        or _message_number(crash, name, function)
        or _of_another_callback(source, name, function)
        or _never_assigned(source, name)
    )


def _no_self(crash: Crash, inside: list[Function]) -> Clue | None:
    source = crash.source
    lacking = next((f for f in reversed(inside) if source.is_method(f) and "self" not in parameters(f)), None)
    if lacking is not None:
        rest = "".join(f", {p}" for p in parameters(lacking))
        return Clue(f"self is missing: def {lacking.name}(self{rest}):", source.place(lacking))
    node = node_made(source)
    if inside and not any(source.is_method(f) for f in inside) and node is not None:
        name = variable_of(source, node)
        return Clue(f"self exists only in methods: in {inside[-1].name} the node is called {name}")
    return None


def _other_spelling(name: str) -> Clue | None:
    if name in OTHER_SPELLINGS:
        return Clue(f"in Python this is written {OTHER_SPELLINGS[name]}, not {name}")
    if name.strip("_") == "name":
        return Clue(f"{name} should be __name__, with two underscores on each side")
    return Clue("put it in quotes: '__main__'") if name.strip("_") == "main" and name != "main" else None


def _ros_1(crash: Crash, name: str) -> Clue | None:
    """`rospy.loginfo` in a file that does not import rospy."""
    if name not in ROS_1:
        return None
    used = [n.attr for n in crash.source.on_line(crash.line, ast.Attribute) if chain(n.value) == name]
    right = next((ROS_1_CALLS[u] for u in used if u in ROS_1_CALLS), ROS_1[name])
    return Clue(f"{name} belongs to ROS 1; this is ROS 2: use {right}")


def _node_method(crash: Crash, name: str, function: Function | None) -> Clue | None:
    """`create_timer(...)` without the node before it."""
    source = crash.source
    if name not in NODE_METHODS or source.functions(name):
        return None
    method = function is not None and source.is_method(function)
    node = node_made(source)
    owner = "self" if method else variable_of(source, node) if node is not None else "node"
    call = next((c for c in source.on_line(crash.line, ast.Call) if chain(c.func) == name), None)
    given = [source.code(a, 40) for a in call.args] if call is not None else []
    rest = ", ".join(given[1:] if given[:1] == ["self"] else given) if given else ""
    return Clue(f"{name} is a method of the node: write {owner}.{name}({rest})")


def _of_a_class(source: Source, name: str, inside: list[Function]) -> Clue | None:
    """A method is called without `self`, or is indented into a class."""
    methods = [f for f in source.functions(name) if source.is_method(f)]
    if not methods or len(methods) != len(source.functions(name)):
        return None
    if any(source.is_method(f) for f in inside):
        return Clue(f"{name} is a method: write self.{name}")
    node = node_made(source)
    if inside and node is not None:
        return Clue(f"{name} is a method of the node: write {variable_of(source, node)}.{name}")
    owner = source.class_of(methods[0])
    hint = f"{name} is indented into the class {owner.name if owner is not None else ''}: "
    return Clue(f"{hint}move its def and its body to the left margin", source.place(methods[0]))


def _text_without_quotes(crash: Crash, name: str) -> Clue | None:
    """A topic, or the name of a node, is written without quotes."""
    source = crash.source
    if name in source.stored:
        return None
    for call in source.on_line(crash.line, ast.Call):
        place = 1 if last_name(call.func) in _CREATE else 0
        named = last_name(call.func) in _CREATE or chain(call.func) == "super().__init__"
        if named and len(call.args) > place and chain(call.args[place]).partition(".")[0] == name:
            what = "a ROS name" if place else "a node name"
            return Clue(f"{what} is a string: write '{'/' * place}{name}'")
    return None


def _imported(source: Source, name: str) -> Clue | None:
    owners = [module for module, names in FUNCTIONS.items() if name in names and name != module]
    known = [module for module in owners if source.aliases.get(module) == module]
    if known:
        return Clue(f"{name} is in the module {known[0]}: write {known[0]}.{name}")
    if name in PLAIN_MODULES and any(d.startswith(f"{name}.") for d in source.aliases.values()):
        return Clue(f"the import is missing: import {name}")
    return Clue(f"the import is missing: {import_of(name)}") if import_of(name) else None


def _stored(source: Source, name: str, inside: list[Function]) -> Clue | None:
    found = bool(inside) and bool(source.stores(f"self.{name}"))
    return Clue(f"{name} is an attribute: write self.{name}") if found else None


def _in_another_function(source: Source, name: str, function: Function | None, line: int) -> Clue | None:
    """The name is a local variable of another function."""
    if function is None or source.stores(f"self.{name}"):
        return None
    stores = [n for n in source.stored.get(name, ()) if isinstance(n, ast.Name)]
    owners = [source.function_of(n) for n in stores]
    if not stores or None in owners or len(set(owners)) != 1 or owners[0] is None or owners[0] is function:
        return None
    owner = owners[0]
    if source.is_method(function) and source.is_method(owner) and source.class_of(owner) is source.class_of(function):
        hint = f"{name} is local to {owner.name}: write self.{name} here and in line {line}"
        return Clue(hint, source.place(stores[0]))
    if source.is_method(function) and name == variable_of(source, node_made(source) or owner, ""):
        return Clue(f"{name} is local to {owner.name}: inside its class the node is called self")
    return None


def _misspelt(source: Source, name: str, line: int) -> Clue | None:
    near = closest(name, _defined(source, line), 0.8)
    return Clue(f"{name} is not defined; the file has {near}") if near else None


def _class_called_otherwise(source: Source, name: str, line: int) -> Clue | None:
    """An object of a class that has another name, in a file with one class."""
    classes = [found.name for found in source.all(ast.ClassDef)]
    if len(classes) != 1 or not name[:1].isupper() or all(c.lineno != line for c in source.calls(name)):
        return None
    return Clue(f"{name} is not defined; the class is called {classes[0]}")


def _message_number(crash: Crash, name: str, function: Function | None) -> Clue | None:
    """A callback uses a name that it does not receive."""
    source, message = crash.source, received(crash.source, function)
    if message is None or function is None or not message.name or name in source.stored:
        return None
    loads = [n.id for n in subtree(function) if isinstance(n, ast.Name)]
    if name in ("msg", "message") and message.name not in loads:
        own = "self, " if source.is_method(function) else ""
        hint = f"{function.name} receives the message as {message.name}: write def {function.name}({own}{name}):"
        return Clue(hint, source.place(function))
    used = [n for n in source.on_line(crash.line, ast.Name) if n.id == name]
    whole = not any(isinstance(source.parents.get(n), ast.Attribute) for n in used)
    if message.type in SINGLE_NUMBERS and whole:
        return Clue(f"{name} is not defined in {function.name}: the received number is {message.name}.data")
    return None


def _of_another_callback(source: Source, name: str, function: Function | None) -> Clue | None:
    """Only another function has a parameter of this name, such as `msg`."""
    owners = [f for f in source.functions() if name in parameters(f)]
    if function is None or len(owners) != 1 or owners[0] is function or name in source.stored:
        return None
    owner = owners[0]
    hint = f"{name} exists only in {owner.name}: "
    if source.is_method(owner) and source.is_method(function):
        return Clue(f"{hint}store what you need there, such as self.{name} = {name}, and read that here")
    return Clue(f"{hint}pass it to {function.name}, which needs a parameter for it")


def _never_assigned(source: Source, name: str) -> Clue | None:
    if name in source.stored or name in source.aliases or source.stars or name in _defined(source, 0):
        return None
    fields = [n for n in source.all(ast.Attribute) if chain(n.value) == name and isinstance(n.ctx, ast.Store)]
    types = {m.type for m in made(source, "publisher")} - {""}
    if fields and len(types) == 1:
        return Clue(f"{name} is never created: write {name} = {next(iter(types))}() before its fields are set")
    return Clue(f"nothing in the file assigns {name}: assign it before this line, or correct the name")


def _defined(source: Source, line: int) -> list[str]:
    """Return the names that a file defines elsewhere than in a line, which is about to define its own."""
    names = [n.id for n in source.all(ast.Name) if isinstance(n.ctx, ast.Store) and n.lineno != line]
    names += [f.name for f in source.functions() if not source.is_method(f)]
    names += [c.name for c in source.all(ast.ClassDef)]
    names += [a.arg for a in source.all(ast.arg)]
    return names + [(a.asname or a.name).split(".")[0] for a in source.all(ast.alias)]


@crash_rule(
    r"^UnboundLocalError: (?:local variable|cannot access local variable) '(\w+)'"
    r"|^NameError: free variable '(\w+)'|^NameError: cannot access free variable '(\w+)'",
    priority=2020,
)
def _unbound_local(crash: Crash) -> Clue | None:
    """A function uses a local variable that has no value yet."""
    source, name = crash.source, next(filter(None, crash.found.groups()))
    function = source.function_at(crash.line)
    stores = [n for n in source.stored.get(name, ()) if source.function_of(n) is function]
    imports = [n for n in source.all(ast.alias) if (n.asname or n.name) == name and source.function_of(n) is function]
    if function is None or not stores:
        return _imported_below(source, name, imports)
    return (
        _attribute_meant(source, name, stores)
        or _global_meant(source, name, function, stores)
        or _assigned_in_branches(source, name, stores, crash.line)
        or _assigned_later(source, name, stores, crash.line)
    )


def _imported_below(source: Source, name: str, imports: list[ast.alias]) -> Clue | None:
    if len(imports) != 1 or source.function_of(imports[0]) is None:
        return None
    return Clue(f"{name} is imported here, after its first use: move the import to the top", source.place(imports[0]))


def _attribute_meant(source: Source, name: str, stores: list[ast.AST]) -> Clue | None:
    if not source.stores(f"self.{name}") or not any(isinstance(source.parents.get(n), ast.AugAssign) for n in stores):
        return None
    return Clue(f"{name} is an attribute: write self.{name}", source.place(stores[0]))


def _global_meant(source: Source, name: str, function: Function, stores: list[ast.AST]) -> Clue | None:
    outside = [n for n in source.stored.get(name, ()) if source.function_of(n) is None and source.class_of(n) is None]
    shadowed = bool(outside) or any(f.name == name for f in source.functions()) or name in source.aliases
    if outside:
        hint = f"{function.name} assigns {name}, so Python treats it as local: "
        names = shared_names(source, function, name)
        return Clue(f"{hint}begin {function.name} with: global {names}", source.place(stores[0]))
    if shadowed and first_line(stores[0]) > 0:
        hint = f"{function.name} assigns {name} here, which hides what it meant: choose another name"
        return Clue(hint, source.place(stores[0]))
    return None


def _assigned_in_branches(source: Source, name: str, stores: list[ast.AST], line: int) -> Clue | None:
    """Every assignment before the use stands under a condition, in a loop or behind something that may fail."""
    before = [n for n in stores if first_line(n) < line]
    tests = [next((o for o in source.around(n, ast.If) if last_line(o) < line), None) for n in before]
    if before and None not in tests:
        outer = tests[0]
        parent = source.parents.get(outer) if outer is not None else None
        while outer is not None and isinstance(parent, ast.If) and outer in parent.orelse:
            outer, parent = parent, source.parents.get(parent)
        if outer is not None:
            hint = f"{name} has no value if no condition from 'if {source.code(outer.test, 40)}' on is true: "
            return Clue(f"{hint}add an else, or set {name} before it", source.place(outer))
    for kind, words in ((ast.Try, "the try block fails"), (ast.For, "the loop never runs")):
        blocks = [next((o for o in source.around(n, kind) if first_line(o) < line), None) for n in before]
        if before and None not in blocks and blocks[0] is not None:
            return Clue(f"{name} has no value if {words}: set it before", source.place(blocks[0]))
    return None


def _assigned_later(source: Source, name: str, stores: list[ast.AST], line: int) -> Clue | None:
    later = [n for n in stores if first_line(n) > line]
    if not later or len(later) != len(stores):
        return None
    return Clue(f"{name} is assigned only here, after line {line} uses it: move this up", source.place(later[0]))
