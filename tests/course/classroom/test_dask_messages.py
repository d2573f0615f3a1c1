"""What travels to a cluster and back: bytes without code or places, and nothing that a result would not hold."""

from __future__ import annotations

import os
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from dask_samples import CONDITIONS, graded, task

from grader.course.classroom.local import Attempt, Task, failed_attempt
from grader.course.classroom.messages import (
    GradingJob,
    JobResult,
    Terms,
    pack_collected,
    pack_message,
    read_collected,
    unpack_message,
    write_answer,
)
from grader.course.classroom.receiving import write_task
from grader.course.classroom.sending import job_for, store_result, terms_of
from grader.course.classroom.store import State
from grader.grading.submissions.collected import Collected
from grader.grading.submissions.submission import stage_collected, stage_submission
from grader.runtime.model.errors import HarnessError, RecordingError, RubricError


def sent(one: Task, wanted: tuple[str] = ("velocity_publisher.py",)) -> tuple[Terms, GradingJob]:
    """Return terms and submission as they come out at the other end."""
    errand = job_for(one, wanted)
    assert isinstance(errand, GradingJob), errand
    return unpack_message(pack_message(terms_of(one)), Terms), unpack_message(pack_message(errand), GradingJob)


def test_a_submission_is_the_same_on_the_other_machine(tmp_path: Path) -> None:
    """Digest, files, notes and name: also of files whose names are no text, and with what was left out."""
    one = task(tmp_path)
    (one.submission / "link.py").symlink_to("/etc/passwd")
    (tmp_path / "ada" / os.fsdecode(b"\xff.txt")).write_bytes(b"odd")
    _, errand = sent(one)
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
    wanted = ["velocity_publisher.py"]
    here = stage_submission(str(one.submission), wanted, tmp_path / "here")
    path = os.fsdecode(errand.path)
    there = stage_collected(read_collected(errand.collected), path, wanted, tmp_path / "there")
    assert (here.digest, here.notes, here.name) == (there.digest, there.notes, there.name)
    assert (here.files, "link.py" in there.notes[0]) == (there.files, True)
    assert not (tmp_path / "there" / "link.py").exists()


def test_a_recording_that_is_too_large_is_known_on_the_other_machine() -> None:
    """There, too, the student is told so."""
    collected = Collected(((os.fsdecode(b"\xff.py"), b"x"),), ("a note",), (os.fsdecode(b"\xff.mcap"),))
    assert read_collected(pack_collected(collected)) == collected


def test_no_place_of_this_machine_travels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Absolute paths become relative ones, of the submission, of rubrics and of a recording."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rubric.yaml").write_text("id: velocity_publisher\n", encoding="utf-8")
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "metadata.yaml").write_text("x", encoding="utf-8")
    one = task(tmp_path, options={"rubrics": (tmp_path / "rubric.yaml",), "bags": (("/scan", tmp_path / "bag"),)})
    terms, errand = sent(one)
    assert str(tmp_path).encode() not in pack_message(terms) + pack_message(errand)
    assert terms.conditions.options.rubrics == (Path("rubric.yaml"),)
    assert terms.conditions.options.bags == (("/scan", Path("bag")),)
    assert ([name for name, _ in terms.files], errand.path) == ([b"rubric.yaml", b"bag/metadata.yaml"], b"ada")


@pytest.mark.parametrize("place", ["rubrics/mine.yaml", "../mine.yaml", "../../a/mine.yaml"])
def test_files_lie_where_reports_say_they_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str) -> None:
    """Relative paths, also those that lead up, lead to the same files inside the folder of the grading."""
    start = tmp_path / "x" / "y"
    start.mkdir(parents=True)
    monkeypatch.chdir(start)
    Path(place).parent.mkdir(parents=True, exist_ok=True)
    Path(place).write_text("mine", encoding="utf-8")
    terms, errand = sent(task(tmp_path, options={"rubrics": (Path(place),)}))
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    laid = write_task(terms, errand, scratch)
    there = next(scratch.rglob("mine.yaml"))
    assert [str(path) for path in laid.conditions.options.rubrics] == [place]
    assert there.read_text(encoding="utf-8") == "mine"
    assert replace(laid.conditions, options=CONDITIONS.options) == CONDITIONS


@pytest.mark.parametrize(
    ("file", "options"),
    [
        (b"/etc/x", {}),
        (b"../../../x/../../../../x/a", {"rubrics": (Path("/etc/x"),)}),
        (b"a", {"bags": (("/scan", Path("/etc")),)}),
        (b"a", {"interfaces": (Path("/etc"),)}),
    ],
)
def test_nothing_is_laid_out_or_read_elsewhere(tmp_path: Path, file: bytes, options: dict[str, Any]) -> None:
    """A path that leads out is refused, of a file and of an option."""
    conditions = replace(CONDITIONS, options=replace(CONDITIONS.options, **options))
    terms = Terms(conditions, ((file, b"x"),), standalone=False, deadline_s=1.0)
    with pytest.raises(HarnessError, match="expected paths that stay inside"):
        write_task(terms, GradingJob("a", b"a", b"a", b""), tmp_path)


