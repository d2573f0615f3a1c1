"""The gradebook of a class, with a row for each submission and each person without one; also as CSV."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field, replace
from enum import Enum
from fractions import Fraction

from grader.classroom.adjustments import (
    Adjusted,
    Adjustments,
    CriterionDecision,
    Decision,
    adjust,
    unknown_student,
)
from grader.classroom.intake import HandedInEntry, Intake
from grader.classroom.roster import Person, RosterMatch, fold_handle
from grader.classroom.store import Kept, ResultStatus, State
from grader.core.author_files import AuthorMistake
from grader.core.dataclass import dataclass
from grader.core.exercise import Outcome
from grader.core.report import AUTHOR_MISTAKE
from grader.reporting.escape import csv_cell, shown
from grader.reporting.json_report import CriterionData, ExerciseData, ReportData


class Status(str, Enum):
    """Status of a row; the first four are the states of a result."""

    GRADED = "graded"
    UNDECIDED = "undecided"
    REFUSED = "refused"
    FAILED = "failed"
    NOT_RUN = "not run"
    MISSING = "nothing handed in"


@dataclass(frozen=True, slots=True)
class Row:
    """One submission, or one person without one."""

    name: str  # name of the entry and of its results folder; empty for a person without a submission
    label: str  # its name in the source
    person: Person | None  # who handed it in; None if nobody on the roster matches
    status: Status
    problem: str = ""  # why there is no report, or why the last attempt failed; may be empty
    result: ResultStatus | None = None  # the stored result; None if there is nothing
    report: ReportData | None = None  # its report; None if there is none
    handed_back: ReportData | None = None  # the report with what students may see; None if there is none
    adjusted: Adjusted = field(default_factory=Adjusted)  # the score after the instructor's decisions
    marked_late: bool = False  # whether the platform marked it as late
    outdated: bool = False  # whether the result belongs to different files or another rubric than the current ones
    twin_of: tuple[str, ...] = ()  # names of other submissions by the same person

    @property
    def shown_name(self) -> str:
        """The person's name, or the label of the submission."""
        return self.person.name if self.person is not None else self.label

    @property
    def standing(self) -> str:
        """The status for people, which tells if an instructor set a score that the grader has not."""
        decided = self.adjusted.score is not None and self.status is not Status.GRADED
        return f"{self.status.value}, score set" if decided else self.status.value

    @property
    def refusal(self) -> str:
        """Why a submission cannot be used, for its student: without the folder where the class is graded."""
        return self.problem[max(0, self.problem.find(self.label)) :]

    @property
    def hint(self) -> str:
        """What the student can do about a submission that cannot be used; empty if there is nothing."""
        return self.result.hint if self.result is not None and self.status is Status.REFUSED else ""

    @property
    def max_score(self) -> Fraction | None:
        """Maximum points; None without a report."""
        return None if self.result is None or self.report is None else exactly(self.result.max_score)


@dataclass(frozen=True, slots=True)
class Gradebook:
    """The gradebook of a class."""

    rows: tuple[Row, ...]  # submissions by name, then people without one
    matching: RosterMatch = field(default_factory=RosterMatch)  # how submissions match the roster
    strays: tuple[str, ...] = ()  # entries of the sources that are not submissions
    foreign: tuple[str, ...] = ()  # names of results that belong to no current submission
    layouts: tuple[tuple[str, str], ...] = ()  # each source with its layout
    remarks: tuple[str, ...] = ()  # remarks for the instructor

    def count(self, status: Status) -> int:
        """Count the rows with a status."""
        return sum(row.status is status for row in self.rows)

    @property
    def author_mistakes(self) -> Mapping[str, tuple[Row, ...]]:
        """Mistakes of the rubrics' authors that leave criteria undecided, each with the rows that it concerns."""
        found: dict[str, list[Row]] = {}
        for row in self.rows:
            criteria = [criterion for exercise in exercises_of(row.report) for criterion in exercise["criteria"]]
            for mistake in dict.fromkeys(filter(None, map(author_mistake, criteria))):
                found.setdefault(mistake, []).append(row)
        return {mistake: tuple(rows) for mistake, rows in found.items()}

    @property
    def refused(self) -> tuple[Row, ...]:
        """Rows of people whose submission cannot be used, and who have no score otherwise."""
        without = [row for row in self.rows if row.status is Status.REFUSED and row.adjusted.score is None]
        return tuple(row for row in without if row.person is not None and not row.adjusted.ignored)

    @property
    def to_export(self) -> tuple[Row, ...]:
        """Rows to export to platforms: those with a score and a person, and only one submission that counts."""
        scored = [row for row in self.rows if row.adjusted.score is not None and row.person is not None]
        count = Counter(id(row.person) for row in scored)
        twins = {row.name for row in scored if any(t in {r.name for r in scored} for t in row.twin_of)}
        return tuple(row for row in scored if count[id(row.person)] == 1 and row.name not in twins)


def exactly(number: float) -> Fraction:
    """Convert a score from a report, which has at most six decimals, to the exact fraction."""
    return Fraction(str(round(number, 6)))


