"""Renders the results of judging again: what changed for each submission, as text and as JSON."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict, dataclass

from grader.reporting.escape import shown
from grader.reporting.json_report import ReportData


@dataclass(frozen=True, slots=True)
class ReportStanding:
    """Outcome and points of a criterion in one report, read from its JSON."""

    outcome: str
    score: float
    max_score: float
    reason: str = ""


@dataclass(frozen=True, slots=True)
class CriterionChange:
    """A criterion whose outcome or points changed; a side is None if its report lacks the criterion."""

    exercise: str
    criterion: str
    before: ReportStanding | None
    after: ReportStanding | None

    @property
    def gain(self) -> float:
        """Points won; negative for points lost."""
        return (self.after.score if self.after else 0) - (self.before.score if self.before else 0)


@dataclass(frozen=True, slots=True)
class ReportChange:
    """What changed for one submission."""

    name: str  # display name of the submission
    before: float  # points in the first report, for the exercises compared
    before_max: float  # maximum points in the first report
    after: float  # points in the new report
    after_max: float  # maximum points in the new report
    criteria: tuple[CriterionChange, ...]  # changed criteria in the order of the new report, removed ones last

    @property
    def gain(self) -> float:
        """Points won; negative for points lost."""
        return round(self.after - self.before, 6)

    @property
    def share_gain(self) -> float:
        """Share of the points won, in [-1, 1]: comparable when the rubric's points have changed."""
        return round(_share(self.after, self.after_max) - _share(self.before, self.before_max), 9)


def change(name: str, before: ReportData, after: ReportData) -> ReportChange:
    """Compare two JSON reports, for the exercises in the second one.

    Raises KeyError, TypeError or ValueError if `before` is not a report.
    """
    exercises = [e["id"] for e in after["exercises"]]
    old = {key: row for key, row in _standings(before) if key[0] in exercises}
    new = dict(_standings(after))
    changed = [
        CriterionChange(*key, old.get(key), new.get(key))
        for key in dict.fromkeys([*new, *old])
        if _mark(old.get(key)) != _mark(new.get(key))
    ]
    return ReportChange(name, *_sums(old.values()), *_sums(new.values()), tuple(changed))


def dropped_first(changes: Sequence[ReportChange]) -> list[ReportChange]:
    """Return the changes that are not empty, from the greatest loss to the greatest gain, by share of the points."""
    return sorted((c for c in changes if c.criteria), key=lambda c: (c.share_gain, c.gain, c.name))


def _standings(report: ReportData) -> Iterator[tuple[tuple[str, str], ReportStanding]]:
    for exercise in report["exercises"]:
        for row in exercise["criteria"]:
            standing = ReportStanding(
                str(row["outcome"]), float(row["score"]), float(row["max_score"]), str(row["reason"])
            )
            yield (str(exercise["id"]), str(row["id"])), standing


def _mark(standing: ReportStanding | None) -> tuple[str, float, float] | None:
    return None if standing is None else (standing.outcome, standing.score, standing.max_score)


def _sums(rows: Collection[ReportStanding]) -> tuple[float, float]:
    return round(sum(r.score for r in rows), 6), round(sum(r.max_score for r in rows), 6)


def _share(score: float, max_score: float) -> float:
    return score / max_score if max_score else 0.0


SCHEMA = "grader/rejudged/v1"
_OUTCOMES = {"not_met": "not met"}


@dataclass(frozen=True, slots=True)
class RejudgedResult:
    """One submission that was judged again, or could not be."""

    name: str  # display name of the submission
    problem: str = ""  # why its evidence cannot be used, on one line; empty if it can
    score: float = 0.0
    max_score: float = 0.0
    code: int = 0  # exit code for this submission alone
    # Changes since the first report; None if not requested, or without a report to compare with
    change: ReportChange | None = None
    report: str = ""  # the new report as JSON text; empty if not requested


def render_results(results: Sequence[RejudgedResult]) -> str:
    """Return one line for each submission, in the order given, then those that were refused."""
    judged = [r for r in results if not r.problem]
    width = max((len(_name(r.name)) for r in judged), default=0)
    lines = [f"{_name(r.name):<{width}}  {_points(r.score)}/{_points(r.max_score)}" for r in judged]
    return "\n".join([*lines, *_refused(results), _count(results)]) + "\n"


def render_changes(results: Sequence[RejudgedResult]) -> str:
    """Return the changes by submission, losses first, then those that were refused."""
    judged = [r for r in results if not r.problem]
    changes = dropped_first([r.change for r in judged if r.change is not None])
    lines = [line for change in changes for line in _change(change)]
    incomparable = [f"{_name(r.name)}: no first report to compare with" for r in judged if r.change is None]
    same = len(judged) - len(changes) - len(incomparable)
    return "\n".join([*lines, *incomparable, *_refused(results), f"unchanged: {same} of {len(judged)}"]) + "\n"


def results_to_json(results: Sequence[RejudgedResult], *, changes: bool) -> str:
    """Return a class as JSON text: every report, or with `changes` the changes, losses first."""
    judged = [r for r in results if not r.problem]
    data: dict[str, object] = {"schema": SCHEMA}
    if changes:
        ordered = dropped_first([r.change for r in judged if r.change is not None])
        data["changed"] = [{**asdict(c), "gain": c.gain} for c in ordered]
        data["unchanged"] = [r.name for r in judged if r.change is not None and not r.change.criteria]
        data["not_compared"] = [r.name for r in judged if r.change is None]
    else:
        data["submissions"] = [{"name": r.name, "report": json.loads(r.report)} for r in judged]
    data["refused"] = [{"name": r.name, "problem": r.problem} for r in results if r.problem]
    return json.dumps(data, indent=2, allow_nan=False) + "\n"


def _change(change: ReportChange) -> Iterator[str]:
    of, gained = _points(change.after_max), f"{_signed(change.gain)} points"
    if change.before_max != change.after_max:
        of += f" (of {_points(change.before_max)} before)"
        gained += f", {_signed(100 * change.share_gain)} % of all"
    yield f"{_name(change.name)}: {_points(change.before)} -> {_points(change.after)} of {of}: {gained}"
    for row in change.criteria:
        yield f"    {shown(row.exercise)}/{shown(row.criterion)}: {_row(row)}"


def _row(row: CriterionChange) -> str:
    if row.after is None:
        return f"was {_standing(row.before)}, is asked no more"
    before = "was not asked" if row.before is None else f"was {_standing(row.before)}"
    return f"{before}, is {_standing(row.after)}: {shown(row.after.reason, limit=200)}"


def _standing(standing: ReportStanding | None) -> str:
    if standing is None:
        return "nothing"
    outcome = _OUTCOMES.get(standing.outcome, standing.outcome)
    return f"{shown(outcome)} {_points(standing.score)}/{_points(standing.max_score)}"


def _refused(results: Sequence[RejudgedResult]) -> list[str]:
    return [f"refused: {_name(r.name)}: {shown(r.problem)}" for r in results if r.problem]


def _count(results: Sequence[RejudgedResult]) -> str:
    refused = sum(bool(r.problem) for r in results)
    judged = len(results) - refused
    return f"judged: {judged}" + (f", refused: {refused}" if refused else "")


def _signed(points: float) -> str:
    return f"{'+' if points > 0 else ''}{_points(points)}"


def _points(points: float) -> str:
    return f"{round(points, 3):g}"


def _name(name: str) -> str:
    return shown(name, limit=80)
