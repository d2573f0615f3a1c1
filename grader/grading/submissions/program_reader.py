"""Reads one Python file of a submission, in the contained process that can do nothing else: its text, tree and names.

No code of a student is imported or run: it is only parsed.
"""

from __future__ import annotations

import codecs
import encodings
import encodings.aliases
import io
import os
from collections.abc import Iterable
from typing import Any, NamedTuple

from grader.grading.judging.source import LONGEST_SOURCE, source_of
from grader.grading.judging.syntax import MOST_DEPTH, MOST_NODES, json_of, measured
from grader.grading.submissions.answers import (
    DEEP,
    ERROR_CHARACTERS,
    HASHES,
    LONG,
    LONG_FILE,
    MOST_NAMES,
    NAME_CHARACTERS,
    UNREADABLE,
)
from grader.grading.submissions.reaching import reaching
from grader.grading.submissions.source_encodings import BOM, UNUSUAL, USUAL, encoding_of
from grader.runtime.model.limits import MAX_PARSED_BYTES
from grader.runtime.programs.beginning import beginning_of
from grader.runtime.programs.inert import is_inert, read_inert


class Described(NamedTuple):
    """What a file holds: a row that JSON can hold, its text and tree if it has any, and how many nodes were counted."""

    row: dict[str, Any]
    text: bytes | None = None
    tree: bytes | None = None
    nodes: int = 0


def load_encodings(contents: Iterable[bytes]) -> frozenset[str]:
    """Load the encodings of some files, which a confined process could not; return those of this Python, by modules."""
    for encoding in {encoding_of(content) for content in contents} & (USUAL | UNUSUAL):
        codecs.lookup(encoding)
    names = os.listdir(os.path.dirname(encodings.__file__ or ""))  # noqa: PTH120, PTH208 - imports nothing more
    return frozenset(name.removesuffix(".py") for name in names) | frozenset(encodings.aliases.aliases)


def program_description(  # noqa: PLR0911  one for each kind of file
    content: bytes, known: frozenset[str], *, decoded: bool = False
) -> Described:
    """Return what a file holds; reading any file, however strange, raises nothing.

    Args:
        content: Its bytes.
        known: What `prepare` returned.
        decoded: Whether it is a text that was decoded before, so that it is in UTF-8 whatever it declares.
    """
    encoding = "utf_8" if decoded else encoding_of(content)
    if encoding not in USUAL | UNUSUAL and encoding in known:
        return Described({"reaches": [UNREADABLE]})
    text = _decoded(content, encoding)
    usual = encoding in USUAL and text is not None
    odd = () if usual or b"\0" in content else (UNREADABLE,)  # Python refuses a source with a null byte
    told = None if text is None else text.encode()
    parsable = len(content) <= MAX_PARSED_BYTES
    if text is not None and not parsable and len(text) > LONGEST_SOURCE:
        return Described({"reaches": [LONG_FILE, *odd], "problem": LONG}, told)
    found = read_inert(text if decoded and text is not None else content)
    if isinstance(found, SyntaxError):
        error = [type(found).__name__, str(found.msg)[:ERROR_CHARACTERS], _line(found)]
        return Described({"reaches": [*odd], **({"error": error} if parsable else {})}, told)
    if found is None:
        return Described({"reaches": [LONG_FILE, *odd], "problem": DEEP}, told)
    state: dict[str, Any] = {"inert": parsable and is_inert(found)}
    if parsable:
        begins = beginning_of(found)
        node = begins.node if len(begins.node) <= NAME_CHARACTERS else ""
        state["begins"] = [begins.starts, begins.main, begins.offers_main, node]
    if text is None:  # Python decodes it otherwise than texts are read here
        return Described({"reaches": [*odd], **state})
    nodes, depth = measured(found)
    if nodes > MOST_NODES or depth > MOST_DEPTH or len(text) > LONGEST_SOURCE:
        problem = DEEP if depth > MOST_DEPTH else LONG
        return Described({"reaches": [LONG_FILE, *odd], "problem": problem, **state}, told, None, nodes)
    names = (*reaching(source_of("", text.split("\n"), found)), *odd)
    return Described({"reaches": _shortened(names), **state}, told, json_of(found), nodes)


def _decoded(content: bytes, encoding: str) -> str | None:
    """Return the text of a file; None if it is not text in its encoding."""
    if content.startswith(BOM) and encoding != "utf_8":
        return None
    try:
        return io.TextIOWrapper(io.BytesIO(content.removeprefix(BOM)), encoding, newline=None).read()
    except (UnicodeError, LookupError):
        return None


def _line(error: SyntaxError) -> int | None:
    return error.lineno if isinstance(error.lineno, int) and 0 <= error.lineno < 1 << 31 else None


def _shortened(names: tuple[str, ...]) -> list[str]:
    """Return the first names, and those on which the seed of hashes depends."""
    first = dict.fromkeys((*names[:MOST_NAMES], *(name for name in names if name in HASHES)))
    return [name[:NAME_CHARACTERS] for name in first]
