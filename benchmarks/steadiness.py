"""Grades one correct and one wrong submission repeatedly, half of the time under load, and compares the reports.

Usage: python benchmarks/steadiness.py [RUNS]      RUNS (40) of each; two busy loops per core during the second half
"""

from __future__ import annotations

import collections
import hashlib
import json
import multiprocessing
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GRADE = str(Path(sys.executable).with_name("grade"))


def burn() -> None:
    """Use a processor forever."""
    while True:
        pass


def fingerprint(submission: str) -> str:
    """Return a digest of the JSON report without its duration, and the score."""
    command = [GRADE, submission, "--json"]
    report = json.loads(subprocess.run(command, check=False, stdout=subprocess.PIPE, cwd=ROOT).stdout)
    report.pop("duration_s")
    digest = hashlib.sha256(json.dumps(report).encode()).hexdigest()[:12]
    return f"{report['score']}/{report['max_score']} {digest}"


def main() -> None:
    """Print how often each report came."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    seen: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    loops = [multiprocessing.Process(target=burn, daemon=True) for _ in range(2 * multiprocessing.cpu_count())]
    for run in range(runs):
        if run == runs // 2:
            for loop in loops:
                loop.start()
        for submission in ("reference_solutions", "benchmarks/wrong"):
            seen[submission][fingerprint(submission)] += 1
    for loop in loops:
        loop.kill()
    for submission, prints in seen.items():
        print(submission, "identical" if len(prints) == 1 else "DIFFERENT", dict(prints))


if __name__ == "__main__":
    main()
