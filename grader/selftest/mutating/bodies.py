"""What operators do to the bodies of functions: put something at the top, take a statement out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import libcst as cst

from grader.selftest.mutating.program import Edit, Program, statement


def lines_of(function: cst.FunctionDef) -> Sequence[Any]:
    """Return the statements of a function's body, in order, without its docstring."""
    if not isinstance(function.body, cst.IndentedBlock):
        return ()
    body = function.body.body
    return body[1:] if function.get_docstring() is not None else body


def at_top(function: cst.FunctionDef, text: str) -> tuple[Edit, ...]:
    """Return the edit that puts a statement before the others of a function; none if that has no block of its own."""
    lines = lines_of(function)
    return ((lines[0], cst.FlattenSentinel([statement(text), lines[0]])),) if lines else ()


def parameters(function: cst.FunctionDef) -> list[str]:
    """Return the names of a function's parameters."""
    return [parameter.name.value for parameter in function.params.params]


def owner(function: cst.FunctionDef) -> str:
    """Return where a function can keep something between two calls: `self`, or the function itself."""
    names = parameters(function)
    return names[0] if names[:1] == ["self"] else function.name.value


def alone(program: Program, node: cst.CSTNode) -> bool:
    """Whether a small statement stands on a line of its own."""
    line = program.enclosing(node, cst.SimpleStatementLine)
    return line is not None and len(line.body) == 1
