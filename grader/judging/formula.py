"""Formulas of one number, as rubrics write them: `sin(0.1 * n)`; read by a whitelist, never evaluated as Python."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

#: The letters a formula may use: the number of a message from 0, and its time in seconds.
VARIABLES = ("n", "t")
_MOST_CHARACTERS = 200
_CONSTANTS = MappingProxyType({"pi": math.pi})
_FUNCTIONS: Mapping[str, Callable[[float], float]] = MappingProxyType(
    {
        "sin": math.sin,
        "cos": math.cos,
        "tan": math.tan,
        "exp": math.exp,
        "sqrt": math.sqrt,
        "abs": abs,
        "floor": math.floor,
    }
)
_BINARY: Mapping[type[ast.operator], Callable[[float, float], float]] = MappingProxyType(
    {
        ast.Add: operator.add,
        ast.Sub: operator.sub,
        ast.Mult: operator.mul,
        ast.Div: operator.truediv,
        ast.Pow: math.pow,
        ast.Mod: operator.mod,
    }
)
_UNARY: Mapping[type[ast.unaryop], Callable[[float], float]] = MappingProxyType(
    {ast.UAdd: operator.pos, ast.USub: operator.neg}
)
#: Functions that are taken for each other.
_MISTAKEN = MappingProxyType({"sin": "cos", "cos": "sin"})


class FormulaError(ValueError):
    """A text is no formula; says what is wrong with it."""


@dataclass(frozen=True, slots=True)
class Curve:
    """A formula that can be asked for its value.

    Attributes:
        text: As the rubric has it.
        tree: Its whitelisted syntax tree.
    """

    text: str
    tree: ast.expr

    def at(self, n: float, t: float = 0.0) -> float:
        """Return the value at `n` and `t`; NaN where there is none, as for a root of -1."""
        try:
            return _value(self.tree, {"n": n, "t": t})
        except (ArithmeticError, ValueError):
            return math.nan

    @property
    def mistaken(self) -> Curve | None:
        """The formula with sine and cosine taken for each other, or None if it has neither."""
        tree = ast.parse(self.text, mode="eval").body
        found = [node for node in ast.walk(tree) if isinstance(node, ast.Name) and node.id in _MISTAKEN]
        for node in found:
            node.id = _MISTAKEN[node.id]
        return Curve(ast.unparse(tree), tree) if found else None


@lru_cache(maxsize=64)
def curve(text: str) -> Curve:
    """Return the formula that a text says.

    Raises:
        FormulaError: It says none.
    """
    if len(text) > _MOST_CHARACTERS:
        raise FormulaError(f"at most {_MOST_CHARACTERS} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise FormulaError("a formula such as sin(0.1 * n)") from None
    _check(tree)
    return Curve(text.strip(), tree)


def _check(node: ast.expr) -> None:
    """Raise unless every part is known."""
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        _check(node.left)
        _check(node.right)
    elif isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
        _check(node.operand)
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS:
        if len(node.args) != 1 or node.keywords or isinstance(node.args[0], ast.Starred):
            raise FormulaError(f"one number in the brackets of {node.func.id}")
        _check(node.args[0])
    elif isinstance(node, ast.Name):
        if node.id not in VARIABLES and node.id not in _CONSTANTS:
            raise FormulaError(f"n, t, pi or one of {', '.join(_FUNCTIONS)} with its brackets, found {node.id[:40]}")
    elif not (isinstance(node, ast.Constant) and type(node.value) in (int, float)):
        raise FormulaError(f"numbers, n, t, pi, + - * / % ** and {', '.join(_FUNCTIONS)}")


def _value(node: ast.expr, known: Mapping[str, float]) -> float:
    if isinstance(node, ast.BinOp):
        return _BINARY[type(node.op)](_value(node.left, known), _value(node.right, known))
    if isinstance(node, ast.UnaryOp):
        return _UNARY[type(node.op)](_value(node.operand, known))
    if isinstance(node, ast.Call):
        assert isinstance(node.func, ast.Name)
        return float(_FUNCTIONS[node.func.id](_value(node.args[0], known)))
    if isinstance(node, ast.Name):
        return known[node.id] if node.id in known else _CONSTANTS[node.id]
    assert isinstance(node, ast.Constant)
    return float(node.value)  # type: ignore[arg-type]  # only numbers come through the whitelist
