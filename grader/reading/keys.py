"""Keys that are kept from students: the course key and the seed key, one a file."""

from __future__ import annotations

from pathlib import Path

from grader.model.errors import KeyFileError
from grader.reading.quoting import shown

#: Fewest and most bytes of a key; one that could be guessed would tell students what is drawn.
LEAST_BYTES, MOST_BYTES = 16, 4096


def read_key(path: Path, what: str) -> bytes:
    """Return the key in a file, without the blanks around it.

    Args:
        path: The file.
        what: What messages call the key, such as `course key`.

    Raises:
        KeyFileError: It cannot be used.
    """
    where = shown(str(path), 500)
    try:
        with path.open("rb") as file:
            key = file.read(MOST_BYTES + 1).strip()
    except OSError as error:
        raise KeyFileError(f"{where}: expected a file with the {what}: {error.strerror}") from None
    return checked_key(key, where)


def checked_key(key: bytes, where: str) -> bytes:
    """Return a key; raises KeyFileError for one that is too short or too long, without a word of what is in it."""
    if not LEAST_BYTES <= len(key) <= MOST_BYTES:
        found = f"more than {MOST_BYTES}" if len(key) > MOST_BYTES else str(len(key))
        hint = "make one: head -c 32 /dev/urandom | base64 > course.key"
        raise KeyFileError(f"{where}: expected a key of {LEAST_BYTES} to {MOST_BYTES} bytes, found {found}", hint)
    return key
