"""A class from end to end, without running anybody's code: what is graded, what is kept, what is written."""

from __future__ import annotations

import io
import json
import os
import shutil
import tarfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from class_samples import GRADING, FakeScheduler, course, grade, hand_in, scores

from grader.course.classroom import class_run
from grader.course.classroom.final_marks import load_mark
from grader.course.classroom.gradebook import Status, row_remarks
from grader.course.classroom.last_run import read_last_run
from grader.course.classroom.outputs import Graded, Platforms, render_graded
from grader.course.classroom.store import SEED_KEY, State, Store, open_store
from grader.course.classroom.watching import Watcher
from grader.grading.app.seeds import SeedKey
from grader.grading.reporting.html.final_mark import FinalMark
from grader.runtime.model.errors import ClassError, HarnessError


def regraded(tmp_path: Path, **changes: Any) -> tuple[list[str], Graded]:
    """Grade the class in `in` again, and return the names of those who were graded."""
    scheduler = FakeScheduler()
    graded = grade(course(tmp_path / "in", tmp_path / "out", **changes), scheduler)
    return scheduler.graded, graded


def test_everybody_is_graded_once(tmp_path: Path) -> None:
    """The same command grades nobody again, and says how all stand."""
    hand_in(tmp_path / "in", ada=10, bob=7)
    names, graded = regraded(tmp_path)
    assert names == ["ada", "bob"]
    assert scores(graded) == {"ada": 10, "bob": 7}
    names, graded = regraded(tmp_path)
    assert (names, graded.kept_before) == ([], 2)
    assert scores(graded) == {"ada": 10, "bob": 7}


def test_what_was_handed_in_anew_is_graded(tmp_path: Path) -> None:
    """Only that; who left the class is named, and the result stays."""
    hand_in(tmp_path / "in", ada=10, bob=7)
    regraded(tmp_path)
    hand_in(tmp_path / "in", bob=9, eve=1)
    assert regraded(tmp_path)[0] == ["bob", "eve"]
    (tmp_path / "in" / "eve" / "score.py").unlink()
    (tmp_path / "in" / "eve").rmdir()
    _, graded = regraded(tmp_path)
    assert graded.book.foreign == ("eve",)
    assert (tmp_path / "out" / "students" / "eve" / "report.json").exists()


@pytest.mark.parametrize("change", [{"grading": "seed"}, {"grading": "clock"}, {"grading": "exercises"}])
def test_other_conditions_are_other_results(tmp_path: Path, change: Mapping[str, str]) -> None:
    """The seed, the clock and the rubrics are part of the key."""
    hand_in(tmp_path / "in", ada=10)
    regraded(tmp_path)
    others: dict[str, Any] = {"seed": 5, "clock": "wall", "exercises": ("odom_subscriber",)}
    other = replace(GRADING, **{change["grading"]: others[change["grading"]]})
    assert regraded(tmp_path, grading=other)[0] == ["ada"]


def test_a_stopped_run_goes_on(tmp_path: Path) -> None:
    """What was done is not done again, and nothing is missing in the end."""
    hand_in(tmp_path / "in", ada=10, bob=7, cleo=5, dan=3)
    with pytest.raises(KeyboardInterrupt):
        grade(course(tmp_path / "in", tmp_path / "out"), FakeScheduler(stop_after=2))
    names, graded = regraded(tmp_path)
    assert names == ["cleo", "dan"]
    assert scores(graded) == {"ada": 10, "bob": 7, "cleo": 5, "dan": 3}