def make_gradebook(  # noqa: PLR0913  each comes from a different source
    intake: Intake,
    matching: RosterMatch,
    adjustments: Adjustments,
    *,
    kept: Mapping[str, Kept],
    keys: Mapping[str, str],
    report_of: Callable[[str], ReportData | None],
    handed_back_of: Callable[[str], ReportData | None],
    foreign: Sequence[str] = (),
) -> Gradebook:
    """Assemble the gradebook; raises ClassError for a decision about somebody who is not in this class.

    Stored results and the keys that current results have, empty if unknown, are given by name. The two functions read
    the complete report of a submission, and the one with what students may see.
    """
    decisions = decisions_for(intake.entries, matching, adjustments)
    twins = {name: tuple(n for n in group if n != name) for group in matching.duplicates for name in group}
    rows = []
    for entry in intake.entries:
        found = kept.get(entry.name, Kept())
        report = report_of(entry.name) if _has_report(found.result) else None
        rows.append(_row(entry, matching, found, report, keys.get(entry.name, "")))
        raw = exactly(report["score"]) if report is not None and report["final"] else None
        decision = decisions.get(entry.name, Decision())
        marked, criteria = _decided(report, decision)
        adjusted = adjust(raw, decision, adjustments, marked=marked, criteria=criteria)
        handed_back = handed_back_of(entry.name) if report is not None else None
        rows[-1] = replace(rows[-1], handed_back=handed_back, adjusted=adjusted, twin_of=twins.get(entry.name, ()))
    rows += [_missing(person, adjustments) for person in matching.missing]
    late = [row.name for row in rows if row.marked_late and not row.adjusted.days_late]
    remarks = [f"marked as late by the platform, but no late days are named: {', '.join(late)}"] if late else []
    odd = [entry.name for entry in intake.entries if not entry.recognised]
    remarks += [f"named otherwise than the layout names submissions: {', '.join(odd)}"] if odd else []
    return Gradebook(tuple(rows), matching, intake.strays, tuple(foreign), intake.layouts, tuple(remarks))


def _decided(report: ReportData | None, decision: Decision) -> tuple[Fraction | None, Mapping[str, CriterionDecision]]:
    """Return the points after decisions about criteria, None while some are undecided, and the decisions that apply."""
    points, final, found = Fraction(0), report is not None, {}
    for exercise in exercises_of(report):
        for criterion in exercise["criteria"]:
            id_ = f"{exercise['id']}/{criterion['id']}"
            decided = decision.criteria.get(id_)
            if decided is not None:
                found[id_] = decided
            if decided is not None and decided.score is not None:
                points += decided.score
            else:
                points += exactly(criterion["score"])
                final = final and criterion["outcome"] != "undecided"
    return points if final else None, found


def decisions_for(
    entries: Sequence[HandedInEntry], matching: RosterMatch, adjustments: Adjustments
) -> dict[str, Decision]:
    """Return name of an entry -> decision; raises ClassError for a decision about somebody outside of the class."""
    found: dict[str, Decision] = {}
    for who, decision in adjustments.students.items():
        meant = [entry.name for entry in entries if fold_handle(who) in _called(entry, matching.people.get(entry.name))]
        exact = [name for name in meant if name == who] or meant
        absent = any(fold_handle(who) in _handles(person) for person in matching.missing)
        if not exact and not absent:
            raise unknown_student(decision, who, [entry.name for entry in entries])
        found.update(dict.fromkeys(exact, decision))
    return found


def _called(entry: HandedInEntry, person: Person | None) -> set[str]:
    own = {fold_handle(text) for text in (entry.name, entry.label, *entry.identity.values())}
    return own | (_handles(person) if person is not None else set())


def _handles(person: Person) -> set[str]:
    return {*person.handles, *(fold_handle(t) for t in (person.name, person.user, person.email, person.id) if t)}


def _has_report(status: ResultStatus | None) -> bool:
    return status is not None and status.state in (State.GRADED, State.UNDECIDED)


def _row(entry: HandedInEntry, matching: RosterMatch, kept: Kept, report: ReportData | None, key: str) -> Row:
    result, last = kept.result, kept.last
    known = result is not None and (report is not None or not _has_report(result))
    return Row(
        name=entry.name,
        label=entry.label,
        person=matching.people.get(entry.name),
        status=Status(result.state.value) if result is not None and known else Status.NOT_RUN,
        problem="" if last is None else last.problem,
        result=result,
        report=report,
        marked_late=entry.late,
        outdated=result is not None and bool(key) and result.state is not State.FAILED and result.key != key,
    )


def _missing(person: Person, adjustments: Adjustments) -> Row:
    """Return the row of a person without a submission, who may still have been given a score."""
    called = _handles(person)
    decision = next((d for who, d in adjustments.students.items() if fold_handle(who) in called), Decision())
    return Row("", person.name, person, Status.MISSING, adjusted=adjust(None, decision, adjustments))


