"""Judges the whole set of test submissions on each clock, with and without load, and prints where the outcomes differ.

Usage: python benchmarks/agreement.py RESULTS [--jobs N] [--parts N] [--only TEXT] [--isolation TIER] MODE...
       MODE is virtual, wall, auto, auto-load (two busy loops per core), or auto-checked (every submission is
       spot-checked, as a class is); RESULTS is a JSON file that is added to, so that a run that was stopped goes on.
       Without a MODE only the table of what RESULTS holds is printed. With --parts the submissions are shared out among
       so many processes, each with its own jobs: auto-checked mostly waits, about 10 s for a submission, so six parts
       keep two processors busy.

The reports, without their duration, are kept in the folder RESULTS.reports, by mode. The exit code is 1 if an outcome
of auto-checked differs. Whether recordings in virtual time are the same, event by event, `grade verify` tells.
"""

from __future__ import annotations

import argparse
import collections
import json
import multiprocessing
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).resolve().parent.parent / "tests" / "support"))
import sample_folders  # where the test submissions are

from grader.grading.app.grade import grade_in
from grader.grading.app.request import GradeRequest
from grader.grading.reporting.json_report import dumps
from grader.runtime.files import write_whole
from grader.runtime.model.errors import GraderError
from grader.runtime.session import RecordingSession, open_session

CHECKED = "auto-checked"
MODES = ("virtual", "wall", "auto", "auto-load", CHECKED)
#: Numbers in reasons, which differ from run to run.
NUMBERS = re.compile(r"\d+(\.\d+)?")
Results = dict[str, dict[str, Any]]


def burn() -> None:
    """Use a processor forever."""
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


def judged(
    session: RecordingSession, folder: str, exercises: tuple[str, ...], how: GradeRequest, reports: Path
) -> dict[str, Any]:
    """Keep the report of one folder, and return outcomes other than `met`, and why it went to the wall clock."""
    request = replace(how, submission=str(sample_folders.folder_of(folder)), exercises=exercises)
    try:
        report = grade_in(session, request, print_nothing)
    except GraderError as fault:
        return {"outcomes": {"error": fault.message}, "wall": []}
    kept = reports / f"{folder}.json"
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.write_text(dumps(replace(report, duration_s=0.0)), encoding="utf-8")
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
) -> None:
    """Grade every folder that has no result under a mode, and write each result when it is there."""
    left = [folder for folder in expected if folder not in results.setdefault(mode, {})]
    loops = 2 * multiprocessing.cpu_count() if mode.endswith("-load") else 0
    with (
        busy(loops),
        open_session(how.isolation, jobs) as session,
        ThreadPoolExecutor(jobs) as pool,
    ):
        futures = {
            pool.submit(judged, session, f, tuple(expected[f]["graded"]), how, reports_of(path, mode)): f for f in left
        }
        for number, future in enumerate(as_completed(futures), 1):
            results[mode][futures[future]] = future.result()
            write_whole(path, json.dumps(results, indent=1).encode())  # a run that is killed here loses nothing
            print(f"{mode} {number}/{len(left)} {futures[future]}", flush=True)


def reports_of(path: Path, mode: str) -> Path:
    """Return the folder with the reports of a mode."""
    return path.with_suffix(".reports") / mode


def table(expected: Mapping[str, Any], results: Results) -> None:
    """Print how many folders of each kind have the expected outcomes under each mode, and every one that has not."""
    print(f"{'mode':14} {'kind':10} {'folders':>8} {'as expected':>12} {'on the wall clock':>18}")
    for mode, found in results.items():
        counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
        for folder, result in found.items():
            kind = folder.split("/")[0]
            counts[kind]["folders"] += 1
            counts[kind]["same"] += result["outcomes"] == expected[folder]["expected"]
            counts[kind]["wall"] += bool(result["wall"])
        for kind, count in sorted(counts.items()):
            print(f"{mode:14} {kind:10} {count['folders']:8} {count['same']:12} {count['wall']:18}")
    for mode, found in results.items():
        reasons = collections.Counter(
            (folder.split("/")[0], NUMBERS.sub("N", reason))
            for folder, result in found.items()
            for reason in result["wall"]
        )
        for (kind, reason), times in sorted(reasons.items()):
            print(f"{mode}: {kind}: {times} on the wall clock: {reason}")
        for folder, result in sorted(found.items()):
            if result["outcomes"] != expected[folder]["expected"]:
                print(f"\n{mode}: {folder}\n  expected {expected[folder]['expected']}\n  found    {result['outcomes']}")
                for criterion, reason in result.get("reasons", {}).items():
                    print(f"    {criterion}: {reason}")


def in_parts(arguments: argparse.Namespace, results: Results) -> None:
    """Run the modes in several processes, each with a share of the submissions, and add what they found."""
    files = [arguments.results.with_suffix(f".part{number}.json") for number in range(arguments.parts)]
    options = ["--jobs", str(arguments.jobs), "--only", arguments.only, "--isolation", arguments.isolation]
    running = [
        subprocess.Popen(
            [sys.executable, __file__, str(file), *options, "--part", f"{number}/{len(files)}", *arguments.modes]
        )
        for number, file in enumerate(files)
    ]
    for process in running:
        process.wait()
    for number, file in enumerate(files):
        for mode, found in what_is_known(file)[1].items():
            results.setdefault(mode, {}).update(found)
            for report in reports_of(file, mode).rglob("*.json"):
                kept = reports_of(arguments.results, mode) / report.relative_to(reports_of(file, mode))
                kept.parent.mkdir(parents=True, exist_ok=True)
                report.replace(kept)
        if running[number].returncode not in (0, 1):
            raise SystemExit(f"part {number} ended with exit code {running[number].returncode}")
    write_whole(arguments.results, json.dumps(results, indent=1).encode())


def shared_out(folders: Mapping[str, Any], part: str) -> dict[str, Any]:
    """Return the share of the folders that a part such as `0/4` has."""
    number, parts = map(int, part.split("/"))
    return {folder: entry for at, (folder, entry) in enumerate(folders.items()) if at % parts == number}


def what_is_known(path: Path) -> tuple[dict[str, Any], Results]:
    """Return what every folder should be given, and the results so far."""
    return sample_folders.expected(), json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def main() -> int:
    """Run the modes asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("modes", nargs="*", metavar="MODE")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="")
    parser.add_argument("--isolation", default="auto")
    parser.add_argument("--parts", type=int, default=1)
    parser.add_argument("--part", default="0/1", help=argparse.SUPPRESS)
    arguments = parser.parse_intermixed_args()
    if unknown := set(arguments.modes) - set(MODES):
        parser.error(f"expected modes of {', '.join(MODES)}, found {', '.join(sorted(unknown))}")
    expected, results = what_is_known(arguments.results)
    chosen = {folder: entry for folder, entry in expected.items() if arguments.only in folder}
    chosen = shared_out(chosen, arguments.part)
    if arguments.parts > 1:
        in_parts(arguments, results)
    for mode in arguments.modes if arguments.parts == 1 else ():
        checks = 1.0 if mode == CHECKED else 0.0
        how = GradeRequest("", clock=mode.partition("-")[0], isolation=arguments.isolation, spot_checks=checks)
        run(mode, how, chosen, results, arguments.results, jobs=arguments.jobs)
    if arguments.part == "0/1":
        table(expected, results)
    wrong = [f for f, r in results.get(CHECKED, {}).items() if r["outcomes"] != expected[f]["expected"]]
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
