"""Short ways to make a Finding, so that checks read as sentences."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from grader.core.exercise import Finding, Location, Problem
from grader.core.quantities import seconds
from grader.core.trace import Fault

#: Evidence key under which a finding names the fault that it rests on; judging an exercise counts each fault once.
FAULT_KEY = "fault"

HALF = Fraction(1, 2)


def met(reason: str, evidence: Mapping[str, Any] | None = None) -> Finding:
    """Return full credit."""
    return Finding(Fraction(1), reason, evidence or {})


def partly(reason: str, evidence: Mapping[str, Any] | None = None, *, hint: str = "") -> Finding:
    """Return half credit."""
    return Finding(HALF, reason, evidence or {}, hint=hint)


def not_met(  # noqa: PLR0913  each is a field of the finding
    reason: str,
    evidence: Mapping[str, Any] | None = None,
    *,
    hint: str = "",
    fault: Fault | None = None,
    blocked_by: str | None = None,
    problem: Problem | None = None,
) -> Finding:
    """Return no credit.

    Args:
        reason: What was found, what was expected.
        evidence: Plain JSON values behind it.
        hint: One thing to do.
        fault: The fault that explains it; becomes the location and part of the evidence.
        blocked_by: Criterion id, or name of a check in the same scenario, without which this cannot be asked.
        problem: What is wrong, where diagnosis can say more about it.
    """
    known = dict(evidence or {})
    if fault is not None:
        known[FAULT_KEY] = fault_evidence(fault)
    location = fault_location(fault) if fault is not None else None
    return Finding(Fraction(0), reason, known, location=location, hint=hint, blocked_by=blocked_by, problem=problem)


def fault_location(fault: Fault) -> Location | None:
    """Return the student's own line at which a fault arose, if it is known."""
    return Location(fault.file, fault.line) if fault.file and fault.line > 0 else None


def fault_evidence(fault: Fault) -> dict[str, Any]:
    """Return a fault as plain JSON values."""
    return {
        "process": fault.process,
        "kind": fault.kind.value,
        "text": fault.text,
        "file": fault.file,
        "line": fault.line,
        "t_s": seconds(fault.t_ns),
    }
