"""Plays small programs on the stage, and returns what they said."""

from __future__ import annotations

import atexit
import functools
import json
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

from grader.grading.submissions.projects import read_projects
from grader.runtime.host.packages import layout_of

STAGE = Path(__file__).with_name("stage.py")
SEED, OTHER_SEED = "ab" * 32, "cd" * 32


def play(code: str, *, seed: str = SEED, repeats: int = 5) -> list[str]:
    """Return what a program said, each with its virtual milliseconds; it must be the same in every repetition."""
    return _perform({"code": textwrap.dedent(code), "seed": seed, "repeats": repeats})


def play_file(root: Path, file: str) -> list[str]:
    """Return what a submission's file said, beside an rclpy that does nothing."""
    package = layout_of(str(root), file).package
    scripts = [script for project in read_projects(root)[0] if project.folder == package for script in project.scripts]
    return _perform({"root": str(root), "file": file, "scripts": scripts, "seed": SEED, "repeats": 1})


def _perform(request: dict[str, Any]) -> list[str]:
    stage = _stage()
    assert stage.stdin is not None
    assert stage.stdout is not None
    stage.stdin.write(json.dumps(request) + "\n")
    stage.stdin.flush()
    answers: list[list[str] | None] = json.loads(stage.stdout.readline())
    first, *others = answers
    assert first is not None, "the program ended its process, or hung"
    for other in others:
        assert other == first, "two runs differ"
    return first


@functools.cache
def _stage() -> subprocess.Popen[str]:
    """Start the stage, once for all tests of this process."""
    stage = subprocess.Popen([sys.executable, str(STAGE)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(stage.wait)
    if stage.stdin is not None:
        atexit.register(stage.stdin.close)
    return stage
