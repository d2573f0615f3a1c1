"""The figures of a class: how scores are distributed, and how often each criterion came to which outcome."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from grader.core.exercise import Outcome
from grader.reporting.class_page.contents import ReportData, StudentRow

#: Parts of the scale, without the last one, which is the full score alone.
_PARTS = 10


@dataclass(frozen=True, slots=True)
class Bin:
    """A part of the scale.

    Attributes:
        label: In percent of the points to be had.
        low: Lowest share in it, from 0 to 1.
        high: The share where the next one begins; the last one has no end.
        raw: How many have so many points of the grader.
        final: How many have so many points in the end.
    """

    label: str
    low: float
    high: float
    raw: int
    final: int


@dataclass(frozen=True, slots=True)
class Distribution:
    """How scores are distributed.

    Attributes:
        bins: From nothing to the full score.
        raw: Mean, median, least and most in percent, as graded; empty without scores.
        final: The same for what counts in the end.
        changed: Whether any score is another one in the end.
        max_score: Points to be had; 0 if nobody has a report.
    """

    bins: tuple[Bin, ...]
    raw: tuple[float, ...]
    final: tuple[float, ...]
    changed: bool
    max_score: Fraction


@dataclass(frozen=True, slots=True)
class CriterionCount:
    """How often a criterion came to which outcome.

    Attributes:
        exercise: Id of its exercise.
        id: Its id.
        title: Its title.
        outcomes: Outcome -> how many; every outcome is there.
    """

    exercise: str
    id: str
    title: str
    outcomes: dict[str, int]

    @property
    def total(self) -> int:
        """How many were asked."""
        return sum(self.outcomes.values())


@dataclass(frozen=True, slots=True)
class ExerciseCount:
    """An exercise of the class, with all its criteria."""

    id: str
    number: str
    title: str
    max_score: Fraction
    criteria: tuple[CriterionCount, ...]


def distribution(students: Sequence[StudentRow]) -> Distribution:
    """Return how the scores of those that count are distributed; scores that are not final are left out."""
    counted = [student for student in students if student.counts]
    most = max((s.max_score for s in counted if s.max_score), default=Fraction(0))
    raw = [s.raw / s.max_score for s in counted if s.raw is not None and s.max_score and _is_final(s)]
    final = [s.final / (s.max_score or most) for s in counted if s.final is not None and (s.max_score or most)]
    in_raw, in_final = Counter(map(_part, raw)), Counter(map(_part, final))
    bins = [_bin(part, in_raw[part], in_final[part]) for part in range(_PARTS + 1)]
    return Distribution(tuple(bins), _summary(raw), _summary(final), sorted(raw) != sorted(final), most)


def exercise_counts(reports: Iterable[ReportData]) -> tuple[ExerciseCount, ...]:
    """Return all exercises and criteria that occur, in the order of the reports."""
    heads: dict[str, tuple[str, str, Fraction]] = {}
    titles: dict[tuple[str, str], str] = {}
    counts: Counter[tuple[str, str, str]] = Counter()
    for report in reports:
        for exercise in report["exercises"]:
            id_ = str(exercise["id"])
            most = Fraction(str(exercise["max_score"]))
            heads.setdefault(id_, (str(exercise.get("number", "")), str(exercise["title"]), most))
            for criterion in exercise["criteria"]:
                titles.setdefault((id_, str(criterion["id"])), str(criterion["title"]))
                counts[id_, str(criterion["id"]), str(criterion["outcome"])] += 1
    return tuple(
        ExerciseCount(
            id_, *head, tuple(_criterion(key, title, counts) for key, title in titles.items() if key[0] == id_)
        )
        for id_, head in heads.items()
    )


def _is_final(student: StudentRow) -> bool:
    return student.report is not None and bool(student.report["final"])


def _part(share: Fraction) -> int:
    """Return the part of the scale that a share lies in; more than everything counts as everything."""
    return max(0, min(_PARTS, int(share * _PARTS)))


def _bin(part: int, raw: int, final: int) -> Bin:
    low, high = part / _PARTS, (part + 1) / _PARTS
    full = part == _PARTS
    label = "100 %" if full else f"{100 * part // _PARTS} to {100 * (part + 1) // _PARTS} %"
    return Bin(label, low, high, raw, final)


def _summary(shares: Sequence[Fraction]) -> tuple[float, ...]:
    if not shares:
        return ()
    percent = [float(100 * share) for share in shares]
    return (statistics.fmean(percent), statistics.median(percent), min(percent), max(percent))


def _criterion(key: tuple[str, str], title: str, counts: Counter[tuple[str, str, str]]) -> CriterionCount:
    return CriterionCount(*key, title, {outcome.value: counts[(*key, outcome.value)] for outcome in Outcome})
