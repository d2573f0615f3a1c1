"""Reads one Python file of a submission, in the contained process that can do nothing else: its text, tree and names.

No code of a student is imported or run: it is only parsed.
"""

from __future__ import annotations

import codecs
import encodings
import encodings.aliases
import io
import os
import tokenize
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
from grader.runtime.model.limits import MAX_PARSED_BYTES
from grader.runtime.programs.inert import is_inert, read

#: Encodings in which editors save programs, by their modules, and others that real programs have, whose declaration is
#: unusual enough to be noticed. All take linear time; `punycode` and `idna` do not.
USUAL = frozenset(
    (
        *("utf_8", "ascii", "latin_1"),
        *(f"iso8859_{part}" for part in range(1, 17)),
        *(f"cp125{part}" for part in range(9)),
    )
)
UNUSUAL = frozenset(
    [
        "gbk",
        "gb2312",
        "gb18030",
        "big5",
        "big5hkscs",
        "cp950",
        "shift_jis",
        "cp932",
        "euc_jp",
        "euc_kr",
        "cp949",
        "koi8_r",
        "koi8_u",
        "mac_roman",
        "cp437",
        "cp850",
        "cp866",
        "tis_620",
    ]
)
#: How much of a file is searched for its encoding, which stands in the first two lines.
HEAD_BYTES = 400
_BOM = b"\xef\xbb\xbf"


class Described(NamedTuple):
    """What a file holds: a row that JSON can hold, its text and tree if it has any, and how many nodes were counted."""

    row: dict[str, Any]
    text: bytes | None = None
    tree: bytes | None = None
    nodes: int = 0


def prepare(contents: Iterable[bytes]) -> frozenset[str]:
    """Load the encodings of some files, which a confined process could not; return those of this Python, by modules."""
    for encoding in {encoding_of(content) for content in contents} & (USUAL | UNUSUAL):
        codecs.lookup(encoding)
    names = os.listdir(os.path.dirname(encodings.__file__ or ""))  # noqa: PTH120, PTH208 - imports nothing more
    return frozenset(name.removesuffix(".py") for name in names) | frozenset(encodings.aliases.aliases)


def encoding_of(content: bytes) -> str:
    """Return the encoding that a file declares, as the name of its module; UTF-8 if it declares none."""
    for line in content[:HEAD_BYTES].removeprefix(_BOM).split(b"\n", 2)[:2]:
        text = line.decode("latin-1")
        found = tokenize.cookie_re.match(text)
        if found is not None:
            return _module_of(found[1])
        if text.strip() and not text.lstrip().startswith("#"):
            break
    return "utf_8"


def _module_of(name: str) -> str:
    plain = encodings.normalize_encoding(name).lower()
    # Python takes these with anything behind them, such as `utf-8-unix`
    for begin, module in (("utf_8", "utf_8"), ("latin_1", "latin_1"), ("iso_8859_1_", "latin_1")):
        if plain == begin.rstrip("_") or plain.startswith(f"{begin.rstrip('_')}_"):
            return module
    return encodings.aliases.aliases.get(plain, plain)


def described(  # noqa: PLR0911  one for each kind of file
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
    found = read(text if decoded and text is not None else content)
    if isinstance(found, SyntaxError):
        error = [type(found).__name__, str(found.msg)[:ERROR_CHARACTERS], _line(found)]
        return Described({"reaches": [*odd], **({"error": error} if parsable else {})}, told)
    if found is None:
        return Described({"reaches": [LONG_FILE, *odd], "problem": DEEP}, told)
    state = {"inert": parsable and is_inert(found)}
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
    if content.startswith(_BOM) and encoding != "utf_8":
        return None
    try:
        return io.TextIOWrapper(io.BytesIO(content.removeprefix(_BOM)), encoding, newline=None).read()
    except (UnicodeError, LookupError):
        return None


def _line(error: SyntaxError) -> int | None:
    return error.lineno if isinstance(error.lineno, int) and 0 <= error.lineno < 1 << 31 else None


def _shortened(names: tuple[str, ...]) -> list[str]:
    """Return the first names, and those on which the seed of hashes depends."""
    first = dict.fromkeys((*names[:MOST_NAMES], *(name for name in names if name in HASHES)))
    return [name[:NAME_CHARACTERS] for name in first]
