"""Grades the whole set of test submissions under several seeds, and prints every outcome that is not the expected one.

Usage: python benchmarks/seeds.py RESULTS [--jobs N] [--only TEXT]... [--exercise ID]... SEED...
       A SEED is a number, or a range such as 1-20. RESULTS is a JSON file that is added to, so that a run that was
       stopped goes on. Without a SEED only the table of what RESULTS holds is printed. --only takes part of the name of
       a folder; repeated, any of them counts.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from agreement import run, table, what_is_known

from grader.grading.app.request import GradeRequest


def seeds_in(text: str) -> range:
    """Return the seeds that a word names: one, or all of a range."""
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def main() -> None:
    """Run the seeds asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path)
    parser.add_argument("seeds", nargs="*", metavar="SEED", type=seeds_in)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--exercise", action="append", default=[])
    arguments = parser.parse_intermixed_args()
    expected, results = what_is_known(arguments.results)
    chosen = {
        folder: entry
        for folder, entry in expected.items()
        if any(text in folder for text in arguments.only or [""])
        and (not arguments.exercise or set(entry["graded"]) & set(arguments.exercise))
    }
    for seed in (seed for seeds in arguments.seeds for seed in seeds):
        run(f"seed-{seed}", GradeRequest("", seed=seed), chosen, results, arguments.results, jobs=arguments.jobs)
    table(expected, results)


if __name__ == "__main__":
    main()
