"""Schedulers of other packages: found by their metadata, Dask among them, and never able to make or cost a mark."""

from __future__ import annotations

import json
import os
import sys
from contextlib import closing
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest
from added_packages import files_of, grade, installed, made_importable, register
from class_samples import LASTING, hand_in
from click.testing import CliRunner, Result
from dask_samples import task
from sample_folders import folder_of

from grader.api import grade_packed, pack_task, store_answer
from grader.cli.main import app
from grader.course.classroom import receiving
from grader.course.classroom.local import Attempt, GradingProcesses
from grader.course.classroom.messages import Parcel, pack_message
from grader.course.classroom.schedulers import DASK, scheduler_name
from grader.course.classroom.store import State
from grader.grading.app.doctor import _added
from grader.grading.model.entry_points import SCHEDULERS as GROUP
from grader.grading.model.entry_points import load_registered
from grader.grading.model.exercise import Drawn

#: A scheduler that does as the fake one of this folder's tests, but for a method.
MODULE = """
from contextlib import contextmanager

from class_samples import FakeScheduler

PLACES = []

class Mine(FakeScheduler):
    {method}

@contextmanager
def connect(place, jobs, warn):
    PLACES.append((place, jobs))
    warn("connected")
    yield Mine()
    {after}
"""
WRONG = {
    "gives no result": ("def run(self, tasks, on_step): return iter(())", 3, "it gave no result"),
    "raises": ("def run(self, tasks, on_step): raise KeyError('x')", 3, "failed: KeyError: 'x'"),
    "raises in the middle": (
        "def run(self, tasks, on_step):\n        yield next(super().run(tasks, on_step))\n        1 / 0",
        3,
        "failed: ZeroDivisionError",
    ),
    "yields nonsense": ("def run(self, tasks, on_step): yield 7", 3, "expected an attempt of an open task"),
    "yields one twice": (
        "def run(self, tasks, on_step):\n        first = next(super().run(tasks, on_step))\n        yield first\n"
        "        yield first",
        3,
        "expected an attempt of an open task",
    ),
    "writes no report": (
        "def run(self, tasks, on_step):\n        for each in super().run(tasks, on_step):\n"
        "            (each.task.into / 'report.json').unlink()\n            yield each",
        3,
        "expected report.json in the task's folder, found none",
    ),
    "invents a result": (
        "def status(self, task):\n        from dataclasses import replace\n"
        "        return replace(super().status(task), digest='sha256:0')",
        3,
        "graded by other rubrics or another recording than those here",
    ),
    "has no status": ("def status(self, task): return 'graded'", 3, "expected a result, found something else"),
    "cannot prepare": ("def prepare(self, isolation): raise OSError('gone')", 2, "cannot be used: OSError: gone"),
}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder that is searched for packages, beside a class of two in the current folder."""
    folder = tmp_path / "packages"
    folder.mkdir()
    made_importable(folder, monkeypatch)
    monkeypatch.delitem(sys.modules, "mine_module", raising=False)
    hand_in(tmp_path / "in", ada=4, bob=10)
    monkeypatch.chdir(tmp_path)
    return folder


def run(scheduler: str, code: int = 0, *options: str) -> Result:
    command = ["batch", "in", "-o", "out", "--no-progress", "--exercise", "1", "--scheduler", scheduler, *options]
    done = CliRunner().invoke(app, command, prog_name="grade")
    assert done.exit_code == code, done.output
    return done


def test_dask_is_registered_like_any_other() -> None:
    """The metadata of the installed grader name it; nothing else of the grader knows where it is."""
    found = [entry for entry in metadata.entry_points(group=GROUP) if entry.dist and entry.dist.name == "rclpy-grader"]
    assert [(entry.name, entry.value) for entry in found] == [("dask", "grader.course.classroom.cluster:connect")]
    assert load_registered(GROUP, "dask", object, "a function") is not None


@pytest.mark.parametrize(("text", "place"), [("mine=a=b,c", "a=b,c"), ("mine=", ""), ("mine", "")])
def test_it_is_opened_by_its_name(package: Path, text: str, place: str) -> None:
    """With what follows the name, and the number of jobs; it warns, and grades the class."""
    register(package, GROUP, {"mine": "mine_module:connect"}, MODULE.format(method="pass", after="pass"))
    done = run(text, 0, "--jobs", "3")
    assert "warning: connected" in done.stderr
    assert [(place, 3)] == sys.modules["mine_module"].PLACES
    students = json.loads(Path("out/batch.json").read_bytes())["students"]
    assert {each["name"]: each["score"] for each in students} == {"ada": 4, "bob": 10}


@pytest.mark.parametrize("mistake", WRONG)
def test_what_it_does_wrong_makes_no_mark_and_costs_none(package: Path, mistake: str) -> None:
    """A failure of the machine, which names the package; the same command, here, grades what is missing."""
    method, code, said = WRONG[mistake]
    register(package, GROUP, {"mine": "mine_module:connect"}, MODULE.format(method=method, after="pass"))
    done = run("mine", code)
    kept = "".join(path.read_text() for path in Path("out").rglob("*.json"))
    assert said in done.output + kept
    assert "the scheduler 'mine' of mine 1.0" in done.output + kept
    rows = json.loads(Path("out/batch.json").read_bytes())["students"] if Path("out/batch.json").exists() else []
    assert all(each["score"] in (None, 4, 10) for each in rows)


def test_an_error_on_leaving_costs_no_mark(package: Path) -> None:
    """All is graded by then: it is a warning."""
    register(package, GROUP, {"mine": "mine_module:connect"}, MODULE.format(method="pass", after="1 / 0"))
    assert "cannot be left: ZeroDivisionError" in run("mine").stderr


@pytest.mark.parametrize(
    ("module", "said"),
    [
        ("1 / 0", "cannot be imported: ZeroDivisionError"),
        ("connect = 7", "expected a function, found int"),
        ("def connect(): pass", "cannot be used: TypeError"),
        ("def connect(place, jobs, warn): raise ValueError('no such place')", "cannot be used: ValueError: no such"),
        ("def connect(place, jobs, warn): return 7", "cannot be used: AttributeError"),
    ],
)
def test_one_that_cannot_be_opened_is_refused_before_grading(package: Path, module: str, said: str) -> None:
    """Exit code 2, and nothing is written."""
    register(package, GROUP, {"mine": "mine_module:connect"}, module)
    done = run("mine", 2)
    assert said in done.stderr
    assert "the scheduler 'mine' of mine 1.0" in done.stderr
    assert "hint: " in done.stderr
    assert not Path("out").exists()


def test_an_unknown_name_is_answered_with_those_that_there_are(package: Path) -> None:
    """It is no address."""
    register(package, GROUP, {"mine": "mine_module:connect"}, "")
    error, hint = run("yours=x", 2).stderr.splitlines()
    assert error == "error: --scheduler yours=x: expected a scheduler, found 'yours'"
    assert hint == "hint: there are dask, mine"


@pytest.mark.parametrize("text", ["tcp://127.0.0.1:9", "a=b.json", "mine"])
def test_addresses_and_files_stay_those_of_dask(package: Path, text: str) -> None:
    """A file may have any name, even that of a scheduler."""
    register(package, GROUP, {"mine": "mine_module:connect"}, "1 / 0")
    if ":" not in text:
        Path(text).write_text("{}")
    assert scheduler_name(text) == (DASK, text)


def test_the_name_of_dask_stays_the_graders(package: Path) -> None:
    """Whatever a package registers; `grade doctor` says that it is in vain."""
    register(package, GROUP, {"dask": "mine_module:connect"}, "1 / 0")
    found = load_registered(GROUP, "dask", object, "a function")
    assert found is not None
    assert found[1].startswith("the scheduler 'dask' of rclpy-grader ")
    (fact,) = _added()
    assert fact.value == "dask of mine 1.0 is not used: the grader has its own"


def test_metadata_without_dask_are_said_to_be_old(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a checkout that was installed before this was registered."""
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: [])
    assert "install it again: its metadata are older than its code" in run("tcp://127.0.0.1:9", 2).stderr


