"""Causes behind files that Python cannot read."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grader.core.trace import Fault, FaultKind
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.wording import quote

_PRINT = re.compile(r"^\s*print\s+(?P<what>[^(].*)$")
_OPERATORS = ((r"\belse\s+if\b", "elif"), (r"&&", "and"), (r"\|\|", "or"), (r"\+\+\s*$", "+= 1"))
#: What Python says, and what to do; the first that fits counts.
_SAYINGS: Sequence[tuple[str, str]] = (
    (r"^TabError", "indent every line with spaces only, four a level: this one mixes tabs and spaces with others"),
    (r"expected ':'", "a colon is missing at the end of: {code}"),
    (r"unindent does not match", "the line begins with {indent}: indent it exactly as the other lines of its block"),
    (r"unexpected indent", "the line begins with {indent}, more than its block: indent it as the line above"),
    (r"expected an indented block after", "indent what belongs to the line above, or write pass there"),
    (r"'(.)' was never closed", "a bracket that is opened here is never closed: {code}"),
    (r"unmatched '(.)'", "there is one closing bracket too many: {code}"),
    (r"does not match opening parenthesis", "the brackets do not match: {code}"),
    (
        r"invalid character '.' \(U\+(2018|2019|201C|201D|00B4|201E)\)",
        "these are typographic quotation marks; type them again as ' or \"",
    ),
    (r"invalid non-printable character", "an invisible character was copied along: type the line again"),
    (r"unterminated (triple-quoted )?string literal", "the quotation mark at the end of the text is missing: {code}"),
    (r"Maybe you meant '==' or ':=' instead|Maybe you meant '==' instead", "to compare, write == instead of ="),
    (r"Perhaps you forgot a comma", "a comma is probably missing in: {code}"),
    (r"'return' outside function", "return stands outside a function: indent it as the function's other lines"),
)


def _syntax(case: Case) -> Clue | None:
    fault = case.fault
    if fault is None or fault.kind is not FaultKind.SYNTAX_ERROR:
        return None
    row = case.source.line(fault.line) if case.source is not None else ""
    return _python_2(fault, row) or _newer_f_string(fault, row) or _other_language(fault, row) or _said(fault, row)


def _python_2(fault: Fault, row: str) -> Clue | None:
    if not fault.said("call to 'print'"):
        return None
    found = _PRINT.match(row[:200])
    shown = f"print({found['what'].strip()})" if found else "print(...)"
    return Clue(f"this is Python 2; in Python 3 print is a function: {quote(shown, 70)}", key="python_2")


def _newer_f_string(fault: Fault, row: str) -> Clue | None:
    if not fault.said("f-string") or fault.python is None or fault.python >= (3, 12):
        return None
    nested = re.search(r"""[fF](['"])[^'"]*\{[^}'"]*\1""", row[:500])
    if nested is None:
        return None
    other = '"' if nested[1] == "'" else "'"
    hint = f"Python 3.{fault.python[1]}, which reads the file here, wants other quotation marks inside the braces"
    return Clue(f"{hint} than around them: {other}")


def _other_language(fault: Fault, row: str) -> Clue | None:
    if not fault.said("invalid syntax"):
        return None
    right = next((word for pattern, word in _OPERATORS if re.search(pattern, row[:500])), None)
    return Clue(f"in Python this is written {right}: {quote(row, 60)}") if right else None


def _said(fault: Fault, row: str) -> Clue | None:
    template = next((template for pattern, template in _SAYINGS if fault.said(pattern)), None)
    if template is None or ("{code}" in template and not row.strip()):
        return None
    return Clue(template.format(code=quote(row, 60), indent=_indent(row)))


def _indent(row: str) -> str:
    blank = row[: len(row) - len(row.lstrip())]
    tabs, spaces = blank.count("\t"), blank.count(" ")
    parts = [f"{n} {word}{'s' if n != 1 else ''}" for n, word in ((tabs, "tab"), (spaces, "space")) if n]
    return " and ".join(parts) or "no space"


def _encoding(case: Case) -> Clue | None:
    fault = case.fault
    if fault is None or fault.kind is not FaultKind.SYNTAX_ERROR or not fault.said("encoding|codec can't decode"):
        return None
    return Clue("save the file as UTF-8")


def _null_bytes(case: Case) -> Clue | None:
    if case.fault is None or not case.fault.said("null bytes"):
        return None
    return Clue("the file holds bytes that are no text: save it as UTF-8 in a text editor")


SYNTAX = (Cause("syntax", _syntax), Cause("encoding", _encoding), Cause("null_bytes", _null_bytes))
