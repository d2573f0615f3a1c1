"""A class keeps how it was graded: an option that is not given applies again until its line is deleted."""

from __future__ import annotations

import csv
import io
import json
import shutil
from pathlib import Path

import pytest
from class_samples import FakeScheduler, hand_in, without_line
from click.testing import CliRunner, Result

from grader.cli import batch
from grader.cli.main import app
from grader.cli.remembered import KEPT
from grader.course.classroom.last_run import LastRun, dump_last_run, read_last_run
from grader.course.classroom.schedulers import ThisMachine
from grader.grading.rubrics.builtin import builtin_recording
from grader.runtime.model.errors import ClassError

#: Parameters that concern one run only: what it is given, where it runs, how much it says.
OF_ONE_RUN = {
    *("sources", "results", "jobs", "scheduler", "rerun", "as_json", "no_progress"),
    *("similarity", "templates"),  # the page of an earlier comparison stays, and says that it is one
}
DECISIONS = "students:\n  ada: {score: 8, reason: the machine was slow}\n"


class ClassOfTwo(FakeScheduler):
    """The scheduler of this machine, and commands that use it."""

    def call(self, *arguments: str) -> Result:
        """Call `grade batch`."""
        return CliRunner().invoke(app, ["batch", *arguments], prog_name="grade", obj=ThisMachine(self))

    def batch(self, *options: str, code: int = 0) -> Result:
        """Grade the class in the current folder."""
        done = self.call("in", "-o", "out", "--no-progress", *options)
        assert done.exit_code == code, done.output
        return done


