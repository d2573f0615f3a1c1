"""A student's file as a syntax tree that is safe to ask: nothing here raises for any text, however strange."""

from __future__ import annotations

import ast
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from grader.core.exercise import Location
from grader.judging.wording import quote

#: Files longer than this are not parsed: no node that a person writes for an exercise comes near.
LONGEST_SOURCE = 100_000
#: The same for the parts of its syntax tree.
MOST_NODES = 12_000
#: Longest quotation of code inside a hint.
CODE_LENGTH = 70
Function = ast.FunctionDef | ast.AsyncFunctionDef
Loop = ast.While | ast.For
Scope = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
AnyNode = TypeVar("AnyNode", bound=ast.AST)
#: Calls that take a function to be called back.
_TAKE_CALLBACKS = frozenset(
    {
        "create_timer",
        "create_subscription",
        "create_service",
        "create_client",
        "add_done_callback",
        "add_on_set_parameters_callback",
        "add_pre_set_parameters_callback",
        "add_post_set_parameters_callback",
        "create_guard_condition",
        "ActionServer",
        "send_goal_async",
        "registerCallback",
    }
)


@dataclass(frozen=True, slots=True)
class Source:
    """One graded file.

    Attributes:
        file: Path inside the submission, as locations have it.
        lines: The text by lines, without their ends.
        nodes: Every node of the syntax tree that has a line, in the order of the text; empty if it cannot be parsed.
        tree: The syntax tree, or None if the text cannot be parsed.
        parents: Node -> the node around it.
        index: The nodes by their class, in the order of the text.
        called: The calls by the last part of the name that is called, in the order of the text.
        stored: Where names and attributes are assigned, by dotted name, in the order of the text.
        aliases: Name in the file -> the dotted name it was imported as.
        stars: Modules of which everything was imported.
    """

    file: str
    lines: Sequence[str] = ()
    nodes: Sequence[ast.AST] = ()
    tree: ast.Module | None = None
    parents: Mapping[ast.AST, ast.AST] = field(default_factory=dict)
    index: Mapping[type[ast.AST], list[Any]] = field(default_factory=dict)
    called: Mapping[str, list[ast.Call]] = field(default_factory=dict)
    stored: Mapping[str, list[ast.AST]] = field(default_factory=dict)
    aliases: Mapping[str, str] = field(default_factory=dict)
    stars: tuple[str, ...] = ()

    def all(self, kind: type[AnyNode]) -> Iterator[AnyNode]:
        """Yield the nodes of a kind in the order of the text."""
        yield from self.index.get(kind, ())

    def loops(self) -> list[Loop]:
        """Return the loops in the order of the text."""
        return sorted([*self.all(ast.While), *self.all(ast.For)], key=_place)

    def names(self) -> list[ast.Name | ast.Attribute]:
        """Return every name, plain or after a dot, in the order of the text."""
        return sorted([*self.all(ast.Name), *self.all(ast.Attribute)], key=_place)

    def stores(self, dotted: str) -> list[ast.Attribute]:
        """Return where an attribute such as `self.x` is assigned, in the order of the text."""
        return [n for n in self.stored.get(dotted, ()) if isinstance(n, ast.Attribute)]

    def calls(self, *names: str) -> Iterator[ast.Call]:
        """Yield the calls of functions or methods by the last part of their name."""
        found = [c for name in dict.fromkeys(names) for c in self.called.get(name, ())]
        yield from found if len(names) == 1 else sorted(found, key=_place)

    def on_line(self, line: int, kind: type[AnyNode]) -> Iterator[AnyNode]:
        """Yield the nodes of a kind that a line is part of, the outermost first."""
        for node in self.all(kind):
            if covers(node, line):
                yield node

    def function_at(self, line: int) -> Function | None:
        """Return the innermost function or method that a line is part of."""
        return next((f for f in reversed(self.functions()) if covers(f, line)), None)

    def around(self, node: ast.AST) -> Iterator[ast.AST]:
        """Yield the nodes around a node, the nearest first."""
        inner: ast.AST | None = self.parents.get(node)
        while inner is not None:
            yield inner
            inner = self.parents.get(inner)

    def function_of(self, node: ast.AST) -> Function | None:
        """Return the function or method that a node is in."""
        return next((n for n in self.around(node) if isinstance(n, Function)), None)

    def class_of(self, node: ast.AST) -> ast.ClassDef | None:
        """Return the class that a node is in."""
        return next((n for n in self.around(node) if isinstance(n, ast.ClassDef)), None)

    def functions(self, name: str | None = None) -> list[Function]:
        """Return the functions and methods of a name, or all."""
        both: list[Function] = [*self.all(ast.FunctionDef), *self.all(ast.AsyncFunctionDef)]
        return sorted((f for f in both if name in (None, f.name)), key=_place)

    def is_method(self, function: Function) -> bool:
        """Return whether a function stands directly in a class and is not static."""
        static = any(last_name(d) == "staticmethod" for d in function.decorator_list)
        return isinstance(self.parents.get(function), ast.ClassDef) and not static

    def place(self, node: ast.AST) -> Location:
        """Return where a node begins."""
        return Location(self.file, first_line(node))

    def line(self, number: int) -> str:
        """Return a line of the text, from 1; empty if there is none."""
        return self.lines[number - 1] if 1 <= number <= len(self.lines) else ""

    def code(self, node: ast.AST, length: int = CODE_LENGTH) -> str:
        """Return a node as it is written, on one line, cut to `length` characters."""
        first, last = first_line(node), last_line(node)
        rows = [self.line(n)[: 4 * CODE_LENGTH].encode() for n in range(first, min(last, first + 4) + 1)]
        if not rows:
            return ""
        if last == first:
            rows[0] = rows[0][: getattr(node, "end_col_offset", None)]
        elif len(rows) == last - first + 1:
            rows[-1] = rows[-1][: getattr(node, "end_col_offset", None)]
        rows[0] = rows[0][getattr(node, "col_offset", 0) :]
        return quote(b" ".join(rows).decode(errors="replace"), length)

    def resolved(self, node: ast.AST | None) -> str:
        """Return the dotted name of an expression, its first part as it was imported: `t.sleep` -> `time.sleep`."""
        name = chain(node)
        head, dot, rest = name.partition(".")
        return f"{self.aliases.get(head, head)}{dot}{rest}"

    def means(self, node: ast.AST | None, wanted: str) -> bool:
        """Return whether an expression names something: by its whole dotted name, or its last part if that is all."""
        if "." not in wanted:
            return last_name(node) == wanted or self.resolved(node).rpartition(".")[2] == wanted
        found = self.resolved(node)
        module, _, name = wanted.rpartition(".")
        return found == wanted or (found == name and module in self.stars)

    def calling(self, wanted: str) -> list[ast.Call]:
        """Return the calls of something by its dotted name, imports followed, in the order of the text."""
        return [call for call in self.all(ast.Call) if self.means(call.func, wanted)]

    def deriving(self, *wanted: str) -> list[ast.ClassDef]:
        """Return the classes that derive from one of those named, also by way of another class of the file."""
        found: list[ast.ClassDef] = []
        while True:
            names = {c.name for c in found}
            more = [c for c in self.all(ast.ClassDef) if c not in found and self._has_base(c, wanted, names)]
            if not more:
                return found
            found += more

    def _has_base(self, class_: ast.ClassDef, wanted: tuple[str, ...], known: set[str]) -> bool:
        return any(chain(base) in known or any(self.means(base, w) for w in wanted) for base in class_.bases)

    def called_back(self) -> list[ast.AST]:
        """Return the functions that run as callbacks, and what these call in the file, each once."""
        functions = {f.name: f for f in self.functions()}
        waiting: list[ast.AST] = [f for call in self.calls(*_TAKE_CALLBACKS) for f in _handed_over(call, functions)]
        found: list[ast.AST] = []
        while waiting:
            here = waiting.pop()
            if here in found:
                continue
            found.append(here)
            called = (n.func for n in subtree(here) if isinstance(n, ast.Call))
            waiting += [functions[name] for func in called if (name := _own_name(func)) in functions]
        return found


