"""The data of the page of a class: plain values, their text not yet escaped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import Any

from grader.core.exercise import Outcome

#: A report as JSON values, version 1.
ReportData = Mapping[str, Any]

LOST = (Outcome.NOT_MET.value, Outcome.PARTLY.value)


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
