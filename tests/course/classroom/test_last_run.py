"""A class remembers how it was graded: an option that is left out applies again, or is asked for, never dropped."""

from __future__ import annotations

import csv
import io
import json
import shutil
from pathlib import Path

import click
import pytest
from class_samples import FakeScheduler, hand_in
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
    said = "--exercise velocity_publisher, --adjust adjust.yaml (1 decision), --roster roster.csv"
    assert again.stderr.splitlines()[0].startswith("note: as in the last run: ")
    assert all(part in again.stderr for part in said.split(", "))
    assert "    Ada 4 -> 8 (score set, the machine was slow)" in again.stdout
    other = scheduler.call(str(tmp_path / "in"), "-o", str(tmp_path / "out"))
    assert (other.exit_code, marks()) == (0, before)
    assert json.loads(Path("out/batch.json").read_text(encoding="utf-8"))["moved"] == []


def test_a_recording_is_found_again_from_another_folder(
    scheduler: ClassOfTwo, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The path behind the topic is kept whole; one that is gone is asked for; no option is both given and left out."""
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
    both = [*command, "--no-recording", "--recording", "/odom=b"]
    assert "exclude each other" in scheduler.call(*both).output


def test_an_option_is_left_out_by_name(scheduler: ClassOfTwo) -> None:
    """Then it stays left out, and every mark that changed is named."""
    scheduler.batch(*FIRST)
    done = scheduler.batch("--no-adjust", "--no-roster")
    assert marks() == {"ada": "4", "bob": "10"}
    assert "as in the last run: --exercise velocity_publisher;" in done.stderr
    assert scheduler.batch().stderr.splitlines()[0] == done.stderr.splitlines()[0]
    assert marks() == {"ada": "4", "bob": "10"}


def test_a_changed_mark_is_named_whatever_changed_it(scheduler: ClassOfTwo) -> None:
    """Here the file of decisions."""
    scheduler.batch(*FIRST)
    Path("adjust.yaml").write_text(DECISIONS.replace("8", "6"), encoding="utf-8")
    assert "final marks that differ from the last run (1): Ada 8 -> 6" in scheduler.batch().stdout
    assert "final marks that differ" not in scheduler.batch().stdout


def test_a_changed_option_is_told(scheduler: ClassOfTwo) -> None:
    """With what the last run had."""
    scheduler.batch(*FIRST)
    done = scheduler.batch("--exercise", "odom_subscriber")
    assert "note: --exercise odom_subscriber; the last run had --exercise velocity_publisher" in done.stderr
    assert [e for e, _ in scheduler.tasks["bob"].conditions.rubrics] == ["odom_subscriber"]


@pytest.mark.parametrize("file", ["adjust.yaml", "roster.csv"])
def test_a_file_that_is_gone_is_asked_for(file: str, scheduler: ClassOfTwo) -> None:
    """No mark changes until it is given again or left out."""
    scheduler.batch(*FIRST)
    before = Path("out/gradebook.csv").read_bytes()
    Path(file).unlink()
    done = scheduler.batch(code=2)
    option = {"adjust.yaml": "adjust", "roster.csv": "roster"}[file]
    holds = " (1 decision)" if option == "adjust" else ""
    assert f"--{option}: expected {Path(file).resolve()}{holds}, which the last run used, found nothing" in done.stderr
    assert f"hint: give it again with --{option}, or leave it out with --no-{option}" in done.stderr
    assert Path("out/gradebook.csv").read_bytes() == before
    scheduler.batch(f"--no-{option}")


def test_the_file_in_the_results_is_asked_for_too(scheduler: ClassOfTwo) -> None:
    """It applies without being named, so it must not stop applying without a word; --no-adjust leaves it out."""
    Path("out").mkdir()
    kept = Path("out/adjust.yaml")
    kept.write_text(DECISIONS, encoding="utf-8")
    scheduler.batch("--exercise", "velocity_publisher")
    assert marks()["ada"] == "8"
    scheduler.batch("--no-adjust")
    assert marks()["ada"] == "4"
    scheduler.batch()
    assert marks()["ada"] == "8"
    kept.unlink()
    done = scheduler.batch(code=2)
    assert (
        f"--adjust: expected the 1 decision of {kept.resolve()}, which the last run applied, found none" in done.stderr
    )
    assert marks()["ada"] == "8"


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


def test_an_option_and_its_opposite_are_refused(scheduler: ClassOfTwo) -> None:
    """Which one was meant is not guessed."""
    done = scheduler.batch("--adjust", "adjust.yaml", "--no-adjust", code=2)
    assert "--adjust and --no-adjust exclude each other" in done.stderr


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


@pytest.mark.parametrize("text", ["", "[]", "{", '{"schema": "grader/batch-run/v9", "options": {}}', '{"options": 3}'])
def test_a_damaged_record_is_not_taken_for_an_empty_one(text: str, tmp_path: Path) -> None:
    """Else everything that it held would be dropped."""
    (tmp_path / "run.json").write_text(text, encoding="utf-8")
    with pytest.raises(ClassError, match=r"run\.json: expected the options of the last run, found a damaged file"):
        read_last_run(tmp_path)


def test_a_record_is_read_as_it_was_written(tmp_path: Path) -> None:
    """And a folder without one remembers nothing."""
    last = LastRun({"rubric": ("/a.yaml", "/b.yaml"), "all": ()}, "/adjust.yaml", 3)
    (tmp_path / "run.json").write_bytes(dump_last_run(last))
    assert read_last_run(tmp_path) == last
    assert read_last_run(tmp_path / "none") == LastRun()


def test_every_option_is_remembered_or_of_one_run() -> None:
    """A new option has to be put into one of the two lists; every remembered one can be left out."""
    exposed = {param.name for param in batch.command.params if param.expose_value}
    assert exposed == set(KEPT) | OF_ONE_RUN
    assert not set(KEPT) & OF_ONE_RUN
    names = {name for param in batch.command.params for name in param.opts}
    kept = [param for param in batch.command.params if param.name in KEPT]
    assert all(isinstance(param, click.Option) and f"--no-{param.opts[0][2:]}" in names for param in kept)
