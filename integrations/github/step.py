"""The grading step of action.yml: reads the inputs, runs `grade`, and writes summary, annotations and outputs.

Text of students reaches the log only while workflow commands are disabled, and the grader gets only a few variables of
the job's environment.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

ALL_MET, UNDECIDED = 0, 3
#: The variables of the job's environment that the grader gets; none is a token, and it does not pass on the seed key.
PASSED_ON = ("PATH", "HOME", "LANG", "LC_ALL", "TMPDIR", "XDG_CACHE_HOME", "GITHUB_WORKSPACE", "GRADER_SEED_KEY")
#: Variables that identify a sourced ROS installation.
OF_ROS = ("ROS_DISTRO", "AMENT_PREFIX_PATH", "PYTHONPATH", "LD_LIBRARY_PATH")
#: Characters allowed in outputs: numbers, words, base64, paths of the runner.
_ONE_LINE = re.compile(r"[^\x00-\x1f\x7f]*")


def main() -> int:
    """Grade the checkout; the exit code of `grade` becomes an output, so that files can be uploaded first."""
    folder = Path(tempfile.mkdtemp(prefix="grading-", dir=os.environ["RUNNER_TEMP"]))
    code = graded(command(os.environ, folder), Path(os.environ["GITHUB_WORKSPACE"]), folder)
    if (folder / "summary.md").exists():
        append("GITHUB_STEP_SUMMARY", (folder / "summary.md").read_text(encoding="utf-8"))
    else:
        append("GITHUB_STEP_SUMMARY", "**Nothing was graded.** The log of this step says why.\n")
    outputs = read_outputs(folder, code)
    append("GITHUB_OUTPUT", "".join(f"{name}={value}\n" for name, value in outputs.items() if single(value)))
    for name in ("summary.md", "annotations.txt", "result.b64", "errors.txt"):
        (folder / name).unlink(missing_ok=True)
    return 0


def command(environment: Mapping[str, str], folder: Path) -> list[str]:
    """Build the command for the inputs; its reports go to a folder whose name students cannot know."""
    words = [program(environment), "--no-progress", "--isolation", environment.get("INPUT_ISOLATION") or "auto"]
    words += ["--audience", "student"]  # students can read summary, annotations, log and artifact
    for exercise in re.split(r"[\s,]+", environment.get("INPUT_EXERCISES", "")):
        words += ["--exercise", exercise] if exercise else []
    for line in environment.get("INPUT_RUBRIC", "").splitlines():
        words += ["--rubric", line.strip()] if line.strip() else []
    least = environment.get("INPUT_MINIMUM_SCORE", "").strip()
    words += ["--min-score", least] if least else []
    outputs = {
        "text": "-",
        "markdown": folder / "summary.md",
        "github": folder / "annotations.txt",
        "classroom": folder / "result.b64",
        "json": folder / "report.json",
        "html": folder / "report.html",
        "evidence": folder / "evidence",
    }
    for format_, place in outputs.items():
        words += ["-o", f"{format_}={place}"]
    return [*words, "--", environment.get("INPUT_PATH") or "."]


def program(environment: Mapping[str, str]) -> str:
    """Return the grader that this action installed, or else the one of the machine."""
    own = Path(environment["RUNNER_TEMP"], "rclpy-grader", "bin", "grade")
    found = str(own) if own.exists() else shutil.which("grade", path=environment.get("PATH"))
    if found is None:
        sys.exit(
            "grade: expected the command on the PATH, found none; leave `setup` at true, or use an image that has it"
        )
    return found


def graded(words: Sequence[str], checkout: Path, folder: Path) -> int:
    """Run the grader, show its output while workflow commands are disabled, then its annotations."""
    names = (*PASSED_ON, *(OF_ROS if os.environ.get("ROS_DISTRO") else ()))
    few = {name: os.environ[name] for name in names if name in os.environ}
    token = secrets.token_hex(16)
    print(f"::stop-commands::{token}", flush=True)
    try:
        with (folder / "errors.txt").open("wb") as errors:
            done = subprocess.run(words, cwd=checkout, env=few, stdin=subprocess.DEVNULL, stderr=errors, check=False)
        said = (folder / "errors.txt").read_text(encoding="utf-8", errors="replace")
        print(said, end="", flush=True)
    finally:
        # An unfinished line must not hide the token.
        print(f"\n::{token}::", flush=True)
    annotations = folder / "annotations.txt"
    if annotations.exists():
        print(annotations.read_text(encoding="utf-8"), end="", flush=True)
    else:
        print(f"::error title=Nothing was graded::{escaped(said.strip() or 'the grader said nothing')}", flush=True)
    return done.returncode


def read_outputs(folder: Path, code: int) -> dict[str, str]:
    """Return the outputs of the step; those from the report are empty if there is none."""
    path, result = folder / "report.json", folder / "result.b64"
    report = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return {
        "score": str(report.get("score", "")),
        "max-score": str(report.get("max_score", "")),
        "passed": json.dumps(code == ALL_MET),
        "final": json.dumps(bool(report.get("final", False))),
        "result": result.read_text(encoding="ascii").strip() if result.exists() else "",
        "folder": str(folder),
        "exit-code": str(code if code >= 0 else UNDECIDED),
    }


def single(value: str) -> bool:
    """Whether a value is a single line, as outputs have to be."""
    return _ONE_LINE.fullmatch(value) is not None


def escaped(text: str) -> str:
    """Escape text for the message of a workflow command."""
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def append(variable: str, text: str) -> None:
    """Append text to one of the files that a step passes to its runner."""
    with Path(os.environ[variable]).open("a", encoding="utf-8") as file:
        file.write(text)


if __name__ == "__main__":
    sys.exit(main())
