"""What the page of a class is made of: plain values, all text in them still as it came."""

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
    """How a status is to be taken."""

    FINE = "fine"
    OURS = "ours"  # undecided or failed, through no fault of the student
    THEIRS = "theirs"  # what was handed in cannot be used
    NOTHING = "nothing"  # there is nothing, or not yet


@dataclass(frozen=True, slots=True)
class StudentRow:
    """One submission, or somebody who handed in nothing.

    Attributes:
        folder: Name of the folder below `students/` with the results; empty if there is none.
        name: The person, or what the submission is called.
        also: What else tells who it is: name of the submission, user name, number, address of the roster.
        status: How it stands, in a word or two.
        tone: How that is to be taken.
        raw: Points of the grader, final or not; None if there are none.
        max_score: Points to be had; None without a report.
        final: What counts in the end; None for no score.
        adjustments: What was decided, one sentence each, e.g. the penalty for late days.
        remarks: What somebody who reads the row must know.
        report: The report; None if there is none.
        less: Whether students get to see less than the report.
        counts: Whether it counts at all.
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
        text: What is said.
        student: Index of the student it is about; None if it is about nobody in the table.
        exercise: Exercise of the report that the line leads to; empty for the report as a whole.
    """

    text: str
    student: int | None = None
    exercise: str = ""


@dataclass(frozen=True, slots=True)
class Listing:
    """Something to look through, under a title."""

    id: str
    title: str
    about: str
    entries: tuple[PageEntry, ...]


@dataclass(frozen=True, slots=True)
class PageLink:
    """A link to another page in the folder for results.

    Attributes:
        title: What it leads to.
        path: Path relative to the folder, with `/` between the parts, not encoded.
        note: A few words beside it, such as how many pairs there are.
    """

    title: str
    path: str
    note: str = ""


@dataclass(frozen=True, slots=True)
class RunFacts:
    """What belongs to the run that wrote the page; nothing else in the page differs between runs.

    Attributes:
        line: One sentence that is always in sight.
        rows: Name and value.
        warnings: What must be read with everything else.
    """

    line: str = ""
    rows: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ClassPage:
    """The page of a class.

    Attributes:
        title: What the class is called.
        run: What belongs to the run.
        students: In the order of the table.
        listings: What needs a look.
        links: Other pages of the class.
    """

    title: str
    run: RunFacts
    students: tuple[StudentRow, ...]
    listings: tuple[Listing, ...] = ()
    links: tuple[PageLink, ...] = ()
