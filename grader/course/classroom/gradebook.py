"""The gradebook of a class, with a row for each submission and each person without one; also as CSV."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from enum import Enum
from fractions import Fraction

from grader.course.classroom.adjustments import (
    Adjusted,
    Adjustments,
    CriterionDecision,
    Decision,
    adjust,
    decided_twice,
    several_students,
    unknown_student,
)
from grader.course.classroom.intake import HandedInEntry, Intake
from grader.course.classroom.roster import Person, RosterMatch, Table, fold_handle, late_by, late_days
from grader.course.classroom.store import Kept, ResultStatus, State
from grader.grading.model.exercise import Outcome
from grader.grading.model.report import AUTHOR_MISTAKE, SUBMISSION_SUSPECTED
from grader.grading.reporting.escape import csv_cell, shown
from grader.grading.reporting.json_report import CriterionData, ExerciseData, ReportData
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.dataclass import dataclass


class Status(str, Enum):
    """Status of a row; the first four are the states of a result."""

    GRADED = "graded"
    UNDECIDED = "undecided"
    REFUSED = "refused"
    FAILED = "failed"
    NOT_RUN = "not run"
    MISSING = "nothing handed in"
    EXCUSED = "excused"


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
    late: str = ""  # how late it was, as the platform says; empty if that is not known
    outdated: bool = False  # whether the result belongs to different files or another rubric than the current ones
    twin_of: tuple[str, ...] = ()  # names of other submissions by the same person
    namesakes: bool = False  # whether another row is shown by the same name

    @property
    def shown_name(self) -> str:
        """The person's name, or the label of the submission."""
        return self.person.name if self.person is not None else self.label

    @property
    def distinct_name(self) -> str:
        """The name in a list of names: with an id where another row has the same name."""
        ids = {} if self.person is None else self.person.platform_ids
        own = self.name or next(iter(ids.values()), "")
        return f"{self.shown_name} ({own})" if self.namesakes and own else self.shown_name

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
            criteria = [criterion for exercise in report_exercises(row.report) for criterion in exercise["criteria"]]
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
    extra: Fraction = Fraction(0),
    worksheet: Table | None = None,
) -> Gradebook:
    """Assemble the gradebook; raises ClassError for a decision about somebody who is not in this class.

    Rubrics allow `extra` points above the maximum. A worksheet of Moodle may say who was late. Stored results and the
    keys that current results have, empty if unknown, are given by name. The two functions read the complete report of a
    submission, and the one with what students may see.
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
        highest = rows[-1].max_score
        most = None if highest is None else highest + extra
        adjusted = adjust(raw, decision, adjustments, marked=marked, criteria=criteria, most=most)
        handed_back = handed_back_of(entry.name) if report is not None else None
        if handed_back == report:
            handed_back = report  # one copy in memory, of which a class of thousands has thousands
        late = late_by(rows[-1].person, worksheet)
        rows[-1] = replace(
            rows[-1],
            handed_back=handed_back,
            adjusted=adjusted,
            twin_of=twins.get(entry.name, ()),
            marked_late=entry.late or bool(late),
            late=late,
        )
    rows += [_missing(person, adjustments) for person in matching.missing]
    count = Counter(row.shown_name for row in rows)
    rows = [replace(row, namesakes=True) if count[row.shown_name] > 1 else row for row in rows]
    odd = [entry.name for entry in intake.entries if not entry.recognised]
    remarks = [*_late_remarks(rows), *_excess(rows, extra)]
    remarks += [f"named differently from the layout: {', '.join(odd)}"] if odd else []
    return Gradebook(tuple(rows), matching, intake.strays, tuple(foreign), intake.layouts, tuple(remarks))


def _late_remarks(rows: Sequence[Row]) -> Iterator[str]:
    """Yield a line for each late submission without late days, with what can be copied into the file of decisions."""
    for row in rows:
        if row.marked_late and not row.adjusted.days_late and not row.adjusted.ignored:
            how_much = f" ({row.late})" if row.late else ""
            given = f"`{row.name}: {{days_late: {late_days(row.late) or 'N'}}}`"
            who = f"{row.distinct_name}{how_much}"
            yield f"marked as late by the platform, no days given: {who}; in adjust.yaml: {given}"


def _excess(rows: Sequence[Row], extra: Fraction) -> Iterator[str]:
    """Yield a line for each score that was set above the maximum of a student's own exercises."""
    for row in rows:
        score = row.adjusted.override
        if score is not None and row.max_score is not None and score > row.max_score + extra:
            most = points_text(row.max_score + extra)
            yield f"the score set for {row.distinct_name}, {points_text(score)}, is above the maximum of {most} points"


