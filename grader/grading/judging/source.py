"""A student's file as a syntax tree; reading any text, however strange, raises nothing.

The trees of what students handed in are made by a contained process; only texts of an author's tests are parsed here.
"""

from __future__ import annotations

import ast
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, TypeVar

from grader.grading.judging.syntax import MOST_DEPTH, MOST_NODES, children, measured, tree_of
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.submission import SourceText

if TYPE_CHECKING:
    from grader.grading.model.exercise import Location

#: Longer files are not parsed, in characters: student nodes are far shorter.
LONGEST_SOURCE = 100_000
#: Longest quotation of code inside a hint, in characters.
CODE_LENGTH = 70
#: Where a node keeps its dotted name.
_CHAIN = "_chain"
#: A function of a student's file.
Function = ast.FunctionDef | ast.AsyncFunctionDef
Loop = ast.While | ast.For
Scope = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
AnyNode = TypeVar("AnyNode", bound=ast.AST)


def words(text: str) -> tuple[str, ...]:
    """Return the words of a text, for long tables of names."""
    return tuple(text.split())


#: Methods that take a callback.
_TAKE_CALLBACKS = words(
    "create_timer create_subscription create_service create_client add_done_callback "
    "add_on_set_parameters_callback add_pre_set_parameters_callback add_post_set_parameters_callback "
    "create_guard_condition ActionServer send_goal_async registerCallback"
)


