"""What makes two lost points the same: the kind of a cause, without the numbers and names of one student."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

_VARYING = "#"
# Longest text that is looked at; the kind of what is longer is in its beginning.
_MOST = 600
# In this order: what is quoted may hold anything, a place holds a number, a call holds names.
_PATTERNS = (
    (re.compile(r"(?<!\w)'[^'\n]*'|\"[^\"\n]*\"|`[^`\n]*`"), "'…'"),
    (re.compile(r"(?<![\w.])[\w./-]+\.pyi?\b(?::\d+){0,2}"), "FILE"),
    (re.compile(r"\b[A-Za-z_][\w.]*\([^()\n]*(?:\)|…)"), "CALL"),
    (re.compile(r"(?<![\w/])/[A-Za-z_][\w/]*"), "/NAME"),
    (re.compile(r"\b[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+\b"), "NAME"),
    (
        re.compile(r"(?<![\w.])[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?(?![\w.]*\d)|\b(?:nan|inf)\b", re.IGNORECASE),
        _VARYING,
    ),
    (re.compile(rf"{_VARYING}(?:(?:, | and | to | or ){_VARYING})+"), _VARYING),
    (re.compile(r"\s+"), " "),
)
#: Exceptions whose words come from Python and say what happened.
_OWN_WORDS = frozenset({"AttributeError", "ImportError", "IndexError", "ModuleNotFoundError", "NameError", "TypeError"})
_EXCEPTION = re.compile(r"(?P<type>[A-Za-z_][\w.]{0,80})(?::\s*(?P<text>.*))?", re.DOTALL)


@dataclass(frozen=True, order=True, slots=True)
class Kind:
    """The kind of a cause.

    Attributes:
        source: What told it: `diagnosis`, `missing`, `fault` or `reason`.
        key: The same for the same kind.
    """

    source: str
    key: str

    @property
    def label(self) -> str:
        """The kind in a few words."""
        if self.source == "diagnosis":
            return self.key.replace("_", " ")
        return {"missing": "file missing", "fault": "fault"}.get(self.source, "as measured")


def kind_of(criterion: Mapping[str, Any]) -> Kind:
    """Return the kind of cause for which a criterion lost points.

    What the diagnosis named is surest; then a missing file, a fault, and at last the words of the reason.

    Args:
        criterion: A criterion of a report, as JSON values.
    """
    evidence = criterion.get("evidence")
    evidence = evidence if isinstance(evidence, Mapping) else {}
    named, missing, fault = (evidence.get(key) for key in ("diagnosis", "missing", "fault"))
    if isinstance(named, str) and named:
        return Kind("diagnosis", named)
    if isinstance(missing, str) and missing:
        return Kind("missing", missing)
    if isinstance(fault, Mapping):
        return Kind("fault", f"{fault.get('kind')} {_exception(str(fault.get('text', '')))}")
    return Kind("reason", skeleton(str(criterion.get("reason", "")).split(";", 1)[0]))


def skeleton(text: str) -> str:
    """Return a sentence without what differs from student to student.

    Numbers, lists of numbers, quotations, file names with lines, calls, attributes and names of topics become signs for
    them: `10.00 Hz` and `9.98 Hz` are the same, and so are `self.timer` and `self.clock_timer`.
    """
    found = text[:_MOST]
    for pattern, sign in _PATTERNS:
        found = pattern.sub(sign, found)
    return found.strip().casefold()


def _exception(text: str) -> str:
    """Return the type of an exception, with the words of Python's own ones: those of a student are no kind."""
    match = _EXCEPTION.fullmatch(text[:_MOST].strip())
    if match is None:
        return skeleton(text.split("\n", 1)[0])
    own = match["type"] in _OWN_WORDS and match["text"]
    return f"{match['type']}: {skeleton(match['text'].split(chr(10), 1)[0])}" if own else match["type"]
