"""Makes text that a student controls harmless in each output: one small function per output."""

from __future__ import annotations

import json
import math
import re
import shlex
import string
import unicodedata
from collections.abc import Mapping, Sequence
from enum import Enum
from fractions import Fraction
from typing import Any

#: Longest piece of foreign text in a report for people, in characters.
LIMIT = 500
#: The same limit for text of several lines.
LINES_LIMIT = 20_000
ELLIPSIS = "…"

# Controls, invisible format characters (bidi overrides among them), surrogates, line separators, and code points whose
# glyph is unknown.
_UNSAFE_CATEGORIES = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
_COMBINING_CATEGORIES = frozenset({"Mn", "Me"})
# More combining marks than this on one letter would paint over neighbouring lines.
_MOST_MARKS = 3
_SURROGATE = re.compile("[\ud800-\udfff]")
# Replacements for the non-ASCII characters of the grader's own sentences, for encodings that lack them.
_PLAIN = str.maketrans({"─": "-", "▶": ">", "±": "+/-", "°": "deg ", "…": "..."})
_TAB_WIDTH = 4

# Special characters inside Markdown text. As entities they cannot start markup, in a paragraph or in a table cell.
_MARKDOWN_SIGNS = frozenset("\\`*_[]~$<>&|#@")
_NOTHING_VISIBLE = "&#8203;"
# Text that GitHub turns into a mention, reference, link or picture without any Markdown syntax.
_LINKED = re.compile(r"(?i)(?P<before>(?:https?|ftp|www|GH|:[a-z0-9_+-]{1,40}(?=:)))(?P<sign>[:.-])")
# What begins a list, a rule, or the line below the head of a table: `- x`, `1. x`, `===`, `:-`.
_LISTED = re.compile(r"(?P<number>[0-9]{0,9})(?P<sign>[-+=.)]|:(?=-))")
_BACKTICKS = re.compile("`+")

# Before characters that make spreadsheets read a cell as a formula; Excel also accepts the full-width forms. A
# semicolon begins another cell where it separates lists, as in German or French: quotes around all do not count there.
_FORMULA = re.compile(r"(?:^|(?<=;))(?=[ \"]*[=+\-@\uff1d\uff0b\uff0d\uff20])")
# Lines that the GitHub Actions runner executes: the current form at the start of a line, the old one anywhere.
_COMMAND = re.compile(r"^\s*:(?=:)|#(?=#\[)", re.MULTILINE)
# In JSON inside HTML: what could end the script element or start a comment, and what old JavaScript rejects.
_ENDS_SCRIPT = re.compile("[<>&\u2028\u2029]")
# Integers beyond 64 bits are not measurements, and most JSON readers cannot hold them.
_MOST_BITS = 64


def shown(text: str, *, limit: int = LIMIT) -> str:
    r"""Return foreign text as one line that is safe on a terminal.

    Line breaks, escape sequences, direction overrides and other unprintable characters appear as `\n`, `\x1b` or
    `\u202e`; every kind of space becomes a plain one. Lone surrogates are allowed. At most `limit` characters are
    returned, at least 1; a longer text ends in an ellipsis.
    """
    if len(text) <= limit and text.isascii() and text.isprintable():
        return text  # the common case; looking at each character takes a hundred times as long
    pieces: list[str] = []
    length = marks = 0
    for character in text:
        marks = marks + 1 if unicodedata.category(character) in _COMBINING_CATEGORIES else 0
        piece = _escaped(character) if marks > _MOST_MARKS else _piece(character)
        pieces.append(piece)
        length += len(piece)
        if length > limit:
            return _cut(pieces, length, limit)
    return "".join(pieces)


