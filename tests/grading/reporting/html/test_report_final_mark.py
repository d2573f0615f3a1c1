"""The mark that counts in a finished page: in every place that shows points, whatever anybody has written."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
from parsed_page import MARKUP, Page
from report_samples import criterion, exercise, report

from grader.grading.model.exercise import Audience, Location, Outcome
from grader.grading.model.report import Report
from grader.grading.reporting.html.final_mark import (
    CriterionMark,
    FinalMark,
    ScoreShown,
    render_refusal,
    with_final_mark,
)
from grader.grading.reporting.html.render import render_html, score_shown

POINTS = "pump/rate"


def sample(text: str = "10 Hz") -> Report:
    """Return a report of 6 of 16 points whose reason, hint and name are a text."""
    lost = criterion("rate", "Rate", 10, Outcome.NOT_MET, reason=text, hint=text, location=Location("pump.py", 3))
    return replace(report(exercise("pump", "1", "Pump", criterion("on", "On", 6), lost)), name=text)


def mark(text: str, score: int = 14) -> FinalMark:
    """Return a mark of so many of 16 points, whose words are a text."""
    shown = ScoreShown(Fraction(score), Fraction(16), (Outcome.MET, Outcome.NOT_MET), True, Fraction(6), text)
    rate = CriterionMark(Fraction(8), Fraction(10), text, text)
    return FinalMark(text, "", (text,), shown, {"pump": (Fraction(score), Fraction(16))}, {POINTS: rate})


def tags(page: str) -> dict[str, int]:
    """Return how often each tag is in a page."""
    return dict(Page(page).tags)


@pytest.mark.parametrize("text", [*MARKUP, "<!--score--><!--/score-->", r"\1 \g<0>"])
def test_hostile_words_stay_words(text: str) -> None:
    """In a student's report, an instructor's decision and a name; twice is once."""
    once = with_final_mark(render_html(sample(text)), mark(text))
    assert tags(once) == tags(with_final_mark(render_html(sample()), mark("plain")))
    assert with_final_mark(once, mark(text)) == once
    refusal = render_refusal(FinalMark(text, text, (text,)), text, text)
    assert tags(refusal) == tags(render_refusal(FinalMark("a", "a", ("a",)), "a", "a"))


def test_the_mark_is_in_every_place_and_goes_without_a_trace() -> None:
    """A later mark replaces an earlier one; that of the report itself gives its page back."""
    page = render_html(sample())
    marked = with_final_mark(page, mark("why", 14))
    assert marked.count('14 <span class="of">/ 16</span>') == 1
    assert '<span class="decided">decided</span> 8 <span class="of">/ 10</span>' in marked
    assert "<strong>14</strong> of 16 points" in marked
    assert "As graded: 6 of 16 points, 1 of 2 criteria met, 1 not met." in marked
    assert "<strong>6</strong>" not in marked
    assert "<strong>15</strong> of 16 points" in with_final_mark(marked, mark("why", 15))
    shown = score_shown(sample())
    zero = FinalMark(
        "10 Hz",
        "",
        (),
        shown,
        {"pump": (Fraction(6), Fraction(16))},
        {POINTS: CriterionMark(Fraction(0), Fraction(10))},
    )
    back = with_final_mark(marked, zero)
    assert back.replace("\n", "") == page.replace("\n", "")


def test_more_than_everything_fills_the_ring_once() -> None:
    """A bonus above the maximum is 100 percent."""
    shown = ScoreShown(Fraction(18), Fraction(16), (Outcome.MET,))
    assert (shown.percent, shown.full, shown.points) == (100.0, True, "18")
    assert ScoreShown(Fraction(0), Fraction(0), ()).percent == 0.0


def test_a_student_reads_what_to_fix_first() -> None:
    """Before the criteria, with place and hint; staff and whoever has lost nothing do not."""
    text = render_html(replace(sample(), audience=Audience.STUDENT))
    first = text.index("Fix first")
    assert first < text.index("What to do:") < text.index("<h3>Criteria</h3>")
    assert text.index('href="#pump-rate"') > first
    assert "graded " not in text.split("<main")[0].split("<body>")[1]  # the line with the path
    assert "Fix first" not in render_html(sample())
    fine = report(exercise("pump", "1", "Pump", criterion("on", "On", 6)))
    assert "Fix first" not in render_html(replace(fine, audience=Audience.STUDENT))
