"""Exit codes of the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fractions import Fraction

    from grader.core.report import Report

ALL_MET, NOT_ALL_MET, UNUSABLE, UNDECIDED, INTERRUPTED = 0, 1, 2, 3, 130


def exit_code(report: Report, min_score: Fraction | None) -> int:
    """Return the exit code for a report as its reader may see it.

    The share of the points, in percent, that counts as success is `min_score`; None requires every criterion.
    """
    if not report.final:
        return UNDECIDED
    reached = report.all_met if min_score is None else report.score * 100 >= report.max_score * min_score
    return ALL_MET if reached else NOT_ALL_MET
