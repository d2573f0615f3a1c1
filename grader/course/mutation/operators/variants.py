"""Makes correct variants of a program: the same behaviour with other names, order and style."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

import libcst as cst

from grader.course.mutation.operators import meaning
from grader.course.mutation.operators.program import (
    CREATORS,
    Candidate,
    Edit,
    ParsedProgram,
    called,
    passed_argument,
    plain_string,
    string,
)
from grader.course.mutation.operators.words import name_places


def renamed_classes(program: ParsedProgram) -> str:
    """Every class has another name."""
    names = {node.name.value for node in program.all(cst.ClassDef)}
    return _renamed(program, names, lambda name: f"My{name}")


def renamed_functions(program: ParsedProgram) -> str:
    """Every function outside classes has another name, `main` too."""
    names = {node.name.value for node in program.all(cst.FunctionDef) if program.enclosing(node, cst.ClassDef) is None}
    return _renamed(program, names, lambda name: f"run_{name}")


def renamed_methods(program: ParsedProgram) -> str:
    """Every method has another name."""
    methods = [node for node in program.all(cst.FunctionDef) if program.enclosing(node, cst.ClassDef)]
    names = {method.name.value for method in methods if not method.name.value.startswith("__")}
    edits: list[Edit] = [(m.name, cst.Name(f"do_{m.name.value}")) for m in methods if m.name.value in names]
    return program.changed([*edits, *_of_own_objects(program, names, "do_")])


def renamed_attributes(program: ParsedProgram) -> str:
    """Every attribute of the program's own objects has another name."""
    targets = [target.target for target in program.all(cst.AssignTarget)]
    names = {t.attr.value for t in targets if isinstance(t, cst.Attribute) and program.code(t.value) == "self"}
    return program.changed(_of_own_objects(program, names, "the_"))


def renamed_variables(program: ParsedProgram) -> str:
    """Every variable and every constant has another name."""
    targets = [target.target for target in program.all(cst.AssignTarget)]
    names = {target.value for target in targets if isinstance(target, cst.Name)}
    names |= {loop.target.value for loop in program.all(cst.For) if isinstance(loop.target, cst.Name)}
    names -= {node.name.value for node in program.all(cst.FunctionDef)}
    names -= {node.name.value for node in program.all(cst.ClassDef)}
    return _renamed(program, names, lambda name: f"{name}_{'X' if name.isupper() else 'x'}")


def renamed_nodes(program: ParsedProgram) -> str:
    """The node has another name."""
    edits: list[Edit] = []
    for call in program.calls("__init__", "Node", "create_node"):
        name = plain_string(call.args[0].value) if call.args else None
        if name is not None and (called(call) != "__init__" or "super" in program.code(call.func)):
            edits.append((call.args[0].value, string(f"{name}_of_mine")))
    return program.changed(edits)


def reordered_methods(program: ParsedProgram) -> str:
    """The methods of each class are in reverse order."""
    edits: list[Edit] = []
    for node in program.all(cst.ClassDef):
        methods = [part for part in node.body.body if isinstance(part, cst.FunctionDef)]
        edits += zip(methods, reversed(methods), strict=True)
    return program.changed([(old, new) for old, new in edits if old is not new])


def reordered_constants(program: ParsedProgram) -> str:
    """The constants of the file are in reverse order, unless one depends on another."""
    lines = [s for s in program.module.body if isinstance(s, cst.SimpleStatementLine)]
    plain = [s for s in lines if isinstance(s.body[0], cst.Assign) and not program.all(cst.Name, s.body[0].value)]
    return program.changed([(old, new) for old, new in zip(plain, reversed(plain), strict=True) if old is not new])


def _renamed(program: ParsedProgram, names: Iterable[str], rename: Callable[[str], str]) -> str:
    """Rename plain names, except as keyword arguments and attributes."""
    wanted = set(names) - _not_ours(program)
    edits: list[Edit] = []
    for node in program.all(cst.Name):
        above = next(program.above(node), None)
        is_attribute = isinstance(above, cst.Attribute) and above.attr is node
        is_keyword = isinstance(above, cst.Arg) and above.keyword is node
        if node.value in wanted and not is_attribute and not is_keyword:
            edits.append((node, cst.Name(rename(node.value))))
    return program.changed(edits)


