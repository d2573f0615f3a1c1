"""Measures how fast grading is, beside a plain start of a node, and prints one table; also beside another `grade`.

Usage: python benchmarks/speed.py [--runs N] [--against COMMAND] [--class] [--keep FILE [--warn FILE]]

Medians of N runs (5), in turn with those of the other command. --class adds classes of 100 and 300, which take minutes.
Another `grade` may have rubrics that observe for longer or shorter: virtual seconds are counted in its recordings. A
plain start is a Python process that imports rclpy, makes a node with one publisher, logs once and ends. Processor
time is that of all processes together. Run it on an idle machine; processor times and ratios say most.

--keep measures only one small run instead, and writes it to FILE as JSON: its processor time in plain starts, and its
instructions where `perf` can count them. --warn compares it with such a FILE, and warns of what grew by a fifth.
"""

from __future__ import annotations

import argparse
import functools
import json
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from class_of_100 import kinds, make_class
from counting import counted, counts
from rosbags.rosbag2 import Reader

from grader.runtime.model.quantities import NS_PER_S

ROOT = Path(__file__).resolve().parent.parent
GRADE = str(Path(sys.executable).with_name("grade"))
PLAIN_START = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
rclpy.init()
node = Node("plain")
node.create_publisher(String, "/plain", 10)
node.get_logger().info("started")
node.destroy_node()
rclpy.shutdown()
"""
EXERCISE_1 = ("reference_solutions", "--exercise", "velocity_publisher")
FIVE_SECONDS = ("--rubric", str(ROOT / "benchmarks" / "five_seconds.yaml"), "--clock", "wall")
#: Submissions that are judged from their text alone.
TEXTS = {"syntax error": "def main(:\n", "empty file": ""}
MS_PER_S = 1000
#: Exit codes of `grade`.
NOT_ALL_MET, UNDECIDED = 1, 3
#: Submissions that are judged again at a time.
COPIES = 200
#: A measure that grew by more than this factor is warned of.
GROWTH = 1.2
#: Names and units of figures, and a function that measures them of a `grade` command, all in one go.
Rows = tuple[Sequence[tuple[str, str]], Callable[[str], Sequence[float]]]


@dataclass(frozen=True)
class Cost:
    """What a command took: real time and processor time of all its processes, in seconds, and instructions."""

    wall_s: float
    processor_s: float
    instructions: int | None = None


def cost_of(*command: str, codes: Sequence[int] = (0,)) -> Cost:
    """Run a command in the folder of the project and return what it took; ends with its words at another exit code."""
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / "counts"
        started = time.perf_counter()
        done = subprocess.run(
            counted(command, written),
            check=False,
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        wall_s = time.perf_counter() - started
        if done.returncode not in codes:
            raise SystemExit(f"{shlex.join(command)} ended with {done.returncode}: {done.stderr}")
        found = counts(written)
    return Cost(wall_s, found.processor_s, found.instructions)


def graded(grade: str, *arguments: str, codes: Sequence[int] = (0,)) -> Cost:
    """Return what one run of a `grade` command took; ends with its words at another exit code."""
    return cost_of(*shlex.split(grade), *arguments, codes=codes)


def rejudged_a_second(grade: str) -> float:
    """Return how many submissions a command judges again in a second of processor time, its own start included."""
    with tempfile.TemporaryDirectory() as folder:
        first = Path(folder) / "first"
        graded(grade, "reference_solutions", "-o", f"evidence={first}")
        for number in range(COPIES):
            shutil.copytree(first, Path(folder) / "class" / str(number))
        return COPIES / graded(grade, "rejudge", str(Path(folder) / "class"), "--jobs", "1").processor_s


@functools.cache
def observed_s(grade: str) -> float:
    """Return how many virtual seconds the recordings of the reference solutions last, up to their last records."""
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder) / "evidence"
        graded(grade, "reference_solutions", "-o", f"evidence={kept}")
        return sum(duration_ns(recording.parent) for recording in kept.glob("*/metadata.yaml")) / NS_PER_S


def duration_ns(recording: Path) -> int:
    """Return how long a recording lasts, in nanoseconds."""
    with Reader(recording) as reader:
        return int(reader.duration)


def of_references(grade: str) -> Sequence[float]:
    """Return what the reference solutions cost.

    Processor time and real time, virtual seconds in a real one, and milliseconds of processor time for a virtual one.
    """
    virtual_s = observed_s(grade)
    cost = graded(grade, "reference_solutions")
    return cost.processor_s, cost.wall_s, virtual_s / cost.wall_s, MS_PER_S * cost.processor_s / virtual_s


def of_exercise_1(grade: str) -> Sequence[float]:
    """Return the real time of exercise 1, and how much longer its judgement on the wall clock takes."""
    wall_s = graded(grade, *EXERCISE_1).wall_s
    return wall_s, graded(grade, *EXERCISE_1, *FIVE_SECONDS, codes=(0, UNDECIDED)).wall_s / wall_s


def wall_of(*arguments: str, code: int = 0) -> Callable[[str], Sequence[float]]:
    """Return a function that measures the real time of a command with some arguments, which ends with an exit code."""
    return lambda grade: (graded(grade, *arguments, codes=(code,)).wall_s,)


def rows(place: Path, *, classes: bool) -> list[Rows]:
    """Return what is measured."""
    references = [("grade reference_solutions, processor", "s"), ("the same, real time", "s")]
    of_virtual = [("virtual in a real second", "s"), ("processor for a virtual second", "ms")]
    found: list[Rows] = [
        ([*references, *of_virtual], of_references),
        ([("exercise 1, real time", "s"), ("wall clock of 5 s / virtual time", "")], of_exercise_1),
    ]
    for what, text in TEXTS.items():
        folder = place / what
        folder.mkdir()
        (folder / "velocity_publisher.py").write_text(text)
        found.append(([(f"{what}, real time", "s")], wall_of(str(folder), *EXERCISE_1[1:], code=NOT_ALL_MET)))
    found += [
        ([("--help, real time", "s")], wall_of("--help")),
        ([("--version, real time", "s")], wall_of("--version")),
        ([("judged again in a second of processor", "")], lambda grade: (rejudged_a_second(grade),)),
    ]
    if classes:
        for size in (100, 300):
            make_class(place / str(size), list(kinds(size)))
        found += [
            (
                [("class of 100, processor of each", "s")],
                lambda grade: (class_of(grade, place, 100, 1).processor_s / 100,),
            ),
            ([("class of 300, 2 jobs, real time", "s")], lambda grade: (class_of(grade, place, 300, 2).wall_s,)),
        ]
    return found


def class_of(grade: str, place: Path, size: int, jobs: int) -> Cost:
    """Return what a class took; its results are thrown away."""
    with tempfile.TemporaryDirectory() as results:
        return graded(grade, "batch", str(place / str(size)), "-o", results, "--jobs", str(jobs), codes=(0, UNDECIDED))


def plain_start() -> Cost:
    """Return what a plain start took, on the ROS that the grader would use."""
    from grader.runtime.ros_installation import find_ros  # noqa: PLC0415  only the environment of this Python has it
    from grader.runtime.sandbox.environment import runtime_environment  # noqa: PLC0415

    runtime = find_ros().runtime
    with tempfile.TemporaryDirectory() as home:
        environment = {**runtime_environment(runtime), "HOME": home}
        variables = (f"{name}={value}" for name, value in environment.items())
        return cost_of("/usr/bin/env", "-i", *variables, str(runtime.executable), "-c", PLAIN_START)


def compare(runs: int, against: str, *, classes: bool) -> None:
    """Print the table."""
    commands = [GRADE, *([against] if against else [])]
    with tempfile.TemporaryDirectory() as folder:
        starts = [plain_start() for _ in range(runs)]
        start = Cost(statistics.median(s.wall_s for s in starts), statistics.median(s.processor_s for s in starts))
        print(f"plain start: {start.processor_s:.2f} s of processor time, {start.wall_s:.2f} s of real time")
        print(f"{'':38} {'here':>9} {'starts':>7}" + (f" {'other':>9} {'starts':>7} {'ratio':>6}" if against else ""))
        for figures, measure in rows(Path(folder), classes=classes):
            values: dict[str, list[Sequence[float]]] = {command: [] for command in commands}
            for _ in range(1 if figures[0][0].startswith("class") else runs):
                for command in commands:
                    values[command].append(measure(command))
            for number, (what, unit) in enumerate(figures):
                medians = [statistics.median(run[number] for run in values[command]) for command in commands]
                one = start.processor_s if "processor" in what else start.wall_s
                starts_of = [f"{m / one:7.1f}" if unit and "virtual" not in what else f"{'':7}" for m in medians]
                cells = [f"{m:9.2f} {s}" for m, s in zip(medians, starts_of, strict=True)]
                ratio = f" {medians[0] / medians[1]:6.2f}" if against else ""
                print(f"{f'{what}, {unit}' if unit else what:38} {' '.join(cells)}{ratio}", flush=True)


def small_run(runs: int) -> dict[str, float | None]:
    """Return the measures of a small run that are worth keeping; None for what cannot be counted here."""
    costs = [(graded(GRADE, *EXERCISE_1), plain_start()) for _ in range(runs)]
    ratios = [run.processor_s / start.processor_s for run, start in costs]
    return {"plain_starts": round(statistics.median(ratios), 3), "instructions": costs[-1][0].instructions}


def warnings(now: Mapping[str, float | None], before: Mapping[str, float | None]) -> Sequence[str]:
    """Return a sentence for each measure that has grown by more than a fifth."""
    both = ((what, now.get(what), before.get(what)) for what in now)
    return [
        f"{what} of a small run: {new:.6g}, and {old:.6g} before"
        for what, new, old in both
        if new and old and new > GROWTH * old
    ]


def main() -> None:
    """Print the table, or keep the small run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, metavar="N")
    parser.add_argument("--against", default="", metavar="COMMAND")
    parser.add_argument("--class", action="store_true", dest="classes")
    parser.add_argument("--keep", type=Path, metavar="FILE")
    parser.add_argument("--warn", type=Path, metavar="FILE")
    arguments = parser.parse_args()
    if arguments.keep is None:
        compare(arguments.runs, arguments.against, classes=arguments.classes)
        return
    now = small_run(arguments.runs)
    arguments.keep.write_text(json.dumps(now) + "\n", encoding="utf-8")
    print(json.dumps(now))
    if arguments.warn is not None:
        for warning in warnings(now, json.loads(arguments.warn.read_text(encoding="utf-8"))):
            print(f"::warning title=Grading got slower::{warning}")


if __name__ == "__main__":
    main()
