"""Measures the memory of one job: of the grader and everything that it starts, by process and over a long class.

Usage: python benchmarks/memory.py [SUBMISSIONS]      a class of 300 unless told otherwise

Memory is the proportional set size, which counts shared pages once. It is looked at four times a second, for `grade`
with the reference solutions, and for `grade batch` with one job and a mixed class; the grader of a class serves all
jobs and counts for none. No submission is drawn for a spot check, because a second one would be graded beside it.
Whether memory stays flat is asked of grader and job, in the first and in the last third. The exit code is 1 if it does
not, or if a job takes too much; what hostile submissions take is their own.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from class_of_100 import GRADE, PAUSE_S, REFERENCE, descendants, kinds, make_class, resident_kib
from killing import kind_of

#: Memory that one job may take at most, and that the grader's processes may gain over a class, in MiB.
MOST_MIB, SLACK_MIB = 350, 16
#: Processes that live as long as the class.
LASTING = ("grader", "job")


@dataclass(frozen=True)
class Look:
    """The memory at one moment.

    Attributes:
        done: How many submissions have been graded.
        mib: The memory by kind of process.
        counts: The number of processes by kind.
    """

    done: int
    mib: Mapping[str, float]
    counts: Mapping[str, int]

    @property
    def jobs(self) -> int:
        """Submissions that are being graded; a second one is begun beside one that waits for the wall clock."""
        return self.counts["job"]

    @property
    def job_mib(self) -> float:
        """The memory of the processes below the grader of a class."""
        return self.total_mib - self.mib.get("grader", 0.0)

    @property
    def total_mib(self) -> float:
        """The memory of all processes."""
        return sum(self.mib.values())

    def words(self) -> str:
        """Return the memory in words, the largest part first."""
        parts = sorted(self.mib.items(), key=lambda part: -part[1])
        return f"{self.total_mib:.0f} MiB: " + ", ".join(f"{self.counts[kind]} {kind} {mib:.0f}" for kind, mib in parts)


def watched(command: Sequence[str], done: Callable[[], int]) -> list[Look]:
    """Run a command and look at its memory until it ends."""
    looks: list[Look] = []
    ended = threading.Event()
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:

        def watch() -> None:
            while not ended.wait(PAUSE_S):
                looks.append(look(process.pid, done()))

        thread = threading.Thread(target=watch)
        thread.start()
        said = process.communicate()[1]
        ended.set()
        thread.join()
    if process.returncode not in (0, 1, 3):
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}: {said}")
    return looks


def look(pid: int, done: int) -> Look:
    """Return the memory of a process and of everything below it."""
    mib: dict[str, float] = {}
    found = Counter[str]()
    for each in descendants(pid):
        kind = kind_of(each, pid) or "others"
        mib[kind] = mib.get(kind, 0.0) + resident_kib(each) / 1024
        found[kind] += 1
    return Look(done, mib, found)


def of_class(count: int, place: Path) -> bool:
    """Grade a class, print its memory, and return whether it is too much or grows."""
    submissions, results = place / "class", place / "results"
    make_class(submissions, list(kinds(count)))
    order = sorted(path.name for path in submissions.iterdir())
    options = ["-o", str(results), "--jobs", "1", "--spot-checks", "0%", "--no-progress"]
    looks = watched(
        [GRADE, "batch", str(submissions), *options], lambda: len(list(results.glob("students/*/result.json")))
    )
    ordinary = [look for look in looks if not order[min(look.done, count - 1)].endswith("_hostile")]
    alone, beside = ([look for look in ordinary if (look.jobs > 1) is more] for more in (False, True))
    largest = max(alone, key=lambda look: look.total_mib)
    print(f"class of {count}, one job: {largest.job_mib:.0f} MiB, with the grader {largest.words()}")
    if beside:
        print(f"  with two submissions at once, with the grader {max(beside, key=lambda look: look.total_mib).words()}")
    if hostile := [look for look in looks if look not in ordinary]:
        print(f"  hostile submissions, with the grader {max(hostile, key=lambda look: look.total_mib).words()}")
    first, last = (lasting([look for look in alone if part[0] <= look.done < part[1]]) for part in thirds(count))
    print(f"  grader and job: {first:.0f} MiB in the first third, {last:.0f} MiB in the last")
    return largest.job_mib > MOST_MIB or last > first + SLACK_MIB


def thirds(count: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the first and the last third of a class, by the numbers of submissions that are done."""
    return (1, 1 + count // 3), (count - count // 3, count)


def lasting(looks: Sequence[Look]) -> float:
    """Return the median memory of the processes that live as long as the class."""
    return statistics.median(sum(look.mib.get(kind, 0.0) for kind in LASTING) for look in looks)


def main() -> int:
    """Print the memory of one submission and of a class, and return 1 if it is too much."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    one = max(watched([GRADE, str(REFERENCE)], lambda: 0), key=lambda look: look.total_mib)
    print(f"grade reference_solutions: {one.words()}", flush=True)
    with tempfile.TemporaryDirectory() as place:
        grows = of_class(count, Path(place))
    print(f"at most {MOST_MIB} MiB for one job and {SLACK_MIB} MiB gained:", "no" if grows else "yes")
    return int(grows or one.total_mib > MOST_MIB)


if __name__ == "__main__":
    sys.exit(main())
