"""The pages and the table of similar submissions: what they show, and that hostile text stays text."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

import pytest
from copies import handed

from grader.course.similarity import pages
from grader.course.similarity.library import (
    ComparedProgram,
    Handed,
    Likeness,
    Pair,
    SameMessages,
    SameText,
    Side,
    Similar,
)
from grader.course.similarity.pages import (
    ShownLine,
    marked_lines,
    render_overview,
    render_pair,
    render_table,
    report_of,
)

EVIL = "<script>document.title='owned'</script>\u202e\x1b[31m=cmd|'/C calc'!A0\" onmouseover=\"alert(1)"


class Elements(HTMLParser):
    """Collects the elements of a page, their attributes, and its text."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: list[tuple[str, str | None]] = []
        self.text = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes += attrs

    def handle_data(self, data: str) -> None:
        self.text += data


def similar(
    name: str = "ada", file: str = "velocity_publisher.py", text: str = "a = 1\nb = 2\n", count: int = 1
) -> Similar:
    """Return what was found in a class: so many pairs of the same two submissions."""
    sides = [Handed(n, n, (ComparedProgram(file, text, n),), (f"{n}: not text",), reported=True) for n in (name, "bob")]
    likeness = Likeness(Side(sides[0].programs[0], 0.999, (1,)), Side(sides[1].programs[0], 0.5, (2,)), 90)
    same = (SameText(file, tuple(sides)),)
    given = ((sides[0], file),)
    found = (Pair(sides[0], sides[1], (likeness,)),) * count
    messages = (SameMessages(("/odom", "/scan"), tuple((side, file) for side in sides)),)
    return Similar(
        sides,
        found,
        same,
        given,
        common_from=4,
        threshold=0.65,
        least_share=0.4,
        given_files=(file,),
        messages=messages,
    )


@pytest.mark.parametrize("render", [render_overview, lambda found: render_pair(found, 0)])
def test_hostile_text_stays_text(render: Callable[..., Any]) -> None:
    """Names, file names and programs: no element, attribute or link comes of them, no sign turns the text around."""
    page = render(similar(EVIL, EVIL, f"{EVIL}\n" * 3))
    read = Elements(page)
    assert not {"script", "img", "iframe", "form", "object"} & read.tags
    assert not [name for name, _ in read.attributes if name.startswith("on")]
    links = [value for name, value in read.attributes if name == "href"]
    assert all(link is not None and link.startswith(("index.html", "pair-", "../")) for link in links)
    assert "<script>document.title='owned'</script>\\u202e" in read.text
    assert "\u202e" not in page
    assert "\x1b" not in page


def test_a_page_runs_nothing_and_asks_for_nothing() -> None:
    """Its policy forbids scripts and whatever lies elsewhere."""
    for page in (render_overview(similar()), render_pair(similar(), 0)):
        assert "default-src 'none'; style-src 'unsafe-inline'" in page
        assert not {"script", "link", "img"} & Elements(page).tags


def test_recordings_of_the_same_messages_are_named_with_their_topics() -> None:
    text = " ".join(Elements(render_overview(similar())).text.split())
    assert "Recordings of the same messages" in text
    assert "/odom, /scan (2): ada" in text
    rows = list(csv.reader(io.StringIO(render_table(similar()))))
    (row,) = [row for row in rows if row[0] == "same messages"]
    assert row[2] == "ada"
    assert row[6] == "bob"
    assert row[4].endswith(": /odom /scan")


def test_the_words_are_neutral() -> None:
    """Nobody is accused, and it is said that no score depends on it."""
    for page in (render_overview(similar()), render_pair(similar(), 0)):
        text = Elements(page).text.casefold()
        assert "no score depends on it" in text
        assert not [word for word in ("cheat", "plagiar", "suspicious", "guilt", "copied") if word in text]


def test_the_marked_lines_are_those_that_are_alike() -> None:
    """Each side has its own."""
    page = render_pair(similar(), 0)
    assert page.count("<mark>") == 2
    assert "<mark>a = 1</mark>" in page
    assert "<mark>b = 2</mark>" in page
    assert "99 %" in page  # what is not all is not shown as all


def test_a_long_file_is_shown_around_what_is_alike() -> None:
    """The rest is counted."""
    text = "".join(f"x{k} = {k}\n" for k in range(1, 1001))
    lines = marked_lines(Side(ComparedProgram("a.py", text, ""), 1.0, (500,)))
    assert lines[0] == ShownLine(0, "496 lines not shown")
    assert [line.number for line in lines if line.alike] == [500]
    assert [line.number for line in lines[1:-1]] == list(range(497, 504))
    assert lines[-1] == ShownLine(0, "497 lines not shown")


def test_no_file_makes_a_huge_page() -> None:
    """However much of it is alike."""
    text = "x\n" * 30_000
    lines = marked_lines(Side(ComparedProgram("a.py", text, ""), 1.0, tuple(range(1, 30_001))))
    assert len(lines) == pages.MOST_LINES + 1
    assert len(marked_lines(Side(ComparedProgram("a.py", "y" * 60_000, ""), 1.0, (1,)))[0].text) < 500


def test_pairs_without_a_page_are_in_the_table() -> None:
    """The overview says how many there are, and leads nowhere else."""
    last = pages.MOST_PAGES
    found = similar(count=last + 1)
    overview = render_overview(found)
    assert "1 more pairs are in similarity.csv" in overview
    assert f"pair-{last:03}" in overview
    assert f"pair-{last + 1:03}" not in overview + render_pair(found, last - 1)
    rows = list(csv.DictReader(io.StringIO(render_table(found))))
    assert [row["page"] for row in rows[last - 1 :]] == [f"similarity/pair-{last:03}.html", "", "", ""]
    assert [row["kind"] for row in rows[last - 1 :]] == ["similar", "similar", "identical", "same messages"]


def test_no_cell_of_the_table_is_a_formula() -> None:
    """Whatever a student or a file is called."""
    rows = list(csv.reader(io.StringIO(render_table(similar("=1+1", "@SUM(A1).py")))))
    assert not [cell for row in rows for cell in row if cell[:1] in "=+-@" and cell]


def test_only_submissions_with_a_report_lead_to_one() -> None:
    """A name leads nowhere but below the folder of the students."""
    assert report_of(handed("ada", "")) == ""
    assert report_of(Handed("ada b", "Ada", (), reported=True)) == "../students/ada%20b/report.html"
    assert report_of(Handed("../..", "Ada", (), reported=True)) == ""