@dataclass(frozen=True, slots=True)
class Source:
    """One graded file.

    Attributes:
        nodes: All syntax nodes with a line, in the order of the text; empty if the text cannot be parsed.
        parents: Node -> enclosing node.
        index: Nodes by class, in the order of the text.
        called: Calls by the last part of the called name, in the order of the text.
        stored: Assignments to names and attributes by dotted name, in the order of the text.
        aliases: Name in the file -> its dotted name at import.
        stars: Modules imported with `*`.
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
        """Return every name and attribute, in the order of the text."""
        return sorted([*self.all(ast.Name), *self.all(ast.Attribute)], key=_place)

    def stores(self, dotted: str) -> list[ast.Attribute]:
        """Return the assignments to an attribute such as `self.x`, in the order of the text."""
        return [n for n in self.stored.get(dotted, ()) if isinstance(n, ast.Attribute)]

    def calls(self, *names: str) -> Iterator[ast.Call]:
        """Yield the calls of functions or methods with this last part of the name."""
        found = [c for name in dict.fromkeys(names) for c in self.called.get(name, ())]
        yield from found if len(names) == 1 else sorted(found, key=_place)

    def on_line(self, line: int, kind: type[AnyNode]) -> Iterator[AnyNode]:
        """Yield the nodes of a kind that cover a line, the outermost first."""
        for node in self.all(kind):
            if covers(node, line):
                yield node

    def function_at(self, line: int) -> Function | None:
        """Return the innermost function or method that covers a line."""
        return next((f for f in reversed(self.functions()) if covers(f, line)), None)

    def around(self, node: ast.AST, kind: type[AnyNode]) -> Iterator[AnyNode]:
        """Yield the enclosing nodes of a kind, the innermost first."""
        inner: ast.AST | None = self.parents.get(node)
        while inner is not None:
            if isinstance(inner, kind):
                yield inner
            inner = self.parents.get(inner)

    def function_of(self, node: ast.AST) -> Function | None:
        """Return the function or method that encloses a node."""
        return next((n for n in self.around(node, ast.AST) if isinstance(n, Function)), None)

    def function_name(self, node: ast.AST) -> str:
        """Return the name of the function or method that encloses a node; empty outside of functions."""
        function = self.function_of(node)
        return "" if function is None else function.name

    def class_of(self, node: ast.AST) -> ast.ClassDef | None:
        """Return the class that encloses a node."""
        return next(self.around(node, ast.ClassDef), None)

    def functions(self, name: str | None = None) -> list[Function]:
        """Return the functions and methods with a name, or all."""
        both: list[Function] = [*self.all(ast.FunctionDef), *self.all(ast.AsyncFunctionDef)]
        return sorted((f for f in both if name in (None, f.name)), key=_place)

    def is_method(self, function: Function) -> bool:
        """Return whether a function is defined directly in a class and is not static."""
        static = any(last_name(d) == "staticmethod" for d in function.decorator_list)
        return isinstance(self.parents.get(function), ast.ClassDef) and not static

    def place(self, node: ast.AST) -> Location:
        """Return the place where a node begins."""
        from grader.grading.model.exercise import Location  # noqa: PLC0415 - the contained process needs no places

        return Location(self.file, first_line(node))

    def line(self, number: int) -> str:
        """Return a line of the text, counted from 1; empty if it does not exist."""
        return self.lines[number - 1] if 1 <= number <= len(self.lines) else ""

    def code(self, node: ast.AST, length: int = CODE_LENGTH) -> str:
        """Return the source code of a node on one line, cut to `length` characters."""
        from grader.grading.model.wording import quote  # noqa: PLC0415 - as above

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
        """Return the dotted name of an expression with imports resolved: `t.sleep` -> `time.sleep`."""
        name = chain(node)
        head, dot, rest = name.partition(".")
        return f"{self.aliases.get(head, head)}{dot}{rest}"

    def means(self, node: ast.AST | None, wanted: str) -> bool:
        """Return whether an expression has a given full dotted name, or a given last part if that has no dot."""
        if "." not in wanted:
            return last_name(node) == wanted or self.resolved(node).rpartition(".")[2] == wanted
        found = self.resolved(node)
        module, _, name = wanted.rpartition(".")
        return found == wanted or (found == name and module in self.stars)

    def calling(self, wanted: str) -> list[ast.Call]:
        """Return the calls of a function by dotted name, with imports resolved, in the order of the text."""
        return [call for call in self.all(ast.Call) if self.means(call.func, wanted)]

    def deriving(self, *wanted: str) -> list[ast.ClassDef]:
        """Return the classes that derive from one of the given ones, also through another class of the file."""
        found: list[ast.ClassDef] = []
        while True:
            names = {c.name for c in found}
            more = [c for c in self.all(ast.ClassDef) if c not in found and self._has_base(c, wanted, names)]
            if not more:
                return found
            found += more

    def _has_base(self, class_: ast.ClassDef, wanted: tuple[str, ...], known: set[str]) -> bool:
        return any(chain(base) in known or any(self.means(base, w) for w in wanted) for base in class_.bases)

    def called_back(self) -> set[ast.AST]:
        """Return every node of the functions that run as callbacks, and of those of the file that they call."""
        functions = {f.name: f for f in self.functions()}
        waiting: list[ast.AST] = [f for call in self.calls(*_TAKE_CALLBACKS) for f in _handed_over(call, functions)]
        found: set[ast.AST] = set()
        while waiting:
            here = waiting.pop()
            if here in found:  # with all that is in it
                continue
            inside = set(subtree(here))
            found |= inside
            called = (n.func for n in inside if isinstance(n, ast.Call))
            waiting += [functions[name] for func in called if (name := _own_name(func)) in functions]
        return found


def read_source(file: str, text: str) -> Source:
    """Return a file as a tree; one that cannot be parsed, or is too long or too deep, has only lines.

    Args:
        file: Its name.
        text: A `SourceText`, whose tree is known, or the text of an author's own test.
    """
    lines = tuple(text[:LONGEST_SOURCE].split("\n"))
    tree = _kept(text) if isinstance(text, SourceText) else parsed_source(text)
    return Source(file, lines) if tree is None else source_of(file, lines, tree)


def _kept(text: SourceText) -> ast.Module | None:
    """Return the tree of a text, which is made once."""
    if text.kept is None:
        told = text.tree
        text.kept = (None if told is None else tree_of(told),)
    tree = text.kept[0] if isinstance(text.kept, tuple) else None
    return tree if isinstance(tree, ast.Module) else None


def source_of(file: str, lines: Sequence[str], tree: ast.Module) -> Source:
    """Return a file whose tree is within the limits of size and depth."""
    parents: dict[ast.AST, ast.AST] = {}
    nodes: list[ast.AST] = []
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if hasattr(node, "lineno"):
            nodes.append(node)
        for child in children(node):
            parents[child] = node
            waiting.append(child)
    nodes.sort(key=_place)
    index: dict[type[ast.AST], list[Any]] = {}
    for node in nodes:
        index.setdefault(type(node), []).append(node)
    return Source(file, lines, tuple(nodes), tree, parents, index, *_by_name(nodes), *_imported(index))


def _by_name(nodes: Sequence[ast.AST]) -> tuple[dict[str, list[ast.Call]], dict[str, list[ast.AST]]]:
    """Return the calls by called name, and the assignments by assigned name."""
    called: dict[str, list[ast.Call]] = {}
    stored: dict[str, list[ast.AST]] = {}
    for node in nodes:
        if isinstance(node, ast.Call):
            called.setdefault(last_name(node.func), []).append(node)
        elif isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Store):
            stored.setdefault(chain(node), []).append(node)
    return called, stored


def _imported(index: Mapping[type[ast.AST], list[Any]]) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the imported names of the file, wherever imported, and the modules imported with `*`."""
    aliases: dict[str, str] = {}
    stars: list[str] = []
    for node in index.get(ast.Import, ()):
        for name in node.names:
            top = name.name.partition(".")[0]
            aliases[name.asname or top] = name.name if name.asname else top
    for imported in index.get(ast.ImportFrom, ()):
        for name in imported.names:
            if name.name == "*":
                stars.append(imported.module or "")
            else:
                aliases[name.asname or name.name] = f"{imported.module or ''}.{name.name}"
    return aliases, tuple(stars)


