"""A class as it stands: one row for each submission and each person without one; what every overview is made of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from fractions import Fraction
from typing import Any

from grader.batch.adjustments import Adjusted, Adjustments, Decision, adjust, unknown_student
from grader.batch.intake import Entry, Intake
from grader.batch.matching import Matching
from grader.batch.people import Person, fold_handle
from grader.batch.standing import Standing, State
from grader.batch.store import Kept

#: A report as JSON values.
ReportData = Mapping[str, Any]


class Status(str, Enum):
    """How a row stands; the first four are the states of a result."""

    GRADED = "graded"
    UNDECIDED = "undecided"
    REFUSED = "refused"
    FAILED = "failed"
    NOT_RUN = "not run"
    MISSING = "nothing handed in"


@dataclass(frozen=True, slots=True)
class Row:
    """One submission, or one person without one.

    Attributes:
        name: Name of the entry, under which its results lie; empty for a person without a submission.
        label: As the source calls it.
        person: Who handed it in; None if nobody on the roster goes with it.
        status: See Status.
        problem: Why there is no report, or why the last attempt came to nothing; may be empty.
        standing: What lies in the folder for results; None if there is nothing.
        report: Its report; None if there is none.
        handed_back: Its report as far as students may see it; None if there is none.
        adjusted: The score, with what was decided about it.
        marked_late: Whether the platform marked it as late.
        outdated: Whether the result is of other files or another rubric than those of now.
        twin_of: Names of other submissions of the same person.
    """

    name: str
    label: str
    person: Person | None
    status: Status
    problem: str = ""
    standing: Standing | None = None
    report: ReportData | None = None
    handed_back: ReportData | None = None
    adjusted: Adjusted = field(default_factory=Adjusted)
    marked_late: bool = False
    outdated: bool = False
    twin_of: tuple[str, ...] = ()

    @property
    def shown_name(self) -> str:
        """The person's name, or what the submission is called."""
        return self.person.name if self.person is not None else self.label

    @property
    def max_score(self) -> Fraction | None:
        """Points to be had; None without a report."""
        return None if self.standing is None or self.report is None else exactly(self.standing.max_score)


@dataclass(frozen=True, slots=True)
class Classbook:
    """A class.

    Attributes:
        rows: Submissions by name, then people without one.
        matching: Who could not be matched.
        strays: What in the sources is no submission.
        foreign: Names of results that belong to no submission of now.
        layouts: Source and layout of each.
        remarks: Sentences that an instructor must know.
    """

    rows: tuple[Row, ...]
    matching: Matching = field(default_factory=Matching)
    strays: tuple[str, ...] = ()
    foreign: tuple[str, ...] = ()
    layouts: tuple[tuple[str, str], ...] = ()
    remarks: tuple[str, ...] = ()

    def count(self, status: Status) -> int:
        """Return how many rows stand like this."""
        return sum(row.status is status for row in self.rows)

    @property
    def to_export(self) -> tuple[Row, ...]:
        """Rows with a score for a person of whom only one submission counts: what platforms may be told."""
        scored = [row for row in self.rows if row.adjusted.score is not None and row.person is not None]
        count = Counter(id(row.person) for row in scored)
        twins = {row.name for row in scored if any(t in {r.name for r in scored} for t in row.twin_of)}
        return tuple(row for row in scored if count[id(row.person)] == 1 and row.name not in twins)


def exactly(number: float) -> Fraction:
    """Return a score of a report, which has at most six digits after the point, as what it was written as."""
    return Fraction(str(round(number, 6)))


