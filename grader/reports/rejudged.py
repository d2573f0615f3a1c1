"""A class that was judged again, as text and as JSON: who stands where, what changed for whom, what was refused."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from grader.reports.changes import Change, CriterionChange, Standing, dropped_first
from grader.reports.escape import shown

SCHEMA = "grader/rejudged/v1"
_OUTCOMES = {"not_met": "not met"}


@dataclass(frozen=True, slots=True)
class Result:
    """One submission judged again, or refused.

    Attributes:
        name: What people call the submission.
        problem: Why its evidence cannot be used, on one line; empty if it can.
        score: Points earned.
        max_score: Points to be had.
        code: Exit code that this submission alone would have.
        change: What changed since its first report; None if nobody asked, or there is none to compare with.
        report: The new report as JSON text; empty if nobody asked for it.
    """

    name: str
    problem: str = ""
    score: float = 0.0
    max_score: float = 0.0
    code: int = 0
    change: Change | None = None
    report: str = ""


def render_results(results: Sequence[Result]) -> str:
    """Return one line for each submission, in the order given, and what was refused."""
    judged = [r for r in results if not r.problem]
    width = max((len(_name(r.name)) for r in judged), default=0)
    lines = [f"{_name(r.name):<{width}}  {_points(r.score)}/{_points(r.max_score)}" for r in judged]
    return "\n".join([*lines, *_refused(results), _count(results)]) + "\n"


def render_changes(results: Sequence[Result]) -> str:
    """Return what changed for whom, dropped marks first, and what was refused."""
    judged = [r for r in results if not r.problem]
    changes = dropped_first([r.change for r in judged if r.change is not None])
    lines = [line for change in changes for line in _change(change)]
    incomparable = [f"{_name(r.name)}: no first report to compare with" for r in judged if r.change is None]
    same = len(judged) - len(changes) - len(incomparable)
    return "\n".join([*lines, *incomparable, *_refused(results), f"unchanged: {same} of {len(judged)}"]) + "\n"


def results_to_json(results: Sequence[Result], *, changes: bool) -> str:
    """Return a class as JSON text: every report, or with `changes` what changed, dropped marks first."""
    judged = [r for r in results if not r.problem]
    data: dict[str, Any] = {"schema": SCHEMA}
    if changes:
        ordered = dropped_first([r.change for r in judged if r.change is not None])
        data["changed"] = [{**asdict(c), "gain": c.gain} for c in ordered]
        data["unchanged"] = [r.name for r in judged if r.change is not None and not r.change.criteria]
        data["not_compared"] = [r.name for r in judged if r.change is None]
    else:
        data["submissions"] = [{"name": r.name, "report": json.loads(r.report)} for r in judged]
    data["refused"] = [{"name": r.name, "problem": r.problem} for r in results if r.problem]
    return json.dumps(data, indent=2, allow_nan=False) + "\n"


def _change(change: Change) -> Iterator[str]:
    of, said = _points(change.after_max), f"{_signed(change.gain)} points"
    if change.before_max != change.after_max:
        of += f" (of {_points(change.before_max)} before)"
        said += f", {_signed(100 * change.share_gain)} % of all"
    yield f"{_name(change.name)}: {_points(change.before)} -> {_points(change.after)} of {of}: {said}"
    for row in change.criteria:
        yield f"    {shown(row.exercise)}/{shown(row.criterion)}: {_row(row)}"


def _row(row: CriterionChange) -> str:
    if row.after is None:
        return f"was {_standing(row.before)}, is asked no more"
    before = "was not asked" if row.before is None else f"was {_standing(row.before)}"
    return f"{before}, is {_standing(row.after)}: {shown(row.after.reason, limit=200)}"


def _standing(standing: Standing | None) -> str:
    if standing is None:
        return "nothing"
    outcome = _OUTCOMES.get(standing.outcome, standing.outcome)
    return f"{shown(outcome)} {_points(standing.score)}/{_points(standing.max_score)}"


def _refused(results: Sequence[Result]) -> list[str]:
    return [f"refused: {_name(r.name)}: {shown(r.problem)}" for r in results if r.problem]


def _count(results: Sequence[Result]) -> str:
    refused = sum(bool(r.problem) for r in results)
    judged = len(results) - refused
    return f"judged: {judged}" + (f", refused: {refused}" if refused else "")


def _signed(points: float) -> str:
    return f"{'+' if points > 0 else ''}{_points(points)}"


def _points(points: float) -> str:
    return f"{round(points, 3):g}"


def _name(name: str) -> str:
    return shown(name, limit=80)
