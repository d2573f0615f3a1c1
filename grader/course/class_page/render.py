"""Renders the page of a class as HTML, from a template that escapes everything."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from importlib.resources import files
from urllib.parse import quote

from jinja2 import Template
from markupsafe import Markup

from grader.course.class_page.causes import CommonCause, causes
from grader.course.class_page.contents import (
    ClassPage,
    Distribution,
    ExerciseCount,
    PageLink,
    StudentRow,
    distribution,
    exercise_counts,
)
from grader.grading.model.exercise import Outcome, exercise_name
from grader.grading.reporting import wording
from grader.grading.reporting.escape import script_json, shown
from grader.grading.reporting.html.assets import Bundle, bundle, page_environment
from grader.grading.reporting.json_report import ReportData


@cache
def own_bundle() -> Bundle:
    """Return what the page needs besides the bundle of reports, which it extends."""
    folder = files(__package__) / "assets"
    script, style = ((folder / name).read_text(encoding="utf-8") for name in ("class.js", "class.css"))
    return Bundle("class", script, style)


def class_assets() -> dict[str, bytes]:
    """Return file name -> content of the files that a page rendered with `assets=...` loads."""
    return {**bundle().files, **own_bundle().files}


#: One letter for each outcome, and one for a criterion that a report lacks.
LETTERS = {Outcome.MET: "m", Outcome.PARTLY: "p", Outcome.NOT_MET: "n", Outcome.BLOCKED: "b", Outcome.UNDECIDED: "u"}
NOT_ASKED = "-"
_NAME_LIMIT = 100


def payload(
    page: ClassPage, exercises: Sequence[ExerciseCount], found: Sequence[CommonCause], spread: Distribution
) -> dict[str, object]:
    """Return the data of the page."""
    criteria = [(e.id, c.id) for e in exercises for c in e.criteria]
    return {
        "criteria": [f"{exercise}/{criterion}" for exercise, criterion in criteria],
        "students": [_student(student, exercises, criteria) for student in page.students],
        "causes": [list(cause.students) for cause in found],
        "bins": [[b.label, b.low, b.high, b.raw, b.final] for b in spread.bins],
        "changed": spread.changed,
        "max_score": float(spread.max_score),
    }


def _student(
    student: StudentRow, exercises: Sequence[ExerciseCount], criteria: Sequence[tuple[str, str]]
) -> dict[str, object]:
    """Return the sort keys of a row, column by column, and the outcome of each criterion as one letter."""
    by_id = {} if student.report is None else {e["id"]: e for e in student.report["exercises"]}
    outcomes = {(e, c["id"]): LETTERS[Outcome(c["outcome"])] for e, x in by_id.items() for c in x["criteria"]}
    change = None if student.final is None or student.raw is None else student.final - student.raw
    return {
        "name": shown(student.name, limit=_NAME_LIMIT),
        "status": student.status,
        "raw": student.raw,
        "change": change if student.adjustments else None,
        "final": student.final,
        "exercises": [by_id[e.id]["score"] if e.id in by_id else None for e in exercises],
        "outcomes": "".join(outcomes.get(pair, NOT_ASKED) for pair in criteria),
    }


#: More causes than the first number are folded, more than the second only counted.
FIRST_CAUSES, MOST_CAUSES = 8, 40
#: More entries of a list, such as that of crashes, are folded: this many fill a screen.
FIRST_ENTRIES = 30
REPORT_PAGE, REPORT_DATA = "report.html", "report.json"
#: The same as far as students may see it.
HANDED_BACK_PAGE = "feedback.html"


def render_class(page: ClassPage, *, assets: str | None = None) -> str:
    """Return the page of a class, all of whose text is treated as hostile; it makes no network requests.

    The files of `class_assets` are found at `assets`, relative to the page; None puts them into the page.
    """
    counted = [(k, s.report) for k, s in enumerate(page.students) if s.report is not None and s.counts]
    exercises = exercise_counts(report for _, report in counted)
    found = causes(counted)
    spread = distribution(page.students)
    return _template().render(
        page=page,
        exercises=exercises,
        causes=found,
        first_causes=FIRST_CAUSES,
        first_entries=FIRST_ENTRIES,
        most_causes=MOST_CAUSES,
        spread=spread,
        tiles=_tiles(page, spread),
        outcomes=wording.OUTCOME_WORDS,
        bundles=(bundle(), own_bundle()),
        assets=assets,
        data=Markup(script_json(payload(page, exercises, found, spread))),  # noqa: S704  safe in a script element
    )


def result_link(folder: str, file: str, anchor: str = "") -> str:
    """Return the link to a file below `students/`, percent-encoded; empty if it would leave the results."""
    path = page_link(PageLink("", f"students/{folder}/{file}")) if "/" not in folder and folder else ""
    return f"{path}#{quote(anchor, safe='', errors='replace')}" if path and anchor else path


def page_link(link: PageLink) -> str:
    """Return the link to another page in the results folder; empty if it would leave the folder."""
    parts = link.path.split("/")
    wrong = any(part in ("", ".", "..") or "\\" in part or "\0" in part for part in parts)
    return "" if wrong else "/".join(quote(part, safe="", errors="replace") for part in parts)


@cache
def _template() -> Template:
    templates = page_environment("grader.course.class_page")
    templates.filters |= {"points": _points, "percent": _percent}
    templates.globals |= {
        "embedded": Markup,
        "exercise_name": exercise_name,
        "result_link": result_link,
        "page_link": page_link,
        "segments": _segments,
        "exercise_points": exercise_points,
        "report_page": REPORT_PAGE,
        "report_data": REPORT_DATA,
        "handed_back_page": HANDED_BACK_PAGE,
    }
    return templates.get_template("class.html")


def exercise_points(report: ReportData | None, id_: str) -> Fraction | None:
    """Return the points of an exercise in a report; None if the report lacks it."""
    exercises = () if report is None else report["exercises"]
    return next((Fraction(str(e["score"])) for e in exercises if e["id"] == id_), None)


def _tiles(page: ClassPage, spread: Distribution) -> list[tuple[str, str]]:
    """Return the key figures with their labels."""
    standing = Counter(student.status for student in page.students)
    found = spread.final or spread.raw
    scores = [("mean", _percent(found[0])), ("median", _percent(found[1]))] if found else []
    full = [("full score", str(spread.bins[-1].final))] if found else []
    return [*scores, *full, *((status, str(count)) for status, count in standing.most_common())]


def _points(value: Fraction | None) -> str:
    return "" if value is None else wording.points(value)


def _percent(value: float) -> str:
    return f"{value:.1f} %"


def _segments(outcomes: dict[str, int]) -> list[tuple[str, int, int]]:
    """Return outcome, start and length of each part of a bar, without empty parts."""
    parts, start = [], 0
    for outcome in Outcome:
        count = outcomes[outcome.value]
        if count:
            parts.append((outcome.value, start, count))
        start += count
    return parts
