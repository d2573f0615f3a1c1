"""Prints every sentence that a user can read, each once, by kind and place: `.venv/bin/python tests/messages.py`.

The sentences of the code come from its string literals, with values as `{...}`; those that whole reports hold come
from the golden texts of the tests. `tests/test_messages.py` checks the wording of all of them.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parent.parent
GOLDEN = ("*/golden.yaml", "*/*/golden.yaml", "judging/diagnosis/*.yaml")
#: What marks a string literal as text for people: two words in a row.
_WORDS = re.compile(r"[A-Za-z]{2,}[,:;]? (?:[A-Za-z]|\{)|\} [a-z]{2,}")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
#: Where the literal of each kind is written: as this keyword, or in a call of a function that is named like this.
_KEYWORDS = {
    "help": "help",
    "hint": "hint",
    "reason": "reason",
    "note": "note",
    "title": "title",
    "expected": "expected",
}
_CALLS = (
    (re.compile(r"Error$|Refused$|Exception$|BadParameter$"), "error"),
    (re.compile(r"^(?:Clue|Cause)$|hint", re.IGNORECASE), "hint"),
    (re.compile(r"^(?:met|partly|not_met|undecided|Finding|Problem)$|problem|reason", re.IGNORECASE), "reason"),
    (re.compile(r"note|complain|warn", re.IGNORECASE), "note"),
    (re.compile(r"option|argument|command", re.IGNORECASE), "help"),
)


class Sentence(NamedTuple):
    """A text for people: what it is (`error`, `hint`, ...), where it is written, and its words."""

    kind: str
    place: str
    text: str


def _documented(tree: ast.Module) -> set[ast.AST]:
    """Return the docstrings of a module, and the parts of f-strings, which are no sentences of their own."""
    found: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            found.add(node.value)
        elif isinstance(node, ast.JoinedStr):
            found.update(part for part in ast.walk(node) if part is not node)
    return found


def words_of(node: ast.AST) -> str:
    """Return the text of a string or f-string with `{expression}` for each value; empty for anything else."""
    if isinstance(node, ast.JoinedStr):
        parts = (p.value if isinstance(p, ast.Constant) else f"{{{ast.unparse(p.value)}}}" for p in node.values)  # type: ignore[attr-defined]
        return "".join(map(str, parts))
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def _kind(above: list[ast.AST]) -> str:
    """Return the kind of a literal by what encloses it, from the outside to the inside."""
    for node in reversed(above):
        if isinstance(node, ast.keyword) and node.arg in _KEYWORDS:
            return _KEYWORDS[node.arg]
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func).rpartition(".")[2]
            found = next((kind for pattern, kind in _CALLS if pattern.search(name)), "")
            if found:
                return found
        if isinstance(node, ast.Raise):
            return "error"
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            return "text"
    return "text"


def in_code(source: str, place: str) -> Iterator[Sentence]:
    """Yield the sentences in the source of a module, in the order of its lines."""
    tree = ast.parse(source)
    skipped = _documented(tree)

    def visit(node: ast.AST, above: list[ast.AST]) -> Iterator[Sentence]:
        text = words_of(node) if node not in skipped else ""
        if _WORDS.search(text):
            yield Sentence(_kind(above), f"{place}:{node.lineno}", text)  # type: ignore[attr-defined]
        for child in ast.iter_child_nodes(node):
            yield from visit(child, [*above, node])

    yield from sorted(visit(tree, []), key=lambda each: int(each.place.rpartition(":")[2]))


def _in_tables() -> Iterator[Sentence]:
    """Yield the reasons and hints of the golden texts; two that differ in numbers only are one."""

    def visit(value: object, key: str, place: str) -> Iterator[Sentence]:
        pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        for name, inner in pairs:
            yield from visit(inner, str(name) if isinstance(value, dict) else key, place)
        if isinstance(value, str) and key in ("reason", "hint", "title"):
            yield Sentence(key, place, value)

    for pattern in GOLDEN:
        for path in sorted((ROOT / "tests").glob(pattern)):
            table = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
            yield from visit(table, "", path.relative_to(ROOT).as_posix())


@cache
def sentences() -> tuple[Sentence, ...]:
    """Return all sentences, each once, sorted by place in the code, then those of the golden texts."""
    found: dict[str, Sentence] = {}
    for path in sorted([*(ROOT / "grader").rglob("*.py"), *(ROOT / "rubrics").rglob("*.py")]):
        for sentence in in_code(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()):
            found.setdefault(sentence.text, sentence)
    for sentence in _in_tables():
        found.setdefault(_NUMBER.sub("0", sentence.text), sentence)
    return tuple(found.values())


def main() -> None:
    """Print the sentences whose kind or place contains all of the arguments."""
    for kind, place, text in sentences():
        if all(word in f"{kind} {place}" for word in sys.argv[1:]):
            print(f"{place} [{kind}] {text.strip()!r}")


if __name__ == "__main__":
    main()
