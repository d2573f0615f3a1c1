"""The commands of the pages that tell how to do things: they are run in a folder that has what they name."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import ROOT

#: Pages in the order in which they are read, in one folder: later ones use what earlier ones leave.
PAGES = (
    *("docs/how-to/class.md", "docs/how-to/similarity.md", "docs/how-to/feedback.md", "docs/how-to/disputed-mark.md"),
    "docs/how-to/moodle.md",
    *(
        "docs/reference/evidence.md",
        "docs/reference/formats.md",
        "docs/reference/report.md",
        "docs/reference/rubric.md",
    ),
    *("docs/how-to/gradescope.md", "docs/how-to/classroom50.md", "docs/how-to/github-actions.md"),
    *("docs/how-to/install.md", "README.md"),
)
_LINE = re.compile(r"^ {4,}(grade .+)$", re.MULTILINE)
#: A remark after a command.
_REMARK = re.compile(r" {2,}.*$")
#: What needs a server or a desktop, or is no command: the output of one.
_ELSEWHERE = re.compile(r"grade (?:upload|doctor)|--open|graded now:")
_ROSTER = "id,name,email,username\n1,Ada Lovelace,ada@uni.edu,ada\n2,Bob,bob@uni.edu,bob\n"
_WORKSHEET = (
    "Identifier,Full name,Email address,Status,Grade,Maximum Grade,Grade can be changed,Last modified (grade),"
    'Feedback comments\nParticipant 1,Ada Lovelace,ada@uni.edu,Submitted,,100.00,Yes,-,""\n'
    'Participant 2,Bob,bob@uni.edu,Submitted,,100.00,Yes,-,""\n'
)


def commands(page: str) -> Iterator[str]:
    """Yield the commands of a page that can be run here, without remarks, and with a real form of OWNER/NAME@COMMIT."""
    for line in _LINE.findall((ROOT / page).read_text(encoding="utf-8")):
        if not _ELSEWHERE.search(line):
            yield _REMARK.sub("", line).replace("OWNER/NAME@COMMIT", f"school/rclpy-grader@{'0' * 40}")


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """Return a folder with a class, a submission, a rubric and a solution, under the names that the pages use."""
    solution = ROOT / "reference_solutions" / "velocity_publisher.py"
    shutil.copy(solution, tmp_path / "solution.py")
    shutil.copy(ROOT / "rubrics" / "exercise_1" / "rubric.yaml", tmp_path / "mine.yaml")
    for folder in ("ada", "FOLDER", "SUBMISSION", "class/1 - Ada Lovelace", "class/2 - Bob", "."):
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
        shutil.copy(solution, tmp_path / folder / "velocity_publisher.py")
    with zipfile.ZipFile(tmp_path / "submissions.zip", "w") as archive:
        for student in ("Ada Lovelace_1_assignsubmission_file_", "Bob_2_assignsubmission_file_"):
            archive.write(solution, f"{student}/velocity_publisher.py")
    (tmp_path / "roster.csv").write_text(_ROSTER)
    (tmp_path / "worksheet.csv").write_text(_WORKSHEET)
    for folder in ("student_template/.github/workflows", ".config/fish/completions"):
        (tmp_path / folder).mkdir(parents=True)
    return tmp_path


@pytest.mark.nightly
@pytest.mark.ros
def test_what_the_pages_say_can_be_done(desk: Path) -> None:
    """Each command of each page ends with 0, or with 1 where points are missing: two exercises are not handed in."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "HOME": str(desk), "GITHUB_STEP_SUMMARY": "summary.md"}
    failed, run = [], 0
    for page in PAGES:
        if page == "README.md":
            (desk / "mine.yaml").unlink()  # it has a command that writes a new one
        for command in commands(page):
            done = subprocess.run(
                ["bash", "-c", command], cwd=desk, env=environment, capture_output=True, text=True, check=False
            )
            run += 1
            if done.returncode not in (0, 1) or "Traceback" in done.stderr:
                failed.append(f"{page}: {command}\n{done.returncode}: {done.stderr}")
    assert failed == []
    assert run > 25
