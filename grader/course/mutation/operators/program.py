"""A parsed program for operators: its syntax tree with lines, parents and constants, and edits of its source."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, TypeVar, cast

import libcst as cst
from libcst import matchers as m
from libcst.metadata import CodeRange, MetadataWrapper, ParentNodeProvider, PositionProvider

from grader.runtime.model.dataclass import dataclass

Node = TypeVar("Node", bound=cst.CSTNode)
#: A node and its replacement: another node, several nodes, or nothing.
Replacement = cst.CSTNode | cst.FlattenSentinel[cst.CSTNode] | cst.RemovalSentinel
Edit = tuple[cst.CSTNode, Replacement]

#: Parameters of the methods that create rclpy entities, in order.
CREATORS: Mapping[str, tuple[str, ...]] = {
    "create_publisher": ("msg_type", "topic", "qos_profile"),
    "create_subscription": ("msg_type", "topic", "callback", "qos_profile"),
    "create_service": ("srv_type", "srv_name", "callback"),
    "create_client": ("srv_type", "srv_name"),
    "create_timer": ("timer_period_sec", "callback"),
    "create_rate": ("frequency",),
}
#: Methods of an rclpy logger.
LEVELS = ("debug", "info", "warn", "warning", "error", "fatal")


@dataclass(frozen=True, slots=True)
class Mutation:
    """One way to change a program: the node that gives the line, the change in one line, and its edits."""

    at: cst.CSTNode
    detail: str
    edits: tuple[Edit, ...]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A changed program: a mutant or a correct variant."""

    id: str  # stays the same as long as the reference solution does
    file: str  # name of the file
    operator: str  # key of `OPERATORS` or of `VARIANTS`
    source: str  # the whole program
    detail: str = ""  # the change of a mutant, in one line


class ParsedProgram:
    """A parsed program; raises libcst.ParserSyntaxError for one that is not valid Python."""

    def __init__(self, source: str) -> None:
        wrapper = MetadataWrapper(cst.parse_module(source))
        self.module = wrapper.module
        self._places = cast("Mapping[cst.CSTNode, CodeRange]", wrapper.resolve(PositionProvider))
        self._parents = cast("Mapping[cst.CSTNode, cst.CSTNode]", wrapper.resolve(ParentNodeProvider))

    def code(self, node: cst.CSTNode) -> str:
        """Return the text of a node."""
        return self.module.code_for_node(node)

    def specification(self, part: cst.BaseFormattedStringContent) -> str:
        """Return how an f-string formats a value, such as `.2f`; empty if it does not say, and for text."""
        pieces = part.format_spec if isinstance(part, cst.FormattedStringExpression) else None
        return "".join(map(self.code, pieces or ()))

    def line(self, node: cst.CSTNode) -> int:
        """Return the first line of a node, starting at 1."""
        return self._places[node].start.line

    def all(self, kind: type[Node], inside: cst.CSTNode | None = None) -> list[Node]:
        """Return the nodes of a kind, in the order of the text."""
        found = cast("Sequence[Node]", m.findall(inside or self.module, m.MatchIfTrue(lambda n: isinstance(n, kind))))
        return sorted(found, key=self._start)

    def _start(self, node: cst.CSTNode) -> tuple[int, int]:
        start = self._places[node].start
        return start.line, start.column

    def above(self, node: cst.CSTNode) -> Iterator[cst.CSTNode]:
        """Yield the ancestors of a node, from the inside out."""
        while (parent := self._parents.get(node)) is not None:
            yield parent
            node = parent

    def enclosing(self, node: cst.CSTNode, kind: type[Node]) -> Node | None:
        """Return the innermost node of a kind around a node."""
        return next((above for above in self.above(node) if isinstance(above, kind)), None)

    def calls(self, *names: str) -> list[cst.Call]:
        """Return the calls of functions or methods with these names."""
        return [call for call in self.all(cst.Call) if called(call) in names]

    def arguments(self, name: str, *creators: str) -> list[tuple[cst.Call, cst.BaseExpression]]:
        """Return the calls of these creating methods that pass a parameter, each with what it passes."""
        given = ((call, passed_argument(call, name)) for call in self.calls(*creators))
        return [(call, value) for call, value in given if value is not None]

    def constant(self, expression: cst.BaseExpression | None) -> cst.BaseExpression | None:
        """Return the expression that defines a value: itself, or the only assignment to its name."""
        if not isinstance(expression, (cst.Name, cst.Attribute)):
            return expression
        values = self._assigned.get(self.code(expression), [])
        return values[0] if len(values) == 1 else expression

    @cached_property
    def _assigned(self) -> Mapping[str, list[cst.BaseExpression]]:
        values: dict[str, list[cst.BaseExpression]] = {}
        for assign in self.all(cst.Assign):
            for target in assign.targets:
                values.setdefault(self.code(target.target), []).append(assign.value)
        return values

    @cached_property
    def callbacks(self) -> list[cst.FunctionDef]:
        """The callbacks of timers, subscriptions, services and futures."""
        done = [call.args[0].value for call in self.calls("add_done_callback") if call.args]
        return self._functions([*done, *(callback for _, callback in self.arguments("callback", *CREATORS))])

    def handed_to(self, creator: str) -> list[cst.FunctionDef]:
        """Return the callbacks passed to the methods that create a kind of entity."""
        return self._functions(callback for _, callback in self.arguments("callback", creator))

    def _functions(self, handed: Iterable[cst.BaseExpression]) -> list[cst.FunctionDef]:
        names = {last_part(expression) for expression in handed}
        return [function for function in self.all(cst.FunctionDef) if function.name.value in names]

    def importing(self, line: str) -> tuple[Edit, ...]:
        """Return the edits that add an import; none if the program already has it."""
        imports = [
            s for s in self.module.body if m.matches(s, m.SimpleStatementLine(body=[m.Import() | m.ImportFrom()]))
        ]
        if not imports or any(self.code(statement).strip() == line for statement in imports):
            return ()
        added = cst.parse_statement(line)
        return ((imports[-1], cst.FlattenSentinel([added, imports[-1]])),)

    def changed(self, edits: Sequence[Edit]) -> str:
        """Return the source after edits."""
        replacements: dict[cst.CSTNode, Replacement] = {}
        for old, new in edits:
            before = replacements.get(old)
            replacements[old] = new if before is None else _joined(before, new)
        return self.module.visit(_Replacing(replacements)).code

    def replacing(self, node: cst.CSTNode, after: cst.CSTNode | str, *, at: cst.CSTNode | None = None) -> Mutation:
        """Return the mutation with another node, or the expression in a text, in the place of a node."""
        new = cst.parse_expression(after) if isinstance(after, str) else after
        return Mutation(at or node, into(self.code(node), self.code(new)), ((node, new),))

    def swapping(self, at: cst.CSTNode, one: cst.CSTNode, other: cst.CSTNode) -> Mutation:
        """Return the mutation with two nodes in each other's place."""
        return Mutation(at, f"{self.code(one)} <-> {self.code(other)}", ((one, other), (other, one)))

    def without(self, node: cst.CSTNode) -> Mutation:
        """Return the mutation without a statement."""
        return Mutation(node, f"no {in_one_line(self.code(node))}", ((node, cst.Pass()),))


