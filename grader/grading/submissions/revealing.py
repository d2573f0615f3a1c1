"""Finds expressions that show what a function is, or in which order a set holds its elements.

The functions of some modules are replaced in virtual time, and the order of a set depends on the hashes of a process. A
program that looks at either can tell where it runs.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from grader.grading.judging.source import Source, chain
from grader.grading.submissions.answers import ORDER

#: Modules with functions that are replaced in virtual time.
REPLACED = frozenset(
    ("time", "datetime", "threading", "queue", "asyncio", "select", "selectors", "signal", "sched", "random", "rclpy")
)
#: Functions that go through their argument in order, and methods that do; `sorted`, `len`, `sum`, `min`, `max`, `any`
#: and `all` give the same for every order, but for rounding.
_IN_ORDER = frozenset(("list", "tuple", "iter", "enumerate", "str", "repr", "zip", "next", "map", "filter", "print"))
_METHODS = frozenset(("join", "extend", "writelines", "fromkeys"))
#: Functions that turn their argument into a text.
_TEXTS = frozenset(("str", "repr", "format", "print", "ascii"))
#: Classes with small letters, which annotations name in brackets.
_CLASSES = frozenset(("date", "datetime", "time", "timedelta", "timezone", "tzinfo"))
#: Attributes of modules that ordinary programs read.
_ORDINARY = frozenset(("__version__", "__file__"))
#: A field of a format, and what it reads, such as `{0.__code__}` or `{f.real}`. Both patterns take linear time.
_FIELD = re.compile(r"\{([^{}]*)\}")
_READ = re.compile(r"[.\[]([A-Za-z_]\w*)")


def shown_functions(source: Source) -> Iterator[str]:
    """Yield the functions of replaced modules that a file looks at without calling them."""
    for node in source.nodes:
        for part in _looked_at(node):
            if _is_replaced(part, source):
                yield f"{source.resolved(part)} as a value"


def _looked_at(node: ast.AST) -> Iterator[ast.expr]:
    """Yield the expressions that a node turns into a text, uses as a key, matches, or reads an inner attribute of."""
    if isinstance(node, ast.FormattedValue):
        yield node.value
    elif isinstance(node, ast.Call):
        name = chain(node.func)
        if name in _TEXTS or (isinstance(node.func, ast.Attribute) and node.func.attr in ("format", "write")):
            yield from node.args
            yield from (keyword.value for keyword in node.keywords)
    elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod):
        yield from node.right.elts if isinstance(node.right, ast.Tuple) else [node.right]
    elif isinstance(node, ast.Subscript):
        yield node.slice
    elif isinstance(node, ast.Match):
        yield from node.subject.elts if isinstance(node.subject, ast.Tuple) else [node.subject]
    elif isinstance(node, ast.Attribute) and node.attr.startswith("__") and node.attr not in _ORDINARY:
        yield node.value


def _is_replaced(node: ast.expr, source: Source) -> bool:
    """Return whether an expression is a function of a module that is replaced, or the module itself."""
    name = source.resolved(node)
    module, _, last = name.rpartition(".")
    head = chain(node).partition(".")[0]
    if "(" in name or head not in source.aliases or name.partition(".")[0] not in REPLACED:
        return False
    return last[:1].islower() and not (module == "datetime" and last in _CLASSES)


def read_attributes(source: Source) -> Iterator[str]:
    """Yield the attributes that fields of formats and patterns of `match` read."""
    for node in source.all(ast.Constant):
        if isinstance(node.value, str) and "{" in node.value:
            for field in _FIELD.findall(node.value):
                yield from _READ.findall(re.split("[:!]", field, maxsplit=1)[0])
    for pattern in source.all(ast.MatchClass):
        yield from pattern.kwd_attrs


def orders(source: Source) -> Iterator[str]:
    """Yield a name if a file uses the order of a set: in a loop, as a list or a text, or by taking any element."""
    names = _set_names(source)
    if any(_uses_order(node, names) for node in source.nodes):
        yield ORDER


def _uses_order(node: ast.AST, names: frozenset[str]) -> bool:
    used: list[ast.expr] = []
    if isinstance(node, (ast.For, ast.AsyncFor)):
        used = [node.iter]
    elif isinstance(node, (ast.ListComp, ast.DictComp, ast.GeneratorExp)):
        used = [loop.iter for loop in node.generators]
    elif isinstance(node, (ast.Starred, ast.FormattedValue, ast.YieldFrom)) or (
        isinstance(node, ast.Assign) and isinstance(node.targets[0], (ast.Tuple, ast.List))
    ):
        used = [node.value]
    if not isinstance(node, ast.Call):
        return any(_is_set(one, names) for one in used)
    if isinstance(node.func, ast.Attribute):
        takes_any = node.func.attr == "pop" and not node.args and _is_set(node.func.value, names)
        return takes_any or (node.func.attr in _METHODS and any(_is_set(argument, names) for argument in node.args))
    return chain(node.func) in _IN_ORDER and any(_is_set(argument, names) for argument in node.args)


def _is_set(node: ast.expr, names: frozenset[str]) -> bool:
    """Return whether an expression is a set that is not empty, or a name that is given nothing but sets."""
    waiting = [node]
    while waiting:
        one = waiting.pop()
        if isinstance(one, ast.BinOp) and isinstance(one.op, (ast.BitOr, ast.BitAnd, ast.Sub, ast.BitXor)):
            waiting += (one.right, one.left)
        elif isinstance(one, ast.Call) and chain(one.func) in ("set", "frozenset"):
            if one.args:
                return True
        elif isinstance(one, (ast.Set, ast.SetComp)) or chain(one) in names:
            return True
    return False


def _set_names(source: Source) -> frozenset[str]:
    """Return the names, such as `seen` or `self.seen`, that are given nothing but sets."""
    given: dict[str, dict[ast.expr, None]] = {}
    for node in source.nodes:
        if isinstance(node, (ast.Assign, ast.AnnAssign, ast.NamedExpr)) and node.value is not None:
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                given.setdefault(chain(target), {})[node.value] = None
    given.pop("", None)
    values_given = dict.fromkeys(value for values in given.values() for value in values)
    sets = {value: _makes_set(value) for value in values_given}
    return frozenset(name for name, values in given.items() if all(sets[value] for value in values))


def _makes_set(node: ast.expr) -> bool:
    empty = isinstance(node, ast.Call) and chain(node.func) in ("set", "frozenset")
    return empty or _is_set(node, frozenset())