def test_a_recording_travels_with_its_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One file or a folder of them; one that is gone is told."""
    monkeypatch.chdir(tmp_path)
    Path("bag").mkdir()
    Path("bag/b.mcap").write_bytes(b"b")
    Path("one.mcap").write_bytes(b"one")
    assert terms_of(task(tmp_path, options={"bags": (("/scan", Path("bag")),)})).files == ((b"bag/b.mcap", b"b"),)
    assert terms_of(task(tmp_path, options={"bags": (("/scan", Path("one.mcap")),)})).files == ((b"one.mcap", b"one"),)
    with pytest.raises(RecordingError, match=r"no\.mcap: cannot be read"):
        terms_of(task(tmp_path, options={"bags": (("/scan", Path("no.mcap")),)}))
    with pytest.raises(RubricError, match=r"no\.yaml: cannot be read"):
        terms_of(task(tmp_path, options={"rubrics": (Path("no.yaml"),)}))


def test_what_cannot_be_used_is_refused_here(tmp_path: Path) -> None:
    """With the key that it has when it is graded on this machine: it is looked at once, wherever that is."""
    one = task(tmp_path)
    (one.submission / "velocity_publisher.py").unlink()
    attempt = job_for(one, ())
    assert isinstance(attempt, Attempt)
    assert (attempt.status.state, attempt.status.label) == (State.REFUSED, "ada")
    assert attempt.status.problem.endswith("expected at least one .py file, found none")
    assert attempt.status.key == CONDITIONS.key(attempt.status.digest)


def test_a_result_is_written_down(tmp_path: Path) -> None:
    """With its files, and under the name that the source has for the submission."""
    attempt = store_result(task(tmp_path, label="Ada L."), graded())
    assert (attempt.status.state, attempt.status.score, attempt.status.label) == (State.GRADED, 3.0, "Ada L.")
    assert (attempt.task.into / "evidence" / "a.mcap").read_bytes() == b"x"


@pytest.mark.parametrize(
    "name", [b"../x", b"/x", b"evidence/../../x", b"result.json", b"x.py", b"evidence/\x1b[2J", b""]
)
def test_a_machine_writes_nothing_but_a_result(tmp_path: Path, name: bytes) -> None:
    """Other files, and names that lead elsewhere, make the answer a failure; nothing of it is written."""
    answer = JobResult("worker", graded().status, ((b"report.json", b"{}"), (name, b"x")))
    attempt = store_result(task(tmp_path), answer)
    assert (attempt.status.state, attempt.status.score) == (State.FAILED, 0.0)
    assert "expected the files of a result" in attempt.status.problem
    assert not attempt.task.into.exists()


def test_another_rubric_is_no_result(tmp_path: Path) -> None:
    """What was graded under other conditions than asked is a failure of ours."""
    attempt = store_result(task(tmp_path), graded(key="sha256:other"))
    assert attempt.status.state is State.FAILED
    assert "other rubrics" in attempt.status.problem


@pytest.mark.parametrize(
    "data", [b"", b"\xc1", b"\x81\xa1a\x01", pickle.dumps({}), pack_message(JobResult("w", b"[]"))]
)
def test_nonsense_is_no_result(tmp_path: Path, data: bytes) -> None:
    """Whatever comes back, it is read as data, never run, and never a mark."""
    from grader.course.classroom.sending import answer_in

    assert store_result(task(tmp_path), answer_in(data, "cluster")).status.state is State.FAILED


def test_a_full_disk_is_a_failure(tmp_path: Path) -> None:
    """The result is tried again when there is room."""
    one = task(tmp_path, into=tmp_path / "no" / "such" / "folder")
    assert store_result(one, graded()).status.problem == "the result cannot be written: No such file or directory"
    assert failed_attempt(one, "x").status.hint == "run the same command again"


def test_too_many_files_are_no_result(tmp_path: Path) -> None:
    """An answer is bounded in its files."""
    files = [(f"evidence/{n}".encode(), b"") for n in range(1_001)]
    with pytest.raises(HarnessError, match="expected the files of a result"):
        write_answer(files, tmp_path / "into", frozenset({"evidence"}))


def test_read_submissions_stay_inside() -> None:
    """Names that a machine made up are refused where they are read."""
    import msgspec

    for name in (b"/x", b"../x", b"a/../../x"):
        with pytest.raises(HarnessError, match="expected names that stay inside"):
            read_collected(msgspec.msgpack.encode({"files": [(name, b"")], "notes": []}))
