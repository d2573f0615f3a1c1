"""Grades short-lived and re-connecting programs again and again, and compares the reports byte by byte.

Usage: python benchmarks/short_lived.py [RUNS] [--load] [NAME...]

RUNS (20) of each program; with --load two busy loops per core run during the second half. A rubric beside the files of
a program is used, and otherwise the exercise that the files belong to.
"""

from __future__ import annotations

import collections
import hashlib
import json
import multiprocessing
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
GRADE = str(Path(sys.executable).with_name("grade"))


def burn() -> None:
    """Use a processor for ever."""
    while True:
        pass


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
    numbers = [int(word) for word in sys.argv[1:] if word.isdecimal()]
    names = [word for word in sys.argv[1:] if not word.isdecimal() and word != "--load"]
    runs = numbers[0] if numbers else 20
    folders = sorted(f for f in (HERE / "short_lived").iterdir() if f.is_dir() and (not names or f.name in names))
    seen: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    loops = [multiprocessing.Process(target=burn, daemon=True) for _ in range(2 * multiprocessing.cpu_count())]
    for run in range(runs):
        if "--load" in sys.argv and run == runs // 2:
            for loop in loops:
                loop.start()
        for folder in folders:
            seen[folder.name][outcome(folder)] += 1
    for loop in loops:
        if loop.is_alive():
            loop.kill()
    for name, found in seen.items():
        print(f"{name:28} {'identical' if len(found) == 1 else 'DIFFERENT'} {dict(found)}", flush=True)


if __name__ == "__main__":
    main()
