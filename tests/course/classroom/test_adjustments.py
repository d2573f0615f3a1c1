"""Late days, other scores and what to ignore: shown beside the raw score, which they never hide."""

from __future__ import annotations

import csv
import html
import io
import json
import shutil
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest
from class_samples import FakeScheduler, course, grade, hand_in, report, scores, without_line
from hypothesis import given
from hypothesis import strategies as st
from places import ROOT

from grader.course.classroom.adjustments import Adjustments, Amount, Decision, adjust, read_adjustments
from grader.course.classroom.gradebook import decision_line
from grader.course.classroom.intake import take_in
from grader.course.classroom.outputs import platforms, render_graded
from grader.course.classroom.platforms import feedback
from grader.course.classroom.renaming import with_renamed_files
from grader.grading.app.request import GradeRequest
from grader.runtime.model.errors import ClassError

RUBRICS = ROOT / "rubrics"
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
        ("students:\n  ada: {bonus: 5}", "adjust.yaml:2:3: expected a `reason` for the `bonus`, found none"),
        ("students:\n  ada: {score: 5, bonus: 1, reason: x}", "2:19: expected `score` or `bonus`, found both"),
        ("students:\n  ada: {ignore: twice, score: 1, reason: x}", "2:9: expected `ignore` or a `score`, found both"),
        (
            "students:\n  ada: {score: 1, reason: x, criteria: {rate: {score: 1, reason: y}}}",
            "2:9: expected a `score` for the whole or for criteria, found both (`rate`)",
        ),
        ("students:\n  ada: {rename: {a.py: b.txt}}", "2:24: expected the name of a .py file without a folder"),
        ("students:\n  ada: {rename: {a.py: x/b.py}}", "2:24: expected the name of a .py file without a folder"),
        (
            "students:\n  ada: {rename: {a.py: c.py, b.py: c.py}}",
            "2:24: expected a different name for each file, found `c.py` twice",
        ),
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


#: The places of a page that a mark is put into.
PAGE = "<title>ada</title>" + "".join(
    f"<!--{place}--><!--/{place}-->"
    for place in (
        *("student", "final-mark", "score", "points:velocity_publisher"),
        *(f"{kind}:velocity_publisher/{id_}" for id_ in ("logging", "rate") for kind in ("earned", "decision")),
    )
)


def report_without_rate(folder: Path) -> None:
    """Write the report and page of a submission without points for its rate, as grading does."""
    values = report(4, reason="10 Hz")
    values["exercises"][0]["criteria"][0]["id"] = "logging"
    for name in ("report.json", "feedback.json"):
        (folder / name).write_text(json.dumps(values), encoding="utf-8")
    for name in ("report.html", "feedback.html"):
        (folder / name).write_text(PAGE, encoding="utf-8")


def test_a_criterion_is_decided_beside_what_the_grader_found(tmp_path: Path) -> None:
    """In the score, the gradebook, the page and the feedback; without the decision all are as before."""
    hand_in(tmp_path / "in", ada=4)
    grade(course(tmp_path / "in", tmp_path / "out"))
    report_without_rate(tmp_path / "out/students/ada")
    (tmp_path / "out/adjust.yaml").write_text(CRITERIA, encoding="utf-8")  # counts without being named
    row = grade(course(tmp_path / "in", tmp_path / "out")).book.rows[0]
    assert (row.adjusted.raw, row.adjusted.marked, row.adjusted.score) == (4, 10, 9)
    text = (tmp_path / "out/gradebook.csv").read_text(encoding="utf-8")
    assert "comment on velocity_publisher/rate: next time as a timer" in text
    assert "4 -> 9 (rate, the lab machine was slow; 1 day late, 1 point off)" in text
    assert text.rstrip().endswith(",4,4,6")
    said = feedback(row)
    assert "Publishes at 20 Hz: 6 of 6 points instead of 0: the lab machine was slow. Comment: next time" in said
    page = (tmp_path / "out/students/ada/feedback.html").read_text(encoding="utf-8")
    assert "<title>ada: 9 of 10 points</title>" in page
    assert "<strong>9</strong> of 10 points" in page
    assert "As graded: 4 of 10 points, 1 of 2 criteria met, 1 not met." in page
    assert '<!--points:velocity_publisher-->10 <span class="of">/ 10</span>' in page
    assert '<span class="decided">decided</span> 6 <span class="of">/ 6</span>' in page
    assert "<dt>Decision</dt><dd>6 of 6 points instead of 0: the lab machine was slow</dd>" in page
    assert "<dt>Comment</dt><dd>next time as a timer</dd>" in page
    assert "<dt>Comment</dt><dd>fine</dd>" in page
    assert "10 points, less 1 for 1 day late." in page
    assert "Comment: see &lt;my&gt; note" in page
    (tmp_path / "out/adjust.yaml").unlink()
    with pytest.raises(ClassError, match=r"expected .*adjust\.yaml, which the last run used, found nothing"):
        grade(course(tmp_path / "in", tmp_path / "out"))
    assert (tmp_path / "out/students/ada/feedback.html").read_text(encoding="utf-8") == page
    without_line(tmp_path / "out", "adjust")
    graded = grade(course(tmp_path / "in", tmp_path / "out"))
    assert graded.moved == ("ada 9 -> 4",)
    page = (tmp_path / "out/students/ada/feedback.html").read_text(encoding="utf-8")
    assert "<title>ada: 4 of 10 points</title>" in page
    assert "<strong>4</strong> of 10 points" in page
    assert not {word for word in ("Comment", "decided", "As graded") if word in page}


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


