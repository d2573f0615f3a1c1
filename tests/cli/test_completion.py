"""What Tab completes: in the words that click gives, and in real shells."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pexpect
import pytest
from click.shell_completion import ShellComplete
from tiers import each

from grader.cli.main import app

RUN = f"{sys.executable} -c 'from grader.cli.main import main; main()'"
#: Starts a shell without anybody's set-up.
SHELLS = {"bash": "bash --norc --noprofile", "zsh": "zsh -f", "fish": "fish --no-config"}
#: What is typed before Tab, and the words of the command then.
TYPED = [
    ("rub", ["rubric"]),
    ("rubric ch", ["rubric", "check"]),
    ("subm", ["submissions"]),
    ("submissions --exercise velo", ["submissions", "--exercise", "velocity_publisher"]),
    ("--min", ["--min-score"]),
    ("submissions -o mark", ["submissions", "-o", "markdown=report.md"]),
    ("submissions -o html=pag", ["submissions", "-o", "html=page one.html"]),
    ("submissions --isolation bubblewrap-f", ["submissions", "--isolation", "bubblewrap-flat"]),
    ("rubric check mi", ["rubric", "check", "mine.yaml"]),
    ("explain lin", ["explain", "linear_velocity"]),
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, with a submission, a rubric and a page."""
    (tmp_path / "submissions").mkdir()
    (tmp_path / "page one.html").touch()
    (tmp_path / "mine.yaml").write_text("exercise:\n  title: T\n  id: mine\ncriteria:\n  - id: one\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("args", "incomplete", "wanted"),
    [
        ([], "re", ["re", "rejudge"]),
        ([], "--exer", ["--exercise"]),
        (["export"], "grad", ["gradescope"]),
        ([".", "--exercise"], "two", ["two_node_communication"]),
        ([".", "--rubric", "mine.yaml", "--exercise"], "", ["mine"]),
        ([".", "--rubric", "none.yaml", "--exercise"], "", []),
        (["explain", "--rubric", "mine.yaml"], "", ["one"]),
        (["batch", "submissions", "--layout"], "m", ["moodle"]),
        (["rejudge", "submissions", "-o"], "ev", ["evidence=evidence"]),
        (
            [".", "-o"],
            "json=",
            ["json=mine.yaml", "json=page one.html", "json=submissions/", "json=submissions/report.json"],
        ),
        ([".", "-o"], "json=none/x", []),
    ],
)
def test_words_are_completed(folder: Path, args: list[str], incomplete: str, wanted: list[str]) -> None:
    """Commands, options and their values; where a path may stand, it is left to the shell."""
    found = ShellComplete(app, {}, "grade", "_GRADE_COMPLETE").get_completions(args, incomplete)
    assert [item.value for item in found] == wanted


def test_completion_does_not_wait_for_the_grader() -> None:
    """Each Tab starts a process: it imports neither what judges nor what reads rubrics."""
    program = (
        "import atexit, sys; from grader.cli.main import main\n"
        "heavy = {'pydantic', 'ruamel', 'rich', 'msgspec'}\n"
        "heavy |= {f'grader.grading.{name}' for name in ('judging', 'rubrics', 'app')}\n"
        "atexit.register(lambda: print(sorted(heavy & set(sys.modules))))\n"
        "main()"
    )
    asked = {"_GRADE_COMPLETE": "bash_complete", "COMP_WORDS": "grade\n.\n--exercise\nvelo", "COMP_CWORD": "3"}
    done = subprocess.run(
        [sys.executable, "-c", program], env={**os.environ, **asked}, check=True, capture_output=True, text=True
    )
    assert done.stdout.splitlines() == ["plain,velocity_publisher", "[]"]


@pytest.mark.breadth(1, 1)
@pytest.mark.slow
@pytest.mark.parametrize("shell", each(SHELLS, 3))
def test_tab_completes_in_a_shell(folder: Path, shell: str) -> None:
    """The printed script is all that a shell needs; what Tab typed arrives at the command, in words."""
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    program, words = folder / "bin" / "grade", folder / "bin" / "words"
    program.parent.mkdir()
    program.write_text(
        f'#!/bin/sh\nif [ -n "$_GRADE_COMPLETE" ] || [ "$1" = completion ]; then exec {RUN} "$@"; fi\n'
        f'printf "%s\\n" "$@" > {words}\n echo don""e\n'
    )
    program.chmod(0o755)
    environment = {**os.environ, "PATH": f"{program.parent}:{os.environ['PATH']}", "HOME": str(folder), "TERM": "dumb"}
    session = pexpect.spawn(SHELLS[shell], env=environment, encoding="utf-8", timeout=300, dimensions=(50, 200))
    session.sendline(
        f"grade completion {shell} > script; {'source' if shell == 'fish' else '.'} ./script; echo read''y"
    )
    session.expect("ready")
    found = []
    for typed, wanted in TYPED:
        session.send(f"grade {typed}\t")
        session.expect_exact(wanted[-1][-4:])
        session.sendline("")
        session.expect("done")
        found.append([word.rstrip("/") for word in words.read_text().splitlines()])
    session.close(force=True)
    assert found == [wanted for _, wanted in TYPED]
