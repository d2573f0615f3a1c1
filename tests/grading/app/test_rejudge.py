"""Judging kept evidence again: the same rubric, the same report; another rubric, and what it changes for whom."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from kept_runs import RUBRICS, kept_run, velocity_exercise, velocity_run, velocity_trace

from grader.cli import main
from grader.grading.app import rejudge
from grader.grading.evidence.store import open_evidence
from grader.grading.judging.judge_run import judge_run
from grader.grading.reporting.json_report import dumps
from grader.grading.rubrics.loader import read_rubric


def grade(*words: str | Path | int) -> Result:
    return CliRunner().invoke(main.app, ["rejudge", *map(str, words)])


def changed_rubric(folder: Path, *changes: tuple[str, str]) -> Path:
    text = (RUBRICS / "exercise_1" / "rubric.yaml").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "changed.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def kept_class(folder: Path) -> Path:
    """A right one, one at half the rate, one without its file."""
    runs = {"ada": velocity_trace(), "bob": velocity_trace(rate_hz=10), "cyd": None}
    for name, trace in runs.items():
        kept_run(folder / name / "evidence", velocity_run(trace, name=name))
    return folder


@pytest.mark.parametrize("rate_hz", [20, 10])
@pytest.mark.parametrize("pictures", [False, True])
def test_the_same_rubric_gives_the_same_report(tmp_path: Path, rate_hz: int, pictures: bool) -> None:
    """Every value of it; only the command comes from the command line and not from the recording."""
    run = velocity_run(velocity_trace(rate_hz=rate_hz), source="import rclpy\nperiod = 0.1\n")
    first = judge_run([velocity_exercise()], run, pictures=pictures)
    kept_run(tmp_path, run)
    how = rejudge.judgement((), (), pictures=pictures)
    again = rejudge.rejudge_evidence(open_evidence(tmp_path), how)
    assert again.reproduce.command == ("grade", "class/ada", "--seed", "7")
    assert dataclasses.replace(again, reproduce=first.reproduce) == first


def test_the_report_is_printed_and_written_as_by_grading(tmp_path: Path) -> None:
    """Text by default, JSON alone where asked for, files beside it, and the exit codes of grading."""
    run = velocity_run(velocity_trace(rate_hz=10))
    kept_run(tmp_path / "e", run)
    text = grade(tmp_path / "e")
    assert (text.exit_code, "20 of 30 points" in text.output) == (1, True)
    shown = grade(tmp_path / "e", "--json", "-o", f"text={tmp_path / 'r.txt'}", "--min-score", 60)
    report = rejudge.rejudge_evidence(open_evidence(tmp_path / "e"), rejudge.judgement((), ()))
    assert (shown.exit_code, shown.stdout) == (0, dumps(report))
    assert "20 of 30 points" in (tmp_path / "r.txt").read_text(encoding="utf-8")


def test_a_changed_rubric_gives_other_scores(tmp_path: Path) -> None:
    """Points, tolerances and checks; the report names the new rubric's digest and the command that gives it."""
    kept_run(tmp_path / "e", velocity_run(velocity_trace(rate_hz=18)))
    path = changed_rubric(tmp_path, ("tolerance: 1 Hz, partly", "tolerance: 2 Hz, partly"), ("points: 5", "points: 7"))
    report = json.loads(grade(tmp_path / "e", "--json", "--rubric", path).stdout)
    assert (report["score"], report["max_score"]) == (34, 34)
    assert report["reproduce"]["rubrics"] == {"velocity_publisher": read_rubric(path).digest}
    assert f"--rubric {path}" in report["reproduce"]["command"]


def test_a_class_is_judged_and_the_rest_goes_on(tmp_path: Path) -> None:
    """What is damaged is refused by name, and the exit code says so."""
    kept_class(tmp_path)
    right = grade(tmp_path)
    assert (right.exit_code, right.output.splitlines()) == (1, ["ada  30/30", "bob  20/30", "cyd  0/30", "judged: 3"])
    (tmp_path / "bob/evidence/velocity_publisher.alone/velocity_publisher.alone_0.mcap").write_bytes(b"x")
    damaged = grade(tmp_path)
    assert damaged.exit_code == 2
    assert damaged.output.splitlines()[:2] == ["ada  30/30", "cyd  0/30"]
    assert damaged.output.splitlines()[2].startswith("refused: bob: ")
    assert damaged.output.splitlines()[3] == "judged: 2, refused: 1"