def _decided(report: ReportData | None, decision: Decision) -> tuple[Fraction | None, Mapping[str, CriterionDecision]]:
    """Return the points after decisions about criteria, None while some are undecided, and the decisions that apply."""
    points, final, found = Fraction(0), report is not None, {}
    for exercise in report_exercises(report):
        for criterion in exercise["criteria"]:
            id_ = f"{exercise['id']}/{criterion['id']}"
            decided = decision.criteria.get(id_)
            # Nor are they final while a check is open, which may take them away.
            open_ = criterion["outcome"] == "undecided" or bool(exercise.get("unchecked"))
            if decided is not None:
                found[id_] = decided
            if decided is not None and decided.score is not None:
                points += decided.score
            else:
                points += exactly(criterion["score"])
                final = final and not open_
    return points if final else None, found


def decisions_for(
    entries: Sequence[HandedInEntry], matching: RosterMatch, adjustments: Adjustments
) -> dict[str, Decision]:
    """Return name of an entry -> decision.

    The name of a submission counts for this one; a name that it had before others of this name came, and ids of a
    student, for all submissions of that student. Raises ClassError for a decision about somebody outside of the class,
    one that several students may be meant by, and a second one about a submission.
    """
    found: dict[str, tuple[str, Decision]] = {}
    by_name = {entry.name: entry for entry in entries}
    exact = {who: by_name[who] for who in adjustments.students if who in by_name}
    for who, entry in exact.items():
        found[entry.name] = (who, adjustments.students[who])
    for who, decision in adjustments.students.items():
        if who in exact:
            continue
        meant = [entry for entry in entries if fold_handle(who) in _called(entry, matching.people.get(entry.name))]
        absent = [person for person in matching.missing if fold_handle(who) in _handles(person)]
        if not meant and not absent:
            raise unknown_student(decision, who, [entry.name for entry in entries])
        if len({_student(entry, matching) for entry in meant}) + len(absent) > 1:
            others = [_other_id(person, who) for person in absent]
            raise several_students(decision, who, [*(entry.name for entry in meant), *others])
        for entry in meant:
            if entry.name in exact:
                continue  # an entry for one submission takes precedence over an entry for its student
            if entry.name in found:
                raise decided_twice(decision, who, entry.name, found[entry.name][0])
            found[entry.name] = (who, decision)
        if meant and all(entry.name in exact for entry in meant):
            raise decided_twice(decision, who, meant[0].name, meant[0].name)
    return {name: decision for name, (_, decision) in found.items()}


def _other_id(person: Person, but: str) -> str:
    """Return what names a person in a decision, but not this text."""
    found = (text for text in (person.email, person.user, person.id) if text and fold_handle(text) != fold_handle(but))
    return next(found, person.name)


def _student(entry: HandedInEntry, matching: RosterMatch) -> tuple[str, ...]:
    """Return what tells students apart: equal for two submissions of one student."""
    person = matching.people.get(entry.name)
    if person is not None and person.row is not None:
        return ("on the roster", str(id(person)))
    return tuple(f"{kind}={text}" for kind, text in sorted(entry.identity.items())) or (fold_handle(entry.label),)