def test_a_parcel_of_another_version_is_not_graded(tmp_path: Path) -> None:
    """Nor is anything that no grader packed: both are failures of the machine."""
    one = task(tmp_path)
    other = store_answer(one, grade_packed(pack_message(Parcel("0.0.1", b"", b""))), "lab")
    assert (other.status.state, "expected rclpy-grader 0.0.1" in other.status.problem) == (State.FAILED, True)
    for sent in (b"", b"\x00", pack_message(Parcel("0.1.0", b"", b""))):
        assert store_answer(one, grade_packed(sent), "lab").status.state is State.FAILED
    for answer in (None, b"", b"\x93", 7, "text"):
        assert store_answer(one, answer, "lab").status.problem == "lab: expected a result, found something else"


def test_parcels_of_a_class_are_graded_by_one_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It waits for the next one of the same class; another class gets another process."""
    choice = SimpleNamespace(isolation=SimpleNamespace(name="bubblewrap", shares_network=False))
    monkeypatch.setattr(receiving, "sandbox_here", lambda wanted: choice)
    with closing(GradingProcesses((sys.executable, "-c", LASTING))) as processes:
        monkeypatch.setattr(receiving, "_PROCESSES", processes)
        steps: list[str] = []
        for seed, (name, deadline_s) in enumerate((("ada", 60.0), ("bob", 60.0), ("cleo", 90.0), ("dan", 60.0))):
            one = task(tmp_path, name, options={"seed": seed}, deadline_s=deadline_s)
            drawn = Drawn(name, {"velocity_publisher": {"rate": str(seed)}})
            sent = pack_task(replace(one, conditions=replace(one.conditions, variants=drawn)))
            assert isinstance(sent, bytes)
            grade_packed(sent, steps.append)
    assert steps[::2] == ["starting"] * 4
    ada, bob, cleo, dan = steps[1::2]
    assert ada == bob == dan != cleo


def test_what_cannot_be_used_is_not_sent(tmp_path: Path) -> None:
    """Its attempt says so at once."""
    one = task(tmp_path)
    (one.submission / "velocity_publisher.py").unlink()
    one.submission.rmdir()
    packed = pack_task(one)
    assert isinstance(packed, Attempt)
    assert packed.status.state is State.REFUSED


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.ros
def test_the_package_of_the_page_works(tmp_path: Path) -> None:
    """Its three files, built and installed by pip, grade a class through two hosts; a stand-in for ssh runs here."""
    files = files_of("docs/how-to/scheduler.md")
    assert len(files) == 3
    packages = installed(files, tmp_path / "package")
    programs = tmp_path / "bin"
    programs.mkdir()
    ssh = programs / "ssh"
    ssh.write_text('#!/bin/sh\necho "$1" >> "$HOSTS"\nshift 2\ncd /\nexec "$PYTHON" "$@"\n')
    ssh.chmod(0o755)
    for name, source in (("ada", "correct/velocity_class"), ("bob", "broken/syntax_error")):
        place = tmp_path / "class" / name
        place.mkdir(parents=True)
        for file in folder_of(source).iterdir():
            (place / file.name).write_bytes(file.read_bytes())
    (tmp_path / "seed.key").write_text("one key for both, so that both draw the same values", encoding="ascii")
    options = ("--exercise", "1", "--seed-key", "seed.key", "--spot-checks", "0%", "--no-progress")
    environment = {
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "PYTHON": sys.executable,
        "HOSTS": str(tmp_path / "hosts"),
    }
    marks = []
    for where, scheduler in (("there", ["--scheduler", "ssh=lab-01,lab-02"]), ("here", [])):
        done = grade(
            "batch",
            "class",
            "-o",
            where,
            *options,
            *scheduler,
            packages=packages,
            cwd=tmp_path,
            environment=environment,
        )
        assert done.returncode == 0, done.stderr
        students = json.loads((tmp_path / where / "batch.json").read_bytes())["students"]
        marks.append({each["name"]: each["score"] for each in students})
    assert marks[0] == marks[1]
    assert marks[0]["ada"] == 30
    assert sorted((tmp_path / "hosts").read_text().split()) == ["lab-01", "lab-02"]
