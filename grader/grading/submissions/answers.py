"""The words in which the contained process says what it found in a program."""

from __future__ import annotations

from typing import Final

#: What a file is said to use that is too long, too deep or too costly to be examined, and one that is not text, or in
#: an unusual encoding.
LONG_FILE, UNREADABLE = "a very long file", "a file that cannot be read as text"
#: What depends on the hashes of a process.
ORDER: Final = "the order of a set"
HASHES = frozenset((ORDER, "hash"))
#: Why a file is not examined.
LONG, DEEP, COSTLY = "long", "deep", "costly"
#: The most names of one file, and the most characters of a name and of an error.
MOST_NAMES, NAME_CHARACTERS, ERROR_CHARACTERS = 100, 200, 500