@pytest.mark.parametrize(
    ("written_number", "hint"),
    [
        ("score: +5", "write `bonus: 5` for points on top, or the points that count without a sign"),
        ("score: '+5'", "write `bonus: 5` for points on top, or the points that count without a sign"),
        ("score: +2.5", "write `bonus: 2.5` for points on top, or the points that count without a sign"),
        ("score: + 5", ""),
        ("score: -5", "write the `score` that remains"),
        ("bonus: -5", "write the `score` that remains"),
        ("score: 80 %", "write points instead of a share"),
        ("score: 25 points", "write `score: 25`"),
        ("score: 7,5", "write `score: 7.5`"),
        ("score: 25/30", "write `score: 25`"),
        ("score: 0x10", ""),
        ("score: 0o17", ""),
        ("score: 1_000", ""),
        ("score: 1e1", ""),
        ("score: true", ""),
        ("score: twenty", ""),
        ("score:", ""),
        ("days_late: 2 days", "write `days_late: 2`"),
        ("days_late: +2", "write `days_late: 2`"),
        ("days_late: 27 h", "write days: `days_late: 1.13`"),
        ("days_late: 24 hours", "write days: `days_late: 1`"),
        ("criteria: {rate: {score: +2, reason: x}}", "write `bonus: 2` of the student for points on top"),
    ],
)
def test_a_number_that_can_be_misread_is_refused(tmp_path: Path, written_number: str, hint: str) -> None:
    """However YAML reads it: `+5` is 5 to it. The hint says what to write."""
    path = written(tmp_path, f"students:\n  ada:\n    reason: x\n    {written_number}\n")
    with pytest.raises(ClassError) as error:
        read_adjustments(path)
    assert ":4:" in error.value.message
    assert "expected a number of " in error.value.message
    assert error.value.hint.startswith(hint)
    assert bool(error.value.hint) is bool(hint)


@pytest.mark.parametrize("text", ["10", "10.5", "10 percent", "+10 %", "ten", "-1 %", "10 % a day"])
def test_an_amount_without_a_unit_is_refused(tmp_path: Path, text: str) -> None:
    """With both units as a hint, where there is a number."""
    with pytest.raises(ClassError) as error:
        read_adjustments(written(tmp_path, f"late: {{per_day: {text}}}\n"))
    assert f"1:17: expected `10 %` or `5 points`, found `{text}`" in error.value.message
    first = text.split(maxsplit=1)[0]
    assert error.value.hint == (f"write `{first} %` or `{first} points`" if first[0].isdigit() else "")


def test_a_plain_number_is_read(tmp_path: Path) -> None:
    """With or without decimals, quoted or not; a bonus may have its sign."""
    text = "students:\n  a: {score: 7.5, reason: x}\n  b: {score: '7', reason: x}\n  c: {bonus: +5, reason: x}\n"
    found = read_adjustments(written(tmp_path, text)).students
    assert (found["a"].score, found["b"].score, found["c"].bonus) == (Fraction(15, 2), 7, 5)