def _of_own_objects(program: ParsedProgram, names: Collection[str], prefix: str) -> list[Edit]:
    """Return the edits that rename attributes of `self` and of objects of the program's own classes."""
    classes = {node.name.value for node in program.all(cst.ClassDef)}
    made = [a for a in program.all(cst.Assign) if isinstance(a.value, cst.Call) and called(a.value) in classes]
    objects = {"self", *(program.code(target.target) for assign in made for target in assign.targets)}
    return [
        (node.attr, cst.Name(f"{prefix}{node.attr.value}"))
        for node in program.all(cst.Attribute)
        if node.attr.value in names and program.code(node.value) in objects
    ]


def _not_ours(program: ParsedProgram) -> set[str]:
    """Return the names of imports and parameters."""
    names = {alias.evaluated_alias or alias.evaluated_name.split(".")[0] for alias in program.all(cst.ImportAlias)}
    return names | {parameter.name.value for parameter in program.all(cst.Param)}


#: Format specifications with the same meaning in every style.
_PLAIN = re.compile(r"(?:0?\d*(?:\.\d+)?[dfegs])?")


def single_quotes(program: ParsedProgram) -> str:
    """Strings have single quotes."""
    doubled = [
        node
        for node in program.all(cst.SimpleString)
        if node.value.startswith('"') and not node.value.startswith('"""') and "'" not in node.value
    ]
    return program.changed([(node, cst.SimpleString(f"'{node.value[1:-1]}'")) for node in doubled])


def windows_lines(program: ParsedProgram) -> str:
    """Lines end with CR LF."""
    return program.module.code.replace("\r\n", "\n").replace("\n", "\r\n")


def other_topic_form(program: ParsedProgram) -> str:
    """Absolute names of topics and services are relative, and relative ones absolute."""
    edits = [(node, string(name[1:] if name.startswith("/") else f"/{name}")) for node, name in name_places(program)]
    return program.changed([(old, new) for old, new in edits if "~" not in new.value])


def keyword_arguments(program: ParsedProgram) -> str:
    """Publishers, timers and so on are created with keyword arguments."""
    edits: list[Edit] = []
    equal = cst.AssignEqual(cst.SimpleWhitespace(""), cst.SimpleWhitespace(""))
    for call in program.calls(*CREATORS):
        args = []
        for arg, name in zip(call.args, CREATORS[called(call)], strict=False):
            named = arg.keyword is not None or arg.star
            args.append(arg if named else arg.with_changes(keyword=cst.Name(name), equal=equal))
        edits.append((call, call.with_changes(args=[*args, *call.args[len(args) :]])))
    return program.changed(edits)


def percent_format(program: ParsedProgram) -> str:
    """Texts are formatted with `%` instead of f-strings."""
    return _formatted(program, lambda spec: f"%{spec or 's'}", _percent_text, "{} % ({},)")


def format_method(program: ParsedProgram) -> str:
    """Texts are formatted with `.format` instead of f-strings."""
    return _formatted(program, lambda spec: f"{{:{spec}}}" if spec else "{}", str, "{}.format({})")


def qos_object(program: ParsedProgram) -> str:
    """The queue depth is given in a QoSProfile."""
    edits: list[Edit] = []
    for _, depth in program.arguments("qos_profile", "create_publisher", "create_subscription"):
        if isinstance(depth, cst.Integer):
            edits.append((depth, cst.parse_expression(f"QoSProfile(depth={depth.value})")))
    return _with_import(program, edits, "from rclpy.qos import QoSProfile")


def lambda_callbacks(program: ParsedProgram) -> str:
    """Callbacks of timers and subscriptions are lambdas."""
    edits: list[Edit] = []
    for call, callback in program.arguments("callback", "create_timer", "create_subscription"):
        if isinstance(callback, (cst.Name, cst.Attribute)):
            given = " msg" if called(call) == "create_subscription" else ""
            after = f"lambda{given}: {program.code(callback)}({given.strip()})"
            edits.append((callback, cst.parse_expression(after)))
    return program.changed(edits)


def executor(program: ParsedProgram) -> str:
    """An executor object spins the node."""
    edits: list[Edit] = []
    for line in program.all(cst.SimpleStatementLine):
        node = _spun(program, line)
        if node:
            text = f"executor = SingleThreadedExecutor()\nexecutor.add_node({node})\nexecutor.spin()\n"
            edits.append((line, cst.FlattenSentinel(cst.parse_module(text).body)))
    return _with_import(program, edits, "from rclpy.executors import SingleThreadedExecutor")


