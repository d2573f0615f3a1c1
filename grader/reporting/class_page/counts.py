"""Statistics of a class: the distribution of scores, and the outcomes of each criterion."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from grader.core.exercise import Outcome
from grader.reporting.class_page.contents import ReportData, StudentRow

#: Number of bins, without the last one, which holds only the full score.
_PARTS = 10


@dataclass(frozen=True, slots=True)
class Bin:
    """One bin of the score distribution.

    Attributes:
        label: In percent of the maximum points.
        low: Lowest share in it, from 0 to 1.
        high: Share where the next bin begins; the last bin is open.
        raw: Number of scores in it as graded.
        final: Number of scores in it after adjustments.
    """

    label: str
    low: float
    high: float
    raw: int
    final: int


@dataclass(frozen=True, slots=True)
class Distribution:
    """The distribution of scores.

    Attributes:
        bins: From zero to the full score.
        raw: Mean, median, minimum and maximum in percent, as graded; empty without scores.
        final: The same after adjustments.
        changed: Whether adjustments changed any score.
        max_score: Maximum points; 0 without reports.
    """

    bins: tuple[Bin, ...]
    raw: tuple[float, ...]
    final: tuple[float, ...]
    changed: bool
    max_score: Fraction


@dataclass(frozen=True, slots=True)
class CriterionCount:
    """How often a criterion had each outcome.

    Attributes:
        exercise: Id of its exercise.
        id: Its id.
        title: Its title.
        outcomes: Outcome -> number of students; contains every outcome.
    """

    exercise: str
    id: str
    title: str
    outcomes: dict[str, int]

    @property
    def total(self) -> int:
        """Number of students whose reports have the criterion."""
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
    """Return the distribution of the scores that count and are final."""
    counted = [student for student in students if student.counts]
    most = max((s.max_score for s in counted if s.max_score), default=Fraction(0))
    raw = [s.raw / s.max_score for s in counted if s.raw is not None and s.max_score and _is_final(s)]
    final = [s.final / (s.max_score or most) for s in counted if s.final is not None and (s.max_score or most)]
    in_raw, in_final = Counter(map(_part, raw)), Counter(map(_part, final))
    bins = [_bin(part, in_raw[part], in_final[part]) for part in range(_PARTS + 1)]
    return Distribution(tuple(bins), _summary(raw), _summary(final), sorted(raw) != sorted(final), most)


def exercise_counts(reports: Iterable[ReportData]) -> tuple[ExerciseCount, ...]:
    """Return all exercises and criteria in the reports, in their order."""
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
    """Return the bin of a share; more than everything counts as everything."""
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
