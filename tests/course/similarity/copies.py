"""Programs as somebody rewrites them who does not want to be found out: the same program, told differently."""

from __future__ import annotations

import ast
import random
from collections.abc import Mapping
from typing import Any

from grader.course.similarity.finding import programs_of
from grader.course.similarity.library import Handed
from grader.grading.submissions.collected import Collected

FILE = "odom_subscriber.py"

# Names that stay: what ROS and Python call things.
_KEPT = {"main", "self", "__init__", "__name__", "args"}

Named = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


class _Names(ast.NodeVisitor):
    """Collects what a program names itself."""

    def __init__(self) -> None:
        self.names: set[str] = set()

    def visit_FunctionDef(self, node: Named) -> None:
        self.names.add(node.name)
        self.generic_visit(node)

    visit_ClassDef = visit_AsyncFunctionDef = visit_FunctionDef  # noqa: N815  names of ast

    def visit_arg(self, node: ast.arg) -> None:
        self.names.add(node.arg)

    def visit_Name(self, node: ast.Name) -> None:
        if isinstance(node.ctx, ast.Store):
            self.names.add(node.id)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if isinstance(node.ctx, ast.Store) and isinstance(node.value, ast.Name) and node.value.id == "self":
            self.names.add(node.attr)
        self.generic_visit(node)


class _Rename(ast.NodeTransformer):
    """Gives everything that a program names itself another name, and says all texts in other words."""

    def __init__(self, names: Mapping[str, str]) -> None:
        self.names = names

    def visit_FunctionDef(self, node: Named) -> Named:
        node.name = self.names.get(node.name, node.name)
        self.generic_visit(node)
        return node

    visit_ClassDef = visit_AsyncFunctionDef = visit_FunctionDef  # noqa: N815  names of ast

    def visit_arg(self, node: ast.arg) -> ast.arg:
        node.arg = self.names.get(node.arg, node.arg)
        return node

    def visit_Name(self, node: ast.Name) -> ast.Name:
        node.id = self.names.get(node.id, node.id)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.Attribute:
        self.generic_visit(node)
        if isinstance(node.value, ast.Name) and node.value.id == "self":
            node.attr = self.names.get(node.attr, node.attr)
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.Constant:
        if isinstance(node.value, str) and " " in node.value:
            node.value = f"now {node.value}"
        return node


def renamed(text: str, seed: int = 0) -> str:
    """Return a program with other names and texts, in another layout and without its comments."""
    tree = ast.parse(text)
    found = _Names()
    found.visit(tree)
    draw = random.Random(seed)
    names = {name: f"{draw.choice('abcdefgh')}{draw.randrange(10_000)}" for name in sorted(found.names - _KEPT)}
    return ast.unparse(_Rename(names).visit(tree)) + "\n"


def reordered(text: str, seed: int = 0) -> str:
    """Return a program whose methods and functions stand in another order; comments go."""
    tree = ast.parse(text)
    draw = random.Random(seed)
    for scope in [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]:
        draw.shuffle(scope.body)
    at = [k for k, node in enumerate(tree.body) if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    moved = [tree.body[k] for k in at]
    draw.shuffle(moved)
    for k, node in zip(at, moved, strict=True):
        tree.body[k] = node
    return ast.unparse(tree) + "\n"


def commented(text: str, seed: int = 0) -> str:
    """Return a program with a comment of one's own on every third line, and more room between lines."""
    del seed
    lines = text.splitlines()
    said = [line + ("  # as I see it" if k % 3 == 0 and line.strip() and line[-1] not in "\\\"'" else "")
            for k, line in enumerate(lines)]  # fmt: skip
    return "# my own work\n\n" + "\n".join(said) + "\n"


def logged(text: str, seed: int = 0) -> str:
    """Return a program with a line of its own in every function, besides other names and another order."""
    tree = ast.parse(reordered(renamed(text, seed), seed))
    for k, node in enumerate(n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)):
        node.body.insert(1 if ast.get_docstring(node) and len(node.body) > 1 else 0, ast.parse(f"mark = {k}").body[0])
    ast.fix_missing_locations(tree)
    return ast.unparse(tree) + "\n"


#: Ways to disguise a copy, the thorough ones last.
DISGUISES = {"comments": commented, "order": reordered, "names": renamed, "all and lines added": logged}


def handed(name: str, *texts: bytes | str, **more: Any) -> Handed:
    """Return a submission of these texts, or byte strings."""
    contents = [text if isinstance(text, bytes) else text.encode() for text in texts]
    files = [(FILE if k == 0 else f"file_{k}.py", content) for k, content in enumerate(contents)]
    programs, passed_over = programs_of(Collected(tuple(files)))
    return Handed(name, name, programs, passed_over, **more)
