"""What a program sees of the machine is the same, wherever and by whomever it is graded."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import GRADE, ROOT
from sandboxes import USER, unreachable, user_start
from tiers import more

from grader.runtime.ros_installation import find_ros
from grader.runtime.sandbox.bubblewrap import USER_NAME
from grader.runtime.sandbox.tiers import FLAT_NAME, LANDLOCK_NAME, PLAIN_NAME

pytestmark = pytest.mark.ros

PAGE = ROOT / "docs" / "reference" / "machine.md"
#: A shell that hands on as much as possible of what a process inherits.
ODD_SHELL = "umask 077; ulimit -S -s 1024; trap '' HUP INT TERM USR1; exec nice -n 5 \"$@\""


def documented() -> set[str]:
    """Return the rows of the page that are fixed or drawn."""
    table = PAGE.read_text(encoding="utf-8").partition("## Fixed or drawn")[2].partition("\n## ")[0]
    cells = [line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")]
    assert cells[0] == "what"
    return set(cells[1:])


def rows(program: Path, *options: str, before: tuple[str, ...] = (), **variables: str) -> dict[str, str]:
    """Return what the program printed under `grade observe`, by its row; skips if its tier does not work here."""
    command = [*before, GRADE, "observe", str(program), "--duration", "1", "--json", *options]
    environment = {**os.environ, **variables}
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600, env=environment)
    if done.stderr.startswith("error: isolation"):
        pytest.skip(done.stderr.strip())
    assert done.stdout, done.stderr
    observed = json.loads(done.stdout)
    assert [fault["kind"] for fault in observed["faults"]] == ["exited"], observed["faults"]
    return dict(record["text"].split(" = ", 1) for record in observed["records"])


@pytest.fixture(scope="module")
def program() -> Iterator[Path]:
    """The program, alone in a folder that every user can read."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(shutil.copy(Path(__file__).parent / "machine" / "machine.py", folder))


@pytest.fixture(scope="module")
def usual(program: Path) -> dict[str, str]:
    """What it prints in the strongest sandbox of this machine."""
    return rows(program)


def test_the_page_lists_what_the_program_prints(usual: dict[str, str]) -> None:
    """Each row of the page that is fixed or drawn is printed and so compared."""
    assert usual.keys() == documented()


@pytest.mark.nightly
def test_on_one_processor_from_an_odd_shell(program: Path, usual: dict[str, str], open_folder: Path) -> None:
    """Affinity, priority, umask, limits, signals, time zone, locale, folders and variables are the caller's."""
    before = ("taskset", "-c", "0", "bash", "-c", ODD_SHELL, "bash")
    variables = {"TZ": "Asia/Kathmandu", "LANG": "de_DE.ISO-8859-1", "LC_ALL": "C", "TMPDIR": str(open_folder)}
    variables |= {"COLUMNS": "20", "TERM": "dumb", "USER": "somebody", "OMP_NUM_THREADS": "9", "PYTHONHASHSEED": "7"}
    assert rows(program, before=before, **variables) == usual


@pytest.mark.nightly
@pytest.mark.parametrize("tier", more([FLAT_NAME, LANDLOCK_NAME, PLAIN_NAME]))
def test_in_another_tier(program: Path, usual: dict[str, str], tier: str) -> None:
    """The tiers without a view of files of their own answer alike."""
    assert rows(program, "--isolation", tier) == usual


@pytest.mark.nightly
def test_for_another_user(program: Path, usual: dict[str, str], open_folder: Path) -> None:
    """An ordinary user, whose sandbox has a user namespace, sees what root sees."""
    if os.geteuid() != 0:
        pytest.skip("only root can become another user")
    ros = find_ros()
    before = user_start(ros)
    if why := unreachable(before, ros):
        pytest.skip(why)
    os.chown(open_folder, USER, USER)
    own = {"HOME": str(open_folder), "XDG_CACHE_HOME": str(open_folder), "TMPDIR": str(open_folder)}
    assert rows(program, "--isolation", USER_NAME, before=before, **own) == usual
