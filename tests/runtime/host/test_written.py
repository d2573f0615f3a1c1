"""A program writes beside itself, as beginners do, and what it writes reaches nobody else."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hostile import hostile, printed, record
from mcap.reader import make_reader
from tiers import more

from grader.runtime.host.protocol import MOST_WRITTEN, FilesWritten
from grader.runtime.host.written import ALL_BYTES, FILE_BYTES
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB
from grader.runtime.model.trace import AssessedTrace, ClockKind, WrittenFile
from grader.runtime.recording.recording_file import recording_bytes, trace_of
from grader.runtime.session import RecordingSession
from grader.runtime.worker.beside import MOST_OF_SUBMISSION, whole_submission
from grader.runtime.worker.student_process import written_files

S = 1_000_000_000
Run = Callable[..., AssessedTrace]

WRITES = """
import csv, os, pathlib
here = pathlib.Path(__file__).parent
print("before", sorted(path.name for path in here.iterdir()))
log = open("velocity.csv", "w", newline="")
csv.writer(log).writerow(["t", "v"])
(here / "log.txt").write_text("hello\\n")
(here / "table.txt").write_text("changed")
(here / "data").mkdir()
(here / "data" / "points.csv").write_text("1,2\\n")
(pathlib.Path.home() / "at_home.txt").write_text("x")
print("after", sorted(path.name for path in here.iterdir()), os.getcwd() == str(here))
"""


@pytest.fixture
def run(session_in_tier: RecordingSession, tmp_path: Path) -> Run:
    def run_one(*programs: str, **fields: Any) -> AssessedTrace:
        (tmp_path / "s").mkdir(exist_ok=True)
        (tmp_path / "s" / "table.txt").write_text("as handed in", encoding="utf-8")
        return record(session_in_tier, tmp_path / "s", *programs, **{"duration_ns": S, **fields})

    tmp_path.chmod(0o755)
    return run_one


def kept(trace: AssessedTrace) -> dict[tuple[str, str], bytes]:
    return {(file.process, file.name): base64.b64decode(file.content) for file in trace.written}


@pytest.mark.breadth(1, 2)
@pytest.mark.ros
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
def test_a_program_writes_beside_itself_and_it_is_kept(run: Run, clock: str) -> None:
    """With a relative name, and by the folder of its file; files that it holds open are written to their end."""
    trace = run(hostile(before=WRITES), clock=clock, first_message_on="/cmd_vel")
    assert printed(trace)[:2] == [
        "before ['a.py', 'table.txt']",
        "after ['a.py', 'data', 'log.txt', 'table.txt', 'velocity.csv'] True",
    ]
    assert kept(trace) == {
        ("a.py", "at_home.txt"): b"x",
        ("a.py", "data/points.csv"): b"1,2\n",
        ("a.py", "log.txt"): b"hello\n",
        ("a.py", "table.txt"): b"changed",
        ("a.py", "velocity.csv"): b"t,v\r\n",
    }
    assert trace.faults() == ()


@pytest.mark.ros
def test_nobody_else_sees_what_a_program_wrote(run: Run, tmp_path: Path) -> None:
    """Neither a program of the same scenario, nor the next scenario of the same worker; the staged copy stays."""
    first = run(hostile(before=WRITES), hostile(before="import time\ntime.sleep(0.5)\n" + WRITES))
    second = run(hostile(before=WRITES), scenario="next")
    assert [text for text in printed(first) if text.startswith("before")] == [
        "before ['a.py', 'b.py', 'table.txt']"
    ] * 2
    assert printed(second)[0].startswith("before ['a.py', ")
    assert "log.txt" not in printed(second)[0]
    assert (tmp_path / "s" / "table.txt").read_text(encoding="utf-8") == "as handed in"


@pytest.mark.ros
@pytest.mark.long
def test_the_copy_has_the_size_of_a_scratch_folder(run: Run) -> None:
    """More ends the program, with the limit as the reason."""
    fills = """
        import pathlib
        here = pathlib.Path(__file__).parent
        for number in range(6):
            (here / f"file-{number}").write_bytes(bytes(1 << 20))
        sum(range(30_000_000))
        """
    trace = run(hostile(before=fills), limits=Limits(scratch_bytes=4 * MIB), duration_ns=2 * S)
    assert "4 MiB in one folder" in trace.faults()[0].text
    assert trace.written == ()  # each is larger than what is kept


@pytest.mark.ros
@pytest.mark.long
def test_only_plain_small_files_are_kept(run: Run) -> None:
    """No link, pipe or large file, and no more than so many."""
    odd = f"""
        import os, pathlib
        here = pathlib.Path(__file__).parent
        os.symlink("/etc/hostname", here / "link")
        os.symlink("/", here / "root")
        os.mkfifo(here / "pipe")
        (here / "large").write_bytes(bytes({FILE_BYTES} + 1))
        (here / "small").write_bytes(b"1")
        for number in range(3 * {MOST_WRITTEN}):
            (here / f"z{{number:02}}").write_bytes(b"2")
        """
    names = [name for _, name in kept(run(hostile(before=odd)))]
    assert names == ["small", *(f"z{number:02}" for number in range(MOST_WRITTEN - 1))]


@pytest.mark.ros
def test_a_large_submission_is_only_read(run: Run, tmp_path: Path) -> None:
    """Its working directory still holds copies of the files beside the program."""
    (tmp_path / "s" / "many").mkdir(parents=True)
    for number in range(MOST_OF_SUBMISSION):
        (tmp_path / "s" / "many" / f"{number}.py").write_text("", encoding="utf-8")
    tries = """
        import pathlib
        try:
            pathlib.Path(__file__).with_name("log.txt").write_text("x")
        except OSError as error:
            print(error.errno in (13, 30))
        print(open("table.txt").read(), open("own.txt", "w").write("x"))
        """
    trace = run(hostile(before=tries))
    assert printed(trace) == ["True", "as handed in 1"]
    assert kept(trace) == {("a.py", "own.txt"): b"x"}


@pytest.mark.ros
@pytest.mark.long
def test_a_program_of_a_package_works_in_an_empty_folder(session_in_tier: RecordingSession, tmp_path: Path) -> None:
    """As under `ros2 run`, from anywhere; it may write beside its module all the same."""
    tmp_path.chmod(0o755)
    package = tmp_path / "s" / "drive" / "drive"
    package.mkdir(parents=True)
    (package.parent / "package.xml").write_text("<package><name>drive</name></package>", encoding="utf-8")
    (package / "__init__.py").write_text("", encoding="utf-8")
    before = 'import os, pathlib\nprint(os.listdir("."), pathlib.Path(__file__).with_name("x.txt").write_text("1"))\n'
    (package / "node.py").write_text(hostile(before=before), encoding="utf-8")
    trace = record(session_in_tier, tmp_path / "s", processes=(("node.py", "drive/drive/node.py"),), duration_ns=S)
    assert printed(trace) == ["[] 1"]
    assert kept(trace) == {("node.py", "drive/drive/x.txt"): b"1"}


def test_files_are_attachments_of_the_recording() -> None:
    """Under the names of process and file; the trace holds them too, so a recording can be verified."""
    written = (WrittenFile("a.py", "log.txt", base64.b64encode(b"hello").decode()),)
    trace = AssessedTrace("alone", ClockKind.VIRTUAL, S, (), written=written)
    recording, _ = recording_bytes(trace, {"environment": json.dumps({"ros_distro": "jazzy"})}, "x.mcap")
    assert trace_of(recording) == trace
    found = {a.name: a.data for a in make_reader(io.BytesIO(recording)).iter_attachments()}
    assert found["written/a.py/log.txt"] == b"hello"


def believed(files: object) -> tuple[WrittenFile, ...]:
    """Return the files that a process has written, by what it reports."""
    return written_files("a.py", FilesWritten.checked({"files": files}).files)


@pytest.mark.parametrize(
    "name", ["../x", "/etc/x", "a//b", "a/./b", "", ".", "x\x1b[2J", "x\n", "x" * 201, 7, None, "\udc80", ["x"]]
)
def test_a_reported_file_with_an_odd_name_is_dropped(name: object) -> None:
    """What a process reports is untrusted."""
    good = {"name": "good.csv", "content": "MQ=="}
    assert believed([{"name": name, "content": "MQ=="}, good]) == (WrittenFile("a.py", "good.csv", "MQ=="),)


@pytest.mark.parametrize(
    "data", [None, 7, "x", {}, [None], [7], [{}], [{"name": "x"}], [{"name": "x", "content": "?"}]]
)
def test_a_report_that_is_none_is_dropped(data: object) -> None:
    """What a process reports is untrusted."""
    assert believed(data) == ()


def test_reported_files_are_limited() -> None:
    """In number, in the size of each, and in all."""
    whole = base64.b64encode(bytes(FILE_BYTES)).decode()
    more = base64.b64encode(bytes(FILE_BYTES + 3)).decode()
    assert believed([{"name": "x", "content": more}]) == ()
    found = believed([{"name": f"{n}", "content": whole} for n in range(3 * MOST_WRITTEN)])
    assert len(found) == ALL_BYTES // FILE_BYTES
    assert len(believed([{"name": f"{n}", "content": ""} for n in range(3 * MOST_WRITTEN)])) == MOST_WRITTEN


def test_a_submission_that_is_too_large_is_not_copied(tmp_path: Path) -> None:
    """By the number of its files, or by their bytes: half of the folder stays free."""
    (tmp_path / "a.py").write_bytes(bytes(100))
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "c.py").write_bytes(bytes(100))
    assert whole_submission(tmp_path, 400) == ("a.py", "b/c.py")
    assert whole_submission(tmp_path, 399) is None
    (tmp_path / "link").symlink_to("a.py")
    assert whole_submission(tmp_path, MIB) is None
    (tmp_path / "link").unlink()
    for number in range(MOST_OF_SUBMISSION - 1):
        (tmp_path / f"{number}").touch()
    assert whole_submission(tmp_path, MIB) is None
