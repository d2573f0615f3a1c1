"""Mistakes of authors in their own checks: in what a check raises, and in what it returns."""

from __future__ import annotations

import sys
from collections.abc import Mapping

from grader.grading.model.exercise import Check, Finding, Location, Problem, ProblemKind
from grader.grading.model.wording import quote
from grader.runtime.model.author_files import AuthorMistake, error_words, line_of


def is_authored(check: Check) -> bool:
    """Return whether a check is in a file of a rubric's author, and not one of the grader's."""
    return not type(check).__module__.startswith("grader.")


def mistake_of(check: Check, error: BaseException) -> AuthorMistake:
    """Return an error in a check of an author's as a mistake, at the last line of the author's file that led to it."""
    path = _file_of(check)
    return AuthorMistake(_base(path), line_of(error, path), f"{type(error).__name__}: {quote(error_words(error))}")


def mistake_in(check: Check, method: str, text: str) -> AuthorMistake:
    """Return what is wrong with the value of a method as a mistake, at the line in which the method begins."""
    code, path = getattr(getattr(type(check), method, None), "__code__", None), _file_of(check)
    line = code.co_firstlineno if code is not None and code.co_filename == path else 0
    return AuthorMistake(_base(path), line, text)


def _file_of(check: Check) -> str:
    return getattr(sys.modules.get(type(check).__module__), "__file__", None) or ""


def _base(path: str) -> str:
    return path.rsplit("/", 1)[-1]


#: Deepest nesting of evidence.
_DEEPEST = 12


def finding_flaw(finding: object) -> str:
    """Describe what is wrong with a check's return value, as the end of a sentence; empty if it is a valid finding.

    The credit needs no look: `Finding` refuses a wrong one.
    """
    if not isinstance(finding, Finding):
        return f"returned a {type(finding).__name__}, expected a Finding"
    return _wrong_text(finding) or _wrong_place(finding.location) or _wrong_problem(finding.problem) or _odd(finding)


def _wrong_text(finding: Finding) -> str:
    for name in ("reason", "hint", "brief"):
        text = getattr(finding, name)
        if not isinstance(text, str):
            return f"gave a {name} of type {type(text).__name__}, expected a str"
    if not isinstance(finding.blocked_by, (str, type(None))):
        return f"gave a blocked_by of type {type(finding.blocked_by).__name__}, expected the id of a criterion"
    return ""


def _wrong_place(place: Location | None) -> str:
    if not isinstance(place, (Location, type(None))):
        return f"gave a location of type {type(place).__name__}, expected a Location"
    if place is not None and (not place.file or place.line < 1):
        return f"gave the location {quote(place.file)}:{place.line}, expected a file and a line from 1 on"
    return ""


def _wrong_problem(problem: Problem | None) -> str:
    if problem is None:
        return ""
    if not isinstance(problem, Problem):
        return f"gave a problem of type {type(problem).__name__}, expected a Problem"
    if not isinstance(problem.kind, ProblemKind):
        return f"gave a problem of the kind {problem.kind!r}, expected a ProblemKind"
    plain = isinstance(problem.topics, tuple) and all(isinstance(topic, str) for topic in problem.topics)
    plain &= isinstance(problem.detail, str) and isinstance(problem.start, (int, type(None)))
    return "" if plain else "gave a problem whose topics, detail or start have a wrong type"


def _odd(finding: Finding) -> str:
    plain = isinstance(finding.evidence, Mapping) and _is_plain(finding.evidence, _DEEPEST)
    return "" if plain else "gave evidence that holds more than plain JSON values"


def _is_plain(value: object, depth: int) -> bool:
    if value is None or isinstance(value, (bool, int, float, str)):
        return True
    if depth == 0:
        return False
    if isinstance(value, Mapping):
        return all(isinstance(key, str) and _is_plain(inner, depth - 1) for key, inner in value.items())
    return isinstance(value, (list, tuple)) and all(_is_plain(inner, depth - 1) for inner in value)
