"""Writes what the notes on a self-test do not explain yet into them, for the author to fill in."""

from __future__ import annotations

import glob
import json
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from grader.course.mutation.explained import SCHEMA
from grader.course.mutation.results import SelftestResult, Trial
from grader.grading.model.rubric_files import notes_on
from grader.runtime.model.errors import GraderError
from grader.runtime.model.wording import printable

#: Most lines of a change that stand above an entry.
_MOST_LINES = 8
_KEY = re.compile(r"^(\w+):[ \t]*(.*?)[ \t]*$")


def noted(
    result: SelftestResult, text: str | None, *, reference: Path | None, template: Path | None
) -> tuple[str, int]:
    """Return the text of the notes with an entry for all that they do not explain, and the number of new entries.

    Args:
        result: The result of the self-test.
        text: The notes as they are; None if there are none.
        reference: Folder of the reference solution, which new notes name.
        template: Folder of the template, which new notes name.

    Raises:
        GraderError: A list of the notes is written in one line, so that nothing can be added to it.
    """
    path = notes_on(Path(result.rubric))
    if text is None:
        text = "\n".join(_head(path.parent, reference, template)) + "\n"
    entries = {
        "survivors": list(_of_trials(result.survivors, "mutants")),
        "variants": list(_of_trials(result.marked_down, "variants")),
        "criteria": [[f"- criterion: {id_}"] for id_ in result.never_turned],
    }
    for key, found in entries.items():
        if found:
            text = _added(text, key, found, path)
    return text, sum(map(len, entries.values()))


def _head(folder: Path, reference: Path | None, template: Path | None) -> Iterator[str]:
    yield f"schema: {SCHEMA}"
    for key, named in (("reference", reference), ("template", template)):
        if named is not None:
            yield f"{key}: {_scalar(os.path.relpath(str(named), str(folder)))}"


def _of_trials(trials: Sequence[Trial], key: str) -> Iterator[list[str]]:
    """Yield the lines of an entry for each pattern, the change above it, without `because:`."""
    seen: set[str] = set()
    for trial in trials:
        pattern = trial_pattern(trial)
        if pattern in seen:
            continue
        seen.add(pattern)
        lines = trial.diff.splitlines()
        more = [f"# ... {len(lines) - _MOST_LINES} more lines"] if len(lines) > _MOST_LINES else []
        yield [*(f"# {printable(line, 110)}" for line in lines[:_MOST_LINES]), *more, f"- {key}: {_scalar(pattern)}"]


def trial_pattern(trial: Trial) -> str:
    """Return a pattern that fits a trial at any line, so that it still fits after a change of the reference."""
    file, rest = glob.escape(trial.file), glob.escape(trial.id.removeprefix(f"{trial.file}:"))
    return f"{file}:{re.sub(r'^[0-9]+:', '*:', rest)}"


def _scalar(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _added(text: str, key: str, entries: Sequence[Sequence[str]], path: Path) -> str:
    """Return the text with entries at the end of the list under a key, which is added if it is not there."""
    lines = text.splitlines()
    tops = [(n, found) for n, line in enumerate(lines) if (found := _KEY.match(line))]
    here = next((place for place, (_, found) in enumerate(tops) if found[1] == key), None)
    if here is None:
        return "\n".join([*lines, "", f"{key}:", *_indented(entries, "  ")]) + "\n"
    start, found = tops[here]
    value = found[2].partition(" #")[0].strip()
    if value not in ("", "[]"):
        place = f"{printable(str(path), 500)}:{start + 1}"
        raise GraderError(f"{place}: expected a line for each entry under `{key}`, found `{printable(value, 60)}`")
    lines[start] = f"{key}:"
    stop = tops[here + 1][0] if here + 1 < len(tops) else len(lines)
    while stop > start + 1 and (not lines[stop - 1].strip() or lines[stop - 1].startswith("#")):
        stop -= 1  # blank lines and comments in front of the next key belong to it
    indent = next((line[: line.index("-")] for line in lines[start + 1 : stop] if line.lstrip().startswith("-")), "  ")
    return "\n".join([*lines[:stop], *_indented(entries, indent), *lines[stop:]]) + "\n"


def _indented(entries: Sequence[Sequence[str]], indent: str) -> Iterator[str]:
    for entry in entries:
        yield from (f"{indent}{line}" for line in entry)
        yield f"{indent}  because:"
