"""Finds out what a setup.py passes to setup(), without running it."""

from __future__ import annotations

import ast
import posixpath
import re
from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatchcase
from string import Formatter
from typing import Any

#: The maximum length of strings and lists that are evaluated, and the maximum number of statements and expressions.
TEXT_CHARACTERS, ITEMS, STEPS = 10_000, 1_000, 20_000
#: String methods that are evaluated if their arguments are strings.
_OF_TEXTS = frozenset(
    {"format", "join", "lower", "lstrip", "replace", "rstrip", "split", "splitlines", "strip", "upper"}
)
_OF_DICTS = frozenset({"items", "keys", "values"})
#: Conversions with a width or a precision, whose result may be of any length.
_WIDTH = re.compile(r"%[-#0 +]*[0-9*.]")


class LimitError(ValueError):
    """Reading the file would take too much."""


def given_to_setup(tree: ast.Module, names: Sequence[str]) -> tuple[dict[str, Any], bool]:
    """Return the keyword arguments of setup(), unknown values as None, and whether what is known of each is all of it.

    A loop over values that are not known, for instance, may add to anything.

    Args:
        tree: The parsed file.
        names: The paths of all files below its folder, which the patterns of `glob` are compared with.

    Raises:
        LimitError: The file exceeds a limit.
    """
    reader = _Reader(names)
    reader.run(tree.body)
    return reader.given, reader.sure


