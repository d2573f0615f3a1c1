"""Measures what spot checks cost a class of correct submissions: real time, processor seconds, and points lost.

Usage: python benchmarks/class_checks.py [--count N] [--jobs N] [SHARE...]

Grades N copies of the reference solutions (40), no two with the same bytes, with `grade batch --spot-checks SHARE` for
each share; by default 0% and 100%. Prints a line for each, and the submissions that lost points or were judged on the
wall clock, of which there should be none. The exit code is 1 if there are any. Run it on an idle machine.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from counting import counted, counts

ROOT = Path(__file__).resolve().parent.parent
GRADE = str(Path(sys.executable).with_name("grade"))
REFERENCE = ROOT / "reference_solutions"
FILES = ("velocity_publisher.py", "odom_subscriber.py", "temperature_sensor.py", "fan_controller.py")


def make_class(folder: Path, count: int) -> None:
    """Write so many copies of the reference solutions, each with another comment at its end."""
    for number in range(count):
        student = folder / f"student_{number:03}"
        student.mkdir(parents=True)
        for name in FILES:
            (student / name).write_bytes((REFERENCE / name).read_bytes() + f"\n# student {number}\n".encode())


def run(submissions: Path, share: str, jobs: int) -> int:
    """Grade a class, print what that took, and return how many submissions were not judged as they should be."""
    with tempfile.TemporaryDirectory() as scratch:
        results, written = Path(scratch) / "class", Path(scratch) / "counts"
        options = ["-o", str(results), "--jobs", str(jobs), "--no-progress", "--spot-checks", share]
        command = counted([GRADE, "batch", str(submissions), *options], written)
        started = time.perf_counter()
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
        took_s = time.perf_counter() - started
        if done.returncode not in (0, 1, 3):
            raise SystemExit(f"grade batch ended with {done.returncode}: {done.stderr}")
        reports = {path.parent.name: json.loads(path.read_text()) for path in results.glob("students/*/report.json")}
        each_s = counts(written).processor_s / len(reports)
    print(f"{share:>5} checked: {len(reports)} submissions in {took_s:.0f} s, {each_s:.2f} processor seconds each")
    wrong = 0
    for name, report in sorted(reports.items()):
        reasons = [e["clock_reason"] for e in report["exercises"] if e["clock"] == "wall"]
        notes = [note for e in report["exercises"] for note in e.get("notes", ()) if "wall clock" in note]
        if report["score"] != report["max_score"] or reasons:
            wrong += 1
            print(f"  {name}: {report['score']} of {report['max_score']}; {'; '.join(reasons)}")
        for note in notes:
            print(f"  {name}: {note}")
    return wrong


def main() -> int:
    """Grade the class with each share."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("shares", nargs="*", default=["0%", "100%"])
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        submissions = Path(folder) / "handed_in"
        make_class(submissions, given.count)
        return 1 if sum(run(submissions, share, given.jobs) for share in given.shares) else 0


if __name__ == "__main__":
    sys.exit(main())
