"""The gradebook of a class as CSV: everybody, with the raw score beside all that was decided about it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from grader.batch.classbook import Classbook, ReportData, Row
from grader.reports.escape import csv_cell, shown

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


def render_gradebook(book: Classbook) -> str:
    """Return the gradebook: one row for everybody, then points by exercise and criterion."""
    exercises, criteria = _asked(book.rows)
    header = [*COLUMNS, *exercises, *(f"{e}/{c}" for e, c in criteria)]
    return table(header, (_cells(row, exercises, criteria) for row in book.rows))


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return CSV as spreadsheets and platforms read it; the cells have been made safe before."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


def number(value: Fraction | float | None) -> str:
    """Return points as digits; nothing where there are none."""
    if value is None:
        return ""
    rounded = round(float(value), 6)
    return str(int(rounded)) if rounded.is_integer() else repr(rounded)


def text_cell(text: str) -> str:
    """Return foreign text for a cell: one line, and no formula."""
    return csv_cell(text, limit=_TEXT_LIMIT)


def remarks(row: Row) -> list[str]:
    """Return what somebody who reads this row must know."""
    found = [shown(row.problem, limit=500)] if row.problem else []
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


def _cells(row: Row, exercises: Sequence[str], criteria: Sequence[tuple[str, str]]) -> list[str]:
    person, adjusted = row.person, row.adjusted
    texts = [row.name, row.shown_name, *((person.user, person.email, person.id) if person else ("", "", ""))]
    raw = None if row.report is None else row.report["score"]
    return [
        *map(text_cell, texts),
        row.status.value,
        number(adjusted.score),
        number(row.max_score),
        number(raw),
        number(adjusted.days_late) if adjusted.days_late else "",
        number(adjusted.penalty) if adjusted.penalty else "",
        number(adjusted.override),
        text_cell(adjusted.reason),
        text_cell("; ".join(remarks(row))),
        text_cell(f"students/{row.name}/report.html") if row.report is not None else "",
        *_points(row.report, exercises, criteria),
    ]


def _asked(rows: Iterable[Row]) -> tuple[list[str], list[tuple[str, str]]]:
    """Return all exercises and criteria that occur, in the order of the reports."""
    exercises: dict[str, None] = {}
    criteria: dict[tuple[str, str], None] = {}
    for row in rows:
        for exercise in _exercises(row.report):
            exercises[exercise["id"]] = None
            criteria.update({(exercise["id"], criterion["id"]): None for criterion in exercise["criteria"]})
    return list(exercises), sorted(criteria, key=lambda pair: list(exercises).index(pair[0]))


def _points(report: ReportData | None, exercises: Sequence[str], criteria: Sequence[tuple[str, str]]) -> list[str]:
    by_exercise = {e["id"]: e for e in _exercises(report)}
    found = {(id_, c["id"]): c for id_, e in by_exercise.items() for c in e["criteria"]}
    return [
        *(number(by_exercise[id_]["score"]) if id_ in by_exercise else "" for id_ in exercises),
        *("" if pair not in found or _open(found[pair]) else number(found[pair]["score"]) for pair in criteria),
    ]


def _open(criterion: Mapping[str, Any]) -> bool:
    return bool(criterion["outcome"] == "undecided")


def _exercises(report: ReportData | None) -> Sequence[Mapping[str, Any]]:
    return () if report is None else report["exercises"]
