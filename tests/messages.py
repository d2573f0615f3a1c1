"""Prints every sentence that a user can read, each once, by kind and place: `.venv/bin/python tests/messages.py`.

The sentences of the code come from its string literals, with values as `{...}`; those of the pages from their
templates and scripts; those of the exercises from their rubrics; those that whole reports hold from the golden texts of
the tests. `tests/test_messages.py` checks the wording of all of them.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple

from jinja2 import Environment
from pygments.lexers import JavascriptLexer
from pygments.token import String
from ruamel.yaml import YAML
from source_trees import nodes_of, parsed

ROOT = Path(__file__).resolve().parent.parent
#: Files with reasons, hints and titles, and those with texts for pages.
TABLES = (
    "tests/*/golden.yaml",
    "tests/*/*/golden.yaml",
    "tests/grading/judging/diagnosis/*.yaml",
    "rubrics/*/rubric.yaml",
)
PAGES, SCRIPTS = "grader/**/templates/*.html", "grader/**/assets/*.js"
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
#: A label of one word in a script, as `"Cases"`; class names, events and keys begin with a small letter.
_LABEL = re.compile(r"(?:\W )?[A-Z][a-z]+\.?")
#: Elements that are part of a sentence, and attributes that are read to people.
_INLINE = frozenset({"a", "abbr", "b", "bdi", "code", "em", "i", "mark", "span", "strong"})
_SPOKEN = frozenset({"alt", "aria-label", "aria-roledescription", "placeholder", "title"})
#: Statements of a template that separate texts, what stands for them and for an expression while the page is parsed.
_APART = frozenset({"block", "elif", "else", "endblock", "endmacro", "macro"})
_BREAK = "<hr>"
_PLACEHOLDER = re.compile("\ue000(\\d+)\ue001")


class Sentence(NamedTuple):
    """A text for people: what it is (`error`, `hint`, ...), where it is written, and its words."""

    kind: str
    place: str
    text: str


def _documented(source: str) -> set[ast.AST]:
    """Return the docstrings of a module, and the parts of f-strings, which are no sentences of their own."""
    found: set[ast.AST] = set()
    for node in nodes_of(source):
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
    skipped = _documented(source)

    def visit(node: ast.AST, above: list[ast.AST]) -> Iterator[Sentence]:
        text = words_of(node) if node not in skipped else ""
        if _WORDS.search(text):
            yield Sentence(_kind(above), f"{place}:{node.lineno}", text)  # type: ignore[attr-defined]
        for child in ast.iter_child_nodes(node):
            yield from visit(child, [*above, node])

    yield from sorted(visit(parsed(source), []), key=lambda each: int(each.place.rpartition(":")[2]))


def in_remarks(source: str, place: str) -> Iterator[Sentence]:
    """Yield the docstrings and comments in the source of a module, which only authors read."""
    for node in nodes_of(source):
        if isinstance(node, ast.Expr) and (text := words_of(node.value)):
            yield Sentence("docstring", f"{place}:{node.lineno}", text)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield Sentence("comment", f"{place}:{token.start[0]}", token.string)


class _Page(HTMLParser):
    """Collects the texts of a page: what stands between two elements that begin a line, and spoken attributes."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[tuple[int, str]] = []
        self._said: list[str] = []
        self._line = 1
        self._silent = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin another text, unless the element is part of one."""
        if tag not in _INLINE:
            self.finish()
        self._silent = tag in ("script", "style")
        spoken = [value for name, value in attrs if name in _SPOKEN and value]
        self.found += [(self.getpos()[0], text) for value in spoken for text in value.split(_BREAK)]

    def handle_endtag(self, tag: str) -> None:
        """End the text with the element that it is in."""
        if tag not in _INLINE:
            self.finish()
        self._silent = False

    def handle_data(self, data: str) -> None:
        """Add to the text that has begun, or begin it."""
        if self._silent:
            return
        if not self._said and data.strip():
            self._line = self.getpos()[0]
        self._said += [data] if self._said or data.strip() else []

    def finish(self) -> None:
        """Keep the text that has begun."""
        text = " ".join("".join(self._said).split())
        self.found += [(self._line, text)] if text else []
        self._said = []


def in_page(template: str, place: str) -> Iterator[Sentence]:
    """Yield the texts of a template, with its expressions as `{...}`, and the sentences in its expressions."""
    plain, inside = "", ""
    literals: list[tuple[int, str]] = []
    expressions: list[str] = []
    for line, kind, token in Environment(autoescape=True).lex(template):
        plain += "\n" * (line - 1 - plain.count("\n"))
        if kind == "data":
            plain += token
        elif kind in ("variable_begin", "block_begin"):
            inside = ""
        elif kind == "variable_end":
            plain += f"\ue000{len(expressions)}\ue001"
            expressions.append(inside.strip())
        elif kind == "block_end":
            plain += _BREAK if inside.split()[0] in _APART else ""
        else:
            inside += token
            literals += [(line, token[1:-1])] if kind == "string" and _WORDS.search(token) else []
    page = _Page()
    page.feed(plain)
    page.finish()
    for line, text in sorted(page.found + literals):
        if re.search("[A-Za-z]{2}", _PLACEHOLDER.sub("", text)):
            words = _PLACEHOLDER.sub(lambda found: f"{{{expressions[int(found[1])]}}}", text)
            yield Sentence("page", f"{place}:{line}", words)


def in_script(source: str, place: str) -> Iterator[Sentence]:
    """Yield the sentences and labels in the strings of a script, with values as `{...}`."""
    found: list[tuple[int, str]] = []
    open_ones: list[tuple[int, str]] = []  # templates around this token, with what was read of them
    inside = False  # an expression of the innermost one
    for position, kind, token in JavascriptLexer(stripnl=False).get_tokens_unprocessed(source):
        part = token
        if kind in String.Backtick and token == "`" and (inside or not open_ones):
            open_ones.append((position, ""))
            inside = False
            continue
        if kind in String.Backtick and token == "`":
            found.append(open_ones.pop())
            inside, part = bool(open_ones), f"`{found[-1][1]}`"
        elif kind in String.Interpol:
            inside, part = token != "}", token.removeprefix("$")
        elif kind in String and kind not in String.Backtick and kind not in String.Regex:
            found.append((position, token[1:-1]))
        if open_ones:
            open_ones[-1] = (open_ones[-1][0], open_ones[-1][1] + part)
    for position, text in sorted(found):
        said = re.sub(r"\\u([0-9a-f]{4})", lambda code: chr(int(code[1], 16)), text)
        if _WORDS.search(said) or _LABEL.fullmatch(said):
            yield Sentence("page", f"{place}:{source.count(chr(10), 0, position) + 1}", said)


def _in_tables() -> Iterator[Sentence]:
    """Yield the reasons, hints and titles of golden texts and rubrics; two that differ in numbers only are one."""

    def visit(value: object, key: str, place: str) -> Iterator[Sentence]:
        pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        for name, inner in pairs:
            yield from visit(inner, str(name) if isinstance(value, dict) else key, place)
        if isinstance(value, str) and key in ("reason", "hint", "title"):
            yield Sentence(key, place, value)

    for pattern in TABLES:
        for path in sorted(ROOT.glob(pattern)):
            table = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
            yield from visit(table, "", path.relative_to(ROOT).as_posix())


@cache
def sentences() -> tuple[Sentence, ...]:
    """Return all sentences, each once, sorted by place in the code, then those of pages, and of golden texts."""
    found: dict[str, Sentence] = {}
    for path in sorted([*(ROOT / "grader").rglob("*.py"), *(ROOT / "rubrics").rglob("*.py")]):
        for sentence in in_code(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()):
            found.setdefault(sentence.text, sentence)
    for pattern, read in ((PAGES, in_page), (SCRIPTS, in_script)):
        for path in sorted(ROOT.glob(pattern)):
            for sentence in read(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()):
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
