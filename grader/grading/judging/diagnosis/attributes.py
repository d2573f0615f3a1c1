"""Causes of attributes that do not exist: of modules, messages, publishers, and of the student's own node."""

from __future__ import annotations

import ast
import re

from grader.grading.judging.diagnosis.names import (
    FIELDS,
    FUNCTIONS,
    LOG_METHODS,
    LOGGER,
    MESSAGE_FIELDS,
    NODE_METHODS,
    NODE_SLIPS,
    PUBLISHER,
    RCLPY,
    RCLPY_CLASSES,
    RCLPY_MODULES,
    ROS_1_CALLS,
    SINGLE_NUMBERS,
    article,
    closest,
    import_of,
)
from grader.grading.judging.diagnosis.rules import Case, Clue, Crash, crash_rule, hint_rule
from grader.grading.judging.diagnosis.wiring import (
    attributes_read,
    called_only,
    made,
    message_classes,
    names_attributes_by_text,
    received,
    returns_nothing,
    target_of,
    used,
)
from grader.grading.judging.source import Function, Source, chain, covers, first_line, last_name, parameters

#: Classes of rclpy -> their methods.
_METHODS = {
    "Publisher": PUBLISHER,
    "RcutilsLogger": LOGGER,
    "Client": ("call", "call_async", "wait_for_service", "service_is_ready", "remove_pending_request", "destroy"),
    "Timer": ("cancel", "reset", "is_canceled", "is_ready", "destroy", "time_until_next_call"),
    "Future": ("result", "done", "cancel", "cancelled", "exception", "add_done_callback", "set_result"),
}


@crash_rule(
    r"'(?:property|member_descriptor|getset_descriptor)' object|^AttributeError: type object '(\w+)' has no",
    priority=6010,
)
def _class_for_object(crash: Crash) -> Clue | None:
    """`msg = Twist` names the class; an object of it is needed."""
    source, classes = crash.source, message_classes(crash.source)
    on_line = [n for n in source.on_line(crash.line, ast.Name) if first_line(n) == crash.line]
    for name in on_line:
        for store in source.stored.get(name.id, ()):
            statement = source.parents.get(store)
            value = statement.value if isinstance(statement, ast.Assign) else None
            if isinstance(value, (ast.Name, ast.Attribute)) and last_name(value) in classes:
                code = source.code(value, 40)
                hint = f"{code} is the class: write {name.id} = {code}() to create an object"
                return Clue(hint, source.place(store))
    direct = next((n for n in on_line if n.id in classes and isinstance(source.parents.get(n), ast.Attribute)), None)
    if direct is None:
        return None
    return Clue(f"{direct.id} is the class: create an object first, msg = {direct.id}(), and use msg instead")


@crash_rule(
    r"^AttributeError: 'dict' object has no attribute '\w+'|^AttributeError: 'MessageInfo' object has no", priority=6020
)
def _message_info(crash: Crash) -> Clue | None:
    """A callback with a second parameter receives what is known about the message as well."""
    for item in made(crash.source, "subscription"):
        for function in crash.source.functions(last_name(item.callback)):
            found = received(crash.source, function)
            if found is not None and found.count == 2:
                own = "self, " if crash.source.is_method(function) else ""
                last = parameters(function)[-1]
                hint = f"the message is the first argument, and {last} is its MessageInfo: "
                return Clue(f"{hint}def {function.name}({own}{last}):", crash.source.place(function))
    return None


@crash_rule(
    r"^AttributeError: module '(\w+_(?:msgs|srvs|interfaces))(?:\.(?:msg|srv))?' has no attribute '(\w+)'",
    in_file=False,
    priority=6030,
)
def _package_attribute(crash: Crash) -> Clue | None:
    """`import geometry_msgs`, and `geometry_msgs.Twist`: the classes are one level further down."""
    package, name = crash.found.groups()
    right = import_of(name) or f"from {package}.msg import {name}"
    return Clue(f"{name} is not in {package} itself: {right}, and write just {name}")


@crash_rule(
    r"^AttributeError: 'float' object has no attribute 'data'|^AttributeError: '(?:int|str|float)' object has no",
    priority=6040,
)
def _plain_value(crash: Crash) -> Clue | None:
    """A field is set in a number or a text, where a message is meant."""
    source = crash.source
    types = {m.type for m in made(source, "publisher")} - {""}
    for node in source.on_line(crash.line, ast.Attribute):
        if not isinstance(node.ctx, ast.Store) or not isinstance(node.value, ast.Name) or len(types) != 1:
            continue
        stores = [n for n in source.stored.get(node.value.id, ()) if first_line(n) < crash.line]
        if stores:
            name, right = node.value.id, next(iter(types))
            return Clue(f"{name} is not a message here: write {name} = {right}()", source.place(stores[-1]))
    return None