COLUMNS = (
    "submission",
    "name",
    "username",
    "email",
    "id",
    "status",
    "score",
    "max_score",
    "raw_score",
    "days_late",
    "penalty",
    "override",
    "reason",
    "remarks",
    "report",
)
_TEXT_LIMIT = 2_000


def render_gradebook(book: Gradebook) -> str:
    """Render the gradebook as CSV: the columns of `COLUMNS`, then the points by exercise and criterion."""
    exercises, criteria = _exercises_and_criteria(book.rows)
    header = [*COLUMNS, *exercises, *(f"{e}/{c}" for e, c in criteria)]
    rows = sorted(book.rows, key=lambda row: ((row.person or Person(row.label)).sort_key, row.name))
    return table(header, (_cells(row, exercises, criteria) for row in rows))


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Render CSV for spreadsheets and platforms; the cells must already be safe."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


def number(value: Fraction | float | None) -> str:
    """Format points; None becomes an empty text."""
    if value is None:
        return ""
    rounded = round(float(value), 6)
    return str(int(rounded)) if rounded.is_integer() else repr(rounded)


def text_cell(text: str) -> str:
    """Make untrusted text safe for a cell: one line, and no formula."""
    return csv_cell(text, limit=_TEXT_LIMIT)


def remarks(row: Row) -> list[str]:
    """Return the remarks about a row."""
    found = [shown(row.problem, limit=500)] if row.problem else []
    found += [f"hint: {shown(row.hint, limit=500)}"] if row.hint else []
    found += [f"{id_}: {_decision(decided)}" for id_, decided in row.adjusted.criteria.items()]
    found += [f"comment: {row.adjusted.comment}"] if row.adjusted.comment else []
    if row.outdated:
        found.append("the result is of other files or of another rubric than now")
    if row.twin_of:
        found.append(f"the same person as {', '.join(row.twin_of)}")
    if row.name and row.person is None:
        found.append("nobody on the roster goes with it for sure")
    if row.marked_late:
        found.append("marked as late by the platform")
    if row.adjusted.ignored:
        found.append("does not count")
    if row.status.value == "undecided":
        found.append("not final: a criterion was not decided, through no fault of the student")
    return found


def _decision(decided: CriterionDecision) -> str:
    points = "" if decided.score is None else f"set to {number(decided.score)}, {decided.reason}"
    return "; ".join(text for text in (points, decided.comment) if text)


def _cells(row: Row, exercises: Sequence[str], criteria: Sequence[tuple[str, str]]) -> list[str]:
    person, adjusted = row.person, row.adjusted
    texts = [row.name, row.shown_name, *((person.user, person.email, person.id) if person else ("", "", ""))]
    raw = None if row.report is None else row.report["score"]
    return [
        *map(text_cell, texts),
        row.standing,
        number(adjusted.score),
        number(row.max_score),
        number(raw),
        number(adjusted.days_late) if adjusted.days_late else "",
        number(adjusted.penalty) if adjusted.penalty else "",
        number(adjusted.override),
        text_cell(adjusted.reason),
        text_cell("; ".join(remarks(row))),
        text_cell(f"students/{row.name}/report.html") if row.report is not None else "",
        *_points(row, exercises, criteria),
    ]


def _exercises_and_criteria(rows: Iterable[Row]) -> tuple[list[str], list[tuple[str, str]]]:
    """Return all exercises and criteria of the rows, in the order of the reports."""
    exercises: dict[str, None] = {}
    criteria: dict[tuple[str, str], None] = {}
    for row in rows:
        for exercise in exercises_of(row.report):
            exercises[exercise["id"]] = None
            criteria.update({(exercise["id"], criterion["id"]): None for criterion in exercise["criteria"]})
    return list(exercises), sorted(criteria, key=lambda pair: list(exercises).index(pair[0]))


def _points(row: Row, exercises: Sequence[str], criteria: Sequence[tuple[str, str]]) -> list[str]:
    """Return the grader's points by exercise, and those that count by criterion."""
    by_exercise = {e["id"]: e for e in exercises_of(row.report)}
    set_ = {id_: decided.score for id_, decided in row.adjusted.criteria.items() if decided.score is not None}
    found = {(id_, c["id"]): c for id_, e in by_exercise.items() for c in e["criteria"]}
    decided = {pair: criterion for pair, criterion in found.items() if criterion["outcome"] != "undecided"}
    return [
        *(number(by_exercise[id_]["score"]) if id_ in by_exercise else "" for id_ in exercises),
        *(number(set_.get("/".join(pair), decided[pair]["score"] if pair in decided else None)) for pair in criteria),
    ]


def exercises_of(report: ReportData | None) -> Sequence[ExerciseData]:
    """Return the exercises of a report, none without one."""
    return () if report is None else report["exercises"]


def author_mistake(criterion: CriterionData) -> str:
    """Return the mistake of the rubric's author that leaves a criterion undecided, with its place; empty if none."""
    open_ = criterion["outcome"] == Outcome.UNDECIDED.value
    found = criterion.get("evidence", {}).get(AUTHOR_MISTAKE) if open_ else None
    return str(AuthorMistake(**found)) if found else ""
