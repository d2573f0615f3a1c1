"""Records the test submissions again, and writes what they are told. Run by hand; read what changed in golden.yaml.

Usage: python tests/recorded/record.py [PREFIX...]      grade them, or only folders such as wrong/joint, or exercise_3
       python tests/recorded/record.py --judge          judge what is recorded, after a change of judging or of texts
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent.parent / "support"))
from archive import SEED, Recorded, charted, judged, recorded_in, recorded_of, told, write_archive
from places import GRADE
from ruamel.yaml import YAML
from sample_folders import ARCHIVE, CHARTS, GOLDEN, collection_of, collections, expected, expected_in, table

from grader.grading.reporting.json_report import dumps


def graded(name: str, exercises: list[str]) -> Recorded:
    """Grade one submission and return what was recorded."""
    with tempfile.TemporaryDirectory() as kept:
        words = [GRADE, name, "--seed", str(SEED), "--no-progress", "-o", f"evidence={kept}"]
        chosen = [word for exercise in exercises for word in ("--exercise", exercise)]
        subprocess.run([*words, *chosen], cwd=collection_of(name), check=False, stdout=subprocess.DEVNULL)
        return recorded_in(Path(kept))


def recorded_again(names: Sequence[str]) -> dict[str, Recorded]:
    """Grade submissions, two at a time, and return what was recorded of each."""
    made = {}
    with ThreadPoolExecutor(2) as pool:
        futures = {pool.submit(graded, name, expected()[name]["graded"]): name for name in names}
        for number, future in enumerate(as_completed(futures), 1):
            made[futures[future]] = future.result()
            print(f"{number}/{len(names)} {futures[future]}", flush=True)
    return made


def keep(collection: Path, before: Mapping[str, Recorded], made: Mapping[str, Recorded]) -> None:
    """Write the archive of a collection if it changed, and the golden texts and charts."""
    made = {name: made[name] for name in expected_in(collection) if name in made}
    if made != before:
        write_archive(made, collection / ARCHIVE)
    reports = {name: judged(one) for name, one in made.items()}
    _write(collection / GOLDEN, {name: text for name, report in reports.items() if (text := told(report))})
    charts = collection / CHARTS
    if charts.exists():
        _write(charts, {name: charted(reports[name]) for name in table(charts) if name in reports})


def _write(path: Path, texts: Mapping[str, object]) -> None:
    yaml = YAML()
    yaml.width = 1000
    with path.open("w", encoding="utf-8") as out:
        yaml.dump(texts, out)


def main() -> None:
    """Record or judge, and write the archives and the golden texts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("prefixes", nargs="*", metavar="PREFIX")
    parser.add_argument("--judge", action="store_true")
    arguments = parser.parse_args()
    begin = tuple(arguments.prefixes) or ("",)
    wanted = [n for n in expected() if n.startswith(begin) or collection_of(n).name in arguments.prefixes]
    new = {} if arguments.judge else recorded_again(wanted)
    changed, count = [], 0
    for collection in collections():
        before = recorded_of(collection)
        made = {name: new.get(name, one) for name, one in before.items()}
        made |= {name: one for name, one in new.items() if collection_of(name) == collection}
        if arguments.judge:
            made = {name: replace(one, report=dumps(judged(one)).encode()) for name, one in made.items()}
        keep(collection, before, made)
        count += len(made)
        changed += [n for n, one in made.items() if n not in before or one.report != before[n].report]
    print(f"{count} recordings, {len(changed)} reports changed: {' '.join(changed[:20])}")


if __name__ == "__main__":
    main()
