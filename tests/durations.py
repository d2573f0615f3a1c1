"""Says what tests cost, and shares the files of tests out among the machines of a CI run.

Usage: python tests/durations.py table RESULTS...    tables by folder, marker and file, and the dearest tests
       python tests/durations.py keep RESULTS...     writes what the files cost to tests/durations.json
       python tests/durations.py shard NUMBER OF     prints the files of one of so many shards

RESULTS are files that pytest wrote with `--junitxml`. Processor time is that of a test and of all the processes that it
started, with the fixtures that it was the first to ask for.
"""

from __future__ import annotations

import json
import sys
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

TESTS = Path(__file__).resolve().parent
KEPT = TESTS / "durations.json"
#: Processor seconds of a file of tests that nothing is known of: about the mean.
UNKNOWN_S = 5.0
#: Rows of each table.
LISTED = 30
#: A test that costs more needs a reason.
DEAR_S = 10.0


class Cost(NamedTuple):
    """What one test cost, in seconds."""

    file: str
    name: str
    markers: tuple[str, ...]
    processor_s: float
    real_s: float


def costs(results: Iterable[Path]) -> list[Cost]:
    """Return the costs of the tests in files of results, which `conftest.py` adds to them."""
    return [
        Cost(
            told["file"],
            case.get("name", ""),
            tuple(told["markers"].split()),
            float(told["processor_s"]),
            float(case.get("time", 0)),
        )
        for path in results
        for case in ET.parse(path).iter("testcase")
        for told in [{one.get("name", ""): one.get("value", "") for one in case.iter("property")}]
        if "processor_s" in told
    ]


def table(tests: list[Cost]) -> str:
    """Return tables of what tests cost: processor seconds, real seconds, tests, and what they have in common."""
    rows = [_row("all", tests)]
    for title, groups in (
        ("folder", lambda test: {"/".join(test.file.split("/")[1:-1][:2]) or "."}),
        ("marker", lambda test: test.markers),
        ("file", lambda test: {test.file}),
    ):
        names = defaultdict[str, float](float)
        for test in tests:
            for name in groups(test):
                names[name] += test.processor_s
        dearest = sorted(names, key=lambda name: -names[name])[:LISTED]
        rows += ["", title, *(_row(name, [test for test in tests if name in groups(test)]) for name in dearest)]
    dear = sorted((test for test in tests if test.processor_s > DEAR_S), key=lambda test: -test.processor_s)
    return "\n".join(
        [*rows, "", f"above {DEAR_S:g} s of a processor", *(_row(f"{t.file}::{t.name}", [t]) for t in dear)]
    )


def _row(name: str, tests: list[Cost]) -> str:
    processor, real = sum(test.processor_s for test in tests), sum(test.real_s for test in tests)
    return f"{processor:9.1f} {real:9.1f} {len(tests):6}  {name}"


def keep(tests: Iterable[Cost]) -> None:
    """Write the processor seconds of each file."""
    known = defaultdict[str, float](float)
    for test in tests:
        known[test.file] += test.processor_s
    rounded = {file: round(seconds, 1) for file, seconds in sorted(known.items())}
    KEPT.write_text(json.dumps(rounded, indent=1) + "\n", encoding="utf-8")


def shards(files: Iterable[str], known: Mapping[str, float], of: int) -> list[list[str]]:
    """Share files out, the dearest first, each to the shard that has least to do."""
    loads, found = [0.0] * of, [list[str]() for _ in range(of)]
    for file in sorted(files, key=lambda file: (-known.get(file, UNKNOWN_S), file)):
        least = loads.index(min(loads))
        loads[least] += known.get(file, UNKNOWN_S)
        found[least].append(file)
    return found


def files_of_tests() -> list[str]:
    """Return all files of tests, from the repository's root; folders that tests copy hold some, too."""
    paths = (path.relative_to(TESTS.parent) for path in TESTS.rglob("test_*.py"))
    return sorted(str(path) for path in paths if "workspace" not in path.parts)


def main(command: str, *arguments: str) -> None:
    """Do what the command line says."""
    if command == "shard":
        known = json.loads(KEPT.read_text(encoding="utf-8"))
        print(*shards(files_of_tests(), known, int(arguments[1]))[int(arguments[0]) - 1], sep="\n")
    elif command == "keep":
        keep(costs(map(Path, arguments)))
    else:
        print(table(costs(map(Path, arguments))))


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in ("table", "keep", "shard"):
        sys.exit(__doc__)
    main(*sys.argv[1:])
