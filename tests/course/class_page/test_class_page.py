"""The page of a class: what it says, read back by a parser; hostile text stays text and no link leads out."""

from __future__ import annotations

import base64
import hashlib
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from html.parser import HTMLParser
from typing import Any
from urllib.parse import unquote

import class_reports
import pytest

from grader.course.class_page.class_links import ClassLinks, with_class_links
from grader.course.class_page.contents import (
    ClassPage,
    Listing,
    PageEntry,
    PageLink,
    RunFacts,
    StudentRow,
    distribution,
    exercise_counts,
)
from grader.course.class_page.render import class_assets, page_link, render_class, result_link
from grader.grading.reporting.html.render import render_html
from grader.grading.reporting.json_report import report_to_json

HOSTILE = (
    "</script><script>alert(1)</script>",
    "<!--<script>",
    '"><img src=x onerror=alert(1)>',
    "' onmouseover='alert(1)",
    "{{ 7 * 7 }}{% raw %}",
    "javascript:alert(1)",
    "a\u202eb\u2028c\nd\x1b[2J\ud800",
    "x" * 10_000,
)
VOID = {"meta", "link", "img", "br", "input"}


class Parsed(HTMLParser):
    """What a parser finds in a page."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: Counter[str] = Counter()
        self.attributes: list[Any] = []
        self.open: list[Any] = []
        self.texts: list[Any] = []
        self.raw: dict[Any, Any] = {}
        self.rows: list[Any] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: Sequence[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th") and self.rows:
            self.rows[-1].append("")
        if tag not in VOID:
            self.open.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        tag, attrs = self.open[-1] if self.open else ("", {})
        if tag == "script":
            self.raw[attrs.get("id", attrs.get("src", "code"))] = data
        else:
            self.texts.append(data)
            if self.rows and any(name in ("td", "th") for name, _ in self.open):
                self.rows[-1][-1] += data

    def links(self) -> list[str]:
        """Return every address that a link leads to."""
        return [value for tag, name, value in self.attributes if (tag, name) == ("a", "href")]


def student(number: int = 1, name: str = "Ada", **changes: Any) -> StudentRow:
    """Return a student with a drawn report."""
    report = report_to_json(class_reports.drawn_report(number, name))
    score, most = Fraction(str(report["score"])), Fraction(str(report["max_score"]))
    given = StudentRow(folder=f"s{number}", name=name, raw=score, max_score=most, final=score, report=report)
    return replace(given, **changes)


def page(*students: StudentRow, **changes: Any) -> ClassPage:
    """Return the page of a class."""
    return replace(ClassPage("homework", RunFacts("took 1:00"), students), **changes)


def parsed(*students: StudentRow, **changes: Any) -> tuple[Parsed, dict[str, Any]]:
    """Return the page as a parser reads it, and the data in it."""
    found = Parsed(render_class(page(*students, **changes)))
    assert found.open == []
    return found, json.loads(found.raw["class"])


def test_everybody_is_in_the_table_with_all_scores() -> None:
    """Raw, what was decided, final, and the points of each exercise; also without a script."""
    late = student(2, "Bob", raw=Fraction(80), final=Fraction(60), adjustments=("2 days late: \u221220 points",))
    found, _ = parsed(student(1), late)
    row = next(cells for cells in found.rows if "Bob" in cells[0])
    assert [cell.strip() for cell in row[1:5]] == ["graded", "80 / 100", "2 days late: \u221220 points", "60"]
    assert len(row) == 9


def test_a_score_that_was_set_does_not_hide_the_raw_one() -> None:
    """Both are in the row, with the reason."""
    found, _ = parsed(
        student(raw=Fraction(10), final=Fraction(80), adjustments=("set to 80: the lab machine was down",))
    )
    row = next(cells for cells in found.rows if "Ada" in cells[0])
    assert row[2].startswith("10")
    assert row[3:5] == ["set to 80: the lab machine was down", "80"]


def test_the_data_is_what_the_table_sorts_by() -> None:
    """A row for a row; one letter for the outcome of each criterion."""
    _, data = parsed(student(1), student(2, "Bob", final=None, report=None, raw=None, max_score=None, folder=""))
    ada, bob = data["students"]
    assert (ada["name"], bob["name"]) == ("Ada", "Bob")
    assert len(ada["outcomes"]) == len(data["criteria"]) == 16
    assert set(bob["outcomes"]) == {"-"}
    assert bob["final"] is None
    assert sum(ada["exercises"]) == ada["raw"]


def test_each_criterion_has_its_counts() -> None:
    """Outcomes of a criterion add up to the submissions that count."""
    students = [student(k, f"s{k}") for k in range(30)]
    found, _ = parsed(*students, student(31, "ignored", counts=False))
    row = next(cells for cells in found.rows if cells and "log_period" in cells[0])
    numbers = [int("".join(filter(str.isdigit, cell))) for cell in row[1:]]
    assert sum(numbers) == 30
    assert numbers[2] == sum(
        c["outcome"] == "not_met"
        for s in students
        for e in (s.report["exercises"] if s.report else ())
        for c in e["criteria"]
        if c["id"] == "log_period"
    )


def test_causes_are_those_of_who_counts() -> None:
    """With an index into the students for each."""
    students = [student(k, f"s{k}") for k in range(60)]
    _, data = parsed(*students)
    _, fewer = parsed(*(replace(s, counts=False) for s in students))
    assert max(map(len, data["causes"])) > 3
    assert fewer["causes"] == []


def test_scores_are_distributed_as_graded_and_in_the_end() -> None:
    """A score at an edge belongs to the part above; more than everything is everything."""
    made = [("a", 0, 0), ("b", 10, 5), ("c", 99, 100), ("d", 100, 120), ("e", 50, None)]
    students = [
        student(1, name, raw=Fraction(raw), final=None if final is None else Fraction(final))
        for name, raw, final in made
    ]
    spread = distribution(students)
    assert [b.raw for b in spread.bins] == [1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1]
    assert [b.final for b in spread.bins] == [2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2]
    assert spread.raw == pytest.approx((51.8, 50, 0, 100))
    assert spread.changed


def test_scores_that_are_not_final_are_no_scores() -> None:
    """What is undecided is not counted as lost."""
    open_ = student(17, final=None)
    assert open_.report is not None
    assert open_.report["final"] is False
    assert sum(b.raw for b in distribution([open_]).bins) == 0


def test_a_class_without_reports_has_a_page() -> None:
    """Also for a class without students."""
    for students in ((), (StudentRow("", "Zoë", status="nothing handed in"),)):
        found, data = parsed(*students)
        assert data["causes"] == []
        assert "There are no scores yet." in "".join(found.texts)
    assert exercise_counts([]) == ()


@pytest.mark.parametrize(("count", "folds"), [(30, 0), (31, 1), (1667, 1)])
def test_a_long_list_is_folded_after_a_screen(count: int, folds: int) -> None:
    """Everybody in it is there, in order."""
    entries = tuple(PageEntry(f"entry {number}", 0) for number in range(count))
    bare = parsed(student(), listings=(Listing("l", "List", "about", ()),))[0]
    found, _ = parsed(student(), listings=(Listing("l", "List", "about", entries),))
    listed = [text for text in map(str.strip, found.texts) if text.removeprefix(": ").startswith("entry ")]
    assert [text.removeprefix(": ") for text in listed] == [entry.text for entry in entries]
    assert found.tags["details"] == bare.tags["details"] + folds
    assert (f"{count - 30} more" in "".join(found.texts)) == bool(folds)


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_text_stays_text(text: str) -> None:
    """Wherever somebody else chose the words: names, remarks, decisions, reasons, titles, lists, links, facts."""
    report = report_to_json(class_reports.drawn_report(3, text))
    for exercise in report["exercises"]:
        exercise["title"] = text
        for criterion in exercise["criteria"]:
            criterion |= {"title": text, "reason": text, "hint": text, "outcome": "not_met", "score": 0}
    plain = parsed(
        student(), listings=(Listing("l", "List", "about", (PageEntry("x", 0),)),), links=(PageLink("t", "p"),)
    )[0]
    bad = student(report=report, name=text, also=(text,), adjustments=(text,), remarks=(text,), folder=f"f{text[:50]}")
    found, data = parsed(
        bad,
        title=text,
        run=RunFacts(text, ((text, text),), (text,)),
        listings=(Listing("l", "List", text, (PageEntry(text, 0, text),)),),
        links=(PageLink(text, f"similarity/{text}", text),),
    )
    assert found.tags["script"] == plain.tags["script"]
    assert {"img", "iframe", "object", "base"} & set(found.tags) == set()
    assert not [name for _, name, _ in found.attributes if name.startswith("on")]
    assert all(
        link.startswith(("#", "students/f", "similarity/", "gradebook.csv", "batch.json")) for link in found.links()
    )
    assert "\u202e" not in "".join(found.texts) + found.raw["class"]
    assert len(data["students"][0]["name"]) <= 100


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_names_stay_text_in_the_links_of_a_page(text: str) -> None:
    """Of the students before and after, and of the one whose page it is; setting the links again replaces them."""
    report = class_reports.drawn_report(3, text)
    one = ClassLinks(
        "../../index.html", 1, 3, ("../a/report.html", text), ("../b/report.html", f"{text}<!--class-links-->")
    )
    plain = render_html(report, assets="../../assets")
    page = with_class_links(plain, one)
    found, before = Parsed(page), Parsed(plain)
    assert found.open == []
    assert found.tags - before.tags == Counter({"a": 3, "span": 5, "bdi": 2, "nav": 1})
    assert not [name for _, name, _ in found.attributes if name.startswith("on")]
    assert with_class_links(with_class_links(page, ClassLinks("x", 1, 1)), one) == page


@pytest.mark.parametrize(
    ("folder", "link"),
    [
        ("ada", "students/ada/report.html"),
        ("a b#c?d%e", "students/a%20b%23c%3Fd%25e/report.html"),
        ("مريم", "students/%D9%85%D8%B1%D9%8A%D9%85/report.html"),
        ("javascript:alert(1)", "students/javascript%3Aalert%281%29/report.html"),
        ("..", ""),
        (".", ""),
        ("", ""),
        ("../x", ""),
        ("a/b", ""),
        ("a\\b", ""),
        ("a\0b", ""),
    ],
)
def test_links_are_encoded_and_stay_in_the_folder(folder: str, link: str) -> None:
    """A name that would lead elsewhere has no link."""
    assert result_link(folder, "report.html") == link
    assert not link or unquote(link) == f"students/{folder}/report.html"


@pytest.mark.parametrize("path", ["/etc/passwd", "../x", "a//b", "", "https://x.example/", "a/../../b"])
def test_other_pages_lie_in_the_folder(path: str) -> None:
    """A page added to the class cannot link out of it."""
    assert page_link(PageLink("t", path)) == ""


def test_other_pages_are_linked_with_a_note() -> None:
    """For instance how many pairs of similar submissions there are."""
    found, _ = parsed(student(), links=(PageLink("Similar submissions", "similarity/index.html", "3 pairs"),))
    assert "similarity/index.html" in found.links()
    assert "Similar submissions (3 pairs)" in "".join(found.texts)


def test_the_page_stands_alone_or_shares_its_scripts() -> None:
    """The policy allows just these scripts, and nothing from a network."""
    alone = Parsed(render_class(page(student())))
    shared = Parsed(render_class(page(student()), assets="assets"))
    policies = [next(v for t, n, v in p.attributes if n == "content" and "default-src" in v) for p in (alone, shared)]
    assert all(policy.startswith("default-src 'none'") for policy in policies)
    files = [v for t, n, v in shared.attributes if (t, n) in (("script", "src"), ("link", "href"))]
    assert {file.removeprefix("assets/") for file in files} == set(class_assets())
    assert not [v for t, n, v in alone.attributes if n == "src"]
    for data in class_assets().values():
        digest = base64.b64encode(hashlib.sha256(data).digest()).decode()
        assert (f"'sha256-{digest}'" in policies[0]) is data.startswith((b"/*", b"//"))


def test_the_table_is_a_table_for_whoever_listens() -> None:
    """Headings with a scope, a caption, an announced order, and a name for each control."""
    found, _ = parsed(student())
    scopes = [v for t, n, v in found.attributes if (t, n) == ("th", "scope")]
    assert scopes.count("col") >= 15
    assert "row" in scopes
    assert found.tags["th"] == len(scopes)
    assert ("th", "aria-sort", "ascending") in found.attributes
    assert found.tags["caption"] == found.tags["table"]
    assert found.tags["label"] == found.tags["select"] + 3


def test_only_the_header_block_differs_between_runs() -> None:
    """The same results give the same page."""
    students = [student(k, f"s{k}") for k in range(20)]
    one, other = (render_class(page(*students, run=RunFacts(line, (("jobs", line),), (line,)))) for line in ("1", "2"))
    cut = [text[: text.index('<div id="run">')] + text[text.index("<nav") :] for text in (one, other)]
    assert one != other
    assert cut[0] == cut[1]
