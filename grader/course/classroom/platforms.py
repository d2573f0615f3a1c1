"""Exports scores for Canvas, Moodle and Gradescope, and lists the people who are left out."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field

from grader.course.classroom.final_marks import criteria_of, decisions
from grader.course.classroom.gradebook import Gradebook, Row, points_text, report_exercises, table, text_cell
from grader.course.classroom.roster import Person, Table, row_of
from grader.grading.reporting.escape import shown as safe
from grader.grading.reporting.json_report import CriterionData, json_text
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError
from grader.runtime.model.wording import listed, printable

#: The columns that Canvas requires before the scores, in this order.
CANVAS_COLUMNS = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")
#: The columns that Moodle can identify people by, the most reliable first.
MOODLE_COLUMNS = ("Email address", "Username", "ID number")
GRADESCOPE_COLUMNS = ("Name", "SID", "Email", "Total Score", "Max Points", "Status")
_POSSIBLE = "points possible"
_FEEDBACK = 4_000


@dataclass(frozen=True, slots=True)
class Export:
    """The files for a platform."""

    files: Mapping[str, str] = field(default_factory=dict)  # name, relative to the results folder -> content
    left_out: tuple[str, ...] = ()  # who is missing, and why; one line each
    remark: str = ""


def export_canvas(book: Gradebook, assignment: str, gradebook: Table | None) -> Export:
    """Export scores for Canvas; raises ClassError if nothing has this number, or nobody has a Canvas id.

    The file contains only people with a score and only this one column, so that later changes in Canvas are kept.
    Without the gradebook that Canvas exported, the roster must have the ids. The assignment is a number, or a title
    with the number in parentheses.
    """
    title = _canvas_title(assignment, gradebook)
    rows: list[list[str]] = []
    left_out: list[str] = []
    maxima = {row.max_score for row in book.to_export if row.max_score is not None}
    for row in _counted(book, left_out):
        found = _canvas_row(row, gradebook)
        if found is None or not found.get("ID", "").strip():
            where = "the roster" if gradebook is None else gradebook.path.name
            left_out.append(f"{row.distinct_name}: {where} has no Canvas number (column ID) for this person")
        else:
            rows.append([*(text_cell(found.get(name, "")) for name in CANVAS_COLUMNS), points_text(row.adjusted.score)])
    possible = _possible(gradebook, title) or points_text(max(maxima, default=None))
    ours = listed([points_text(points) for points in sorted(maxima)] or [possible])
    remark = "" if ours == possible else _line(f"{title} has {possible} points in Canvas, the reports have {ours}")
    header = [*CANVAS_COLUMNS, text_cell(title)]
    points = ["    Points Possible", *[""] * (len(CANVAS_COLUMNS) - 1), text_cell(possible)]
    return Export({"canvas.csv": table(header, [points, *rows])}, tuple(map(_line, left_out)), remark)


def export_moodle(book: Gradebook, users: Table) -> Export:
    """Export grades and feedback for Moodle's grade import; importing one without the other deletes grades.

    Who handed in something that cannot be used has no grade, and the reason and the hint as feedback.

    People who are not in the table of users are left out, because Moodle rejects a file with an unknown user. Raises
    ClassError if the table has no column that Moodle can identify people by.
    """
    by_name = {name.strip().casefold(): name for name in users.header}
    column = next((name for name in MOODLE_COLUMNS if name.casefold() in by_name), None)
    if column is None:
        found = listed([printable(name, 30) for name in users.header[:6]], "and")
        raise ClassError(f"{users.path}:1: expected a column {listed(MOODLE_COLUMNS)}, found {found}")
    rows: list[list[str]] = []
    left_out: list[str] = []
    refused = [row for row in book.refused if not row.twin_of]
    names = {row.name for row in refused}
    for row in (*_counted(book, left_out, but=names), *refused):
        found_row = row_of(row.person, users)
        value = "" if found_row is None else found_row[by_name[column.casefold()]].strip()
        if not value:
            left_out.append(f"{row.distinct_name}: nobody with this name, address or number in {users.path.name}")
        elif text_cell(value) != value:
            left_out.append(f"{row.distinct_name}: {column} looks like a formula of a spreadsheet")
        else:
            rows.append([value, points_text(row.adjusted.score), text_cell(html.escape(feedback(row), quote=False))])
    return Export({"moodle.csv": table([column, "Grade", "Feedback"], rows)}, tuple(map(_line, left_out)))


def export_gradescope(book: Gradebook, results: Mapping[str, str]) -> Export:
    """Export a results.json for each submission, as an autograder would write it, and a table of all scores."""
    files: dict[str, str] = {}
    rows: list[list[str]] = []
    left_out: list[str] = []
    for row in _counted(book, left_out):
        person = row.person or Person(row.label)
        texts = [text_cell(text) for text in (person.name, person.id, person.email)]
        rows.append([*texts, points_text(row.adjusted.score), points_text(row.max_score), "Graded"])
        if row.name in results:
            files[f"gradescope/{row.name}/results.json"] = _decided(results[row.name], row)
    return Export({"gradescope.csv": table(GRADESCOPE_COLUMNS, rows), **files}, tuple(map(_line, left_out)))


def withheld(book: Gradebook) -> tuple[str, ...]:
    """Return the criteria that count in an exported score although their students may not see them, by full id."""
    found: dict[str, None] = {}
    for row in book.to_export:
        seen = {full_id for full_id, _ in criteria_of(row.handed_back)}
        if row.handed_back is not None:
            found.update({full_id: None for full_id, _ in criteria_of(row.report) if full_id not in seen})
    return tuple(found)


def feedback(row: Row) -> str:
    """Write the feedback for a student in one line: score, decision, and each lost point with its reason.

    The score is the final mark, which the platform shows too. Only reasons that students may see are included.
    """
    if row.report is None:
        said = [f"Not graded: {row.refusal}." if row.refusal else "", f"Hint: {row.hint}." if row.hint else ""]
        return safe(" ".join(part for part in (*said, *decisions(row)) if part), limit=_FEEDBACK)
    parts = [f"{points_text(row.adjusted.score)} of {points_text(row.max_score)} points.", *decisions(row)]
    parts += _first_hint(row)
    parts += [_lost(criterion) for exercise in report_exercises(row.handed_back) for criterion in exercise["criteria"]]
    return safe(" ".join(part for part in parts if part), limit=_FEEDBACK)


def _first_hint(row: Row) -> list[str]:
    """Return the first thing to do, as far as the student may see it."""
    criteria = [criterion for exercise in report_exercises(row.handed_back) for criterion in exercise["criteria"]]
    lost = [c["hint"] for c in criteria if c["outcome"] in ("not_met", "partly") and c.get("hint")]
    return [f"First hint: {lost[0]}."] if lost else []


def _lost(criterion: CriterionData) -> str:
    if criterion["outcome"] == "met":
        return ""
    points = f"{points_text(criterion['score'])}/{points_text(criterion['max_score'])}"
    return f"[{points}] {criterion['title']}: {criterion['reason']}"


def _counted(book: Gradebook, left_out: list[str], but: Collection[str] = ()) -> Sequence[Row]:
    """Return the rows to export; list everybody else who handed something in, but for some names."""
    to_export = book.to_export
    chosen = {id(row) for row in to_export}
    for row in book.rows:
        if id(row) in chosen or row.adjusted.ignored or not row.name or row.name in but:
            continue
        if row.person is None:
            why = "matches nobody on the roster with certainty"
        elif row.adjusted.score is None:
            why = f"no score: {row.status.value}"
        else:
            why = f"the same person as {', '.join(row.twin_of)}; say which one to `ignore`"
        left_out.append(f"{row.name}: {why}")
    return to_export


def _canvas_title(assignment: str, gradebook: Table | None) -> str:
    """Return the header of the assignment's column; Canvas identifies it by the number in parentheses."""
    number_ = re.fullmatch(r"(?:.*\()?(\d+)\)?", assignment.strip(), re.DOTALL)
    if number_ is None:
        hint = "open the assignment in Canvas: the number is at the end of its address"
        raise ClassError(f"--canvas: expected an assignment's number, found {printable(assignment)}", hint)
    if gradebook is None:
        return assignment.strip() if "(" in assignment else f"Assignment ({number_[1]})"
    title = next((name for name in gradebook.header if name.rstrip().endswith(f"({number_[1]})")), None)
    if title is None:
        raise ClassError(f"{gradebook.path}:1: expected a column that ends in ({number_[1]}), found none")
    return title


def _canvas_row(row: Row, gradebook: Table | None) -> Mapping[str, str] | None:
    """Return a person's row in the Canvas gradebook, or on the roster if there is no gradebook."""
    if gradebook is not None:
        return row_of(row.person, gradebook)
    person = row.person
    return person.row if person is not None and person.canvas else None


def _possible(gradebook: Table | None, title: str) -> str:
    """Return the possible points of an assignment in Canvas; empty if unknown."""
    for row in gradebook.rows if gradebook is not None else ():
        if next(iter(row.values())).strip().casefold() == _POSSIBLE:
            return row[title].strip()
    return ""


def _decided(results: str, row: Row) -> str:
    """Put the final score into a results.json, and keep the raw one as extra data."""
    data = json.loads(results)
    if row.adjusted.changed:
        data["extra_data"]["raw_score"] = data["score"]
        data["score"] = float(row.adjusted.score or 0)
    if said := decisions(row):
        data["output"] = "\n".join([*(safe(text, limit=1_200) for text in said), data["output"]])
    return json_text(data)


def _line(text: str) -> str:
    return safe(text, limit=300)
