"""Marks on their way to Canvas and Moodle: shown first, sent once, gone on with, and never lost in silence."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from class_samples import course, grade, hand_in
from click.testing import CliRunner, Result
from platform_stand_ins import ASSIGNMENT, COURSE, TOKEN, Course, serving

pytest.importorskip("canvasapi", reason="pip install -e '.[upload]'")

from urllib3.util.retry import Retry

from grader.cli.main import app

ROSTER = """name,username,email,id number
Ada Lovelace,ada,ada@x.edu,S1
"Ross, Bob",bob,bob@x.edu,S2
Cleo <b>,cleo,cleo@x.edu,
"""
PEOPLE = {
    101: {"name": "A. Lovelace", "email": "ADA@x.edu", "login": "al"},
    102: {"name": "Ross, Bob", "login": "other"},
    103: {"name": "Cleo", "login": "cleo"},
    104: {"name": "Somebody else", "id": "101"},
}
FINAL = {101: 8.0, 102: 7.0, 103: 5.0}


@pytest.fixture(autouse=True)
def no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask again at once."""
    monkeypatch.setattr(Retry, "sleep", lambda *_: None)
    monkeypatch.setenv("CANVAS_TOKEN", TOKEN)
    monkeypatch.setenv("MOODLE_TOKEN", TOKEN)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the results of a class: Ada is a day late, Dan was refused, and Bob has no id in common."""
    folder = tmp_path_factory.mktemp("upload")
    hand_in(folder / "in", ada=10, bob=7, cleo=5)
    (folder / "roster.csv").write_text(ROSTER, encoding="utf-8")
    (folder / "late.yaml").write_text("late: {per_day: 20 %}\nstudents:\n  ada: {days_late: 1}\n", encoding="utf-8")
    grade(course(folder / "in", folder / "out", roster=folder / "roster.csv", adjustments=folder / "late.yaml"))
    return folder / "out"


class Upload:
    """The command for one platform against its stand-in."""

    def __init__(self, platform: str, results: Path, there: Course, url: str) -> None:
        self.platform, self.results, self.there, self.url = platform, results, there, url

    def __call__(self, *more: str, course: int = COURSE, assignment: int = ASSIGNMENT) -> Result:
        numbers = ["--course", str(course), "--assignment", str(assignment)]
        arguments = ["upload", self.platform, str(self.results), "--url", self.url, *numbers, *more]
        result = CliRunner().invoke(app, arguments, prog_name="grade")
        assert TOKEN not in result.output
        return result


@pytest.fixture(params=["canvas", "moodle"])
def upload(request: pytest.FixtureRequest, results: Path) -> Iterator[Upload]:
    """Return the command, with the stand-in running."""
    there = Course({number: dict(person) for number, person in PEOPLE.items()})
    with serving(request.param, there) as url:
        yield Upload(request.param, results, there, url)


def test_nothing_is_sent_unless_asked(upload: Upload) -> None:
    """The default shows each mark, the assignment, and how sure it is of the account."""
    shown = upload()
    assert shown.exit_code == 0
    assert upload.there.writes == []
    assert "to: Robotics: Homework (10 points)" in shown.stdout
    assert "  Ada Lovelace: 8, with feedback\n" in shown.stdout
    assert "  Bob Ross: 7, with feedback, found by name\n" in shown.stdout
    assert "marks: 3 to send, 0 already there" in shown.stdout
    assert "nothing was sent; --send sends 3 marks" in shown.stderr


def test_final_scores_and_feedback_arrive_once(upload: Upload) -> None:
    """After the penalty; a second upload sends nothing, a changed score on the platform is set again."""
    assert upload("--send").exit_code == 0
    assert upload.there.scores == FINAL
    assert [len(upload.there.comments[number]) for number in FINAL] == [1, 1, 1]
    assert upload.there.comments[101][0].startswith("8 of 10 points. 10 points, less 2 for 1 day late.")
    again = upload("--send")
    assert again.exit_code == 0
    assert "marks: 0 to send, 3 already there" in again.stdout
    assert upload.there.writes == [101, 102, 103]
    upload.there.scores[102] = 1.0
    assert "  Bob Ross: 1 -> 7" in upload("--send").stdout
    assert upload.there.scores == FINAL
    assert [len(upload.there.comments[number]) for number in FINAL] == [1, 1, 1]


def test_scores_can_go_without_feedback(upload: Upload) -> None:
    """What a teacher wrote on the platform stays."""
    upload.there.comments[101] = ["well done"]
    assert upload("--send", "--scores-only").exit_code == 0
    assert upload.there.scores == FINAL
    assert upload.there.comments == {101: ["well done"]}


def test_an_upload_that_stops_says_how_far_it_came_and_goes_on(upload: Upload) -> None:
    """Nobody gets a mark or a comment twice."""
    upload.there.stop_after = 2
    stopped = upload("--send")
    assert stopped.exit_code == 2
    assert "2 of 3 marks were sent" in stopped.stderr
    assert "run the same command again to continue" in stopped.stderr
    upload.there.stop_after = None
    assert "marks: 1 to send, 2 already there" in upload("--send").stdout
    assert upload.there.writes == [101, 102, 103]
    assert upload.there.scores == FINAL


def test_a_refused_mark_is_named_and_the_others_arrive(upload: Upload) -> None:
    """With what the platform says, as plain text."""
    upload.there.refuse = frozenset({102})
    result = upload("--send")
    assert result.exit_code == 1
    assert "sent: 2" in result.stdout
    assert "refused: Bob Ross: This grading period is" in result.stdout
    assert set(upload.there.scores) == {101, 103}


def test_a_score_that_the_platform_changes_is_reported(upload: Upload) -> None:
    """Scores are read back after they were sent."""
    upload.there.less = 1.0
    result = upload("--send")
    assert result.exit_code == 1
    assert "not as sent: Ada Lovelace: sent 8, the platform has 7" in result.stdout


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda people: people.pop(103), "Cleo <b>: no student of the course with this email, username or name"),
        (lambda people: people[104].update(login="cleo"), "Cleo <b>: several accounts with this username"),
        (lambda people: people[104].update(name="Bob Ross"), "Bob Ross: several accounts of this name"),
        (lambda people: people[101].update(name="Bob Ross", email="bob@x.edu"), "no student of the course"),
    ],
)
def test_without_an_account_for_everybody_nothing_is_sent(upload: Upload, change, said: str) -> None:  # type: ignore[no-untyped-def]
    """Unless the others are asked for; the exit code tells that somebody was left out."""
    change(upload.there.people)
    assert said in upload().stdout
    refused = upload("--send")
    assert refused.exit_code == 2
    assert "nothing was sent" in refused.stderr
    assert upload.there.writes == []
    others = upload("--send", "--skip-unknown")
    assert others.exit_code == 1
    assert len(upload.there.writes) == 2


def test_a_wrong_token_is_told_before_anything_is_sent(upload: Upload, monkeypatch: pytest.MonkeyPatch) -> None:
    """And so is a missing one, or a file that holds something else."""
    variable = f"{upload.platform.upper()}_TOKEN"
    monkeypatch.setenv(variable, "wrong")
    result = upload("--send")
    assert result.exit_code == 2
    assert "does not accept the access token" in result.stderr
    assert "wrong" not in result.stderr
    monkeypatch.delenv(variable)
    calls = len(upload.there.calls)
    assert f"expected an access token in {variable}" in upload("--send").stderr
    assert len(upload.there.calls) == calls
    assert upload.there.writes == []


def test_the_token_can_come_from_a_file(upload: Upload, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Line break and all; a file of several words is none."""
    monkeypatch.delenv(f"{upload.platform.upper()}_TOKEN")
    (tmp_path / "token").write_text(f"{TOKEN}\n", encoding="utf-8")
    assert upload("--token-file", str(tmp_path / "token")).exit_code == 0
    (tmp_path / "token").write_text("my token\n", encoding="utf-8")
    assert "expected one access token" in upload("--token-file", str(tmp_path / "token")).stderr


