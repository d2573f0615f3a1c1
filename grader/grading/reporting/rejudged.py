"""Renders the results of judging again: what changed for each submission and in all, as text, JSON and CSV."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict
from statistics import fmean

from grader.grading.reporting.escape import csv_cell, shown
from grader.grading.reporting.json_report import ReportData
from grader.runtime.model.dataclass import dataclass


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


@dataclass(frozen=True, slots=True)
class CriterionSummary:
    """How one criterion changed in all submissions where it did."""

    exercise: str
    criterion: str
    changed: int  # number of submissions
    max_before: float | None  # its points; None if no first report has the criterion
    max_after: float | None  # its points; None if no new report has it
    mean_before: float  # mean of the points earned, over the submissions where it changed
    mean_after: float
    outcomes: tuple[tuple[str, str, int], ...]  # outcome before, outcome after, how often, where these differ


@dataclass(frozen=True, slots=True)
class ChangesSummary:
    """How the scores of a class changed; scores are compared as percentages, because maxima may have changed."""

    compared: int  # number of submissions compared
    changed: int  # number of submissions of which a criterion changed
    up: int
    down: int
    mean_before: float  # mean score in percent, over all submissions compared
    mean_after: float
    criteria: tuple[CriterionSummary, ...]


def summarise_changes(changes: Sequence[ReportChange]) -> ChangesSummary:
    """Summarise the changes of a class; there must be at least one, which may be empty."""
    rows: dict[tuple[str, str], list[CriterionChange]] = {}
    for row in (row for each in changes for row in each.criteria):
        rows.setdefault((row.exercise, row.criterion), []).append(row)
    return ChangesSummary(
        compared=len(changes),
        changed=sum(bool(each.criteria) for each in changes),
        up=sum(each.share_gain > 0 for each in changes),
        down=sum(each.share_gain < 0 for each in changes),
        mean_before=100 * fmean(_share(each.before, each.before_max) for each in changes),
        mean_after=100 * fmean(_share(each.after, each.after_max) for each in changes),
        criteria=tuple(_criterion_summary(*key, found) for key, found in rows.items()),
    )


def _criterion_summary(exercise: str, criterion: str, rows: Sequence[CriterionChange]) -> CriterionSummary:
    moves = Counter((row.before.outcome, row.after.outcome) for row in rows if row.before and row.after)
    return CriterionSummary(
        exercise,
        criterion,
        len(rows),
        max((row.before.max_score for row in rows if row.before), default=None),
        max((row.after.max_score for row in rows if row.after), default=None),
        fmean(row.before.score if row.before else 0.0 for row in rows),
        fmean(row.after.score if row.after else 0.0 for row in rows),
        tuple((*move, count) for move, count in moves.most_common() if move[0] != move[1]),
    )


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
#: Most names in one line.
_MOST_NAMES = 10


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


def render_rejudged(results: Sequence[RejudgedResult]) -> str:
    """Return one line for each submission, in the order given, then those that were refused."""
    judged = [r for r in results if not r.problem]
    width = max((len(_name(r.name)) for r in judged), default=0)
    lines = [f"{_name(r.name):<{width}}  {_points(r.score)}/{_points(r.max_score)}" for r in judged]
    return "\n".join([*lines, *_refused(results), _count(results)]) + "\n"


def render_changes(results: Sequence[RejudgedResult]) -> str:
    """Return the changes by submission, losses first, then those that were refused."""
    judged = [r for r in results if not r.problem]
    changes = dropped_first([r.change for r in judged if r.change is not None])
    compared = [r.change for r in judged if r.change is not None]
    lines = change_summary(compared) if changes else []
    # A single submission shows every change, a class only those that change a score.
    told = [change for change in changes if _score_changed(change) or len(judged) == 1]
    lines += [line for change in told for line in _change(change)]
    lines += _same_score([change for change in changes if change not in told])
    incomparable = [f"{_name(r.name)}: no first report to compare with" for r in judged if r.change is None]
    same = len(judged) - len(changes) - len(incomparable)
    return "\n".join([*lines, *incomparable, *_refused(results), f"unchanged: {same} of {len(judged)}"]) + "\n"


def rejudged_to_json(results: Sequence[RejudgedResult], *, changes: bool) -> str:
    """Return a class as JSON text: every report, or with `changes` the changes, losses first."""
    judged = [r for r in results if not r.problem]
    data: dict[str, object] = {"schema": SCHEMA}
    if changes:
        ordered = dropped_first([r.change for r in judged if r.change is not None])
        compared = [r.change for r in judged if r.change is not None]
        data["summary"] = asdict(summarise_changes(compared)) if compared else None
        data["changed"] = [{**asdict(c), "gain": c.gain} for c in ordered]
        data["unchanged"] = [r.name for r in judged if r.change is not None and not r.change.criteria]
        data["not_compared"] = [r.name for r in judged if r.change is None]
    else:
        data["submissions"] = [{"name": r.name, "report": json.loads(r.report)} for r in judged]
    data["refused"] = [{"name": r.name, "problem": r.problem} for r in results if r.problem]
    return json.dumps(data, indent=2, allow_nan=False) + "\n"


def change_summary(changes: Sequence[ReportChange]) -> list[str]:
    """Return how a class changed in a few lines: how many up and down, the mean, then each criterion."""
    found = summarise_changes(changes)
    if not found.changed:
        return [f"changed: 0 of {found.compared}"]
    mean = f"mean {found.mean_before:.1f} -> {found.mean_after:.1f} %"
    head = f"changed: {found.changed} of {found.compared}: {found.up} up, {found.down} down; {mean}"
    return [head, *(f"    {_of_all(criterion)}" for criterion in found.criteria)]


def _of_all(row: CriterionSummary) -> str:
    """Return how a criterion changed in a class, e.g. `rate: 10 -> 5 points; 57 changed, mean 8.2 -> 4.1`."""
    name = f"{shown(row.exercise)}/{shown(row.criterion)}"
    if row.max_after is None:
        return f"{name}: removed, it had {_points(row.max_before or 0)} points; {row.changed} changed"
    if row.max_before is None:
        return f"{name}: new, with {_points(row.max_after)} points; {row.changed} changed, mean {row.mean_after:.1f}"
    of = _points(row.max_before)
    of += f" -> {_points(row.max_after)}" if row.max_after != row.max_before else ""
    moves = [f"{_outcome(before)} -> {_outcome(after)}: {count}" for before, after, count in row.outcomes]
    mean = f"mean {row.mean_before:.1f} -> {row.mean_after:.1f}"
    return "; ".join([f"{name}: {of} points", f"{row.changed} changed, {mean}", *moves])


_COLUMNS = (
    "submission",
    "score_before",
    "max_before",
    "score_after",
    "max_after",
    "exercise",
    "criterion",
    "outcome_before",
    "points_before",
    "of_before",
    "outcome_after",
    "points_after",
    "of_after",
    "gain",
    "reason",
)


def render_changes_table(changes: Sequence[ReportChange]) -> str:
    """Return the changes as CSV, one row for each changed criterion, losses first; no cell is a formula."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(_COLUMNS)
    for each in dropped_first(changes):
        totals = [_points(n) for n in (each.before, each.before_max, each.after, each.after_max)]
        for row in each.criteria:
            sides = [*_side(row.before), *_side(row.after), _points(row.gain)]
            names = [csv_cell(row.exercise), csv_cell(row.criterion)]
            reason = csv_cell(row.after.reason) if row.after else ""
            writer.writerow([csv_cell(each.name), *totals, *names, *sides, reason])
    return text.getvalue()


