"""Causes behind exceptions that arise while a node is built: its base class, its endpoints, ROS itself."""

from __future__ import annotations

import ast

from grader.core.trace import Fault
from grader.judging.diagnosis.case import Case, Cause, Clue, frames, lines_of
from grader.judging.diagnosis.names import NODE_PROPERTIES, closest
from grader.judging.diagnosis.wiring import Made, made
from grader.judging.source import Source, chain, covers, first_line, last_name


def _missing_qos(case: Case) -> Clue | None:
    found = case.said(r"create_(publisher|subscription)\(\) missing \d required positional arguments?: (.*)")
    call = _call_at_fault(case, f"create_{found[1]}") if found is not None else None
    if found is None or call is None or case.source is None or not call.args:
        return None
    written, last = case.source.code(call), call.args[-1]
    if found[1] == "subscription" and isinstance(last, ast.Constant) and isinstance(last.value, int):
        return Clue(f"{written} names no callback: the third argument is the method to call, the depth comes after it")
    if "callback" in found[2] or "topic" in found[2] or not written.endswith(")"):
        return None
    return Clue(f"the queue depth is missing: {written[:-1]}, 10)")


def _call_at_fault(case: Case, *names: str) -> ast.Call | None:
    """Return the call of one of these names in the line of the fault."""
    if case.faulty is None:
        return None
    fault, source = case.faulty
    return next((c for c in source.calls(*names) if covers(c, fault.line)), None)


def _read_only_property(case: Case) -> Clue | None:
    if case.faulty is None:
        return None
    fault, source = case.faulty
    texts = r"has no setter|can't set attribute|handle cannot be modified|has no attribute 'add_node'"
    if not case.said(texts):
        return None
    for node in source.on_line(fault.line, ast.Attribute):
        if isinstance(node.ctx, ast.Store) and chain(node) == f"self.{node.attr}" and node.attr in NODE_PROPERTIES:
            return Clue(f"Node itself uses the name {node.attr}; rename yours, for example self.my_{node.attr}")
    return None


def _super_init(case: Case) -> Clue | None:
    """The constructor of Node was not called, was called too late or was misspelt."""
    if case.faulty is None:
        return None
    fault, source = case.faulty
    if case.said(r"descriptor '__init__' requires a 'super' object"):
        return Clue("super needs parentheses: super().__init__('node_name')")
    misspelt = case.said(r"'super' object has no attribute '(\w+)'")
    if misspelt and closest(misspelt[1], ("__init__",)):
        return Clue(f"{misspelt[1]} is a slip: write super().__init__('node_name')")
    if case.said(r"Node\.__init__\(\) missing 1 required positional argument: 'node_name'"):
        return _no_name(fault, source)
    return _no_base(case, fault, source) or _used_before_super(case, fault, source)


def _no_base(case: Case, fault: Fault, source: Source) -> Clue | None:
    owner = next(source.on_line(fault.line, ast.ClassDef), None)
    if owner is None or owner.bases or not case.said(r"object\.__init__\(\) takes exactly one argument"):
        return None
    return Clue(f"make it a node: class {owner.name}(Node):", source.place(owner))


def _no_name(fault: Fault, source: Source) -> Clue | None:
    calls = list(source.on_line(fault.line, ast.Call))
    if any(chain(c.func) == "super().__init__" for c in calls):
        return Clue(f"give the node a name: super().__init__('{fault.process.removesuffix('.py')}')")
    made_here = {last_name(c.func) for c in calls}
    for function in source.functions():
        owner = source.parents.get(function)
        slip = function.name != "__init__" and function.name.strip("_").lower() in ("init", "int", "inti", "ini")
        if slip and isinstance(owner, ast.ClassDef) and owner.name in made_here:
            hint = f"{function.name} is never called: the constructor's name is __init__"
            return Clue(f"{hint}, two underscores on each side", source.place(function))
    return None


def _used_before_super(case: Case, fault: Fault, source: Source) -> Clue | None:
    missing = case.said(r"'(\w+)' object has no attribute '(_\w+)'")
    where = frames(fault)
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
    if first_line(calls[0]) > fault.line:
        hint = f"{source.code(calls[0])} must come first: before it, the node cannot be used in line {fault.line}"
        return Clue(hint, source.place(calls[0]))
    return None


