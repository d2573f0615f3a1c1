"""The page of a class as `grade batch` writes it: who is where, what no page may name, and that it is always whole."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from class_reports import drawn_report
from class_samples import FakeScheduler, course, grade, hand_in

from grader.course.classroom.class_page import without_folders
from grader.grading.reporting.html.render import render_html

RUN = re.compile(r'<div id="run">.*?</div>\n<nav', re.DOTALL)


def page_of(folder: Path) -> str:
    """Return the text of the page in a folder for results."""
    return (folder / "index.html").read_text(encoding="utf-8")


def data_of(folder: Path) -> dict[str, Any]:
    """Return the data in the page."""
    found = re.search(r'<script type="application/json" id="class">(.*?)</script>', page_of(folder))
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


def standing(folder: Path) -> dict[str, str]:
    """Return name -> status of everybody in the page."""
    return {student["name"]: student["status"] for student in data_of(folder)["students"]}


def test_the_page_lies_beside_the_gradebook(tmp_path: Path) -> None:
    """With the scripts that it shares with the reports; everything it loads is there."""
    hand_in(tmp_path / "in", ada=10, bob=7)
    graded = grade(course(tmp_path / "in", tmp_path / "out"))
    assert graded.files[-1] == tmp_path / "out" / "index.html"
    loaded = re.findall(r'(?:src|href)="(assets/[^"]+)"', page_of(tmp_path / "out"))
    assert len(loaded) == 4
    assert all((tmp_path / "out" / name).is_file() for name in loaded)
    assert standing(tmp_path / "out") == {"ada": "graded", "bob": "graded"}


def test_a_page_that_stands_alone_loads_nothing(tmp_path: Path) -> None:
    """As the reports of `--standalone` do."""
    hand_in(tmp_path / "in", ada=10)
    grade(course(tmp_path / "in", tmp_path / "out", standalone=True))
    assert "assets/" not in page_of(tmp_path / "out")
    assert not (tmp_path / "out" / "assets").exists()


@pytest.mark.parametrize(("given", "title"), [("", "in"), ("  ", "in"), ("Robotics 1 <b>", "Robotics 1 &lt;b&gt;")])
def test_a_page_has_the_title_that_the_instructor_gives(tmp_path: Path, given: str, title: str) -> None:
    """Else the names of the sources, such as that of a download."""
    hand_in(tmp_path / "in", ada=10)
    grade(course(tmp_path / "in", tmp_path / "out", title=given))
    assert f"<h1>{title}</h1>" in page_of(tmp_path / "out")


def test_a_stopped_run_leaves_a_page(tmp_path: Path) -> None:
    """It says so, and who was not graded; the next run says it no more."""
    hand_in(tmp_path / "in", ada=10, bob=7, cleo=5)
    wanted = course(tmp_path / "in", tmp_path / "out")
    with pytest.raises(KeyboardInterrupt):
        grade(wanted, FakeScheduler(stop_after=1))
    assert standing(tmp_path / "out") == {"ada": "graded", "bob": "not run", "cleo": "not run"}
    assert "was stopped before everybody" in page_of(tmp_path / "out")
    grade(wanted)
    assert standing(tmp_path / "out") == dict.fromkeys(("ada", "bob", "cleo"), "graded")
    assert "was stopped before everybody" not in page_of(tmp_path / "out")


def test_the_same_results_give_the_same_page(tmp_path: Path) -> None:
    """But for the block about the run, also when one of the runs was stopped and went on."""
    hand_in(tmp_path / "in", ada=10, bob=7, cleo="undecided 5")
    grade(course(tmp_path / "in", tmp_path / "out"))
    with pytest.raises(KeyboardInterrupt):
        grade(course(tmp_path / "in", tmp_path / "other"), FakeScheduler(stop_after=2))
    grade(course(tmp_path / "in", tmp_path / "other", jobs=7))
    one, other = page_of(tmp_path / "out"), page_of(tmp_path / "other")
    assert one != other
    assert RUN.sub("", one) == RUN.sub("", other)


def test_no_page_names_a_folder_of_this_machine(tmp_path: Path) -> None:
    """Neither in what the run was, nor in why something was refused or failed."""
    hand_in(tmp_path / "in", ada=10, bob="failed", dan=3)
    (tmp_path / "in" / "broken.zip").write_bytes(b"PK\x03\x04 no archive")
    (tmp_path / "in" / "notes.txt").write_text("x", encoding="utf-8")
    grade(course(tmp_path / "in", tmp_path / "out"))
    text = page_of(tmp_path / "out")
    assert standing(tmp_path / "out")["broken"] == "refused"
    assert "notes.txt" in text
    assert str(tmp_path) not in text
    assert str(tmp_path.parent.name) not in text


def test_students_come_by_surname_and_their_pages_are_linked_in_that_order(tmp_path: Path) -> None:
    """Whatever form the roster has; what students get has no links, and a later run with others renews them."""
    hand_in(tmp_path / "in", ada=10, bob=7, cleo=5, dan="failed")
    roster = tmp_path / "roster.csv"
    roster.write_text(
        'user,name\nada,"Young, Ada"\nbob,Bob de Wit\ncleo,"van Dam, Cleo"\ndan,Dan Vos\n', encoding="utf-8"
    )
    grade(course(tmp_path / "in", tmp_path / "out", roster=roster))
    assert list(standing(tmp_path / "out")) == ["Cleo van Dam", "Dan Vos", "Bob de Wit", "Ada Young"]
    students = tmp_path / "out" / "students"
    for name in ("ada", "bob", "cleo"):  # the fake scheduler writes no pages
        for file in ("report.html", "feedback.html"):
            (students / name / file).write_text(render_html(drawn_report(3, name)), encoding="utf-8")
    grade(course(tmp_path / "in", tmp_path / "out", roster=roster))

    def links(name: str) -> list[str]:
        return re.findall(r'href="(\.\./[^"]+)"', (students / name / "report.html").read_text(encoding="utf-8"))

    assert links("cleo") == ["../../index.html", "../bob/report.html"]
    assert links("bob") == ["../../index.html", "../cleo/report.html", "../ada/report.html"]
    assert "index.html" not in (students / "bob" / "feedback.html").read_text(encoding="utf-8")
    roster.write_text("user,name\nada,Ada A\nbob,Bob B\n", encoding="utf-8")
    grade(course(tmp_path / "in", tmp_path / "out", roster=roster))
    assert links("ada") == ["../../index.html", "../bob/report.html"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("/data/x/in/ada: no file", "ada: no file"),
        ("/data/x/in: empty", "in: empty"),
        ("'/somewhere/else/deep/a.py' is missing", "'a.py' is missing"),
        ("/cmd_vel and /turtle1/cmd_vel stay", "/cmd_vel and /turtle1/cmd_vel stay"),
        ("geometry_msgs/msg/Twist stays", "geometry_msgs/msg/Twist stays"),
    ],
)
def test_paths_begin_where_the_class_begins(text: str, said: str) -> None:
    """Names of ROS are none."""
    assert without_folders(text, ("/data/x/in",)) == said


def test_addresses_are_those_of_the_roster(tmp_path: Path) -> None:
    """One that only the name of a file told is not repeated."""
    hand_in(tmp_path / "in", **{"ada - ada@uni.example": 10})
    pattern = "(?P<name>[a-z]+) - (?P<email>.+)"
    grade(course(tmp_path / "in", tmp_path / "out", pattern=pattern))
    text = page_of(tmp_path / "out")
    assert ">ada<" in text
    assert "<bdi>ada@uni.example</bdi>" not in text
    roster = tmp_path / "roster.csv"
    roster.write_text("name,email\nAda Lovelace,ada@uni.example\n", encoding="utf-8")
    grade(course(tmp_path / "in", tmp_path / "out", pattern=pattern, roster=roster))
    assert ">Ada Lovelace<" in page_of(tmp_path / "out")
    assert "<bdi>ada@uni.example</bdi>" in page_of(tmp_path / "out")


def test_what_was_decided_is_beside_the_raw_score(tmp_path: Path) -> None:
    """Penalty, another score with its reason, and what does not count; the distribution shows both."""
    hand_in(tmp_path / "in", ada=10, bob=10, cleo=4, dan=10)
    late = tmp_path / "late.yaml"
    late.write_text(
        "late: {per_day: 20 %}\nstudents:\n  ada: {days_late: 1}\n  bob: {score: 3, reason: copied a picture}\n"
        "  dan: {ignore: handed in twice}\n",
        encoding="utf-8",
    )
    grade(course(tmp_path / "in", tmp_path / "out", adjustments=late))
    students = {student["name"]: student for student in data_of(tmp_path / "out")["students"]}
    assert {name: (s["raw"], s["final"]) for name, s in students.items()} == {
        "ada": (10, 8),
        "bob": (10, 3),
        "cleo": (4, 4),
        "dan": (10, None),
    }
    text = page_of(tmp_path / "out")
    for said in (
        "10 -&gt; 8 (1 day late, 2 points off)",
        "10 -&gt; 3 (score set, copied a picture)",
        "10 -&gt; no score (ignored, handed in twice)",
    ):
        assert said in text
    bins = data_of(tmp_path / "out")["bins"]
    assert [sum(b[3] for b in bins), sum(b[4] for b in bins)] == [3, 3]
    assert (bins[10][3], bins[8][4]) == (2, 1)


def test_who_needs_a_look_is_listed(tmp_path: Path) -> None:
    """Undecided, not graded, not on the roster, twice, without a submission."""
    hand_in(tmp_path / "in", ada=10, bob="failed", cleo="undecided 5", eve=1)
    hand_in(tmp_path / "more", ada=3)
    roster = tmp_path / "roster.csv"
    people = "ada,Ada\nbob,Bob\ncleo,Cleo\nzoe,Zoe\n"
    roster.write_text(f"username,name\n{people}", encoding="utf-8")
    both = replace(
        course(tmp_path / "in", tmp_path / "out", roster=roster), sources=(tmp_path / "in", tmp_path / "more")
    )
    grade(both)
    text = page_of(tmp_path / "out")
    lists = {id_: text.split(f'<section id="{id_}"')[1].split("</section>")[0] for id_ in
             ("undecided", "not-graded", "unmatched", "duplicates", "missing")}  # fmt: skip
    assert "Cleo" in lists["undecided"]
    assert "Bob" in lists["not-graded"]
    assert "failed: the grader ended without a result" in lists["not-graded"]
    assert "eve" in lists["unmatched"]
    assert lists["duplicates"].count(" = ") == 1
    assert "Zoe" in lists["missing"]
