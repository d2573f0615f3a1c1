"""What students get: one mark, the one that counts, in every page, and nothing that is for staff."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from regraded_class import grade, rubric

from grader.cli.main import app
from grader.course.classroom.final_marks import load_mark
from grader.course.classroom.outputs import platforms, render_graded
from grader.course.classroom.uploading.marks import read_marks

ADJUST = """late: {per_day: 10 %}
students:
  bob:
    days_late: 1
    comment: see me
    criteria:
      rate: {score: 8, reason: the lab machine was slow, comment: use <a> timer}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a class whose rate is wrong, and its rubric; rubrics have points and seeds as usual."""
    for name in ("ada", "bob"):
        (tmp_path / "in" / name).mkdir(parents=True)
        (tmp_path / "in" / name / "velocity_publisher.py").write_text(f"# {name}\n", encoding="utf-8")
    rubric(tmp_path)
    (tmp_path / "adjust.yaml").write_text(ADJUST, encoding="utf-8")
    return tmp_path


def rejudged(folder: Path, *options: str) -> Result:
    """Judge the class again, and write pages for students."""
    arguments = ["rejudge", str(folder / "out/students"), "--rubric", str(folder / "rubric.yaml")]
    pages = ["--audience", "student", "-o", f"html={folder / 'back'}"]
    return CliRunner().invoke(app, [*arguments, *pages, *options], prog_name="grade")


def page(path: Path) -> str:
    """Return a page without its scripts and styles."""
    text = path.read_text(encoding="utf-8")
    return re.sub(r"<(script|style)[ >].*?</\1>", "", text, flags=re.DOTALL)


def shows_the_mark(text: str) -> None:
    """The final mark of bob: 20 as graded, 8 by decision, less a tenth for a day."""
    assert "<title>bob: 25.2 of 30 points</title>" in text
    assert "<strong>25.2</strong> of 30 points" in text
    assert "As graded: 20 of 30 points, 4 of 5 criteria met, 1 not met." in text
    assert "<dt>Decision</dt><dd>8 of 10 points instead of 0: the lab machine was slow</dd>" in text
    assert "<dt>Comment</dt><dd>use &lt;a&gt; timer</dd>" in text
    assert "28 points, less 2.8 for 1 day late." in text
    assert "Comment: see me" in text
    assert text.count("28 <span") == 1  # the points of the exercise
    assert "20%" not in text


def test_every_page_shows_the_mark_that_counts(folder: Path) -> None:
    """The pages of the class and those that are handed back later are the same to a student."""
    grade(folder, adjustments=folder / "adjust.yaml")
    for name in ("feedback.html", "report.html"):
        shows_the_mark(page(folder / "out/students/bob" / name))
    done = rejudged(folder)
    assert (done.exit_code, done.stderr) == (1, "")
    shows_the_mark(page(folder / "back/bob.html"))
    assert "<strong>30</strong> of 30 points" in page(folder / "back/ada.html")
    one = folder / "one.html"
    evidence = folder / "out/students/bob/evidence"
    arguments = ["rejudge", str(evidence), "--rubric", str(folder / "rubric.yaml"), "--audience", "student"]
    assert CliRunner().invoke(app, [*arguments, "-o", f"html={one}"], prog_name="grade").exit_code == 1
    shows_the_mark(page(one))


def test_a_student_reads_what_to_fix_first_and_nothing_of_staff(folder: Path) -> None:
    """No path, digest, option, version or command; staff have them in their page."""
    grade(folder, adjustments=folder / "adjust.yaml")
    rejudged(folder)
    staff = page(folder / "out/students/bob/report.html")
    assert "How to reproduce this report" in staff
    for text in (page(folder / "out/students/bob/feedback.html"), page(folder / "back/bob.html")):
        assert text.index("Fix first") < text.index("<h3>Criteria</h3>")
        assert text.index("What to do:") < text.index("<h3>Criteria</h3>")
        assert not [
            word for word in (str(folder), "sha256", "--", "isolation", "rclpy 7", "Fast") if word in visible(text)
        ]
    assert "Fix first" not in staff
    assert "Fix first" not in page(folder / "out/students/ada/feedback.html")  # nothing is to be fixed


def visible(text: str) -> str:
    """Return a page without its comments, whose marks begin with two hyphens, and its head."""
    return re.sub(r"<!--.*?-->", "", text.split("<body>")[1], flags=re.DOTALL)


def test_a_mark_of_other_points_is_in_no_page(folder: Path) -> None:
    """With a rubric that the gradebook was not made with, its mark would be wrong; the page says what was graded."""
    grade(folder, adjustments=folder / "adjust.yaml")
    rubric(folder, ("points: 10", "points: 5"))
    done = rejudged(folder)
    assert "warning: without the mark in the gradebook, which was made from other points: ada; run" in done.stderr
    assert "<strong>25</strong> of 25 points" in page(folder / "back/ada.html")
    (folder / "out/students/ada/mark.json").write_text("{}", encoding="utf-8")
    assert "warning: without the mark in the gradebook, which is not kept: ada; run" in rejudged(folder).stderr


def test_a_withheld_criterion_is_not_revealed_by_the_mark(folder: Path) -> None:
    """The page counts what it shows, and says so; an export that counts the rest is warned of."""
    rubric(folder, ("  - id: rate\n", "  - id: rate\n    feedback: nothing\n"))
    users = folder / "users.csv"
    users.write_text("username\nada\nbob\n", encoding="utf-8")
    wanted = platforms("", None, users, gradescope=False)
    graded, _, _ = grade(folder, adjustments=folder / "adjust.yaml", platforms=wanted, roster=users)
    text = page(folder / "out/students/bob/feedback.html")
    assert "<strong>20</strong> of 20 points" in text
    assert "The mark in the gradebook also counts criteria that are not shown here." in text
    assert not [word for word in ("25.2", "the lab machine", "28", "late") if word in text]
    assert "Comment: see me" in text
    assert (
        "note: the exported grades include a criterion that the rubric hides from students (velocity_publisher/rate)"
        in (render_graded(graded))
    )
    assert read_marks(folder / "out").withheld == ("velocity_publisher/rate",)
    rubric(folder)
    graded, _, _ = grade(folder, adjustments=folder / "adjust.yaml", platforms=wanted, roster=users)
    assert "hides from students" not in render_graded(graded)
    assert read_marks(folder / "out").withheld == ()


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"student": "a", "adjusted": {"score": "1/0"}}', '{"schema": "x"}'])
def test_a_damaged_mark_is_none(text: str) -> None:
    """Whatever its JSON is."""
    assert load_mark(text.encode()) is None


def test_a_mark_is_kept_exactly(folder: Path) -> None:
    """A third stays a third."""
    (folder / "adjust.yaml").write_text("late: {per_day: 33.3 %}\nstudents:\n  bob: {days_late: 1}\n", encoding="utf-8")
    graded, _, _ = grade(folder, adjustments=folder / "adjust.yaml")
    kept = load_mark((folder / "out/students/bob/mark.json").read_bytes())
    assert kept is not None
    assert kept.adjusted == next(row.adjusted for row in graded.book.rows if row.name == "bob")
    assert json.loads((folder / "out/students/bob/mark.json").read_bytes())["adjusted"]["penalty"] == "333/50"
