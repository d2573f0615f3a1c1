"""What spreadsheets and platforms are given: read back by the rules of each, with hostile names."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from class_samples import course, grade, hand_in

from grader.course.classroom.outputs import Graded, platforms
from grader.runtime.model.errors import ClassError

ROSTER = """Student,ID,SIS User ID,SIS Login ID,Section,Email address
"Lovelace, Ada",1001,S1,ada,A,ada@x.edu
"=HYPERLINK(1), Bob",1002,S2,bob,A,bob@x.edu
"Ross, Cleo",1003,S3,cleo,A,cleo@x.edu
"""
GRADEBOOK = """Student,ID,SIS User ID,SIS Login ID,Section,Other (7),ROS homework (12345),Final Score
    Points Possible,,,,,5,10,(read only)
"Lovelace, Ada",1001,S1,ada,A,3,,50
"=HYPERLINK(1), Bob",1002,S2,bob,A,4,2,60
"""
MOODLE = "First name,Last name,Email address\nAda,Lovelace,ada@x.edu\nBob,=HYPERLINK(1),bob@x.edu\n"


def rows(path: Path) -> list[list[str]]:
    """Return the rows of a CSV file as a program reads it."""
    return list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"), newline="")))


@pytest.fixture
def class_(tmp_path: Path) -> Callable[..., Any]:
    """Return what grades a class of three for the platforms asked for."""
    hand_in(tmp_path / "in", ada=10, bob=4, cleo="undecided 6", zoe=5)
    for name, text in (("roster", ROSTER), ("gradebook", GRADEBOOK), ("moodle", MOODLE)):
        (tmp_path / f"{name}.csv").write_text(text, encoding="utf-8")

    def run(
        canvas: str = "", *, gradebook: bool = False, moodle: bool = False, gradescope: bool = False, **changes: Path
    ) -> tuple[Graded, Path]:
        files = [tmp_path / "gradebook.csv" if gradebook else None, tmp_path / "moodle.csv" if moodle else None]
        wanted = platforms(canvas, *files, gradescope=gradescope)
        here = course(tmp_path / "in", tmp_path / "out", roster=tmp_path / "roster.csv", platforms=wanted, **changes)
        return grade(here), tmp_path / "out"

    return run


def test_canvas_from_its_own_gradebook(class_: Callable[..., Any]) -> None:
    """Five columns and the one assignment, as Canvas named it; no other score is touched, no blank one written."""
    graded, out = class_("12345", gradebook=True)
    assert rows(out / "canvas.csv") == [
        ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "ROS homework (12345)"],
        ["    Points Possible", "", "", "", "", "10"],
        ["Lovelace, Ada", "1001", "S1", "ada", "A", "10"],
        ["'=HYPERLINK(1), Bob", "1002", "S2", "bob", "A", "4"],
    ]
    assert graded.left_out["canvas"] == (
        "cleo: no score: undecided",
        "zoe: matches nobody on the roster with certainty",
    )


def test_canvas_by_number_alone(class_: Callable[..., Any]) -> None:
    """The roster tells the numbers, the reports the points."""
    _, out = class_("Homework (9)")
    assert [row[-1] for row in rows(out / "canvas.csv")] == ["Homework (9)", "10", "10", "4"]


def test_canvas_with_other_points_is_told(class_: Callable[..., Any], tmp_path: Path) -> None:
    """A score of 10 would be little of 100."""
    graded, _ = class_("7", gradebook=True)
    assert graded.remarks == ("Other (7) has 5 points in Canvas, the reports have 10",)


@pytest.mark.parametrize(
    ("number", "text"), [("99", r"a column that ends in \(99\)"), ("homework", "expected an assignment's number")]
)
def test_an_assignment_that_canvas_does_not_know(class_: Callable[..., Any], number: str, text: str) -> None:
    """A title that matches nothing would make a new assignment."""
    with pytest.raises(ClassError, match=text):
        class_(number, gradebook=True)


def test_moodle_has_grade_and_feedback_side_by_side(class_: Callable[..., Any]) -> None:
    """And nobody whom Moodle does not know: one such user makes it refuse all."""
    graded, out = class_(moodle=True)
    header, *found = rows(out / "moodle.csv")
    assert header == ["Email address", "Grade", "Feedback"]
    assert [row[:2] for row in found] == [["ada@x.edu", "10"], ["bob@x.edu", "4"]]
    assert found[1][2] == "4 of 10 points. [0/6] Publishes at 20 Hz: as expected"
    assert len(graded.left_out["moodle"]) == 2


def test_moodle_tells_only_what_students_may_see(class_: Callable[..., Any]) -> None:
    """Reasons come from what is handed back, never from the instructor's report; without one there is the score."""
    _, out = class_(moodle=True)
    place = out / "students" / "bob" / "feedback.json"
    place.write_text(place.read_text(encoding="utf-8").replace("as expected", "not shown"), encoding="utf-8")
    class_(moodle=True)
    assert rows(out / "moodle.csv")[2][2] == "4 of 10 points. [0/6] Publishes at 20 Hz: not shown"
    place.unlink()
    class_(moodle=True)
    assert rows(out / "moodle.csv")[2][2] == "4 of 10 points."