def read(file: str, text: str) -> Source:
    """Return a file ready to be asked; one that cannot be parsed, or is endless, has lines only."""
    lines = tuple(text[:LONGEST_SOURCE].split("\n"))
    tree = _parsed(text) if len(text) <= LONGEST_SOURCE else None
    parents: dict[ast.AST, ast.AST] = {}
    nodes: list[ast.AST] = []
    waiting: list[ast.AST] = [tree] if tree is not None else []
    while waiting and len(parents) <= MOST_NODES:
        node = waiting.pop()
        if hasattr(node, "lineno"):
            nodes.append(node)
        for child in ast.iter_child_nodes(node):
            if not isinstance(child, (ast.expr_context, ast.operator, ast.unaryop, ast.cmpop, ast.boolop)):
                parents[child] = node
                waiting.append(child)
    if tree is None or waiting:
        return Source(file, lines)
    nodes.sort(key=_place)
    index: dict[type[ast.AST], list[Any]] = {}
    for node in nodes:
        index.setdefault(type(node), []).append(node)
    return Source(file, lines, tuple(nodes), tree, parents, index, *_by_name(nodes), *_imported(index))


def _by_name(nodes: Sequence[ast.AST]) -> tuple[dict[str, list[ast.Call]], dict[str, list[ast.AST]]]:
    """Return the calls by the name called, and the places of assignment by the name assigned."""
    called: dict[str, list[ast.Call]] = {}
    stored: dict[str, list[ast.AST]] = {}
    for node in nodes:
        if isinstance(node, ast.Call):
            called.setdefault(last_name(node.func), []).append(node)
        elif isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Store):
            stored.setdefault(chain(node), []).append(node)
    return called, stored