@pytest.fixture
def scheduler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ClassOfTwo:
    """Return the scheduler that grades a class of two in the current folder."""
    hand_in(tmp_path / "in", ada=4, bob=10)
    (tmp_path / "adjust.yaml").write_text(DECISIONS, encoding="utf-8")
    (tmp_path / "roster.csv").write_text("username,name\nada,Ada\nbob,Bob\neve,Eve\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return ClassOfTwo()


def marks() -> dict[str, str]:
    """Return name -> score in the gradebook."""
    text = Path("out/gradebook.csv").read_text(encoding="utf-8")
    return {row["name"]: row["score"] for row in csv.DictReader(io.StringIO(text, newline=""))}


FIRST = ("--exercise", "velocity_publisher", "--adjust", "adjust.yaml", "--roster", "roster.csv")


def test_what_is_left_out_applies_again(scheduler: ClassOfTwo, tmp_path: Path) -> None:
    """Nothing changes, nobody is graded again, and one line says so; also from another folder."""
    scheduler.batch(*FIRST)
    before = marks()
    assert before == {"Ada": "8", "Bob": "10", "Eve": ""}
    scheduler.graded.clear()
    again = scheduler.batch()
    assert (marks(), scheduler.graded) == (before, [])
    said = ("--exercise velocity_publisher", "--adjust adjust.yaml", "--roster roster.csv")
    assert again.stderr.splitlines()[0].startswith("note: from out/class.yaml: ")
    assert all(part in again.stderr for part in said)
    assert "    Ada 4 -> 8 (score set, the machine was slow)" in again.stdout
    other = scheduler.call(str(tmp_path / "in"), "-o", str(tmp_path / "out"))
    assert (other.exit_code, marks()) == (0, before)
    assert json.loads(Path("out/batch.json").read_text(encoding="utf-8"))["moved"] == []


def test_a_recording_is_found_again_from_another_folder(
    scheduler: ClassOfTwo, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The path behind the topic is kept whole; one that is gone is asked for."""
    shutil.copytree(builtin_recording(), tmp_path / "drive")
    options = ("--exercise", "odom_subscriber", "--recording", "/odom=drive")
    scheduler.batch(*options)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    command = [str(tmp_path / "in"), "-o", str(tmp_path / "out"), "--no-progress"]
    again = scheduler.call(*command)
    assert again.exit_code == 0, again.output
    assert f"--recording /odom={tmp_path}/drive" in again.stderr
    assert scheduler.graded == ["ada", "bob"], "nobody is graded again by the same recording"
    shutil.rmtree(tmp_path / "drive")
    gone = scheduler.call(*command)
    assert f"--recording: expected {tmp_path}/drive, which the last run used, found nothing there" in gone.output


def test_an_option_is_left_out_by_deleting_its_line(scheduler: ClassOfTwo) -> None:
    """Then it stays left out."""
    scheduler.batch(*FIRST)
    without_line(Path("out"), "adjust")
    without_line(Path("out"), "roster")
    done = scheduler.batch()
    assert marks() == {"ada": "4", "bob": "10"}
    assert "from out/class.yaml: --exercise velocity_publisher;" in done.stderr
    assert scheduler.batch().stderr.splitlines()[0] == done.stderr.splitlines()[0]
    assert marks() == {"ada": "4", "bob": "10"}


def test_an_option_can_be_written_into_the_file(scheduler: ClassOfTwo) -> None:
    """Numbers and lists are as they are typed; a name that is no option, or no kept one, is refused."""
    scheduler.batch("--exercise", "velocity_publisher")
    path = Path("out/class.yaml")
    before = path.read_text(encoding="utf-8")
    path.write_text(f"{before}seed: 7\nstandalone: true\nmoodle: roster.csv\n", encoding="utf-8")
    done = scheduler.batch()
    assert all(part in done.stderr for part in ("--seed 7", "--standalone", "--moodle roster.csv"))
    assert Path("out/moodle.csv").is_file()
    assert "standalone: true\n" in path.read_text(encoding="utf-8")
    for line, message in (
        ("jobs: 3", "out/class.yaml: expected one of adjust, all, canvas"),
        ("roster: true", "out/class.yaml: roster: expected one value"),
        ("roster: [a.csv, b.csv]", "out/class.yaml: roster: expected one value"),
        ("standalone: 3", "out/class.yaml: standalone: expected true"),
        ("rubric: []", "out/class.yaml: rubric: expected values"),
    ):
        path.write_text(f"{before}{line}\n", encoding="utf-8")
        assert message in scheduler.batch(code=2).stderr


def test_a_changed_mark_is_named_whatever_changed_it(scheduler: ClassOfTwo) -> None:
    """Here the file of decisions."""
    scheduler.batch(*FIRST)
    Path("adjust.yaml").write_text(DECISIONS.replace("8", "6"), encoding="utf-8")
    assert "final marks that differ from the last run (1): Ada 8 -> 6" in scheduler.batch().stdout
    assert "final marks that differ" not in scheduler.batch().stdout


def test_an_option_that_is_given_replaces_the_kept_one(scheduler: ClassOfTwo) -> None:
    """For the following runs, too."""
    scheduler.batch(*FIRST)
    scheduler.batch("--exercise", "odom_subscriber")
    assert [e for e, _ in scheduler.tasks["bob"].conditions.rubrics] == ["odom_subscriber"]
    assert "--exercise odom_subscriber," in scheduler.batch().stderr


@pytest.mark.parametrize("file", ["adjust.yaml", "roster.csv"])
def test_a_file_that_is_gone_is_asked_for(file: str, scheduler: ClassOfTwo) -> None:
    """No mark changes until it is given again or left out."""
    scheduler.batch(*FIRST)
    before = Path("out/gradebook.csv").read_bytes()
    Path(file).unlink()
    done = scheduler.batch(code=2)
    option = {"adjust.yaml": "adjust", "roster.csv": "roster"}[file]
    assert f"--{option}: expected {Path(file).resolve()}, which the last run used, found nothing" in done.stderr
    assert f"hint: give it again with --{option}, or delete the line to leave it out" in done.stderr
    assert Path("out/gradebook.csv").read_bytes() == before
    without_line(Path("out"), option)
    scheduler.batch()


def test_the_file_in_the_results_is_asked_for_too(scheduler: ClassOfTwo) -> None:
    """It applies without being named, so it must not stop applying without a word."""
    Path("out").mkdir()
    kept = Path("out/adjust.yaml")
    kept.write_text(DECISIONS, encoding="utf-8")
    scheduler.batch("--exercise", "velocity_publisher")
    assert marks()["ada"] == "8"
    kept.unlink()
    done = scheduler.batch(code=2)
    assert f"--adjust: expected {kept.resolve()}, which the last run used, found nothing there" in done.stderr
    assert marks()["ada"] == "8"
    without_line(Path("out"), "adjust")
    scheduler.batch()
    assert marks()["ada"] == "4"


def test_two_files_of_decisions_are_not_mixed_up(scheduler: ClassOfTwo) -> None:
    """The one that is named counts, and the other one is mentioned."""
    Path("out").mkdir()
    Path("out/adjust.yaml").write_text(DECISIONS.replace("8", "6"), encoding="utf-8")
    done = scheduler.batch(*FIRST)
    assert marks()["Ada"] == "8"
    assert "warning: out/adjust.yaml is not applied, because --adjust names adjust.yaml" in done.stderr


def test_options_that_exclude_each_other_are_not_both_repeated(scheduler: ClassOfTwo) -> None:
    """A seed key replaces a seed, a layout a pattern, and the other way around."""
    Path("k.key").write_text("x" * 44, encoding="utf-8")
    scheduler.batch("--seed", "7", "--pattern", "(?P<name>.+)", "--exercise", "velocity_publisher")
    assert "--seed 7" in scheduler.batch().stderr
    scheduler.batch("--seed-key", "k.key", "--layout", "folders")
    said = scheduler.batch().stderr
    assert ("--seed-key k.key" in said, "--layout folders" in said) == (True, True)
    assert ("--seed 7" in said, "--pattern" in said) == (False, False)


def test_a_mistake_leaves_what_is_remembered(scheduler: ClassOfTwo) -> None:
    """A run that grades nothing is not the last run."""
    scheduler.batch(*FIRST)
    Path("bad.yaml").write_text("students:\n  zoe: {score: 1, reason: x}\n", encoding="utf-8")
    scheduler.batch("--adjust", "bad.yaml", code=2)
    Path("adjust.yaml").write_text("students:\n  zoe: {score: 1, reason: x}\n", encoding="utf-8")
    assert "error: adjust.yaml:2:3: expected a submission or a person of the class" in scheduler.batch(code=2).stderr
    Path("adjust.yaml").write_text(DECISIONS, encoding="utf-8")
    scheduler.batch()
    assert marks()["Ada"] == "8"


def test_exports_follow_the_marks(scheduler: ClassOfTwo) -> None:
    """A file for a platform that was written once is written again, and never holds old marks."""
    scheduler.batch(*FIRST, "--moodle", "roster.csv")
    Path("adjust.yaml").write_text(DECISIONS.replace("8", "6"), encoding="utf-8")
    scheduler.batch()
    assert "ada,6," in Path("out/moodle.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize("text", ["", "[]", "{", "roster: {a: b}\n", "roster: [[a]]\n", "roster:\n", "\udcf3"])
def test_a_damaged_file_is_not_taken_for_an_empty_one(text: str, tmp_path: Path) -> None:
    """Else everything that it held would be dropped."""
    (tmp_path / "class.yaml").write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(ClassError, match=r"class\.yaml: expected the options of this class, one a line, found"):
        read_last_run(tmp_path)


def test_a_file_is_read_as_it_was_written(tmp_path: Path) -> None:
    """Whatever the paths are; and a folder without one keeps nothing."""
    options = {"rubric": ("/a.yaml", "/b: 'c'\n\x80\U0001f600.yaml"), "all": (), "seed": ("07",), "title": ('"#',)}
    last = LastRun(options, ("/in", "/latin-\udcf3"))
    (tmp_path / "class.yaml").write_bytes(dump_last_run(last))
    assert read_last_run(tmp_path) == last
    assert read_last_run(tmp_path / "none") == LastRun()


def test_every_option_is_remembered_or_of_one_run() -> None:
    """A new option has to be put into one of the two lists."""
    exposed = {param.name for param in batch.command.params if param.expose_value}
    assert exposed == set(KEPT) | OF_ONE_RUN
    assert not set(KEPT) & OF_ONE_RUN
