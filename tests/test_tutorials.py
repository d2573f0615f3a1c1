"""The tutorials: their files are taken out of them, and their commands run in order and print what is shown."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import ROOT

FILE = re.compile(r"^`([\w/.]+)`:\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
CONSOLE = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)
#: Pages that are read one after the other in one folder, and the number of their commands.
SERIES = {
    "author": (["tutorials/author.md", "how-to/own-check.md"], 10),
    "rule": (["tutorials/hint-rule.md"], 5),
    "class": (["tutorials/student.md", "tutorials/instructor.md", "tutorials/ta.md", "tutorials/ci.md"], 17),
}


def steps(page: str) -> Iterator[tuple[str, str, str]]:
    """Yield a page's files and commands in order; a command comes with the lines that it has to print."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    found = [(m.start(), ("file", m[1], m[2])) for m in FILE.finditer(text)]
    for block in CONSOLE.finditer(text):
        for n, command in enumerate(re.split(r"^\$ ", block[1], flags=re.MULTILINE)[1:]):
            line, _, printed = command.partition("\n")
            found.append((block.start() + n, ("command", line, printed)))
    yield from (step for _, step in sorted(found))


def run(command: str, folder: Path) -> str:
    """Run a command as a reader would who has the grader on the path; return what it printed."""
    words, _, remark = command.partition("  # ")
    here = str(Path(sys.executable).parent)
    done = subprocess.run(
        shlex.split(words),
        cwd=folder,
        env={**os.environ, "PATH": f"{here}{os.pathsep}{os.environ['PATH']}"},
        check=False,
        capture_output=True,
        text=True,
    )
    wanted = int(remark.removeprefix("exit code ")) if remark else 0
    assert done.returncode == wanted, f"{command}\n{done.stdout}{done.stderr}"
    return " ".join(done.stdout.split())


@pytest.mark.nightly
@pytest.mark.breadth(0, 1)
@pytest.mark.ros
@pytest.mark.parametrize("series", SERIES)
def test_the_tutorials_work(series: str, tmp_path: Path) -> None:
    """Every file as it stands in them, every command in order, and every line that it is said to print."""
    pages, wanted = SERIES[series]
    for folder in ("student_template", "reference_solutions"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    commands = 0
    for kind, name, content in (step for page in pages for step in steps(page)):
        if kind == "file":
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_text(content, encoding="utf-8")
            continue
        printed = run(name, tmp_path)
        commands += 1
        for line in content.splitlines():
            assert " ".join(line.split()) in printed, f"{name}\n{printed}"
    assert commands == wanted
