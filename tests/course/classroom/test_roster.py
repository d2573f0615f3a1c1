"""Whose submission it is: rosters of every platform, and everybody for whom that is not clear."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.course.classroom.downloads import CANVAS as CANVAS_LAYOUT
from grader.course.classroom.downloads import FOLDERS
from grader.course.classroom.downloads import GITHUB as GITHUB_LAYOUT
from grader.course.classroom.downloads import MOODLE as MOODLE_LAYOUT
from grader.course.classroom.intake import HandedInEntry, safe_name
from grader.course.classroom.roster import (
    Person,
    RosterMatch,
    late_by,
    late_days,
    match,
    read_roster,
    read_table,
    row_of,
)
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


def entry(label: str, layout: str = FOLDERS, **identity: str) -> HandedInEntry:
    return HandedInEntry(safe_name(label), label, Path(label), identity, layout=layout)


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
    people = roster(tmp_path, CANVAS.replace("1002", ""))
    entries = [
        entry("x", CANVAS_LAYOUT, name="lovelaceada", id="1001"),
        entry("y", CANVAS_LAYOUT, name="rossbob", id="0"),
    ]
    assert who(match(entries, people)) == {"x": "Ada Lovelace", "y": "Bob Ross"}


def test_moodle_entries_go_by_participant(tmp_path: Path) -> None:
    """The download has the number alone, the worksheet a word before it."""
    found = match([entry("x", MOODLE_LAYOUT, name="Somebody", id="657694")], roster(tmp_path, MOODLE))
    assert who(found) == {"x": "Bob Ross"}
    assert [person.name for person in found.missing] == ["Ada Lovelace"]


def test_clones_go_by_user(tmp_path: Path) -> None:
    """Also where the layout does not know the prefix: the longest user name at the end counts."""
    people = roster(tmp_path, CLASSROOM50)
    found = match([entry("ros-hw-ada", GITHUB_LAYOUT, user="ada"), entry("ros-hw-bob-ross")], people)
    assert who(found) == {"ros-hw-ada": "Ada Lovelace", "ros-hw-bob-ross": "Bob Ross"}


GIT = "username,name\nli,Li Wei\neveho,Eve Ho\nho,Ho Chi\n"


@pytest.mark.parametrize(
    ("clones", "people"),
    [
        (("hw-li", "hw-mal-li", "hw-eveho"), {"hw-li": "Li Wei", "hw-eveho": "Eve Ho"}),
        (("hw-mal-li", "hw-eveho", "hw-ho"), {"hw-eveho": "Eve Ho", "hw-ho": "Ho Chi"}),
        (("hw-mal-li", "hw-mal-ho", "hw-eveho", "hw-x"), {"hw-eveho": "Eve Ho"}),
        (("hw-mal-li", "hw-zoe-ho"), {}),
        (("hw-mal-li",), {}),
    ],
)
@pytest.mark.parametrize("layout", [GITHUB_LAYOUT, FOLDERS])
def test_the_end_of_a_user_name_is_not_the_user(
    tmp_path: Path, layout: str, clones: tuple[str, ...], people: dict[str, str]
) -> None:
    """A stranger is on no roster, whoever else handed in, and also where the layout does not know the prefix."""
    entries = [
        entry(name, layout, user=name.removeprefix("hw-")) if layout == GITHUB_LAYOUT else entry(name)
        for name in clones
    ]
    found = match(entries, roster(tmp_path, GIT))
    assert who(found) == people
    assert set(found.unmatched) == {*clones} - {*people}
    assert found.duplicates == found.ambiguous == ()


@pytest.mark.parametrize("column", ["ID number", "Username", "Student ID", "Email address"])
def test_a_number_is_compared_with_numbers_of_its_kind(tmp_path: Path, column: str) -> None:
    """The participant number that Moodle gives one student may be the ID number of another."""
    people = roster(tmp_path, f"Identifier,Full name,{column}\nParticipant 1,Ada,77\nParticipant 77,Bob,5\n")
    found = match(
        [entry("x", MOODLE_LAYOUT, name="Bob", id="77"), entry("y", MOODLE_LAYOUT, name="Eve", id="5")], people
    )
    assert (who(found), found.unmatched) == ({"x": "Bob"}, ("y",))
    people = roster(tmp_path, f"Full name,{column}\nAda,77\nBob,5\n")
    assert who(match([entry("x", MOODLE_LAYOUT, name="Bob", id="77")], people)) == {"x": "Bob"}


def test_the_number_of_an_account_in_canvas_is_no_number_of_the_institution(tmp_path: Path) -> None:
    """Canvas counts its accounts; a table of one's own has one column of numbers, whatever they are."""
    entries = [entry("x", CANVAS_LAYOUT, name="eve", id="77")]
    own = "ID,SIS User ID,Student\n1,77,Ada\n77,2,Bob\n"
    assert who(match(entries, roster(tmp_path, own))) == {"x": "Bob"}
    assert who(match(entries, roster(tmp_path, own.replace("\n77,", "\n78,")))) == {}
    assert who(match(entries, roster(tmp_path, "id,name\n1,Ada\n77,Bob\n"))) == {"x": "Bob"}