@crash_rule(
    r"^AttributeError: module '(math|random|time|rclpy)' has no attribute '(\w+)'", in_file=False, priority=6050
)
def _module_attribute(crash: Crash) -> Clue | None:
    module, name = crash.found.groups()
    if module == "rclpy":
        return _rclpy_module(crash, name) or _rclpy_name(name)
    near = closest(name, FUNCTIONS[module], 0.7)
    if near:
        return Clue(f"{module}.{name} should be {module}.{near}")
    homes = [other for other, names in FUNCTIONS.items() if name in names and other != "rclpy"]
    return Clue(f"{name} is in the module {homes[0]}: write {homes[0]}.{name}") if len(homes) == 1 else None


def _rclpy_module(crash: Crash, name: str) -> Clue | None:
    """A module of rclpy that the file uses without importing it: what imports it elsewhere decides whether it works."""
    if name not in RCLPY_MODULES:
        return None
    used = [crash.source.parents.get(node) for node in _named(crash, name)]
    names = {node.attr for node in used if isinstance(node, ast.Attribute)}
    if len(names) != 1:
        return Clue(f"import rclpy does not import rclpy.{name}: write import rclpy.{name}")
    (one,) = names
    whole = f"rclpy.{name}.{one}"
    return Clue(
        f"import rclpy does not import rclpy.{name}: write from rclpy.{name} import {one}, and {one} for {whole}"
    )


def _rclpy_name(name: str) -> Clue | None:
    if name in RCLPY_CLASSES:
        used = "class ...(Node)" if name == "Node" else name
        return Clue(f"{name} is in {RCLPY_CLASSES[name]}: from {RCLPY_CLASSES[name]} import {name}, then {used}")
    if name in ROS_1_CALLS and name not in RCLPY:
        right = ROS_1_CALLS[name]
        return Clue(f"rclpy.{name} is a name of ROS 1: in ROS 2 write {right if ' ' in right else right + '(...)'}")
    near = closest(name, RCLPY)
    return Clue(f"rclpy.{name} should be rclpy.{near}") if near else None


@crash_rule(
    r"^AttributeError: '(\w+)' object has no attribute '(\w+)'|^AttributeError: '(\w+)' object attribute '(\w+)' is",
    in_file=False,
    priority=6060,
)
def _wrong_attribute(crash: Crash) -> Clue | None:
    owner, name = (crash.found[1], crash.found[2]) if crash.found[1] else (crash.found[3], crash.found[4])
    if owner in ("function", "method", "builtin_function_or_method"):
        return _of_a_function(crash, name)
    if owner in _METHODS:
        near = closest(name, _METHODS[owner])
        return Clue(f"{name} should be {near}") if near else None
    if name == "publish":
        return _published_through(crash, owner)
    return _self_second(crash) or _message_field(owner, name) or _own_attribute(crash, owner, name)


def _self_second(crash: Crash) -> Clue | None:
    """`def callback(msg, self)`: the node comes first."""
    function = crash.source.function_at(crash.line)
    names = parameters(function) if function is not None else []
    if function is None or "self" not in names[1:] or not crash.source.is_method(function):
        return None
    ordered = ["self", *(n for n in names if n != "self")]
    return Clue(f"self comes first: def {function.name}({', '.join(ordered)}):", crash.source.place(function))


def _of_a_function(crash: Crash, name: str) -> Clue | None:
    """A method is named and not called: `self.get_logger.info`."""
    if name in LOGGER:
        return Clue(f"get_logger is a method, call it: self.get_logger().{name}(...)")
    imported = _function_for_module(crash, name)
    if imported is not None:
        return imported
    for node in crash.source.on_line(crash.line, ast.Attribute):
        if node.attr == name and isinstance(node.value, (ast.Attribute, ast.Name)):
            code = crash.source.code(node.value, 40)
            return Clue(f"{code} is not called: write {code}().{name}")
    return None


def _function_for_module(crash: Crash, name: str) -> Clue | None:
    """`from time import time`, and then `time.sleep`."""
    for node in crash.source.on_line(crash.line, ast.Attribute):
        owner = node.value.id if node.attr == name and isinstance(node.value, ast.Name) else ""
        if owner in FUNCTIONS and name in FUNCTIONS[owner] and crash.source.aliases.get(owner) == f"{owner}.{owner}":
            return Clue(f"{owner} is the function {owner}.{owner} here, not the module: write import {owner}")
    return None


