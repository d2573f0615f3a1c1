"""Syntax trees as JSON: a contained process parses what students wrote, and others make the tree of what it says.

Whatever the JSON holds, `tree_of` returns a tree that the parser could have made, with limited size and depth, or none.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

#: Larger trees are not looked at, in nodes without operators and contexts: student nodes have some hundreds.
MOST_NODES = 12_000
#: Nor are deeper ones: programs that people write have 30 levels, sums of many terms and long `elif` chains more. What
#: looks at a tree may use three frames of Python for a level, of which it has 1,000.
MOST_DEPTH = 200
#: Nodes that hold nothing: the parser makes one of each for all places.
_SHARED = (ast.expr_context, ast.operator, ast.unaryop, ast.cmpop, ast.boolop)
#: Whole numbers that JSON holds as they are; larger ones become texts, which Python converts in linear time.
_PLAIN_INT = 1 << 53
_MOST_PLACE = 1 << 31


class _Field(NamedTuple):
    name: str
    of: type | None  # the class of its nodes; None for a plain value
    plain: str  # the name of the type of a plain value
    optional: bool
    many: bool


class _Kind(NamedTuple):
    made: type[ast.AST]
    placed: bool  # whether it has a line
    fields: tuple[_Field, ...]


class UnfitTree(ValueError):  # noqa: N818  reads well in except clauses
    """A tree has too many nodes or levels, or a JSON text holds none."""


@lru_cache(maxsize=1)
def _kinds() -> tuple[tuple[_Kind, ...], dict[type, int]]:
    """Return every class of nodes with its fields, as this Python describes them, and the number of each."""
    found = []
    for name in sorted(vars(ast)):
        made = getattr(ast, name)
        text = getattr(made, "__doc__", None) or ""
        if not (isinstance(made, type) and issubclass(made, ast.AST) and re.match(rf"{name}(\(|$)", text)):
            continue
        told = re.findall(r"(\w+)([?*]*) (\w+)", text.partition("(")[2])
        if tuple(field for _, _, field in told) != made._fields:
            continue
        fields = tuple(_field(*parts) for parts in told)
        found.append(_Kind(made, "lineno" in made._attributes, fields))  # noqa: SLF001 - documented
    return tuple(found), {kind.made: number for number, kind in enumerate(found)}


def _field(type_: str, marks: str, name: str) -> _Field:
    of = getattr(ast, type_, None)
    of = of if isinstance(of, type) and issubclass(of, ast.AST) else None
    # elements of these lists may be missing: `{**given}`, and parameters without a default
    gaps = name in ("keys", "kw_defaults")
    return _Field(name, of, "" if of else type_, "?" in marks or gaps or name == "kind", "*" in marks)


def measured(tree: ast.AST) -> tuple[int, int]:
    """Return the number of nodes of a tree and its depth; counting ends beyond either limit."""
    waiting: list[tuple[ast.AST, int]] = [(tree, 1)]
    count = depth = 0
    while waiting and count <= MOST_NODES and depth <= MOST_DEPTH:
        node, level = waiting.pop()
        count, depth = count + 1, max(depth, level)
        waiting += [(child, level + 1) for child in children(node)]
    return count, depth


def children(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes in a node, without operators and contexts."""
    return (child for child in ast.iter_child_nodes(node) if not isinstance(child, _SHARED))


def json_of(tree: ast.Module) -> bytes:
    """Return a tree as JSON.

    Raises:
        UnfitTree: It has too many nodes or levels.
    """
    count, depth = measured(tree)
    if count > MOST_NODES or depth > MOST_DEPTH:
        raise UnfitTree
    return json.dumps(_row(tree, _kinds()[1]), separators=(",", ":")).encode("ascii")


