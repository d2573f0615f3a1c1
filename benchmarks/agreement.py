"""Judges the whole set of test submissions on each clock, with and without load, and prints where the outcomes differ.

Usage: python benchmarks/agreement.py RESULTS [--jobs N] [--only TEXT] MODE...
       MODE is virtual, wall, auto or auto-load (two busy loops per core); RESULTS is a JSON file that is added to, so
       that a run that was stopped goes on. Without a MODE only the table of what RESULTS holds is printed.
"""

from __future__ import annotations

import argparse
import collections
import json
import multiprocessing
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from grader.app.grade import grade_in
from grader.app.request import GradeRequest
from grader.core.errors import GraderError
from grader.execution.recording_session import RecordingSession, open_session
from grader.reporting.delivery import write_whole

SUBMISSIONS = Path(__file__).resolve().parent.parent / "tests" / "submissions"
MODES = ("virtual", "wall", "auto", "auto-load")
Results = dict[str, dict[str, Any]]


def burn() -> None:
    """Use a processor for ever."""
    while True:
        pass


@contextmanager
def busy(loops: int) -> Iterator[None]:
    """Keep so many processes in busy loops."""
    processes = [multiprocessing.Process(target=burn, daemon=True) for _ in range(loops)]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.kill()


def print_nothing(step: str) -> None:
    """Hear which step begins, and say nothing."""


def judged(session: RecordingSession, folder: str, exercises: tuple[str, ...], how: GradeRequest) -> dict[str, Any]:
    """Return what one folder was given: outcomes other than `met`, and why it went to the wall clock."""
    request = replace(how, submission=str(SUBMISSIONS / folder), exercises=exercises)
    try:
        report = grade_in(session, request, print_nothing)
    except GraderError as fault:
        return {"outcomes": {"error": fault.message}, "wall": []}
    verdicts = [verdict for exercise in report.exercises for verdict in exercise.verdicts]
    return {
        "outcomes": {v.id: v.outcome.value for v in verdicts if v.outcome.value != "met"},
        "reasons": {v.id: v.reason for v in verdicts if v.outcome.value != "met"},
        "wall": [exercise.clock_reason for exercise in report.exercises if exercise.clock.value == "wall"],
    }


def run(  # noqa: PLR0913  one parameter a choice
    mode: str,
    how: GradeRequest,
    expected: Mapping[str, Any],
    results: Results,
    path: Path,
    *,
    jobs: int,
    load: bool = False,
) -> None:
    """Grade every folder that has no result under a mode, and write each result when it is there."""
    left = [folder for folder in expected if folder not in results.setdefault(mode, {})]
    loops = 2 * multiprocessing.cpu_count() if load else 0
    with busy(loops), open_session(how.isolation, jobs) as session, ThreadPoolExecutor(jobs) as pool:
        futures = {pool.submit(judged, session, f, tuple(expected[f]["graded"]), how): f for f in left}
        for number, future in enumerate(as_completed(futures), 1):
            results[mode][futures[future]] = future.result()
            write_whole(path, json.dumps(results, indent=1).encode())  # a run that is killed here loses nothing
            print(f"{mode} {number}/{len(left)} {futures[future]}", flush=True)


def table(expected: Mapping[str, Any], results: Results) -> None:
    """Print how many folders of each kind have the expected outcomes under each mode, and every one that has not."""
    print(f"{'mode':10} {'kind':10} {'folders':>8} {'as expected':>12} {'on the wall clock':>18}")
    for mode, found in results.items():
        counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
        for folder, result in found.items():
            kind = folder.split("/")[0]
            counts[kind]["folders"] += 1
            counts[kind]["same"] += result["outcomes"] == expected[folder]["expected"]
            counts[kind]["wall"] += bool(result["wall"])
        for kind, count in sorted(counts.items()):
            print(f"{mode:10} {kind:10} {count['folders']:8} {count['same']:12} {count['wall']:18}")
    for mode, found in results.items():
        for folder, result in sorted(found.items()):
            if result["outcomes"] != expected[folder]["expected"]:
                print(f"\n{mode}: {folder}\n  expected {expected[folder]['expected']}\n  found    {result['outcomes']}")
                for criterion, reason in result.get("reasons", {}).items():
                    print(f"    {criterion}: {reason}")


def what_is_known(path: Path) -> tuple[dict[str, Any], Results]:
    """Return what every folder should be given, and the results so far."""
    expected = YAML(typ="safe").load((SUBMISSIONS / "expected.yaml").read_text(encoding="utf-8"))
    return expected, json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def main() -> None:
    """Run the modes asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("modes", nargs="*", metavar="MODE")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="")
    arguments = parser.parse_intermixed_args()
    if unknown := set(arguments.modes) - set(MODES):
        parser.error(f"expected modes of {', '.join(MODES)}, found {', '.join(sorted(unknown))}")
    expected, results = what_is_known(arguments.results)
    chosen = {folder: entry for folder, entry in expected.items() if arguments.only in folder}
    for mode in arguments.modes:
        clock, _, load = mode.partition("-")
        how = GradeRequest("", clock=clock)
        run(mode, how, chosen, results, arguments.results, jobs=arguments.jobs, load=bool(load))
    table(expected, results)


if __name__ == "__main__":
    main()
