"""A loose program finds the files beside it in its working directory, as if it were started in its folder."""

import os
from pathlib import Path
from typing import Any

import pytest
from tiers import more

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import OutputLine
from grader.runtime.session import RecordingSession
from grader.runtime.worker.beside import MOST_BYTES, MOST_FILES, files_beside

PROGRAM = """
import rclpy, os
from rclpy.node import Node
with open("settings.txt") as file:
    print("read", file.read(), flush=True)
with open("settings.txt", "w") as file:
    file.write("30")
with open("deep/table.csv") as file, open("deep/out.csv", "w") as out:
    out.write(file.read())
print(open("settings.txt").read(), open("deep/out.csv").read(), sorted(os.listdir()), flush=True)
rclpy.init()
rclpy.spin_once(Node("node"), timeout_sec=0.5)
"""


def write(root: Path, *names: str) -> None:
    for name in names:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text("text")


def test_files_in_and_below_the_folder_are_found(tmp_path: Path) -> None:
    """Neither programs nor what is hidden, nor files of the folder above."""
    write(
        tmp_path,
        "above.txt",
        "week/node.py",
        "week/other.py",
        "week/b.txt",
        "week/a/c.yaml",
        "week/.env",
        "week/.git/x",
    )
    write(tmp_path, "week/__pycache__/node.cpython-311.pyc")
    assert files_beside(tmp_path, "week/node.py") == ("a/c.yaml", "b.txt")


def test_links_and_pipes_are_left_out(tmp_path: Path) -> None:
    """A link could lead anywhere, and whoever opened a pipe would wait for ever."""
    write(tmp_path, "node.py", "a.txt")
    (tmp_path / "link.txt").symlink_to("/etc/passwd")
    (tmp_path / "folder").symlink_to("/etc")
    os.mkfifo(tmp_path / "pipe.txt")
    assert files_beside(tmp_path, "node.py") == ("a.txt",)


def test_a_program_in_a_package_has_none(tmp_path: Path) -> None:
    """`ros2 run` starts it from anywhere."""
    write(tmp_path, "setup.py", "robot/node.py", "robot/a.txt")
    assert files_beside(tmp_path, "robot/node.py") == ()


def test_large_and_many_files_are_left_out(tmp_path: Path) -> None:
    """What fits is kept."""
    write(tmp_path, "node.py", *(f"{number:03}.txt" for number in range(MOST_FILES + 5)))
    (tmp_path / "000.txt").write_bytes(bytes(MOST_BYTES + 1))
    (tmp_path / "001.txt").write_bytes(bytes(MOST_BYTES - 8))
    assert files_beside(tmp_path, "node.py") == ("001.txt", "002.txt", "003.txt")
    (tmp_path / "001.txt").write_bytes(b"")
    assert len(files_beside(tmp_path, "node.py")) == MOST_FILES


@pytest.mark.ros
@pytest.mark.parametrize(
    "how", [{}, *more([{"clock": "wall"}, {"clock": "wall", "bare": True}])], ids=["virtual", "wall", "bare"]
)
def test_a_program_reads_and_writes_beside_itself(
    session: RecordingSession, tmp_path: Path, how: dict[str, Any]
) -> None:
    """On every clock; the files that were handed in stay as they are."""
    pytest.importorskip("rclpy")
    from hostile import record

    root = tmp_path / "s"
    tmp_path.chmod(0o755)
    write(root, "settings.txt", "deep/table.csv")
    for path in (root, *root.rglob("*")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    trace = record(session, root, PROGRAM, duration_ns=60 * NS_PER_S, **how)  # it ends by itself
    lines = [o.text for o in trace.observations if isinstance(o, OutputLine)]
    assert lines[:2] == ["read text", "30 text ['a.py', 'deep', 'settings.txt']"]
    assert (root / "settings.txt").read_text() == "text"
