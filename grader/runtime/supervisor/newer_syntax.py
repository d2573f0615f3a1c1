"""Says which version of Python a file is written for that this one cannot compile, in a process of its own.

Usage: python -m grader.runtime.supervisor.newer_syntax LIMITS < FILE. What it reads was made by students, so the
process gives
up all privileges, files and networks first, and has limits (LIMITS, as for `confine`). It writes one line, a JSON list:
the oldest version that compiles the file, such as `[3, 12]`, or null if there is none that it knows.

Nothing is guessed from the text of an error, and no other Python runs. libcst parses the file by the grammar of the
newest Python. Each construct that came after this version becomes one that this version has, and that is correct where
the newer one is: a type parameter is left out, an f-string becomes a tuple of its expressions. Then this version
compiles the result, so that everything else is checked by Python itself.
"""

from __future__ import annotations

import ast
import json
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeAlias

import libcst as cst

from grader.runtime.contained import confine

Version: TypeAlias = tuple[int, int]
#: The version that this process runs on.
HERE: Version = sys.version_info[:2]
#: When each construct came: PEP 654, PEP 646, PEP 695, PEP 701, PEP 696, PEP 750 and PEP 758.
EXCEPT_STAR = STARRED = (3, 11)
TYPE_PARAMETERS = F_STRINGS = (3, 12)
DEFAULTS = (3, 13)
T_STRINGS = EXCEPT_WITHOUT_BRACKETS = (3, 14)
#: How deep the braces of an f-string may be nested in its format specifications: `MAX_EXPR_NESTING` of CPython.
DEEPEST = 3
_Strings: TypeAlias = cst.FormattedString | cst.TemplatedString | cst.ConcatenatedString | cst.SimpleString


class Refused(Exception):  # noqa: N818 - what the newer Python does with the file
    """The newer Python does not compile the file either."""


def main(limits: dict[str, Any]) -> int:
    """Read the file of standard input, and write the version to standard output."""
    cst.parse_module("x = f'{1}'\n")  # loads what a confined process could not
    text = sys.stdin.buffer.read()
    warnings.simplefilter("ignore")
    confine(limits)
    sys.stdout.write(json.dumps(needed(text)) + "\n")
    sys.stdout.flush()
    return 0


def needed(text: bytes, here: Version = HERE) -> Version | None:
    """Return the oldest version of Python, newer than `here`, that compiles a text; None if none is known to."""
    older = Older(here)
    try:
        tree = cst.parse_module(text)
        changed = tree.visit(older)
        compile(changed.bytes, "file", "exec", dont_inherit=True)
    except (
        cst.ParserSyntaxError,
        cst.CSTValidationError,
        cst.CSTLogicError,
        Refused,
        SyntaxError,
        ValueError,
        RecursionError,
    ):
        return None
    return older.needs if older.needs > here else None


