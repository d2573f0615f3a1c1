"""Gives files of submissions the names that an instructor decided on, in copies."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from grader.course.classroom.adjustments import Decision
from grader.course.classroom.intake import HandedInEntry
from grader.grading.rubrics.mistakes import nearest_hint
from grader.grading.submissions.collected import Collected
from grader.grading.submissions.submission import every_file, write_files
from grader.runtime.model.errors import ClassError, SubmissionError
from grader.runtime.model.wording import first_of, printable

_RENAMED = "renamed"


def with_renamed_files(
    entries: Sequence[HandedInEntry], decisions: Mapping[str, Decision], unpacked: Path, wanted: Sequence[str]
) -> tuple[HandedInEntry, ...]:
    """Return the entries, those of which files are renamed with the copy that is graded, in the folder `unpacked`.

    Decisions are given by the name of the entry, and `wanted` are the files that exercises ask for. Raises ClassError
    for a file that is not in the submission, and for a name that another file has; HarnessError if a copy cannot be
    written.
    """
    shutil.rmtree(unpacked / _RENAMED, ignore_errors=True)
    return tuple(
        _renamed(entry, decisions[entry.name], unpacked / _RENAMED / entry.name, wanted)
        if entry.name in decisions and decisions[entry.name].rename and not entry.problem
        else entry
        for entry in entries
    )


def _renamed(entry: HandedInEntry, decision: Decision, into: Path, wanted: Sequence[str]) -> HandedInEntry:
    try:
        with tempfile.TemporaryDirectory() as scratch:
            collected = every_file(str(entry.path), Path(scratch), wanted)
    except SubmissionError:
        return entry  # grading refuses it, and says why
    files = list(_with_new_names(collected, decision, entry.name))
    into.mkdir(parents=True)
    write_files(Collected(tuple(files), collected.notes), into)
    return replace(entry, path=into)


def _with_new_names(collected: Collected, decision: Decision, name: str) -> Iterator[tuple[str, bytes]]:
    names = [path for path, _ in collected.files]
    new_names = {}
    for old, new in decision.rename.items():
        found = [path for path in names if old in (path, PurePosixPath(path).name)]
        where = f"{decision.where}: {printable(name, 80)}"
        if not found:
            hint = nearest_hint(old, [PurePosixPath(path).name for path in names])
            raise ClassError(f"{where}: expected the file `{printable(old)}` to rename, found {first_of(names)}", hint)
        if len(found) > 1:
            hint = f"write one of the paths: {first_of(found)}"
            raise ClassError(f"{where}: expected one file `{printable(old)}` to rename, found {len(found)}", hint)
        new_names[found[0]] = str(PurePosixPath(found[0]).with_name(new))
    for path, content in collected.files:
        target = new_names.get(path, path)
        if target != path and target in names and target not in new_names:
            text = f"expected a new name for `{printable(path)}`, found that there is a file `{printable(target)}`"
            raise ClassError(f"{decision.where}: {printable(name, 80)}: {text}")
        yield target, content
