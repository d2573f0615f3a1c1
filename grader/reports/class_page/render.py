"""The page of a class as HTML, rendered from a template that escapes everything it is given."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from functools import cache
from urllib.parse import quote

from jinja2 import Template
from markupsafe import Markup

from grader.model.exercise import Outcome, exercise_name
from grader.reports import wording
from grader.reports.class_page import bundle
from grader.reports.class_page.causes import Cause, causes
from grader.reports.class_page.contents import ClassPage, PageLink, ReportData
from grader.reports.class_page.counts import Distribution, distribution, exercise_counts
from grader.reports.class_page.payload import payload
from grader.reports.escape import script_json
from grader.reports.html.environment import page_environment

#: More causes than this are counted, not shown.
MOST_CAUSES = 40
REPORT_PAGE, REPORT_DATA = "report.html", "report.json"
#: The same as far as students may see it.
HANDED_BACK_PAGE = "feedback.html"


def render_class(page: ClassPage, *, assets: str | None = None) -> str:
    """Return the page of a class, which loads nothing from anywhere else.

    Args:
        page: What is shown; all its text is taken for hostile.
        assets: Where the page finds the files of `class_assets`, relative to itself, e.g. `assets`; None puts them into
            the page.
    """
    counted = [(k, s.report) for k, s in enumerate(page.students) if s.report is not None and s.counts]
    exercises = exercise_counts(report for _, report in counted)
    found = causes(counted)
    spread = distribution(page.students)
    return _template().render(
        page=page,
        exercises=exercises,
        causes=found,
        most_causes=MOST_CAUSES,
        spread=spread,
        tiles=_tiles(page, spread),
        outcomes=wording.OUTCOME_WORDS,
        common=bundle.common(),
        assets=assets,
        data=Markup(script_json(payload(page, exercises, found, spread))),  # noqa: S704  safe in a script element
    )


def result_link(folder: str, file: str, anchor: str = "") -> str:
    """Return the link to a file of a student's results, percent-encoded; empty if it would lead anywhere else.

    Args:
        folder: Name of the folder below `students/`.
        file: Name of the file in it.
        anchor: Id of an element in it.
    """
    path = page_link(PageLink("", f"students/{folder}/{file}")) if "/" not in folder and folder else ""
    return f"{path}#{quote(anchor, safe='', errors='replace')}" if path and anchor else path


def page_link(link: PageLink) -> str:
    """Return the address of another page in the folder for results; empty if it would lead out of it."""
    parts = link.path.split("/")
    wrong = any(part in ("", ".", "..") or "\\" in part or "\0" in part for part in parts)
    return "" if wrong else "/".join(quote(part, safe="", errors="replace") for part in parts)


@cache
def _template() -> Template:
    templates = page_environment("grader.reports.class_page")
    templates.filters |= {"points": _points, "percent": _percent}
    templates.globals |= {
        "embedded": Markup,
        "bundle": bundle,
        "exercise_name": exercise_name,
        "result_link": result_link,
        "page_link": page_link,
        "segments": _segments,
        "exercise_points": exercise_points,
        "report_page": REPORT_PAGE,
        "report_data": REPORT_DATA,
        "handed_back_page": HANDED_BACK_PAGE,
        "cause_anchor": _cause_anchor,
    }
    return templates.get_template("class.html")


def exercise_points(report: ReportData | None, id_: str) -> Fraction | None:
    """Return the points that a report has for an exercise; None if it is not in it."""
    exercises = () if report is None else report["exercises"]
    return next((Fraction(str(e["score"])) for e in exercises if e["id"] == id_), None)


def _tiles(page: ClassPage, spread: Distribution) -> list[tuple[str, str]]:
    """Return the figures that are looked at first, with what they are."""
    standing = Counter(student.status for student in page.students)
    found = spread.final or spread.raw
    scores = [("mean", _percent(found[0])), ("median", _percent(found[1]))] if found else []
    full = [("full score", str(spread.bins[-1].final))] if found else []
    return [*scores, *full, *((status, str(count)) for status, count in standing.most_common())]


def _cause_anchor(cause: Cause) -> str:
    return f"{cause.exercise}-{cause.criterion}"


def _points(value: Fraction | None) -> str:
    return "" if value is None else wording.points(value)


def _percent(value: float) -> str:
    return f"{value:.1f} %"


def _segments(outcomes: dict[str, int]) -> list[tuple[str, int, int]]:
    """Return outcome, where its part of a bar begins and how long it is, without the empty ones."""
    parts, start = [], 0
    for outcome in Outcome:
        count = outcomes[outcome.value]
        if count:
            parts.append((outcome.value, start, count))
        start += count
    return parts
