"""Grades a submission repeatedly, kills one of the grader's processes each time, and compares the reports.

Usage: python benchmarks/killing.py [RUNS] [SUBMISSION | --class]

200 runs of reference_solutions unless told otherwise; --class grades a class of three with `grade batch` and two jobs.

The process is drawn from one kind at a time: the grader, a worker, a starter, a student's process, bubblewrap, or a job
of a class, at a moment that is drawn from the time that a grading takes. A criterion has to have its usual outcome or
be undecided, or the student's result is marked as failed. No process and no temporary folder may stay, but that of a
killed grader or job until the next grading, and for a minute if it is empty. The same command, which goes on with a
class, has to complete it.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import ctypes
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from grader.runtime.temp_dirs import FRESH_S, sweep
from grader.runtime.usage import families

ROOT = Path(__file__).resolve().parent.parent
GRADE = str(Path(sys.executable).with_name("grade"))
KINDS = ("grader", "worker", "starter", "student", "bubblewrap")
REFERENCE = ROOT / "reference_solutions"
STARTS_STARTER = "grader.runtime.worker.worker_main"
MODULES = {STARTS_STARTER: "worker", "grader.course.classroom.worker": "job"}
#: Kinds that remove their temporary folder themselves; after a kill, the next grading does it.
SWEPT = ("grader", "job")
#: Outcomes that cost no student anything, and the beginnings of the words about a grading that ended wrongly.
HARMLESS, BAD = ("undecided", "failed"), ("WRONG", "left", "no report,", "going on")
#: Seconds until a grading must have ended, and until its processes must have.
GRADED_S, GONE_S = 300.0, 20.0
SET_CHILD_SUBREAPER = 36  # linux/prctl.h


def kind_of(pid: int, grader: int) -> str:
    """Return the kind of a process; empty for helpers, and if it has ended."""
    if pid == grader:
        return "grader"
    with contextlib.suppress(OSError, UnicodeDecodeError):
        words = words_of(pid)
        if Path(words[0]).name == "bwrap":
            return "bubblewrap"
        if is_of_starter(words):
            # Its forks keep its words: those that start students' processes, these, and what deletes their folders.
            above = words_of(parent_of(pid))
            return "student" if is_of_starter(above) else "starter" if STARTS_STARTER in above else ""
        if any(word.endswith("/launcher.py") for word in words):
            return "student"
        return next((kind for module, kind in MODULES.items() if module in words), "")
    return ""


def words_of(pid: int) -> list[str]:
    """Return the command line of a process; raises OSError if it has ended."""
    return Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")


def is_of_starter(words: list[str]) -> bool:
    """Return whether a command line is that of a starter, or of a fork of it."""
    return any(word.endswith("/starter.py") for word in words)


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


class Single:
    """The grading of one submission, which prints its report."""

    kinds = KINDS

    def __init__(self, submission: str) -> None:
        self.command = [GRADE, submission, "--json"]
        self._printed = b""

    def take(self, printed: bytes) -> None:
        """Take what the command has printed."""
        self._printed = printed

    def outcomes(self) -> dict[str, str] | None:
        """Return the outcome of each criterion; None if there is no report."""
        return outcomes(self._printed)

    def settle(self, expected: dict[str, str]) -> str:
        """Return what is wrong about going on after a kill; there is nothing to go on with."""
        del expected
        return ""

    def begin(self) -> None:
        """Forget the grading before."""
        self._printed = b""


class WholeClass:
    """The grading of a class by two jobs: two right submissions and a wrong one.

    Args:
        place: A folder for the class and its results.
    """

    kinds = (*KINDS, "job")

    def __init__(self, place: Path) -> None:
        self._results = place / "results"
        for number, source in enumerate((REFERENCE, ROOT / "benchmarks" / "wrong", REFERENCE)):
            student = place / "class" / f"student_{number}"
            shutil.copytree(source, student)
            with (student / "velocity_publisher.py").open("a", encoding="utf-8") as file:
                file.write(f"# student {number}\n")
        options = ["--jobs", "2", "--seed", "1", "--spot-checks", "0%", "--no-progress"]
        self.command = [GRADE, "batch", str(place / "class"), "-o", str(self._results), *options]
        self._count = 3

    def begin(self) -> None:
        """Forget the results before."""
        shutil.rmtree(self._results, ignore_errors=True)

    def take(self, printed: bytes) -> None:
        """Take what the command has printed, which is for people."""

    def outcomes(self) -> dict[str, str] | None:
        """Return the outcome of each criterion of each student, and `failed` for one who has none; None without all."""
        found, told = {}, list(self._results.glob("students/*/result.json"))
        for result in told:
            report = result.with_name("report.json")
            own = outcomes(report.read_bytes()) if report.exists() else None
            own = {"all": json.loads(result.read_bytes())["state"]} if own is None else own
            found.update({f"{result.parent.name}: {name}": outcome for name, outcome in own.items()})
        return found if len(told) == self._count else None

    def settle(self, expected: dict[str, str]) -> str:
        """Go on as an instructor would, and return what is wrong about the results then; empty if nothing is."""
        done = subprocess.run([*self.command, "--rerun", "undecided"], cwd=ROOT, capture_output=True, check=False)
        found = self.outcomes()
        return "" if found == expected else f"going on did not help, exit code {done.returncode}"


def graded(grading: Single | WholeClass, scratch: str, kind: str = "", delay_s: float = 0.0) -> tuple[int, float, bool]:
    """Grade once and kill a process; return the exit code, the seconds, and whether one was killed."""
    grading.begin()
    began, killed = time.monotonic(), False
    with subprocess.Popen(
        grading.command,
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
        printed, _ = process.communicate(timeout=GRADED_S)
    grading.take(printed)
    return process.returncode, time.monotonic() - began, killed


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


def ending(grading: Single | WholeClass, expected: dict[str, str], kind: str, code: int, *, killed: bool) -> str:
    """Return how a grading ended, in words; those of `BAD` if it must not end like that."""
    found = grading.outcomes()
    if not killed:
        return "ended before the kill"
    if found is None:
        by_kill = kind == "grader" and code == -signal.SIGKILL
        return "no report" if by_kill else f"no report, exit code {code}"
    if found == expected:
        return "the usual report"
    wrong = {name: outcome for name, outcome in found.items() if outcome not in (expected.get(name), *HARMLESS)}
    return f"WRONG: {wrong}" if wrong else "failed" if "failed" in found.values() else "undecided"


def main() -> None:
    """Print how gradings ended by the kind of process that was killed; exit code 1 if one ended wrongly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=int, nargs="?", default=200)
    parser.add_argument("submission", nargs="?", default=str(REFERENCE))
    parser.add_argument("--class", action="store_true", dest="of_class")
    arguments = parser.parse_args()
    ctypes.CDLL(None).prctl(SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    wrong = 0
    counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    with tempfile.TemporaryDirectory() as scratch, tempfile.TemporaryDirectory() as place:
        grading = WholeClass(Path(place)) if arguments.of_class else Single(arguments.submission)
        graded(grading, scratch)
        _, seconds, _ = graded(grading, scratch)
        expected = grading.outcomes()
        assert expected, "the grading without a kill has no report"
        for run in range(arguments.runs):
            kind = grading.kinds[run % len(grading.kinds)]
            code, _, killed = graded(grading, scratch, kind, random.uniform(0, seconds))
            how, left = ending(grading, expected, kind, code, killed=killed), left_over()
            if kind in SWEPT:
                sweep(Path(scratch))  # as the next grading does
            folders = [path.name for path in Path(scratch).iterdir() if any(path.iterdir())]
            if left or folders:
                how = f"left {left or folders}"
            elif how in ("no report", "failed", "undecided"):
                how = grading.settle(expected) or how
            wrong += how.startswith(BAD)
            counts[kind][how] += 1
        time.sleep(FRESH_S)
        sweep(Path(scratch))
        if folders := [path.name for path in Path(scratch).iterdir()]:
            print(f"left {folders} for longer than {FRESH_S:.0f} s")
            wrong += 1
    for kind, hows in counts.items():
        print(kind.ljust(12), ", ".join(f"{count} {how}" for how, count in hows.most_common()))
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
