"""Measures what it costs to grade a class: submissions a minute, processor seconds and memory, by kind, jobs and size.

Usage: python benchmarks/class_of_100.py [--quick]

Makes classes of 25 and 100 of the samples that the tests know (--quick: 4 and 8), each submission with all four files
of the chapter: most are correct, some wrong, few broken or hostile. Grades them with `grade batch`, with one and with
two jobs. What a submission of one kind costs is measured on classes of that kind alone. Run it on an idle machine.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from counting import counted, counts

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "tests" / "support"))
from sample_folders import folders_in  # where the test submissions are

GRADE = str(Path(sys.executable).with_name("grade"))
REFERENCE = ROOT / "reference_solutions"
FILES = ("velocity_publisher.py", "odom_subscriber.py", "temperature_sensor.py", "fan_controller.py")
#: What a class consists of, in percent.
SHARES = {"correct": 55, "wrong": 27, "broken": 13, "hostile": 5}
SEED = 20
#: How often the memory of all processes is looked at.
PAUSE_S = 0.25


@dataclass(frozen=True)
class Cost:
    """What one run of `grade batch` took.

    Attributes:
        count: Submissions.
        jobs: Submissions at a time.
        took_s: Real time.
        processor_s: Processor time of all its processes.
        peak_mib: Most memory that all of them held at once, shared pages counted once.
    """

    count: int
    jobs: int
    took_s: float
    processor_s: float
    peak_mib: float

    def row(self, what: str) -> str:
        """Return a line of the table."""
        per_minute, each_s = 60 * self.count / self.took_s, self.processor_s / self.count
        memory = f"{self.peak_mib:6.0f} MiB, {self.peak_mib / self.jobs:5.0f} a job"
        return f"{what:<16} {self.count:>5} {self.jobs:>5} {per_minute:>12.1f} {each_s:>14.2f} s   {memory}"


def samples() -> Mapping[str, Sequence[Mapping[str, Path]]]:
    """Return kind -> the samples of it, each as file name -> file that replaces the reference solution's."""
    found: dict[str, list[Mapping[str, Path]]] = {}
    for kind in ("correct", "wrong", "broken"):
        given = ({name: folder / name for name in FILES if (folder / name).is_file()} for folder in folders_in(kind))
        found[kind] = [files for files in given if files]
    hostile = sorted((ROOT / "tests" / "attacks" / "nodes").glob("a*.py"))
    return {**found, "hostile": [{"velocity_publisher.py": path} for path in hostile]}


def kinds(count: int) -> Iterator[str]:
    """Yield the kind of each submission of a class, in the shares of `SHARES`."""
    due = dict.fromkeys(SHARES, 0.0)
    for _ in range(count):
        due = {kind: owed + SHARES[kind] for kind, owed in due.items()}
        chosen = max(due, key=lambda kind: due[kind])
        due[chosen] -= 100
        yield chosen


def make_class(folder: Path, wanted: Sequence[str], seed: int = SEED) -> None:
    """Write one submission of each kind wanted; no two have the same files."""
    chance, known = random.Random(seed), samples()
    for number, kind in enumerate(wanted):
        student = folder / f"{number:03}_{kind}"
        student.mkdir(parents=True)
        files = {**{name: REFERENCE / name for name in FILES}, **chance.choice(known[kind])}
        for name, source in files.items():
            (student / name).write_bytes(source.read_bytes() + f"\n# student {number}\n".encode())


def cost_of(submissions: Path, jobs: int) -> Cost:
    """Grade a class and return what that took; its results are thrown away."""
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as results:
        written = Path(results) / "counts"
        folder = str(Path(results) / "class")
        command = [GRADE, "batch", str(submissions), "-o", folder, "--jobs", str(jobs), "--no-progress"]
        with subprocess.Popen(
            counted(command, written), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        ) as batch:
            memory = Memory(batch.pid)
            said = batch.communicate()[1]
            peak_mib = memory.stop()
        took_s = time.perf_counter() - started
        if batch.returncode not in (0, 1, 3):
            raise SystemExit(f"grade batch ended with {batch.returncode}: {said}")
        processor_s = counts(written).processor_s
    return Cost(len(list(submissions.iterdir())), jobs, took_s, processor_s, peak_mib)


class Memory:
    """Adds up, repeatedly, the memory of a process and of all that it started.

    Args:
        pid: Process id.
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._peak_kib = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    def stop(self) -> float:
        """Return the most that was seen, in MiB."""
        self._ended.set()
        self._thread.join()
        return self._peak_kib / 1024

    def _watch(self) -> None:
        while not self._ended.wait(PAUSE_S):
            self._peak_kib = max(self._peak_kib, sum(map(resident_kib, descendants(self._pid))))


def descendants(pid: int) -> list[int]:
    """Return a process and everything below it."""
    parents = {int(name): parent_of(int(name)) for name in os.listdir("/proc") if name.isdecimal()}  # noqa: PTH208  names are wanted
    found, fresh = [pid], {pid}
    while fresh:
        fresh = {child for child, parent in parents.items() if parent in fresh}
        found += sorted(fresh)
    return found


def parent_of(pid: int) -> int:
    """Return the parent of a process, 0 if it has gone."""
    try:
        return int(Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rsplit(")", 1)[1].split()[1])
    except (OSError, IndexError, ValueError):
        return 0


def resident_kib(pid: int) -> int:
    """Return the memory of a process, its part of shared pages included; 0 if it has gone."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) for line in lines if line.startswith("Pss:")), 0)


def main() -> None:
    """Print the table."""
    quick = "--quick" in sys.argv[1:]
    small, large = (4, 8) if quick else (25, 100)
    alone = 2 if quick else 12
    print(f"{'class':<16} {'size':>5} {'jobs':>5} {'a minute':>12} {'processor each':>16}   peak memory")
    with tempfile.TemporaryDirectory() as folder:
        for kind in SHARES:
            place = Path(folder) / kind
            make_class(place, [kind] * alone)
            print(cost_of(place, 1).row(f"{kind} alone"), flush=True)
        for size in (small, large):
            place = Path(folder) / str(size)
            make_class(place, list(kinds(size)))
            for jobs in (1, 2):
                print(cost_of(place, jobs).row("mixed"), flush=True)
            shutil.rmtree(place)


if __name__ == "__main__":
    main()