def _side(standing: ReportStanding | None) -> list[str]:
    if standing is None:
        return ["", "", ""]
    return [csv_cell(_outcome(standing.outcome)), _points(standing.score), _points(standing.max_score)]


def _outcome(outcome: str) -> str:
    return shown(_OUTCOMES.get(outcome, outcome))


def _change(change: ReportChange) -> Iterator[str]:
    of, gained = _points(change.after_max), f"{_signed(change.gain)} points"
    if change.before_max != change.after_max:
        of += f" (of {_points(change.before_max)} before)"
        gained += f", {_signed(100 * change.share_gain)} % of all"
    yield f"{_name(change.name)}: {_points(change.before)} -> {_points(change.after)} of {of}: {gained}"
    for row in change.criteria:
        yield f"    {shown(row.exercise)}/{shown(row.criterion)}: {_row(row)}"


def _score_changed(change: ReportChange) -> bool:
    return (change.before, change.before_max) != (change.after, change.after_max)


def _same_score(changes: Sequence[ReportChange]) -> list[str]:
    """Return one line about the submissions of which only the points of criteria changed, not their sum."""
    if not changes:
        return []
    names = ", ".join(_name(change.name) for change in changes[:_MOST_NAMES])
    more = f" and {len(changes) - _MOST_NAMES} more" if len(changes) > _MOST_NAMES else ""
    keeps = "1 keeps its score" if len(changes) == 1 else f"{len(changes)} keep their score"
    return [f"{keeps}, but criteria changed: {names}{more}"]


def _row(row: CriterionChange) -> str:
    if row.after is None:
        return f"was {_standing(row.before)}; criterion removed"
    before = "new criterion" if row.before is None else f"was {_standing(row.before)}"
    return f"{before}, is {_standing(row.after)}: {shown(row.after.reason, limit=200)}"


def _standing(standing: ReportStanding | None) -> str:
    if standing is None:
        return "nothing"
    return f"{_outcome(standing.outcome)} {_points(standing.score)}/{_points(standing.max_score)}"


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
