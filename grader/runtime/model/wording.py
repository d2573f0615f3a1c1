"""Names and foreign text in messages."""

from __future__ import annotations

from collections.abc import Container, Sequence
from itertools import count

#: Longest piece of foreign text in a message, in characters.
SHOWN_LENGTH = 80


def printable(text: str, limit: int = SHOWN_LENGTH) -> str:
    """Return text as one printable line, with escaped control characters and lone surrogates, cut in the middle."""
    kept = text if len(text) <= 2 * limit else text[:limit] + text[-limit:]
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in kept)
    if len(line) <= limit and len(kept) == len(text):
        return line
    head = (limit - 1) // 2
    return f"{line[: limit - 1 - head]}…{line[len(line) - head :]}"


def listed(names: list[str] | tuple[str, ...], conjunction: str = "or") -> str:
    """Return names as a phrase: `a`, `a or b`, `a, b or c`; needs at least one name."""
    if len(names) == 1:
        return names[0]
    return f"{', '.join(names[:-1])} {conjunction} {names[-1]}"


def first_of(names: Sequence[str]) -> str:
    """Return the first three names as a phrase that ends in `and 2 more`, if there are more."""
    more = [f"{len(names) - 3} more"] if len(names) > 3 else []
    return listed([*map(printable, names[:3]), *more], "and")


def unused_name(name: str, used: Container[str]) -> str:
    """Return a name, with the first number from 2 on that makes it one that is not used, if it is."""
    if name not in used:
        return name
    return next(one for number in count(2) if (one := f"{name} ({number})") not in used)
