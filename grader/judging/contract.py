"""What a finding has to be for a report to be made of it; checks of a rubric's own may get it wrong."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from grader.core.exercise import Finding, Location, Problem

#: Deepest nesting of evidence.
_DEEPEST = 12


def breach(finding: object) -> str:
    """Return what is wrong with what a check returned, as the end of a sentence; empty if it is a good finding."""
    if not isinstance(finding, Finding):
        return f"returned a {type(finding).__name__}, expected a Finding"
    if isinstance(finding.credit, bool) or not isinstance(finding.credit, (int, Fraction)):
        return f"gave a credit of type {type(finding.credit).__name__}, expected a Fraction"
    if not 0 <= finding.credit <= 1:
        return f"gave a credit of {finding.credit}, expected 0 to 1"
    texts = (finding.reason, finding.hint, finding.blocked_by or "")
    if not all(isinstance(text, str) for text in texts) or not isinstance(finding.location, (Location, type(None))):
        return "gave a reason, hint or location of another type than a Finding has"
    if not isinstance(finding.problem, (Problem, type(None))):
        return f"gave a problem of type {type(finding.problem).__name__}, expected a Problem"
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
