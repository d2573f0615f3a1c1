"""Quotes commands for a shell."""

from __future__ import annotations

import shlex
from collections.abc import Sequence


def command_line(words: Sequence[str]) -> str:
    """Return words as one line for a POSIX shell, or for bash where a word is unprintable."""
    return " ".join(map(quoted, words))


def quoted(word: str) -> str:
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
    return "".join(f"\\x{byte:02x}" for byte in character.encode("utf-8", _surrogates(character)))


def _surrogates(character: str) -> str:
    return "surrogateescape" if "\udc80" <= character <= "\udcff" else "surrogatepass"
