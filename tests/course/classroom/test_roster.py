"""Whose submission it is: rosters of every platform, and everybody for whom that is not clear."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.course.classroom.intake import HandedInEntry, safe_name
from grader.course.classroom.roster import Person, RosterMatch, late_by, late_days, match, read_roster, read_table
from grader.runtime.model.errors import ClassError

CANVAS = """Student,ID,SIS User ID,SIS Login ID,Section,Homework (12345)
    Points Possible,,,,,100
"Lovelace, Ada",1001,S1,ada,A,
"Ross, Bob",1002,S2,bob,A,
"Student, Test",9999,,x,A,
"""
MOODLE = """Identifier;Full name;Email address;Status;Grade
Participant 657693;Ada Lovelace;ada@x.edu;Submitted;
Participant 657694;Bob Ross;bob@x.edu;Submitted;
"""
CLASSROOM50 = """username,first_name,last_name,email,section,github_id
ada,Ada,Lovelace,ada@x.edu,A,1
bob-ross,Bob,Ross,bob@x.edu,A,2
ross,Rossella,Verdi,rv@x.edu,A,3
"""
GITHUB = '"identifier","github_username","github_id","name"\n"ada@x.edu","ada","1",""\n"bob@x.edu","","",""\n'


def roster(tmp_path: Path, text: str, encoding: str = "utf-8") -> list[Person]:
    (tmp_path / "roster.csv").write_bytes(text.encode(encoding))
    return read_roster(tmp_path / "roster.csv")


def entry(label: str, **identity: str) -> HandedInEntry:
    return HandedInEntry(safe_name(label), label, Path(label), identity)


def who(matching: RosterMatch) -> dict[str, str]:
    return {name: person.name for name, person in matching.people.items()}


@pytest.mark.parametrize(
    ("text", "encoding"),
    [(CANVAS, "utf-8"), (CANVAS, "utf-8-sig"), (MOODLE, "utf-16"), (CLASSROOM50.replace(",", "\t"), "utf-8")],
)
def test_rosters_are_read_as_platforms_write_them(tmp_path: Path, text: str, encoding: str) -> None:
    """Whatever is between the cells and in front of the text; made-up students and rows of points are nobody."""
    people = roster(tmp_path, text, encoding)
    assert [person.name for person in people][:2] == ["Ada Lovelace", "Bob Ross"]
    assert len(people) == (3 if "Verdi" in text else 2)


def test_github_classroom_knows_people_by_what_the_course_calls_them(tmp_path: Path) -> None:
    """Who has not accepted yet has no user name."""
    people = roster(tmp_path, GITHUB)
    assert [(p.name, p.user) for p in people] == [("ada@x.edu", "ada"), ("bob@x.edu", "")]


def test_canvas_entries_go_by_number(tmp_path: Path) -> None:
    """And by the name without spaces where there is no number of Canvas."""
    people = roster(tmp_path, CANVAS)
    found = match([entry("x", name="lovelaceada", id="1001"), entry("y", name="rossbob", id="0")], people)
    assert who(found) == {"x": "Ada Lovelace", "y": "Bob Ross"}


def test_moodle_entries_go_by_participant(tmp_path: Path) -> None:
    """The download has the number alone, the worksheet a word before it."""
    found = match([entry("x", name="Somebody", id="657694")], roster(tmp_path, MOODLE))
    assert who(found) == {"x": "Bob Ross"}
    assert [person.name for person in found.missing] == ["Ada Lovelace"]


def test_clones_go_by_user(tmp_path: Path) -> None:
    """Also where the layout does not know the prefix: the longest user name at the end counts."""
    people = roster(tmp_path, CLASSROOM50)
    found = match([entry("ros-hw-ada", user="ada"), entry("ros-hw-bob-ross")], people)
    assert who(found) == {"ros-hw-ada": "Ada Lovelace", "ros-hw-bob-ross": "Bob Ross"}


@pytest.mark.parametrize("label", ["ada@x.edu", "ADA", "Ada Lovelace", "lovelace ada", "Adá Lovelace"])
def test_folders_go_by_whatever_they_are_called(tmp_path: Path, label: str) -> None:
    """An address, a user name or a name."""
    assert who(match([entry(label)], roster(tmp_path, CLASSROOM50))) == {safe_name(label): "Ada Lovelace"}


def test_nobody_is_chosen_where_several_could_be_meant(tmp_path: Path) -> None:
    """The entry is listed, and nobody counts as missing because of it."""
    people = roster(tmp_path, "name,email\nAda Lovelace,a@x\nAda Lovelace,b@x\nBob,c@x\n")
    found = match([entry("Ada Lovelace"), entry("zoe")], people)
    assert (found.ambiguous, found.unmatched) == (("ada-lovelace",), ("zoe",))
    assert [person.name for person in found.missing] == ["Bob"]


def test_two_submissions_of_one_person_are_listed(tmp_path: Path) -> None:
    """Both are graded; neither is chosen."""
    found = match([entry("ada"), entry("ada@x.edu")], roster(tmp_path, CLASSROOM50))
    assert found.duplicates == (("ada", "ada@x.edu"),)


def test_without_a_roster_everybody_is_who_the_submission_says() -> None:
    """A folder and an archive of one name are of one student."""
    found = match(
        [
            HandedInEntry("ada-1", "ada", Path("ada")),
            HandedInEntry("ada-2", "Ada", Path("ada.zip")),
            entry("b", name="Bo"),
        ],
        None,
    )
    assert found.duplicates == (("ada-1", "ada-2"),)
    assert found.people["b"].name == "Bo"
    assert found.unmatched == ()


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "expected a header and rows"),
        (b"foo,bar\n1,2\n", "roster.csv:1: expected a column name"),
        (b"name\n\xff\xff\xff", "expected UTF-8"),
        (b'name\n"' + b"x" * 200_000 + b'"\n', "expected CSV"),
    ],
)
def test_a_roster_that_cannot_be_used(tmp_path: Path, data: bytes, text: str) -> None:
    """The message says what was expected."""
    (tmp_path / "roster.csv").write_bytes(data)
    with pytest.raises(ClassError) as error:
        read_roster(tmp_path / "roster.csv")
    assert text in error.value.message


@pytest.mark.parametrize("text", ["", ".", "..", "/", "con", "a/b", "\x00", "\u202e", "-rf", "x" * 500, "李雷"])
def test_a_safe_name_is_one_part_of_a_path(text: str) -> None:
    """Whatever it is made from."""
    name = safe_name(text)
    assert name
    assert not set(name) & set("/\\\0\n")
    assert name[0] not in ".-"
    assert len(name.encode()) <= 90
    assert safe_name(text) == name


@pytest.mark.parametrize(
    ("status", "late", "days"),
    [
        ("Submitted for grading - 1 day 3 hours late", "1 day 3 hours", "1.13"),
        ("Submitted for grading - Graded - 2 hours 13 mins late", "2 hours 13 mins", "0.1"),
        ("Submitted for grading - 1 min late", "1 min", "0.01"),
        ("Submitted for grading - 24 hours late - Extension granted until: Friday", "24 hours", "1"),
        ("Submitted for grading - 3 moons late", "3 moons", ""),
        ("Submitted for grading", "", ""),
        ("No submission - Overdue by: 3 days 4 hours", "", ""),
        ("Submitted for grading - 3 days early", "", ""),
        ("late", "", ""),
    ],
)
def test_a_worksheet_of_moodle_says_how_late(tmp_path: Path, status: str, late: str, days: str) -> None:
    """Days are rounded up, because a started day counts in full."""
    text = f"Identifier,Full name,Status\nParticipant 1,Ada,{status}\n"
    assert late_by(roster(tmp_path, text)[0]) == late
    assert late_by(Person("Ada", names=frozenset({"ada"})), read_table(tmp_path / "roster.csv")) == late
    assert late_by(Person("Eve", names=frozenset({"eve"})), read_table(tmp_path / "roster.csv")) == ""
    assert late_days(late) == days


def test_without_a_status_nobody_is_late(tmp_path: Path) -> None:
    """As on other rosters, and without one."""
    assert late_by(roster(tmp_path, CANVAS)[0]) == ""
    assert late_by(Person("Ada")) == late_by(None) == ""