def allowing(tmp_path: Path, bonus: str) -> GradeRequest:
    """Return a request with a rubric of 10 points that allows a bonus; empty for none."""
    text = (RUBRICS / "exercise_1" / "rubric.yaml").read_text(encoding="utf-8")
    text = text.replace("  required: true", f"  required: true\n{bonus}")
    assert bonus in text
    (tmp_path / "rubric.yaml").write_text(text, encoding="utf-8")
    return GradeRequest("", rubrics=(tmp_path / "rubric.yaml",))


@pytest.mark.parametrize(
    ("bonus", "score", "found"),
    [
        ("", 31, "at most 30 points, the maximum, found 31"),
        ("  bonus: 2", 33, "at most 32 points, 2 of them as a bonus, found 33"),
    ],
)
def test_a_mark_above_the_maximum_is_refused(tmp_path: Path, bonus: str, score: int, found: str) -> None:
    """Unless the rubric allows it, and then up to what it allows; with the place, before anything is graded."""
    hand_in(tmp_path / "in", ada=4)
    path = written(tmp_path, f"students:\n  ada: {{score: {score}, reason: x}}\n")
    scheduler = FakeScheduler()
    wanted = course(tmp_path / "in", tmp_path / "out", adjustments=path, grading=allowing(tmp_path, bonus))
    with pytest.raises(ClassError) as error:
        grade(wanted, scheduler)
    assert error.value.message.endswith(f"adjust.yaml:2:3: expected {found}")
    assert scheduler.graded == []
    written(tmp_path, f"students:\n  ada: {{score: {score - 1}, reason: x}}\n")
    assert scores(grade(wanted)) == {"ada": score - 1}


@pytest.mark.parametrize(
    ("raw", "bonus", "score", "line"),
    [
        (4, "", 9, "4 -> 9 (bonus 5, for the poster)"),
        (8, "", 10, "8 -> 10 (bonus 5, of which 2 count: the maximum is reached, for the poster)"),
        (8, "  bonus: 1", 11, "8 -> 11 (bonus 5, of which 3 count: the maximum is reached, for the poster)"),
    ],
)
def test_a_bonus_counts_up_to_the_maximum(tmp_path: Path, raw: int, bonus: str, score: int, line: str) -> None:
    """On top of what is left after the late penalty; what does not count is told."""
    hand_in(tmp_path / "in", ada=raw)
    path = written(tmp_path, "students:\n  ada: {bonus: 5, reason: for the poster}\n")
    wanted = course(tmp_path / "in", tmp_path / "out", adjustments=path, grading=allowing(tmp_path, bonus))
    row = grade(wanted).book.rows[0]
    assert (row.adjusted.score, decision_line(row)) == (score, line)


def test_every_decision_is_in_the_terminal_the_gradebook_and_the_page(tmp_path: Path) -> None:
    """As `NAME before -> after (what, reason)`, one line each, also where there was no score."""
    hand_in(tmp_path / "in", ada=10, bob=4, cleo=7, dan=8)
    (tmp_path / "roster.csv").write_text("username\nada\nbob\ncleo\ndan\neve\n", encoding="utf-8")
    path = written(tmp_path, RULES + "  eve: {score: 6, reason: by mail}\n  dan: {comment: good}\n")
    graded = grade(course(tmp_path / "in", tmp_path / "out", adjustments=path, roster=tmp_path / "roster.csv"))
    lines = {
        "ada": "10 -> 8 (2 days late, 2 points off)",
        "bob": "4 -> 9 (score set, the machine was down)",
        "cleo": "7 -> no score (ignored, handed in twice)",
        "dan": "8 -> 8 (comment)",
        "eve": "no score -> 6 (score set, by mail)",
    }
    said = render_graded(graded).splitlines()
    first = said.index("decisions (5):") + 1
    assert said[first : first + 5] == [f"    {name} {line}" for name, line in lines.items()]
    rows = csv.DictReader(io.StringIO((tmp_path / "out/gradebook.csv").read_text(encoding="utf-8"), newline=""))
    assert {row["name"]: row["decisions"] for row in rows} == lines
    page = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    assert all(html.escape(line) in page for line in lines.values())
    assert "scores as graded: mean 72.5 %" in render_graded(graded)
    assert "final marks: mean 83.3 %" in render_graded(graded)