def _called(entry: HandedInEntry, person: Person | None) -> set[str]:
    own = {fold_handle(text) for text in (entry.name, entry.label, entry.base, *entry.identity.values())}
    own -= {""}
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
    adjusted = adjust(None, decision, adjustments)
    status = Status.EXCUSED if adjusted.ignored else Status.MISSING
    return Row("", person.name, person, status, adjusted=adjusted)


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
    "bonus",
    "decisions",
)
#: Spreadsheets hold 32,767 characters in a cell; nobody reads more than this.
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


def points_text(value: Fraction | float | None) -> str:
    """Format points; None becomes an empty text."""
    if value is None:
        return ""
    rounded = round(float(value), 6)
    return str(int(rounded)) if rounded.is_integer() else repr(rounded)


def text_cell(text: str) -> str:
    """Make untrusted text safe for a cell: one line, and no formula."""
    return csv_cell(text, limit=_TEXT_LIMIT)


def row_remarks(row: Row) -> list[str]:
    """Return the remarks about a row."""
    found = [shown(row.problem, limit=500)] if row.problem else []
    found += [f"hint: {shown(row.hint, limit=500)}"] if row.hint else []
    commented = {id_: decided.comment for id_, decided in row.adjusted.criteria.items() if decided.comment}
    found += [f"comment on {id_}: {comment}" for id_, comment in commented.items()]
    found += [f"comment: {row.adjusted.comment}"] if row.adjusted.comment else []
    if row.outdated:
        found.append("the result belongs to other files or to another rubric")
    if row.twin_of:
        found.append(f"the same person as {', '.join(row.twin_of)}")
    if row.name and row.person is None:
        found.append("matches nobody on the roster with certainty")
    if row.marked_late:
        found.append(f"marked as late by the platform{f' ({row.late})' if row.late else ''}")
    if row.adjusted.ignored:
        found.append("does not count")
    if row.status.value == "undecided":
        found += [f"not final: {shown(why, limit=500)}" for why in unchecked(row.report)]
        criteria = [c for e in report_exercises(row.report) for c in e["criteria"]]
        theirs = any(map(may_be_theirs, criteria))
        why = "perhaps because of what the submission does" if theirs else "through no fault of the student"
        if any(criterion["outcome"] == Outcome.UNDECIDED.value for criterion in criteria):
            found.append(f"not final: a criterion was not decided, {why}")
    return found


def decision_line(row: Row) -> str:
    """Return what was decided about a row, as `20 -> 28 (rate, the machine was slow)`; empty if nothing was."""
    causes = decision_causes(row)
    if not causes:
        return ""
    before = None if row.report is None else exactly(row.report["score"])
    after = row.adjusted.score
    return f"{points_text(before) or 'no score'} -> {points_text(after) or 'no score'} ({'; '.join(causes)})"


def decision_causes(row: Row) -> list[str]:
    """Return each decision about a row with its reason, in the order in which they count."""
    adjusted = row.adjusted
    ids = [f"{e['id']}/{c['id']}" for e in report_exercises(row.report) for c in e["criteria"]]
    found = [f"{old} renamed to {new}" for old, new in adjusted.rename.items()]
    if adjusted.ignored:
        return [*found, f"ignored, {adjusted.reason}"]
    for id_, decided in adjusted.criteria.items():
        short = id_.partition("/")[2]
        name = short if sum(full.endswith(f"/{short}") for full in ids) == 1 else id_
        found += [f"{name}, {decided.reason}"] if decided.score is not None else []
    if adjusted.override is not None:
        found.append(f"score set, {adjusted.reason}")
    elif adjusted.days_late:
        points = (
            "1 point"
            if adjusted.penalty == 1
            else f"{points_text(adjusted.penalty) if adjusted.penalty else 'no'} points"
        )
        found.append(f"{days(adjusted.days_late)} late, {points} off")
    if adjusted.bonus or adjusted.bonus_lost:
        counts = (
            f", of which {points_text(adjusted.bonus)} count: the maximum is reached" if adjusted.bonus_lost else ""
        )
        found.append(f"bonus {points_text(adjusted.bonus + adjusted.bonus_lost)}{counts}, {adjusted.reason}")
    if not found and (adjusted.comment or any(decided.comment for decided in adjusted.criteria.values())):
        found.append("comment")
    return found