def loop_in_thread(program: ParsedProgram) -> str:
    """A loop with a sleep replaces the timer; a thread spins the node."""
    timers = program.calls("create_timer")
    lines = [line for line in program.all(cst.SimpleStatementLine) if _spun(program, line)]
    if len(timers) != 1 or len(lines) != 1:
        return _same(program)
    timer, callback, pause = (
        timers[0],
        passed_argument(timers[0], "callback"),
        passed_argument(timers[0], "timer_period_sec"),
    )
    if callback is None or pause is None or "self" in program.code(pause):
        return _same(program)
    made = program.enclosing(timer, cst.SimpleStatementLine)
    name = program.code(callback)
    if made is None or not name.startswith("self.") or program.code(made).strip() != program.code(timer):
        return _same(program)
    node = _spun(program, lines[0])
    thread = f"threading.Thread(target=rclpy.spin, args=({node},), daemon=True).start()"
    body = f"    {node}{name.removeprefix('self')}()\n    time.sleep({program.code(pause)})\n"
    loop = cst.FlattenSentinel([cst.parse_statement(thread), cst.parse_statement(f"while rclpy.ok():\n{body}")])
    imports = (*program.importing("import threading"), *program.importing("import time"))
    return program.changed([(made, cst.parse_statement("pass")), (lines[0], loop), *imports])


def without_guard(program: ParsedProgram) -> str:
    """The `__main__` guard is missing, as in a module for a console script."""
    guards = [node for node in program.all(cst.If) if "__name__" in program.code(node.test)]
    has_main = any(node.name.value == "main" for node in program.all(cst.FunctionDef))
    return program.changed([(guard, cst.RemoveFromParent()) for guard in guards]) if has_main else _same(program)


def _spun(program: ParsedProgram, line: cst.SimpleStatementLine) -> str:
    """Return the name of the node that a line spins; empty for other lines."""
    small = line.body[0]
    if not isinstance(small, cst.Expr) or not isinstance(small.value, cst.Call):
        return ""
    call = small.value
    plain = program.code(call.func) == "rclpy.spin" and len(call.args) == 1 and isinstance(call.args[0].value, cst.Name)
    return program.code(call.args[0].value) if plain else ""


def _formatted(program: ParsedProgram, field: Callable[[str], str], text: Callable[[str], str], whole: str) -> str:
    """Rewrite f-strings where possible: `field` writes a specification, `text` what is between, `whole` everything."""
    edits: list[Edit] = []
    for node in program.all(cst.FormattedString):
        values = [part for part in node.parts if isinstance(part, cst.FormattedStringExpression)]
        if values and len(node.start) == 2 and all(_is_plain(program, part) for part in values):
            written = "".join(
                text(part.value) if isinstance(part, cst.FormattedStringText) else field(program.specification(part))
                for part in node.parts
            )
            given = ", ".join(program.code(part.expression) for part in values)
            edits.append((node, cst.parse_expression(whole.format(f"{node.end}{written}{node.end}", given))))
    return program.changed(edits)


def _is_plain(program: ParsedProgram, part: cst.FormattedStringExpression) -> bool:
    """Whether every style can format a field."""
    bare = part.conversion is None and part.equal is None
    return bare and _PLAIN.fullmatch(program.specification(part)) is not None


def _percent_text(text: str) -> str:
    return text.replace("%", "%%").replace("{{", "{").replace("}}", "}")


def _with_import(program: ParsedProgram, edits: Sequence[Edit], line: str) -> str:
    """Return the source after edits that need an import; the unchanged source if there are none."""
    return program.changed([*edits, *program.importing(line)]) if edits else _same(program)


def _same(program: ParsedProgram) -> str:
    return program.module.code


#: Returns the source of a variant, or the unchanged source if there is nothing to vary.
Rewriter = Callable[[ParsedProgram], str]
#: Variant name -> its rewriter; the docstring describes the difference.
VARIANTS: Mapping[str, Rewriter] = {
    rewriter.__name__: rewriter
    for rewriter in (
        *(renamed_classes, renamed_functions, renamed_methods, renamed_attributes, renamed_variables, renamed_nodes),
        *(reordered_methods, reordered_constants),
        *(single_quotes, windows_lines, other_topic_form, keyword_arguments, percent_format, format_method),
        *(qos_object, lambda_callbacks, executor, loop_in_thread, without_guard),
    )
}


def variants_of(source: str, file: str) -> tuple[Candidate, ...]:
    """Return the variants that differ from a program, in the order of the table."""
    program = ParsedProgram(source)
    written = ((name, rewriter(program)) for name, rewriter in VARIANTS.items())
    return tuple(
        Candidate(f"{file}:{name}", file, name, text)
        for name, text in written
        if text != source and meaning(text) is not None
    )