def _place(node: Any) -> tuple[int, int, int]:
    """Return a sort key, of a node that has a place, that follows the text and puts outer nodes before inner ones."""
    return node.lineno, node.col_offset, -(node.end_lineno or node.lineno)


def parsed_source(text: str) -> ast.Module | None:
    """Return the tree of a text; None if it cannot be parsed, or is too long or too deep."""
    if len(text) > LONGEST_SOURCE:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the student's invalid escapes must not warn here
        try:
            tree = ast.parse(text.removeprefix("\ufeff"))
        except (SyntaxError, ValueError, RecursionError, MemoryError, OverflowError):
            return None
    count, depth = measured(tree)
    return tree if count <= MOST_NODES and depth <= MOST_DEPTH else None


def first_line(node: ast.AST) -> int:
    """Return the line that a node begins on."""
    return int(getattr(node, "lineno", 0))


def last_line(node: ast.AST) -> int:
    """Return the line that a node ends on."""
    return int(getattr(node, "end_lineno", 0) or first_line(node))


def covers(node: ast.AST, line: int) -> bool:
    """Return whether a node covers a line."""
    return first_line(node) <= line <= last_line(node)


def last_name(node: ast.AST | None) -> str:
    """Return the last part of a name such as `self.get_logger().info`; empty for anything else."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def chain(node: ast.AST | None) -> str:
    """Return a dotted name with `()` for calls: `self.get_logger().info`; empty if it starts with anything else."""
    # each node keeps its own, because a long chain is asked for once for every link
    inner: list[ast.Attribute | ast.Call] = []
    name: str | None = None
    while name is None:
        if isinstance(node, (ast.Attribute, ast.Call)):
            name = node.__dict__.get(_CHAIN)
            if name is None:
                inner.append(node)
                node = node.value if isinstance(node, ast.Attribute) else node.func
        else:
            name = node.id if isinstance(node, ast.Name) else ""
    for link in reversed(inner):
        if name:
            name += f".{link.attr}" if isinstance(link, ast.Attribute) else "()"
        link.__dict__[_CHAIN] = name
    return name


def argument(call: ast.Call, place: int, name: str) -> ast.expr | None:
    """Return an argument by its position or its name."""
    if place < len(call.args) and not any(isinstance(a, ast.Starred) for a in call.args[: place + 1]):
        return call.args[place]
    return next((k.value for k in call.keywords if k.arg == name), None)


def parameters(function: Scope) -> list[str]:
    """Return the names of the positional parameters."""
    return [a.arg for a in (*function.args.posonlyargs, *function.args.args)]


def literal_text(node: ast.AST | None) -> str | None:
    """Return the text of a string literal."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def quoted_number(node: ast.AST | None) -> str:
    """Return the number that a string literal holds, as in `'0.5'`; empty if it holds none."""
    text = (literal_text(node) or "").strip()
    return text if text.lstrip("+-").replace(".", "", 1).isdigit() else ""


def subtree(node: ast.AST) -> Iterator[ast.AST]:
    """Yield a node and everything in it, in no particular order, without the contents of inner classes."""
    waiting = [node]
    while waiting:
        here = waiting.pop()
        yield here
        waiting.extend(c for c in ast.iter_child_nodes(here) if not isinstance(c, ast.ClassDef))


def _own_name(node: ast.AST | None) -> str:
    """Return the name of a function or method of the file, written `f` or `self.f`; empty for anything else."""
    name = chain(node)
    return name.removeprefix("self.") if "." not in name.removeprefix("self.") else ""


def _handed_over(call: ast.Call, functions: dict[str, Function]) -> Iterator[ast.AST]:
    """Yield the functions that are passed to a call without being called, directly or wrapped in another call."""
    for given in [*call.args, *(k.value for k in call.keywords)]:
        called = {id(n.func) for n in subtree(given) if isinstance(n, ast.Call)}
        for node in subtree(given):
            if isinstance(node, ast.Lambda):
                yield node
            elif (
                isinstance(node, (ast.Name, ast.Attribute)) and id(node) not in called and _own_name(node) in functions
            ):
                yield functions[_own_name(node)]