def _imported(index: Mapping[type[ast.AST], list[Any]]) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return what the names of the file were imported as, wherever in it, and the modules that were imported whole."""
    aliases: dict[str, str] = {}
    stars: list[str] = []
    for node in index.get(ast.Import, ()):
        for name in node.names:
            aliases[name.asname or name.name.partition(".")[0]] = (
                name.name if name.asname else name.name.partition(".")[0]
            )
    for imported in index.get(ast.ImportFrom, ()):
        for name in imported.names:
            if name.name == "*":
                stars.append(imported.module or "")
            else:
                aliases[name.asname or name.name] = f"{imported.module or ''}.{name.name}"
    return aliases, tuple(stars)


def _place(node: ast.AST) -> tuple[int, int, int]:
    """Return what sorts nodes by the text, the outer before the inner."""
    return first_line(node), getattr(node, "col_offset", 0), -last_line(node)


def _parsed(text: str) -> ast.Module | None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the student's doubtful escapes are not ours
        try:
            return ast.parse(text.removeprefix("\ufeff"))
        except (SyntaxError, ValueError, RecursionError, MemoryError, OverflowError):
            return None


def first_line(node: ast.AST) -> int:
    """Return the line that a node begins on."""
    return int(getattr(node, "lineno", 0))


def last_line(node: ast.AST) -> int:
    """Return the line that a node ends on."""
    return int(getattr(node, "end_lineno", 0) or first_line(node))


def covers(node: ast.AST, line: int) -> bool:
    """Return whether a line is one of those that a node is written on."""
    return first_line(node) <= line <= last_line(node)


def last_name(node: ast.AST | None) -> str:
    """Return the last part of a name such as `self.get_logger().info`; empty for anything else."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def chain(node: ast.AST | None) -> str:
    """Return a dotted name, calls in it as `()`: `self.get_logger().info`; empty where it starts with anything else."""
    parts: list[str] = []
    while True:
        if isinstance(node, ast.Attribute):
            parts.append("." + node.attr)
            node = node.value
        elif isinstance(node, ast.Call):
            parts.append("()")
            node = node.func
        elif isinstance(node, ast.Name):
            parts.append(node.id)
            return "".join(reversed(parts))
        else:
            return ""


def argument(call: ast.Call, place: int, name: str) -> ast.expr | None:
    """Return an argument by its place or its name."""
    if place < len(call.args) and not any(isinstance(a, ast.Starred) for a in call.args[: place + 1]):
        return call.args[place]
    return next((k.value for k in call.keywords if k.arg == name), None)


def parameters(function: Scope) -> list[str]:
    """Return the names of the positional parameters."""
    return [a.arg for a in (*function.args.posonlyargs, *function.args.args)]


def text_of(node: ast.AST | None) -> str | None:
    """Return the text of a string literal."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def subtree(node: ast.AST) -> Iterator[ast.AST]:
    """Yield a node and everything in it, in no particular order, without what inner classes hold."""
    waiting = [node]
    while waiting:
        here = waiting.pop()
        yield here
        waiting.extend(c for c in ast.iter_child_nodes(here) if not isinstance(c, ast.ClassDef))


def _own_name(node: ast.AST | None) -> str:
    """Return the name of a function or method of the file, called as `f` or `self.f`; empty for anything else."""
    name = chain(node)
    return name.removeprefix("self.") if "." not in name.removeprefix("self.") else ""


def _handed_over(call: ast.Call, functions: dict[str, Function]) -> Iterator[ast.AST]:
    """Yield the functions that are given to a call without being called, directly or wrapped in another."""
    for given in [*call.args, *(k.value for k in call.keywords)]:
        called = {id(n.func) for n in subtree(given) if isinstance(n, ast.Call)}
        for node in subtree(given):
            if isinstance(node, ast.Lambda):
                yield node
            elif (
                isinstance(node, (ast.Name, ast.Attribute)) and id(node) not in called and _own_name(node) in functions
            ):
                yield functions[_own_name(node)]
