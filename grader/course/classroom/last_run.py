"""The options that a class was last graded with, kept in its results folder: leaving one out must not change a mark."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path

import msgspec

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError

#: The file in the results folder.
RUN = "run.json"
SCHEMA = "grader/batch-run/v1"


@dataclass(frozen=True, slots=True)
class LastRun:
    """How a class was last graded."""

    # Name of an option without dashes -> its values as they were typed, paths absolute; none for an option without one
    options: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    adjustments: str = ""  # absolute path of the file of decisions that was applied; empty for none
    decisions: int = 0  # how many it held
    sources: tuple[str, ...] = ()  # absolute paths of the folders and downloads that were graded
    schema: str = SCHEMA  # version of this format


def read_last_run(results: Path) -> LastRun:
    """Read how a class was last graded; empty if it never was. Raises ClassError if the file is damaged."""
    path = results / RUN
    try:
        data = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return LastRun()
    except OSError as error:
        raise ClassError(f"{path}: the options of the last run cannot be read: {error.strerror}") from None
    try:
        # A path need not be valid text: `json` keeps its bytes as lone surrogates, which msgspec's decoder rejects.
        last = msgspec.convert(json.loads(data), LastRun)
    except (msgspec.MsgspecError, RecursionError, ValueError) as error:
        raise _damaged(path, str(error)) from None
    if last.schema != SCHEMA:
        raise _damaged(path, f"schema {last.schema!r}")
    return last


def dump_last_run(last: LastRun) -> bytes:
    """Encode how a class was graded as JSON."""
    values = {
        "schema": last.schema,
        "options": {name: list(found) for name, found in last.options.items()},
        "adjustments": last.adjustments,
        "decisions": last.decisions,
        "sources": list(last.sources),
    }
    return json.dumps(values, indent=2).encode() + b"\n"


def _damaged(path: Path, found: str) -> ClassError:
    hint = "delete the file, and give all options again: --adjust, --roster, --rubric, --exercise and the others"
    return ClassError(f"{path}: expected the options of the last run, found a damaged file: {found}", hint)