@crash_rule(r"^AttributeError: '(?:int|float|str|list|NoneType)' object has no attribute '(\w+)'", priority=6070)
def _hidden_by_variable(crash: Crash) -> Clue | None:
    """A variable has the name of a module."""
    source = crash.source
    for node in source.on_line(crash.line, ast.Attribute):
        owner = node.value.id if node.attr == crash.found[1] and isinstance(node.value, ast.Name) else ""
        if owner in FUNCTIONS and crash.found[1] in FUNCTIONS[owner] and source.stored.get(owner):
            hint = f"{owner} is assigned here, which hides the module {owner}: choose another name"
            return Clue(hint, source.place(source.stored[owner][0]))
    return None


def _published_through(crash: Crash, owner: str) -> Clue | None:  # noqa: PLR0911  one for each kind of owner
    """`publish` of something else than a publisher."""
    source = crash.source
    own = any(c.name == owner for c in source.all(ast.ClassDef))
    publishers = made(source, "publisher")
    names = [t for m in publishers if (t := target_of(source, m.call)).startswith("self.")]
    if owner in MESSAGE_FIELDS and len(names) == 1:
        called = [source.code(n.value) for n in _named(crash)]
        makers = [source.parents.get(m.call) for m in publishers]
        over = [n for n in source.stores(names[0]) if source.parents.get(n) not in makers]
        if names[0] in called and over:
            hint = f"{names[0]} holds the publisher, and this line replaces it: choose another name"
            return Clue(hint, source.place(over[0]))
        return Clue(f"publish is a method of the publisher: write {names[0]}.publish(...)")
    if owner == "Subscription" and len(names) == 1:
        return Clue(f"a subscription only receives: write {names[0]}.publish(...)")
    if not own:
        return None
    if not all(_is_called(source, n) for n in _named(crash)):
        return _callback_meant(crash)
    if len(names) == 1:
        return Clue(f"publish is a method of the publisher, {names[0]}: write {names[0]}.publish(...)")
    unstored = [m for m in publishers if not target_of(source, m.call).startswith("self.")]
    if len(publishers) == 1 and unstored:
        hint = "publish is a method of the publisher: store it as self.publisher, and call self.publisher.publish"
        return Clue(f"{hint}(...)", source.place(unstored[0].call))
    return None


def _named(crash: Crash, name: str = "") -> list[ast.Attribute]:
    """Return the attributes of the missing name on the line."""
    return [n for n in crash.source.on_line(crash.line, ast.Attribute) if n.attr == (name or crash.found[2])]


def _is_called(source: Source, node: ast.AST) -> bool:
    call = source.parents.get(node)
    return isinstance(call, ast.Call) and call.func is node


def _callback_meant(crash: Crash) -> Clue | None:
    """A callback that does not exist is passed on, and one method of the class is used nowhere."""
    source = crash.source
    items = made(source, "timer", "subscription")
    if not any(covers(m.call, crash.line) and last_name(m.callback) == crash.found[2] for m in items):
        return None
    methods = [f for f in source.functions() if source.is_method(f) and not f.name.startswith("__")]
    unused = [f for f in methods if not used(source, f)]
    if len(unused) == 1:
        hint = f"there is no method {crash.found[2]}: self.{unused[0].name} is not called by anything, pass that"
        return Clue(hint)
    return Clue(f"there is no method {crash.found[2]}: write def {crash.found[2]}(self) in the class")


def _message_field(owner: str, name: str) -> Clue | None:
    if name in ("get_logger", "create_publisher", "create_timer", "publish"):
        return None
    if name.startswith("__") or (owner not in MESSAGE_FIELDS and (owner, name) not in FIELDS):
        return None
    a = article(owner)
    if (owner, name) in FIELDS:
        right = FIELDS[owner, name]
        return Clue(f"{a} {owner} has no {name}; in the message it is {right}")
    near = closest(name, MESSAGE_FIELDS[owner], 0.6)
    if near:
        return Clue(f"{name} should be {near}")
    fields = ", ".join(MESSAGE_FIELDS[owner])
    called = owner.replace("_Response", " response").replace("_Request", " request")
    return Clue(f"{a} {called} has {fields}, but no {name}")


