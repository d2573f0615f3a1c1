"""Reads the text of the graded files, for whoever explains what is in them."""

from __future__ import annotations

import io
import tokenize
from pathlib import Path

from grader.model.submission import Submission

#: Of a file that is longer, no text is given.
MAX_SOURCE_BYTES = 1 << 20


def read_sources(submission: Submission) -> dict[str, str]:
    """Return wanted file name -> text, of the staged files that were found and can be decoded as Python does it."""
    texts = {
        wanted: source_text(submission.root / file.found)
        for wanted, file in submission.files.items()
        if file.found is not None
    }
    return {wanted: text for wanted, text in texts.items() if text is not None}


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
