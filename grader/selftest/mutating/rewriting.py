"""Rewriters that give things other names and another order."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

import libcst as cst

from grader.selftest.mutating.program import Edit, Program, called, string, text_of


def renamed_classes(program: Program) -> str:
    """Every class has another name."""
    names = {node.name.value for node in program.all(cst.ClassDef)}
    return _renamed(program, names, lambda name: f"My{name}")


def renamed_functions(program: Program) -> str:
    """Every function outside classes has another name, `main` too."""
    names = {node.name.value for node in program.all(cst.FunctionDef) if program.enclosing(node, cst.ClassDef) is None}
    return _renamed(program, names, lambda name: f"run_{name}")


def renamed_methods(program: Program) -> str:
    """Every method has another name."""
    methods = [node for node in program.all(cst.FunctionDef) if program.enclosing(node, cst.ClassDef)]
    names = {method.name.value for method in methods if not method.name.value.startswith("__")}
    edits: list[Edit] = [(m.name, cst.Name(f"do_{m.name.value}")) for m in methods if m.name.value in names]
    return program.changed([*edits, *_of_own_objects(program, names, "do_")])


def renamed_attributes(program: Program) -> str:
    """Every attribute of an object of the program's own has another name."""
    targets = [target.target for target in program.all(cst.AssignTarget)]
    names = {t.attr.value for t in targets if isinstance(t, cst.Attribute) and program.code(t.value) == "self"}
    return program.changed(_of_own_objects(program, names, "the_"))


def renamed_variables(program: Program) -> str:
    """Every variable and every constant has another name."""
    targets = [target.target for target in program.all(cst.AssignTarget)]
    names = {target.value for target in targets if isinstance(target, cst.Name)}
    names |= {loop.target.value for loop in program.all(cst.For) if isinstance(loop.target, cst.Name)}
    names -= {node.name.value for node in program.all(cst.FunctionDef)}
    names -= {node.name.value for node in program.all(cst.ClassDef)}
    return _renamed(program, names, lambda name: f"{name}_{'X' if name.isupper() else 'x'}")


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


def _renamed(program: Program, names: Iterable[str], rename: Callable[[str], str]) -> str:
    """Return the source with plain names changed: not as keyword, and not as attribute of anything."""
    wanted = set(names) - _not_ours(program)
    edits: list[Edit] = []
    for node in program.all(cst.Name):
        above = next(program.above(node), None)
        is_attribute = isinstance(above, cst.Attribute) and above.attr is node
        is_keyword = isinstance(above, cst.Arg) and above.keyword is node
        if node.value in wanted and not is_attribute and not is_keyword:
            edits.append((node, cst.Name(rename(node.value))))
    return program.changed(edits)


def _of_own_objects(program: Program, names: Collection[str], prefix: str) -> list[Edit]:
    """Return the edits that rename attributes of `self`, and of variables that hold an object of an own class."""
    classes = {node.name.value for node in program.all(cst.ClassDef)}
    made = [a for a in program.all(cst.Assign) if isinstance(a.value, cst.Call) and called(a.value) in classes]
    objects = {"self", *(program.code(target.target) for assign in made for target in assign.targets)}
    return [
        (node.attr, cst.Name(f"{prefix}{node.attr.value}"))
        for node in program.all(cst.Attribute)
        if node.attr.value in names and program.code(node.value) in objects
    ]


def _not_ours(program: Program) -> set[str]:
    """Return the names that come with an import, or are those of parameters."""
    names = {alias.evaluated_alias or alias.evaluated_name.split(".")[0] for alias in program.all(cst.ImportAlias)}
    return names | {parameter.name.value for parameter in program.all(cst.Param)}
