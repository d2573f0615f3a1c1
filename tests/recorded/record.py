"""Records the test submissions again, and writes what they are told. Run by hand; read what changed in golden.yaml.

Usage: python tests/recorded/record.py [PREFIX...]      grade them, or only folders such as wrong/joint
       python tests/recorded/record.py --judge          judge what is recorded, after a change of judging or of texts
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

from archive import (
    ARCHIVE,
    CHARTED,
    SEED,
    SUBMISSIONS,
    Recorded,
    charted,
    expected,
    judged,
    read_archive,
    recorded_in,
    told,
    write_archive,
)
from ruamel.yaml import YAML

from grader.reporting.json_report import dumps

GOLDEN, CHARTS = SUBMISSIONS / "golden.yaml", SUBMISSIONS / "charts.yaml"
GRADE = str(Path(sys.executable).with_name("grade"))


def graded(folder: str, exercises: list[str]) -> Recorded:
    """Grade one folder and return what was recorded."""
    with tempfile.TemporaryDirectory() as kept:
        words = [GRADE, folder, "--seed", str(SEED), "--no-progress", "-o", f"evidence={kept}"]
        chosen = [word for exercise in exercises for word in ("--exercise", exercise)]
        subprocess.run([*words, *chosen], cwd=SUBMISSIONS, check=False, stdout=subprocess.DEVNULL)
        return recorded_in(Path(kept))


def main() -> None:
    """Record or judge, and write the archive and the golden texts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("prefixes", nargs="*", metavar="PREFIX")
    parser.add_argument("--judge", action="store_true")
    arguments = parser.parse_args()
    wanted = expected()
    before = read_archive() if ARCHIVE.exists() else {}
    if arguments.judge:
        made = {folder: replace(one, report=dumps(judged(one)).encode()) for folder, one in before.items()}
    else:
        folders = [folder for folder in wanted if folder.startswith(tuple(arguments.prefixes) or ("",))]
        made = {folder: one for folder, one in before.items() if folder in wanted}
        with ThreadPoolExecutor(2) as pool:
            futures = {pool.submit(graded, folder, wanted[folder]["graded"]): folder for folder in folders}
            for number, future in enumerate(as_completed(futures), 1):
                made[futures[future]] = future.result()
                print(f"{number}/{len(folders)} {futures[future]}", flush=True)
    write_archive({folder: made[folder] for folder in wanted if folder in made})
    texts = {folder: told(judged(made[folder])) for folder in wanted if folder in made}
    yaml = YAML()
    yaml.width = 1000
    with GOLDEN.open("w", encoding="utf-8") as out:
        yaml.dump({folder: text for folder, text in texts.items() if text}, out)
    with CHARTS.open("w", encoding="utf-8") as out:
        yaml.dump({folder: charted(judged(made[folder])) for folder in CHARTED if folder in made}, out)
    changed = [folder for folder, one in made.items() if folder not in before or one.report != before[folder].report]
    print(f"{len(made)} recordings, {len(changed)} reports changed: {' '.join(changed[:20])}")


if __name__ == "__main__":
    main()