def _init_order(case: Case) -> Clue | None:
    if case.faulty is None:
        return None
    fault, source = case.faulty
    inits = [c for c in source.calls("init") if chain(c.func) in ("rclpy.init", "init")]
    if case.said(r"init\(\) must only be called once"):
        others = [c for c in inits if first_line(c) != fault.line]
        again = f" and in {lines_of(*others)}" if others else ""
        return Clue(f"rclpy.init() may be called once only; it is called here{again}: remove one of them")
    if not case.said(r"NotInitializedException|rclpy\.init\(\) has not been called"):
        return None
    used = next((line for line, name in reversed(frames(fault)) if name != "__init__"), fault.line)
    if not inits:
        at = next((c for c in source.on_line(used, ast.Call) if first_line(c) == used), None)
        hint = f"call rclpy.init() before line {used}: nothing of ROS works without it"
        return Clue(hint, source.place(at) if at is not None else None)
    return _init_elsewhere(source, inits, used)


def _init_elsewhere(source: Source, inits: list[ast.Call], used: int) -> Clue | None:
    """Return that ROS was started after line `used`, or ended before it, in the same function."""
    here = source.function_at(used)
    late = [c for c in inits if first_line(c) > used and source.function_of(c) is here]
    if late and len(late) == len(inits):
        hint = f"{source.code(late[0])} comes too late: the node is made before it, in line {used}"
        return Clue(hint, source.place(late[0]))
    stops = [c for c in source.calls("shutdown", "try_shutdown") if first_line(c) < used]
    if stops and source.function_of(stops[-1]) is here:
        return Clue(f"{source.code(stops[-1])} has ended ROS before line {used}", source.place(stops[-1]))
    return None


def _endpoint_arguments(case: Case) -> Clue | None:
    """Arguments of create_publisher, create_subscription or create_timer in the wrong order or of the wrong kind."""
    if case.faulty is None:
        return None
    fault, source = case.faulty
    items = (m for kind in ("publisher", "subscription", "timer") for m in made(source, kind))
    item = next((m for m in items if covers(m.call, fault.line) and m.call.args), None)
    if item is None:
        return None
    return _timer_arguments(case, source, item) if item.kind == "timer" else _topic_arguments(case, source, item)


def _timer_arguments(case: Case, source: Source, item: Made) -> Clue | None:
    if not case.said(r"must be a string or a real number, not '(method|function)'|operand type.*'(method|function)'"):
        return None
    period = source.code(item.call.args[1]) if len(item.call.args) > 1 else "..."
    return Clue(f"the period comes first, then the callback: create_timer({period}, {source.code(item.call.args[0])})")


def _topic_arguments(case: Case, source: Source, item: Made) -> Clue | None:
    first = item.call.args[0]
    text_first = isinstance(first, ast.Constant) and isinstance(first.value, str)
    if text_first and len(item.call.args) > 1 and case.said(r"rclpy_resolve_name\(\): incompatible"):
        other = source.code(item.call.args[1])
        return Clue(f"the message type comes first, then the topic: ({other}, {source.code(first)}, ...)")
    if text_first and case.said(r"has no attribute '_TYPE_SUPPORT'"):
        return Clue(f"the message type is a class, without quotation marks: {source.code(first).strip(_QUOTES)}")
    if case.said(r"type object 'module' has no attribute '_TYPE_SUPPORT'"):
        return Clue(f"{source.code(first)} is a module; name the message class in it")
    if case.said(r"Expected QoSProfile or int") and item.qos is not None:
        return Clue(f"the queue depth is a number: write 10 instead of {source.code(item.qos)}")
    return None


_QUOTES = "\"'"


def _bad_name(case: Case) -> Clue | None:
    if case.said(r"InvalidNodeNameException"):
        return Clue("a node name holds letters, digits and underscores only")
    if case.said(r"InvalidTopicNameException"):
        return Clue("a topic name holds letters, digits, underscores and slashes only, and no part starts with a digit")
    return None


def _spun_class(case: Case) -> Clue | None:
    call = _call_at_fault(case, "spin", "spin_once")
    if call is None or case.source is None or not call.args or not case.said(r"^TypeError|^AttributeError"):
        return None
    name = last_name(call.args[0])
    if not any(c.name == name for c in case.source.all(ast.ClassDef)):
        return None
    return Clue(f"spin takes a node, {name} is the class: {name}()")


CONSTRUCTION = (
    Cause("missing_qos", _missing_qos),
    Cause("read_only_property", _read_only_property),
    Cause("super_init", _super_init),
    Cause("init_order", _init_order),
    Cause("endpoint_arguments", _endpoint_arguments),
    Cause("bad_name", _bad_name),
    Cause("spun_class", _spun_class),
)
