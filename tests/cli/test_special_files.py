"""A pipe, a socket or a device in place of a file is refused, and blocks no command."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from places import GRADE, ROOT
from tiers import each

pytestmark = pytest.mark.slow

#: Far more than a command needs that opens nothing which never ends; only a hang takes so long.
HANGS_S = 300
SPECIAL = "a device, pipe or socket"


def make_socket(path: Path) -> None:
    """Bind a socket under a short name, which its address must have."""
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(f"/proc/self/fd/{folder}/{path.name}")
    finally:
        os.close(folder)


def make_link_to_pipe(path: Path) -> None:
    """Link to a pipe beside it."""
    pipe = path.with_name(f"{path.name}.pipe")
    os.mkfifo(pipe)
    path.symlink_to(pipe.name)


KINDS: dict[str, Callable[[Path], None]] = {
    "pipe": os.mkfifo,
    "socket": make_socket,
    "link to a pipe": make_link_to_pipe,
    "link to a device": lambda path: path.symlink_to("/dev/zero"),
}


def run(*arguments: str | Path, cwd: Path) -> tuple[int, str]:
    done = subprocess.run(
        [GRADE, *arguments], cwd=cwd, capture_output=True, text=True, check=False, timeout=HANGS_S,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


@pytest.mark.breadth(1, 5)
@pytest.mark.parametrize("kind", each(KINDS, 4))
@pytest.mark.parametrize("command", [(), (".",), ("--exercise", "1"), ("velocity_publisher.py",), ("observe", ".")])
def test_a_file_to_grade(tmp_path: Path, kind: str, command: tuple[str, ...]) -> None:
    """By its folder, without a name, or named itself."""
    KINDS[kind](tmp_path / "velocity_publisher.py")
    code, said = run(*command, cwd=tmp_path)
    assert code == 2
    assert "error: " in said
    assert "failed" not in said


@pytest.mark.parametrize("kind", each(KINDS, 4))
def test_a_class(tmp_path: Path, kind: str) -> None:
    """Only the submission is refused."""
    folder = tmp_path / "class" / "ada"
    folder.mkdir(parents=True)
    KINDS[kind](folder / "velocity_publisher.py")
    KINDS[kind](tmp_path / "class" / "bob.zip")
    code, said = run("batch", "class", "-o", "results", "--exercise", "1", cwd=tmp_path)
    assert code == 1
    assert "refused: ada" in said


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize("kind", each(KINDS, 4))
def test_files_beside_a_program(tmp_path: Path, kind: str) -> None:
    """Every file that describes a package, and archives, markers and sources, left out with a note."""
    shutil.copy(ROOT / "reference_solutions" / "velocity_publisher.py", tmp_path)
    for number, name in enumerate(("setup.py", "setup.cfg", "pyproject.toml", "package.xml", "CMakeLists.txt", "x.py")):
        (tmp_path / f"{number}").mkdir()
        KINDS[kind](tmp_path / f"{number}" / name)
        KINDS[kind](tmp_path / f"{number}" / "data.zip")
    KINDS[kind](tmp_path / "setup.py")
    code, said = run(".", "--exercise", "1", "-v", cwd=tmp_path)
    assert code == 0
    assert "30 of 30 points" in said
    assert "not copied: " in said
    code, said = run("observe", "velocity_publisher.py", "--duration", "1", cwd=tmp_path)
    assert code == 0
    assert "/cmd_vel" in said
