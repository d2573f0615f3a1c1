"""Reads the project files and programs of a submission, as a process of its own that can do nothing else.

Usage: python -m grader.grading.submissions.submission_reader LIMITS < INPUT. What it reads was made by students, so the
process gives up all privileges, files and networks first; its memory, processor time and output are limited (LIMITS, as
for `confine`).

The input is the contents of all files behind each other, then a JSON object, then the length of that object in eight
bytes. The object has `sizes`, the lengths of the contents; `packages`, each an object of its `folder`, `files`, the
numbers of its project files by name, and `lists`, whether it needs the names of the files below its folder; `names`,
the number of the content with all names, each ended by a null byte; `programs`, each a path and a number; `likely`, the
paths of those that are probably run; and `decoded`, whether programs are texts in UTF-8, whatever they declare.

For each package it writes a line of JSON as soon as it is read, so that what ends the process costs nothing before it:
`project_reader` says what it has. For each program follows a line of JSON with `path`, `reaches`, names by which it
reaches into its process, `inert`, `error` and `problem`; then its text in UTF-8 and its syntax tree as JSON, of as many
bytes as `text` and `tree` in the line say, or nothing of either if it is `untold`.
"""

from __future__ import annotations

import gc
import json
import os
import posixpath
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, BinaryIO

from grader.runtime.contained import confine
from grader.runtime.model.limits import MAX_FILES

#: The trees of all programs that are examined, in nodes: more take seconds. A test submission has some hundreds, a
#: workspace of fifty real programs 60,000.
MOST_NODES = 200_000
#: The texts and trees that are told, in bytes: those of programs that are probably run, and of others, whose lines an
#: exception may name.
MOST_TOLD, MOST_BESIDE = 10 << 20, 1 << 20


def main(limits: dict[str, Any]) -> int:
    """Read the submission of standard input, and write what is found to standard output."""
    data = memoryview(sys.stdin.buffer.read())
    size = int.from_bytes(data[-8:], "big")
    asked = json.loads(bytes(data[-8 - size : -8]))
    contents = list(_slices(data, asked["sizes"]))
    known = None
    # Only what is asked for is imported, and all of it before the process confines itself.
    if asked["packages"]:
        from grader.grading.submissions import project_reader  # noqa: PLC0415

        project_reader.load_parsers()
    if asked["programs"]:
        from grader.grading.submissions import program_reader, source_encodings  # noqa: PLC0415

        heads = (bytes(contents[number][: source_encodings.HEAD_BYTES]) for _, number in asked["programs"])
        known = program_reader.load_encodings(heads)
    warnings.simplefilter("ignore")  # a warning would want to show the line of a file
    gc.disable()  # there are no cycles
    confine(limits)
    sys.meta_path.clear()  # so that what tries to import is told at once that it cannot
    run: set[str] = set()
    if asked["packages"]:
        names = [os.fsdecode(name) for name in bytes(contents[asked["names"]]).split(b"\0")[:-1]]
        for package in asked["packages"]:
            files = {name: bytes(contents[number]) for name, number in package["files"].items()}
            below = list(_below(package["folder"], names)) if package["lists"] else []
            found = project_reader.project_description(files, below)
            _write(sys.stdout.buffer, found)
            run.update(_run_by(found))
    if known is not None:
        likely = set(asked["likely"]) | {p for p, _ in asked["programs"] if posixpath.basename(p) in run}
        order = sorted(asked["programs"], key=lambda program: program[0] not in likely)
        for found, *told in _programs(order, contents, likely, known, decoded=asked["decoded"]):
            _write(sys.stdout.buffer, found, *told)
    return 0


def _slices(data: memoryview, sizes: Sequence[int]) -> Iterator[memoryview]:
    begin = 0
    for size in sizes:
        yield data[begin : begin + size]
        begin += size


def _write(out: BinaryIO, row: Mapping[str, Any], *told: bytes) -> None:
    out.write(json.dumps(row).encode() + b"\n" + b"".join(told))
    out.flush()


def _below(folder: str, names: Sequence[str]) -> Iterator[str]:
    """Return the names of the files below a folder, relative to it."""
    begin = f"{folder}/" if folder else ""
    return islice((name.removeprefix(begin) for name in names if name.startswith(begin)), MAX_FILES)


def _run_by(package: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of the files that the programs of a package are in."""
    yield from (f"{module.rpartition('.')[2]}.py" for _, module, _ in package["scripts"])
    yield from (posixpath.basename(file) for _, file, _ in package["programs"])


def _programs(
    programs: Sequence[tuple[str, int]],
    contents: Sequence[memoryview],
    likely: set[str],
    known: frozenset[str],
    *,
    decoded: bool,
) -> Iterator[tuple[dict[str, Any], bytes, bytes]]:
    """Yield what each program holds, with its text and tree as far as they are told."""
    from grader.grading.submissions.answers import COSTLY, LONG_FILE  # noqa: PLC0415 - see above
    from grader.grading.submissions.program_reader import program_description  # noqa: PLC0415

    nodes_left, left, beside = MOST_NODES, MOST_TOLD, MOST_BESIDE
    for path, number in programs:
        if nodes_left <= 0:
            yield {"path": path, "reaches": [LONG_FILE], "problem": COSTLY}, b"", b""
            continue
        found = program_description(bytes(contents[number]), known, decoded=decoded)
        nodes_left -= found.nodes
        row, parts = {"path": path, **found.row}, {"text": found.text, "tree": found.tree}
        size = sum(len(part) for part in parts.values() if part is not None)
        if size <= (left if path in likely else min(left, beside)):
            left -= size
            beside -= 0 if path in likely else size
            row |= {name: len(part) for name, part in parts.items() if part is not None}
            yield row, found.text or b"", found.tree or b""
        else:
            yield {**row, "untold": True}, b"", b""


if __name__ == "__main__":
    os._exit(main(json.loads(sys.argv[1])))
