"""Grades a submission again and again, kills one of the grader's processes each time, and compares the reports.

Usage: python benchmarks/killing.py [RUNS] [SUBMISSION]      200 runs of reference_solutions unless told otherwise

The process is drawn from one kind at a time: the grader, a worker, a starter, a student's process, or bubblewrap, at a
moment that is drawn from the time that a grading takes. A criterion has to have its usual outcome or be undecided, and
no process and no temporary folder may stay.
"""

from __future__ import annotations

import collections
import contextlib
import ctypes
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from grader.execution.usage import families

ROOT = Path(__file__).resolve().parent.parent
GRADE = str(Path(sys.executable).with_name("grade"))
KINDS = ("grader", "worker", "starter", "student", "bubblewrap")
#: Seconds until a grading must have ended, and until its processes must have.
GRADED_S, GONE_S = 300.0, 20.0
SET_CHILD_SUBREAPER = 36  # linux/prctl.h


def kind_of(pid: int, grader: int) -> str:
    """Return the kind of a process; empty for helpers, and if it has ended."""
    if pid == grader:
        return "grader"
    with contextlib.suppress(OSError, UnicodeDecodeError):
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
        if Path(words[0]).name == "bwrap":
            return "bubblewrap"
        if any(word.endswith("/starter.py") for word in words):
            # A fork keeps the words of the starter, and has its own root once it is a student's process.
            inside = Path(f"/proc/{pid}/root").stat().st_ino, Path(f"/proc/{pid}/root").stat().st_dev
            parent = Path(f"/proc/{parent_of(pid)}/root").stat()
            return "starter" if inside == (parent.st_ino, parent.st_dev) else "student"
        if any(word.endswith("/launcher.py") for word in words):
            return "student"
        if "grader.execution.worker_main" in words:
            return "worker"
    return ""


def parent_of(pid: int) -> int:
    """Return the parent of a process; raises OSError if it has ended."""
    return int(Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[1])


def outcomes(report: bytes) -> dict[str, str] | None:
    """Return the outcome of each criterion; None if there is no report."""
    try:
        exercises = json.loads(report)["exercises"]
    except (ValueError, KeyError):
        return None
    return {one["id"]: one["outcome"] for exercise in exercises for one in exercise["criteria"]}


def graded(submission: str, scratch: str, kind: str = "", delay_s: float = 0.0) -> tuple[bytes, int, float, bool]:
    """Grade once and kill a process; return the report, the exit code, the seconds, and whether one was killed."""
    began, killed = time.monotonic(), False
    with subprocess.Popen(
        [GRADE, submission, "--json"],
        cwd=ROOT,
        env={**os.environ, "TMPDIR": scratch},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as process:
        deadline = began + GRADED_S
        if kind:
            time.sleep(delay_s)
        while kind and not killed and process.poll() is None and time.monotonic() < deadline:
            family = families([process.pid])[process.pid]
            pids = sorted(pid for pid in family if kind_of(pid, process.pid) == kind)
            with contextlib.suppress(ProcessLookupError):
                if pids:
                    os.kill(random.choice(pids), signal.SIGKILL)
                    killed = True
            time.sleep(0.005)
        report, _ = process.communicate(timeout=GRADED_S)
    return report, process.returncode, time.monotonic() - began, killed


def left_over() -> list[str]:
    """Wait for the end of what a killed grader leaves behind, and return what is still there."""
    deadline = time.monotonic() + GONE_S
    while True:
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        children = Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="ascii").split()
        if not children or time.monotonic() > deadline:
            return [f"process {pid}" for pid in children]
        time.sleep(0.05)


def main() -> None:
    """Print how gradings ended by the kind of process that was killed; exit code 1 if one ended wrongly."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    submission = sys.argv[2] if len(sys.argv) > 2 else "reference_solutions"
    ctypes.CDLL(None).prctl(SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    wrong = 0
    counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    with tempfile.TemporaryDirectory() as scratch:
        graded(submission, scratch)
        usual, _, seconds, _ = graded(submission, scratch)
        expected = outcomes(usual)
        assert expected, "the grading without a kill has no report"
        for run in range(runs):
            kind = KINDS[run % len(KINDS)]
            report, code, _, killed = graded(submission, scratch, kind, random.uniform(0, seconds))
            found, left = outcomes(report), left_over()
            folders = [] if kind == "grader" else [path.name for path in Path(scratch).iterdir()]
            if left or folders:
                how = f"left {left or folders}"
            elif not killed:
                how = "ended before the kill"
            elif found is None:
                how = "no report" if kind == "grader" and code == -signal.SIGKILL else f"no report, exit code {code}"
            elif found == expected:
                how = "the usual report"
            elif all(outcome in (expected[name], "undecided") for name, outcome in found.items()):
                how = "undecided"
            else:
                how = "WRONG: " + str({n: o for n, o in found.items() if o not in (expected[n], "undecided")})
            wrong += how.startswith(("WRONG", "left", "no report,"))
            counts[kind][how] += 1
    for kind, hows in counts.items():
        print(kind.ljust(12), ", ".join(f"{count} {how}" for how, count in hows.most_common()))
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