class _Reader:
    """Evaluates the statements of a setup.py, as far as they use strings, lists and dictionaries."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names
        self.given: dict[str, Any] = {}
        self.sure = True
        self._known: dict[str, Any] = {}
        self._steps = 0

    def run(self, statements: Iterable[ast.stmt]) -> None:
        """Evaluate statements, including every branch, and the bodies of functions where they are defined."""
        for statement in statements:
            self._count_step()
            if isinstance(statement, ast.Assign):
                value = self._value(statement.value)
                for target in statement.targets:
                    self._bind(target, value)
            elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
                self._bind(statement.target, self._value(statement.value))
            elif isinstance(statement, ast.AugAssign):
                both = ast.BinOp(_loaded(statement.target), statement.op, statement.value)
                self._bind(statement.target, self._value(both))
            elif isinstance(statement, (ast.Expr, ast.Return)):
                self._value(statement.value)
            elif isinstance(statement, ast.For):
                for item in self._iterated(statement.iter):
                    self._bind(statement.target, item)
                    self.run(statement.body)
            else:
                for part in ("body", "orelse", "finalbody"):
                    self.run(s for s in _parts(statement, part) if isinstance(s, ast.stmt))

    def _count_step(self) -> None:
        self._steps += 1
        if self._steps > STEPS:
            raise LimitError

    def _bind(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Name):
            self._known[target.id] = value
        elif isinstance(target, (ast.Tuple, ast.List)):
            values = _items(value)
            for number, part in enumerate(target.elts):
                self._bind(part, values[number] if number < len(values) else None)
        elif isinstance(target, ast.Subscript):
            holder, key = self._value(target.value), self._value(target.slice)
            if isinstance(holder, dict) and isinstance(key, str):
                holder[key] = value

    def _value(self, node: ast.expr | None) -> Any:
        """Evaluate an expression; None if its value is unknown."""
        self._count_step()
        try:
            value = self._of(node)
        except LimitError:
            raise
        except (LookupError, TypeError, ValueError):  # setup.py itself would raise it, if it ever came here
            value = None
        if isinstance(value, str) and len(value) > TEXT_CHARACTERS:
            raise LimitError
        if isinstance(value, (list, dict)) and len(value) > ITEMS:
            raise LimitError
        return value

    def _of(self, node: ast.expr | None) -> Any:
        value: Any = None
        if isinstance(node, ast.Constant):
            value = node.value
        elif isinstance(node, ast.Name):
            value = self._known.get(node.id)
        elif isinstance(node, (ast.List, ast.Tuple, ast.Set)):
            value = [item for element in node.elts for item in self._elements(element)]
        elif isinstance(node, ast.Dict):
            value = self._dictionary(zip(node.keys, node.values, strict=True))
        elif isinstance(node, ast.JoinedStr):
            parts = [self._value(p.value if isinstance(p, ast.FormattedValue) else p) for p in node.values]
            value = "".join(parts) if all(isinstance(part, str) for part in parts) else None
        elif isinstance(node, ast.BinOp):
            value = _combined(node.op, self._value(node.left), self._value(node.right))
        elif isinstance(node, ast.Subscript):
            value = _item(self._value(node.value), self._value(node.slice))
        elif isinstance(node, (ast.ListComp, ast.GeneratorExp, ast.SetComp)):
            value = list(self._comprehended(node.elt, node.generators))
        elif isinstance(node, ast.Call):
            value = self._called(node)
        return value

    def _iterated(self, node: ast.expr) -> list[Any]:
        """Return the items of an expression; with an unknown one, not all is known that they are put into."""
        value = self._value(node)
        self.sure = self.sure and value is not None
        return _items(value)

    def _elements(self, node: ast.expr) -> list[Any]:
        return self._iterated(node.value) if isinstance(node, ast.Starred) else [self._value(node)]

    def _dictionary(self, pairs: Iterable[tuple[ast.expr | None, ast.expr]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, node in pairs:
            value, name = self._value(node), None if key is None else self._value(key)
            if isinstance(name, str):
                found[name] = value
            elif key is None and isinstance(value, dict):
                found.update(value)
            else:
                self.sure = False
        return found

    def _comprehended(self, element: ast.expr, generators: list[ast.comprehension]) -> Iterator[Any]:
        """Yield the items of a comprehension; conditions are assumed to be true."""
        if not generators:
            yield self._value(element)
            return
        for item in self._iterated(generators[0].iter):
            self._bind(generators[0].target, item)
            yield from self._comprehended(element, generators[1:])

    def _called(self, node: ast.Call) -> Any:  # noqa: PLR0911  one for each kind of call
        named = self._dictionary((None if k.arg is None else ast.Constant(k.arg), k.value) for k in node.keywords)
        if _name(node.func) == "setup":
            self.given = self.given or named
            return None
        values = [item for argument in node.args for item in self._elements(argument)]
        if _name(node.func) in ("glob", "iglob") and values and isinstance(values[0], str):
            return self._matching(values[0])
        if _name(node.func) in ("find_packages", "find_namespace_packages"):
            return self._packages(values, named, plain=_name(node.func) == "find_packages")
        if isinstance(node.func, ast.Attribute) and _dotted(node.func) in ("path.join", "os.path.join"):
            return posixpath.join(*values) if values and all(isinstance(value, str) for value in values) else None
        if isinstance(node.func, ast.Attribute):
            self.sure = self.sure and not (node.func.attr == "extend" and None in values)
            return _method(self._value(node.func.value), node.func.attr, values, named)
        name = _name(node.func)
        if name == "dict":
            return {**(values[0] if values and isinstance(values[0], dict) else {}), **named}
        return _made(name, values[0]) if len(values) == 1 else None

    def _packages(self, values: list[Any], named: dict[str, Any], *, plain: bool) -> list[str] | None:
        """Evaluate find_packages(where, exclude, include): the folders with an __init__.py, dotted.

        Without `plain`, all folders with a module count.
        """
        given = {**dict(zip(("where", "exclude", "include"), values, strict=False)), **named}
        where, exclude, include = given.get("where", "."), given.get("exclude", []), given.get("include", ["*"])
        texts = [where, *_items(exclude), *_items(include)]
        if None in (where, exclude, include) or not all(isinstance(text, str) for text in texts):
            return None
        begin = posixpath.normpath(where)
        above = "" if begin == "." else f"{begin}/"
        below = [name.removeprefix(above) for name in self._names if name.startswith(above)]
        folders = {posixpath.dirname(name) for name in below if name.endswith(".py")} - {""}
        if plain:
            marked = {name.removesuffix("/__init__.py") for name in below if name.endswith("/__init__.py")}
            folders = {f for f in marked if all(up in marked for up in _with_parents(f))}
        dotted = [folder.replace("/", ".") for folder in sorted(folders) if "." not in folder]
        return [
            name
            for name in dotted
            if any(fnmatchcase(name, one) for one in include) and not any(fnmatchcase(name, one) for one in exclude)
        ]

    def _matching(self, pattern: str) -> list[str] | None:
        """Return the files below the folder that match a pattern; None for a pattern that could match others."""
        parts = [part for part in pattern.split("/") if part not in ("", ".")]
        if pattern.startswith("/") or ".." in parts or "**" in parts:
            return None
        return sorted(name for name in self._names if _matches(name.split("/"), parts))


def _with_parents(folder: str) -> Iterator[str]:
    """Yield a relative folder and those that it is in."""
    while folder:
        yield folder
        folder = posixpath.dirname(folder)


def _matches(path: Sequence[str], pattern: Sequence[str]) -> bool:
    """Return whether a path matches, part by part; as in a shell, a pattern matches no hidden file by chance."""
    return len(path) == len(pattern) and all(
        fnmatchcase(part, wanted) and (wanted.startswith(".") or not part.startswith("."))
        for part, wanted in zip(path, pattern, strict=True)
    )


def _made(name: str, value: Any) -> Any:
    """Evaluate a call of a built-in function; lists of anything but strings are neither sorted nor written as text."""
    if name in ("list", "tuple") and isinstance(value, (str, list)):
        return list(value)
    if name == "sorted" and isinstance(value, (str, list)) and all(isinstance(item, str) for item in value):
        return sorted(value)
    return value if name == "str" and isinstance(value, str) else None


def _dotted(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        before = _dotted(node.value)
        return f"{before}.{node.attr}" if before else ""
    return node.id if isinstance(node, ast.Name) else ""


def _method(of: Any, name: str, values: list[Any], named: dict[str, Any]) -> Any:
    """Evaluate a method call, including methods that modify a list or a dictionary."""
    if isinstance(of, list) and name in ("append", "extend") and len(values) == 1:
        of += values if name == "append" else _items(values[0])
    elif isinstance(of, dict) and name == "update":
        of.update({k: v for given in (*values, named) if isinstance(given, dict) for k, v in given.items()})
    elif isinstance(of, dict) and name in _OF_DICTS:
        return [list(found) if name == "items" else found for found in getattr(of, name)()]
    elif isinstance(of, str) and name in _OF_TEXTS and len(of) < TEXT_CHARACTERS // 10:
        texts = _items(values[0]) if name == "join" and values else [*values, *named.values()]
        known = all(isinstance(text, str) for text in texts) and (name != "format" or _only_inserts(of))
        return getattr(of, name)(*values, **named) if known else None
    return None


def _only_inserts(template: str) -> bool:
    """Return whether a template of `str.format` inserts its arguments whole and as they are, without a width."""
    return all(
        not spec and conversion is None and (not name or name.isalnum() or name.isidentifier())
        for _, name, spec, conversion in Formatter().parse(template)
    )


def _combined(operator: ast.operator, left: Any, right: Any) -> Any:
    if isinstance(operator, ast.Add) and type(left) is type(right) and isinstance(left, (str, list)):
        return left + right
    if isinstance(operator, ast.BitOr) and isinstance(left, dict) and isinstance(right, dict):
        return left | right
    if isinstance(operator, ast.Mod) and isinstance(left, str) and len(left) < TEXT_CHARACTERS // 10:
        values = tuple(right) if isinstance(right, list) else (right,)
        return left % values if all(isinstance(v, str) for v in values) and not _WIDTH.search(left) else None
    return None


def _item(of: Any, key: Any) -> Any:
    if isinstance(of, dict):
        return of.get(key) if isinstance(key, str) else None
    known = isinstance(of, (list, str)) and type(key) is int and -len(of) <= key < len(of)
    return of[key] if known else None


def _items(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (list, dict)) else []


def _loaded(target: ast.expr) -> ast.expr:
    """Convert the target of an assignment to an expression that reads it."""
    return ast.Name(target.id) if isinstance(target, ast.Name) else target


def _parts(statement: ast.stmt, part: str) -> list[Any]:
    found = getattr(statement, part, None)
    return found if isinstance(found, list) else []


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