def shown_lines(text: str, *, limit: int = LINES_LIMIT) -> str:
    """Return foreign text of several lines that is safe on a terminal: as `shown`, but its line breaks stay.

    Tabs become spaces up to the next column of four.
    """
    lines: list[str] = []
    left = limit
    for line in text[: limit + 1].replace("\r\n", "\n").split("\n"):
        lines.append(shown(line.expandtabs(_TAB_WIDTH), limit=limit + 1))
        left -= len(lines[-1]) + 1
        if left < -1:
            break
    whole = "\n".join(lines)
    return whole if len(whole) <= limit and len(text) <= limit + 1 else whole[: limit - len(ELLIPSIS)] + ELLIPSIS


def valid_unicode(text: str) -> str:
    """Return the text with every lone surrogate replaced by U+FFFD, so that it can be encoded."""
    return _SURROGATE.sub("\ufffd", text)


def encoded(text: str, encoding: str) -> bytes:
    """Return the text in the encoding of an output; characters that it lacks are replaced by plain ones."""
    try:
        return text.encode(encoding)
    except UnicodeEncodeError:
        return text.translate(_PLAIN).encode(encoding, errors="replace")


def workflow_message(text: str, *, limit: int = LINES_LIMIT) -> str:
    """Return foreign text as the message of a GitHub workflow command, after the second `::`; line breaks stay."""
    return shown_lines(text, limit=limit).replace("%", "%25").replace("\n", "%0A")


def workflow_property(text: str, *, limit: int = LIMIT) -> str:
    """Return foreign text as the value of a property of a GitHub workflow command, such as `file` or `title`."""
    return shown(text, limit=limit).replace("%", "%25").replace(":", "%3A").replace(",", "%2C")


def log_lines(text: str, *, limit: int = LINES_LIMIT) -> str:
    """Return foreign text for the log of a GitHub job: as `shown_lines`, but no line is a workflow command.

    The text is whole lines, including everything that is printed before foreign text in them.
    """
    return without_workflow_commands(shown_lines(text, limit=limit))


def without_workflow_commands(text: str) -> str:
    """Return lines that are otherwise safe with every GitHub workflow command defused."""
    return _COMMAND.sub(r"\g<0>\\", text)


def markdown(text: str, *, limit: int = LIMIT) -> str:
    """Return foreign text as one line of Markdown that shows exactly this text, at most `limit` visible characters.

    The result fits into a paragraph, heading, list or table cell, also at its start: it cannot become markup, HTML, a
    link, picture, formula, mention or reference. An invisible space breaks what GitHub links without any markup.
    """
    line = shown(text, limit=limit).strip(" ")
    line = _LINKED.sub(r"\g<before>\0\g<sign>", line)
    first = _LISTED.match(line)
    begun = f"{first['number']}&#{ord(first['sign'])};" if first else ""
    return begun + "".join(map(_entity, line[first.end() :] if first else line))


def markdown_code(text: str, *, in_cell: bool = False, limit: int = LIMIT) -> str:
    """Return foreign text as a Markdown code span of one line, or nothing if it is empty.

    GitHub links nothing in a code span, so this suits names and values best. In a table cell `|` needs another escape.
    """
    line = shown(text, limit=limit)
    if not line.strip(" "):
        return ""
    fence = "`" * _longer_than_runs(line, 1)
    # One space on either side is not rendered; without it, a backtick at the edge would lengthen the fence.
    padding = " " if line[0] in " `" or line[-1] in " `" else ""
    span = f"{fence}{padding}{line}{padding}{fence}"
    return span.replace("|", "\\|") if in_cell else span


def markdown_block(text: str, *, limit: int = LINES_LIMIT) -> str:
    """Return foreign text as a fenced Markdown code block, for use between blank lines at the left margin."""
    lines = shown_lines(text, limit=limit)
    fence = "`" * _longer_than_runs(lines, 3)
    return f"{fence}text\n{lines}\n{fence}"


def mermaid_label(text: str, *, limit: int = LIMIT) -> str:
    """Return foreign text for a double-quoted label in a Mermaid diagram."""
    signs = frozenset(string.punctuation) - frozenset("/_.,-")
    return "".join(f"#{ord(sign)};" if sign in signs else sign for sign in shown(text, limit=limit))