def test_a_number_of_a_platform_is_not_that_of_the_institution(tmp_path: Path) -> None:
    """Marks are uploaded by ids of their kind, with a roster of one's own and without one."""
    entries = [entry("x", MOODLE_LAYOUT, name="Bob", id="77"), entry("y", CANVAS_LAYOUT, name="eve", id="78")]
    people = match(entries, None).people
    assert [people[name].platform_ids for name in ("x", "y")] == [{}, {"canvas": "78"}]
    (own,) = roster(tmp_path, "id,name\n77,Bob\n")
    assert own.platform_ids == {"id": "77"}
    (theirs,) = roster(tmp_path, "ID,SIS User ID,Student\n77,s1,Bob\n")
    assert theirs.platform_ids == {"canvas": "77", "id": "s1"}


def test_a_namesake_with_another_number_is_somebody_else(tmp_path: Path) -> None:
    """Where the numbers of roster and download are of one kind, as others of the class show."""
    people = roster(tmp_path, CANVAS)
    ada, namesake = (entry(i, CANVAS_LAYOUT, name=n, id=i) for i, n in (("1001", "lovelaceada"), ("7", "rossbob")))
    assert (who(match([ada, namesake], people)), match([ada, namesake], people).unmatched) == (
        {"1001": "Ada Lovelace"},
        ("7",),
    )
    other_numbers = roster(tmp_path, "id,name\ns1,Ada Lovelace\ns2,Bob Ross\n")
    assert who(match([ada, namesake], other_numbers)) == {"1001": "Ada Lovelace", "7": "Bob Ross"}


def test_a_user_of_github_is_looked_for_among_users_of_github(tmp_path: Path) -> None:
    """Anybody can register a name there that is a user name of the university."""
    people = roster(tmp_path, "username,github_username,name\nada,countess,Ada\nbob,bobross,Bob\neve,,Eve\n")
    entries = [entry(f"hw-{user}", GITHUB_LAYOUT, user=user) for user in ("ada", "countess", "eve")]
    assert who(match(entries, people)) == {"hw-countess": "Ada", "hw-eve": "Eve"}


@pytest.mark.parametrize(
    ("table", "username"),
    [
        ("Username,ID number,Full name\nada,5,Ada\n77,6,Bob\n", "ada"),  # the number of one is the user of another
        ("Username,ID number,Full name\n77,6,Ada\n", None),  # only a namesake is there
        ("Username,Email address\n77,b@x.edu\nx,ADA@x.edu\n", "x"),
        ("Username,Full name\n77,Bob\nx,Ada\n", "x"),
    ],
)
def test_a_person_is_found_in_another_table(tmp_path: Path, table: str, username: str | None) -> None:
    """By what is unique, of its kind; else by the name, unless a number says that it is somebody else."""
    ada = roster(tmp_path, "name,student id,email\nAda,77,ada@x.edu\n")[0]
    if "ada,5" in table:
        ada = roster(tmp_path, "name,student id\nAda,5\n")[0]
    (tmp_path / "users.csv").write_text(table, encoding="utf-8")
    row = row_of(ada, read_table(tmp_path / "users.csv"))
    assert (None if row is None else row["Username"]) == username


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
