"""Late days, other scores and what to ignore: shown beside the raw score, which they never hide."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import pytest
from class_samples import FakeScheduler, course, grade, hand_in, report
from hypothesis import given
from hypothesis import strategies as st

from grader.classroom.adjustments import Adjustments, Amount, Decision, adjust, read_adjustments
from grader.classroom.outputs import platforms
from grader.classroom.platforms import feedback
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
        (
            "students:\n  ada:\n    criteria:\n      rate: {score: 5}",
            "adjust.yaml:4:7: expected a `reason` for the `score`, found none",
        ),
        ("students:\n  ada: {criteria: {rate: {points: 5}}}", "adjust.yaml:2:27: expected `score`, `reason` or"),
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


CRITERIA = """students:
  ada:
    days_late: 1
    comment: see <my> note
    criteria:
      rate: {score: 6, reason: the lab machine was slow, comment: next time as a timer}
      velocity_publisher/logging: {comment: fine}
late: {per_day: 10 %}
"""


def report_without_rate(folder: Path) -> None:
    """Write the report and page of a submission without points for its rate, as grading does."""
    values = report(4, reason="10 Hz")
    values["exercises"][0]["criteria"][0]["id"] = "logging"
    for name in ("report.json", "feedback.json"):
        (folder / name).write_text(json.dumps(values), encoding="utf-8")
    for name in ("report.html", "feedback.html"):
        (folder / name).write_text("<h1>Report</h1><!--final-mark--><!--/final-mark-->", encoding="utf-8")


def test_a_criterion_is_decided_beside_what_the_grader_found(tmp_path: Path) -> None:
    """In the score, the gradebook, the page and the feedback; without the decision all are as before."""
    hand_in(tmp_path / "in", ada=4)
    grade(course(tmp_path / "in", tmp_path / "out"))
    report_without_rate(tmp_path / "out/students/ada")
    (tmp_path / "out/adjust.yaml").write_text(CRITERIA, encoding="utf-8")  # counts without being named
    row = grade(course(tmp_path / "in", tmp_path / "out")).book.rows[0]
    assert (row.adjusted.raw, row.adjusted.marked, row.adjusted.score) == (4, 10, 9)
    text = (tmp_path / "out/gradebook.csv").read_text(encoding="utf-8")
    assert "velocity_publisher/rate: set to 6, the lab machine was slow; next time as a timer" in text
    assert text.rstrip().endswith(",4,4,6")
    said = feedback(row)
    assert "Publishes at 20 Hz: 6 of 6 points instead of 0: the lab machine was slow. Comment: next time" in said
    page = (tmp_path / "out/students/ada/feedback.html").read_text(encoding="utf-8")
    assert "final mark 9 of 10 points" in page
    assert "10 points, less 1 for 1 day late." in page
    assert "Comment: see &lt;my&gt; note" in page
    (tmp_path / "out/adjust.yaml").unlink()
    grade(course(tmp_path / "in", tmp_path / "out"))
    page = (tmp_path / "out/students/ada/feedback.html").read_text(encoding="utf-8")
    assert "final mark 4 of 10 points" in page
    assert "Comment" not in page


@pytest.mark.parametrize(
    ("decided", "message", "hint"),
    [
        ("rates: {comment: x}", ":3:16: expected a criterion of the rubrics, found `rates`", "did you mean `rate`?"),
        ("rate: {score: 11, reason: x}", ":3:16: expected at most 10 points, found 11", ""),
    ],
)
def test_a_decision_about_no_criterion_is_refused(tmp_path: Path, decided: str, message: str, hint: str) -> None:
    """With its place, before anything is graded."""
    hand_in(tmp_path / "in", ada=4)
    path = written(tmp_path, f"students:\n  ada:\n    criteria: {{{decided}}}\n")
    scheduler = FakeScheduler()
    with pytest.raises(ClassError) as error:
        grade(course(tmp_path / "in", tmp_path / "out", adjustments=path), scheduler)
    assert (message in error.value.message, error.value.hint, scheduler.graded) == (True, hint, [])


def test_an_undecided_criterion_may_be_decided(tmp_path: Path) -> None:
    """Then the score is final."""
    hand_in(tmp_path / "in", ada="undecided 4")
    path = written(tmp_path, "students:\n  ada: {criteria: {rate: {score: 3, reason: seen in class}}}\n")
    row = grade(course(tmp_path / "in", tmp_path / "out", adjustments=path)).book.rows[0]
    assert (row.adjusted.score, row.standing) == (7, "undecided, score set")


def test_who_was_refused_reads_why(tmp_path: Path) -> None:
    """On a page and in Moodle, without a grade; a score that was set is told by the status."""
    (tmp_path / "in").mkdir()
    for name in ("ada", "bob"):
        (tmp_path / "in" / f"{name}.zip").write_bytes(b"PK no zip")
    path = written(tmp_path, "students:\n  bob: {score: 0, reason: twice}\n")
    users = tmp_path / "users.csv"
    users.write_text("Username,Name\nada,Ada\nbob,Bob\n", encoding="utf-8")
    wanted = platforms("", None, users, gradescope=False)
    graded = grade(course(tmp_path / "in", tmp_path / "out", adjustments=path, roster=users, platforms=wanted))
    assert {row.name: row.standing for row in graded.book.rows} == {"ada": "refused", "bob": "refused, score set"}
    moodle = (tmp_path / "out/moodle.csv").read_text(encoding="utf-8")
    assert 'ada,,"Not graded: ada.zip: ' in moodle
    assert "Hint: " in moodle
    assert "bob,0," in moodle
    page = (tmp_path / "out/students/ada/feedback.html").read_text(encoding="utf-8")
    assert "ada.zip: " in page
    assert "What to do:" in page
    assert str(tmp_path) not in page
