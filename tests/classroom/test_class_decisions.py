"""Late days, other scores and what to ignore: shown beside the raw score, which they never hide."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from class_samples import course, grade, hand_in
from hypothesis import given
from hypothesis import strategies as st

from grader.classroom.adjustments import Adjustments, Amount, Decision, adjust, read_adjustments
from grader.core.errors import ClassError

RULES = """late:
  per_day: 10 %
  at_most: 50 %
students:
  ada: {days_late: 2}
  bob: {score: 9, reason: the machine was down}
  cleo: {ignore: handed in twice}
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "adjust.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_decisions_stand_beside_the_raw_score(tmp_path: Path) -> None:
    """The gradebook has both, and the reason."""
    hand_in(tmp_path / "in", ada=10, bob=4, cleo=7, dan=8)
    path = written(tmp_path, RULES)
    graded = grade(course(tmp_path / "in", tmp_path / "out", adjustments=path))
    found = {row.name: (row.adjusted.raw, row.adjusted.penalty, row.adjusted.score) for row in graded.book.rows}
    assert found == {"ada": (10, 2, 8), "bob": (4, 0, 9), "cleo": (7, 0, None), "dan": (8, 0, 8)}
    text = (tmp_path / "out" / "gradebook.csv").read_text(encoding="utf-8")
    assert "bob,bob,,,,graded,9,10,4,,,9,the machine was down,," in text
    assert "ada,ada,,,,graded,8,10,10,2,2,," in text


def test_what_is_decided_later_grades_nobody_again(tmp_path: Path) -> None:
    """It is no part of a result's key."""
    hand_in(tmp_path / "in", ada=10)
    grade(course(tmp_path / "in", tmp_path / "out"))
    path = written(tmp_path, "late: {per_day: 3 points}\nstudents:\n  ada: {days_late: 1}\n")
    graded = grade(course(tmp_path / "in", tmp_path / "out", adjustments=path))
    assert (graded.graded, graded.book.rows[0].adjusted.score) == (0, 7)


def test_who_handed_in_nothing_may_have_a_score(tmp_path: Path) -> None:
    """By mail, for example."""
    hand_in(tmp_path / "in", ada=10)
    (tmp_path / "roster.csv").write_text("username,name\nada,Ada\neve,Eve\n", encoding="utf-8")
    path = written(tmp_path, "students:\n  eve: {score: 6, reason: by mail}\n")
    graded = grade(course(tmp_path / "in", tmp_path / "out", adjustments=path, roster=tmp_path / "roster.csv"))
    assert [(row.shown_name, row.adjusted.score) for row in graded.book.rows] == [("Ada", 10), ("Eve", 6)]


@pytest.mark.parametrize(
    ("raw", "days", "score"),
    [(80, "0", 80), (80, "0.1", 72), (80, "1", 72), (80, "1.5", 64), (80, "5", 40), (80, "30", 40), (0, "3", 0)],
)
def test_each_begun_day_counts_up_to_the_most(raw: int, days: str, score: int) -> None:
    """Ten percent a day of what was earned, at most half of it."""
    rules = Adjustments(Amount(Fraction(10), percent=True), Amount(Fraction(50), percent=True))
    assert adjust(Fraction(raw), Decision(days_late=Fraction(days)), rules).score == score


def test_a_score_that_was_set_is_not_reduced() -> None:
    """The instructor's word is final, and the penalty is still shown."""
    rules = Adjustments(Amount(Fraction(5), percent=False))
    found = adjust(Fraction(20), Decision(days_late=Fraction(1), score=Fraction(15), reason="x"), rules)
    assert (found.score, found.raw, found.penalty) == (15, 20, 5)


@given(raw=st.fractions(0, 100), days=st.fractions(0, 100), per_day=st.fractions(0, 50), percent=st.booleans())
def test_a_penalty_stays_between_nothing_and_all(
    raw: Fraction, days: Fraction, per_day: Fraction, percent: bool
) -> None:
    """And a later submission never has more."""
    rules = Adjustments(Amount(per_day, percent=percent))
    score = adjust(raw, Decision(days_late=days), rules).score
    later = adjust(raw, Decision(days_late=days + 1), rules).score
    assert score is not None
    assert later is not None
    assert 0 <= score <= raw
    assert later <= score


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("studnets: {}", "adjust.yaml:1:1: expected `late` or `students`, found `studnets`"),
        ("late: {per_day: ten}", "adjust.yaml:1:17: expected `10 %` or `5 points`, found `ten`"),
        ("late: {at_most: 5 %}", "adjust.yaml:1:7: expected the key `per_day`"),
        ("students:\n  ada: {score: 5}", "adjust.yaml:2:3: expected a `reason` for the `score`, found none"),
        ("students:\n  ada: {score: .nan, reason: x}", "adjust.yaml:2:16: "),
        ("students:\n  ada: {days_late: -1}", "adjust.yaml:2:20: "),
        ("students:\n  ada: {days_late: 1}\n  ada: {days_late: 2}", "adjust.yaml:3:3: expected each key once"),
        ("students: [", "adjust.yaml:1:12: not valid YAML"),
    ],
)
def test_a_mistake_is_told_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    """Line and column, what was expected, what was found."""
    with pytest.raises(ClassError) as error:
        read_adjustments(written(tmp_path, text))
    assert message in error.value.message


def test_an_empty_file_decides_nothing(tmp_path: Path) -> None:
    """A file with remarks only is a beginning."""
    assert read_adjustments(written(tmp_path, "# nothing yet\n")) == Adjustments()
