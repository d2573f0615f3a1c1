"""Rewriters that give things other names and another order."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import libcst as cst

from grader.selftest.mutating.program import Edit, Program, called, string, text_of


def renamed_classes(program: Program) -> str:
    """Every class has another name."""
    names = {node.name.value for node in program.all(cst.ClassDef)}
    return _renamed(program, names, lambda name: f"My{name}", attributes=False)


def renamed_functions(program: Program) -> str:
    """Every function outside classes has another name, `main` too."""
    names = {node.name.value for node in program.all(cst.FunctionDef) if program.enclosing(node, cst.ClassDef) is None}
    return _renamed(program, names, lambda name: f"run_{name}", attributes=False)


def renamed_methods(program: Program) -> str:
    """Every method has another name."""
    names = {node.name.value for node in program.all(cst.FunctionDef) if program.enclosing(node, cst.ClassDef)}
    return _renamed(program, {n for n in names if not n.startswith("__")}, lambda name: f"do_{name}", attributes=True)


def renamed_attributes(program: Program) -> str:
    """Every attribute of an object of the program's own has another name."""
    targets = [target.target for target in program.all(cst.AssignTarget)]
    names = {t.attr.value for t in targets if isinstance(t, cst.Attribute) and program.code(t.value) == "self"}
    edits = [
        (node.attr, cst.Name(f"the_{node.attr.value}"))
        for node in program.all(cst.Attribute)
        if node.attr.value in names and program.code(node.value) in ("self", "node")
    ]
    return program.changed(edits)


def renamed_variables(program: Program) -> str:
    """Every variable and every constant has another name."""
    targets = [target.target for target in program.all(cst.AssignTarget)]
    names = {target.value for target in targets if isinstance(target, cst.Name)}
    names |= {loop.target.value for loop in program.all(cst.For) if isinstance(loop.target, cst.Name)}
    return _renamed(program, names, lambda name: f"{name}_{'X' if name.isupper() else 'x'}", attributes=False)


def renamed_nodes(program: Program) -> str:
    """The node has another name."""
    edits: list[Edit] = []
    for call in program.calls("__init__", "Node", "create_node"):
        name = text_of(call.args[0].value) if call.args else None
        if name is not None and (called(call) != "__init__" or "super" in program.code(call.func)):
            edits.append((call.args[0].value, string(f"{name}_of_mine")))
    return program.changed(edits)


def reordered_methods(program: Program) -> str:
    """The methods of each class stand the other way round."""
    edits: list[Edit] = []
    for node in program.all(cst.ClassDef):
        methods = [part for part in node.body.body if isinstance(part, cst.FunctionDef)]
        edits += zip(methods, reversed(methods), strict=True)
    return program.changed([(old, new) for old, new in edits if old is not new])


def reordered_constants(program: Program) -> str:
    """The constants of the file stand the other way round, as far as none needs another."""
    lines = [s for s in program.module.body if isinstance(s, cst.SimpleStatementLine)]
    plain = [s for s in lines if isinstance(s.body[0], cst.Assign) and not program.all(cst.Name, s.body[0].value)]
    return program.changed([(old, new) for old, new in zip(plain, reversed(plain), strict=True) if old is not new])


def _renamed(program: Program, names: Iterable[str], rename: Callable[[str], str], *, attributes: bool) -> str:
    """Return the source with names changed, wherever they mean the same: not as keyword, nor as field of a message."""
    wanted = set(names) - _not_ours(program)
    edits: list[Edit] = []
    for node in program.all(cst.Name):
        above = next(program.above(node), None)
        is_attribute = isinstance(above, cst.Attribute) and above.attr is node
        is_keyword = isinstance(above, cst.Arg) and above.keyword is node
        own = not is_attribute or (isinstance(above, cst.Attribute) and program.code(above.value) in ("self", "node"))
        if node.value in wanted and own and not is_keyword and (attributes or not is_attribute):
            edits.append((node, cst.Name(rename(node.value))))
    return program.changed(edits)


def _not_ours(program: Program) -> set[str]:
    """Return the names that come with an import, or are those of parameters."""
    names = {alias.evaluated_name.split(".")[0] for alias in program.all(cst.ImportAlias)}
    return names | {parameter.name.value for parameter in program.all(cst.Param)}