def make_classbook(  # noqa: PLR0913  each comes from another place
    intake: Intake,
    matching: Matching,
    adjustments: Adjustments,
    *,
    kept: Mapping[str, Kept],
    keys: Mapping[str, str],
    report_of: Callable[[str], ReportData | None],
    handed_back_of: Callable[[str], ReportData | None],
    foreign: Sequence[str] = (),
) -> Classbook:
    """Put a class together.

    Args:
        intake: The submissions.
        matching: Whose they are.
        adjustments: What was decided.
        kept: Name -> what lies in the folder for results.
        keys: Name -> what the key of a result of now is; empty if that is not known.
        report_of: Reads the report of a submission.
        handed_back_of: Reads it as far as students may see it.
        foreign: Names of results of nobody.

    Raises:
        ClassError: A decision names nobody of this class.
    """
    decisions = decisions_for(intake.entries, matching, adjustments)
    twins = {name: tuple(n for n in group if n != name) for group in matching.duplicates for name in group}
    rows = []
    for entry in intake.entries:
        found = kept.get(entry.name, Kept())
        report = report_of(entry.name) if _has_report(found.result) else None
        rows.append(_row(entry, matching, found, report, keys.get(entry.name, "")))
        raw = exactly(report["score"]) if report is not None and report["final"] else None
        adjusted = adjust(raw, decisions.get(entry.name, Decision()), adjustments)
        handed_back = handed_back_of(entry.name) if report is not None else None
        rows[-1] = replace(rows[-1], handed_back=handed_back, adjusted=adjusted, twin_of=twins.get(entry.name, ()))
    rows += [_missing(person, adjustments) for person in matching.missing]
    late = [row.name for row in rows if row.marked_late and not row.adjusted.days_late]
    remarks = [f"marked as late by the platform, but no late days are named: {', '.join(late)}"] if late else []
    odd = [entry.name for entry in intake.entries if not entry.recognised]
    remarks += [f"named otherwise than the layout names submissions: {', '.join(odd)}"] if odd else []
    return Classbook(tuple(rows), matching, intake.strays, tuple(foreign), intake.layouts, tuple(remarks))


def decisions_for(entries: Sequence[Entry], matching: Matching, adjustments: Adjustments) -> dict[str, Decision]:
    """Return name of an entry -> what was decided; raises ClassError for a decision about nobody of this class."""
    found: dict[str, Decision] = {}
    for who, decision in adjustments.students.items():
        meant = [entry.name for entry in entries if fold_handle(who) in _called(entry, matching.people.get(entry.name))]
        exact = [name for name in meant if name == who] or meant
        absent = any(fold_handle(who) in _handles(person) for person in matching.missing)
        if not exact and not absent:
            raise unknown_student(decision, who, [entry.name for entry in entries])
        found.update(dict.fromkeys(exact, decision))
    return found


def _called(entry: Entry, person: Person | None) -> set[str]:
    own = {fold_handle(text) for text in (entry.name, entry.label, *entry.identity.values())}
    return own | (_handles(person) if person is not None else set())


def _handles(person: Person) -> set[str]:
    return {*person.handles, *(fold_handle(t) for t in (person.name, person.user, person.email, person.id) if t)}


def _has_report(standing: Standing | None) -> bool:
    return standing is not None and standing.state in (State.GRADED, State.UNDECIDED)


def _row(entry: Entry, matching: Matching, kept: Kept, report: ReportData | None, key: str) -> Row:
    result, last = kept.result, kept.last
    known = result is not None and (report is not None or not _has_report(result))
    return Row(
        name=entry.name,
        label=entry.label,
        person=matching.people.get(entry.name),
        status=Status(result.state.value) if result is not None and known else Status.NOT_RUN,
        problem="" if last is None else last.problem,
        standing=result,
        report=report,
        marked_late=entry.late,
        outdated=result is not None and bool(key) and result.state is not State.FAILED and result.key != key,
    )


def _missing(person: Person, adjustments: Adjustments) -> Row:
    """Return the row of somebody who handed in nothing, who may have been given a score all the same."""
    called = _handles(person)
    decision = next((d for who, d in adjustments.students.items() if fold_handle(who) in called), Decision())
    return Row("", person.name, person, Status.MISSING, adjusted=adjust(None, decision, adjustments))
