"""What an expression is worth where the text alone tells: literals, arithmetic, names that are assigned once."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable
from dataclasses import dataclass

from grader.judging.source import Source, argument, chain, last_name, parameters, text_of

_DEEPEST = 12
_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
}
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "float": float,
    "int": lambda x: float(int(x)),
    "abs": abs,
    "math.radians": math.radians,
    "math.degrees": math.degrees,
    "np.deg2rad": math.radians,
    "np.rad2deg": math.degrees,
}
_NAMED = {"math.pi": math.pi, "np.pi": math.pi, "numpy.pi": math.pi}


@dataclass(frozen=True, slots=True)
class Constant:
    """A number, and the place in the text at which it is written down.

    Attributes:
        value: The number.
        origin: The expression that a reader has to change for another number.
    """

    value: float
    origin: ast.AST


def constant(source: Source, node: ast.AST | None, depth: int = 0) -> Constant | None:
    """Return what an expression is worth, or None if the text alone does not tell."""
    if node is None or depth > _DEEPEST:
        return None
    if isinstance(node, ast.Constant):
        return _literal(node)
    if isinstance(node, (ast.UnaryOp, ast.BinOp)):
        return _arithmetic(source, node, depth)
    if isinstance(node, ast.Call):
        return _called(source, node, depth)
    return _named(source, node, depth) if isinstance(node, (ast.Name, ast.Attribute)) else None


def _literal(node: ast.Constant) -> Constant | None:
    plain = isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    value = _as_float(node.value) if plain else None
    return None if value is None else Constant(value, node)


def _named(source: Source, node: ast.Name | ast.Attribute, depth: int) -> Constant | None:
    if chain(node) in _NAMED:
        return Constant(_NAMED[chain(node)], node)
    if isinstance(node, ast.Attribute) and node.attr in ("value", "double_value", "integer_value"):
        found = _parameter(source, node.value, depth)
        if found is not None:
            return found
    return constant(source, _only_assignment(source, node), depth + 1)


def number_at(source: Source, node: ast.AST | None) -> float | None:
    """Return the value of an expression, or None."""
    found = constant(source, node)
    return None if found is None else found.value


def _as_float(value: object) -> float | None:
    try:
        return float(value)  # type: ignore[arg-type]
    except (OverflowError, ValueError, TypeError):
        return None


def _arithmetic(source: Source, node: ast.UnaryOp | ast.BinOp, depth: int) -> Constant | None:
    if isinstance(node, ast.UnaryOp):
        inner = constant(source, node.operand, depth + 1)
        if inner is None or not isinstance(node.op, (ast.USub, ast.UAdd)):
            return None
        return Constant(-inner.value if isinstance(node.op, ast.USub) else inner.value, node)
    left, right = constant(source, node.left, depth + 1), constant(source, node.right, depth + 1)
    apply = _BINARY.get(type(node.op))
    if left is None or right is None or apply is None:
        return None
    try:
        value = apply(left.value, right.value)
    except (ArithmeticError, ValueError):
        return None
    # one number that was given a name is the one to change: in 1 / RATE that is RATE
    named = [c.origin for c, at in ((left, node.left), (right, node.right)) if c.origin is not at]
    return Constant(value, named[0] if len(named) == 1 else node)


def _called(source: Source, call: ast.Call, depth: int) -> Constant | None:
    if chain(call.func) in _FUNCTIONS and len(call.args) == 1 and not call.keywords:
        inner = constant(source, call.args[0], depth + 1)
        if inner is None:
            return None
        try:
            return Constant(_FUNCTIONS[chain(call.func)](inner.value), call)
        except (ArithmeticError, ValueError):
            return None
    return None


def _parameter(source: Source, call: ast.AST, depth: int) -> Constant | None:
    """Return the default of a ROS parameter that is read or declared by this call."""
    if isinstance(call, ast.Call) and last_name(call.func) == "get_parameter_value":
        call = call.func.value if isinstance(call.func, ast.Attribute) else call
    if not isinstance(call, ast.Call):
        return None
    if last_name(call.func) == "declare_parameter":
        return constant(source, argument(call, 1, "value"), depth + 1)
    name = text_of(argument(call, 0, "name"))
    if last_name(call.func) != "get_parameter" or name is None:
        return None
    declared = [c for c in source.calls("declare_parameter") if text_of(argument(c, 0, "name")) == name]
    return constant(source, argument(declared[0], 1, "value"), depth + 1) if len(declared) == 1 else None


def _only_assignment(source: Source, name: ast.Name | ast.Attribute) -> ast.expr | None:
    """Return the value of a name that is given one at one place only."""
    if isinstance(name, ast.Attribute):
        return _only_attribute(source, name)
    function = source.function_of(name)
    if function is not None:
        if name.id in parameters(function):
            return _only_default(source, function, name.id)
        inside = [n for n in bindings(source, name.id) if source.function_of(n) is function]
        if inside:
            return _value(inside[0]) if len(inside) == 1 else None
    outside = [n for n in bindings(source, name.id) if source.function_of(n) is None and source.class_of(n) is None]
    changed = any(name.id in g.names for g in source.all(ast.Global))
    return _value(outside[0]) if len(outside) == 1 and not changed else None


def _only_attribute(source: Source, name: ast.Attribute) -> ast.expr | None:
    wanted = chain(name)
    if not wanted.startswith("self.") or "(" in wanted:
        return None
    stores = source.stores(wanted)
    if stores:
        return _value(source.parents.get(stores[0])) if len(stores) == 1 else None
    named = [n for n in bindings(source, name.attr) if isinstance(source.parents.get(n), ast.ClassDef)]
    return _value(named[0]) if len(named) == 1 and wanted.count(".") == 1 else None


def bindings(source: Source, name: str) -> list[ast.AST]:
    """Return the statements that give a plain name a value, in the order of the text."""
    return [source.parents[n] for n in source.stored.get(name, ()) if n in source.parents]


def _value(statement: ast.AST | None) -> ast.expr | None:
    if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
        return statement.value
    return statement.value if isinstance(statement, ast.AnnAssign) else None


def _only_default(source: Source, function: ast.FunctionDef | ast.AsyncFunctionDef, name: str) -> ast.expr | None:
    """Return the default of a parameter, if no call in the file passes anything to the function."""
    names = parameters(function)
    owner = source.class_of(function)
    known_as = [function.name, owner.name] if owner is not None and function.name == "__init__" else [function.name]
    passed = [c for c in source.calls(*known_as) if (c.args or c.keywords) and "super()" not in chain(c.func)]
    place = names.index(name) - len(names) + len(function.args.defaults)
    return function.args.defaults[place] if place >= 0 and not passed else None