def _own_attribute(crash: Crash, owner: str, name: str) -> Clue | None:
    """A misspelt attribute of the student's node, or one that was made a local variable."""
    source = crash.source
    if not any(c.name == owner for c in source.all(ast.ClassDef)):
        return None
    outside = _outside_of_class(source, owner, name)
    if outside is not None:
        return outside
    items = made(source, "publisher", "subscription", "timer")
    local = next((m for m in items if target_of(source, m.call) == name), None)
    if local is not None:
        owned_by = source.function_name(local.call) or "the file"
        hint = f"{name} is local to {owned_by}: write self.{name} = ..."
        return Clue(hint, source.place(local.call))
    publishers = [t for m in items if m.kind == "publisher" and (t := target_of(source, m.call)).startswith("self.")]
    if f"self.{name}.publish(" in source.line(crash.line) and len(publishers) == 1:
        return Clue(f"the publisher is called {publishers[0]}: write {publishers[0]}.publish(...)")
    return (
        _of_rclpy(crash, name)
        or _misspelt(source, name)
        or _callback_meant(crash)
        or _local_only(source, owner, name)
        or _kept_nowhere(crash, owner, name)
    )


def _of_rclpy(crash: Crash, name: str) -> Clue | None:
    """`node.spin()`, `self.info(...)`: functions of rclpy, of the logger, or of another language's Node."""
    source = crash.source
    node = next((n for n in source.on_line(crash.line, ast.Attribute) if n.attr == name), None)
    owner = source.code(node.value, 30) if node is not None else "self"
    if name in ("spin", "spin_once", "shutdown", "ok", "init", "spin_until_future_complete"):
        given = owner if name.startswith("spin") else ""
        return Clue(f"{name} is a function of rclpy: write rclpy.{name}({given})")
    if name in LOG_METHODS:
        return Clue(f"{name} is a method of the logger: write {owner}.get_logger().{name}(...)")
    called = node is not None and (_is_called(source, node) or NODE_SLIPS.get(name, "").endswith("()"))
    if name in NODE_SLIPS and called and not source.stores(f"self.{name}"):
        return Clue(f"{owner}.{name} should be {owner}.{NODE_SLIPS[name]}")
    return None


def _misspelt(source: Source, name: str) -> Clue | None:
    stored = [dotted.removeprefix("self.") for dotted in source.stored if re.fullmatch(r"self\.\w+", dotted)]
    methods = [f for f in source.functions() if source.is_method(f) and not f.name.startswith("__")]
    unused = [f for f in methods if not used(source, f)]
    near = closest(name, [*stored, *(f.name for f in methods)], 0.8) or closest(name, NODE_METHODS, 0.85)
    near = near or closest(name, [f.name for f in unused], 0.7) or _doubled(name, stored)
    return Clue(f"self.{name} should be self.{near}") if near else None


def _doubled(name: str, known: list[str]) -> str:
    """Return the only known name that differs by a letter that was typed twice, or once instead of twice."""

    def single(text: str) -> str:
        return re.sub(r"(.)\1+", r"\1", text)

    near = [other for other in dict.fromkeys(known) if other != name and single(other) == single(name)]
    return near[0] if len(near) == 1 else ""


def _local_only(source: Source, owner: str, name: str) -> Clue | None:
    """A method of the class assigns a local variable of this name."""
    early = _counted_only(source, name)
    if any(source.function_name(n) == "__init__" for n in source.stores(f"self.{name}")):
        return None
    for node in source.stored.get(name, ()):
        function = source.function_of(node)
        if not early and (function is None or function.name != "__init__"):
            continue
        inside = function is not None and source.is_method(function)
        class_ = source.class_of(node)
        if function is not None and inside and class_ is not None and class_.name == owner:
            hint = f"{name} is local to {function.name}: write self.{name} = ..."
            return Clue(hint, source.place(node))
    return None


