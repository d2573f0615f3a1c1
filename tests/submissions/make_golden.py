"""Writes golden.yaml: what a student reads for every fault of the wrong and broken ones. Run by hand; read the changes.

Usage: python tests/submissions/make_golden.py [PREFIX...]     with prefixes such as wrong/joint, only these again
"""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ruamel.yaml import YAML

from grader.session import Request, grade

HERE = Path(__file__).resolve().parent
#: The seed of all texts, here and where they are compared: another key changes none of them.
SEED = 1
#: What these say depends on where a loop stood when it was stopped.
UNSTEADY = ("broken/loops_in_callback", "broken/loops_in_constructor", "broken/events_executor", "broken/memory_grows")


def told(report):
    """Return reason, hint and place of every criterion that lost points by a fault of its own."""
    return {
        verdict.id: {
            "reason": verdict.reason,
            "hint": verdict.hint,
            "at": f"{verdict.location.file}:{verdict.location.line}" if verdict.location else "",
        }
        for exercise in report.exercises
        for verdict in exercise.verdicts
        if verdict.outcome.value in ("not_met", "partly")
    }


def golden_of(folder, exercises):
    """Grade one folder; None if it needs the wall clock, whose figures differ from run to run."""
    report = grade(Request(str(HERE / folder), exercises=tuple(exercises), seed=SEED), lambda step: None)
    virtual = all(exercise.clock.value == "virtual" for exercise in report.exercises)
    return told(report) if virtual and report.final else None


def main():
    """Grade every wrong or broken submission and write what was told."""
    expected = YAML(typ="safe").load((HERE / "expected.yaml").read_text(encoding="utf-8"))
    faulty = [folder for folder in expected if folder.startswith(("wrong/", "broken/")) and folder not in UNSTEADY]
    folders = [folder for folder in faulty if folder.startswith(tuple(sys.argv[1:]) or ("",))]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda folder: golden_of(folder, expected[folder]["graded"]), folders))
    before = YAML(typ="safe").load((HERE / "golden.yaml").read_text(encoding="utf-8")) or {}
    made = {**before, **dict(zip(folders, found, strict=True))}
    golden = {folder: made[folder] for folder in faulty if made.get(folder) is not None}
    yaml = YAML()
    yaml.width = 1000
    with (HERE / "golden.yaml").open("w", encoding="utf-8") as out:
        yaml.dump(golden, out)
    print(f"{len(golden)} of {len(faulty)} folders")  # noqa: T201


if __name__ == "__main__":
    main()
