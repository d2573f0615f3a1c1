"""Grades short-lived and re-connecting programs again and again, and compares the reports byte by byte.

Usage: python benchmarks/short_lived.py [--load] [--jobs N] [RUNS [NAME...]]

RUNS (20) of each program; with --load two busy loops per core run during the second half. A rubric beside the files of
a program is used, and otherwise the exercise that the files belong to.
"""

from __future__ import annotations

import argparse
import collections
import hashlib
import json
import multiprocessing
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from agreement import busy

HERE = Path(__file__).resolve().parent
GRADE = str(Path(sys.executable).with_name("grade"))


def outcome(folder: Path) -> str:
    """Return the score, the criteria that are not met, and a digest of the JSON report without its duration."""
    rubric = folder / "rubric.yaml"
    how = ["--rubric", str(rubric)] if rubric.exists() else ["--all"]
    command = [GRADE, f"short_lived/{folder.name}", *how, "--json"]
    report = json.loads(subprocess.run(command, check=False, stdout=subprocess.PIPE, cwd=HERE).stdout)
    report.pop("duration_s")
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
    arguments = parser.parse_args()
    runs, names = arguments.runs, arguments.names
    folders = sorted(f for f in (HERE / "short_lived").iterdir() if f.is_dir() and (not names or f.name in names))
    seen: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    quiet = runs - runs // 2 if arguments.load else runs
    for count, load in ((quiet, False), (runs - quiet, True)):
        with busy(2 * multiprocessing.cpu_count() if load else 0), ThreadPoolExecutor(arguments.jobs) as pool:
            several = folders * count
            for folder, found in zip(several, pool.map(outcome, several), strict=True):
                seen[folder.name][found] += 1
    for name, reports in seen.items():
        print(f"{name:28} {'identical' if len(reports) == 1 else 'DIFFERENT'} {dict(reports)}", flush=True)


if __name__ == "__main__":
    main()
