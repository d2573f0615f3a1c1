"""Grades many submissions in one process, a third of them hostile, and compares what is held before and after.

Usage: python benchmarks/soak.py [RUNS]       300 runs unless told otherwise; exit code 1 if anything stayed
"""

from __future__ import annotations

import ctypes
import gc
import itertools
import os
import random
import shutil
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "tests" / "attacks")]

from arena import Arena
from attack_rubric import publisher_rubric
from attack_runs import HERE, REFERENCE, Attack, read_attacks
from sample_folders import folders_in

from grader.grading.app.request import GradeRequest
from grader.grading.app.start import grade_once
from grader.runtime.model.errors import GraderError

NODE = "velocity_publisher"
#: Runs after which everything that is loaded once has been loaded, and that count for nothing.
WARM_UP = 15
#: Memory that may be gained over all runs, in MiB: allocators keep what they were once given.
SLACK_MIB = 16
TIER = "bubblewrap-root" if os.geteuid() == 0 else "bubblewrap"


@dataclass(frozen=True)
class Held:
    """What this process and its children hold, or have left on the machine."""

    processes: int
    threads: int
    descriptors: int
    shared_memory: int
    kernel_memory: int
    temporary_files: int
    outside_files: int
    resident_mib: int


def held(arena: Arena) -> Held:
    """Count everything, after what is no longer needed has been given back."""
    left = arena.processes_left()
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    status = Path("/proc/self/status").read_text(encoding="ascii")
    resident = next(line for line in status.splitlines() if line.startswith("VmRSS"))
    return Held(
        processes=len(left),
        threads=threading.active_count(),
        descriptors=len(list(Path("/proc/self/fd").iterdir())),
        shared_memory=sum(
            1 for path in Path("/dev/shm").iterdir() if "fastrtps" in path.name or arena.mark in path.name
        ),
        kernel_memory=len(Path("/proc/sysvipc/shm").read_text(encoding="ascii").splitlines()) - 1,
        temporary_files=sum(1 for _ in (arena.base / "tmp").rglob("*")),
        outside_files=sum(1 for _ in arena.outside.iterdir()),
        resident_mib=int(resident.split()[1]) // 1024,
    )


def submissions(arena: Arena, hostile: list[Attack]) -> Iterator[tuple[str, Path]]:
    """Yield right, faulty and hostile submissions in turn, without end, each with its kind."""
    faulty = [folder for folder in folders_in("broken") if (folder / f"{NODE}.py").is_file()]
    # Those that wait for their limit of real time take half a minute each; the attacks do that as well.
    faulty = [folder for folder in faulty if not folder.name.startswith(("waits_", "asks_"))]
    right = arena.folder("right")
    shutil.copy(REFERENCE, right / f"{NODE}.py")
    attacks, broken = itertools.cycle(hostile), itertools.cycle(faulty)
    while True:
        yield "right", right
        yield "faulty", next(broken)
        folder = arena.base / "students" / "hostile"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for path in (HERE / "kit").glob("*.py"):
            shutil.copy(path, folder)
        (folder / "planted.py").write_text(arena.planted(), encoding="utf-8")
        shutil.copy(next(attacks).path, folder / f"{NODE}.py")
        yield "hostile", folder


def run(arena: Arena, hostile: list[Attack], runs: int) -> tuple[list[Held], Counter[str]]:
    """Grade so many submissions and return what was held before, in the middle and after, and what they came to."""
    rubric = arena.base / "rubric.yaml"
    rubric.write_text(publisher_rubric([NODE]), encoding="utf-8")
    looks, came_to = [], Counter[str]()
    for number, (kind, folder) in enumerate(itertools.islice(submissions(arena, hostile), WARM_UP + runs + 1)):
        if number in (WARM_UP, WARM_UP + runs // 2, WARM_UP + runs):
            looks.append(held(arena))
        if number == WARM_UP + runs:
            break
        score = score_of(folder, rubric)
        if number >= WARM_UP:
            came_to[f"{kind}: {score}"] += 1
    return looks, came_to


def score_of(folder: Path, rubric: Path) -> str:
    """Grade once and return what it came to, in a word."""
    try:
        report = grade_once(GradeRequest(str(folder), rubrics=(rubric,), isolation=TIER), lambda _: None)
    except GraderError as error:
        print(error.message, file=sys.stderr, flush=True)
        return "refused"
    return "undecided" if not report.final else "full" if report.score == report.max_score else "less"


def main() -> int:
    """Print the table and return 1 if anything stayed."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    hostile = [attack for attack in read_attacks() if attack.kind == "node" and attack.earns != "never_on"]
    random.Random(4).shuffle(hostile)
    started = time.monotonic()
    with Arena(TIER) as arena:
        tempfile.tempdir = str(arena.base / "tmp")
        # What is remembered of self-tests is this run's own.
        os.environ["XDG_RUNTIME_DIR"] = str(arena.base / "runtime")
        looks, came_to = run(arena, hostile, runs)
    before, middle, after = looks
    print(f"{runs} runs under {TIER} in {time.monotonic() - started:.0f} s, after {WARM_UP} to warm up")
    print(", ".join(f"{what}: {count}" for what, count in sorted(came_to.items())))
    print(f"\n{'':<18}{'before':>8}{'half-way':>10}{'after':>8}")
    stayed = []
    for field, *counts in zip(fields(Held), astuple(before), astuple(middle), astuple(after), strict=True):
        slack = SLACK_MIB if field.name == "resident_mib" else 0
        more = counts[2] > counts[0] + slack
        stayed += [field.name] if more else []
        name = field.name.replace("_", " ").replace("mib", "MiB")
        print(f"{name:<18}{counts[0]:>8}{counts[1]:>10}{counts[2]:>8}{'  stayed' if more else ''}")
    wrong = sum(came_to[f"right: {what}"] for what in ("less", "undecided", "refused"))
    print(f"\nright submissions without full score: {wrong}")
    return 1 if stayed or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
