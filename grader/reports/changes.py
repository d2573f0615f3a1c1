"""What became different between two reports of one submission: points and outcomes, by exercise and criterion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Standing:
    """What a criterion came to in one report, as its JSON says."""

    outcome: str
    score: float
    max_score: float
    reason: str = ""


@dataclass(frozen=True, slots=True)
class CriterionChange:
    """One criterion whose outcome or points changed; None where a report has no such criterion."""

    exercise: str
    criterion: str
    before: Standing | None
    after: Standing | None

    @property
    def gain(self) -> float:
        """Points won; negative for points lost."""
        return (self.after.score if self.after else 0) - (self.before.score if self.before else 0)


@dataclass(frozen=True, slots=True)
class Change:
    """What changed for one submission.

    Attributes:
        name: What people call the submission.
        before: Points of the first report, of the exercises compared.
        before_max: Points there were to be had.
        after: Points of the new report.
        after_max: Points there are to be had.
        criteria: Those that changed, in the order of the new report, removed ones last.
    """

    name: str
    before: float
    before_max: float
    after: float
    after_max: float
    criteria: tuple[CriterionChange, ...]

    @property
    def gain(self) -> float:
        """Points won; negative for points lost."""
        return round(self.after - self.before, 6)

    @property
    def share_gain(self) -> float:
        """Share of the points won, in [-1, 1]: what counts where the rubric gives other points than before."""
        return round(_share(self.after, self.after_max) - _share(self.before, self.before_max), 9)


def change(name: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> Change:
    """Return what changed between two reports as JSON, of the exercises that the second one has.

    Raises:
        KeyError, TypeError, ValueError: `before` is no report.
    """
    exercises = [e["id"] for e in after["exercises"]]
    old = {key: row for key, row in _standings(before) if key[0] in exercises}
    new = dict(_standings(after))
    changed = [
        CriterionChange(*key, old.get(key), new.get(key))
        for key in dict.fromkeys([*new, *old])
        if _mark(old.get(key)) != _mark(new.get(key))
    ]
    return Change(name, *_sums(old.values()), *_sums(new.values()), tuple(changed))


def dropped_first(changes: Sequence[Change]) -> list[Change]:
    """Return those with any difference: the greatest loss first, by the share of the points, the greatest gain last."""
    return sorted((c for c in changes if c.criteria), key=lambda c: (c.share_gain, c.gain, c.name))


def _standings(report: Mapping[str, Any]) -> Iterator[tuple[tuple[str, str], Standing]]:
    for exercise in report["exercises"]:
        for row in exercise["criteria"]:
            standing = Standing(str(row["outcome"]), float(row["score"]), float(row["max_score"]), str(row["reason"]))
            yield (str(exercise["id"]), str(row["id"])), standing


def _mark(standing: Standing | None) -> tuple[str, float, float] | None:
    return None if standing is None else (standing.outcome, standing.score, standing.max_score)


def _sums(standings: Any) -> tuple[float, float]:
    rows = list(standings)
    return round(sum(r.score for r in rows), 6), round(sum(r.max_score for r in rows), 6)


def _share(score: float, max_score: float) -> float:
    return score / max_score if max_score else 0.0
