"""`grade batch --similarity`: what it adds to the results of a class, and what it leaves as it was."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import copies
import pytest
from class_samples import FakeScheduler, course, grade, hand_in, scores
from click.testing import CliRunner
from recorded_bags import drive, write_bag
from rosbags.rosbag2 import StoragePlugin
from sample_folders import folder_of

from grader.cli.main import app
from grader.course.classroom.outputs import Graded


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """Return a class of three; one took from another and changed all names."""
    text = (folder_of("correct/odom_csv") / "odom_subscriber.py").read_text(encoding="utf-8")
    other = (folder_of("correct/odom_json") / "odom_subscriber.py").read_text(encoding="utf-8")
    folder = hand_in(tmp_path / "in", ada=10, bob=7, cleo=5)
    for name, program in {"ada": text, "bob": copies.renamed(text, 1), "cleo": other}.items():
        (folder / name / "odom_subscriber.py").write_text(program, encoding="utf-8")
    return folder


def compared(source: Path, **changes: Path) -> tuple[Graded, list[str]]:
    """Grade the class and compare it; return the class, and the names of those who were graded."""
    scheduler = FakeScheduler()
    graded = grade(course(source, source.parent / "out", **{"given": (), **changes}), scheduler)
    return graded, scheduler.graded


def test_it_is_added_to_results_that_are_there(source: Path) -> None:
    """Nobody is graded again, no score changes, and the page of the class leads to what was found."""
    before = grade(course(source, source.parent / "out"))
    graded, names = compared(source)
    out = source.parent / "out"
    assert names == []
    assert scores(graded) == scores(before)
    assert graded.remarks == ("similar submissions: 1 pair",)
    assert 'href="similarity/index.html">Similar submissions (1 pair)<' in (out / "index.html").read_text()
    assert "ada" in (out / "similarity" / "pair-001.html").read_text()
    assert (out / "similarity.csv").read_text().count("\n") == 2
    assert "similar submissions: 1 pair" in json.loads((out / "batch.json").read_text())["remarks"]
    assert out / "similarity" / "index.html" in graded.files


def test_a_later_run_without_it_keeps_the_pages(source: Path) -> None:
    """They are said to be of an earlier run."""
    compared(source)
    graded = grade(course(source, source.parent / "out"))
    assert [link.note for link in graded.links] == ["of an earlier run"]


def test_a_run_that_was_stopped_goes_on_and_compares(source: Path) -> None:
    """All are compared in the end, also those of the first part."""
    with pytest.raises(KeyboardInterrupt):
        grade(course(source, source.parent / "out", given=()), FakeScheduler(stop_after=1))
    graded, names = compared(source)
    assert names == ["bob", "cleo"]
    assert graded.remarks == ("similar submissions: 1 pair",)


def test_pages_of_pairs_that_are_none_any_more_go(source: Path) -> None:
    """A submission was handed in anew."""
    compared(source)
    (source / "bob" / "odom_subscriber.py").write_text("x = 1\n")
    graded, _ = compared(source)
    assert graded.remarks == ("similar submissions: 0 pairs",)
    assert [path.name for path in (source.parent / "out" / "similarity").iterdir()] == ["index.html"]


def test_a_submission_that_cannot_be_used_stops_nothing(source: Path) -> None:
    """It is named on the page."""
    (source / "dan.zip").write_bytes(b"PK\3\4 no archive")
    graded, _ = compared(source)
    assert graded.remarks == ("similar submissions: 1 pair",)
    assert "it cannot be read" in (source.parent / "out" / "similarity" / "index.html").read_text()


def test_people_of_the_same_name_are_told_apart(source: Path) -> None:
    """By the names of their submissions; all others are called by their own."""
    roster = source.parent / "roster.csv"
    roster.write_text("name,folder\nAda,ada\nAda,bob\nCleo,cleo\n", encoding="utf-8")
    compared(source, roster=roster)
    page = (source.parent / "out" / "similarity" / "pair-001.html").read_text(encoding="utf-8")
    assert "<title>Pair 1: Ada (ada) and Ada (bob)</title>" in page


def test_without_the_library_nothing_begins(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit code 2 and what to install, before anybody is graded."""
    monkeypatch.setitem(sys.modules, "copydetect", None)
    done = CliRunner().invoke(app, ["batch", str(source), "-o", str(source.parent / "o"), "--similarity"])
    assert done.exit_code == 2
    assert done.stderr.splitlines() == [
        "error: --similarity: expected the package copydetect of the extra 'similarity', found none",
        f"hint: {sys.executable} -m pip install 'copydetect<0.6,>=0.5'",
    ]
    assert not (source.parent / "o").exists()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--template", "x"], "--template needs --similarity"),
        (["--similarity", "--template", "x"], "x: expected a folder with the Python files"),
    ],
)
def test_a_template_that_cannot_be_used_is_told_first(source: Path, options: Sequence[str], said: str) -> None:
    """Before anybody is graded."""
    done = CliRunner().invoke(app, ["batch", str(source), "-o", str(source.parent / "o"), *options])
    assert done.exit_code == 2
    assert said in done.stderr
    assert not (source.parent / "o").exists()


@pytest.mark.sandbox
@pytest.mark.slow
def test_recordings_that_were_recorded_again_are_named(tmp_path: Path) -> None:
    """Bob played Ada's and recorded it, Cleo drove herself; nobody handed in a program."""
    rubric = tmp_path / "square.yaml"
    rubric.write_text(
        "schema: grader/rubric/v1\nexercise: {id: square, number: 1, title: A square}\n"
        "scenarios:\n  - {id: drive, handed_in: {bag: '*'}}\n"
        "criteria:\n  - {id: odometry, title: Odometry, points: 5, scenario: drive, "
        "check: {publishes: {topic: /odom, type: nav_msgs/msg/Odometry}}}\n"
    )
    later = [(t_ns + 3_600_000_000_007, data) for t_ns, data in drive(60, 99_000_000)]
    write_bag(tmp_path / "in" / "ada" / "run", {"/odom": drive(60)})
    write_bag(tmp_path / "in" / "bob" / "mine", {"/odom": later}, plugin=StoragePlugin.SQLITE3)
    write_bag(tmp_path / "in" / "cleo" / "run", {"/odom": drive(60)[::2]})
    out = tmp_path / "out"
    given = ["batch", str(tmp_path / "in"), "-o", str(out), "--rubric", str(rubric), "--jobs", "1", "--similarity"]
    done = CliRunner().invoke(app, given)
    assert done.exit_code == 0, done.output
    assert "0 pairs, 1 recording handed in more than once" in done.output
    (row,) = [line.split(",") for line in (out / "similarity.csv").read_text().splitlines()[1:]]
    assert (row[0], row[2], row[4], row[6], row[8]) == ("same messages", "ada", "run: /odom", "bob", "mine: /odom")
    students = json.loads((out / "batch.json").read_text())["students"]
    assert [each["score"] for each in students] == [5, 5, 5]
