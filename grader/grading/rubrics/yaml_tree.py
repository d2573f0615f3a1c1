"""YAML text as plain values, with the line and column of every key and value."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Any, cast

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, StreamMark, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.wording import printable

#: Deepest nesting, and most values after expanding aliases: a small file can expand to billions of values.
MAX_DEPTH = 24
MAX_VALUES = 20_000

#: Keys and list indices from the root of a document to a value.
TreePath = tuple[str | int, ...]


@dataclass(frozen=True, slots=True, order=True)
class Mistake:
    """A mistake in a file; line and column count from 1."""

    line: int
    column: int
    text: str
    hint: str = ""


@dataclass(frozen=True, slots=True, order=True)
class Position:
    """A position in a file; line and column count from 1."""

    line: int
    column: int

    def mistake(self, text: str, hint: str = "") -> Mistake:
        """Return a mistake at this position."""
        return Mistake(self.line, self.column, text, hint)


TOP = Position(1, 1)


def end_of(text: str) -> Position:
    """Return the position after a text from the top of a file."""
    return Position(text.count("\n") + 1, len(text) - text.rfind("\n"))


@dataclass(slots=True)
class YamlTree:
    """A parsed document."""

    data: object = None
    values: dict[TreePath, Position] = field(default_factory=dict)  # position of each value
    keys: dict[TreePath, Position] = field(default_factory=dict)  # position of the key of each value in a mapping
    # Text of each plain value as it is written: YAML reads `+5`, `0x5` and `5` as the same number
    texts: dict[TreePath, str] = field(default_factory=dict)
    # Invalid parts: duplicate keys, keys that are not text, unknown tags
    mistakes: list[Mistake] = field(default_factory=list)

    def raw(self, path: TreePath) -> Any:
        """Return a value as it was read, which has to be there."""
        here: Any = self.data
        for part in path:
            here = here[part]
        return here

    def at(self, path: TreePath) -> Position:
        """Return the position of a value; the top of the file if it is not there."""
        return self.values.get(path, TOP)

    def at_key(self, path: TreePath) -> Position:
        """Return the position of the key of a value; the top of the file if it is not there."""
        return self.keys.get(path, TOP)


class YamlSyntaxError(Exception):
    """The text is not a YAML document."""

    def __init__(self, mistake: Mistake) -> None:
        super().__init__(mistake.text)
        self.mistake = mistake


def read_yaml(text: str) -> YamlTree:
    """Parse one YAML 1.2 document, whose size the caller limits; the data of an empty document is None.

    Raises:
        YamlSyntaxError: Not valid YAML, several documents, or nested or expanded beyond the limits.
    """
    try:
        _refuse_excess(text)
        root = _yaml().compose(text)
    except ReaderError as error:
        raise YamlSyntaxError(_unreadable_character(text, error)) from None
    except MarkedYAMLError as error:
        raise YamlSyntaxError(_syntax_mistake(error)) from None
    except (YAMLError, ValueError, LookupError, AttributeError, AssertionError) as error:
        # The parser lets some of its own exceptions escape on malformed directives and escapes.
        raise YamlSyntaxError(TOP.mistake(f"not valid YAML: {printable(str(error))}")) from None
    tree = YamlTree()
    if root is not None:
        tree.data = _Reader(tree).value(root, ())
    return tree


def _yaml() -> YAML:
    return YAML(typ="safe", pure=True)


def _refuse_excess(text: str) -> None:
    """Check the event stream first: composing a hundred thousand open brackets exhausts the stack."""
    depth = 0
    for count, event in enumerate(_yaml().parse(text)):
        kind = type(event).__name__
        depth += kind.endswith("StartEvent") - kind.endswith("EndEvent")
        deep = depth > MAX_DEPTH + 2  # the stream and the document count as well
        if count > MAX_VALUES or deep:
            limit = f"{MAX_VALUES} values" if count > MAX_VALUES else f"{MAX_DEPTH} levels"
            where = _position(event.start_mark)
            raise YamlSyntaxError(where.mistake(f"expected at most {limit}, found more"))


def _position(mark: StreamMark | None) -> Position:
    return TOP if mark is None else Position(mark.line + 1, mark.column + 1)


def _unreadable_character(text: str, error: ReaderError) -> Mistake:
    character = printable(text[error.position : error.position + 1])
    return end_of(text[: error.position]).mistake(f"expected text, found the control character {character}")


def _syntax_mistake(error: MarkedYAMLError) -> Mistake:
    where = _position(error.problem_mark or error.context_mark)
    problem = str(error.problem or error.context)
    if problem.startswith("but "):
        problem = f"{error.context}, {problem}"
    problem = printable(" ".join(problem.split()), 160)
    hint = "indent with spaces, not with tabs" if "\\t" in problem else ""
    return where.mistake(f"not valid YAML: {problem}", hint)


class _Reader:
    """Converts nodes to plain values and records their positions."""

    def __init__(self, tree: YamlTree) -> None:
        self._tree = tree
        self._count = 0
        self._construct = _yaml().constructor.construct_object

    def value(self, node: Node, path: TreePath) -> object:
        where = _position(node.start_mark)
        self._count += 1
        if self._count > MAX_VALUES or len(path) > MAX_DEPTH:
            raise YamlSyntaxError(where.mistake("expected a small document, found aliases that multiply it"))
        self._tree.values[path] = where
        if isinstance(node, MappingNode):
            return self._mapping(node, path)
        if isinstance(node, SequenceNode):
            return [self.value(item, (*path, i)) for i, item in enumerate(node.value)]
        self._tree.texts[path] = str(node.value)
        return self._scalar(cast("ScalarNode", node))

    def _mapping(self, node: MappingNode, path: TreePath) -> Mapping[str, object]:
        found: dict[str, object] = {}
        for key_node, value_node in node.value:
            where = _position(key_node.start_mark)
            if not isinstance(key_node, ScalarNode):
                self._tree.mistakes.append(where.mistake("expected a key of one word, found a list or a mapping"))
                continue
            key = str(key_node.value)
            if key in found:
                first = self._tree.keys[(*path, key)].line
                text = f"expected each key once, found `{printable(key)}` again (first in line {first})"
                self._tree.mistakes.append(where.mistake(text))
                continue
            self._tree.keys[(*path, key)] = where
            found[key] = self.value(value_node, (*path, key))
            if value_node.value == "":  # an empty value would otherwise be placed at the next token
                self._tree.values[(*path, key)] = where
        return found

    def _scalar(self, node: ScalarNode) -> object:
        where = _position(node.start_mark)
        tag = re.sub(r"^tag:yaml\.org,2002:", "!!", str(node.tag))
        if tag not in _PLAIN_TAGS:
            self._tree.mistakes.append(where.mistake(f"expected a plain value, found the tag {printable(tag)}"))
            return str(node.value)
        if tag in _TEXT_TAGS:
            return str(node.value)
        try:
            return self._construct(node)
        except (YAMLError, ValueError, KeyError, OverflowError):
            text = f"expected a value of the kind {tag}, found `{printable(str(node.value))}`"
            self._tree.mistakes.append(where.mistake(text))
            return str(node.value)


# Dates, and the `=` and `<<` of older YAML, are plain text here.
_TEXT_TAGS = frozenset({"!!str", "!!timestamp", "!!value", "!!merge"})
_PLAIN_TAGS = _TEXT_TAGS | {"!!int", "!!float", "!!bool", "!!null"}


def nearest_position(positions: Mapping[TreePath, Position], path: Iterable[str | int]) -> tuple[TreePath, Position]:
    """Return the longest known prefix of a path and its position; parts that are not in the file are skipped."""
    known: TreePath = ()
    for part in path:
        if (*known, part) in positions:
            known = (*known, part)
    return known, positions.get(known, TOP)