def test_moodle_unknown_users_are_named_beforehand(class_: Callable[..., Any], tmp_path: Path) -> None:
    """With what they could not be found by."""
    (tmp_path / "moodle.csv").write_text("Email address\nada@x.edu\nother@x.edu\n", encoding="utf-8")
    graded, out = class_(moodle=True)
    assert len(rows(out / "moodle.csv")) == 2
    assert any("Bob" in line and "moodle.csv" in line for line in graded.left_out["moodle"])


def test_moodle_needs_a_column_that_it_knows_people_by(class_: Callable[..., Any], tmp_path: Path) -> None:
    """A name is not enough."""
    (tmp_path / "moodle.csv").write_text("Full name,Grade\nAda Lovelace,\n", encoding="utf-8")
    with pytest.raises(ClassError, match="expected a column Email address, Username or ID number"):
        class_(moodle=True)


def test_gradescope_has_the_score_that_counts_and_the_raw_one(class_: Callable[..., Any], tmp_path: Path) -> None:
    """In the results.json of each submission, and a table of all."""
    (tmp_path / "adjust.yaml").write_text("students:\n  bob: {score: 7, reason: regraded}\n", encoding="utf-8")
    _, out = class_(gradescope=True, adjustments=tmp_path / "adjust.yaml")
    results = json.loads((out / "gradescope" / "bob" / "results.json").read_text(encoding="utf-8"))
    assert (results["score"], results["extra_data"]["raw_score"]) == (7, 4)
    assert results["output"].startswith("The score was set to 7 instead of 4: regraded.")
    assert [row[3] for row in rows(out / "gradescope.csv")] == ["Total Score", "10", "7"]
    assert "raw_score" not in (out / "gradescope" / "ada" / "results.json").read_text(encoding="utf-8")


def test_twins_are_exported_once_one_is_ignored(class_: Callable[..., Any], tmp_path: Path) -> None:
    """Until then nobody decides which one counts."""
    hand_in(tmp_path / "in", **{"ada@x.edu": 5})
    graded, out = class_("12345", gradebook=True)
    assert [row[3] for row in rows(out / "canvas.csv")[2:]] == ["bob"]
    assert sum("say which one to `ignore`" in line for line in graded.left_out["canvas"]) == 2
    (tmp_path / "adjust.yaml").write_text(
        'students:\n  "ada@x.edu": {ignore: the first one counts}\n', encoding="utf-8"
    )
    graded, out = class_("12345", gradebook=True, adjustments=tmp_path / "adjust.yaml")
    assert ["ada", "10"] in [[row[3], row[5]] for row in rows(out / "canvas.csv")]


@pytest.mark.parametrize("file", ["gradebook.csv", "canvas.csv", "moodle.csv", "gradescope.csv"])
def test_no_cell_is_a_formula(class_: Callable[..., Any], tmp_path: Path, file: str) -> None:
    """Whatever people call themselves, and whatever is said about them."""
    (tmp_path / "adjust.yaml").write_text('students:\n  bob: {score: 7, reason: "=1+1"}\n', encoding="utf-8")
    hand_in(tmp_path / "in", **{"@SUM(A1)": 5, "+1": 4})
    _, out = class_("12345", gradebook=True, moodle=True, gradescope=True, adjustments=tmp_path / "adjust.yaml")
    cells = [cell for row in rows(out / file) for cell in row]
    assert not [cell for cell in cells if cell[:1] in ("=", "+", "-", "@", "\t", "\r")]


def test_the_gradebook_has_points_by_exercise_and_criterion(class_: Callable[..., Any]) -> None:
    """What is undecided is left open, never 0."""
    _, out = class_()
    header, *found = rows(out / "gradebook.csv")
    by_name = {row[0]: dict(zip(header, row, strict=True)) for row in found}
    assert by_name["bob"]["velocity_publisher/rate"] == "0"
    assert (by_name["cleo"]["velocity_publisher/rate"], by_name["cleo"]["score"]) == ("", "")
    assert by_name["cleo"]["raw_score"] == "6"