def test_a_stopped_rerun_goes_on_too(tmp_path: Path) -> None:
    """Everybody is graded again once, not from the beginning after each stop; the next rerun is a new one."""
    hand_in(tmp_path / "in", ada=10, bob=7, cleo=5)
    regraded(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        grade(course(tmp_path / "in", tmp_path / "out", rerun="all"), FakeScheduler(stop_after=1))
    assert regraded(tmp_path, rerun="all")[0] == ["bob", "cleo"]
    assert regraded(tmp_path, rerun="all")[0] == ["ada", "bob", "cleo"]


def test_a_failure_is_tried_again_and_is_never_a_mark(tmp_path: Path) -> None:
    """Nothing is known of the score, and the same command tries once more."""
    hand_in(tmp_path / "in", ada="failed")
    _, graded = regraded(tmp_path)
    assert graded.book.rows[0].status is Status.FAILED
    assert graded.book.rows[0].adjusted.score is None
    assert regraded(tmp_path)[0] == ["ada"]


@pytest.mark.parametrize("later", ["failed", "undecided 6"])
def test_a_good_result_is_never_replaced_by_a_fault_of_ours(tmp_path: Path, later: str) -> None:
    """Also not where the files changed: the old result stays, and the row says that it is old."""
    hand_in(tmp_path / "in", ada=10)
    regraded(tmp_path)
    hand_in(tmp_path / "in", ada=later)
    names, graded = regraded(tmp_path)
    assert (names, graded.now.not_replaced) == (["ada"], ("ada",))
    assert scores(graded) == {"ada": 10}
    assert graded.book.rows[0].outdated
    assert regraded(tmp_path)[0] == ["ada"]
    hand_in(tmp_path / "in", ada=4)
    graded = regraded(tmp_path)[1]
    assert (scores(graded), graded.book.rows[0].problem) == ({"ada": 4}, "")


def test_rerun_chooses(tmp_path: Path) -> None:
    """Failed ones, undecided ones, or all."""
    hand_in(tmp_path / "in", ada=10, bob="undecided 6")
    (tmp_path / "in" / "eve").mkdir()
    regraded(tmp_path)
    assert regraded(tmp_path)[0] == []
    assert regraded(tmp_path, rerun="undecided")[0] == ["bob"]
    ran, graded = regraded(tmp_path, rerun="failed")
    assert (ran, graded.graded) == ([], 1)  # eve is refused again, for which nothing runs
    assert regraded(tmp_path, rerun="all")[0] == ["ada", "bob"]


def test_a_check_without_a_result_leaves_no_final_score(tmp_path: Path) -> None:
    """The points so far, and why they are not final, in the gradebook and on the page of the class."""
    hand_in(tmp_path / "in", bob="unchecked 10")
    row = regraded(tmp_path)[1].book.rows[0]
    assert (row.status, row.adjusted.score) == (Status.UNDECIDED, None)
    assert row_remarks(row) == ["not final: the machine was too busy for a check"]
    assert "t: the machine was too busy for a check" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")


def test_what_is_undecided_has_no_final_score(tmp_path: Path) -> None:
    """The points so far are shown as raw ones only."""
    hand_in(tmp_path / "in", bob="undecided 6")
    row = regraded(tmp_path)[1].book.rows[0]
    assert row.report is not None
    assert (row.status, row.adjusted.score, row.report["score"]) == (Status.UNDECIDED, None, 6)


def test_the_class_is_written_for_programs_and_for_spreadsheets(tmp_path: Path) -> None:
    """batch.json and gradebook.csv name everybody."""
    hand_in(tmp_path / "in", ada=10, bob="failed")
    regraded(tmp_path)
    written = json.loads((tmp_path / "out" / "batch.json").read_text(encoding="utf-8"))
    assert [(s["name"], s["status"]) for s in written["students"]] == [("ada", "graded"), ("bob", "failed")]
    lines = (tmp_path / "out" / "gradebook.csv").read_text(encoding="utf-8").splitlines()
    assert [line.split(",")[0] for line in lines] == ["submission", "ada", "bob"]


def test_results_have_one_writer(tmp_path: Path) -> None:
    """A second command on the same folder ends at once."""
    hand_in(tmp_path / "in", ada=10)
    with open_store(tmp_path / "out"), pytest.raises(ClassError, match="another process grades into this folder"):
        regraded(tmp_path)


def test_a_full_disk_ends_the_run_and_keeps_what_was_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The others would fail too; the same command continues when there is room again."""
    hand_in(tmp_path / "in", ada=10, bob="failed", cleo=5)
    with monkeypatch.context() as disk:
        disk.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=0))
        with pytest.raises(HarnessError, match="found the disk full"):
            regraded(tmp_path)
    names, graded = regraded(tmp_path)
    assert names == ["bob", "cleo"]
    assert scores(graded) == {"ada": 10, "bob": None, "cleo": 5}


def test_a_decision_about_nobody_ends_the_run_before_it_begins(tmp_path: Path) -> None:
    """The message names the line and the nearest name."""
    hand_in(tmp_path / "in", ada=10)
    (tmp_path / "adjust.yaml").write_text("students:\n  adda: {days_late: 1}\n", encoding="utf-8")
    with pytest.raises(ClassError, match=r"adjust\.yaml:2:3: expected a submission or a person") as error:
        regraded(tmp_path, adjustments=tmp_path / "adjust.yaml")
    assert error.value.hint == "did you mean `ada`?"
    assert not (tmp_path / "out" / "students" / "ada").exists()


def test_results_survive_in_every_state(tmp_path: Path) -> None:
    """What is written is read back."""
    hand_in(tmp_path / "in", ada=10, bob="undecided 6", cleo="failed")
    (tmp_path / "in" / "eve").mkdir()
    regraded(tmp_path)
    store = Store(tmp_path / "out")
    results = [store.kept(name).result for name in ("ada", "bob", "cleo", "eve")]
    assert [result.state for result in results if result] == [
        State.GRADED,
        State.UNDECIDED,
        State.FAILED,
        State.REFUSED,
    ]


def seeds(scheduler: FakeScheduler) -> dict[str, int | None]:
    """Return the seed that each submission was graded with."""
    return {name: task.conditions.options.seed for name, task in scheduler.tasks.items()}


def test_a_class_keeps_a_key_of_its_own(tmp_path: Path) -> None:
    """Everybody gets a seed that nobody can predict, the same again when graded again."""
    hand_in(tmp_path / "in", ada=10, bob=7)
    first, again, elsewhere = FakeScheduler(), FakeScheduler(), FakeScheduler()
    grade(course(tmp_path / "in", tmp_path / "out"), first)
    grade(course(tmp_path / "in", tmp_path / "out", rerun="all"), again)
    grade(course(tmp_path / "in", tmp_path / "other"), elsewhere)
    assert len(set(seeds(first).values())) == 2
    assert seeds(again) == seeds(first)
    assert set(seeds(elsewhere).values()).isdisjoint(seeds(first).values())
    key = tmp_path / "out" / SEED_KEY
    assert key.stat().st_mode & 0o777 == 0o600


def test_the_key_of_a_class_is_in_nothing_else_that_it_leaves(tmp_path: Path) -> None:
    """Results are handed on: pages, tables, reports."""
    hand_in(tmp_path / "in", ada=10)
    scheduler = FakeScheduler()
    grade(course(tmp_path / "in", tmp_path / "out"), scheduler)
    key = (tmp_path / "out" / SEED_KEY).read_bytes().strip()
    files = [path for path in (tmp_path / "out").rglob("*") if path.is_file() and path.name != SEED_KEY]
    assert files
    assert [path for path in files if key in path.read_bytes()] == []
    assert key.decode() not in repr(scheduler.tasks)


def test_another_key_is_another_result(tmp_path: Path) -> None:
    """One that is named is not kept; a changed one grades everybody again."""
    hand_in(tmp_path / "in", ada=10)
    regraded(tmp_path, seed_key=SeedKey(b"one key of 16 bytes"))
    assert not (tmp_path / "out" / SEED_KEY).exists()
    assert regraded(tmp_path, seed_key=SeedKey(b"one key of 16 bytes"))[0] == []
    assert regraded(tmp_path, seed_key=SeedKey(b"two key of 16 bytes"))[0] == ["ada"]
    assert regraded(tmp_path)[0] == ["ada"]
    assert regraded(tmp_path)[0] == []


def test_a_seed_for_everybody_needs_no_key(tmp_path: Path) -> None:
    """And none is made."""
    hand_in(tmp_path / "in", ada=10)
    scheduler = FakeScheduler()
    grade(course(tmp_path / "in", tmp_path / "out", grading=replace(GRADING, seed=5)), scheduler)
    assert seeds(scheduler) == {"ada": 5}
    assert not (tmp_path / "out" / SEED_KEY).exists()


#: A name in Latin-1, as a zip from Windows gives a folder on Linux.
LATIN_1 = os.fsdecode("M\xfcller".encode("latin-1"))


@pytest.mark.parametrize("layout", ["{}", "{}_1_assignsubmission_file_", "hw-{}"])
def test_a_name_in_another_encoding_stops_nobody(tmp_path: Path, layout: str) -> None:
    """Everybody after it in the class has a mark, in whatever layout; the next run goes on from there."""
    source = tmp_path / "hw-submissions"
    for name in ("ada", LATIN_1, "zoe"):
        hand_in(source, **{layout.format(name): 7})
    wanted = course(source, tmp_path / "out", platforms=Platforms(gradescope=True))
    for done_before in (0, 3):
        graded = grade(wanted)
        assert (graded.kept_before, graded.remarks) == (done_before, ())
        marks = [load_mark(path.read_bytes()) for path in sorted((tmp_path / "out" / "students").glob("*/mark.json"))]
        assert [mark and mark.adjusted.score for mark in marks] == [7, 7, 7]
        assert [mark and "\ufffd" in mark.student for mark in marks] == [False, True, False]
        assert f"written: {tmp_path}/out/gradescope.csv" in render_graded(graded)


def test_a_download_with_a_name_in_another_encoding(tmp_path: Path) -> None:
    """The name of a member of a tar archive is bytes, too."""
    with tarfile.open(tmp_path / "hw.tar", "w") as archive:
        for name in ("ada", LATIN_1, "zoe"):
            info = tarfile.TarInfo(f"{name}/score.py")
            info.size = 1
            archive.addfile(info, io.BytesIO(b"7"))
    assert list(scores(grade(course(tmp_path / "hw.tar", tmp_path / "out"))).values()) == [7, 7, 7]
    assert len(list((tmp_path / "out" / "students").glob("*/mark.json"))) == 3


def test_folders_in_another_encoding_are_graded_again(tmp_path: Path) -> None:
    """What the next run repeats is read as it was written: folders of class and results, and paths of options."""
    hand_in(tmp_path / LATIN_1, ada=10)
    wanted = course(tmp_path / LATIN_1, tmp_path / f"out-{LATIN_1}", options={"roster": (f"/x/{LATIN_1}.csv",)})
    for _ in range(2):
        assert scores(grade(wanted)) == {"ada": 10}
    assert read_last_run(wanted.results).options == wanted.options


def test_a_row_that_cannot_be_written_stops_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The remark names the submission; its mark is in the gradebook."""

    def fails_for_bob(page: str, mark: FinalMark) -> str:
        if mark.student == "bob":
            raise UnicodeEncodeError("utf-8", "\udcfc", 0, 1, "surrogates not allowed")
        return f"{page}{mark.student}"

    monkeypatch.setattr(class_run, "with_final_mark", fails_for_bob)
    hand_in(tmp_path / "in", ada=10, bob=7, cleo=5)
    graded = grade(course(tmp_path / "in", tmp_path / "out"))
    assert scores(graded) == {"ada": 10, "bob": 7, "cleo": 5}
    assert [remark.partition(",")[0] for remark in graded.remarks] == ["the pages of bob do not show the final mark"]
    pages = sorted((tmp_path / "out" / "students").glob("*/report.html"))
    assert [page.read_text(encoding="utf-8") for page in pages] == ["ada", "cleo"]
    assert graded.remarks[0] in json.loads((tmp_path / "out" / "batch.json").read_bytes())["remarks"]


TWINS = "name,student id\nMaria Schmidt,11\nMaria Schmidt,12\nEve Ill,13\nZoe,14\n"


def decided(tmp_path: Path, text: str) -> dict[str, Any]:
    """Write a roster and decisions, and return the options with them."""
    (tmp_path / "roster.csv").write_text(TWINS, encoding="utf-8")
    (tmp_path / "adjust.yaml").write_text(f"students:\n{text}", encoding="utf-8")
    return {"roster": tmp_path / "roster.csv", "adjustments": tmp_path / "adjust.yaml"}


def test_people_of_one_name_are_told_apart(tmp_path: Path) -> None:
    """By the name of the submission, wherever a list has names only."""
    hand_in(tmp_path / "in", **{"11": 4, "12": 7, "14": 5})
    regraded(tmp_path, **decided(tmp_path, "  '14': {comment: good}\n"))
    marks = "  '11': {score: 9, reason: r}\n  '14': {score: 6, reason: r}\n"
    graded = regraded(tmp_path, **decided(tmp_path, marks))[1]
    assert graded.moved == ("Maria Schmidt (11) 4 -> 9", "Zoe 5 -> 6")
    assert "    Maria Schmidt (11) 4 -> 9" in render_graded(graded)


def test_who_is_excused_has_not_handed_in_nothing(tmp_path: Path) -> None:
    """Neither on the terminal, nor in the counts, nor on the page."""
    hand_in(tmp_path / "in", **{"14": 5})
    graded = regraded(tmp_path, **decided(tmp_path, "  Eve Ill: {ignore: ill}\n"))[1]
    summary = render_graded(graded)
    assert "nothing handed in (2): Maria Schmidt (11), Maria Schmidt (12)\n" in summary
    assert "excused (1): Eve Ill\n" in summary
    assert (graded.book.count(Status.MISSING), graded.book.count(Status.EXCUSED)) == (2, 1)
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "Excused" in page


def test_a_decision_by_a_number_of_two_people_is_asked_for(tmp_path: Path) -> None:
    """Also where one of them has handed in nothing: nobody gets the points of the other."""
    source = tmp_path / "in"
    for name in ("Zoe_12_assignsubmission_file_", "Eve Ill_8_assignsubmission_file_"):
        hand_in(source, **{name: 5})
    with pytest.raises(ClassError, match=r"expected one student, found 2 for `12`") as error:
        regraded(tmp_path, **decided(tmp_path, "  '12': {score: 9, reason: r}\n"))
    assert error.value.hint == "name one of the submissions: `zoe-12` or `Maria Schmidt`"


def test_results_of_another_class_are_not_replaced_in_silence(tmp_path: Path) -> None:
    """A warning names where they came from, once, also where a folder was given twice."""
    for place, name in (("one", "ada"), ("two", "bob")):
        hand_in(tmp_path / place, **{name: 5})
    said: list[str] = []
    for source in ("one", "one", "two", "two"):
        wanted = course(tmp_path / source, tmp_path / "out")
        wanted = replace(wanted, sources=(*wanted.sources, *wanted.sources))
        class_run.grade_class(wanted, Watcher(lambda line: None), said.append, FakeScheduler())
    assert said == [
        f"{tmp_path}/out holds 1 result of another class, of {tmp_path}/one: they stay, but gradebook and page show "
        "this class; name another folder with -o to keep both"
    ]
