"""How many disguised copies `grade batch --similarity` lists, and how many pairs besides: recall and precision.

The test submissions that are right were written differently on purpose: they stand for people who worked
alone. Six of ten are handed in a second time, each disguised in one of several ways. One class for each exercise.

    python benchmarks/similarity.py [SEED]
"""

import random
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "tests" / "course" / "similarity")]

import copies  # noqa: E402  beside the tests
from sample_folders import folders_in  # noqa: E402  as above

from grader.course.similarity.finding import find_similar, read_compared, read_templates  # noqa: E402  as above
from grader.course.similarity.library import Handed  # noqa: E402  as above

CLASSES = ("velocity", "odom", "fan", "joint", "angle", "battery")
WAYS = tuple(copies.DISGUISES)


def people(prefix: str) -> list[Handed]:
    """Return a submission for each folder of right programs that begins with a word."""
    folders = folders_in("correct", "threads")
    return [Handed(f.name, f.name, *read_compared(f)) for f in folders if f.name.startswith(prefix)]


def disguised(one: Handed, way: str, seed: int) -> Handed | None:
    """Return a submission written differently; None if it cannot be parsed."""
    try:
        made = [replace(p, text=copies.DISGUISES[way](p.text, seed), digest=f"{p.digest} {way}") for p in one.programs]
    except (SyntaxError, ValueError):
        return None
    return replace(one, name=f"copy of {one.name}", programs=tuple(made))


def main() -> None:
    """Print what is found in each class, and the shares of all."""
    draw = random.Random(int(sys.argv[1]) if len(sys.argv) > 1 else 1)
    given = read_templates([ROOT / "student_template"])
    hits: Counter[str] = Counter()
    made: Counter[str] = Counter()
    besides: list[list[str]] = []
    began = time.process_time()
    for prefix in CLASSES:
        alone = people(prefix)
        ways = {}
        group = list(alone)
        for k, one in enumerate(draw.sample(alone, len(alone) * 6 // 10)):
            copy = disguised(one, WAYS[k % len(WAYS)], k)
            if copy is not None:
                ways[frozenset((one.name, copy.name))] = WAYS[k % len(WAYS)]
                group.append(copy)
        found = [frozenset((pair.left.name, pair.right.name)) for pair in find_similar(group, given).pairs]
        made.update(ways.values())
        hits.update(ways[pair] for pair in found if pair in ways)
        besides += [sorted(pair) for pair in found if pair not in ways]
    for way in WAYS:
        print(f"{way:20} {hits[way]:3} of {made[way]:3} copies listed")
    listed = hits.total()
    print(f"recall {listed / made.total():.3f}, precision {listed / (listed + len(besides)):.3f}")
    print(f"{time.process_time() - began:.1f} s of processor time; pairs listed besides:")
    for pair in besides:
        print("  ", *pair)


if __name__ == "__main__":
    main()
