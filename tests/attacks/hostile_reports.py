"""Reads reports as their readers do, and says what hostile text has become in them."""

from __future__ import annotations

import base64
import csv
import io
import json
import re
import unicodedata
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping
from html.parser import HTMLParser
from typing import Any

from markdown_it import MarkdownIt

#: The word that every hostile text has in it.
OURS = re.compile("attack(69|7[0-2])")
_COMMAND = re.compile(r"^\s*(::(set-output|add-mask|stop-commands|set-env|add-path|save-state)\b|##\[)", re.MULTILINE)
_ANNOTATION = re.compile(r"^\s*::(error|warning|notice)[^:\n]*::attack70", re.MULTILINE)
_BIDI = set("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_RUNNABLE = ("", "text/javascript", "module", "application/javascript")
#: Formats that a terminal or the log of a workflow shows as they are.
_PRINTED = ("text", "markdown", "github")


def objections(format_: str, content: bytes) -> Iterator[str]:
    """Yield what hostile text does in a report of a format."""
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        yield f"it is not UTF-8: {error}"
        return
    if format_ in _PRINTED:
        yield from _controls(text)
        commands = (_COMMAND.search(text), _ANNOTATION.search(text))
        yield from (f"a workflow command: {found[0].strip()}" for found in commands if found)
    yield from READERS[format_](text)


def _nothing(text: str) -> Iterator[str]:
    del text
    yield from ()


def _controls(text: str) -> Iterator[str]:
    found = {c for c in text if c in _BIDI or (unicodedata.category(c) == "Cc" and c not in "\n\t")}
    if found:
        yield f"control characters: {sorted(map(ascii, found))}"


def _json(text: str) -> Iterator[str]:
    try:
        value = json.loads(text, parse_constant=_refuse)
    except ValueError as error:
        yield f"it is not JSON: {error}"
        return
    for part in _dicts(value):
        if part.get("output_format", "text") == "html":
            yield from _page(str(part.get("output", "")))
        elif part.get("output_format") == "md":
            yield from _markdown(str(part.get("output", "")))


def _packed(text: str) -> Iterator[str]:
    """Look into what is handed on as base64, so that nothing reads it on the way."""
    yield from _json(base64.b64decode(text).decode("utf-8"))


def _refuse(constant: str) -> Any:
    raise ValueError(f"{constant} is no JSON")


def _dicts(value: Any) -> Iterator[dict[str, Any]]:
    if isinstance(value, dict):
        yield value
        value = list(value.values())
    if isinstance(value, list):
        for part in value:
            yield from _dicts(part)


def _xml(text: str) -> Iterator[str]:
    yield from _controls(text)
    try:
        tree = ET.fromstring(text)
    except ET.ParseError as error:
        yield f"it is not XML: {error}"
        return
    yield from (
        f"an element {element.tag}" for element in tree.iter() if OURS.search(element.tag) or element.tag == "img"
    )


def _cells(text: str) -> Iterator[str]:
    for row in csv.reader(io.StringIO(text)):
        yield from (f"a formula: {cell[:60]}" for cell in row if cell.startswith(_FORMULA) and OURS.search(cell))


def _markdown(text: str) -> Iterator[str]:
    yield from _page(MarkdownIt("commonmark", {"html": True}).enable("table").render(text))


def _page(text: str) -> Iterator[str]:
    page = _Page()
    page.feed(text)
    page.close()
    yield from _controls("".join(page.shown))
    yield from page.found


class _Page(HTMLParser):
    """Notes what of a page would run, load or lead somewhere because of a hostile text."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.shown: list[str] = []
        self._script: str | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Look at an element that hostile text may have made."""
        values = {name: value or "" for name, value in attrs}
        if tag == "script":
            self._script = values.get("type", "")
        if tag in ("iframe", "object", "embed", "base") or (tag == "img" and values.get("src") == "x"):
            self.found.append(f"an element {tag}")
        for name, value in values.items():
            leads = name in ("href", "src", "action", "style", "srcdoc") and not value.startswith("data:")
            if OURS.search(value) and (name.startswith("on") or leads):
                self.found.append(f"an attribute {name}={value[:60]}")
            if name.startswith("on") and OURS.search(name + value):
                self.found.append(f"a handler {name}")

    def handle_endtag(self, tag: str) -> None:
        """Leave a script."""
        if tag == "script":
            self._script = None

    def handle_data(self, data: str) -> None:
        """Look at the text of scripts: what runs must not hold a hostile text, and data must be whole."""
        if self._script is None:
            self.shown.append(data)
            return
        if self._script.lower() in _RUNNABLE and OURS.search(data):
            self.found.append("a script with hostile text")
        if self._script == "application/json":
            try:
                json.loads(data)
            except ValueError:
                self.found.append("embedded data that was cut short")


#: What looks at the reports of each format, and at the gradebook (`csv`): what hostile text would do there.
READERS: Mapping[str, Callable[[str], Iterator[str]]] = {
    **dict.fromkeys(("json", "gradescope", "prairielearn", "classroom50"), _json),
    **dict.fromkeys(("text", "github"), _nothing),
    "classroom": _packed,
    "csv": _cells,
    "html": _page,
    "junit": _xml,
    "markdown": _markdown,
}
