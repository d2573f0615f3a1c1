"""Makes text that a student controls harmless to show: no control codes, no tricks with direction, no endless lines."""

from __future__ import annotations

import re
import unicodedata

#: Longest piece of foreign text that a report for people shows, in characters.
LIMIT = 500
ELLIPSIS = "…"

# Controls, invisible format characters (bidi overrides among them), surrogates, line separators, and code points
# whose glyph nobody can foretell.
_UNSAFE_CATEGORIES = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
_COMBINING_CATEGORIES = frozenset({"Mn", "Me"})
# More marks than this on one letter serve to paint over the neighbouring lines.
_MOST_MARKS = 3
_SURROGATE = re.compile("[\ud800-\udfff]")
# What the grader's own sentences use beyond ASCII, for outputs that cannot say it.
_PLAIN = str.maketrans({"─": "-", "▶": ">", "±": "+/-", "°": "deg ", "…": "..."})


def shown(text: str, *, limit: int = LIMIT) -> str:
    r"""Return foreign text as one line that is safe on a terminal.

    Line breaks, escape sequences, direction overrides and other unprintable characters appear as `\n`, `\x1b`
    or `\u202e`; every kind of space is a plain one.

    Args:
        text: Anything, lone surrogates included.
        limit: Most characters returned, at least 1; a longer text ends in an ellipsis.
    """
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


def valid_unicode(text: str) -> str:
    """Return the text with every lone surrogate replaced by U+FFFD, so that it can be encoded."""
    return _SURROGATE.sub("\ufffd", text)


def encoded(text: str, encoding: str) -> bytes:
    """Return the text in the encoding of an output; where that is a poor one, signs give way to plain ones."""
    try:
        return text.encode(encoding)
    except UnicodeEncodeError:
        return text.translate(_PLAIN).encode(encoding, errors="replace")


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
