"""Manuals of checks, read from their docstrings: what is asked, how it is measured, and the parameters."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass

_PARAMETER = re.compile(r"^ {4}(?P<name>\w+): (?P<meaning>.*)$")
_HEADING = "Attributes:"


@dataclass(frozen=True, slots=True)
class Manual:
    """The parts of a docstring.

    Attributes:
        summary: The first paragraph, on one line.
        details: The other paragraphs before the attributes, one per line.
        parameters: Attribute -> its meaning, on one line.
    """

    summary: str
    details: str
    parameters: Mapping[str, str]


def manual_of(kind: type) -> Manual:
    """Return the manual of a class; empty if it has no docstring."""
    written = kind.__doc__ or ""
    # Without a docstring, a dataclass gets its signature as one.
    known = "" if written.startswith(f"{kind.__name__}(") else written
    text, _, attributes = inspect.cleandoc(known).partition(_HEADING)
    paragraphs = [" ".join(p.split()) for p in text.split("\n\n") if p.strip()]
    return Manual(paragraphs[0] if paragraphs else "", "\n".join(paragraphs[1:]), _parameters(attributes))


def _parameters(text: str) -> dict[str, str]:
    found: dict[str, str] = {}
    name = ""
    for line in text.split("\n"):
        start = _PARAMETER.match(line)
        if start is not None:
            name = start["name"]
            found[name] = start["meaning"].strip()
        elif name and line.startswith(" " * 8):
            found[name] += f" {line.strip()}"
        elif line.strip():
            name = ""
    return found
