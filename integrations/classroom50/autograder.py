"""The autograder of a Classroom 50 assignment: grades the current checkout, and writes the files that the runner reads.

`grade export classroom50` puts the following files beside it: the grader as a wheel, `prepare`, `constraints.txt`,
`settings.json` and the course's own rubrics. It writes `result.json`, `release-body.md`, `grading-report.html` and
`grading-evidence.zip`. The exit code is 0 if the submission was graded; with any other one, Classroom 50 records an
error and no mark.
"""

from __future__ import annotations

import json
import os
import secrets
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

HERE = Path(__file__).resolve().parent
ALL_MET, NOT_ALL_MET, UNDECIDED = 0, 1, 3
#: The variables of the job's environment that the grader gets; none of them is a token.
PASSED_ON = (
    *("PATH", "HOME", "LANG", "LC_ALL", "TMPDIR", "XDG_CACHE_HOME", "GITHUB_WORKSPACE", "GITHUB_EVENT_PATH"),
    *("CLASSROOM", "ASSIGNMENT", "ASSIGNMENT_TYPE", "OWNER", "USERNAME", "SUBMISSION_TAG"),
    *("COMMIT_URL", "RELEASE_URL", "REVIEW_URL"),
    "GRADER_SEED_KEY",  # the grader passes it to no other process
)
#: Files written to the checkout, by their names while grading.
LEFT = {
    "result.json": "result.json",
    "summary.md": "release-body.md",
    "report.html": "grading-report.html",
    "evidence.zip": "grading-evidence.zip",
}


def main() -> int:
    """Grade the checkout."""
    checkout = Path.cwd()
    for name in LEFT.values():
        remove(checkout / name)  # a student may have submitted a file or a link of this name
    folder = Path(tempfile.mkdtemp(prefix="grading-", dir=os.environ.get("RUNNER_TEMP")))
    code = graded(program(folder), checkout, folder)
    if (folder / "evidence").is_dir():
        shutil.make_archive(str(folder / "evidence"), "zip", folder / "evidence")
    for name, place in LEFT.items():
        # A result that is not final is not a mark; without a result, the runner reports an error.
        if (folder / name).exists() and not (code == UNDECIDED and place == "result.json"):
            shutil.copyfile(folder / name, checkout / place)
    return 0 if code in (ALL_MET, NOT_ALL_MET) else 1


def program(folder: Path) -> str:
    """Install the grader from the wheel beside this file, and return it; without a wheel, use the installed command."""
    wheels = sorted(HERE.glob("rclpy_grader-*.whl"))
    found = shutil.which("grade")
    if not wheels and found:
        return found
    if not wheels:
        sys.exit(f"{HERE}: expected a wheel of the grader, found none; make this folder with grade export classroom50")
    words = ["bash", HERE / "prepare", folder / "venv", wheels[-1], HERE / "constraints.txt"]
    subprocess.run(words, cwd=folder, check=True)
    return str(folder / "venv" / "bin" / "grade")


def graded(grade: str, checkout: Path, folder: Path) -> int:
    """Run the grader, and show its output while workflow commands are disabled."""
    outputs = {"text": "-", "classroom50": folder / "result.json", "markdown": folder / "summary.md"}
    outputs |= {"html": folder / "report.html", "evidence": folder / "evidence"}
    words = [grade, *arguments()]
    for format_, place in outputs.items():
        words += ["-o", f"{format_}={place}"]
    token = secrets.token_hex(16)
    print(f"::stop-commands::{token}", flush=True)
    try:
        done = subprocess.run(
            [*words, "--", "."],
            cwd=checkout,
            env=surroundings(os.environ, checkout),
            stdin=subprocess.DEVNULL,
            stderr=subprocess.STDOUT,
            check=False,
        )
    finally:
        # An unfinished line must not hide the token.
        print(f"\n::{token}::", flush=True)
    return done.returncode


def arguments() -> list[str]:
    """Return the settings of the export; the default is all exercises."""
    path = HERE / "settings.json"
    chosen = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    # Students can read the release, its files and the log.
    words = ["--no-progress", "--isolation", chosen.get("isolation", "auto"), "--audience", "student"]
    for exercise in chosen.get("exercises", ()):
        words += ["--exercise", exercise]
    for rubric in chosen.get("rubrics", ()):
        words += ["--rubric", str(HERE / rubric)]
    return words


def surroundings(environment: Mapping[str, str], checkout: Path) -> dict[str, str]:
    """Return the environment of the grader: a few variables, and the time of the commit."""
    few = {name: environment[name] for name in PASSED_ON if name in environment}
    when = environment.get("COMMIT_DATETIME") or committed(environment.get("GITHUB_SHA") or "HEAD", checkout)
    return {**few, "COMMIT_DATETIME": when} if when else few


def committed(commit: str, checkout: Path) -> str:
    """Return the time of a commit, ISO 8601; empty if unknown. When regrading there is no push event with the time."""
    words = ["git", "-c", "safe.directory=*", "-c", "core.fsmonitor=false", "-c", "log.showSignature=false"]
    words += ["show", "--no-patch", "--format=%cI", "--end-of-options", commit]
    try:
        done = subprocess.run(words, cwd=checkout, capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def remove(path: Path) -> None:
    """Remove a file, link or folder if it exists."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


if __name__ == "__main__":
    sys.exit(main())
