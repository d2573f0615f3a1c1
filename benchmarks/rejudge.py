"""Measures how fast kept evidence is judged again: submissions per second and core, and where the time goes.

Usage: python benchmarks/rejudge.py [COPIES] [EVIDENCE...]

Copies evidence until there are COPIES folders (200): of the named folders in turn, or of the reference solutions, which
are then graded first. Judges all of them in one process, then as `grade rejudge` does over all cores. Run it on
an idle machine: on a busy one the least time says most.
"""

from __future__ import annotations

import cProfile
import os
import pstats
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from grader.grading.app import rejudge

ROOT = Path(__file__).resolve().parent.parent
GRADE = str(Path(sys.executable).with_name("grade"))
SLOWEST = 12


def kept(into: Path) -> list[Path]:
    """Grade the reference solutions and return their evidence."""
    command = [GRADE, "reference_solutions", "-o", f"evidence={into}", "-o", "json=/dev/null"]
    subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
    return [into]


def main() -> None:
    """Print the measurements."""
    copies = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    with tempfile.TemporaryDirectory() as folder:
        sources = [Path(name) for name in sys.argv[2:]] or kept(Path(folder) / "first")
        members = Path(folder) / "class"
        for number in range(copies):
            shutil.copytree(sources[number % len(sources)], members / f"{number:05}")
        measure(members)


def processor_s(one: tuple[str, Path], how: rejudge.Judgement, wanted: rejudge.Wanted) -> float:
    """Return the processor time that one submission takes, start-up left out."""
    started = time.process_time()
    rejudge.rejudge_class([one], how, wanted, jobs=1)
    return time.process_time() - started


def measure(members: Path) -> None:
    """Judge a class in several ways."""
    named = rejudge.named_evidence([members])
    how = rejudge.judgement((), ())
    wanted = rejudge.Wanted()
    rejudge.rejudge_class(named[:5], how, wanted, jobs=1)
    used = [processor_s(one, how, wanted) for one in named]
    print(f"processor time of one: median {1e3 * statistics.median(used):.1f} ms, least {1e3 * min(used):.1f} ms")
    for jobs in dict.fromkeys((1, len(os.sched_getaffinity(0)))):
        started, before = time.perf_counter(), time.process_time()
        results = rejudge.rejudge_class(named, how, wanted, jobs=jobs)
        took, processor = time.perf_counter() - started, time.process_time() - before
        assert not any(result.problem for result in results), results
        print(f"{jobs} process(es): {len(named) / took:.0f} submissions/s", end="")
        print(f", {len(named) / processor:.0f} per second of processor time" if jobs == 1 else "")
    started = time.perf_counter()
    subprocess.run([GRADE, "rejudge", str(members)], stdout=subprocess.DEVNULL, check=False)
    print(f"grade rejudge, start included: {len(named) / (time.perf_counter() - started):.0f} submissions/s")
    with cProfile.Profile() as profile:
        rejudge.rejudge_class(named[:50], how, wanted, jobs=1)
    pstats.Stats(profile).sort_stats("tottime").print_stats(SLOWEST)


if __name__ == "__main__":
    main()
