"""Grades one submission again and again as the first, the middle and the last of a class, and compares the reports.

Usage: python benchmarks/identical.py [RUNS] [SUBMISSION]      300 runs of reference_solutions unless told otherwise

A class is graded by one job, which keeps its workers and starters; between the three are others of all kinds, also
hostile ones. While one of these waits on the wall clock, the next is graded in another process. What is compared are
the report and what students and platforms get, byte by byte, without the duration, and with one name for all. The exit
code is 1 if two differ; the first two that do are kept and named.
"""

from __future__ import annotations

import hashlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from class_of_100 import GRADE, REFERENCE, SHARES, make_class

POSITIONS = ("first", "middle", "last")
#: What is compared, and the values in it that tell how long grading took.
FILES = ("report.json", "feedback.json", "gradescope.json")
DURATIONS = re.compile(r'(^  "(?:duration_s|execution_time)": |graded PLACE/class/NAME in )[0-9.]+', re.MULTILINE)
SEED = 7


def main() -> int:
    """Print how often each report came, and return 1 if there is more than one."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    submission = Path(sys.argv[2]) if len(sys.argv) > 2 else REFERENCE
    chance = random.Random(SEED)
    seen: dict[str, Counter[str]] = {}
    between = Counter[str]()
    for number in range(-(-runs // len(POSITIONS))):
        kinds = chance.choices(list(SHARES), k=len(POSITIONS) - 1)
        between.update(kinds)
        for position, text in reports(submission, kinds, seed=number).items():
            seen.setdefault(text, Counter())[position] += 1
        print(f"class {number + 1}: {len(seen)} different reports", file=sys.stderr, flush=True)
    print(f"{sum(count.total() for count in seen.values())} runs of {submission.name}, beside {dict(between)}")
    for text, count in seen.items():
        print(hashlib.sha256(text.encode()).hexdigest()[:12], dict(count))
    identical = len(seen) == 1 and "" not in seen
    print("identical" if identical else f"DIFFERENT: {kept(list(seen)[:2])}")
    return 0 if identical else 1


def reports(submission: Path, others: list[str], *, seed: int) -> dict[str, str]:
    """Grade a class with a submission at three positions and others of these kinds between, and return its reports."""
    with tempfile.TemporaryDirectory() as place:
        submissions, results = Path(place) / "class", Path(place) / "results"
        for number, position in enumerate(POSITIONS):
            shutil.copytree(submission, submissions / f"{number}_{position}")
        make_class(Path(place) / "others", others, seed=seed)
        for number, folder in enumerate(sorted((Path(place) / "others").iterdir())):
            folder.rename(submissions / f"{number}_then_{folder.name}")
        options = ["-o", str(results), "--jobs", "1", "--seed", "1", "--spot-checks", "0%", "--no-progress"]
        done = subprocess.run([GRADE, "batch", str(submissions), *options], check=False, capture_output=True, text=True)
        if done.returncode not in (0, 1, 3):
            raise SystemExit(f"grade batch ended with {done.returncode}: {done.stderr}")
        order = sorted(results.glob("students/*/result.json"), key=lambda path: path.stat().st_mtime_ns)
        names = [name for path in order if (name := path.parent.name)[2:] in POSITIONS]
        assert names == sorted(names), f"graded in another order: {names}"
        return {name[2:]: content(results / "students" / name, place) for name in names}


def content(folder: Path, place: str) -> str:
    """Return what is compared of a result; empty if there is no report."""
    texts = [(folder / name).read_text(encoding="utf-8") for name in FILES if (folder / name).exists()]
    return DURATIONS.sub(r"\1TIME", "\n".join(texts).replace(place, "PLACE").replace(folder.name, "NAME"))


def kept(texts: list[str]) -> str:
    """Write texts into files and return their paths."""
    folder = Path(tempfile.mkdtemp(prefix="identical-"))
    for number, text in enumerate(texts):
        (folder / str(number)).write_text(text, encoding="utf-8")
    return " ".join(str(path) for path in sorted(folder.iterdir()))


if __name__ == "__main__":
    sys.exit(main())
