"""A class on a real cluster of two workers, one of which is killed on the way."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sample_folders import folder_of

pytestmark = pytest.mark.ros
GRADE = (sys.executable, "-c", "from grader.cli.main import main; main()", "batch", "class")
DASK = (sys.executable, "-m", "dask")
CLASS = {
    "ada": "correct/velocity_class",
    "cleo": "broken/syntax_error",
    "eve": "wrong/velocity_10_hz",
    "gus": "broken/syntax_error",
    "hal": "broken/python2_print",
}
#: What the time that grading took, or a machine's use of memory, puts into a result.
TAKEN = re.compile(rb'"(?:duration_s|execution_time|processor_s|peak_bytes)": [\d.]+|\bin \d+\.\d s\b')


@pytest.fixture
def class_(tmp_path: Path) -> Path:
    """Return a class of eight: folders, an archive, a large file, a link, no such file, nothing at all."""
    folder = tmp_path / "class"
    for name, source in CLASS.items():
        shutil.copytree(folder_of(source), folder / name)
    shutil.make_archive(str(folder / "bob"), "zip", folder_of("correct/velocity_class"))
    (folder / "dan").mkdir()
    (folder / "fay").mkdir()
    (folder / "fay" / "other.py").write_text("print()\n", encoding="utf-8")
    (folder / "eve" / "link.py").symlink_to("/etc/passwd")
    (folder / "eve" / "data.bin").write_bytes(os.urandom(2 << 20))
    return folder


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """Start a scheduler and two workers, and return its address and the workers."""
    place: dict[str, Any] = {"cwd": tmp_path, "stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "text": True}
    running: list[subprocess.Popen[str]] = []
    try:
        command = [*DASK, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
        running.append(subprocess.Popen(command, stderr=subprocess.PIPE, **place))
        assert running[0].stderr is not None
        log = iter(running[0].stderr.readline, "")
        address = next(found[1] for line in log if (found := re.search(r"Scheduler at:\s+(tcp://\S+)", line)))
        for name in ("one", "two"):
            command = [*DASK, "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
            command += ["--host", "127.0.0.1", "--local-directory", str(tmp_path / name)]
            running.append(subprocess.Popen(command, stderr=subprocess.DEVNULL, **place))
        yield address, running[1:]
    finally:
        for process in reversed(running):
            process.kill()
            process.communicate()


def results(folder: Path) -> dict[str, bytes]:
    """Return name and file -> content of all results, without how long they took."""
    students = folder / "students"
    paths = [path for path in sorted(students.rglob("*")) if path.is_file()]
    found = {path.relative_to(students).as_posix(): TAKEN.sub(b"", path.read_bytes()) for path in paths}
    # Who could not be used was not graded in a process of its own, and nobody measured what that used.
    return {name: re.sub(rb'"usage": \{[^}]*\}', b"", content) for name, content in found.items()}


@pytest.mark.nightly
def test_a_class_survives_the_loss_of_a_worker(
    class_: Path, cluster: tuple[str, list[subprocess.Popen[str]]], tmp_path: Path
) -> None:
    """Every result arrives once, and is what this machine makes of the submission."""
    address, workers = cluster
    (tmp_path / "seed.key").write_text("one key for both, so that both draw the same values", encoding="ascii")
    options = ("--exercise", "velocity_publisher", "--seed-key", "seed.key", "--spot-checks", "0%")
    here = subprocess.run([*GRADE, "-o", "here", *options], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert here.returncode == 1, here.stderr  # dan handed in nothing

    command = [*GRADE, "-o", "there", *options, "--scheduler", address]
    said = []
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as there:
        assert there.stderr is not None
        for line in there.stderr:
            said.append(line)
            if line.startswith("[3/8]"):
                workers[0].send_signal(signal.SIGKILL)
    assert there.returncode == 1, said
    arrived = [found[1] for line in said if (found := re.match(r"\[\d/8\] (\w+)", line))]
    assert sorted(arrived) == ["ada", "bob", "cleo", "dan", "eve", "fay", "gus", "hal"], said

    assert results(tmp_path / "there") == results(tmp_path / "here")
    again = subprocess.run([*GRADE, "-o", "there", *options], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "to grade: 0, done before: 8" in again.stderr
