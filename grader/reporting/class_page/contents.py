"""The data of the page of a class: plain values, their text not yet escaped, and statistics of them."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

from grader.core.exercise import Outcome
from grader.reporting import json_report

#: A report as JSON values, version 1.
ReportData = json_report.ReportData

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
    """One submission, or a student without one.

    Attributes:
        folder: Name of the folder below `students/` with the results; empty if there is none.
        name: The student, or the name of the submission.
        also: Further identification: submission name, user name, number, address in the roster.
        status: The state in a word or two.
        tone: How to present the status.
        raw: Points as graded, final or not; None if there are none.
        max_score: Maximum points; None without a report.
        final: Points that count in the end; None without a score.
        adjustments: Decisions that changed the score, one sentence each, e.g. the penalty for late days.
        remarks: Notes for readers of the row.
        report: The report; None if there is none.
        less: Whether students see less than the report.
        counts: Whether the submission counts.
    """

    folder: str
    name: str
    also: tuple[str, ...] = ()
    status: str = "graded"
    tone: RowTone = RowTone.FINE
    raw: Fraction | None = None
    max_score: Fraction | None = None
    final: Fraction | None = None
    adjustments: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    report: ReportData | None = None
    less: bool = False
    counts: bool = True


@dataclass(frozen=True, slots=True)
class PageEntry:
    """A line of a list.

    Attributes:
        text: The text of the line.
        student: Index of the student it refers to; None if that is nobody in the table.
        exercise: Exercise of the report that the line links to; empty for the whole report.
    """

    text: str
    student: int | None = None
    exercise: str = ""


@dataclass(frozen=True, slots=True)
class Listing:
    """A titled list of entries that need attention."""

    id: str
    title: str
    about: str
    entries: tuple[PageEntry, ...]


@dataclass(frozen=True, slots=True)
class PageLink:
    """A link to another page in the results folder.

    Attributes:
        title: Title of the page.
        path: Path relative to the folder, with `/` as separator, not percent-encoded.
        note: A short note beside it, such as the number of pairs.
    """

    title: str
    path: str
    note: str = ""


@dataclass(frozen=True, slots=True)
class RunFacts:
    """Facts about the run that wrote the page; nothing else in the page differs between runs.

    Attributes:
        line: One sentence that is always visible.
        rows: Names and values.
        warnings: Warnings that apply to the whole page.
    """

    line: str = ""
    rows: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ClassPage:
    """The data of the page.

    Attributes:
        title: Name of the class.
        run: Facts about the run.
        students: Rows in the order of the table.
        listings: Lists of entries that need attention.
        links: Other pages of the class.
    """

    title: str
    run: RunFacts
    students: tuple[StudentRow, ...]
    listings: tuple[Listing, ...] = ()
    links: tuple[PageLink, ...] = ()


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
