"""What runs leave on the machine: nothing of their own, and nothing of a run that was killed."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from grader.runtime.temp_dirs import FRESH_S, PREFIX, make_room, scratch_folder, sweep


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for temporary files of these tests only."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def dead(place: Path, name: str = f"{PREFIX}abcd_012", age_s: float = 0.0) -> Path:
    """Return a folder as a killed run leaves it."""
    folder = place / name
    (folder / "submission" / "pkg").mkdir(parents=True)
    (folder / "submission" / "pkg" / "a.py").write_text("pass")
    os.utime(folder, (0, folder.stat().st_mtime - age_s))
    return folder


def test_the_folder_is_gone_afterwards(place: Path) -> None:
    """Also what is in it."""
    with scratch_folder() as folder:
        (folder / "x").write_text("x")
        assert folder.parent == place
    assert list(place.iterdir()) == []


def test_a_dead_runs_folder_is_removed_by_the_next_run(place: Path) -> None:
    """Write-protected folders in it are no obstacle."""
    folder = dead(place)
    (folder / "submission" / "pkg").chmod(0o555)
    (folder / "submission").chmod(0o500)
    with scratch_folder() as own:
        assert list(place.iterdir()) == [own]


def test_a_run_that_was_killed_leaves_its_folder_to_the_next(place: Path) -> None:
    """The lock goes with the process, however it ends."""
    code = (
        "import sys, tempfile; tempfile.tempdir = sys.argv[1]\n"
        "from grader.runtime.temp_dirs import scratch_folder\n"
        "with scratch_folder() as folder:\n"
        "    (folder / 'x').write_text('x'); print(folder, flush=True); sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(place)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as run:
        assert run.stdout is not None
        folder = Path(run.stdout.readline().strip())
        assert sweep(place) == []
        assert folder.is_dir()
        run.send_signal(signal.SIGKILL)
        run.wait()
    assert sweep(place) == [folder.name]
    assert not folder.exists()


def test_what_is_in_use_stays(place: Path) -> None:
    """Two runs of one user at the same time do not see each other's folder as dead."""
    with scratch_folder() as first, scratch_folder() as second:
        assert first.is_dir()
        assert second.is_dir()


@pytest.mark.parametrize(
    "name", [f"{PREFIX}short", f"{PREFIX}toolong_12", "grade-abcdefgh", "essays", f"x{PREFIX}abcdefgh"]
)
def test_other_names_stay(place: Path, name: str) -> None:
    """Only what has our name is looked at."""
    folder = dead(place, name)
    assert sweep(place) == []
    assert folder.is_dir()


def test_a_link_is_neither_followed_nor_removed(place: Path) -> None:
    """Somebody else's link with our name leads nowhere."""
    target = place / "target"
    target.mkdir()
    (target / "precious").write_text("x")
    (place / f"{PREFIX}abcdefgh").symlink_to(target)
    assert sweep(place) == []
    assert (target / "precious").exists()


def test_links_inside_are_removed_but_not_followed(place: Path) -> None:
    """A killed run's folder may hold links that a student's file became."""
    target = place / "target"
    target.mkdir(mode=0o700)
    (target / "precious").write_text("x")
    folder = dead(place)
    (folder / "link").symlink_to(target)
    (folder / "file").symlink_to(target / "precious")
    target.chmod(0o750)
    assert sweep(place) == [folder.name]
    assert (target / "precious").read_text() == "x"
    assert target.stat().st_mode & 0o777 == 0o750


def test_another_users_folder_stays(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Even for root, who could remove it."""
    folder = dead(place)
    monkeypatch.setattr(os, "geteuid", lambda: folder.stat().st_uid + 1)
    assert sweep(place) == []
    assert folder.is_dir()


def test_a_folder_that_is_just_being_made_stays(place: Path) -> None:
    """It is empty, and its maker is about to lock it; an old empty one is nobody's."""
    young, old = place / f"{PREFIX}youngone", place / f"{PREFIX}oldone_1"
    young.mkdir()
    old.mkdir()
    os.utime(old, (0, old.stat().st_mtime - FRESH_S - 60))
    assert sweep(place) == [old.name]
    assert young.is_dir()


def test_the_lock_is_not_inherited(place: Path) -> None:
    """A process that outlives the run must not keep its folder alive."""
    with scratch_folder() as folder:
        child = subprocess.Popen([sys.executable, "-I", "-c", "import sys; sys.stdin.read()"], stdin=subprocess.PIPE)
        held = [str(path.resolve()) for path in Path(f"/proc/{child.pid}/fd").iterdir()]
        child.communicate()
    assert str(folder) not in held


def test_files_of_the_tracer_go_unless_they_were_there_or_are_in_use(tmp_path: Path) -> None:
    """A library that ROS loads leaves them in the shared memory of every program of a user."""
    shared = tmp_path / "shm"
    shared.mkdir()
    (shared / "lttng-ust-wait-5").write_bytes(bytes(4096))
    with scratch_folder(shared):
        for name in ("lttng-ust-wait-6", "lttng-ust-wait-7", "other"):
            (shared / name).write_bytes(bytes(4096))
        with (shared / "lttng-ust-wait-7").open("rb") as file:
            import mmap

            used = mmap.mmap(file.fileno(), 4096, prot=mmap.PROT_READ)
    assert sorted(p.name for p in shared.iterdir()) == ["lttng-ust-wait-5", "lttng-ust-wait-7", "other"]
    used.close()


def test_a_place_that_is_missing_holds_nothing(place: Path) -> None:
    """Sweeping never fails a run."""
    assert sweep(place / "nowhere") == []


def test_a_folder_that_is_locked_stays(place: Path) -> None:
    """The lock is what tells a live run."""
    folder = dead(place)
    lock = os.open(folder, os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    assert sweep(place) == []
    os.close(lock)
    assert sweep(place) == [folder.name]


def test_the_oldest_builds_make_room(place: Path) -> None:
    """What was used last stays, and so do other folders and the new build, though it is larger than the limit."""
    builds = {}
    for number, name in enumerate(("oldest", "old", "new", "newest")):
        builds[name] = place / f"submitted-{name}"
        (builds[name] / "python").mkdir(parents=True)
        (builds[name] / "python" / "a.py").write_bytes(b"x" * 70_000)
        os.utime(builds[name], (number, number))
    (place / "0123456789abcdef").mkdir()
    (place / "submitted-link").symlink_to(place / "0123456789abcdef")
    assert make_room(place, keep=builds["newest"], most=300_000) == ["submitted-oldest"]
    (builds["newest"] / "python" / "b.py").write_bytes(b"x" * 400_000)
    make_room(place, keep=builds["newest"], most=300_000)
    assert builds["newest"].is_dir()
    assert not builds["new"].exists()
    assert (place / "0123456789abcdef").is_dir()