def test_changes_are_told_with_dropped_marks_first(tmp_path: Path) -> None:
    """By the share of the points, with the old and the new standing of each criterion that changed."""
    kept_class(tmp_path)
    assert grade("--diff", tmp_path).output == "unchanged: 3 of 3\n"
    path = changed_rubric(
        tmp_path, ("linear.x: 0.5", "linear.x: 0.6"), ("partly_tolerance: 2 Hz", "partly_tolerance: 12 Hz")
    )
    lines = grade("--diff", tmp_path, "--rubric", path).output.splitlines()
    assert lines[:3] == [
        "changed: 2 of 3: 0 up, 1 down; mean 55.6 -> 50.0 %",
        "    velocity_publisher/linear_velocity: 5 points; 2 changed, mean 5.0 -> 0.0; met -> not met: 2",
        "    velocity_publisher/rate: 10 points; 1 changed, mean 0.0 -> 5.0; not met -> partly: 1",
    ]
    assert lines[3] == "ada: 30 -> 25 of 30: -5 points"
    assert lines[4].startswith("    velocity_publisher/linear_velocity: was met 5/5, is not met 0/5: t = 0.000 s")
    assert lines[5] == "1 keeps its score, but criteria changed: bob"
    assert lines[-1] == "unchanged: 1 of 3"


def test_changes_can_be_read_by_programs(tmp_path: Path) -> None:
    """The same order, every number, and who was refused or could not be compared."""
    kept_class(tmp_path)
    (tmp_path / "cyd/evidence/report.json").unlink()
    (tmp_path / "dan").mkdir()
    (tmp_path / "dan/evidence.json").write_text("{}")
    path = changed_rubric(tmp_path, ("linear.x: 0.5", "linear.x: 0.6"))
    found = json.loads(grade("--diff", "--json", tmp_path, "--rubric", path).stdout)
    assert [(c["name"], c["before"], c["after"], c["gain"]) for c in found["changed"]] == [
        ("ada", 30, 25, -5),
        ("bob", 20, 15, -5),
    ]
    assert found["unchanged"] == []
    assert (found["summary"]["down"], found["summary"]["mean_after"]) == (2, pytest.approx(200 / 3))
    assert found["not_compared"] == ["cyd"]
    assert [row["name"] for row in found["refused"]] == ["dan"]


def test_changes_can_be_opened_in_a_spreadsheet(tmp_path: Path) -> None:
    """One row for each criterion that changed; a name is no formula."""
    kept_class(tmp_path / "=class")
    path = changed_rubric(tmp_path, ("points: 10", "points: 5"))
    out = tmp_path / "changes.csv"
    text = grade("--diff", tmp_path, "--rubric", path, "--csv", out).output
    assert text.startswith(
        "changed: 3 of 3: 1 up, 0 down; mean 55.6 -> 60.0 %\n    velocity_publisher/rate: 10 -> 5 points;"
    )
    rows = list(csv.DictReader(io.StringIO(out.read_text(encoding="utf-8"), newline="")))
    assert [(r["submission"], r["criterion"], r["points_before"], r["of_after"], r["gain"]) for r in rows] == [
        ("'=class/ada", "rate", "10", "5", "-5"),
        ("'=class/cyd", "rate", "0", "5", "0"),
        ("'=class/bob", "rate", "0", "5", "0"),
    ]
    assert "--csv needs --diff" in grade(tmp_path, "--csv", out).output


def test_added_and_removed_criteria_are_changes(tmp_path: Path) -> None:
    """A criterion that is no longer asked took its points along."""
    kept_run(tmp_path / "e", velocity_run(velocity_trace()))
    text = (RUBRICS / "exercise_1" / "rubric.yaml").read_text(encoding="utf-8")
    (tmp_path / "less.yaml").write_text(text[: text.index("  - id: logging")], encoding="utf-8")
    (tmp_path / "other.yaml").write_text(text.replace("id: logging", "id: logs"), encoding="utf-8")
    less = grade("--diff", tmp_path / "e", "--rubric", tmp_path / "less.yaml").output
    assert "velocity_publisher/logging: was met 4/4; criterion removed" in less
    other = grade("--diff", tmp_path / "e", "--rubric", tmp_path / "other.yaml").output
    assert "velocity_publisher/logs: new criterion, is met 4/4" in other


def test_reports_of_a_class_are_files_in_a_folder(tmp_path: Path) -> None:
    """One a submission and format, and the whole class as JSON on standard output."""
    kept_class(tmp_path / "class")
    out = tmp_path / "out"
    done = grade(tmp_path / "class", "--json", "-o", f"json={out}", "-o", f"text={out}", "--jobs", 1)
    assert sorted(p.name for p in out.iterdir()) == [f"{n}.{e}" for n in ("ada", "bob", "cyd") for e in ("json", "txt")]
    found = json.loads(done.stdout)
    assert [row["report"] for row in found["submissions"]] == [
        json.loads((out / f"{row['name']}.json").read_text()) for row in found["submissions"]
    ]


