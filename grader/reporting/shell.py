"""Commands as a shell reads them."""

from __future__ import annotations

import shlex
from collections.abc import Sequence


def command_line(words: Sequence[str]) -> str:
    """Return words as one line that a POSIX shell, or bash where a name is unprintable, reads as they are."""
    return " ".join(map(quoted, words))


def quoted(word: str) -> str:
    """Return a word as a shell reads it; one with unprintable characters in bash's own quotes, on one line."""
    if word.isprintable():
        return shlex.quote(word)
    return f"$'{''.join(map(_in_bash_quotes, word))}'"


def _in_bash_quotes(character: str) -> str:
    if character in "\\'":
        return f"\\{character}"
    if character.isprintable():
        return character
    # Bytes that are no UTF-8 came in as lone surrogates; one that stands for no byte has no better name.
    return "".join(f"\\x{byte:02x}" for byte in character.encode("utf-8", _surrogates(character)))


def _surrogates(character: str) -> str:
    return "surrogateescape" if "\udc80" <= character <= "\udcff" else "surrogatepass"