def script_json(value: object) -> str:
    """Return data as JSON for a script element of an HTML page; it cannot end the element."""
    text = json.dumps(json_value(value), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return _ENDS_SCRIPT.sub(lambda match: f"\\u{ord(match.group()):04x}", text)


def xml_text(text: str, *, limit: int = LINES_LIMIT) -> str:
    """Return foreign text that XML 1.0 can hold, line breaks included; the XML writer escapes `<` and `&`."""
    # Everything illegal in XML (controls, surrogates, U+FFFE and U+FFFF) is in a category that is shown as an escape.
    return shown_lines(text, limit=limit)


def csv_cell(text: str, *, limit: int = LIMIT) -> str:
    """Return foreign text for a CSV cell that no spreadsheet reads as a formula.

    A text that looks like a formula gets a leading apostrophe, and so does one behind a semicolon, which separates
    cells in some countries. Our own numbers do not need this; the CSV writer quotes.
    """
    return _FORMULA.sub("'", shown(text, limit=limit))


def json_value(value: object) -> Any:
    """Return a value as JSON can represent it.

    Fractions become numbers of six digits, NaN and the infinities their names, integers beyond 64 bits a sentence, lone
    surrogates U+FFFD, and everything else its text.
    """
    if type(value) is float:  # the common case: charts are numbers, and abstract classes are slow to ask
        return value if math.isfinite(value) else str(value)
    if isinstance(value, (list, tuple)):
        return [json_value(item) for item in value]
    if isinstance(value, Mapping):
        return {valid_unicode(str(key)): json_value(item) for key, item in value.items()}
    if isinstance(value, Enum):
        return json_value(value.value)
    if value is None or isinstance(value, bool):
        return value
    return _json_number(value) if isinstance(value, (int, float, Fraction)) else valid_unicode(str(value))


def _json_number(value: float | Fraction) -> int | float | str:
    if isinstance(value, Fraction):
        rounded = round(float(value), 6)
        return int(rounded) if rounded.is_integer() else rounded
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    return value if value.bit_length() <= _MOST_BITS else f"an integer of {value.bit_length()} bits"


def _entity(character: str) -> str:
    if character == "\0":  # our own marker: shown text holds no control characters
        return _NOTHING_VISIBLE
    if character not in _MARKDOWN_SIGNS:
        return character
    # After these two, a mention or a reference would follow.
    return f"&#{ord(character)};{_NOTHING_VISIBLE if character in '@#' else ''}"


def _longer_than_runs(text: str, least: int) -> int:
    return max([least, *(len(run) + 1 for run in _BACKTICKS.findall(text))])


def _piece(character: str) -> str:
    category = unicodedata.category(character)
    if category == "Zs" or character == "\t":
        return " "
    return _escaped(character) if category in _UNSAFE_CATEGORIES else character


def _escaped(character: str) -> str:
    if character == "\n":
        return "\\n"
    if character == "\r":
        return "\\r"
    code = ord(character)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def _cut(pieces: list[str], length: int, limit: int) -> str:
    while pieces and length > limit - len(ELLIPSIS):
        length -= len(pieces.pop())
    return "".join(pieces) + ELLIPSIS


def shell_line(words: Sequence[str]) -> str:
    """Return words as one line for a POSIX shell, or for bash where a word is unprintable."""
    return " ".join(map(shell_quoted, words))


def shell_quoted(word: str) -> str:
    """Return a word quoted for a shell, on one line; unprintable characters use the quotes of bash."""
    if word.isprintable():
        return shlex.quote(word)
    return f"$'{''.join(map(_in_bash_quotes, word))}'"


def _in_bash_quotes(character: str) -> str:
    if character in "\\'":
        return f"\\{character}"
    if character.isprintable():
        return character
    # Bytes that are not UTF-8 arrive as lone surrogates; other surrogates are written as they are.
    surrogates = "surrogateescape" if "\udc80" <= character <= "\udcff" else "surrogatepass"
    return "".join(f"\\x{byte:02x}" for byte in character.encode("utf-8", surrogates))