@pytest.mark.nightly
@pytest.mark.slow
def test_many_processes_give_what_one_gives(tmp_path: Path) -> None:
    """In the same order; enough submissions for a pool."""
    for number in range(rejudge.WORTH_A_POOL * 2):
        kept_run(tmp_path / f"{number:03}", velocity_run(velocity_trace(rate_hz=10) if number % 3 else None))
    named = rejudge.named_evidence([tmp_path])
    how, wanted = rejudge.judgement((), ()), rejudge.Wanted(reports=True)
    several = rejudge.rejudge_class(named, how, wanted, jobs=2)
    assert several == rejudge.rejudge_class(named, how, wanted, jobs=1)
    assert [r.name for r in several] == [f"{number:03}" for number in range(rejudge.WORTH_A_POOL * 2)]


def test_equal_names_are_told_apart(tmp_path: Path) -> None:
    """Two classes may each have an ada."""
    for name in ("one", "two"):
        kept_run(tmp_path / name / "ada", velocity_run(velocity_trace()))
    named = rejudge.named_evidence([tmp_path / "one", tmp_path / "two", tmp_path / "one"])
    assert [name for name, _ in named] == ["ada", "ada (2)"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "expected kept evidence, found none"),
        (("--exercise", "odom_subscriber"), "expected the exercise odom_subscriber, found velocity_publisher"),
        (("--rubric", RUBRICS / "exercise_2"), "expected a rubric for velocity_publisher, found one for odom_sub"),
        (("--exercise", "velocity"), "expected one of velocity_publisher"),
        (("-o", "evidence=x"), "evidence is kept while grading"),
    ],
    ids=["none", "exercise", "rubric", "unknown", "output"],
)
def test_what_cannot_be_judged_is_told(tmp_path: Path, words: tuple[Path | str, ...], said: str) -> None:
    """Exit code 2 and one line."""
    (tmp_path / "none").mkdir()
    kept_run(tmp_path / "e", velocity_run(velocity_trace()))
    done = grade(tmp_path / ("e" if words else "none"), *words)
    assert done.exit_code == 2
    assert said in done.output


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    """A folder's name comes from a student; on a terminal it does nothing."""
    kept_run(tmp_path / "a\x1b[31m\n::error::x" / "evidence", velocity_run(None))
    shown = grade(tmp_path).output
    assert "\x1b" not in shown
    assert not any(line.startswith("::") for line in shown.splitlines())


def test_a_table_of_changes_is_not_replaced_by_an_empty_one(tmp_path: Path) -> None:
    """A first one is written even if nothing changed, for programs that expect it."""
    kept_class(tmp_path)
    table = tmp_path / "changes.csv"
    assert grade("--diff", "--csv", table, tmp_path).exit_code in (0, 1)
    assert table.read_text(encoding="utf-8").count("\n") == 1
    path = changed_rubric(tmp_path, ("linear.x: 0.5", "linear.x: 0.6"))
    grade("--diff", "--csv", table, tmp_path, "--rubric", path)
    real = table.read_bytes()
    assert real.count(b"\n") > 1
    done = grade("--diff", "--csv", table, tmp_path)
    assert f"note: {table} is left as it was: nothing changed" in done.stderr
    assert table.read_bytes() == real


def test_verifying_says_the_same_of_sound_evidence(tmp_path: Path) -> None:
    """Slower, and no other result; how much was verified is told apart from it."""
    kept_class(tmp_path)
    verified = grade("--verify", tmp_path)
    assert verified.stdout == grade(tmp_path).stdout
    assert verified.stderr == "verified: the recordings show what was judged: 3 submissions\n"


@pytest.mark.parametrize("word", ["1", "velocity_publisher", "exercise_1"])
def test_an_exercise_is_named_as_for_grading(tmp_path: Path, word: str) -> None:
    """By its number or folder as well; the report is that of its id."""
    kept_run(tmp_path / "kept", velocity_run(velocity_trace(rate_hz=10)))
    printed = grade(tmp_path / "kept", "--exercise", word)
    assert printed.exit_code == 1, printed.output
    by_id = rejudge.judgement(("velocity_publisher",), ())
    assert rejudge.judgement((word,), ()).chosen == by_id.chosen == ("velocity_publisher",)


def test_a_verbose_text_shows_everything(tmp_path: Path) -> None:
    """On the terminal, and in the files of a class."""
    kept_class(tmp_path / "class")
    short, long = (grade(tmp_path / "class" / "bob" / "evidence", *v).output for v in ((), ("-v",)))
    assert "-v shows everything" in short
    assert len(long.splitlines()) > len(short.splitlines())
    sizes = []
    for name, v in (("short", ()), ("long", ("-v",))):
        grade(tmp_path / "class", "-o", f"text={tmp_path / name}", *v)
        sizes.append((tmp_path / name / "bob.txt").stat().st_size)
    assert sizes[0] < sizes[1]
