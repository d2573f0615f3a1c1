"""Formats times, numbers, names and quotations for reasons."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Sequence

from grader.runtime.model.quantities import seconds

#: Longest quotation of a student's text inside a sentence, in characters.
QUOTE_LENGTH = 120
#: Memory address of an object in Python's repr; it differs in every run.
_ADDRESS = re.compile(r" at 0x[0-9a-fA-F]{6,16}\b")
# A name of a file, module, program, node or parameter, as nearly everybody writes it.
_NAME = re.compile(r"(?=.*\w)[\w./+~-]{1,80}…?", re.ASCII)


def moment(t_ns: int) -> str:
    """Return a time as `t = 3.200 s`."""
    return f"t = {seconds(t_ns):.3f} s"


def span(duration_ns: int) -> str:
    """Return a duration as `10.0 s`."""
    return f"{seconds(duration_ns):.1f} s"


def number(value: float) -> str:
    """Return a number with up to six significant digits, without a needless `.0`."""
    return f"{value:.6g}" if math.isfinite(value) else str(value)


def numbers(values: Iterable[float]) -> str:
    """Return numbers as `1, 2.5, 3`."""
    return ", ".join(number(v) for v in values)


def quote(text: str, length: int = QUOTE_LENGTH) -> str:
    """Return a student's text on one line, without memory addresses, cut to `length` characters."""
    line = _ADDRESS.sub("", " ".join(text[: 4 * length].split()))
    return line if len(line) <= length else line[: length - 1] + "…"


def named(text: str, length: int = QUOTE_LENGTH) -> str:
    """Return a student's word inside a sentence of the grader: as it is if it looks like a name, else in quotes.

    Without quotes, words after a full stop would read as the grader's own.
    """
    line = quote(text, length)
    return line if _NAME.fullmatch(line) else f"""'{line.replace("'", '"')}'"""


def in_unit(unit: str) -> str:
    """Return what follows a number that has a unit: the unit after a space; empty if it has none."""
    return f" {unit}" if unit else ""


def nearest(name: str, candidates: Iterable[str]) -> str | None:
    """Return the probable correct spelling of `name`: almost equal, or the same last part; None otherwise."""
    others = sorted(set(candidates) - {name})
    last = _last_part(name)
    same_end = [c for c in others if _last_part(c) == last]
    if same_end:
        return same_end[0]
    close = difflib.get_close_matches(_plain(name), [_plain(c) for c in others], n=1, cutoff=0.7)
    alike = [c for c in others if close and _plain(c) == close[0]]
    alike += [c for c in others if len(_plain(c)) >= 3 and (_plain(c) in _plain(name) or _plain(name) in _plain(c))]
    return next(iter(alike), None)


def first_few(items: Sequence[str], limit: int = 4) -> str:
    """Return items as `a, b and 2 more`."""
    shown = [quote(i, 80) for i in items[:limit]]
    rest = len(items) - len(shown)
    return ", ".join(shown) + (f" and {rest} more" if rest else "")


def _last_part(name: str) -> str:
    return name.rsplit("/", 1)[-1]


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())
