"""Says what a Python file starts when it is run, and what it has that can be started in its place."""

from __future__ import annotations

import ast

from grader.runtime.host.packages import never_true, offers_main
from grader.runtime.model.submission import Beginning

#: Modules whose functions only prepare the program when a file calls them at the top level.
_SETTING_UP = frozenset({"sys", "os", "warnings", "random", "logging", "np", "numpy", "signal", "math"})
_NODES = frozenset({"Node", "LifecycleNode"})


def beginning_of(tree: ast.Module) -> Beginning:
    """Return what a file starts."""
    nodes = [node for node in tree.body if isinstance(node, ast.ClassDef) and _is_node(node)]
    return Beginning(
        starts=any(map(_starts, tree.body)),
        main=any(isinstance(node, ast.FunctionDef) and node.name == "main" for node in tree.body),
        offers_main=offers_main(tree),
        node=nodes[0].name if len(nodes) == 1 and not _needs_arguments(nodes[0]) else "",
    )


def _starts(statement: ast.stmt) -> bool:
    """Return whether a top-level statement may run the program, as opposed to only preparing it."""
    waiting = [statement]
    while waiting:  # a long `elif` is as deep as it is long
        one = waiting.pop()
        if isinstance(one, ast.Expr):
            if isinstance(one.value, ast.Call) and _root(one.value.func) not in _SETTING_UP:
                return True
        elif isinstance(one, ast.If) and never_true(one):
            waiting += one.orelse
        elif not isinstance(one, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            waiting += (part for name in ("body", "orelse", "finalbody") for part in getattr(one, name, []))
    return False


def _root(node: ast.expr) -> str:
    while isinstance(node, (ast.Attribute, ast.Call, ast.Subscript)):
        node = node.func if isinstance(node, ast.Call) else node.value
    return node.id if isinstance(node, ast.Name) else ""


def _is_node(node: ast.ClassDef) -> bool:
    return any(getattr(base, "id", getattr(base, "attr", "")) in _NODES for base in node.bases)


def _needs_arguments(node: ast.ClassDef) -> bool:
    """Return whether the constructor has a parameter without a default, apart from `self`."""
    made = next((f for f in node.body if isinstance(f, ast.FunctionDef) and f.name == "__init__"), None)
    if made is None:
        return False
    given = made.args
    free = len(given.posonlyargs) + len(given.args) - len(given.defaults)
    return free > 1 or None in given.kw_defaults
