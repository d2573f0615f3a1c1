"""Says whether a file is written for Python 3.12, which this Python cannot compile, in a process of its own.

Usage: python -m grader.runtime.supervisor.newer_syntax LIMITS < FILE. What it reads was made by students, so the
process gives up all privileges, files and networks first, and has limits (LIMITS, as for `confine`). It writes one line
of JSON, `true` or `false`.

Nothing is guessed from the text of an error, and no other Python runs. libcst parses the file by the grammar of the
newest Python. What came with 3.12 is replaced: type parameters are left out, an f-string becomes an expression that
each version reads. Then this Python compiles the result, so that everything else is checked by Python itself. A mistake
in such a string, or about such parameters, that only the compiler of 3.12 finds is not found here.
"""

from __future__ import annotations

import ast
import json
import os
import sys
import warnings
from typing import Any, TypeVar

import libcst as cst

from grader.runtime.contained import confine

_Text = TypeVar("_Text", cst.FormattedString, cst.ConcatenatedString)
_Generic = TypeVar("_Generic", cst.FunctionDef, cst.ClassDef)


def main(limits: dict[str, Any]) -> int:
    """Read the file of standard input, and write the answer to standard output."""
    cst.parse_module("x = f'{1}'\n")  # loads what a confined process could not
    text = sys.stdin.buffer.read()
    warnings.simplefilter("ignore")
    confine(limits)
    sys.stdout.write(json.dumps(needs_newer(text)) + "\n")
    sys.stdout.flush()
    return 0


def needs_newer(text: bytes) -> bool:
    """Return whether Python 3.12 compiles a text, and no older one does."""
    older = _Older()
    try:
        compile(cst.parse_module(text).visit(older).bytes, "file", "exec", dont_inherit=True)
    except (
        cst.ParserSyntaxError,
        cst.CSTValidationError,
        cst.CSTLogicError,
        SyntaxError,
        ValueError,
        RecursionError,
    ):
        return False
    return older.changed


class _Older(cst.CSTTransformer):
    """Turns what came with Python 3.12 (PEP 695 and PEP 701) into what any Python has."""

    def __init__(self) -> None:
        super().__init__()
        self.changed = False

    def leave_FormattedString(
        self, original_node: cst.FormattedString, updated_node: cst.FormattedString
    ) -> cst.BaseExpression:
        return self._read_anywhere(original_node, updated_node)

    def visit_ConcatenatedString(self, node: cst.ConcatenatedString) -> bool:
        return False  # a part of it cannot become a tuple

    def leave_ConcatenatedString(
        self, original_node: cst.ConcatenatedString, updated_node: cst.ConcatenatedString
    ) -> cst.BaseExpression:
        return self._read_anywhere(original_node, updated_node)

    def _read_anywhere(self, node: _Text, updated: _Text) -> cst.BaseExpression:
        try:
            ast.parse(f"({cst.Module([]).code_for_node(node)}\n)")
        except (SyntaxError, ValueError):
            self.changed = True
            # like an f-string, this can be neither the target of an assignment, nor a pattern, nor a docstring
            text, brackets = cst.SimpleString("''"), ([*node.lpar, cst.LeftParen()], [cst.RightParen(), *node.rpar])
            return cst.BooleanOperation(text, cst.And(), text, *brackets)
        return updated

    def leave_TypeAlias(self, original_node: cst.TypeAlias, updated_node: cst.TypeAlias) -> cst.BaseSmallStatement:
        self._leave_out(original_node.type_parameters)
        return cst.Assign([cst.AssignTarget(updated_node.name)], updated_node.value)

    def leave_FunctionDef(self, original_node: cst.FunctionDef, updated_node: cst.FunctionDef) -> cst.FunctionDef:
        return self._plain(updated_node)

    def leave_ClassDef(self, original_node: cst.ClassDef, updated_node: cst.ClassDef) -> cst.ClassDef:
        return self._plain(updated_node)

    def _plain(self, node: _Generic) -> _Generic:
        if node.type_parameters is None:
            return node
        self._leave_out(node.type_parameters)
        return node.with_changes(type_parameters=None)

    def _leave_out(self, parameters: cst.TypeParameters | None) -> None:
        self.changed = True
        given = [] if parameters is None else parameters.params
        if any(parameter.default is not None for parameter in given):
            raise SyntaxError("a default came with Python 3.13 (PEP 696)")
        if len({parameter.param.name.value for parameter in given}) < len(given):
            raise SyntaxError("a parameter twice")


if __name__ == "__main__":
    os._exit(main(json.loads(sys.argv[1])))
