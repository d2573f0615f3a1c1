"""The data of the page of a class: plain values, their text not yet escaped, and statistics of them."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterable, Sequence
from enum import Enum
from fractions import Fraction

from grader.grading.model.exercise import Outcome
from grader.grading.reporting.json_report import ReportData
from grader.runtime.model.dataclass import dataclass

LOST = (Outcome.NOT_MET.value, Outcome.PARTLY.value)

#: Number of bins, without the last one, which holds only the full score.
_PARTS = 10


class RowTone(str, Enum):
    """How to present a status."""

    FINE = "fine"
    OURS = "ours"  # undecided or failed, not the student's fault
    THEIRS = "theirs"  # the submission cannot be used
    NOTHING = "nothing"  # nothing submitted, or not graded yet


@dataclass(frozen=True, slots=True)
class StudentRow:
    """One submission, or a student without one."""

    folder: str  # name of the folder below `students/` with the results; empty if there is none
    name: str  # the student, or the name of the submission
    also: tuple[str, ...] = ()  # further identification: submission name, user name, number, address in the roster
    status: str = "graded"  # the state in a word or two
    tone: RowTone = RowTone.FINE  # how to present the status
    raw: Fraction | None = None  # points as graded, final or not; None if there are none
    max_score: Fraction | None = None  # maximum points; None without a report
    final: Fraction | None = None  # points that count in the end; None without a score
    # Decisions that changed the score, one sentence each, e.g. the penalty for late days.
    adjustments: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()  # notes for readers of the row
    report: ReportData | None = None  # the report; None if there is none
    counts: bool = True


@dataclass(frozen=True, slots=True)
class PageEntry:
    """A line of a list."""

    text: str  # the text of the line
    student: int | None = None  # index of the student it refers to; None if the student is not in the table
    exercise: str = ""  # exercise of the report that the line links to; empty for the whole report


@dataclass(frozen=True, slots=True)
class Listing:
    """A titled list of entries that need attention."""

    id: str
    title: str
    about: str
    entries: tuple[PageEntry, ...]


@dataclass(frozen=True, slots=True)
class PageLink:
    """A link to another page in the results folder."""

    title: str
    path: str  # path relative to the folder, with `/` as separator, not percent-encoded
    note: str = ""  # a short note beside it, such as the number of pairs


@dataclass(frozen=True, slots=True)
class RunFacts:
    """Facts about the run that wrote the page; nothing else in the page differs between runs."""

    line: str = ""  # one sentence that is always visible
    rows: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()  # warnings that apply to the whole page


@dataclass(frozen=True, slots=True)
class ClassPage:
    """The data of the page."""

    title: str  # name of the class
    run: RunFacts
    students: tuple[StudentRow, ...]  # rows in the order of the table
    listings: tuple[Listing, ...] = ()  # lists of entries that need attention
    links: tuple[PageLink, ...] = ()


@dataclass(frozen=True, slots=True)
class Bin:
    """One bin of the score distribution."""

    label: str  # in percent of the maximum points
    low: float  # lowest share in it, from 0 to 1
    high: float  # share where the next bin begins; the last bin is open
    raw: int  # number of scores in it as graded
    final: int  # number of scores in it after adjustments


@dataclass(frozen=True, slots=True)
class Distribution:
    """The distribution of scores."""

    bins: tuple[Bin, ...]  # from zero to the full score
    raw: tuple[float, ...]  # mean, median, minimum and maximum in percent, as graded; empty without scores
    final: tuple[float, ...]  # the same after adjustments
    changed: bool  # whether adjustments changed any score
    max_score: Fraction  # maximum points; 0 without reports


@dataclass(frozen=True, slots=True)
class CriterionCount:
    """How often a criterion had each outcome."""

    exercise: str  # id of its exercise
    id: str
    title: str
    outcomes: dict[str, int]  # outcome -> number of students; contains every outcome

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
    decided = [s for s in counted if s.report is not None and s.report["final"]]
    raw = [s.raw / s.max_score for s in decided if s.raw is not None and s.max_score]
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
