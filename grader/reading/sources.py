"""Reads the text of the graded files, for whoever explains what is in them."""

from __future__ import annotations

import io
import tokenize
from pathlib import Path

from grader.model.submission import Submission
from grader.reading.internals import LONG, reaching

#: Of a file that is longer, no text is given.
MAX_SOURCE_BYTES = 1 << 20
#: Of more than this in all files nothing more is read.
MAX_PROGRAM_BYTES = 4 << 20
#: Modules that Python imports without their source.
COMPILED = (".so", ".pyc", ".pyo", ".pth")


def read_sources(submission: Submission) -> dict[str, str]:
    """Return wanted file name -> text, of the staged files that were found and can be decoded as Python does it."""
    texts = {
        wanted: source_text(submission.root / file.found)
        for wanted, file in submission.files.items()
        if file.found is not None
    }
    return {wanted: text for wanted, text in texts.items() if text is not None}


def read_reaches(root: Path) -> tuple[str, ...]:
    """Return by what names the files of a staged submission reach for the insides of their process, each once.

    A module that is no text, or more text than anybody reads, counts as reaching.
    """
    found: list[str] = []
    size = 0
    for path in sorted(root.rglob("*")):
        if path.suffix in COMPILED:
            found.append(f"a {path.suffix} file")
        elif path.suffix == ".py" and path.is_file():
            size += path.stat().st_size
            if size > MAX_PROGRAM_BYTES:
                return (*dict.fromkeys(found), LONG)
            text = source_text(path)
            found += reaching(text) if text is not None else ()
    return tuple(dict.fromkeys(found))


def source_text(path: Path) -> str | None:
    """Return the text of a staged file, or None if it is too long or not text in the encoding that it names."""
    try:
        with path.open("rb") as file:
            content = file.read(MAX_SOURCE_BYTES + 1)
        if len(content) > MAX_SOURCE_BYTES:
            return None
        encoding, _ = tokenize.detect_encoding(io.BytesIO(content).readline)
        return io.TextIOWrapper(io.BytesIO(content), encoding, newline=None).read()
    except (OSError, SyntaxError, UnicodeError, LookupError):
        return None