class _Replacing(cst.CSTTransformer):
    def __init__(self, replacements: Mapping[cst.CSTNode, Replacement]) -> None:
        super().__init__()
        self._replacements = replacements

    def on_leave(self, original_node: Any, updated_node: Any) -> Any:
        return self._replacements.get(original_node, updated_node)


def _joined(one: Replacement, other: Replacement) -> Replacement:
    """Merge two insertions before the same statement."""
    assert isinstance(one, cst.FlattenSentinel)
    assert isinstance(other, cst.FlattenSentinel)
    return cst.FlattenSentinel([*list(one)[:-1], *list(other)])


def called(call: cst.Call) -> str:
    """Return the last part of the called name; empty if there is none."""
    return last_part(call.func)


def last_part(expression: cst.BaseExpression) -> str:
    """Return `b` for `a.b` and for `b`; empty for anything without a name."""
    if isinstance(expression, cst.Attribute):
        return expression.attr.value
    return expression.value if isinstance(expression, cst.Name) else ""


def passed_argument(call: cst.Call, name: str) -> cst.BaseExpression | None:
    """Return what is passed for a parameter of a creating method, by name or position; None if nothing is."""
    for arg in call.args:
        if arg.keyword is not None and arg.keyword.value == name:
            return arg.value
    names = CREATORS.get(called(call), ())
    place = names.index(name) if name in names else len(call.args)
    plain = [arg.value for arg in call.args if arg.keyword is None and not arg.star]
    return plain[place] if place < len(plain) else None


def without_comma(items: Sequence[Node]) -> list[Node]:
    """Return arguments or parameters without a comma after the last one."""
    return [*items[:-1], items[-1].with_changes(comma=cst.MaybeSentinel.DEFAULT)] if items else []


def plain_string(node: cst.CSTNode | None) -> str | None:
    """Return the value of a plain string; None for anything else."""
    if not isinstance(node, cst.SimpleString) or isinstance(node.evaluated_value, bytes):
        return None
    return node.evaluated_value


def string(text: str) -> cst.SimpleString:
    """Return a string literal, in double quotes."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return cst.SimpleString(f'"{escaped}"')


def is_docstring(program: ParsedProgram, node: cst.CSTNode) -> bool:
    """Whether a string is a statement by itself."""
    return isinstance(next(program.above(node), None), cst.Expr)


def literal_number(node: cst.CSTNode | None) -> float | int | None:
    """Return the value of a number literal; None for anything else."""
    return node.evaluated_value if isinstance(node, (cst.Integer, cst.Float)) else None


def number_literal(value: float) -> cst.BaseExpression:
    """Return a number literal without floating-point noise."""
    text = repr(value) if isinstance(value, int) else repr(float(f"{value:.12g}"))
    return cst.parse_expression(text)


def into(before: str, after: str) -> str:
    """Return `before -> after`, short and on one line."""
    return f"{in_one_line(before)} -> {in_one_line(after)}"


def in_one_line(text: str, limit: int = 40) -> str:
    """Shorten a text to one line."""
    line = " ".join(text.split())
    return line if len(line) <= limit else f"{line[: limit - 1]}…"
