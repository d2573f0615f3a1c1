"""Whatever is handed in: a report or one clear line within its limits, and nothing left behind."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from places import GRADE
from process_table import Running, read, running, segments_in_use, students_of
from sample_folders import folder_of
from tiers import each
from waiting import wait_for

pytestmark = pytest.mark.ros


@pytest.fixture
def scratch(tmp_path: Path) -> Path:
    """A folder that the grader is told to use for what it needs; it is short, as sockets in it have short names."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    return folder


def start(scratch: Path, *arguments: Path | str) -> subprocess.Popen[str]:
    environment = {**os.environ, "TMPDIR": str(scratch)}
    command = [GRADE, *map(str, arguments)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def run(scratch: Path, *arguments: Path | str) -> tuple[int, str, str]:
    """Return exit code, standard output and standard error; afterwards nothing may be left behind."""
    before = shared_memory()
    process = start(scratch, *arguments)
    out, err = process.communicate(timeout=600)
    assert_nothing_left(scratch, before)
    return process.returncode, out, err


def assert_nothing_left(scratch: Path, shared_memory_before: set[str], files: Sequence[str] = ()) -> None:
    """Check that no process, no file and no segment of shared memory is left."""
    wait_for(lambda: not processes_of(scratch))
    wait_for(lambda: sorted(path.name for path in scratch.iterdir()) == sorted(files))
    wait_for(lambda: not orphaned_segments() - shared_memory_before)


def shared_memory() -> set[str]:
    """Return the segments that DDS has on this machine."""
    return {path.name for path in Path("/dev/shm").glob("*fast*")}


def orphaned_segments() -> set[str]:
    """Return the segments of DDS that no living process uses."""
    there = shared_memory()
    return there - segments_in_use()


def processes_of(scratch: Path) -> list[int]:
    """Return the processes that were started with this scratch folder, or whose submission was staged in it."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit() or int(entry.name) == os.getpid():
            continue
        told = b"".join(read(entry / name) for name in ("environ", "cmdline", "mountinfo"))
        if str(scratch).encode() in told:
            found.append(int(entry.name))
    return found


@pytest.mark.breadth(1, 3)
@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda path: None, "expected a folder, a .py file or an archive, found nothing there"),
        (lambda path: path.mkdir(), "expected at least one .py file, found none"),
        (lambda path: path.write_text("x"), "expected a folder, a .py file or an archive, found another kind of file"),
        (
            lambda path: path.symlink_to("/nonexistent"),
            "expected a folder, a .py file or an archive, found nothing there",
        ),
        (os.mkfifo, "expected a folder, a .py file or an archive, found a device, pipe or socket"),
    ],
    ids=["nothing", "empty folder", "another file", "dangling link", "pipe"],
)
def test_what_is_no_submission_is_one_line(
    scratch: Path, tmp_path: Path, make: Callable[[Path], object], said: str
) -> None:
    """Exit code 2, where and what, and no traceback."""
    make(tmp_path / "ada")
    code, out, err = run(scratch, tmp_path / "ada")
    assert (code, out) == (2, "")
    assert err.splitlines()[0] == f"error: {tmp_path}/ada: {said}"
    assert len(err.splitlines()) <= 2


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind root")
def test_a_file_that_may_not_be_read_is_named(scratch: Path, tmp_path: Path) -> None:
    """It is not copied, and the report or the line says so."""
    file = tmp_path / "ada" / "velocity_publisher.py"
    file.parent.mkdir()
    file.write_text("x = 1\n")
    file.chmod(0)
    code, out, err = run(scratch, file.parent, "--exercise", "velocity_publisher")
    assert code in (1, 2)
    assert "velocity_publisher.py" in out + err
    assert "Traceback" not in out + err


BAD = {
    "syntax_error": "syntax_error",
    "null_bytes": "syntax_error",
    "raises_in_constructor": "exception",
    "raises_in_callback": "exception",
    "exits_at_import": "exited",
    "loops_in_constructor": "hung",
    "loops_in_callback": "hung",
    "segmentation_fault": "killed",
    "endless_output": None,
    "ignores_stop": None,
    "asks_for_input": "exception",
    "memory_grows": None,
}


@pytest.mark.breadth(1, 2)
@pytest.mark.parametrize("name", each(BAD, 4))
def test_bad_code_ends_in_a_report(scratch: Path, name: str) -> None:
    """What went wrong is in it; the command ends by itself and leaves nothing behind."""
    submission = folder_of(f"broken/{name}")
    exercise = exercise_of(submission)
    code, out, err = run(scratch, submission, "--exercise", exercise, "--json")
    report = json.loads(out)
    assert code in (0, 1), err
    assert report["final"] is True
    kinds = {fault["kind"] for fault in report["exercises"][0]["faults"]}
    assert BAD[name] is None or BAD[name] in kinds
    assert all("\n" not in c["reason"] and len(c["reason"]) < 1000 for c in report["exercises"][0]["criteria"])
    assert "Traceback" not in err


def exercise_of(folder: Path) -> str:
    """Return the exercise that a folder answers."""
    names = {path.name for path in folder.rglob("*.py")}
    if "velocity_publisher.py" in names:
        return "velocity_publisher"
    return "odom_subscriber" if "odom_subscriber.py" in names else "two_node_communication"


def test_a_file_that_is_not_python_is_named_with_its_line(scratch: Path, tmp_path: Path) -> None:
    """The first thing its author needs."""
    file = tmp_path / "ada" / "velocity_publisher.py"
    file.parent.mkdir()
    file.write_text("import rclpy\n\ndef main(:\n    pass\n")
    code, out, _ = run(scratch, file.parent, "--exercise", "velocity_publisher", "--json")
    (fault,) = json.loads(out)["exercises"][0]["faults"]
    assert code == 1
    assert (fault["kind"], fault["file"], fault["line"]) == ("syntax_error", "velocity_publisher.py", 3)


#: Prints its own name in a way that finds it again, and never ends.
ENDLESS = "print('running', flush=True)\nwhile True: pass\n"


def endless(tmp_path: Path) -> Path:
    submission = tmp_path / "endless"
    submission.mkdir()
    (submission / "velocity_publisher.py").write_text(ENDLESS)
    return submission


def test_an_interrupt_in_the_middle_leaves_nothing(scratch: Path, tmp_path: Path) -> None:
    """Ctrl-C: 130, one line, and no process, folder or shared memory; also when it is pressed twice."""
    before = shared_memory()
    process, students = started(scratch, endless(tmp_path))
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=600)
    assert (process.returncode, out) == (130, "")
    assert err == "interrupted: no report was made\n"
    wait_for(lambda: not students & running())
    assert_nothing_left(scratch, before)


@pytest.mark.long
def test_a_kill_in_the_middle_ends_everything(scratch: Path, tmp_path: Path) -> None:
    """SIGKILL gives no time to tidy up: folders stay, but no process and no shared memory."""
    before = shared_memory()
    process, students = started(scratch, endless(tmp_path))
    process.kill()
    process.communicate(timeout=600)
    wait_for(lambda: not (processes_of(scratch) or students & running()))
    wait_for(lambda: not orphaned_segments() - before)
    assert all(re.match("grade-", path.name) for path in scratch.iterdir())


@pytest.mark.long
def test_a_termination_in_the_middle_ends_everything(scratch: Path, tmp_path: Path) -> None:
    """As a build server does it that has waited long enough."""
    before = shared_memory()
    process, students = started(scratch, endless(tmp_path))
    process.terminate()
    process.communicate(timeout=600)
    wait_for(lambda: not (processes_of(scratch) or students & running()))
    wait_for(lambda: not orphaned_segments() - before)


def started(scratch: Path, submission: Path) -> tuple[subprocess.Popen[str], set[Running]]:
    """Start the command, and return it with its students' processes once there are any."""
    process = start(scratch, submission, "--exercise", "velocity_publisher")
    students: set[Running] = set()

    def found() -> set[Running]:
        students.update(students_of(process))
        return students

    wait_for(found)
    return process, students
