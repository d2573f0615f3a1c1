"""Facts about a student's file that no recording shows: what its classes derive from, and which calls stand where."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field

from grader.judging.source import Function, Source, chain, last_name, subtree

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
class Code:
    """A file with its names resolved.

    Attributes:
        source: The file.
        aliases: Name in the file -> the dotted name it was imported as.
        stars: Modules of which everything was imported.
    """

    source: Source
    aliases: dict[str, str] = field(default_factory=dict)
    stars: tuple[str, ...] = ()

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

    def calls(self, wanted: str) -> list[ast.Call]:
        """Return the calls of something, in the order of the text."""
        return [call for call in self.source.all(ast.Call) if self.means(call.func, wanted)]

    def deriving(self, *wanted: str) -> list[ast.ClassDef]:
        """Return the classes that derive from one of those named, also by way of another class of the file."""
        found: list[ast.ClassDef] = []
        while True:
            names = {c.name for c in found}
            more = [c for c in self.source.all(ast.ClassDef) if c not in found and self._has_base(c, wanted, names)]
            if not more:
                return found
            found += more

    def _has_base(self, class_: ast.ClassDef, wanted: tuple[str, ...], known: set[str]) -> bool:
        return any(chain(base) in known or any(self.means(base, w) for w in wanted) for base in class_.bases)

    def called_back(self) -> list[ast.AST]:
        """Return the functions that run as callbacks, and what these call in the file, each once."""
        functions = {f.name: f for f in self.source.functions()}
        waiting: list[ast.AST] = [f for call in self._takers() for f in _handed_over(call, functions)]
        found: list[ast.AST] = []
        while waiting:
            here = waiting.pop()
            if here in found:
                continue
            found.append(here)
            called = (n.func for n in subtree(here) if isinstance(n, ast.Call))
            waiting += [functions[name] for func in called if (name := _own_name(func)) in functions]
        return found

    def _takers(self) -> Iterator[ast.Call]:
        for call in self.source.all(ast.Call):
            if last_name(call.func) in _TAKE_CALLBACKS:
                yield call


def code_of(source: Source) -> Code:
    """Return a file with its imports read, wherever in it they stand."""
    aliases: dict[str, str] = {}
    stars: list[str] = []
    for node in source.all(ast.Import):
        for name in node.names:
            aliases[name.asname or name.name.partition(".")[0]] = (
                name.name if name.asname else name.name.partition(".")[0]
            )
    for imported in source.all(ast.ImportFrom):
        for name in imported.names:
            if name.name == "*":
                stars.append(imported.module or "")
            else:
                aliases[name.asname or name.name] = f"{imported.module or ''}.{name.name}"
    return Code(source, aliases, tuple(stars))


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
