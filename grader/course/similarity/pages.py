"""Renders the pages and the CSV table of similar submissions; the templates escape everything."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from functools import cache

from jinja2 import Template
from markupsafe import Markup

from grader.course.class_page.render import REPORT_PAGE, result_link
from grader.course.similarity.library import Handed, Side, Similar
from grader.grading.reporting.escape import csv_cell, shown
from grader.grading.reporting.html.assets import bundle, page_environment
from grader.runtime.model.dataclass import dataclass

#: Most pairs with a page; further pairs appear only in the table.
MOST_PAGES = 200
#: A file with more lines than the first number is shown only around its similar lines; no page shows more lines of a
#: file than the second number.
WHOLE, MOST_LINES = 400, 1_500
_AROUND = 3
#: A longer line is data, and is cut.
_LINE_LIMIT = 400
OVERVIEW = "index.html"
COLUMNS = (
    *("kind", "page", "submission", "name", "file", "share"),
    *("other_submission", "other_name", "other_file", "other_share", "characters"),
)


@dataclass(frozen=True, slots=True)
class ShownLine:
    """A line as a page shows it; number 0 marks a gap of omitted lines."""

    number: int
    text: str
    alike: bool = False


def render_overview(similar: Similar) -> str:
    """Render the page that lists all pairs, identical files, and recordings of the same messages."""
    return _template("overview.html").render(
        similar=similar,
        pages=[page_name(rank) for rank in range(min(MOST_PAGES, len(similar.pairs)))],
        most=MOST_PAGES,
        passed_over=[(one, sentence) for one in similar.handed for sentence in one.passed_over],
    )


def render_pair(similar: Similar, rank: int) -> str:
    """Render the page that shows a pair side by side; `rank` is its index in the list, starting at 0."""
    last = min(MOST_PAGES, len(similar.pairs)) - 1
    return _template("pair.html").render(
        pair=similar.pairs[rank],
        rank=rank,
        count=len(similar.pairs),
        before=page_name(rank - 1) if rank else "",
        after=page_name(rank + 1) if rank < last else "",
        overview=OVERVIEW,
    )


def page_name(rank: int) -> str:
    """Return the file name of a pair's page."""
    return f"pair-{rank + 1:03}.html"


def render_table(similar: Similar) -> str:
    """Render all findings as CSV, with one row for each pair of files."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for rank, pair in enumerate(similar.pairs):
        page = f"similarity/{page_name(rank)}" if rank < MOST_PAGES else ""
        for one in pair.likenesses:
            left = _cells(pair.left, one.left.program.name, one.left.share)
            right = _cells(pair.right, one.right.program.name, one.right.share)
            writer.writerow(["similar", page, *left, *right, str(one.overlap)])
    for same in similar.same:
        first = same.holders[0]
        for other in same.holders[1:]:
            sides = (*_cells(first, same.file, 1.0), *_cells(other, same.file, 1.0))
            writer.writerow(["identical", "", *sides, ""])
    for recorded in similar.messages:
        topics = " ".join(recorded.topics)
        (first, its), *others = recorded.holders
        for other, theirs in others:
            cells = (*_cells(first, f"{its}: {topics}", 1.0), *_cells(other, f"{theirs}: {topics}", 1.0))
            writer.writerow(["same messages", "", *cells, ""])
    return text.getvalue()


def _cells(handed: Handed, file: str, share: float) -> tuple[str, str, str, str]:
    return csv_cell(handed.name), csv_cell(handed.label), csv_cell(file), f"{share:.2f}"


def marked_lines(side: Side) -> Sequence[ShownLine]:
    """Return the lines of a file with the similar ones marked; of a long file, only the lines near those."""
    texts = side.program.text.expandtabs(4).rstrip("\n").split("\n")
    alike = frozenset(side.alike)
    wanted = set(range(1, len(texts) + 1))
    if len(texts) > WHOLE:
        wanted &= {near for number in alike for near in range(number - _AROUND, number + _AROUND + 1)}
    made: list[ShownLine] = []
    before = 0
    for number in sorted(wanted)[:MOST_LINES]:
        if number != before + 1:
            made.append(_gap(number - before - 1))
        made.append(ShownLine(number, shown(texts[number - 1], limit=_LINE_LIMIT), number in alike))
        before = number
    return [*made, _gap(len(texts) - before)] if before < len(texts) else made


def _gap(count: int) -> ShownLine:
    return ShownLine(0, f"{count} lines not shown")


@cache
def _template(name: str) -> Template:
    templates = page_environment("grader.course.similarity")
    templates.filters |= {"percent": _percent}
    templates.globals |= {
        "style": Markup(bundle().style),  # noqa: S704  part of this package
        "lines_of": marked_lines,
        "report_of": report_of,
    }
    return templates.get_template(name)


def report_of(handed: Handed) -> str:
    """Return the link from a page to a submission's report; empty if it has no report."""
    link = result_link(handed.name, REPORT_PAGE) if handed.reported else ""
    return f"../{link}" if link else ""


def _percent(share: float) -> str:
    # Rounded down, so that only complete copies show 100 %.
    return f"{int(100 * share)} %"
