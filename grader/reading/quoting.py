"""How text that somebody else wrote is shown inside a one-line message."""

#: Longest piece of foreign text in a message, in characters.
SHOWN_LENGTH = 80


def shown(text: str, limit: int = SHOWN_LENGTH) -> str:
    """Return text as one printable line: control characters and lone surrogates escaped, cut in the middle.

    Args:
        text: Anything: file names and YAML scalars may hold line breaks, escapes and undecodable bytes.
        limit: Longest result, in characters.
    """
    kept = text if len(text) <= 2 * limit else text[:limit] + text[-limit:]
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in kept)
    if len(line) <= limit and len(kept) == len(text):
        return line
    head = (limit - 1) // 2
    return f"{line[: limit - 1 - head]}…{line[len(line) - head :]}"


def listed(names: list[str] | tuple[str, ...], conjunction: str = "or") -> str:
    """Return names as a phrase: `a`, `a or b`, `a, b or c`; at least one name."""
    if len(names) == 1:
        return names[0]
    return f"{', '.join(names[:-1])} {conjunction} {names[-1]}"