@pytest.mark.parametrize(
    ("numbers", "said"),
    [({"course": 8}, "there is no course 8"), ({"assignment": 32}, "there is no assignment 32 in course 7")],
)
def test_a_wrong_course_or_assignment_is_named(upload: Upload, numbers: dict[str, int], said: str) -> None:
    """With the place where the right number stands."""
    result = upload("--send", **numbers)
    assert result.exit_code == 2
    assert said in result.stderr
    assert "address" in result.stderr
    assert upload.there.writes == []


def test_an_assignment_without_points_is_refused(upload: Upload) -> None:
    """Scores of it would mean something else."""
    upload.there.kind = "pass_fail"
    result = upload("--send")
    assert result.exit_code == 2
    assert "expected an assignment that is graded in points" in result.stderr


def test_other_points_than_those_of_the_reports_are_told(upload: Upload) -> None:
    """Moodle would ignore a score above its maximum, so it is refused here."""
    upload.there.points = 6.0
    result = upload("--send")
    assert "note: the reports have 10 points" in result.stdout
    sent = {103: 5.0} if upload.platform == "moodle" else FINAL
    assert upload.there.scores == sent
    assert result.exit_code == (1 if upload.platform == "moodle" else 0)


def test_an_answer_that_is_no_answer_sends_nothing(upload: Upload) -> None:
    """For instance a web page of a proxy, or no server at all."""
    upload.there.page_of_errors = True
    result = upload("--send")
    assert result.exit_code == 2
    assert "no usable answer" in result.stderr
    upload.url = "http://127.0.0.1:9"
    assert "no usable answer" in upload("--send").stderr