def test_a_renamed_file_is_graded_under_its_new_name(tmp_path: Path) -> None:
    """One line for the commonest complaint; only this student is graded again, also from within an archive."""
    for name in ("ada", "bob"):
        (tmp_path / "in" / name / "deep").mkdir(parents=True)
        (tmp_path / "in" / name / "deep" / "Score.py").write_text("7", encoding="utf-8")
        (tmp_path / "in" / name / "helper.py").write_text("", encoding="utf-8")
    shutil.make_archive(str(tmp_path / "in" / "cleo"), "zip", tmp_path / "in" / "ada")
    path = written(
        tmp_path, "students:\n  ada: {rename: {Score.py: score.py}}\n  cleo: {rename: {deep/Score.py: score.py}}\n"
    )
    graded = grade(course(tmp_path / "in", tmp_path / "out", adjustments=path), FakeScheduler(default="failed"))
    assert {row.name: row.status.value for row in graded.book.rows} == {
        "ada": "graded",
        "bob": "failed",
        "cleo": "graded",
    }
    assert decision_line(graded.book.rows[0]) == "7 -> 7 (Score.py renamed to score.py)"
    assert (tmp_path / "in/ada/deep/Score.py").is_file()  # what was handed in is not changed
    assert (tmp_path / "out/unpacked/renamed/ada/deep/score.py").read_text(encoding="utf-8") == "7"
    again = FakeScheduler(default="failed")
    without_line(tmp_path / "out", "adjust")
    grade(course(tmp_path / "in", tmp_path / "out"), again)
    assert set(again.graded) == {"ada", "bob", "cleo"}


@pytest.mark.parametrize(("wanted", "kept"), [(("score.py",), False), (("score.py", "*.mcap"), True)])
def test_a_wanted_recording_lies_beside_a_renamed_file(tmp_path: Path, wanted: tuple[str, ...], *, kept: bool) -> None:
    """Whatever its size, within what is read of recordings."""
    hand_in(tmp_path / "in", ada=7)
    (tmp_path / "in/ada/run.mcap").write_bytes(bytes(9 << 20))
    entries = take_in([tmp_path / "in"], tmp_path / "out", wanted=wanted).entries
    (entry,) = with_renamed_files(
        entries, {"ada": Decision(rename={"score.py": "other.py"})}, tmp_path / "unpacked", wanted
    )
    assert (entry.path / "other.py").is_file()
    assert (entry.path / "run.mcap").exists() == kept


@pytest.mark.parametrize(
    ("rename", "message", "hint"),
    [
        (
            "{scores.py: b.py}",
            "expected the file `scores.py` to rename, found helper.py and score.py",
            "did you mean `score.py`?",
        ),
        ("{score.py: helper.py}", "expected a new name for `score.py`, found that there is a file `helper.py`", ""),
        (
            "{score.py: velocity_publsher.py}",
            "expected the name of a file that is asked for, found `velocity_publsher.py`",
            "did you mean `velocity_publisher.py`?",
        ),
    ],
)
def test_a_file_that_cannot_be_renamed_is_told(tmp_path: Path, rename: str, message: str, hint: str) -> None:
    """With the place, before anything is graded."""
    hand_in(tmp_path / "in", ada=4)
    (tmp_path / "in/ada/helper.py").write_text("", encoding="utf-8")
    path = written(tmp_path, f"students:\n  ada: {{rename: {rename}}}\n")
    scheduler = FakeScheduler()
    with pytest.raises(ClassError) as error:
        grade(course(tmp_path / "in", tmp_path / "out", adjustments=path), scheduler)
    assert message in error.value.message
    assert "adjust.yaml:2:3: " in error.value.message
    assert (error.value.hint, scheduler.graded) == (hint, [])


def test_two_files_may_swap_their_names(tmp_path: Path) -> None:
    """A new name that is free after all renaming is one."""
    hand_in(tmp_path / "in", ada=4)
    (tmp_path / "in/ada/other.py").write_text("9", encoding="utf-8")
    path = written(tmp_path, "students:\n  ada: {rename: {score.py: other.py, other.py: score.py}}\n")
    assert scores(grade(course(tmp_path / "in", tmp_path / "out", adjustments=path))) == {"ada": 9}