def _row(node: ast.AST, numbers: dict[type, int]) -> Any:
    number = numbers[type(node)]
    kind = _kinds()[0][number]
    if not kind.fields and not kind.placed:
        return number
    row: list[Any] = [number]
    if kind.placed:
        row += (node.lineno, node.col_offset, node.end_lineno, node.end_col_offset)  # type: ignore[attr-defined]
    for field in kind.fields:
        value: Any = getattr(node, field.name, None)
        if field.of is None:
            row.append([_plain(v) for v in value] if field.many else _plain(value))
        elif field.many:
            row.append([None if one is None else _row(one, numbers) for one in value])
        else:
            row.append(None if value is None else _row(value, numbers))
    return row


def _plain(value: object) -> object:
    if isinstance(value, bytes):
        return {"bytes": value.decode("latin-1")}
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= _PLAIN_INT:
        return {"int": hex(value)}
    if isinstance(value, complex):
        return {"complex": [value.real, value.imag]}
    return {"ellipsis": 0} if value is Ellipsis else value


def tree_of(told: bytes) -> ast.Module | None:
    """Return the tree that a JSON text holds; None if it holds none that this module could have written."""
    try:
        tree = _Reader().node(json.loads(told), ast.mod, 1)
    except (ValueError, TypeError, RecursionError, MemoryError):
        return None
    return tree if isinstance(tree, ast.Module) else None


class _Reader:
    """Makes one tree."""

    def __init__(self) -> None:
        self._left = MOST_NODES
        self._shared: dict[int, ast.AST] = {}

    def node(self, row: Any, wanted: type, depth: int) -> ast.AST:
        kinds, _ = _kinds()
        if type(row) is int and 0 <= row < len(kinds):
            kind = kinds[row]
            if kind.fields or kind.placed or not issubclass(kind.made, wanted):
                raise UnfitTree
            if row not in self._shared:
                self._shared[row] = kind.made()
            return self._shared[row]
        self._left -= 1
        if type(row) is not list or not row or type(row[0]) is not int or not 0 <= row[0] < len(kinds):
            raise UnfitTree
        kind = kinds[row[0]]
        places = row[1:5] if kind.placed else []
        values = row[1 + len(places) :]
        if self._left < 0 or depth > MOST_DEPTH or not issubclass(kind.made, wanted) or len(values) != len(kind.fields):
            raise UnfitTree
        if kind.placed and (len(places) != 4 or not all(type(p) is int and 0 <= p < _MOST_PLACE for p in places)):
            raise UnfitTree
        named = {f.name: self._value(f, value, depth) for f, value in zip(kind.fields, values, strict=True)}
        made = kind.made(**named)
        if kind.placed:
            made.lineno, made.col_offset, made.end_lineno, made.end_col_offset = places  # type: ignore[attr-defined]
        return made

    def _value(self, field: _Field, value: Any, depth: int) -> Any:
        if not field.many:
            return self._one(field, value, depth)
        if type(value) is not list:
            raise UnfitTree
        return [self._one(field, one, depth) for one in value]

    def _one(self, field: _Field, value: Any, depth: int) -> Any:
        if value is None and (field.optional or field.plain == "constant"):
            return None
        if field.of is not None:
            return self.node(value, field.of, depth + 1)
        if field.plain == "constant":
            return _constant(value)
        fits = type(value) is int if field.plain == "int" else type(value) is str
        if not fits:
            raise UnfitTree
        return value


def _constant(value: Any) -> object:
    if type(value) in (str, bool, int, float):
        return value
    if type(value) is not dict or len(value) != 1:
        raise UnfitTree
    ((kind, held),) = value.items()
    if kind == "bytes" and type(held) is str:
        return held.encode("latin-1")
    if kind == "int" and type(held) is str:
        return int(held, 16)
    if kind == "complex" and _are_floats(held):
        return complex(*held)
    if kind == "ellipsis":
        return ...
    raise UnfitTree


def _are_floats(held: Any) -> bool:
    return type(held) is list and len(held) == 2 and all(type(part) is float for part in held)