def days(count: Fraction) -> str:
    """Return a number of days as text."""
    return f"{points_text(count)} {'day' if count == 1 else 'days'}"


def _cells(row: Row, exercises: Sequence[str], criteria: Sequence[tuple[str, str]]) -> list[str]:
    person, adjusted = row.person, row.adjusted
    texts = [row.name, row.shown_name, *((person.user, person.email, person.id) if person else ("", "", ""))]
    raw = None if row.report is None else row.report["score"]
    return [
        *map(text_cell, texts),
        row.standing,
        points_text(adjusted.score),
        points_text(row.max_score),
        points_text(raw),
        points_text(adjusted.days_late) if adjusted.days_late else "",
        points_text(adjusted.penalty) if adjusted.penalty else "",
        points_text(adjusted.override),
        text_cell(adjusted.reason),
        text_cell("; ".join(row_remarks(row))),
        text_cell(f"students/{row.name}/report.html") if row.report is not None else "",
        points_text(adjusted.bonus) if adjusted.bonus else "",
        text_cell(decision_line(row)),
        *_points(row, exercises, criteria),
    ]


def _exercises_and_criteria(rows: Iterable[Row]) -> tuple[list[str], list[tuple[str, str]]]:
    """Return all exercises and criteria of the rows, in the order of the reports."""
    exercises: dict[str, None] = {}
    criteria: dict[tuple[str, str], None] = {}
    for row in rows:
        for exercise in report_exercises(row.report):
            exercises[exercise["id"]] = None
            criteria.update({(exercise["id"], criterion["id"]): None for criterion in exercise["criteria"]})
    return list(exercises), sorted(criteria, key=lambda pair: list(exercises).index(pair[0]))


def _points(row: Row, exercises: Sequence[str], criteria: Sequence[tuple[str, str]]) -> list[str]:
    """Return the grader's points by exercise, and those that count by criterion."""
    by_exercise = {e["id"]: e for e in report_exercises(row.report)}
    set_ = {id_: decided.score for id_, decided in row.adjusted.criteria.items() if decided.score is not None}
    found = {(id_, c["id"]): c for id_, e in by_exercise.items() for c in e["criteria"]}
    decided = {pair: criterion for pair, criterion in found.items() if criterion["outcome"] != "undecided"}
    return [
        *(points_text(by_exercise[id_]["score"]) if id_ in by_exercise else "" for id_ in exercises),
        *(
            points_text(set_.get("/".join(pair), decided[pair]["score"] if pair in decided else None))
            for pair in criteria
        ),
    ]


def report_exercises(report: ReportData | None) -> Sequence[ExerciseData]:
    """Return the exercises of a report, none without one."""
    return () if report is None else report["exercises"]


def unchecked(report: ReportData | None) -> list[str]:
    """Return why checks on the wall clock ended without a result, each reason once."""
    return list(dict.fromkeys(filter(None, (exercise.get("unchecked", "") for exercise in report_exercises(report)))))


def may_be_theirs(criterion: CriterionData) -> bool:
    """Return whether a criterion is undecided for a reason that the submission itself may have caused."""
    open_ = criterion["outcome"] == Outcome.UNDECIDED.value
    return open_ and criterion.get("evidence", {}).get(SUBMISSION_SUSPECTED) is True


def author_mistake(criterion: CriterionData) -> str:
    """Return the mistake of the rubric's author that leaves a criterion undecided, with its place; empty if none."""
    open_ = criterion["outcome"] == Outcome.UNDECIDED.value
    found = criterion.get("evidence", {}).get(AUTHOR_MISTAKE) if open_ else None
    return str(AuthorMistake(**found)) if found else ""