class Older(cst.CSTTransformer):
    """Turns what came to Python after a version into what this version has.

    Raises Refused for what the newer Python finds wrong in these constructs, apart from its grammar.

    Args:
        here: The version.
    """

    def __init__(self, here: Version) -> None:
        super().__init__()
        self._here = here
        self.needs = here

    def _need(self, version: Version) -> bool:
        """Take note of a construct, and return whether it is too new."""
        self.needs = max(self.needs, version)
        return version > self._here

    # --- f-strings and t-strings ---

    def leave_FormattedString(
        self, original_node: cst.FormattedString, updated_node: cst.FormattedString
    ) -> cst.BaseExpression:
        if self._here >= F_STRINGS or _parses(original_node):
            return updated_node
        self._need(F_STRINGS)
        return _as_tuple(updated_node)

    def leave_TemplatedString(
        self, original_node: cst.TemplatedString, updated_node: cst.TemplatedString
    ) -> cst.BaseExpression:
        return _as_tuple(updated_node) if self._need(T_STRINGS) else updated_node

    def visit_ConcatenatedString(self, node: cst.ConcatenatedString) -> bool:
        return False  # a part of it cannot become a tuple

    def leave_ConcatenatedString(
        self, original_node: cst.ConcatenatedString, updated_node: cst.ConcatenatedString
    ) -> cst.BaseExpression:
        parts = list(_parts(original_node))
        kinds = {isinstance(part, cst.TemplatedString) for part in parts}
        if len(kinds) > 1:
            raise Refused
        if kinds == {False} and _parses(original_node):
            return updated_node
        return _tuple([_expression(part.visit(self)) for part in parts], updated_node)

    def visit_MatchValue(self, node: cst.MatchValue) -> None:
        _refuse_if(_is_formatted(node.value))

    def visit_MatchMappingElement(self, node: cst.MatchMappingElement) -> None:
        _refuse_if(_is_formatted(node.key))

    # --- type parameters ---

    def leave_TypeAlias(self, original_node: cst.TypeAlias, updated_node: cst.TypeAlias) -> cst.BaseSmallStatement:
        if not self._need(TYPE_PARAMETERS):
            return updated_node
        self._check_parameters(original_node.type_parameters)
        _refuse_yields([original_node.value])
        return cst.Assign([cst.AssignTarget(updated_node.name)], updated_node.value)

    def leave_FunctionDef(self, original_node: cst.FunctionDef, updated_node: cst.FunctionDef) -> cst.FunctionDef:
        if original_node.type_parameters is None or not self._need(TYPE_PARAMETERS):
            return updated_node
        self._check_parameters(original_node.type_parameters)
        _refuse_yields(_annotations(original_node))
        return updated_node.with_changes(type_parameters=None)

    def leave_ClassDef(self, original_node: cst.ClassDef, updated_node: cst.ClassDef) -> cst.ClassDef:
        if original_node.type_parameters is None or not self._need(TYPE_PARAMETERS):
            return updated_node
        self._check_parameters(original_node.type_parameters)
        _refuse_yields([*original_node.bases, *original_node.keywords])
        return updated_node.with_changes(type_parameters=None)

    def _check_parameters(self, parameters: cst.TypeParameters | None) -> None:
        if parameters is None:
            return
        names = [parameter.param.name.value for parameter in parameters.params]
        given = [parameter.default is not None for parameter in parameters.params]
        _refuse_if(len({*names}) < len(names) or given != sorted(given))
        _refuse_yields(parameters.params)
        if any(given):
            self._need(DEFAULTS)

    # --- exceptions ---

    def leave_ExceptHandler(
        self, original_node: cst.ExceptHandler, updated_node: cst.ExceptHandler
    ) -> cst.ExceptHandler:
        kinds = updated_node.type
        if not isinstance(kinds, cst.Tuple) or kinds.lpar or not self._need(EXCEPT_WITHOUT_BRACKETS):
            return updated_node
        return updated_node.with_changes(type=_in_brackets(kinds))

    def leave_ExceptStarHandler(
        self, original_node: cst.ExceptStarHandler, updated_node: cst.ExceptStarHandler
    ) -> cst.ExceptStarHandler:
        kinds = updated_node.type
        if not isinstance(kinds, cst.Tuple) or kinds.lpar or not self._need(EXCEPT_WITHOUT_BRACKETS):
            return updated_node
        return updated_node.with_changes(type=_in_brackets(kinds))

    def leave_TryStar(self, original_node: cst.TryStar, updated_node: cst.TryStar) -> cst.BaseCompoundStatement:
        if not self._need(EXCEPT_STAR):
            return updated_node
        for handler in original_node.handlers:
            handler.body.visit(_Jumping())
        handlers = [cst.ExceptHandler(h.body, type=h.type, name=h.name) for h in updated_node.handlers]
        return cst.Try(updated_node.body, handlers, orelse=updated_node.orelse, finalbody=updated_node.finalbody)

    # --- stars ---

    def leave_Index(self, original_node: cst.Index, updated_node: cst.Index) -> cst.Index:
        if updated_node.star is None or not self._need(STARRED):
            return updated_node
        starred = cst.Tuple([cst.StarredElement(updated_node.value)])
        return cst.Index(_in_brackets(starred))

    def leave_Annotation(self, original_node: cst.Annotation, updated_node: cst.Annotation) -> cst.Annotation:
        starred = updated_node.annotation
        if not isinstance(starred, cst.StarredElement) or not self._need(STARRED):
            return updated_node
        return updated_node.with_changes(annotation=_in_brackets(cst.Tuple([starred])))


class _Jumping(cst.CSTVisitor):
    """Refuses what may not leave an `except*` block; in a loop in it, break and continue may."""

    def visit_FunctionDef(self, node: cst.FunctionDef) -> bool:
        return False

    def visit_ClassDef(self, node: cst.ClassDef) -> bool:
        return False

    def __init__(self) -> None:
        super().__init__()
        self._loops = 0

    def visit_For(self, node: cst.For) -> None:
        self._loops += 1

    def leave_For(self, original_node: cst.For) -> None:
        self._loops -= 1

    def visit_While(self, node: cst.While) -> None:
        self._loops += 1

    def leave_While(self, original_node: cst.While) -> None:
        self._loops -= 1

    def visit_Return(self, node: cst.Return) -> None:
        raise Refused

    def visit_Break(self, node: cst.Break) -> None:
        _refuse_if(not self._loops)

    def visit_Continue(self, node: cst.Continue) -> None:
        _refuse_if(not self._loops)


