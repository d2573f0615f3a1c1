"""Measures how fast grading is: the whole process, virtual against real seconds, and exercise 1 against the wall clock.

Usage: python benchmarks/speed.py [RUNS]      ratios and medians of RUNS runs (5) in one go; run it on an idle machine
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GRADE = [str(Path(sys.executable).with_name("grade"))]
#: Virtual seconds that the scenarios of the three exercises observe: 10 + 24 + 12.2 + 17 + 20.2.
OBSERVED_S = 10.0 + 24.0 + 12.2 + 17.0 + 20.2


def seconds(*arguments: str) -> float:
    """Return the wall time of one `grade` process."""
    started = time.perf_counter()
    subprocess.run([*GRADE, *arguments], check=True, stdout=subprocess.DEVNULL, cwd=ROOT)
    return time.perf_counter() - started


def main() -> None:
    """Print the measurements."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    whole = [seconds("reference_solutions") for _ in range(runs)]
    one = ["reference_solutions", "--exercise", "velocity_publisher"]
    five = [*one, "--rubric", str(ROOT / "benchmarks" / "five_seconds.yaml"), "--clock", "wall"]
    ratios = []
    for _ in range(runs):
        virtual, wall = seconds(*one), seconds(*five)
        ratios.append(wall / virtual)
    peak_mib = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    median = statistics.median(whole)
    print(f"grade reference_solutions: median {median:.2f} s of {', '.join(f'{s:.2f}' for s in whole)} s")
    print(f"virtual seconds observed / wall seconds: {OBSERVED_S / median:.1f}")
    print(f"exercise 1, wall clock with a 5 s window / virtual time with 10 s: median {statistics.median(ratios):.1f}")
    print(f"largest process: {peak_mib:.0f} MiB")


if __name__ == "__main__":
    main()