def _kept_nowhere(crash: Crash, owner: str, name: str) -> Clue | None:
    """Nothing assigns the attribute; a callback that keeps no message is the likeliest place for it."""
    source = crash.source
    if not _counted_only(source, name) or any(source.functions(name)) or "setattr" in source.called:
        return None
    if source.stores(f"self.{name}"):
        counted = source.code(source.parents[source.stores(f"self.{name}")[0]], 40)
        return Clue(f"{counted} needs an initial value: set self.{name} = 0 in __init__")
    message = received(source, source.function_at(crash.line))
    if message is not None and message.name and message.type in SINGLE_NUMBERS:
        return Clue(f"nothing sets self.{name}: the received number is {message.name}.data")
    class_ = next(c for c in source.all(ast.ClassDef) if c.name == owner)
    if any(isinstance(n, ast.Name) and n.id == name for s in class_.body for n in _targets(s)):
        return None
    found = [(f, r) for f in source.functions() if (r := received(source, f)) is not None and r.name]
    keeping = [f for f, _ in found if any(_stores_self(source, f))]
    listens = not made(source, "publisher") and not called_only(source, found[0][0]) if len(found) == 1 else False
    if listens and not keeping:
        function, message = found[0]
        hint = f"nothing sets self.{name}: set it to None in __init__, and in {function.name} to the received value, "
        return Clue(f"{hint}self.{name} = {message.name}", source.place(function))
    return Clue(f"nothing in the file sets self.{name}: set it in __init__, self.{name} = ...")


def _counted_only(source: Source, name: str) -> bool:
    """Return whether an attribute is never assigned, but at most changed with `+=` and the like."""
    return all(isinstance(source.parents.get(n), ast.AugAssign) for n in source.stores(f"self.{name}"))


def _targets(statement: ast.stmt) -> list[ast.expr]:
    if isinstance(statement, ast.Assign):
        return statement.targets
    return [statement.target] if isinstance(statement, ast.AnnAssign) else []


def _stores_self(source: Source, function: Function) -> list[str]:
    """Return the attributes that a function assigns."""
    dotted = [name for name in source.stored if name.startswith("self.")]
    return [name for name in dotted if any(source.function_of(n) is function for n in source.stores(name))]


def _outside_of_class(source: Source, owner: str, name: str) -> Clue | None:
    """The method is there, but it is indented too little or too much."""
    functions = source.functions(name)
    if len(functions) != 1 or source.is_method(functions[0]):
        return None
    function, around = functions[0], source.function_of(functions[0])
    if around is not None:
        hint = f"{name} is indented into {around.name}: dedent its def to the level of def {around.name}"
        return Clue(hint, source.place(function)) if source.is_method(around) else None
    if parameters(function)[:1] == ["self"]:
        hint = f"{name} is outside the class {owner}: indent it like the other methods"
        return Clue(hint, source.place(function))
    return Clue(f"{name} is a function of the file, not a method of {owner}: write {name}(...) without self")


@crash_rule(r"^AttributeError: 'NoneType' object has no attribute '(\w+)'", priority=6080)
def _result_of_nothing(crash: Crash) -> Clue | None:
    """A variable holds the result of a function that returns nothing."""
    source = crash.source
    for call in source.on_line(crash.line, ast.Call):
        owner = chain(call.func.value) if isinstance(call.func, ast.Attribute) else ""
        if owner and target_of(source, call) == owner and returns_nothing(source, call):
            code = source.code(call, 50)
            return Clue(f"{code} changes the list and returns nothing: write {code} alone, without {owner} =")
    for node in source.on_line(crash.line, ast.Attribute):
        if node.attr != crash.found[1] or not isinstance(node.value, ast.Name):
            continue
        stores = [n for n in source.stored.get(node.value.id, ()) if first_line(n) <= crash.line]
        statement = source.parents.get(stores[-1]) if stores else None
        value = statement.value if isinstance(statement, ast.Assign) else None
        if isinstance(value, ast.Call) and returns_nothing(source, value):
            hint = f"{source.code(value, 50)} returns nothing, so {node.value.id} is None: "
            own = source.functions(last_name(value.func))
            hint += f"end {own[0].name} with return" if own else f"keep the object itself in {node.value.id}"
            return Clue(hint, source.place(value))
    return None


@hint_rule(priority=6090)
def _stored_as_another(case: Case) -> Clue | None:
    """A callback stores a value under a misspelled name, and the attribute that is read keeps its first value."""
    for source in case.sources.values():
        if names_attributes_by_text(source):
            continue
        own = [dotted for dotted in source.stored if re.fullmatch(r"self\.\w+", dotted)]
        read = attributes_read(source)
        late = {d: [n for n in source.stores(d) if source.function_name(n) != "__init__"] for d in own}
        never_late = [d.removeprefix("self.") for d in own if not late[d] and d in read]
        for dotted, places in late.items():
            near = "" if dotted in read else closest(dotted.removeprefix("self."), never_late, 0.7)
            if near and len(places) == len(source.stores(dotted)):
                hint = f"nothing reads {dotted}, and self.{near} never changes: write self.{near}"
                return Clue(hint, source.place(places[0]), key=f"stored:{dotted}")
    return None