@pytest.mark.parametrize("url", ["http://canvas.example.edu", "ftp://x", "canvas.example.edu", "https://a:b@x.example"])
def test_a_token_is_sent_to_no_unsafe_address(upload: Upload, url: str) -> None:
    """Only to https, or to this machine."""
    upload.url = url
    result = upload()
    assert result.exit_code == 2
    assert "--url: expected" in result.stderr
    assert upload.there.calls == []


@pytest.mark.parametrize("text", [None, "{", '{"schema": "x", "students": [{"name": "a"}]}'])
def test_results_that_hold_no_marks_are_refused(upload: Upload, tmp_path: Path, text: str | None) -> None:
    """No file, a broken one, or one of an older version; nothing is made in the folder."""
    upload.results = tmp_path
    if text is not None:
        (tmp_path / "batch.json").write_text(text, encoding="utf-8")
    result = upload("--send")
    assert result.exit_code == 2
    assert "expected the results of a class" in result.stderr
    assert "run `grade batch`" in result.stderr
    assert upload.there.calls == []
    assert not (tmp_path / "students").exists()


def test_who_has_no_score_is_listed_and_gets_none(tmp_path: Path) -> None:
    """Undecided, failed or refused submissions, and two of one person."""
    hand_in(tmp_path / "in", ada=10, bob="undecided 5", cleo="failed")
    (tmp_path / "roster.csv").write_text(ROSTER, encoding="utf-8")
    grade(course(tmp_path / "in", tmp_path / "out", roster=tmp_path / "roster.csv"))
    there = Course({number: dict(person) for number, person in PEOPLE.items()})
    with serving("canvas", there) as url:
        result = Upload("canvas", tmp_path / "out", there, url)("--send")
    assert result.exit_code == 1
    assert "without a mark: bob: no score: undecided" in result.stdout
    assert "without a mark: cleo: no score: failed" in result.stdout
    assert there.scores == {101: 10.0}


def test_hostile_names_do_not_reach_the_terminal(results: Path, tmp_path: Path) -> None:
    """Neither those of the class nor what the platform says."""
    (tmp_path / "students").mkdir()
    data = json.loads((results / "batch.json").read_text(encoding="utf-8"))
    data["students"][0]["person"] = "Ada\x1b[2J\u202e"
    (tmp_path / "batch.json").write_text(json.dumps(data), encoding="utf-8")
    there = Course({101: {"name": "x\x1b[31m", "email": "ada@x.edu"}})
    with serving("moodle", there) as url:
        result = Upload("moodle", tmp_path, there, url)()
    assert "\x1b" not in result.output
    assert "\u202e" not in result.output