class _Yielding(cst.CSTVisitor):
    """Refuses what may not stand in an annotation scope, as PEP 695 calls it."""

    def visit_Lambda(self, node: cst.Lambda) -> bool:
        return False

    def visit_Yield(self, node: cst.Yield) -> None:
        raise Refused

    def visit_Await(self, node: cst.Await) -> None:
        raise Refused

    def visit_NamedExpr(self, node: cst.NamedExpr) -> None:
        raise Refused


def _refuse_if(wrong: bool) -> None:  # noqa: FBT001 - the condition is all there is
    if wrong:
        raise Refused


def _refuse_yields(nodes: Iterable[cst.CSTNode]) -> None:
    for node in nodes:
        node.visit(_Yielding())


def _annotations(function: cst.FunctionDef) -> list[cst.CSTNode]:
    given = function.params
    every = [*given.posonly_params, *given.params, *given.kwonly_params, given.star_arg, given.star_kwarg]
    found = [one.annotation for one in every if isinstance(one, cst.Param)] + [function.returns]
    return [annotation for annotation in found if annotation is not None]


def _parses(node: cst.BaseExpression) -> bool:
    """Return whether this version of Python reads an expression as it is."""
    try:
        ast.parse(f"({cst.Module([]).code_for_node(node)}\n)")
    except (SyntaxError, ValueError):
        return False
    return True


def _parts(node: cst.BaseExpression) -> Iterable[_Strings]:
    """Yield the literals of a concatenation."""
    while isinstance(node, cst.ConcatenatedString):
        yield from _parts(node.left)
        node = node.right
    if isinstance(node, (cst.FormattedString, cst.TemplatedString, cst.SimpleString)):
        yield node


def _is_formatted(node: cst.BaseExpression) -> bool:
    return any(not isinstance(part, cst.SimpleString) for part in _parts(node))


def _as_tuple(node: cst.FormattedString | cst.TemplatedString) -> cst.Tuple:
    """Return a tuple of what a formatted string holds: its texts, and its expressions with their specifications."""
    raw = "r" in node.start.lower()
    return _tuple(list(_held(node.parts, lambda text: _literal(node, text) if not raw else None, 1)), node)


def _held(
    parts: Sequence[Any], literal: Callable[[str], cst.BaseExpression | None], depth: int
) -> Iterable[cst.BaseExpression]:
    for part in parts:
        if isinstance(part, (cst.FormattedStringText, cst.TemplatedStringText)):
            text = literal(part.value)
            if text is not None:
                yield text
            continue
        _refuse_if(depth > DEEPEST)
        yield _in_brackets(part.expression)
        yield from _held(part.format_spec or (), literal, depth + 1)


def _literal(node: cst.FormattedString | cst.TemplatedString, text: str) -> cst.BaseExpression:
    """Return a text with the quotes around it, so that its escapes are checked."""
    # the space keeps a quote or a backslash at the end of the text from those that end the literal
    return cst.SimpleString(f"{node.quote}{text} {node.quote}")


def _tuple(elements: Sequence[cst.BaseExpression], like: cst.BaseExpression) -> cst.Tuple:
    """Return a tuple in brackets that can be no target of an assignment, as no string can."""
    first = cst.SimpleString("''")
    inner = cst.Tuple([cst.Element(element) for element in (first, first, *elements)])
    outer = {"lpar": [*like.lpar, cst.LeftParen()], "rpar": [cst.RightParen(), *like.rpar]}
    return cst.ensure_type(inner.with_changes(**outer), cst.Tuple)


def _expression(node: object) -> cst.BaseExpression:
    if not isinstance(node, cst.BaseExpression):
        raise TypeError(f"expected an expression, found {type(node).__name__}")
    return node


def _in_brackets(node: Any) -> Any:
    return node.with_changes(lpar=[cst.LeftParen(), *node.lpar], rpar=[*node.rpar, cst.RightParen()])


if __name__ == "__main__":
    os._exit(main(json.loads(sys.argv[1])))
