"""Runs tests many times, some of them on a busy machine, and counts how often each failed.

Usage: python tests/repeat.py [--times 20] [--busy 6] [--cores 2] [TEST...] [OPTION OF PYTEST...]

Each run is a process of pytest of its own, on the first processors only. The last runs share these with two endless
loops for each processor. The table names each file with the number of its tests, and each test that failed or was
skipped in some run; below it stands the first failure of each test. Ctrl-C ends the run that is under way, which then
does not count, and prints the table. Exit codes: 0 if no test ever failed, 1 if one did, 2 if pytest could not run.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: As many endless loops for each processor share it with the tests: a test then gets a third of it.
LOOPS = 2
#: Ends with the process that started it, whatever happens to that.
LOOP = "import os\nparent = os.getppid()\nwhile os.getppid() == parent:\n    for _ in range(1_000_000): pass"
#: pytest's exit codes for runs in which all tests passed, and in which some failed.
RAN = (0, 1)


@dataclass
class Counts:
    """What became of one test."""

    runs: Counter[bool] = field(default_factory=Counter)  # by whether the machine was busy
    failed: Counter[bool] = field(default_factory=Counter)
    skipped: Counter[bool] = field(default_factory=Counter)
    failure: str = ""  # the first one


def main() -> int:
    """Run what is asked for, print the table, and return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False
    )
    parser.add_argument("--times", type=int, default=20, help="runs in all (default: %(default)s)")
    parser.add_argument("--busy", type=int, default=6, help="how many of them on a busy machine (default: %(default)s)")
    parser.add_argument("--cores", type=int, default=2, help="processors to use (default: %(default)s)")
    asked, options = parser.parse_known_args()
    if not 0 <= asked.busy <= asked.times or asked.times < 1:
        parser.error(f"expected 0 <= --busy <= --times, found {asked.busy} and {asked.times}")
    cores = sorted(os.sched_getaffinity(0))[: max(1, asked.cores)]
    os.sched_setaffinity(0, cores)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    tests: defaultdict[str, Counts] = defaultdict(Counts)
    with contextlib.suppress(KeyboardInterrupt):
        for number in range(asked.times):
            busy = number >= asked.times - asked.busy
            with loops(cores) if busy else contextlib.nullcontext():
                results = run(options)
            if isinstance(results, str):
                print(results)
                return 2
            failed = count(results, busy, tests)
            print(f"run {number + 1} of {asked.times}{', busy' * busy}:", *failed or ["-"], file=sys.stderr, flush=True)
    print_table(tests)
    return 1 if any(counts.failure for counts in tests.values()) else 0


@contextlib.contextmanager
def loops(cores: Collection[int]) -> Iterator[None]:
    """Keep each processor busy meanwhile."""
    started = [subprocess.Popen([sys.executable, "-I", "-S", "-c", LOOP]) for _ in range(LOOPS * len(cores))]
    try:
        for number, process in enumerate(started):
            os.sched_setaffinity(process.pid, [sorted(cores)[number % len(cores)]])
        yield
    finally:
        for process in started:
            process.kill()
            process.wait()


def run(options: Sequence[str]) -> list[ET.Element] | str:
    """Run the tests once and return their results, or what pytest printed if it could not run."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder, "results.xml")
        # Only the older family names the file of a test.
        command = [sys.executable, "-m", "pytest", f"--junitxml={results}", "-o", "junit_family=xunit1", *options]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        if done.returncode not in RAN or not results.exists():
            return done.stdout.decode(errors="replace")
        return list(ET.parse(results).getroot().iter("testcase"))


def count(cases: Sequence[ET.Element], busy: bool, tests: defaultdict[str, Counts]) -> list[str]:
    """Add the results of a run to the counts, and return the tests that failed."""
    # A test that fails, and whose clean-up fails as well, stands there twice.
    outcomes: defaultdict[str, list[ET.Element]] = defaultdict(list)
    for case in cases:
        file = case.get("file", "")
        group = case.get("classname", "").removeprefix(file.removesuffix(".py").replace("/", ".")).strip(".")
        outcomes["::".join(filter(None, (file, group, case.get("name"))))] += list(case)
    for name, parts in outcomes.items():
        counts = tests[name]
        counts.runs[busy] += 1
        failures = [part.text or part.get("message") or part.tag for part in parts if part.tag in ("failure", "error")]
        counts.failed[busy] += bool(failures)
        counts.skipped[busy] += any(part.tag == "skipped" for part in parts)
        counts.failure = counts.failure or "\n".join(failures)
    return [name for name, parts in outcomes.items() if any(part.tag in ("failure", "error") for part in parts)]


def print_table(tests: Mapping[str, Counts]) -> None:
    """Print the files, the tests that failed or were skipped, and the first failure of each."""
    files = defaultdict(list)
    for name, counts in tests.items():
        files[name.split("::")[0]].append(counts)
    rows = [(f"{file} ({len(kept)})", kept) for file, kept in sorted(files.items())]
    rows += [(name, [c]) for name, c in sorted(tests.items()) if c.failed.total() or c.skipped.total()]
    width = max(len(name) for name, _ in rows) if rows else 0
    print(f"{'tests':<{width}}{'runs':>7}{'failed':>8}{'skipped':>9}{'busy runs':>11}{'failed':>8}{'skipped':>9}")
    for name, kept in rows:
        line = f"{name:<{width}}"
        for busy, first in ((False, 7), (True, 11)):
            line += f"{max(c.runs[busy] for c in kept):>{first}}{sum(c.failed[busy] for c in kept):>8}"
            line += f"{sum(c.skipped[busy] for c in kept):>9}"
        print(line)
    for name, counts in sorted(tests.items()):
        if counts.failure:
            print(f"\n{name}\n{counts.failure}")


if __name__ == "__main__":
    sys.exit(main())
