"""Grades ten programs near the thresholds of virtual time repeatedly, half of the time under load.

Usage: python benchmarks/thresholds.py [RUNS] [--jobs N] [--only NAME] [--out FILE]
       RUNS (100) of each program, so many at a time (6); two busy loops per core during the second half

The programs are in benchmarks/thresholds/, with what they do in their first lines, and a rubric of their own, which
watches them for three seconds. A program may be recorded on either clock, but has to get the same outcome each time.
Prints how often each outcome came; the exit code is 1 if a program got several.
"""

from __future__ import annotations

import argparse
import collections
import hashlib
import json
import multiprocessing
import re
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from agreement import busy, print_nothing

from grader.grading.app.grade import grade_in
from grader.grading.app.request import GradeRequest
from grader.runtime.files import write_whole
from grader.runtime.model.errors import GraderError
from grader.runtime.session import RecordingSession, open_session

HERE = Path(__file__).resolve().parent / "thresholds"
RUBRIC = HERE / "pace.yaml"
#: program -> whether it was under load -> (outcome, clock, why) -> how often
Seen = dict[str, dict[bool, collections.Counter[tuple[str, str, str]]]]


#: Iterations of the hash whose time is measured, so often; the shortest time is that of an idle processor.
TRIED, TRIES = 20_000, 50


def adapted(programs: list[str], folder: Path) -> None:
    """Copy the programs, with as many iterations a millisecond as this machine needs."""
    times = []
    for _ in range(TRIES):
        began = time.process_time()
        hashlib.pbkdf2_hmac("sha256", b"x", b"y", TRIED)
        times.append(time.process_time() - began)
    per_ms = round(TRIED / min(times) / 1000)
    for program in programs:
        text = (HERE / program / "pace.py").read_text(encoding="utf-8")
        (folder / program).mkdir()
        (folder / program / "pace.py").write_text(re.sub(r"(?m)^PER_MS = .*$", f"PER_MS = {per_ms}", text))


def outcome(session: RecordingSession, submission: Path) -> tuple[str, str, str]:
    """Grade one program; return the outcome, the clock that it was judged on, and why it was that, or what failed."""
    request = GradeRequest(str(submission), rubrics=(RUBRIC,))
    try:
        report = grade_in(session, request, print_nothing)
    except GraderError as fault:
        return "error", "none", fault.message
    exercise = report.exercises[0]
    (verdict,) = exercise.verdicts
    why = exercise.clock_reason or "; ".join(exercise.notes)
    return verdict.outcome.value, exercise.clock.value, why


def rounds(folder: Path, runs: int, seen: Seen, given: argparse.Namespace, *, loaded: bool) -> None:
    """Grade every program in a folder so often, several at a time."""
    jobs, out = given.jobs, given.out
    loops = 2 * multiprocessing.cpu_count() if loaded else 0
    with open_session("auto", jobs) as session, busy(loops), ThreadPoolExecutor(jobs) as pool:
        todo = [program for _ in range(runs) for program in seen]
        for program, found in zip(todo, pool.map(lambda one: outcome(session, folder / one), todo), strict=True):
            seen[program][loaded][found] += 1
            if out is not None:
                write_whole(out, dumps(seen))


def dumps(seen: Seen) -> bytes:
    """Return what was seen as JSON."""
    rows = [
        {"program": program, "loaded": loaded, "outcome": one[0], "clock": one[1], "why": one[2], "times": times}
        for program, by_load in seen.items()
        for loaded, counts in by_load.items()
        for one, times in counts.items()
    ]
    return json.dumps(rows, indent=1).encode()


def table(seen: Seen) -> int:
    """Print every outcome of each program with its clocks; return 1 if one has several."""
    several = 0
    for program, by_load in seen.items():
        outcomes = {one[0] for counts in by_load.values() for one in counts}
        several += len(outcomes) > 1
        print(f"{program}: {len(outcomes)} {'outcome' if len(outcomes) == 1 else 'OUTCOMES'}")
        for loaded, counts in by_load.items():
            for (result, clock, why), times in sorted(counts.items()):
                print(f"  {times:4} {result:8} {clock:8} {'under load' if loaded else 'idle':10} {why}")
    print(f"{len(seen)} programs, {several} with several outcomes")
    return 1 if several else 0


def main() -> int:
    """Run and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=int, nargs="?", default=100)
    parser.add_argument("--jobs", type=int, default=6)
    parser.add_argument("--only", default="")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    programs = sorted(path.name for path in HERE.iterdir() if path.is_dir() and given.only in path.name)
    seen: Seen = {program: collections.defaultdict(collections.Counter) for program in programs}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        adapted(programs, folder)
        rounds(folder, given.runs - given.runs // 2, seen, given, loaded=False)
        rounds(folder, given.runs // 2, seen, given, loaded=True)
    return table(seen)


if __name__ == "__main__":
    sys.exit(main())
