"""Grades short-lived and re-connecting programs repeatedly, and compares the reports byte by byte.

Usage: python benchmarks/short_lived.py [--load] [--jobs N] [--clock CLOCK] [RUNS [NAME...]]

RUNS (20) of each program, JOBS at a time, all in one session; with --load two busy loops per core run during the
second half. A rubric beside the files of a program is used, and otherwise the exercise that the files belong to.
"""

from __future__ import annotations

import argparse
import collections
import hashlib
import json
import multiprocessing
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from agreement import busy, print_nothing

from grader.grading.app.grade import grade_in
from grader.grading.app.request import GradeRequest
from grader.grading.reporting.json_report import report_to_json
from grader.runtime.session import RecordingSession, open_session

HERE = Path(__file__).resolve().parent


def outcome(session: RecordingSession, folder: Path, clock: str) -> str:
    """Return the score, the criteria that are not met, and a digest of the JSON report with no duration."""
    rubric = folder / "rubric.yaml"
    rubrics = (rubric,) if rubric.exists() else ()
    request = GradeRequest(str(folder), every=not rubrics, rubrics=rubrics, clock=clock)
    report: dict[str, Any] = {**report_to_json(grade_in(session, request, print_nothing)), "duration_s": 0.0}
    verdicts = [c for exercise in report["exercises"] for c in exercise["criteria"]]
    lost = " ".join(f"{c['id']}={c['outcome']}" for c in verdicts if c["outcome"] != "met")
    digest = hashlib.sha256(json.dumps(report).encode()).hexdigest()[:12]
    return f"{report['score']}/{report['max_score']} {lost} {digest}"


def main() -> None:
    """Print one row for each program: how often each report came."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="?", type=int, default=20, metavar="RUNS")
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--load", action="store_true")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--clock", default="auto")
    arguments = parser.parse_args()
    runs, names = arguments.runs, arguments.names
    folders = sorted(f for f in (HERE / "short_lived").iterdir() if f.is_dir() and (not names or f.name in names))
    seen: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    quiet = runs - runs // 2 if arguments.load else runs
    for count, load in ((quiet, False), (runs - quiet, True)):
        with (
            busy(2 * multiprocessing.cpu_count() if load else 0),
            open_session("auto", arguments.jobs) as session,
            ThreadPoolExecutor(arguments.jobs) as pool,
        ):
            several = folders * count
            reports = pool.map(lambda folder: outcome(session, folder, arguments.clock), several)
            for folder, found in zip(several, reports, strict=True):
                seen[folder.name][found] += 1
    for name, counts in seen.items():
        print(f"{name:28} {'identical' if len(counts) == 1 else 'DIFFERENT'} {dict(counts)}", flush=True)


if __name__ == "__main__":
    main()