def test_an_id_stays_valid_when_a_second_submission_arrives(tmp_path: Path) -> None:
    """It then means both; a decision about one of them takes precedence."""
    source = tmp_path / "in"
    pattern = r"(?P<name>\w+)_(?P<id>\d+)_.+"
    hand_in(source, Ada_9003_x=4)
    path = written(tmp_path, "students:\n  ada-9003: {score: 9, reason: x}\n")
    wanted = course(source, tmp_path / "out", adjustments=path, pattern=pattern)
    assert scores(grade(wanted)) == {"ada-9003": 9}
    hand_in(tmp_path / "more", Ada_9003_y=5)
    both = replace(wanted, sources=(source, tmp_path / "more"))
    found = scores(grade(both))
    assert len(found) == 2
    assert set(found.values()) == {9}
    first, second = found
    written(tmp_path, f"students:\n  {first}: {{ignore: twice}}\n  ada-9003: {{score: 9, reason: x}}\n")
    assert scores(grade(both)) == {first: None, second: 9}


def test_a_name_that_two_students_have_decides_nothing(tmp_path: Path) -> None:
    """Neither do two decisions about one submission: which one counts would be chance."""
    pattern = r"(?P<name>\w+)_(?P<id>\d+)_.+"
    hand_in(tmp_path / "in", Ada_1_x=4, Ada_2_x=5)
    path = written(tmp_path, "students:\n  Ada: {score: 9, reason: x}\n")
    wanted = course(tmp_path / "in", tmp_path / "out", adjustments=path, pattern=pattern)
    with pytest.raises(ClassError, match="2:3: expected one student, found 2 for `Ada`") as error:
        grade(wanted)
    assert error.value.hint == "name one of the submissions: `ada-1` or `ada-2`"
    written(tmp_path, "students:\n  ada-1: {score: 9, reason: x}\n  '1': {days_late: 1}\n")
    with pytest.raises(ClassError, match="3:3: expected one decision about ada-1, found `1` as well"):
        grade(wanted)


def test_who_is_late_is_told_with_the_line_to_write(tmp_path: Path) -> None:
    """As the worksheet of Moodle says; whose days are given, or who is not late, is not mentioned."""
    hand_in(tmp_path / "in", ada=10, bob=10, cleo=10)
    roster = tmp_path / "roster.csv"
    late = "Submitted for grading - 1 day 3 hours late"
    roster.write_text(f"username,status\nada,{late}\nbob,{late}\ncleo,Submitted for grading\n", encoding="utf-8")
    path = written(tmp_path, "late: {per_day: 10 %}\nstudents:\n  bob: {days_late: 2}\n")
    wanted = course(tmp_path / "in", tmp_path / "out", adjustments=path, roster=roster)
    graded = grade(wanted)
    told = (
        "marked as late by the platform, no days given: ada (1 day 3 hours); in adjust.yaml: `ada: {days_late: 1.13}`"
    )
    assert graded.book.remarks == (told,)
    assert told in render_graded(graded)
    assert scores(graded) == {"ada": 10, "bob": 8, "cleo": 10}
    written(tmp_path, "late: {per_day: 10 %}\nstudents:\n  bob: {days_late: 2}\n  ada: {days_late: 1.13}\n")
    graded = grade(wanted)
    assert (graded.book.remarks, scores(graded)["ada"]) == ((), 8)


@pytest.mark.parametrize(
    ("files", "problem", "hint"),
    [
        (
            ("velocity_publisher.py.txt", "report.pdf"),
            "found report.pdf and velocity_publisher.py.txt",
            "rename velocity_publisher.py.txt so that it ends in .py",
        ),
        (("report.pdf", "onlinetext.html"), "found onlinetext.html and report.pdf", "hand in velocity_publisher.py"),
        (("a.ipynb",), "found a.ipynb", "a.ipynb is a notebook: "),
    ],
)
def test_who_handed_in_no_program_reads_what_was_found_and_what_to_do(
    tmp_path: Path, files: tuple[str, ...], problem: str, hint: str
) -> None:
    """On the page, in the terminal and in the gradebook."""
    (tmp_path / "in" / "ada").mkdir(parents=True)
    for name in files:
        (tmp_path / "in" / "ada" / name).write_text("x", encoding="utf-8")
    graded = grade(course(tmp_path / "in", tmp_path / "out"))
    page = (tmp_path / "out/students/ada/feedback.html").read_text(encoding="utf-8")
    for text in (page, render_graded(graded), (tmp_path / "out/gradebook.csv").read_text(encoding="utf-8")):
        assert f"expected at least one .py file, {problem}" in text
        assert hint in text
