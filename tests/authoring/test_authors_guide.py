"""The guide for authors: its files are taken out of it and its commands run, and its tables show all there is.

Run as a program, it writes the tables anew.
"""

from __future__ import annotations

import inspect
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from grader.judging.checks import CHECKS
from grader.rubrics.check_parameters import manual_of
from grader.rubrics.model import StimulusShape

GUIDE = Path(__file__).resolve().parent.parent.parent / "docs" / "tutorials" / "author.md"
FILE = re.compile(r"^`([\w/.]+)`:\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
CONSOLE = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)
STIMULI_HEAD, CHECKS_HEAD = "| stimulus | is |\n|---|---|\n", "| check | asks |\n|---|---|\n"
TABLE = r"((?:\|.*\n)+)"


def checks_table() -> str:
    """Return the table of all checks, from their docstrings."""
    return "".join(f"| `{name}` | {manual_of(kind).summary.replace('|', '/')} |\n" for name, kind in CHECKS.items())


def stimuli_table() -> str:
    """Return the table of all stimuli, from the docstrings of their shapes."""
    rows = []
    for field in StimulusShape.model_fields.values():
        text = " ".join(inspect.cleandoc(getattr(field.annotation, "__doc__", None) or "").split("\n\n")[0].split())
        text = text.removeprefix("A stimulus: ").replace("|", "/")
        rows.append(f"| `{field.alias}` | {text} |\n")
    return "".join(rows)


def with_tables(text: str) -> str:
    """Return the guide with its tables written anew."""
    for head, table in ((STIMULI_HEAD, stimuli_table()), (CHECKS_HEAD, checks_table())):
        text = re.sub(re.escape(head) + TABLE, (head + table).replace("\\", r"\\"), text)
    return text


def test_the_tables_show_every_check_and_every_stimulus() -> None:
    """`python tests/authoring/test_authors_guide.py` was run after the last change."""
    text = GUIDE.read_text(encoding="utf-8")
    assert CHECKS_HEAD + checks_table() in text
    assert STIMULI_HEAD + stimuli_table() in text


def steps() -> Any:
    """Return the guide's files and commands in order; a command comes with the lines that it has to print."""
    text = GUIDE.read_text(encoding="utf-8")
    found = [(m.start(), ("file", m[1], m[2])) for m in FILE.finditer(text)]
    for block in CONSOLE.finditer(text):
        for n, command in enumerate(re.split(r"^\$ ", block[1], flags=re.MULTILINE)[1:]):
            line, _, printed = command.partition("\n")
            found.append((block.start() + n, ("command", line, printed)))
    return [step for _, step in sorted(found)]


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


@pytest.mark.ros
@pytest.mark.long
def test_the_worked_example_works(tmp_path: Path) -> None:
    """Every file as it stands in the guide, every command in order, and every line that it is said to print."""
    commands = 0
    for kind, name, content in steps():
        if kind == "file":
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_text(content, encoding="utf-8")
            continue
        printed = run(name, tmp_path)
        commands += 1
        for line in content.splitlines():
            assert " ".join(line.split()) in printed, f"{name}\n{printed}"
    assert commands == 10


if __name__ == "__main__":
    GUIDE.write_text(with_tables(GUIDE.read_text(encoding="utf-8")), encoding="utf-8")
